"""Penetration and floating against plain loops, on flat and uneven ground."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from metric_cases import FEET, SCORED, compute, index, sides
from scipy.interpolate import RegularGridInterpolator

from retarget_bench.api import Contacts, Ground

BUMPS = Ground(
    heights=np.random.default_rng(0).uniform(-0.6, 0.1, size=(9, 7)), origin=(-1.5, -2.0), spacing=0.5
)
ROLES = ("left_foot", "left_toe", "right_foot", "right_toe")


def height(ground: Ground, x: float, z: float) -> float:
    """By scipy, with places beyond the field moved to its edge."""
    if ground.heights is None:
        return ground.height
    rows, columns = (
        start + ground.spacing * np.arange(n)
        for start, n in zip(ground.origin[::-1], ground.heights.shape, strict=True)
    )
    place = [np.clip(z, rows[0], rows[-1]), np.clip(x, columns[0], columns[-1])]
    return float(RegularGridInterpolator((rows, columns), ground.heights)([place])[0])


def lowest(ground: Ground, pose: np.ndarray, joints: list[int]) -> float:
    return min(pose[j, 1] - height(ground, pose[j, 0], pose[j, 2]) for j in joints)


@pytest.mark.parametrize("ground", [Ground(), Ground(height=-0.1), BUMPS], ids=["zero", "flat", "bumps"])
def test_against_loops(ground: Ground) -> None:
    case = replace(sides(30, 1), ground=ground)
    case.contacts = Contacts(ROLES, np.random.default_rng(1).random((30, 4)) < 0.2)
    body = case.predicted.character
    values = compute("ground", case)
    joints = index(body, SCORED)
    depths = [max(0.0, -lowest(ground, pose, joints)) for pose in case.predicted.positions]
    assert 0 < sum(d > 0.01 for d in depths) < 30, "the random case must not be trivial"
    assert values["penetration.rate"] == pytest.approx(100 * sum(d > 0.01 for d in depths) / 30)
    assert values["penetration.mean"] == pytest.approx(100 * np.mean(depths), rel=1e-9)
    assert values["penetration.max"] == pytest.approx(100 * max(depths), rel=1e-9)
    feet, gaps = index(body, FEET), []
    for t in range(30):
        if any(case.contacts.planted[t]):
            predicted_lowest = lowest(ground, case.predicted.positions[t], feet)
            gaps.append(max(0.0, predicted_lowest - lowest(ground, case.expected.positions[t], feet)))
    assert 0 < len(gaps) < 30
    assert values["floating.rate"] == pytest.approx(100 * sum(g > 0.01 for g in gaps) / len(gaps))
    assert values["floating.mean"] == pytest.approx(100 * np.mean(gaps), rel=1e-9)


def test_floating_needs_a_reference_and_a_standing_frame() -> None:
    case = sides(10, 2)
    assert {id_.split(".")[0] for id_ in compute("ground", replace(case, expected=None))} == {"penetration"}
    case.contacts = Contacts(ROLES, np.zeros((10, 4), dtype=bool))
    assert {id_.split(".")[0] for id_ in compute("ground", case)} == {"penetration"}


@pytest.mark.parametrize(("depth", "rate"), [(0.009, 0.0), (0.011, 100.0)])
def test_up_to_a_centimetre_is_no_fault(depth: float, rate: float) -> None:
    case = sides(10, 4)
    places = case.expected.positions
    standing = places - places[..., 1].min(axis=1)[:, None, None] * [0, 1, 0]
    body = case.predicted.character
    at = {
        height: body.positions(standing + np.array([0, height, 0]), 30.0) for height in (-depth, 0.0, depth)
    }
    sunk = compute("ground", replace(case, predicted=at[-depth]))
    assert sunk["penetration.rate"] == rate
    assert sunk["penetration.max"] == pytest.approx(100 * depth, abs=1e-9)
    case.contacts = Contacts(ROLES, np.ones((10, 4), dtype=bool))
    lifted = compute("ground", replace(case, predicted=at[depth], expected=at[0.0]))
    assert lifted["floating.rate"] == rate
    assert lifted["floating.mean"] == pytest.approx(100 * depth)
