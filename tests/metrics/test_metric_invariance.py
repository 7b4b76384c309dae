"""Each value moves, or does not move, with scale, turns and shifts as its formula says."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from metric_cases import METRICS, Sides, everything, labelled, metric, moved
from metric_cases import sides as unlabelled

from retarget_bench.motion import rotation
from tests.examples import examples

Values = dict[str, float | Mapping[str, float]]

IDS = {value.id for name in METRICS for value in metric(name).card.computed}
FAMILY = {value.id: name for name in METRICS for value in metric(name).card.computed}

FIXED_LENGTHS = {
    "pan_recall",
    "pan_contact_precision",
    "pan_contact_f1",
    "penetration.rate",
    "floating.rate",
}
"""Values with a threshold in centimetres: they change with scale in no simple way."""
LENGTHS = {"pan_eq16_mean", "nkn_mse_h", "nkn_mse_local", "foot_slide", "foot_slide_src"} | {
    *("penetration.mean", "penetration.max", "floating.mean", "acc", "acceleration", "jerk"),
    *("pa_acc", "pa_acc.rigid"),
}
"""Values that grow with scale; all others do not feel it."""
UPRIGHT = {
    "root_path.horizontal",
    "root_path.vertical",
    "root_path.drift",
    "nkn_mse_h",
    "nkn_mse_local",
    "mpjpe_h.path_fitted",
    "path_fit.level",
    "path_fit.lift",
} | {id_ for id_, family in FAMILY.items() if family in ("slide", "ground", "contact")}
"""Values that know which way is up."""
OWN_MOTION = {
    id_
    for id_, family in FAMILY.items()
    if family in ("contact_speed", "joint_speed", "pan_contact", "smoothness", "touch") and id_ != "acc"
}
"""Values that do not feel where in the world, and which way round, the prediction alone is performed."""

seeds = st.integers(0, 10_000)
coordinates = st.floats(-5.0, 5.0)
shifts = st.tuples(coordinates, coordinates, coordinates).map(np.array)
angles = st.floats(-3.0, 3.0)
turns = st.tuples(angles, angles, angles).map(lambda v: rotation.from_rotation_vector(np.array(v)))
few = examples(12)

FRAMES = 125


def sides(frames: int, seed: int, scale: float = 0.01) -> Sides:
    """A random case with labels of contacts and touches."""
    return labelled(unlabelled(frames, seed, scale=scale), seed)


def all_moved(case: Sides, turn: np.ndarray, shift: np.ndarray) -> Sides:
    return replace(
        case,
        source=moved(case.source, turn, shift),
        predicted=moved(case.predicted, turn, shift),
        expected=moved(case.expected, turn, shift),
    )


def alone_moved(case: Sides, turn: np.ndarray, shift: np.ndarray) -> Sides:
    return replace(case, predicted=moved(case.predicted, turn, shift))


def assert_same(before: Values, after: Values, ids: set[str], factor: float = 1.0) -> None:
    for id_ in sorted(ids):
        numbers = before[id_] if isinstance(before[id_], Mapping) else {"": before[id_]}
        others = after[id_] if isinstance(after[id_], Mapping) else {"": after[id_]}
        expected = {key: number * factor for key, number in numbers.items()}
        assert others == pytest.approx(expected, rel=1e-6, abs=1e-7), id_


def assert_felt(before: Values, after: Values, ids: set[str]) -> None:
    for id_ in sorted(ids):
        assert after[id_] != pytest.approx(before[id_], rel=1e-4), id_


def test_the_random_case_has_every_value() -> None:
    assert set(everything(sides(FRAMES, 0))) == IDS


@few
@given(seed=seeds, factor=st.floats(0.1, 10.0))
def test_scale(seed: int, factor: float) -> None:
    before, after = everything(sides(FRAMES, seed)), everything(sides(FRAMES, seed, scale=0.01 * factor))
    present = set(before) & set(after)
    assert_same(before, after, present & LENGTHS, factor)
    assert_same(before, after, present - LENGTHS - FIXED_LENGTHS)


@few
@given(seed=seeds, angle=angles, x=coordinates, z=coordinates)
def test_turning_the_stage_about_the_vertical_changes_nothing(
    seed: int, angle: float, x: float, z: float
) -> None:
    case = sides(FRAMES, seed)
    turn = rotation.from_rotation_vector(np.array([0.0, angle, 0.0]))
    shift = np.array([x, 0.0, z])
    before, after = everything(case), everything(all_moved(case, turn, shift))
    assert set(before) == set(after)
    assert_same(before, after, set(before))
    plants = {id_ for id_ in before if FAMILY[id_] == "contact"}  # where on a flat floor does not matter
    assert_same(before, everything(alone_moved(case, turn, shift)), plants)


@few
@given(seed=seeds, turn=turns, shift=shifts)
def test_any_turn_of_the_stage_is_felt_only_by_what_knows_up(
    seed: int, turn: np.ndarray, shift: np.ndarray
) -> None:
    case = sides(FRAMES, seed)
    before, after = everything(case), everything(all_moved(case, turn, shift))
    assert_same(before, after, set(before) - UPRIGHT)


def test_a_tilted_stage_is_felt_by_what_knows_up() -> None:
    case = sides(FRAMES, 1)
    tilt = rotation.from_rotation_vector(np.array([1.2, 0.0, 0.5]))
    before, after = everything(case), everything(all_moved(case, tilt, np.zeros(3)))
    # this prediction never stands where its source does, tilted or not
    shares = {"contact_recall_src", "contact_precision_src", "contact_f1_src"}
    assert_felt(before, after, UPRIGHT - shares)


@few
@given(seed=seeds, turn=turns, shift=shifts)
def test_the_prediction_alone_may_be_elsewhere(seed: int, turn: np.ndarray, shift: np.ndarray) -> None:
    case = sides(FRAMES, seed)
    before, after = everything(case), everything(alone_moved(case, turn, shift))
    fits = {id_ for id_, family in FAMILY.items() if family == "procrustes"}
    assert_same(before, after, (fits | OWN_MOTION) & set(before))


def test_a_prediction_that_is_elsewhere_is_felt_by_errors_in_the_world() -> None:
    case = sides(FRAMES, 2)
    turn = rotation.from_rotation_vector(np.array([0.0, 1.0, 0.0]))
    before, after = everything(case), everything(alone_moved(case, turn, np.array([1.0, 0.2, 0.0])))
    felt = {
        "mpjpe_h.world",
        "mpjpe_h.root",
        "growth.world",
        "growth.pose",
        "ee_h.world",
        "ee_h.root",
        "san_code",
        "humot_mpjpe",
    }
    assert_felt(
        before, after, felt | {"star", "rotation.local", "rotation.world", "acc", "root_path.drift"}
    )


@few
@given(seed=seeds, shift=shifts)
def test_pose_errors_do_not_feel_the_path(seed: int, shift: np.ndarray) -> None:
    case = sides(FRAMES, seed)
    drift = np.linspace(0.0, 1.0, FRAMES)[:, None] * shift
    drifting = alone_moved(case, rotation.identity(1)[0], drift)
    before, after = everything(case), everything(drifting)
    pose = {
        "mpjpe_h.root",
        "mpjpe_h.joint",
        "growth.pose",
        "ee_h.root",
        "rotation.local",
        "rotation.world",
        "rotation.joint",
        "touch_gap",
        "touch_recall",
    }
    assert_same(before, after, pose | {"pa_mpjpe.rigid", "pa_mpjpe.similarity"})


@few
@given(seed=seeds)
def test_positions_say_the_same_as_rotations(seed: int) -> None:
    case = sides(FRAMES, seed)
    before, after = everything(case), everything(case.by_positions())
    by_turns = {id_ for id_, family in FAMILY.items() if family in ("joint_speed", "rotation", "touch")}
    assert set(before) - set(after) == by_turns & set(before)  # speeds are left out of restless references
    assert after == {id_: before[id_] for id_ in after}


@few
@given(seed=seeds)
def test_the_reference_itself_is_perfect(seed: int) -> None:
    case = sides(FRAMES, seed)
    values = everything(replace(case, predicted=case.expected))
    perfect = ("growth", "position", "papers", "procrustes", "rotation")
    errors = {id_ for id_, family in FAMILY.items() if family in perfect}
    assert_same(values, values, errors, 0.0)
    assert values["star"] == 0.0
    for id_ in (
        "contact_recall.speed",
        "contact_precision.speed",
        "contact_f1.speed",
        "jerk_ratio",
        "acceleration_ratio",
    ):
        assert values[id_] == pytest.approx(1.0)
    assert (values["acc"], values["floating.rate"]) == (0.0, 0.0)
