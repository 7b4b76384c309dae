"""One panel into several: by pair, clip, kind of performance, structure, level, joint, body part, what
training had, or the points of a curve; and the part of it that is long."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping
from dataclasses import replace
from typing import Any, Literal

import numpy as np

from retarget_bench.api import CaseInfo
from retarget_bench.errors import BenchError, FileError
from retarget_bench.evaluation.tasks import levels
from retarget_bench.motion.roles import BODY_PARTS
from retarget_bench.results import case_metadata, compatibility, store
from retarget_bench.results.columns import Key
from retarget_bench.results.result_matrix import MethodRow, ResultMatrix
from retarget_bench.results.store import ResultPaths

By = Literal["pair", "clip", "kind", "structure", "level", "joint", "part", "seen", "second", "threshold"]
CURVES: tuple[By, ...] = ("second", "threshold")
"""What a value may be a curve over, a row of the results per point; a line each in a table."""
UNKNOWN = "unknown"
NameOf = Callable[[str, str], str]
"""From a target and one of its joints to the group of the joint."""


def breakdown(panel: ResultMatrix, by: By) -> list[ResultMatrix]:
    """A panel per group, in alphabetical order (body parts from the trunk outwards).

    ``joint`` and ``part`` have the values that are known per joint, averaged within a case over the
    joints of the group; ``second`` and ``threshold`` the curves over those, point by point in increasing
    order. Raises BenchError where the results do not know what is asked for.
    """
    if by in CURVES:
        return _by_point(panel, by)
    if by in ("joint", "part"):
        return _by_joint(panel, by)
    if by == "seen":
        return _by_seen(panel)
    if by in ("structure", "level"):
        return _by_mark(panel, structures_of(panel) if by == "structure" else _levels(panel))
    names = np.array([str(getattr(info, by)) or UNKNOWN for info in panel.cases])
    return [panel.restricted(names == name, name) for name in sorted(set(names.tolist()))]


# ----------------------------------------------------------------------------------------------- marks
def _by_mark(panel: ResultMatrix, groups: Mapping[str, str]) -> list[ResultMatrix]:
    """A panel per group; case -> its group, in the order in which groups are to stand."""
    names = np.array([groups[info.id] for info in panel.cases])
    return [panel.restricted(names == name, name) for name in dict.fromkeys(groups.values())]


def structures_of(panel: ResultMatrix) -> dict[str, str]:
    """Case -> the structure of its target, by name. Raises BenchError where results do not say it."""
    found: dict[str, str] = {}
    for row in panel.rows:
        mine = case_metadata.read_structures(row.place)
        if mine is None:
            raise BenchError(
                f"{row.place.folder} does not say of what structure the bodies are; bench run --redo "
                "always writes it"
            )
        found |= mine
    groups = {info.id: found.get(info.target, UNKNOWN) for info in panel.cases}
    return dict(sorted(groups.items(), key=lambda pair: pair[1]))


def _levels(panel: ResultMatrix) -> dict[str, str]:
    conditions = {
        case: each for row in panel.rows for case, each in case_metadata.read_conditions(row.place).items()
    }
    if not conditions:
        raise BenchError(
            f"{panel.dataset}, {panel.split}: these cases have no levels; those of bench task denoise "
            "and upsample have"
        )
    ordered = sorted(panel.cases, key=lambda info: levels.order(conditions.get(info.id, {})))
    return {info.id: levels.name(conditions.get(info.id, {})) for info in ordered}


# ---------------------------------------------------------------------------------------------- joints
def _by_joint(panel: ResultMatrix, by: By) -> list[ResultMatrix]:
    values = {key: value for key, value in panel.values.items() if value.index == "joint"}
    if not values:
        raise BenchError(f"{panel.dataset}, {panel.split}: no value is known per joint; run bench score")
    newest = compatibility.newest(row.header for row in panel.rows)
    draws: list[list[dict[str, dict[Key, np.ndarray]]]] = []
    for row in panel.rows:
        fresh = {key for key in values if not newest.stale_value(row.header, key)}
        fresh = set() if newest.stale_data(row.header) else fresh
        name_of = _part_of(row) if by == "part" else _own_name
        draws.append([_joint_means(panel, place, fresh, name_of) for place in row.places])
    groups = {group for row in draws for draw in row for group in draw}
    order = {part: rank for rank, part in enumerate(BODY_PARTS)}
    plain = {key: replace(value, index="") for key, value in values.items()}
    return [
        replace(
            panel,
            values=plain,
            part=group,
            rows=tuple(
                replace(row, draws=tuple(draw.get(group, {}) for draw in each))
                for row, each in zip(panel.rows, draws, strict=True)
            ),
        )
        for group in sorted(groups, key=lambda name: (order.get(name, len(order)), name))
    ]


def _part_of(row: MethodRow) -> NameOf:
    parts = case_metadata.read_parts(row.place)
    if parts is None:
        raise BenchError(
            f"{row.place.folder} does not say which joint belongs to which part of the body; "
            "bench run --redo always, or bench score, writes it"
        )
    return lambda target, joint: parts.get((target, joint), UNKNOWN)


def _own_name(target: str, joint: str) -> str:
    del target
    return joint


def _joint_means(
    panel: ResultMatrix, place: ResultPaths, values: set[str], name_of: NameOf
) -> dict[str, dict[Key, np.ndarray]]:
    """Group -> (value id, "") -> ``(cases,)``: the mean over the joints of the group."""
    position = {info.id: number for number, info in enumerate(panel.cases)}
    found: dict[str, dict[Key, np.ndarray]] = {}
    arrays = store.read_arrays(place)
    for value in sorted(values):
        if f"{value}:values" not in arrays:
            continue
        cases, case = np.unique(arrays[f"{value}:cases"], return_inverse=True)
        joints, joint = np.unique(arrays[f"{value}:index"], return_inverse=True)
        if strangers := [name for name in cases.tolist() if name not in position]:
            raise FileError(place.arrays, f"names case {strangers[0]!r}, which {place.cases} does not list")
        at = np.array([position[name] for name in cases.tolist()], dtype=np.int64)[case]
        pairs, pair = np.unique(at * len(joints) + joint, return_inverse=True)
        names = [name_of(panel.cases[p // len(joints)].target, str(joints[p % len(joints)])) for p in pairs]
        groups, group = np.unique(names, return_inverse=True)
        shape = len(groups), len(panel.cases)
        flat = group[pair] * len(panel.cases) + at
        counts = np.bincount(flat, minlength=shape[0] * shape[1]).reshape(shape)
        totals = np.bincount(flat, arrays[f"{value}:values"], shape[0] * shape[1]).reshape(shape)
        with np.errstate(invalid="ignore"):
            means = totals / counts
        for name, row in zip(groups.tolist(), means, strict=True):
            found.setdefault(name, {})[value, ""] = row
    return found


# -------------------------------------------------------------------------------------------- curves
def _by_point(panel: ResultMatrix, by: By) -> list[ResultMatrix]:
    values = {key: replace(value, index="") for key, value in panel.values.items() if value.index == by}
    if not values:
        raise BenchError(f"{panel.dataset}, {panel.split}: no value is a curve over {by}; run bench score")
    points = {index for value, index in panel.keys if value in values}
    return [
        replace(
            panel,
            values=values,
            part=point,
            rows=tuple(
                replace(row, draws=tuple(_at_point(draw, values, point) for draw in row.draws))
                for row in panel.rows
            ),
        )
        for point in sorted(points, key=_number)
    ]


def _number(point: str) -> tuple[float, str]:
    """Sorts the points of a curve: what is no number comes last."""
    try:
        return float(point), ""
    except ValueError:
        return math.inf, point


def _at_point(draw: Mapping[Key, np.ndarray], values: Collection[str], point: str) -> dict[Key, np.ndarray]:
    return {(value, ""): draw[value, point] for value in values if (value, point) in draw}


def lasting(panel: ResultMatrix, seconds: int) -> ResultMatrix:
    """The cases that last so many whole seconds, as curves over seconds tell.

    Raises BenchError where results have no such curve.
    """
    curves = {key for key, value in panel.values.items() if value.index == "second"}
    if not curves:
        raise BenchError(
            f"{panel.dataset}, {panel.split}: results do not say how long clips last; bench score adds it "
            "(growth.world)"
        )
    kept = np.zeros(len(panel.cases), dtype=bool)
    for value, index in panel.keys:
        if value in curves and _number(index)[0] >= seconds:
            kept |= ~np.isnan(panel.numbers((value, index))).all(axis=0)
    return panel.restricted(kept, f"{seconds} s and longer")


# ------------------------------------------------------------------------------------------------ seen
def _by_seen(panel: ResultMatrix) -> list[ResultMatrix]:
    """By whether training had the characters and the motion (NKN's four groups).

    What counts is what a method's own weights were trained on; for untrained methods the marks of the
    data set, or where it has none those of the first trained method.
    """
    manifests = [row.header.method.trained_on for row in panel.rows]
    fallback: Any = next((each for each in manifests if each), None)
    names = []
    for row, manifest in zip(panel.rows, manifests, strict=True):
        unseen = None if manifest else case_metadata.read_unseen(row.place)
        if unseen is None and not (manifest or fallback):
            raise BenchError(
                f"{row.place.folder} does not say what training had; the data set does not know it, or "
                "the results are older than these marks (bench run --redo always writes them)"
            )
        names.append([_seen_group(unseen, manifest or fallback, case) for case in panel.cases])
    table = np.array(names)
    return [panel.restricted(table == name, name) for name in sorted(set(table.ravel().tolist()))]


def _seen_group(unseen: Mapping[str, frozenset[str]] | None, manifest: Any, info: CaseInfo) -> str:
    new = case_metadata.not_in(manifest, info) if unseen is None else unseen.get(info.id, frozenset())
    who = "new" if new & {"source", "target"} else "known"
    return f"{who} characters, {'new' if 'kind' in new else 'known'} motion"
