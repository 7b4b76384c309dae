"""Breakdowns of results: by pair, clip, kind, structure, level, joint, training or time."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, Literal

import numpy as np

from retarget_bench.analysis.ranking import doubt
from retarget_bench.errors import BenchError
from retarget_bench.motion.roles import BODY_PARTS
from retarget_bench.results import case_metadata, compatibility, store
from retarget_bench.results.header import DeclaredValue
from retarget_bench.results.result_matrix import ResultMatrix
from retarget_bench.results.rows import Key
from retarget_bench.results.store import ResultPaths

By = Literal["pair", "clip", "kind", "structure", "level", "joint", "part", "seen", "second", "threshold"]
CURVES: tuple[By, ...] = ("second", "threshold")
"""Indices of curves: a breakdown by one of them has a line per point."""
UNKNOWN = "unknown"


def breakdown(matrix: ResultMatrix, by: By) -> list[ResultMatrix]:
    """A matrix per group, in alphabetical order (body parts from the trunk outwards, levels in theirs).

    ``joint`` and ``part`` have the values that are known per joint, averaged within a case over the
    joints of the group; ``second`` and ``threshold`` split curves into their points, in increasing order.
    Raises BenchError where the results lack the metadata that the breakdown needs.
    """
    if by in CURVES:
        return _by_point(matrix, by)
    if by in ("joint", "part"):
        return _by_joint(matrix, by)
    if by == "seen":
        names = _seen_groups(matrix)
    elif by in ("structure", "level"):
        groups = structures_of(matrix) if by == "structure" else _levels(matrix)
        names = np.array([groups[info.id] for info in matrix.cases])
    else:
        names = np.array([str(getattr(info, by)) or UNKNOWN for info in matrix.cases])
    order = dict.fromkeys(groups.values()) if by == "level" else sorted(set(names.ravel().tolist()))
    return [matrix.restricted(names == name, name) for name in order]


# -------------------------------------------------------------------------------------- case metadata
def structures_of(matrix: ResultMatrix) -> dict[str, str]:
    """Case -> structure of its target, sorted by structure. Raises BenchError where results lack it."""
    structures: dict[str, str] = {}
    for row in matrix.rows:
        own = case_metadata.read(row.paths).structures
        if not own:
            raise BenchError(
                f"{row.paths.folder} lacks the structures of the bodies; bench run --overwrite always "
                "writes them"
            )
        structures |= own
    groups = {info.id: structures.get(info.target, UNKNOWN) for info in matrix.cases}
    return dict(sorted(groups.items(), key=lambda pair: pair[1]))


def _levels(matrix: ResultMatrix) -> dict[str, str]:
    """Case -> its level, in the order of levels."""
    from retarget_bench.evaluation.tasks import definitions

    conditions = {
        case: each for row in matrix.rows for case, each in case_metadata.read(row.paths).conditions.items()
    }
    if not conditions:
        raise BenchError(
            f"{matrix.dataset}, {matrix.split}: these cases have no levels; those of the tasks "
            "denoise and joint-completion do"
        )
    ordered = sorted(matrix.cases, key=lambda info: definitions.level_order(conditions.get(info.id, {})))
    return {info.id: definitions.level_name(conditions.get(info.id, {})) for info in ordered}


# ---------------------------------------------------------------------------------------------- joints
def _by_joint(matrix: ResultMatrix, by: By) -> list[ResultMatrix]:
    values = _indexed(matrix, "joint", "value per joint")
    newest = compatibility.newest(row.header for row in matrix.rows)
    draws: list[list[dict[str, dict[Key, np.ndarray]]]] = []
    for row in matrix.rows:
        fresh = {key for key in values if not newest.why_value_outdated(row.header, key)}
        fresh = set() if newest.why_outdated(row.header) else fresh
        parts = case_metadata.read(row.paths).parts if by == "part" else None
        if parts is not None and not parts:
            raise BenchError(
                f"{row.paths.folder} lacks the body parts of the joints; bench run --overwrite always "
                "writes them"
            )
        draws.append([_joint_means(matrix, place, fresh, parts) for place in row.all_paths])
    groups = {group for row in draws for draw in row for group in draw}
    order = {part: rank for rank, part in enumerate(BODY_PARTS)}
    return [
        _with_runs(matrix, values, group, [[draw.get(group, {}) for draw in row] for row in draws])
        for group in sorted(groups, key=lambda name: (order.get(name, len(order)), name))
    ]


def _indexed(matrix: ResultMatrix, index: str, what: str) -> dict[str, DeclaredValue]:
    """The values of this index, declared as values without one; those that references break rank nobody.
    Raises BenchError where there is none."""
    values = {
        key: replace(each, index="", better="none" if doubt(matrix, key) else each.better)
        for key, each in matrix.values.items()
        if each.index == index
    }
    if not values:
        raise BenchError(f"{matrix.dataset}, {matrix.split}: there is no {what}; bench run computes them")
    return values


def _with_runs(
    matrix: ResultMatrix,
    values: Mapping[str, DeclaredValue],
    part: str,
    runs: Sequence[Sequence[Mapping[Key, np.ndarray]]],
) -> ResultMatrix:
    """A part of a matrix: these values and these numbers of the runs of every row."""
    rows = (replace(row, runs=tuple(each)) for row, each in zip(matrix.rows, runs, strict=True))
    return replace(matrix, values=values, part=part, rows=tuple(rows))


def _joint_means(
    matrix: ResultMatrix,
    place: ResultPaths,
    values: set[str],
    parts: Mapping[str, Mapping[str, str]] | None,
) -> dict[str, dict[Key, np.ndarray]]:
    """Group -> (value id, "") -> ``(cases,)``: the mean over the joints of the group.

    parts: target -> joint -> group; None: each joint is a group.
    """
    position = {info.id: number for number, info in enumerate(matrix.cases)}
    means_of: dict[str, dict[Key, np.ndarray]] = {}
    stored = store.read_results(place, arrays=True)
    here = [number for number, info in enumerate(stored.infos) if info.id in position]  # of these bodies
    place_of = [position[stored.infos[number].id] for number in here]
    for value in sorted(values):
        joints = sorted(joint for key, joint in stored.numbers if key == value)
        if not joints:
            continue
        table = np.stack([stored.numbers[value, joint][here] for joint in joints], axis=1)
        case, joint = np.nonzero(~np.isnan(table))
        at = np.array(place_of, dtype=np.int64)[case]
        pairs = zip(at.tolist(), joint.tolist(), strict=True)
        names = [
            joints[j] if parts is None else parts.get(matrix.cases[c].target, {}).get(joints[j], UNKNOWN)
            for c, j in pairs
        ]
        groups, group = np.unique(names, return_inverse=True)
        shape = len(groups), len(matrix.cases)
        flat = group * len(matrix.cases) + at
        counts = np.bincount(flat, minlength=shape[0] * shape[1]).reshape(shape)
        totals = np.bincount(flat, table[case, joint], shape[0] * shape[1]).reshape(shape)
        with np.errstate(invalid="ignore"):
            means = totals / counts
        for name, row in zip(groups.tolist(), means, strict=True):
            means_of.setdefault(name, {})[value, ""] = row
    return means_of


# -------------------------------------------------------------------------------------------- curves
def _by_point(matrix: ResultMatrix, by: By) -> list[ResultMatrix]:
    values = _indexed(matrix, by, f"curve over {by}")
    points = {index for value, index in matrix.keys if value in values}
    return [
        _with_runs(
            matrix,
            values,
            point,
            [
                [{(v, ""): draw[v, point] for v in values if (v, point) in draw} for draw in row.runs]
                for row in matrix.rows
            ],
        )
        for point in sorted(points, key=_number)
    ]


def _number(point: str) -> tuple[float, str]:
    """Sort key of a point of a curve; points that are not numbers come last."""
    try:
        return float(point), ""
    except ValueError:
        return math.inf, point


def lasting(matrix: ResultMatrix, seconds: int) -> ResultMatrix:
    """The cases of at least this many whole seconds.

    Durations are read from curves over seconds. Raises BenchError where results have no such curve.
    """
    curves = {key for key, value in matrix.values.items() if value.index == "second"}
    if not curves:
        raise BenchError(
            f"{matrix.dataset}, {matrix.split}: the durations of clips are unknown; bench run adds them "
            "(growth.world)"
        )
    long_enough = np.zeros(len(matrix.cases), dtype=bool)
    for value, index in matrix.keys:
        if value in curves and _number(index)[0] >= seconds:
            long_enough |= ~np.isnan(matrix.numbers((value, index))).all(axis=0)
    return matrix.restricted(long_enough, f"{seconds} s and longer")


# ------------------------------------------------------------------------------------------------ seen
def _seen_groups(matrix: ResultMatrix) -> np.ndarray:
    """``(methods, cases)`` whether characters and motion were seen in training (the four groups of NKN).

    A trained method is split by the training data of its own weights; an untrained one by the data set's
    own training part, or else by that of the first trained method.
    """
    manifests = [row.header.method.trained_on for row in matrix.rows]
    fallback: Any = next((each for each in manifests if each), None)
    names = []
    for row, manifest in zip(matrix.rows, manifests, strict=True):
        unseen = None if manifest else case_metadata.read(row.paths).unseen
        if unseen is None and not (manifest or fallback):
            raise BenchError(
                f"{row.paths.folder} lacks what was seen in training; the data set has no training part, "
                "or the results are older than this metadata (bench run --overwrite always writes it)"
            )
        groups = []
        for info in matrix.cases:
            if unseen is None:
                new = case_metadata.not_in(manifest or fallback, info)
            else:
                new = unseen.get(info.id, frozenset())
            who = "new" if new & {"source", "target"} else "known"
            groups.append(f"{who} characters, {'new' if 'kind' in new else 'known'} motion")
        names.append(groups)
    return np.array(names)
