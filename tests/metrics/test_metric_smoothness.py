"""Differences over time against plain loops and closed forms."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from metric_cases import SCORED, Sides, character, compute, index, sides

from retarget_bench.api import Prediction


def restless(side: Prediction, order: int) -> float:
    """Mean size of the n-th differences per second^n, joint by joint and frame by frame."""
    weights = {2: (1, -2, 1), 3: (-1, 3, -3, 1)}[order]
    total, count = 0.0, 0
    for joint in index(side.character, SCORED):
        for t in range(side.frames - order):
            step = sum(w * side.positions[t + k, joint] for k, w in enumerate(weights))
            total += float(np.sqrt((step**2).sum())) * side.fps**order
            count += 1
    return total / count


@pytest.mark.parametrize(("seed", "fps"), [(0, 30.0), (1, 120.0)])
def test_sizes_and_ratios(seed: int, fps: float) -> None:
    case = sides(12, seed, fps=fps)
    values = compute("smoothness", case)
    heights = case.predicted.character.height, case.source.character.height
    for order, name in ((2, "acceleration"), (3, "jerk")):
        own, true, source = (restless(s, order) for s in (case.predicted, case.expected, case.source))
        assert values[name] == pytest.approx(own, rel=1e-9)
        assert values[f"{name}_ratio"] == pytest.approx(own / true, rel=1e-9)
        assert values[f"{name}_ratio_src"] == pytest.approx(
            own / heights[0] / (source / heights[1]), rel=1e-9
        )


@pytest.mark.parametrize("fps", [30.0, 60.0])
def test_acceleration_error(fps: float) -> None:
    case = sides(12, 2, fps=fps)
    p, g = case.predicted.positions, case.expected.positions
    total = 0.0
    for joint in index(case.predicted.character, SCORED):
        for t in range(1, 11):
            bends = [x[t + 1, joint] - 2 * x[t, joint] + x[t - 1, joint] for x in (p, g)]
            total += float(np.linalg.norm(bends[0] - bends[1])) * (fps / 30) ** 2
    assert compute("smoothness", case)["acc"] == pytest.approx(total / len(SCORED) / 10, rel=1e-9)


def falling(frames: int, fps: float, push: float) -> Prediction:
    """A stiff body whose height is g t^2 / 2 + push t^3 / 6."""
    body = character("Human")
    time = np.arange(frames) / fps
    path = -9.81 * time**2 / 2 + push * time**3 / 6
    return body.positions(body.skeleton.rest_positions + path[:, None, None] * [0, 1, 0], fps)


@pytest.mark.parametrize("fps", [30.0, 50.0])
def test_free_fall(fps: float) -> None:
    case = Sides(falling(20, fps, 30.0), falling(20, fps, 60.0), falling(20, fps, 30.0))
    values = compute("smoothness", case)
    assert values["jerk"] == pytest.approx(60.0, rel=1e-6)
    assert values["jerk_ratio"] == pytest.approx(2.0, rel=1e-6)
    assert values["jerk_ratio_src"] == pytest.approx(2.0, rel=1e-6)
    still = compute("smoothness", Sides(*(falling(20, fps, 0.0) for _ in range(3))))
    assert still["acceleration"] == pytest.approx(9.81, rel=1e-6)
    assert still["acceleration_ratio"] == pytest.approx(1.0)
    assert "jerk_ratio" not in still
    assert "jerk_ratio_src" not in still


def test_bone_drift() -> None:
    case = sides(6, 3)
    assert compute("smoothness", case)["bone_drift"] == pytest.approx(0.0, abs=1e-9)
    body = case.predicted.character
    rng = np.random.default_rng(0)
    places = case.predicted.positions + rng.normal(scale=0.02, size=case.predicted.positions.shape)
    off = []
    for pose in places:
        for joint, parent in enumerate(body.skeleton.parents):
            if parent >= 0:
                length = np.linalg.norm(body.skeleton.offsets[joint])
                off.append(abs(np.linalg.norm(pose[joint] - pose[parent]) - length))
    values = compute("smoothness", replace(case, predicted=body.positions(places, 30.0)))
    assert values["bone_drift"] == pytest.approx(100 * np.mean(off) / body.height, rel=1e-9)


@pytest.mark.parametrize(
    ("frames", "missing"), [(1, {"acceleration", "jerk", "acc"}), (3, {"jerk", "jerk_ratio"})]
)
def test_short_clips(frames: int, missing: set[str]) -> None:
    values = compute("smoothness", sides(frames, 4))
    assert not missing & set(values)
    assert "bone_drift" in values
