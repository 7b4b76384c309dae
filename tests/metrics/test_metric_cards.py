"""Every metric keeps its promises: declared ids, finite numbers, and nothing where nothing is known."""

from __future__ import annotations

import csv
import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest
from metric_cases import (
    GROUP_METRICS,
    MESH_METRICS,
    METRICS,
    SET_METRICS,
    TASK_METRICS,
    Sides,
    character,
    compute,
    everything,
    metric,
    sides,
)

from retarget_bench.plugins import registry
from retarget_bench.plugins.bound import declared_values
from retarget_bench.tables.builder import DEFAULT_COLUMNS, OVERVIEW_COLUMNS
from retarget_bench.verification.gate.golden import built_in, parsed, read

REFERENCE_FREE = {
    *(
        "contact_recall.speed_src",
        "contact_precision.speed_src",
        "contact_f1.speed_src",
        "foot_slide_src",
        "foot_slide_h_src",
    ),
    *("jerk", "acceleration", "jerk_ratio_src", "acceleration_ratio_src", "bone_drift"),
    *("penetration.rate", "penetration.mean", "penetration.max"),
    *("contact_recall_src", "contact_precision_src", "contact_f1_src", "contact_drift_src"),
    *(
        f"joint_{order}_excess{part}"
        for order in ("speed", "acceleration")
        for part in ("", ".clips", ".frames", ".joint")
    ),
}


def numbers(values: Mapping[str, float | Mapping[str, float]]) -> list[float]:
    return [
        number
        for value in values.values()
        for number in (value.values() if isinstance(value, Mapping) else [value])
    ]


def test_all_built_in_metrics_are_tested_here() -> None:
    built_in = {entry.name for entry in registry.names("metrics") if entry.origin == registry.BUILT_IN}
    assert built_in == {*METRICS, *SET_METRICS, *GROUP_METRICS, *TASK_METRICS, *MESH_METRICS}


@pytest.mark.parametrize("name", [*METRICS, *SET_METRICS, *GROUP_METRICS, *TASK_METRICS, *MESH_METRICS])
def test_card(name: str) -> None:
    card = metric(name).card
    assert card.name == name
    assert card.summary
    for value in card.values:
        assert all((value.label, value.meaning, value.unit, value.formula, value.source)), value.id
        assert len(value.meaning) <= 100, value.id
        assert "\n" not in value.formula
        assert value.tolerance > 0
        assert value.better in ("lower", "higher", "target", "none")


def test_ids_are_unique_and_the_first_columns_exist() -> None:
    declared = declared_values(
        metric(name) for name in (*METRICS, *SET_METRICS, *TASK_METRICS, *MESH_METRICS)
    )
    assert {*DEFAULT_COLUMNS, *OVERVIEW_COLUMNS} <= set(declared)


@pytest.mark.parametrize("frames", [1, 2, 3, 4, 30, 121])
@pytest.mark.parametrize("seed", [0, 1])
def test_values_are_declared_indexed_as_declared_and_finite(frames: int, seed: int) -> None:
    case = sides(frames, seed)
    for name in METRICS:
        declared = {value.id: value for value in metric(name).card.computed}
        values = compute(name, case)
        assert set(values) <= set(declared)
        for id_, value in values.items():
            assert isinstance(value, Mapping) == bool(declared[id_].index)
        assert all(type(number) is float and math.isfinite(number) for number in numbers(values))


def test_without_a_reference_only_what_needs_none() -> None:
    case = replace(sides(40, 0), expected=None)
    assert set(everything(case)) == REFERENCE_FREE
    declared = declared_values(metric(name) for name in METRICS)
    assert all("reference" not in declared[id_].needs for id_ in REFERENCE_FREE)


def still(frames: int) -> Sides:
    """Nobody moves."""
    body = character("Human")
    pose = np.zeros((frames, len(body.skeleton), 4))
    pose[..., 0] = 1.0
    return Sides(*(body.motion(pose, np.zeros((frames, 3)), 30.0) for _ in range(3)))


@pytest.mark.parametrize("frames", [1, 30])
def test_still_clips_have_no_ratios_and_no_infinities(frames: int) -> None:
    values = everything(still(frames))
    assert not {"jerk_ratio", "acceleration_ratio", "jerk_ratio_src", "acceleration_ratio_src"} & set(
        values
    )
    assert all(math.isfinite(number) for number in numbers(values))
    assert (values["mpjpe_h.world"], values.get("foot_slide", 0.0)) == (0.0, 0.0)


def test_bodies_without_any_role_are_compared_by_their_joints() -> None:
    """A chain of three joints that mean nothing: no feet, no hips, no paper's protocol."""
    rig = (("a", "", (0.0, 0.0, 0.0)), ("b", "a", (0.0, 50.0, 0.0)), ("c", "b", (0.0, 50.0, 10.0)))
    body = character("Snake", rig=rig)
    rng = np.random.default_rng(0)
    places = [body.positions(rng.normal(size=(10, 3, 3)), 30.0) for _ in range(3)]
    values = everything(Sides(*places))
    assert set(values["mpjpe_h.joint"]) == {"a", "b", "c"}
    anatomical = ("contact", "pan_recall", "pan_contact", "foot", "nkn", "floating", "ee_h")
    assert not any(id_.startswith(anatomical) for id_ in values)


def test_golden_rows_are_within_the_bounds_that_cards_declare() -> None:
    declared = declared_values(metric(name) for name in (*METRICS, *SET_METRICS, *TASK_METRICS))
    checked, outside = set(), []
    numbers = [
        (parsed(name)[2], text)
        for name, text in read(built_in()).facts.items()
        if name.startswith(("motion/", "clouds/"))
    ]
    for path in (built_in() / "rows").glob("*/*/*/*.csv"):
        with path.open(encoding="utf-8", newline="") as file:
            numbers += [(row.get("value_id"), row.get("value")) for row in csv.DictReader(file)]
    for name, text in numbers:
        if value := declared.get(name):
            checked.add(value.id)
            outside += [] if value.allows(float(text)) else [(name, text)]
    assert not outside
    assert checked >= {
        value.id for name in (*METRICS, *SET_METRICS) for value in metric(name).card.computed
    }


def test_bounds_follow_from_unit_and_direction_unless_declared() -> None:
    declared = declared_values(metric(name) for name in (*METRICS, *SET_METRICS))
    open_, shares = (0.0, math.inf), (0.0, 1.0)
    expected = {
        **{"mpjpe_h.world": open_, "jerk_ratio": open_, "fid.structure": open_, "density": open_},
        **{"contact_f1.speed": shares, "coverage": shares, "kid": (-math.inf, math.inf)},
        **{"penetration.rate": (0.0, 100.0), "rotation.local": (0.0, 180.0)},
    }
    assert {name: declared[name].bounds for name in expected} == expected
    recall = declared["contact_recall.speed"]
    assert [recall.allows(each) for each in (0.0, 1.0 + 1e-9, 7.0, -0.5, math.nan)] == [1, 1, 0, 0, 0]
