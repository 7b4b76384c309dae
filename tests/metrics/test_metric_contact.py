"""Planted feet by place, against plain loops and feet whose ways are known."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from math import hypot

import numpy as np
import pytest
from metric_cases import FEET, HUMAN, Sides, character, compute, index, labelled, motion, sides

from retarget_bench.api import Contacts, Ground, Prediction
from retarget_bench.api.comparison import Comparison
from retarget_bench.datasets.puppets import plugin as Puppets
from retarget_bench.metrics.contact import of_reference
from retarget_bench.motion.character import Character
from retarget_bench.motion.contact import CONTACT_ROLES

R = 0.005
"""Heights."""


def stays(side: np.ndarray, t: int, j: int, reach: int) -> bool:
    """Whether a foot is near a frame around which it keeps to one place, of ``(frames, 4, 3)`` heights."""

    def around(c: int) -> range:
        return range(max(c - reach, 0), min(c + reach + 1, len(side)))

    return any(all(apart(side, j, c, k) <= R for k in around(c)) for c in around(t))


def apart(side: np.ndarray, j: int, s: int, t: int) -> float:
    return hypot(side[s, j, 0] - side[t, j, 0], side[s, j, 2] - side[t, j, 2])


def standing(body: Character) -> np.ndarray:
    """``(4,)`` heights of the feet over the floor in the rest pose of the toy, a T-pose."""
    up = body.skeleton.rest_positions[:, 1]
    lowest = min(up[index(body, (*FEET, "LeftToe_End", "RightToe_End"))])
    floor = 0.0 if 0.0 < lowest < 0.05 * body.height else lowest
    return (up[index(body, FEET)] - floor) / body.height


def by_hand(case: Sides, suffix: str = "") -> dict[str, float]:
    """The four values by loops over frames, on a flat floor at 0, against the reference or the source."""
    body, frames = case.predicted.character, case.predicted.frames
    reach = max(round(case.predicted.fps / 15), 1)
    p = case.predicted.positions[:, index(body, FEET)] / body.height
    other = case.source if suffix else case.expected
    g = other.positions[:, index(other.character, FEET)] / other.character.height
    g[..., 1] += standing(body) - standing(other.character)
    if case.contacts is not None and not suffix:
        planted, pivoting = case.contacts.planted, case.contacts.pivoting
    else:
        pivoting = np.zeros((frames, 4), dtype=bool)
        stay = [[stays(g, t, j, reach) for j in range(4)] for t in range(frames)]
        low = [min(g[t, c, 1] for t in range(frames) for c in (j, j ^ 2) if stay[t][c]) for j in range(4)]
        planted = np.array(
            [[stay[t][j] and g[t, j, 1] <= low[j] + 0.02 for j in range(4)] for t in range(frames)]
        )

    kept, extents = 0, []
    for j in range(4):
        t = 0
        while t < frames:
            run: list[int] = []
            while t < frames and planted[t, j]:
                if run and (case.contacts is None or suffix) and apart(g, j, run[0], t) > R:
                    break
                run.append(t)
                t += 1
            if run:
                level = {k for k in run if abs(p[k, j, 1] - g[k, j, 1]) <= R}
                kept += max(sum(apart(p, j, s, k) <= R for k in level) for s in run)
                extents.append(max(apart(p, j, s, k) for s in run for k in run))
            else:
                t += 1

    def is_contact(side: np.ndarray, t: int, j: int) -> bool:
        high = [g[k, c, 1] for k in range(frames) for c in (j, j ^ 2) if planted[k, c]]
        return bool(high) and stays(side, t, j, reach) and side[t, j, 1] <= max(high) + R

    contacts = [(t, j) for t in range(frames) for j in range(4) if is_contact(p, t, j)]
    right = [(t, j) for t, j in contacts if planted[t, j] or pivoting[t, j] or is_contact(g, t, j)]
    recall, precision = kept / planted.sum(), len(right) / len(contacts)
    return {
        f"contact_recall{suffix}": recall,
        f"contact_precision{suffix}": precision,
        f"contact_f1{suffix}": 2 * recall * precision / (recall + precision),
        f"contact_drift{suffix}": 100 * float(np.mean(extents)),
    }


def against(values: Mapping[str, float], suffix: str = "") -> dict[str, float]:
    """The values against the reference, or the source."""
    return {id_: number for id_, number in values.items() if id_.endswith("_src") == bool(suffix)}


def late(side: Prediction, body: Character) -> Prediction:
    """Its places on a body, two frames late and up and down, so that some of the contacts are right."""
    places = np.roll(side.positions / side.character.height, 2, axis=0)
    places[..., 1] += 0.006 * np.sin(0.3 * np.arange(side.frames))[:, None]
    return body.positions(body.height * places, side.fps)


@pytest.mark.parametrize(("seed", "fps"), [(0, 30.0), (0, 60.0), (3, 24.0)])
@pytest.mark.parametrize("labels", ["exact", "found"])
def test_against_loops(seed: int, fps: float, labels: str) -> None:
    case = labelled(sides(60, seed, fps=fps), seed)
    if labels == "found":
        case.contacts = None
    case = replace(case, predicted=late(case.expected, case.expected.character))
    values = against(compute("contact", case))
    assert 0.05 < values["contact_recall"] < 0.95, "the random case must not be trivial"
    assert 0.05 < values["contact_precision"] < 0.99
    assert values == pytest.approx(by_hand(case), rel=1e-9)


@pytest.mark.parametrize(("seed", "fps"), [(0, 30.0), (2, 60.0), (3, 24.0)])
def test_against_loops_over_the_source(seed: int, fps: float) -> None:
    """A source of another size, whose soles are thicker: the toy stands with its toes 2 cm over y = 0."""
    rig = tuple((n, p, (x, 1.02 * y if n == "Hips" else y, z)) for n, p, (x, y, z) in HUMAN)
    source, target = character("A", rig=rig, scale=0.007), character("B")
    assert abs(standing(source) - standing(target)).min() > 2 * R
    moves = motion(source, 60, seed, fps=fps)
    sunk = moves.positions - source.height * (standing(source) - standing(target))[0] * np.array([0, 1, 0])
    predicted = late(source.positions(sunk, fps), target)
    case = Sides(moves, predicted, None)
    values = compute("contact", case)
    assert 0.05 < values["contact_recall_src"] < 0.95, "the random case must not be trivial"
    assert 0.05 < values["contact_precision_src"] < 0.99
    assert values == pytest.approx(by_hand(case, "_src"), rel=1e-9)


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
    assert compute("contact_speed", case)["contact_recall.speed"] == 1.0
    values = compute("contact", case)
    assert values["contact_recall"] == pytest.approx(5 / 60)
    assert values["contact_drift"] == pytest.approx(100 * 59 * 0.002)
    assert values["contact_precision"] == 1.0


@pytest.mark.parametrize(("shift", "recall"), [((0.3, 0.0, -1.0), 1.0), ((0.0, 0.0049, 0.0), 1.0)])
def test_a_foot_may_stand_elsewhere_but_not_higher(shift: tuple[float, ...], recall: float) -> None:
    values = compute("contact", conveyor(np.tile(shift, (60, 1))))
    assert against(values) == pytest.approx(
        {"contact_recall": recall, "contact_precision": 1.0, "contact_f1": 1.0, "contact_drift": 0.0}
    )
    for wrong in (0.0051, -0.0051):
        up = compute("contact", conveyor(np.tile((0.0, wrong, 0.0), (60, 1))))
        assert (up["contact_recall"], up["contact_drift"]) == (0.0, 0.0)


def test_height_is_over_the_ground() -> None:
    """A body a step to the side, up on a step as high as it is moved."""
    case = conveyor(np.tile((2.0, 0.2, 0.0), (60, 1)))
    height = case.predicted.character.height
    assert compute("contact", case)["contact_recall"] == 0.0
    step = np.array([[0.0, 0.0, 0.2, 0.2]]) * height
    case.ground = Ground(heights=step, origin=(0.0, 0.0), spacing=0.5 * height)
    assert compute("contact", case)["contact_recall"] == 1.0


def test_nothing_known_nothing_said() -> None:
    case = labelled(sides(30, 0))
    assert set(compute("contact", replace(case, expected=None))) == set(
        against(compute("contact", case), "_src")
    )
    none = Contacts(CONTACT_ROLES, np.zeros((30, 4), dtype=bool))
    assert against(compute("contact", replace(case, contacts=none))) == {}
    elsewhere = Contacts(("left_index_1",), np.ones((30, 1), dtype=bool))
    assert against(compute("contact", replace(case, contacts=elsewhere))) == {}
    case.ground = Ground(heights=np.zeros((2, 2)))
    assert against(compute("contact", case), "_src") == {}, "the ground under the source is not known"


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("frames", [1, 80])
def test_an_answer_that_is_the_reference_keeps_all_contacts_found_in_it(seed: int, frames: int) -> None:
    """However it creeps: what is found as one plant lies within the circle."""
    case = sides(frames, seed)
    values = against(compute("contact", replace(case, predicted=case.expected)))
    assert values["contact_recall"] == values["contact_precision"] == 1.0
    assert values["contact_drift"] <= 200 * R


def test_labels_found_in_generated_references_are_the_exact_ones() -> None:
    """Shares of all labels, feet and toes of people, fore paws left out."""
    data, hits, true, claimed = Puppets(), 0, 0, 0
    for info in data.cases("retarget", "self")[::4]:
        comparison = Comparison(data.load(info), data.load(info).reference)
        detected, exact = _found_in_reference(comparison), comparison.contact_labels
        hits += (detected & exact.planted).sum()
        true, claimed = true + exact.planted.sum(), claimed + (detected & ~exact.pivoting).sum()
    assert hits / true > 0.95
    assert hits / claimed > 0.95


def _found_in_reference(comparison: Comparison) -> np.ndarray:
    case = replace(comparison.case, contacts=None)
    expected = of_reference(Comparison(case, case.reference))
    return expected.planted[:, [expected.joints.index(j) for j in comparison.contact_labels.joints]]
