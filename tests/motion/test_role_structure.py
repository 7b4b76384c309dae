"""Roles of bodies whose names say nothing, by the tree and the places of joints."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from editing_bodies import body, fingers, gait
from role_schemes import SCHEMES

from retarget_bench.motion import bvh
from retarget_bench.motion.character import Motion
from retarget_bench.motion.files.reading import Reading
from retarget_bench.motion.importer import load
from retarget_bench.motion.role_structure import completed, guess
from retarget_bench.motion.roles import ESSENTIAL
from retarget_bench.motion.skeleton import Skeleton

PLAIN = [
    name
    for name, each in SCHEMES.items()
    if "(" not in each.arm + each.leg and each.leg.count("|") > 2 and "|" in each.trunk
]
"""Schemes of bodies with toes and a spine and without joints inside the bones of limbs."""


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


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("extra", [None, fingers()], ids=["plain", "fingers"])
def test_a_walk_under_names_that_say_nothing(tmp_path: Path, seed: int, extra: object) -> None:
    motion, roles = nonsense(gait(body(extra), 60), seed)
    path = tmp_path / "walk.bvh"
    bvh.write(path, motion, scale=100.0)
    imported = load(path)
    joint_of = imported.motion.character.joint_of
    names, read = motion.skeleton.names, imported.motion.skeleton.names
    assert {role: read[joint_of[role]] for role in ESSENTIAL} == {r: names[roles[r]] for r in ESSENTIAL}
    assert any("are a guess by the tree" in doubt for doubt in imported.findings.doubts)
    settled = load(path, replace(imported.settled))
    assert not any("are a guess" in doubt for doubt in settled.findings.doubts)


@pytest.mark.parametrize("scheme", PLAIN)
def test_bodies_at_rest_with_feet_that_point_forwards(scheme: str) -> None:
    skeleton, expected = SCHEMES[scheme].body()
    joint_of = {role: joint for joint, role in enumerate(expected.values()) if role is not None}
    for seed in range(3):
        other, place = shuffled(skeleton, seed)
        guessed = guess(other, other.rest_positions[None])
        assert {role: guessed[role] for role in ESSENTIAL} == {r: place[joint_of[r]] for r in ESSENTIAL}
        assert all(place[joint_of[role]] == joint for role, joint in guessed.items() if role in joint_of)


def test_nothing_is_guessed_where_no_bend_tells_left_from_right() -> None:
    skeleton, _ = SCHEMES["H36M"].body()
    assert guess(skeleton, skeleton.rest_positions[None]) == {}


def test_nothing_is_guessed_of_other_trees() -> None:
    chain = Skeleton(tuple("abcdef"), np.arange(-1, 5), np.tile([0.0, 0.1, 0.0], (6, 1)))
    star = Skeleton(tuple("abcdef"), np.array([-1, 0, 0, 0, 0, 0]), np.eye(6, 3))
    for skeleton in (chain, star, Skeleton(("a",), np.array([-1]), np.zeros((1, 3)))):
        assert guess(skeleton, skeleton.rest_positions[None]) == {}


def test_names_win_over_structure() -> None:
    """What contradicts a name is not guessed, and what a user said has no role keeps none."""
    skeleton, expected = SCHEMES["Mixamo"].body()
    roles, places = list(expected.values()), skeleton.rest_positions[None]
    without = [None if role == "left_hand" else role for role in roles]
    assert completed(skeleton, without, places) == tuple(roles)
    hand = skeleton.names[roles.index("left_hand")]
    assert completed(skeleton, without, places, explicit={hand}) == tuple(without)
    swapped = ["head" if role == "neck" else None if role == "head" else role for role in without]
    assert completed(skeleton, swapped, places) == tuple(swapped)


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


def test_real_rigs_under_names_that_say_nothing(real_data: Path) -> None:
    """At least nine of ten main joints, and every side."""
    right, total = 0, 0
    for file in REAL:
        motion, roles = nonsense(load(real_data / file).motion, 1)
        sample = motion.at(np.unique(np.linspace(0, motion.frames - 1, 100).astype(int)))
        guessed = guess(motion.skeleton, sample.positions)
        right += sum(guessed.get(role) == roles[role] for role in ESSENTIAL)
        total += len(ESSENTIAL)
        other = {
            role: role.replace("left", "\0").replace("right", "left").replace("\0", "right")
            for role in roles
        }
        assert not [
            r for r, joint in guessed.items() if other.get(r) != r and roles.get(other.get(r, "")) == joint
        ]
    assert right >= 0.9 * total


def test_a_reading_of_roles_is_not_guessed_over(tmp_path: Path) -> None:
    motion, roles = nonsense(gait(body(), 30), 0)
    path = tmp_path / "walk.bvh"
    bvh.write(path, motion, scale=100.0)
    name = motion.skeleton.names[roles["left_hand"]]
    imported = load(path, Reading(roles={name: None}))
    assert "left_hand" not in imported.motion.character.joint_of
    assert "right_hand" in imported.motion.character.joint_of
