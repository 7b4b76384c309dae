"""Position errors against plain loops, and the joints they count."""

from __future__ import annotations

from dataclasses import replace
from math import hypot, sqrt

import numpy as np
import pytest
from metric_cases import SCORED, Sides, character, compute, index, motion, sides

from retarget_bench.motion.character import Character

CLOSE = {"rel": 1e-9, "abs": 1e-12}


def distance(a: np.ndarray, b: np.ndarray) -> float:
    return sqrt(sum((float(x) - float(y)) ** 2 for x, y in zip(a, b, strict=True)))


def chain(body: Character, *names: str) -> float:
    """Bone lengths of these joints, one by one."""
    return sum(sqrt(sum(x * x for x in body.skeleton.offsets[body.skeleton.index(n)])) for n in names)


def tall(body: Character) -> float:
    """H1: toe end up to the hips, and head top up to the hips."""
    leg = chain(body, "LeftUpLeg", "LeftLeg", "LeftFoot", "LeftToeBase", "LeftToe_End")
    return leg + chain(body, "Spine", "Spine1", "Spine2", "Neck", "Head", "HeadTop_End")


def mean_distance(case: Sides, joints: list[int], *, centred: bool = False) -> float:
    total, count = 0.0, 0
    for p, g in zip(case.predicted.positions, case.expected.positions, strict=True):
        for j in joints:
            move = (p[0], g[0]) if centred else (0.0, 0.0)
            total += distance(p[j] - move[0], g[j] - move[1])
            count += 1
    return total / count


@pytest.mark.parametrize("seed", range(3))
def test_primary_protocol(seed: int) -> None:
    case = sides(11, seed)
    values = compute("position", case)
    body = case.predicted.character
    h, joints = tall(body), index(body, SCORED)
    assert values["mpjpe_h.world"] == pytest.approx(100 * mean_distance(case, joints) / h, **CLOSE)
    assert values["mpjpe_h.root"] == pytest.approx(
        100 * mean_distance(case, joints, centred=True) / h, **CLOSE
    )
    curve = values["mpjpe_h.joint"]
    assert set(curve) == set(SCORED)
    for name in SCORED:
        one = 100 * mean_distance(case, index(body, (name,)), centred=True) / h
        assert curve[name] == pytest.approx(one, **CLOSE)


def test_end_effectors_and_root_path() -> None:
    case = sides(9, 5)
    values = compute("position", case)
    body = case.predicted.character
    h = tall(body)
    ends = index(
        body, ("Head", "LeftHand", "RightHand", "LeftFoot", "LeftToeBase", "RightFoot", "RightToeBase")
    )
    assert values["ee_h.world"] == pytest.approx(100 * mean_distance(case, ends) / h, **CLOSE)
    assert values["ee_h.root"] == pytest.approx(100 * mean_distance(case, ends, centred=True) / h, **CLOSE)
    level, high = [], []
    for p, g in zip(case.predicted.positions[:, 0], case.expected.positions[:, 0], strict=True):
        level.append((p[0] - g[0], p[2] - g[2]))
        high.append(abs(p[1] - g[1]))
    assert values["root_path.horizontal"] == pytest.approx(
        100 * np.mean([hypot(*d) for d in level]) / h, **CLOSE
    )
    assert values["root_path.vertical"] == pytest.approx(100 * np.mean(high) / h, **CLOSE)
    drift = hypot(level[-1][0] - level[0][0], level[-1][1] - level[0][1])
    assert values["root_path.drift"] == pytest.approx(100 * drift / h, **CLOSE)


@pytest.mark.parametrize("frames", [4, 11])
def test_papers(frames: int) -> None:
    """SAN's and HuMoT's numbers, and PAN's eq. 16 as it is typed."""
    case = sides(frames, 2)
    values = compute("papers", case)
    body = case.predicted.character
    h1 = tall(body)
    joints = index(body, SCORED)
    squares, cubes = [], []
    for p, g in list(zip(case.predicted.positions, case.expected.positions, strict=True))[
        : frames // 4 * 4
    ]:
        for j in joints:
            squares.append(distance(p[j], g[j]) ** 2)
            cubes += [((p[j][axis] - g[j][axis]) / h1) ** 2 for axis in range(3)]
    assert values["san_code"] == pytest.approx(1000 * sum(cubes) / len(cubes), **CLOSE)
    assert values["san_code_noself"] == values["san_code"]
    assert values["sqdist_h2"] == pytest.approx(1000 * np.mean(squares) / h1**2, **CLOSE)
    centimetres = [1e4 * square / (100 * h1) for square in squares]
    assert values["pan_eq16_mean"] == pytest.approx(np.mean(centimetres), **CLOSE)
    assert values["humot_mpjpe"] == pytest.approx(mean_distance(case, joints) / h1, **CLOSE)


def test_worked_example() -> None:
    """Everything 3 cm off to the side and 4 cm up: 5 cm, of a body of 1.6 m or so."""
    body = character()
    expected = motion(body, 8, 0)
    moved = expected.character.motion(expected.rotations, expected.root + np.array([0.03, 0.04, 0.0]), 30.0)
    case = Sides(expected, moved, expected)
    height = tall(body)
    values = compute("position", case) | compute("papers", case)
    assert values["mpjpe_h.world"] == pytest.approx(100 * 0.05 / height)
    assert values["mpjpe_h.root"] == pytest.approx(0.0, abs=1e-9)
    assert values["root_path.vertical"] == pytest.approx(100 * 0.04 / height)
    assert values["root_path.drift"] == pytest.approx(0.0, abs=1e-9)
    assert values["san_code"] == pytest.approx(1000 * 0.05**2 / 3 / height**2)
    assert values["pan_eq16_mean"] == pytest.approx(5.0**2 / (100 * height))


def test_short_clips_leave_out_what_they_cannot_say() -> None:
    case = sides(1, 0)
    assert "root_path.drift" not in compute("position", case)
    values = compute("papers", case)
    assert set(values) == {"humot_mpjpe"}


def test_fingers_and_props_count_only_when_both_bodies_have_them() -> None:
    case = sides(5, 1)
    assert set(compute("position", case)["mpjpe_h.joint"]) == set(SCORED)
    both = compute("position", replace(case, source=motion(character("A"), 5, 9)))["mpjpe_h.joint"]
    assert set(both) == {*SCORED, "LeftHandThumb1", "RightHandThumb1", "Hat"}
