"""Angles between rotations, against scipy."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from metric_cases import BODY, compute, index, sides
from scipy.spatial.transform import Rotation


def degrees(a: np.ndarray, b: np.ndarray) -> float:
    turns = (Rotation.from_quat(q, scalar_first=True) for q in (a, b))
    first, second = turns
    return float(np.degrees((first.inv() * second).magnitude()))


def test_local_world_and_by_joint() -> None:
    case = sides(5, 0)
    values = compute("rotation", case)
    joints = index(case.predicted.character, BODY)
    p, g = case.predicted, case.expected
    local = [[degrees(p.rotations[t, j], g.rotations[t, j]) for j in joints] for t in range(5)]
    world = [
        [degrees(p.global_rotations[t, j], g.global_rotations[t, j]) for j in joints] for t in range(5)
    ]
    assert values["rotation.local"] == pytest.approx(np.mean(local), rel=1e-9)
    assert values["rotation.world"] == pytest.approx(np.mean(world), rel=1e-9)
    for name, angles in zip(BODY, np.array(local).T, strict=True):
        assert values["rotation.joint"][name] == pytest.approx(angles.mean(), rel=1e-9)


def test_a_turn_of_the_root_counts_once_locally_and_everywhere_in_the_world() -> None:
    case = sides(5, 1)
    turns = case.expected.rotations.copy()
    turn = Rotation.from_rotvec([0.0, np.radians(30.0), 0.0])
    root = turn * Rotation.from_quat(turns[:, 0], scalar_first=True)
    turns[:, 0] = -root.as_quat(scalar_first=True)  # the sign of a quaternion means nothing
    predicted = case.expected.character.motion(turns, case.expected.root, 30.0)
    values = compute("rotation", replace(case, predicted=predicted))
    assert values["rotation.local"] == pytest.approx(30.0 / 22, rel=1e-9)
    assert values["rotation.world"] == pytest.approx(30.0, rel=1e-9)


def test_positions_alone_have_no_angles() -> None:
    case = sides(5, 2)
    assert compute("rotation", case.by_positions()) == {}
    assert compute("rotation", replace(case, predicted=case.by_positions().predicted)) == {}
    assert compute("rotation", replace(case, expected=case.by_positions().expected)) == {}
