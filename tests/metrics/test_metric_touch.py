"""Self-touches against scipy's rotations, and gaps that are known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from metric_cases import compute, labelled, sides
from scipy.spatial.transform import Rotation

from retarget_bench.api import Touch
from retarget_bench.errors import BenchError
from retarget_bench.motion import kinematics


def gaps(case) -> list[float]:
    """Heights from every point to its place, frame by frame."""
    body, p = case.predicted.character, case.predicted
    stand = kinematics.forward(body.skeleton, body.reference_pose[None], np.zeros((1, 3)))[1][0]

    def at(role: str, spot: np.ndarray, frame: int) -> np.ndarray:
        joint = body.joint_of[role]
        now, then = (
            Rotation.from_quat(q, scalar_first=True)
            for q in (p.global_rotations[frame, joint], stand[joint])
        )
        return p.positions[frame, joint] + (now * then.inv()).apply(np.array(spot))

    return [
        float(np.linalg.norm(at(t.end, t.point, k) - at(t.bearing, t.place, k))) / body.height
        for t in case.touches
        for k in range(p.frames)
        if t.rests[k]
    ]


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_gap_and_recall(seed: int) -> None:
    case = labelled(sides(20, seed), seed)
    values, by_hand = compute("touch", case), gaps(case)
    assert values["touch_gap"] == pytest.approx(100 * np.mean(by_hand), rel=1e-9)
    recall = np.mean([gap <= 0.01 for gap in by_hand])
    assert 0.1 < recall < 0.9, "the random case must not be trivial"
    assert values["touch_recall"] == pytest.approx(recall)


def test_a_place_that_is_carried_along_has_the_gap_that_it_was_given() -> None:
    case = labelled(sides(20, 3))
    wrist = case.touches[0]
    assert compute("touch", replace(case, touches=(wrist,))) == pytest.approx(
        {"touch_gap": 0.5, "touch_recall": 1.0}
    )
    body = case.predicted.character
    off = replace(wrist, point=0.03 * body.height * np.array([0.0, -0.6, -0.8]))
    # the same line on the reference pose only: wrist and forearm turn on their own
    standing = body.motion(np.repeat(body.reference_pose[None], 20, axis=0), np.zeros((20, 3)), 30.0)
    values = compute("touch", replace(case, predicted=standing, touches=(off,)))
    assert values == pytest.approx({"touch_gap": 3.5, "touch_recall": 0.0})


def test_no_touch_no_value() -> None:
    case = labelled(sides(20, 4))
    never = replace(case.touches[0], rests=np.zeros(20, dtype=bool))
    strange = replace(case.touches[0], bearing="left_index_1")
    for touches in (None, (), (never,), (strange,)):
        assert compute("touch", replace(case, touches=touches)) == {}
    assert compute("touch", case.by_positions()) == {}


def test_labels_of_another_length_are_refused_in_words() -> None:
    case = sides(20, 5)
    case.touches = (Touch("left_hand", np.zeros(3), "hips", np.zeros(3), np.ones(19, dtype=bool)),)
    with pytest.raises(BenchError, match=r"left_hand on hips needs labels \(20,\), got \(19,\)"):
        compute("touch", case)
