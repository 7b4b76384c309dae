"""What metrics share: joint sets, contact labels, and refusing what does not fit together."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parent / "metrics"))

from metric_cases import FEET, HUMAN, SCORED, Sides, character, index, labelled, motion, sides

from retarget_bench.api import Contacts
from retarget_bench.errors import BenchError
from retarget_bench.verification.contract.common import snapshot
from retarget_bench.verification.rewriting import resized


def names(case: Sides, joints: np.ndarray) -> set[str]:
    return {case.predicted.character.skeleton.names[joint] for joint in joints}


def test_fingers_and_props_count_where_both_sides_have_them() -> None:
    case = sides(4)
    comparison = case.comparison()
    assert names(case, comparison.structure_joints) == set(SCORED)
    assert names(case, comparison.joints) == set(SCORED)
    own = replace(case, source=case.predicted).comparison()
    assert names(case, own.joints) == set(case.predicted.character.skeleton.names)


def test_split_joints_count_and_copies_never_do() -> None:
    rig = [(name, "Spine1_split" if name == "Spine2" else parent, offset) for name, parent, offset in HUMAN]
    rig.insert(3, ("Spine1_split", "Spine1", (0.0, 6.0, 0.0)))
    rig += [("LeftArm_virtual", "LeftArm", (0.0, 0.0, 0.0)), ("Pelvis", "Hips", (0.0, 0.0, 0.0))]
    body = character("Split", rig=tuple(rig))
    case = replace(sides(4), predicted=motion(body, 4, 0), expected=None)
    comparison = case.comparison()
    assert names(case, comparison.structure_joints) == {*SCORED, "Spine1_split"}
    assert names(case, comparison.joints) == {*SCORED, "Spine1_split"}


def test_four_legged_bodies_stand_on_their_hands_too() -> None:
    flat = {"Spine": (0.0, 0.0, 30.0), "LeftArm": (0.0, -30.0, 0.0), "RightArm": (0.0, -30.0, 0.0)}
    rig = tuple((name, parent, flat.get(name, offset)) for name, parent, offset in HUMAN)
    rig = tuple((n, p, (0.0, 0.0, 20.0) if n in ("Spine1", "Spine2") else o) for n, p, o in rig)
    rig = tuple((n, p, (0.0, -30.0, 0.0) if n.endswith(("ForeArm", "Hand")) else o) for n, p, o in rig)
    body = character("Dog", rig=rig)
    case = replace(sides(4), predicted=motion(body, 4, 0), expected=None)
    assert set(case.comparison().contact_roles) == {
        *("left_foot", "left_toe", "right_foot", "right_toe", "left_hand", "right_hand")
    }
    assert "left_hand" not in sides(4).comparison().contact_roles


def test_the_schedule_is_the_case_s_own_then_the_reference_s() -> None:
    case = sides(20)
    assert case.comparison().contact_labels.joints.tolist() == index(case.predicted.character, FEET)
    case.contacts = Contacts(("left_foot",), np.ones((20, 1), dtype=bool))
    assert case.comparison().contact_labels.planted.all()
    case.contacts = Contacts(("left_toe_end_2",), np.ones((20, 1), dtype=bool))
    assert case.comparison().contact_labels is None
    assert replace(case, contacts=None, expected=None).comparison().contact_labels is None


def test_pivots_are_those_of_the_labels_or_none() -> None:
    case = sides(20)
    assert not case.comparison().contact_labels.pivoting.any()
    stands, turns = np.zeros((20, 2), dtype=bool), np.zeros((20, 2), dtype=bool)
    turns[3:6] = [False, True]
    case.contacts = Contacts(("left_toe_end_2", "right_toe"), stands, turns)
    schedule = case.comparison().contact_labels
    assert schedule.joints.tolist() == index(case.predicted.character, ("RightToeBase",))
    assert np.flatnonzero(schedule.pivoting[:, 0]).tolist() == [3, 4, 5]
    case.contacts = Contacts(("left_foot",), np.ones((20, 1), dtype=bool), np.ones((20, 2), dtype=bool))
    with pytest.raises(BenchError, match=r"need labels \(20, 1\), got \(20, 2\)"):
        _ = case.comparison().contact_labels


def test_touches_are_those_whose_joints_the_target_has() -> None:
    case = labelled(sides(20))
    strange = replace(case.touches[0], end="left_index_1")
    touches = replace(case, touches=(strange, *case.touches)).comparison().touches
    assert touches == case.touches
    assert sides(20).comparison().touches == ()


def test_a_resized_case_takes_its_touches_along() -> None:
    """There and back: frame 12 of a clip of 10 is frame 6."""
    case = labelled(sides(10)).comparison().case
    longer = resized(case, 15)
    assert [touch.rests.shape for touch in longer.touches] == [(15,), (15,)]
    for before, after in zip(case.touches, longer.touches, strict=True):
        assert np.array_equal(after.rests[:10], before.rests)
        assert after.rests[12] == before.rests[6]
    assert "case.touches.1.rests" in snapshot(case=case)


def test_what_does_not_fit_together_is_refused() -> None:
    case = sides(10)
    with pytest.raises(BenchError, match=r"prediction has 10 frames, the source 9"):
        replace(case, source=case.source.at(slice(9))).comparison()
    with pytest.raises(BenchError, match=r"prediction has 10 frames, the reference 8"):
        replace(case, expected=case.expected.at(slice(8))).comparison()
    faster = replace(case.expected, fps=60.0)
    with pytest.raises(BenchError, match=r"30 frames per second, the reference 60"):
        replace(case, expected=faster).comparison()
    with pytest.raises(BenchError, match=r"the reference is not a motion of B"):
        replace(case, expected=case.source).comparison()
    with pytest.raises(BenchError, match=r"no frames"):
        Sides(*(side.at(slice(0)) for side in (case.source, case.predicted, case.expected))).comparison()
    case.contacts = Contacts(("left_foot", "left_toe"), np.ones((10, 3), dtype=bool))
    with pytest.raises(BenchError, match=r"need labels \(10, 2\), got \(10, 3\)"):
        _ = case.comparison().contact_labels


def test_a_body_without_height_is_refused() -> None:
    point = character("Point", rig=(("Hips", "", (0.0, 90.0, 0.0)),))
    with pytest.raises(BenchError, match="no height"):
        Sides(*(motion(point, 3, seed) for seed in range(3))).comparison()
