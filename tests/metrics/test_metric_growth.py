"""Errors by second against plain loops, exact rates, and motions whose error grows as is known."""

from __future__ import annotations

import importlib
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from metric_cases import SCORED, compute, index, metric, sides

from retarget_bench.api.comparison import Comparison

by_second = importlib.import_module("retarget_bench.metrics.growth").by_second


def in_seconds(frames: int, fps: Fraction) -> dict[int, list[int]]:
    """End of every whole second -> its frames, in exact fractions."""
    middles = [(Fraction(frame) + Fraction(1, 2)) / fps for frame in range(frames + 1)]
    seconds: dict[int, list[int]] = {}
    for frame, middle in enumerate(middles[:-1]):
        seconds.setdefault(int(middle) + 1, []).append(frame)
    return {end: inside for end, inside in seconds.items() if end <= int(middles[-1])}


@pytest.mark.parametrize(("frames", "fps"), [(95, 30), (100, 24), (61, 60), (125, 120), (40, 12.5), (9, 3)])
def test_every_second_is_the_mean_over_its_frames(frames: int, fps: float) -> None:
    case = sides(frames, 3, fps=fps)
    body = case.predicted.character
    joints, hips = index(body, SCORED), body.skeleton.names.index("Hips")
    p, g = case.predicted.positions, case.expected.positions
    values = compute("growth", case)
    expected = in_seconds(frames, Fraction(fps))
    for id_ in ("growth.world", "growth.pose"):
        curve = {}
        for end, inside in expected.items():
            total = 0.0
            for t in inside:
                moved = (p[t, hips] - g[t, hips]) if id_ == "growth.pose" else np.zeros(3)
                total += sum(float(np.linalg.norm(p[t, j] - g[t, j] - moved)) for j in joints)
            curve[str(end)] = 100 * total / len(inside) / len(joints) / body.height
        assert values[id_] == pytest.approx(curve, rel=1e-9)


@given(
    frames=st.integers(1, 400),
    fps=st.sampled_from([30, 24, 25, 60, 50, 120, 100, 12, Fraction("29.97"), Fraction("7.5"), 1]),
)
def test_frames_of_every_rate_fall_into_their_seconds(frames: int, fps: Fraction) -> None:
    curve = by_second(np.arange(frames, dtype=float), float(fps))
    expected = {str(end): float(np.mean(each)) for end, each in in_seconds(frames, Fraction(fps)).items()}
    assert curve == pytest.approx(expected)
    assert [int(end) for end in curve] == sorted(map(int, curve))


@pytest.mark.parametrize("fps", [30.0, 1 / 0.0333333, 1 / 0.0333334])
def test_rounded_frame_times_change_nothing(fps: float) -> None:
    """Ten minutes at a rate as files write it."""
    numbers = np.arange(18_000, dtype=float)
    assert by_second(numbers, fps) == by_second(numbers, 30.0)
    assert len(by_second(numbers, fps)) == 600


def test_steady_drift_is_a_straight_line() -> None:
    """0.3 m per second to the side: the pose stays right, the place does not."""
    case = sides(150, 1)
    drift = np.outer(np.arange(150) / 30.0, [0.3, 0.0, 0.0])
    moved = case.expected.character.motion(case.expected.rotations, case.expected.root + drift, 30.0)
    values = metric("growth").compute(Comparison(case.comparison().case, moved))
    line = {str(s): 100 * 0.3 * (s - 0.5 - 0.5 / 30) / moved.character.height for s in range(1, 6)}
    assert values["growth.world"] == pytest.approx(line, rel=1e-9)
    assert values["growth.pose"] == pytest.approx(dict.fromkeys(line, 0.0), abs=1e-9)


def test_less_than_a_second_and_no_reference_have_no_curve() -> None:
    assert compute("growth", sides(28, 0)) == {}
    assert set(compute("growth", sides(30, 0))["growth.world"]) == {"1"}
    case = sides(40, 0)
    case.expected = None
    assert compute("growth", case) == {}
