"""Roles of bodies whose names say nothing, by the tree and the places of joints."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from editing_bodies import Bones, body, fingers, gait, twists
from role_schemes import SCHEMES

from retarget_bench.motion import bvh, rotation
from retarget_bench.motion.character import Motion
from retarget_bench.motion.importer import load
from retarget_bench.motion.role_structure import completed, guess
from retarget_bench.motion.roles import ESSENTIAL
from retarget_bench.motion.skeleton import Skeleton

MAIN = (
    *ESSENTIAL,
    *(f"{side}_{part}" for side in ("left", "right") for part in ("shoulder", "toe")),
    "spine_1",
)
"""Joints that are looked for."""


def shuffled(skeleton: Skeleton, seed: int) -> tuple[Skeleton, list[int]]:
    """The skeleton with joints in another order and names that say nothing, and where each joint went."""
    random = np.random.default_rng(seed)
    order, left = [0], list(skeleton.children[0])
    while left:
        joint = left.pop(int(random.integers(len(left))))
        order.append(joint)
        left += skeleton.children[joint]
    place = {joint: index for index, joint in enumerate(order)}
    parents = np.array([-1, *(place[int(skeleton.parents[joint])] for joint in order[1:])])
    names = tuple(f"zx{number:03}" for number in random.permutation(len(order)))
    return Skeleton(names, parents, skeleton.offsets[order]), [place[joint] for joint in range(len(order))]


def nonsense(motion: Motion, seed: int) -> tuple[Motion, dict[str, int]]:
    """A motion under such names; and its roles."""
    skeleton, place = shuffled(motion.skeleton, seed)
    roles = {role: place[joint] for role, joint in motion.character.joint_of.items()}
    by_joint = {joint: role for role, joint in roles.items()}
    character = replace(
        motion.character,
        skeleton=skeleton,
        roles=tuple(by_joint.get(joint) for joint in range(len(skeleton))),
        reference_pose=motion.character.reference_pose[np.argsort(place)],
    )
    return character.motion(motion.rotations[:, np.argsort(place)], motion.root, motion.fps), roles


EXTRA: dict[str, Bones] = {
    "plain": {},
    "twists beside bones": twists(0.5),
    "fingers and chained twists": {**fingers(), **twists(0.33, 0.66, chained=True)},
}


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("extra", EXTRA)
def test_a_walk_under_names_that_say_nothing(tmp_path: Path, seed: int, extra: str) -> None:
    motion, roles = nonsense(gait(body(EXTRA[extra]), 60), seed)
    path = tmp_path / "walk.bvh"
    bvh.write(path, motion, scale=100.0)
    imported = load(path)
    joint_of = imported.motion.character.joint_of
    names, read = motion.skeleton.names, imported.motion.skeleton.names
    assert {role: read[joint_of[role]] for role in ESSENTIAL} == {r: names[roles[r]] for r in ESSENTIAL}
    assert any("are a guess by the tree" in doubt for doubt in imported.findings.doubts)
    settled = load(path, replace(imported.settled))
    assert not any("are a guess" in doubt for doubt in settled.findings.doubts)


def right(guessed: Mapping[str, int], roles: Mapping[str, int]) -> tuple[int, int]:
    """How many of the main joints that a body has are guessed, and how many there are."""
    main = [role for role in MAIN if role in roles]
    return sum(guessed.get(role) == roles[role] for role in main), len(main)


def exchanged(guessed: Mapping[str, int], roles: Mapping[str, int]) -> bool:
    return any(guessed.get(f"left_{part}") == roles.get(f"right_{part}", -1) for part in ("arm", "up_leg"))


METATARSALS = ("DAZ Genesis 8", "DAZ Genesis 9", "Meta XR")
"""Schemes with a joint between foot and toe, which is taken for the toe."""
TOES = {f"{side}_{part}" for side in ("left", "right") for part in ("toe", "toe_end")}


@pytest.mark.parametrize("scheme", SCHEMES)
def test_bodies_at_rest(scheme: str) -> None:
    """Also with joints inside the bones of limbs, without toes, collar bones or spine."""
    skeleton, expected = SCHEMES[scheme].body()
    joint_of = {role: joint for joint, role in enumerate(expected.values()) if role is not None}
    for seed in range(3):
        other, place = shuffled(skeleton, seed)
        found = guess(other, other.rest_positions[None])
        assert found is not None
        expected_at = {role: place[joint] for role, joint in joint_of.items()}
        wrong = {role for role, joint in found.joint_of.items() if expected_at.get(role) != joint}
        assert wrong <= (TOES if scheme in METATARSALS else set())
        assert found.joint_of.keys() >= set(ESSENTIAL)


def test_where_no_fold_tells_left_from_right_that_is_said() -> None:
    """Then the left is taken to be along +X; feet that point forwards tell it, however it is turned."""
    about = rotation.about(np.array([0.0, 1.0, 0.0]), np.pi)
    for scheme, clear in (("H36M", False), ("LAFAN1", True)):
        skeleton, expected = SCHEMES[scheme].body()
        roles = {role: joint for joint, role in enumerate(expected.values()) if role is not None}
        front = guess(skeleton, skeleton.rest_positions[None])
        back = guess(skeleton, rotation.rotate(about[None], skeleton.rest_positions)[None])
        assert front is not None
        assert back is not None
        assert not exchanged(front.joint_of, roles)
        assert exchanged(back.joint_of, roles) is not clear
        assert ("perhaps exchanged" in front.confidence) is not clear
        assert (back.exchanged == front.joint_of) is not clear


PROP = (("Grip", "{}Hand", 0.5), ("Blade", "Grip", 0.9))


@pytest.mark.parametrize("side", ["Left", "Right"])
def test_what_one_hand_holds_is_no_part_of_the_arm(side: str) -> None:
    prop = {name: (parent.format(side), (0.0, 0.0, length)) for name, parent, length in PROP}
    motion, roles = nonsense(gait(body({**fingers(), **prop}), 60), 1)
    found = guess(motion.skeleton, motion.positions)
    assert found is not None
    assert right(found.joint_of, roles) == (len(MAIN), len(MAIN))


def test_a_tail_a_skirt_and_long_ears() -> None:
    extra = {"Tail0": ("Hips", (0.0, -0.05, -0.1)), "Tail1": ("Tail0", (0.0, -0.1, -0.2))}
    for k, (x, z) in enumerate(((0.1, 0.1), (-0.1, 0.1), (0.1, -0.1), (-0.1, -0.1))):
        extra |= {f"Skirt{k}0": ("Hips", (x, -0.05, z)), f"Skirt{k}1": (f"Skirt{k}0", (x / 4, -0.2, z / 4))}
        extra |= {f"Skirt{k}2": (f"Skirt{k}1", (x / 4, -0.2, z / 4))}
    for letter, x in (("L", 0.05), ("R", -0.05)):
        extra |= {
            f"Ear{letter}0": ("Head", (x, 0.2, 0.0)),
            f"Ear{letter}1": (f"Ear{letter}0", (x, 0.2, 0.0)),
        }
        extra |= {f"Ear{letter}2": (f"Ear{letter}1", (x, 0.2, 0.0))}
    motion, roles = nonsense(gait(body(extra), 60), 2)
    found = guess(motion.skeleton, motion.positions)
    assert found is not None
    assert right(found.joint_of, roles) == (len(MAIN), len(MAIN))
    assert [role for role in found.joint_of if role.startswith("tail")] == ["tail_1", "tail_2"]


def test_nothing_is_guessed_of_other_trees() -> None:
    chain = Skeleton(tuple("abcdef"), np.arange(-1, 5), np.tile([0.0, 0.1, 0.0], (6, 1)))
    star = Skeleton(tuple("abcdef"), np.array([-1, 0, 0, 0, 0, 0]), np.eye(6, 3))
    for skeleton in (chain, star, Skeleton(("a",), np.array([-1]), np.zeros((1, 3)))):
        assert guess(skeleton, skeleton.rest_positions[None]) is None


def test_names_win_over_structure() -> None:
    """What contradicts a name is not guessed, and what a user said has no role keeps none."""
    skeleton, expected = SCHEMES["Mixamo"].body()
    roles, places = list(expected.values()), skeleton.rest_positions[None]
    without = [None if role == "left_hand" else role for role in roles]
    assert completed(skeleton, without, places)[0] == tuple(roles)
    hand = skeleton.names[roles.index("left_hand")]
    assert completed(skeleton, without, places, explicit={hand}) == (tuple(without), "")
    swapped = ["head" if role == "neck" else None if role == "head" else role for role in without]
    assert completed(skeleton, swapped, places) == (tuple(swapped), "")


def test_names_say_which_side_is_the_left_where_the_rest_pose_does_not() -> None:
    """A body that faces the other way: the limbs of one side alone are known, or letters for the sides."""
    skeleton, expected = SCHEMES["H36M"].body()
    about = rotation.about(np.array([[0.0, 1.0, 0.0]]), np.array([np.pi]))
    places = rotation.rotate(about, skeleton.rest_positions)[None]
    roles = tuple(expected.values())
    known = [role if role is None or role.startswith("left_") else None for role in roles]
    assert completed(skeleton, known, places)[0] == roles
    letters = tuple(f"{name[0].lower()}_{'vwxyz'[k % 5]}{k}" for k, name in enumerate(skeleton.names))
    found, confidence = completed(replace(skeleton, names=letters), [None] * len(roles), places)
    assert found == roles
    assert "perhaps" not in confidence


def test_a_letter_in_one_name_is_no_side() -> None:
    motion, roles = nonsense(gait(body(), 40), 0)
    skeleton = motion.skeleton
    names = list(skeleton.names)
    names[roles["right_hand"]] = "k_L"
    found, _ = completed(replace(skeleton, names=tuple(names)), [None] * len(names), motion.positions)
    assert found[roles["right_hand"]] == "right_hand"


REAL = (
    "lafan1/Lafan1_example.bvh",
    "cmu_bvh/01_01.bvh",
    "cmu_asfamc/02_01.amc",
    "cmu_iclone/002_01.bvh",
    "mixamo_san/Aj/Box Turn.bvh",
    "mixamo_san/Mousey_m/Box Turn.bvh",
    "mixamo_r2et/Ortiz/Angry.bvh",
    "bandai_namco/dataset-1_bow_giant_001.bvh",
    "dog/Dog_example.bvh",
    "same_pairs/result/0.bvh",
    "gltf/Fox.glb",
    "gltf/Soldier.glb",
    "makehuman/makehuman/data/animations/walks/walk1.bvh",
)


@pytest.mark.parametrize("rest", [False, True], ids=["first second", "at rest"])
def test_real_rigs_under_names_that_say_nothing(real_data: Path, rest: bool) -> None:
    """At least nine of ten main joints, and every side but those that are said to be doubtful."""
    count, total = 0, 0
    for file in REAL:
        motion, roles = nonsense(load(real_data / file).motion, 1)
        second = motion.at(slice(0, max(round(motion.fps), 1))).positions
        found = guess(motion.skeleton, motion.skeleton.rest_positions[None] if rest else second)
        assert found is not None
        here, there = right(found.joint_of, roles)
        count, total = count + here, total + there
        assert not exchanged(found.joint_of, roles) or "perhaps exchanged" in found.confidence
        assert rest or "perhaps exchanged" not in found.confidence
    assert count >= 0.9 * total
