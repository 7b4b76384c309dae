"""Which joint answers to which, and how orientations are carried over."""

from __future__ import annotations

import numpy as np
import pytest
from alignment_rigs import BONES, performance, t_pose
from hypothesis import given
from hypothesis import strategies as st

from retarget_bench.motion import bvh, rotation
from retarget_bench.motion.character import Character
from retarget_bench.motion.skeleton import Skeleton
from retarget_bench.motion.transfer import correspondence, from_relative, orientations, shares


@pytest.mark.parametrize(
    ("target_count", "source_count", "table"),
    [
        (3, 3, [0, 1, 2]),
        (2, 3, [1, 2]),
        (1, 3, [2]),
        (3, 4, [0, 2, 3]),
        (4, 3, [0, 1, 1, 2]),
        (2, 1, [0, 0]),
        (3, 1, [-1, 0, 0]),  # the lowest third of the target's spine ends nearer to the hips
        (5, 3, [0, 0, 1, 1, 2]),
        (2, 0, [-1, -1]),
        (0, 3, []),
    ],
)
def test_links_are_shared_out_along_the_chain(target_count, source_count, table):
    assert shares(target_count, source_count) == table


@given(st.integers(1, 12), st.integers(1, 12))
def test_shares_rise_and_end_with_the_last(target_count, source_count):
    table = shares(target_count, source_count)
    assert table == sorted(table)
    assert table[-1] == source_count - 1
    if target_count == source_count:
        assert table == list(range(source_count))
    for k, link in enumerate(table, 1):  # no other end lies nearer; the hips are the end of link -1
        ends = [abs(k / target_count - (other + 1) / source_count) for other in range(-1, source_count)]
        assert abs(k / target_count - (link + 1) / source_count) <= min(ends) + 1e-12


def body(*left_out: str, **extra: tuple[str, tuple[float, float, float]]) -> Character:
    """The T-pose body without some joints, and with others: name = (parent, offset)."""
    bones = {name: bone for name, bone in BONES.items() if name not in left_out} | extra
    names = [name for name in bones if name not in extra]
    for name, (parent, _) in extra.items():
        names.insert(names.index(parent) + 1, name)
    for joint, (above, new) in {"Spine1": ("Spine", "Spine_split")}.items():
        if new in extra:
            bones[joint] = (new, bones[joint][1])
            assert bones[new][0] == above
    parents = [names.index(bones[name][0]) if bones[name][0] else -1 for name in names]
    offsets = np.array([bones[name][1] for name in names])
    return Character.of("body", Skeleton(tuple(names), np.array(parents), offsets))


def answers(source: Character, target: Character) -> dict[str, str | None]:
    table = correspondence(source, target)
    return {
        name: source.skeleton.names[joint] if joint >= 0 else None
        for name, joint in zip(target.skeleton.names, table, strict=True)
    }


def test_joints_answer_by_role_and_the_rest_follows():
    source = body("LeftToe_End", "RightToe_End")
    target = body(Spine_split=("Spine", (0.0, 0.05, 0.0)), LeftHandThumb1=("LeftHand", (0.03, 0.0, 0.02)))
    table = answers(source, target)
    assert table["Spine_split"] is None
    assert table["LeftHandThumb1"] is None
    assert table["LeftToe_End"] is None
    assert {k: v for k, v in table.items() if v != k and v is not None} == {}


def test_bodies_with_the_same_joints_answer_one_to_one_props_included():
    first = body(Hat=("Head", (0.0, 0.1, 0.0)))
    second = body(Hat=("Head", (0.0, 0.2, 0.0)))
    np.testing.assert_array_equal(correspondence(first, second), np.arange(len(first.skeleton)))


def test_what_follows_its_parent_does_not_turn_against_it():
    source = Character.of("t", t_pose())
    moves = performance(source, 30)
    target = body(Spine_split=("Spine", (0.0, 0.05, 0.0)), Hat=("Head", (0.0, 0.1, 0.0)))
    motion = source.motion(moves, np.zeros((30, 3)), 30.0)
    turned = from_relative(target, orientations(motion, target))
    names, source_names = target.skeleton.names, source.skeleton.names
    for name in ("Spine_split", "Hat"):
        rest = rotation.identity(30)
        assert rotation.angle(turned[:, names.index(name)], rest).max() < 1e-9
    for name in ("LeftForeArm", "Hips", "RightFoot"):
        target_turns = turned[:, names.index(name)]
        assert rotation.angle(target_turns, moves[:, source_names.index(name)]).max() < 1e-7


def test_spines_and_necks_of_other_counts(real_data):
    """CMU has three spine and two neck joints, the result of SAME two and one."""
    cmu = Character.of("cmu", bvh.read(real_data / "same_pairs/pfnn/LocomotionFlat01_000_3.bvh").skeleton)
    two = Character.of("two", bvh.read(real_data / "same_pairs/result/1.bvh").skeleton)
    table = answers(cmu, two)
    assert (table["Spine"], table["Spine1"], table["Neck"]) == ("Spine", "Spine1", "Neck1")
    back = answers(two, cmu)
    assert [back[name] for name in ("LowerBack", "Spine", "Spine1")] == ["Spine", "Spine", "Spine1"]
    assert [back[name] for name in ("Neck", "Neck1")] == ["Neck", "Neck"]
