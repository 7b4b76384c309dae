"""Planted feet by place, against plain loops and feet whose ways are known."""

from __future__ import annotations

from dataclasses import replace
from math import hypot

import numpy as np
import pytest
from metric_cases import FEET, Sides, character, compute, index, labelled, motion, sides

from retarget_bench.api import Contacts, Ground
from retarget_bench.api.comparison import Comparison
from retarget_bench.datasets.puppets import plugin as Puppets
from retarget_bench.metrics.plant import plugin as Plant
from retarget_bench.motion.contact import CONTACT_ROLES

R = 0.005
"""Heights."""


def by_hand(case: Sides) -> dict[str, float]:
    """The four values by loops over frames, on a flat floor at 0."""
    body, labels = case.predicted.character, case.contacts
    feet, frames = index(body, FEET), case.predicted.frames
    p, g = (side.positions[:, feet] / body.height for side in (case.predicted, case.expected))
    reach = max(round(case.predicted.fps / 15), 1)

    def apart(side: np.ndarray, j: int, s: int, t: int) -> float:
        return hypot(side[s, j, 0] - side[t, j, 0], side[s, j, 2] - side[t, j, 2])

    kept, extents = 0, []
    for j in range(4):
        t = 0
        while t < frames:
            run = []
            while t < frames and labels.planted[t, j]:
                run.append(t)
                t += 1
            if run:
                level = {k for k in run if abs(p[k, j, 1] - g[k, j, 1]) <= R}
                kept += max(sum(apart(p, j, s, k) <= R for k in level) for s in run)
                extents.append(max(apart(p, j, s, k) for s in run for k in run))
            t += 1

    def stays(side: np.ndarray, t: int, j: int) -> bool:
        high = [g[k, c, 1] for k in range(frames) for c in (j, (j + 2) % 4) if labels.planted[k, c]]
        around = range(max(t - reach, 0), min(t + reach + 1, frames))
        dwells = any(
            all(apart(side, j, c, k) <= R for k in range(max(c - reach, 0), min(c + reach + 1, frames)))
            for c in around
        )
        return bool(high) and dwells and side[t, j, 1] <= max(high) + R

    found = [(t, j) for t in range(frames) for j in range(4) if stays(p, t, j)]
    right = [(t, j) for t, j in found if labels.planted[t, j] or labels.pivoting[t, j] or stays(g, t, j)]
    recall, precision = kept / labels.planted.sum(), len(right) / len(found)
    return {
        "plant_recall": recall,
        "plant_precision": precision,
        "plant_f1": 2 * recall * precision / (recall + precision),
        "plant_drift": 100 * float(np.mean(extents)),
    }


@pytest.mark.parametrize(("seed", "fps"), [(0, 30.0), (0, 60.0), (2, 24.0)])
def test_against_loops(seed: int, fps: float) -> None:
    case = labelled(sides(60, seed, fps=fps), seed)
    # the reference a little later and up and down, so that some of its plants are right
    near = np.roll(case.expected.positions, 2, axis=0)
    wavy = 0.006 * case.expected.character.height * np.sin(0.3 * np.arange(60))[:, None]
    near[..., 1] = case.expected.positions[..., 1] + wavy
    case = replace(case, predicted=case.expected.character.positions(near, fps))
    found = compute("plant", case)
    assert 0.05 < found["plant_recall"] < 0.95, "the random case must not be trivial"
    assert 0.05 < found["plant_precision"] < 0.95
    assert found == pytest.approx(by_hand(case), rel=1e-9)


def conveyor(way: np.ndarray, frames: int = 60) -> Sides:
    """A reference that stands still and is labelled so; a prediction moved by ``(frames, 3)`` heights."""
    body = character("B", seed=1)
    standing = motion(body, 1, 0).positions.repeat(frames, axis=0)
    carried = standing + body.height * way[:, None]
    bodies = [body.positions(places, 30.0) for places in (standing, carried, standing)]
    labels = np.ones((frames, 4), dtype=bool)
    return Sides(*bodies, contacts=Contacts(CONTACT_ROLES, labels))


def drifting(per_frame: float, frames: int = 60) -> np.ndarray:
    return np.arange(frames)[:, None] * per_frame * np.array([0.6, 0.0, 0.8])


def test_a_slow_drift_is_no_plant_though_its_speed_is_one() -> None:
    """Two thirds of the speed rule's limit: a foot within the circle of one place for five frames of 60."""
    case = conveyor(drifting(0.002))
    assert compute("contact", case)["contact_recall"] == 1.0
    found = compute("plant", case)
    assert found["plant_recall"] == pytest.approx(5 / 60)
    assert found["plant_drift"] == pytest.approx(100 * 59 * 0.002)
    assert found["plant_precision"] == 1.0


@pytest.mark.parametrize(("shift", "recall"), [((0.3, 0.0, -1.0), 1.0), ((0.0, 0.0049, 0.0), 1.0)])
def test_a_foot_may_stand_elsewhere_but_not_higher(shift: tuple[float, ...], recall: float) -> None:
    found = compute("plant", conveyor(np.tile(shift, (60, 1))))
    assert found == pytest.approx(
        {"plant_recall": recall, "plant_precision": 1.0, "plant_f1": 1.0, "plant_drift": 0.0}
    )
    for wrong in (0.0051, -0.0051):
        up = compute("plant", conveyor(np.tile((0.0, wrong, 0.0), (60, 1))))
        assert (up["plant_recall"], up["plant_drift"]) == (0.0, 0.0)


def test_one_leap_of_many_frames_costs_only_its_frames() -> None:
    way = np.zeros((60, 3))
    way[20:25] = [0.5, 0.0, 0.0]
    found = compute("plant", conveyor(way))
    assert found["plant_recall"] == pytest.approx(55 / 60)
    assert found["plant_drift"] == pytest.approx(50.0)


def test_height_is_over_the_ground() -> None:
    """A body a step to the side, up on a step as high as it is moved."""
    case = conveyor(np.tile((2.0, 0.2, 0.0), (60, 1)))
    height = case.predicted.character.height
    assert compute("plant", case)["plant_recall"] == 0.0
    step = np.array([[0.0, 0.0, 0.2, 0.2]]) * height
    case.ground = Ground(heights=step, origin=(0.0, 0.0), spacing=0.5 * height)
    assert compute("plant", case)["plant_recall"] == 1.0


def test_a_body_that_stands_all_the_time_has_recall_and_little_precision() -> None:
    case = conveyor(np.zeros((60, 3)))
    walking = case.expected.positions.copy()
    walking[30:] += np.arange(30)[:, None, None] * [0.1, 0.0, 0.0]
    case.expected = case.expected.character.positions(walking, 30.0)
    case.contacts.planted[30:] = False
    found = compute("plant", case)
    assert found["plant_recall"] == 1.0
    # the reference stays for one more frame, at its end
    assert found["plant_precision"] == pytest.approx(31 / 60)


def test_a_foot_held_in_the_air_is_no_plant() -> None:
    """Found is only what is as low as the reference's planted feet."""
    case = conveyor(np.zeros((60, 3)))
    case.contacts.planted[30:] = False
    lifted = case.predicted.positions.copy()
    lifted[30:, :, 1] += 0.1
    held = case.predicted.character.positions(lifted, 30.0)
    assert compute("plant", replace(case, predicted=held))["plant_precision"] == 1.0
    walking = case.expected.positions.copy()
    walking[30:] += np.arange(30)[:, None, None] * [0.1, 0.0, 0.0]
    gone = case.expected.character.positions(walking, 30.0)
    assert compute("plant", replace(case, expected=gone))["plant_precision"] == pytest.approx(31 / 60)


def test_nothing_known_nothing_said() -> None:
    case = labelled(sides(30, 0))
    assert compute("plant", replace(case, contacts=None)) == {}
    assert compute("plant", replace(case, expected=None)) == {}
    none = Contacts(CONTACT_ROLES, np.zeros((30, 4), dtype=bool))
    assert compute("plant", replace(case, contacts=none)) == {}


def test_the_reference_and_the_second_answer_of_generated_motion_are_perfect() -> None:
    data = Puppets()
    for split in ("intra", "cross"):
        for info in data.cases("retarget", split)[::9]:
            case = data.load(info)
            found = Plant().compute(Comparison(case, case.reference))
            assert found["plant_recall"] == found.get("plant_precision", 1.0) == 1.0, info.id
            assert found["plant_drift"] < 100 * 0.001 / case.target.height
            assert Plant().compute(Comparison(case, case.alternative))["plant_recall"] == 1.0, info.id
