"""Roles files that were filled in wrongly are said to be, and right ones are not."""

from __future__ import annotations

import json
import re
import shutil
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from editing_bodies import body, gait
from hypothesis import given
from hypothesis import strategies as st

from retarget_bench import cli
from retarget_bench.errors import BenchError
from retarget_bench.motion import bvh, rotation
from retarget_bench.motion.character import Character
from retarget_bench.motion.files.reading import Reading
from retarget_bench.motion.importer import load
from retarget_bench.motion.role_checks import contradictions, doubt, left_out
from tests.examples import examples

ROLES = {
    name: role for name, role in zip(body().skeleton.names, body().roles, strict=True) if role is not None
}


def exchanged(a: str, b: str) -> dict[str, str]:
    """The right roles with one word for another, and the other way round."""
    marked = {name: role.replace(a, "\0").replace(b, a).replace("\0", b) for name, role in ROLES.items()}
    return {name: role for name, role in marked.items() if role != ROLES[name]}


ARMS_AND_LEGS = dict(
    zip(
        ("arm", "forearm", "hand", "up_leg", "leg", "foot"),
        ("up_leg", "leg", "foot", "arm", "forearm", "hand"),
        strict=True,
    )
)


def limbs() -> dict[str, str]:
    parts = {name: role.partition("_") for name, role in ROLES.items()}
    return {
        name: f"{side}_{ARMS_AND_LEGS[part]}"
        for name, (side, _, part) in parts.items()
        if part in ARMS_AND_LEGS
    }


WRONG = {
    "sides": (lambda: exchanged("left", "right"), ("left_arm", "right_arm", "left_up_leg")),
    "arms alone": (
        lambda: {n: r for n, r in exchanged("left", "right").items() if not re.search("Leg|Foot|Toe", n)},
        ("left_arm and right_arm",),
    ),
    "arms and legs": (limbs, ("left_arm", "left_up_leg", "exchanged")),
    "head and hips": (lambda: {"Head": "hips", "Hips": "head"}, ("hips does not carry",)),
    "knee and foot": (lambda: {"LeftLeg": "left_foot", "LeftFoot": "left_leg"}, ("left_foot", "left_leg")),
    "spine": (lambda: {"Spine": "spine_2", "Spine1": "spine_1"}, ("spine_2 does not hang from spine_1",)),
    "a hand for a head": (lambda: {"LeftHand": "head", "Head": "none"}, ("head hangs from left_forearm",)),
}  # fmt: skip


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "walk.bvh"
    bvh.write(path, gait(body(), 60), scale=100.0)
    return path


def saved(path: Path, roles: Mapping[str, str]) -> Path:
    path.write_text("".join(f"{json.dumps(name)} = {json.dumps(role)}\n" for name, role in roles.items()))
    return path


@pytest.mark.parametrize("kind", WRONG)
def test_a_wrong_map_is_told_in_a_line_and_used(file: Path, tmp_path: Path, kind: str) -> None:
    wrong: Callable[[], dict[str, str]] = WRONG[kind][0]
    roles = saved(tmp_path / "roles.toml", wrong())
    findings = load(file, Reading(roles=roles)).findings
    doubts = [each for each in findings.doubts if each.startswith("roles look wrong: ")]
    assert len(doubts) == 1
    assert "\n" not in doubts[0]
    assert doubts[0].endswith("correct the table of roles")
    for word in WRONG[kind][1]:
        assert word in doubts[0]
    for name, role in wrong().items():
        assert role == "none" or dict(findings.joints)[name] == role


def test_the_commands_say_so(file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    def run(*words: object) -> str:
        with pytest.raises(SystemExit):
            cli.main([str(word) for word in words])
        return "".join(capsys.readouterr())

    roles, out = saved(tmp_path / "roles.toml", exchanged("left", "right")), tmp_path / "out.bvh"
    source = shutil.copy(file, tmp_path / "source.bvh")
    output = run("doctor", f"{file}[roles={roles}]")
    assert "roles look wrong: left_arm and right_arm are on the other side" in output
    output = run("retarget", source, "--target", f"{file}[roles={roles}]", "-o", out)
    assert output.count("roles look wrong") == 1
    assert f"{file}: roles look wrong" in output, "the file is named whose roles are wrong"
    assert out.exists(), "nothing is refused because of it"


def test_right_maps_are_not_doubted(file: Path, tmp_path: Path) -> None:
    for roles in (ROLES, {"Head": "head"}, {"LeftToe_End": "none"}):
        findings = load(file, Reading(roles=saved(tmp_path / "roles.toml", roles))).findings
        assert not [each for each in findings.doubts if "roles" in each]


def test_mirrored_names_may_be_corrected() -> None:
    """Sides are told by how legs bend, not by names, where these contradict each other."""
    motion = gait(body(), 60)
    other = {"Left": "Right", "Right": "Left"}
    names = tuple(
        other.get(name[:4], other.get(name[:5], "")) + name.removeprefix("Left").removeprefix("Right")
        if name.startswith(("Left", "Right"))
        else name
        for name in motion.skeleton.names
    )
    skeleton = replace(motion.skeleton, names=names)
    right = replace(motion.character, skeleton=skeleton)
    assert contradictions(replace(motion, character=right)) == []
    wrong = Character.of("mirrored", skeleton)
    assert contradictions(wrong.motion(motion.rotations, motion.root, 30.0))


@given(st.permutations(sorted(ROLES.values())))
@examples(25)
def test_no_permutation_is_refused_because_of_it(order: list[str]) -> None:
    motion = gait(body(), 20)
    by_role = dict(zip(ROLES, order, strict=True))
    try:
        moved = Character.of("any", motion.skeleton, roles=tuple(by_role[n] for n in motion.skeleton.names))
    except BenchError:
        return
    line = doubt(moved.motion(motion.rotations, motion.root, 30.0), by_role)
    assert (line == "") == (contradictions(moved.motion(motion.rotations, motion.root, 30.0)) == [])
    assert len(line) < 600


@pytest.mark.parametrize("about", ["across", "along"])
def test_joints_of_no_role_that_bend_inside_a_chain_are_said_to_be_left_out(about: str) -> None:
    """Not those that turn about their bone, as twist bones do."""
    bent = body()
    joint = bent.skeleton.index("Spine1")
    roles = tuple(None if index == joint else role for index, role in enumerate(bent.roles))
    bent = replace(bent, roles=roles)
    rotations = np.array(gait(body(), 20).rotations)
    below = bent.skeleton.children[joint][0]
    bone = rotation.unit(bent.skeleton.offsets[below])
    axis = bone if about == "along" else np.cross(bone, (1.0, 0.0, 0.0))
    turn = np.radians(np.linspace(0.0, 35.0, 20))
    rotations[:, joint] = rotation.about(np.broadcast_to(rotation.unit(axis), (20, 3)), turn)
    sentences = left_out(bent.motion(rotations, np.zeros((20, 3)), 30.0))
    if about == "along":
        assert sentences == ()
    else:
        (sentence,) = sentences
        assert sentence.startswith(
            f"Spine to {bent.skeleton.names[below]}: Spine1 turns by up to 35 degrees"
        )
