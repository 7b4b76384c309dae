"""Roles of joints in the naming schemes in use."""

from __future__ import annotations

import pytest
from role_schemes import SCHEMES, Scheme

from retarget_bench.motion.role_aliases import read
from retarget_bench.motion.role_finding import find


@pytest.mark.parametrize("scheme", SCHEMES)
def test_a_scheme_is_understood(scheme: str) -> None:
    skeleton, expected = SCHEMES[scheme].body()
    assert dict(zip(skeleton.names, find(skeleton), strict=True)) == expected


def test_twist_bones_are_told_from_the_limb_by_their_places() -> None:
    """Of joints without a meaning inside a limb, the one that divides it most evenly is the knee."""
    scheme = Scheme("Hips|Spine", "Head", "Arm.#|(A1.#)|A2.#|(A3.#)|Hand.#", "Thigh.#|(L1.#)|L2.#|Foot.#")
    skeleton, expected = scheme.body()
    assert dict(zip(skeleton.names, find(skeleton), strict=True)) == expected


def test_a_head_without_a_name_is_the_end_of_the_line_above_the_arms() -> None:
    skeleton, expected = Scheme(
        "Hips|B1|B2", "B3|B4|B5", "Arm.#|Elbow.#|Hand.#", "Thigh.#|Knee.#|Foot.#"
    ).body()
    assert dict(zip(skeleton.names, find(skeleton), strict=True)) == expected


def test_a_neck_alone_is_no_head() -> None:
    skeleton, _ = Scheme("Hips|Spine", "Neck", "Arm.#|Elbow.#|Hand.#", "Thigh.#|Knee.#|Foot.#").body()
    assert "head" not in find(skeleton)


def test_words_of_the_body_are_no_prefix() -> None:
    """A hand's joints all begin with its name."""
    names = ("LeftHand", *(f"LeftHand{finger}{k}" for finger in ("Thumb", "Index") for k in (1, 2)))
    assert [each.stem for each in read(names)] == ["hand", *("handthumb",) * 2, *("handindex",) * 2]
    assert {each.side for each in read(names)} == {"left"}


@pytest.mark.parametrize(("front", "hind"), [("Front", "Back"), ("front_", "hind_"), ("Fore", "Rear")])
def test_fore_and_hind_legs(front: str, hind: str) -> None:
    parts = "{0}UpLeg_#|{0}Leg_#|{0}Foot_#"
    skeleton, expected = Scheme("Pelvis|Spine", "Neck|Head", parts.format(front), parts.format(hind)).body()
    assert dict(zip(skeleton.names, find(skeleton), strict=True)) == expected


def test_serial_numbers_behind_all_names_are_no_numbers_of_fingers() -> None:
    names = [
        f"{name}{k}" for name in ("LeftHandThumb", "LeftHandIndex", "RightHandThumb") for k in (1, 2, 3)
    ]
    names += ["Hips", "Spine", "Neck", "Head", "LeftArm", "RightArm", "LeftLeg", "RightLeg"]
    serial = tuple(f"{name}_{number:02}" for number, name in enumerate(names))
    assert read(serial) == read(tuple(names))
    assert read(serial)[2].numbers == (3,)
