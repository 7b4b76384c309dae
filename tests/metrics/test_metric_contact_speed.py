"""Contacts and foot slide against plain loops."""

from __future__ import annotations

from dataclasses import replace
from math import hypot

import numpy as np
import pytest
from metric_cases import FEET, Sides, compute, index, sides

from retarget_bench.api import Contacts, Prediction

ROLES = ("left_foot", "left_toe", "right_foot", "right_toe")


def still(side: Prediction, joint: int, frame: int, limit: float) -> bool:
    """Whether a joint moved less than ``limit`` metres per frame of 30 per second."""
    step = side.positions[frame, joint] - side.positions[frame - 1, joint]
    return float(np.linalg.norm(step)) * side.fps / 30 < limit


def rates(expected: list[bool], predicted: list[bool]) -> tuple[float, float, float]:
    """Recall, precision and F1 by counting."""
    both = sum(w and f for w, f in zip(expected, predicted, strict=True))
    return both / sum(expected), both / sum(predicted), 2 * both / (sum(expected) + sum(predicted))


def labels(side: Prediction, limit: float) -> list[bool]:
    joints = index(side.character, FEET)
    return [still(side, joint, frame, limit) for frame in range(1, side.frames) for joint in joints]


@pytest.mark.parametrize(("seed", "fps"), [(0, 30.0), (1, 60.0), (2, 24.0)])
def test_primary_rule(seed: int, fps: float) -> None:
    case = sides(60, seed, fps=fps)
    values = compute("contact_speed", case)
    predicted = labels(case.predicted, 0.003 * case.predicted.character.height)
    for suffix, side in (("", case.expected), ("_src", case.source)):
        expected = labels(side, 0.003 * side.character.height)
        ids = ("contact_recall.speed", "contact_precision.speed", "contact_f1.speed")
        for id_, value in zip(ids, rates(expected, predicted), strict=True):
            assert 0.05 < value < 0.95, "the random case must not be trivial"
            assert values[f"{id_}{suffix}"] == pytest.approx(value, rel=1e-12)


@pytest.mark.parametrize(("seed", "fps"), [(0, 30.0), (1, 60.0)])
def test_sweeps(seed: int, fps: float) -> None:
    """PAN's eq. 17 (contacts of the reference), 18 (those of the answer there) and 19 (recall)."""
    case = sides(60, seed, fps=fps)
    curves = compute("pan_contact", case)
    sweeps = {
        "": [0.05, 0.1, 0.25, 0.5, 1, 2, 4],
        "_h": [0.001, 0.002, 0.003, 0.004, 0.005, 0.006, 0.008, 0.01],
    }
    for suffix, thresholds in sweeps.items():
        ids = [f"{kind}{suffix}" for kind in ("pan_recall", "pan_contact_precision", "pan_contact_f1")]
        assert all(set(curves[id_]) == {f"{e:g}" for e in thresholds} for id_ in ids)
        for e in thresholds:
            limit = e * case.predicted.character.height if suffix else e**0.5 / 100
            values = rates(labels(case.expected, limit), labels(case.predicted, limit))
            assert [curves[id_][f"{e:g}"] for id_ in ids] == pytest.approx(values, rel=1e-12)


def planted(case: Sides, seed: int) -> Contacts:
    return Contacts(ROLES, np.random.default_rng(seed).random((case.predicted.frames, 4)) < 0.5)


def test_labels_of_the_data_set_win_over_the_reference() -> None:
    case = sides(40, 3)
    case.contacts = planted(case, 0)
    expected = [bool(x) for row in case.contacts.planted[1:] for x in row]
    predicted = labels(case.predicted, 0.003 * case.predicted.character.height)
    values = compute("contact_speed", case)
    assert values["contact_recall.speed"] == pytest.approx(rates(expected, predicted)[0])
    assert values["contact_precision.speed"] == pytest.approx(rates(expected, predicted)[1])
    case.expected = None
    assert compute("contact_speed", case)["contact_f1.speed"] == pytest.approx(
        rates(expected, predicted)[2]
    )


def test_feet_that_never_stand_have_precision_zero_and_unlabelled_clips_no_value() -> None:
    case = sides(30, 5)
    running = case.predicted.positions + np.arange(30)[:, None, None] * [1.0, 0.0, 0.0]
    away = case.predicted.character.positions(running, 30.0)
    values = compute("contact_speed", replace(case, predicted=away))
    rates_of_plants = {"contact_recall.speed", "contact_precision.speed", "contact_f1.speed"}
    assert not any(values[id_] for id_ in rates_of_plants)
    values = compute("contact_speed", replace(case, expected=away))
    assert not rates_of_plants & set(values)
    assert "foot_slide" not in compute("slide", replace(case, expected=away))
    assert compute("pan_contact", replace(case, expected=away)) == {}


@pytest.mark.parametrize(("seed", "fps"), [(0, 30.0), (1, 60.0)])
def test_foot_slide(seed: int, fps: float) -> None:
    case = sides(60, seed, fps=fps)
    values = compute("slide", case)
    joints = index(case.predicted.character, FEET)
    p, h = case.predicted.positions, case.predicted.character.height
    for suffix, side in (("", case.expected), ("_src", case.source)):
        limit, feet = 0.003 * side.character.height, index(side.character, FEET)
        speeds = []
        for t in range(1, 60):
            for joint, foot in zip(joints, feet, strict=True):
                before = still(side, foot, max(t - 1, 1), limit)
                if before and still(side, foot, t, limit):
                    x, _, z = p[t, joint] - p[t - 1, joint]
                    speeds.append(hypot(x, z) * fps)
        assert values[f"foot_slide{suffix}"] == pytest.approx(np.mean(speeds) * 100 / 30, rel=1e-9)
        assert values[f"foot_slide_h{suffix}"] == pytest.approx(np.mean(speeds) * 100 / h, rel=1e-9)
