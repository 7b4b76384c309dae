"""Comparison of two snapshots, row by row."""

import math
from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from enum import StrEnum
from typing import Any

import numpy as np

from retarget_bench.analysis.statistics import losses
from retarget_bench.verification.gate.golden import Snapshot, Table
from retarget_bench.verification.gate.method_rows import MEAN


class Status(StrEnum):
    """The result for a row, most severe first."""

    UNMEASURED = "could not measure"
    FAILING = "newly failing"
    WORSE = "worse"
    BETTER = "better"
    MOVED = "moved"
    INCOMPARABLE = "not comparable"
    NO_WORSE = "no worse"
    SAME = "same"


@dataclass(frozen=True)
class Tolerance:
    """The allowed difference of a number: ``absolute``, or ``relative`` times its size if that is more."""

    absolute: float
    relative: float

    def ratio(self, golden: float, now: float) -> float:
        """The difference in multiples of the tolerance; above 1 the number has moved."""
        apart, limit = abs(now - golden), max(self.absolute, self.relative * abs(golden))
        return apart / limit if limit else math.inf if apart else 0.0


EXACT = Tolerance(1e-9, 1e-9)
"""Of metrics on frozen motions. The same sums in another order, by another processor, differ by 1e-12."""
RELATIVE = 1e-6
"""Floor of deterministic methods, beside the metric's own tolerance: what is measured has been rounded to
single precision twice (motions as they are kept, predictions as files have them), 1e-7 each. Also that of
frozen inputs, whose intervals use quantiles that differ between versions of scipy."""
LEARNED = Tolerance(10.0, 1e-3)
"""Of methods with weights: ten metric tolerances, or a thousandth: networks run in single precision, and
their sums are taken in an order that differs between processors and versions of the library."""


@dataclass(frozen=True)
class Criteria:
    """Criteria of a check; by default nothing may move.

    values:     the ids of the values that count; none: all. Whether cases are answered always counts.
    worse_only: a method's numbers may get better, and those without a better side may move.
    tolerances: value id ("": all others) -> by how much a method's mean may differ. Such values are judged
                by their mean alone, where both sides have one.
    """

    values: Collection[str] = ()
    worse_only: bool = False
    tolerances: Mapping[str, Tolerance] = field(default_factory=dict)

    def asks(self, value: str) -> bool:
        return not self.values or value in self.values

    def tolerance(self, value: str) -> Tolerance | None:
        return self.tolerances.get(value, self.tolerances.get(""))


@dataclass(frozen=True)
class GateRow:
    """One row of the report: a value of a metric on one frozen prediction, or of a method on one split.

    subject: the method, ``frozen motions`` or ``frozen inputs``; where: the split, the prediction or the
    input; value: the value's id.
    before, after: the mean, or the number that moved most; ``ratio`` times the tolerance apart.
    family: the values that say the same: the part of the id before the dot, or the metric.
    size: by how much the number moved, in typical numbers of the value. worst: the number that moved most.
    """

    status: Status
    subject: str
    where: str = ""
    value: str = ""
    unit: str = ""
    before: float | None = None
    after: float | None = None
    ratio: float = 0.0
    why: str = ""
    family: str = ""
    size: float = 0.0
    worst: str = ""


EVERYTHING = Criteria()
FROZEN, INPUTS = "frozen motions", "frozen inputs"
NEW = "there is no golden row yet"


def compare(golden: Snapshot, now: Snapshot, asked: Criteria = EVERYTHING) -> list[GateRow]:
    """A line per row of either side, most severe first; unmeasured and changed lists included."""
    lines = [GateRow(Status.UNMEASURED, "", why=why) for why in now.missing]
    lines += _lists(golden, now)
    if golden.complete and now.complete:
        lines += _frozen(golden, now, asked)
    for label in now.methods:
        lines += _method(golden, now, label, asked)
    if asked.worse_only:
        lines = [_no_worse(line) for line in lines]
    typical = _typical(golden)
    lines = [_sized(line, typical.get(line.value, 0.0)) for line in lines]
    order = list(Status)
    return sorted(lines, key=lambda line: (order.index(line.status), -line.size))


def _no_worse(line: GateRow) -> GateRow:
    free = line.status is Status.BETTER or (
        line.status is Status.MOVED and line.subject not in (FROZEN, INPUTS)
    )
    return replace(line, status=Status.NO_WORSE) if free else line


def _typical(golden: Snapshot) -> dict[str, float]:
    """Value id -> the median size of its golden numbers: the means of methods, else those on motions."""
    found: dict[str, list[float]] = {}
    means = [
        row for table in golden.rows.values() for name, row in table.items() if name.endswith(f" {MEAN}")
    ]
    for row in means or golden.frozen.values():
        for column, number in row.items():
            found.setdefault(column.split("@", 1)[0], []).append(abs(number))
    return {value: float(np.median(numbers)) for value, numbers in found.items()}


def _sized(line: GateRow, typical: float) -> GateRow:
    if line.before is None or line.after is None:
        return line
    apart = abs(line.after - line.before)
    return replace(line, size=apart / (max(typical, abs(line.before)) or apart or 1.0))


def verdict(lines: Iterable[GateRow]) -> int:
    """0: all is the same; 1: something moved; 2: something could not be measured, or nothing was."""
    statuses = {line.status for line in lines}
    if not statuses or Status.UNMEASURED in statuses:
        return 2
    return int(not statuses <= {Status.SAME, Status.NO_WORSE})


# ------------------------------------------------------------------------------------------ protocols
def _lists(golden: Snapshot, now: Snapshot) -> Iterator[GateRow]:
    """Lists of cases that changed although the data set says that its content did not."""
    if _why_other_data(golden, now):
        return
    before, after = (each.dataset.get("lists", {}) for each in (golden, now))
    for split in sorted(before.keys() | after.keys()):
        old, new = (each.get(split, {"cases": 0, "hash": ""}) for each in (before, after))
        if old == new:
            continue
        status = Status.UNMEASURED if new["cases"] < old["cases"] else Status.INCOMPARABLE
        why = (
            f"its list of cases changed ({old['cases']} before, {new['cases']} now) though the data set "
            "claims to hold what it held"
        )
        yield GateRow(status, now.dataset.get("spec", ""), split, why=why)


def _why_other_data(golden: Snapshot, now: Snapshot) -> str:
    for name in ("name", "parameters", "content"):
        old, new = golden.dataset.get(name), now.dataset.get(name)
        if old != new and new is not None:
            return f"the data set is another: {old} before, {new} now"
    return ""


def _why_incomparable(golden: Snapshot, now: Snapshot, value: str) -> str:
    """The reason why a value's numbers cannot be compared, or ""."""
    old, new = golden.values.get(value), now.values.get(value)
    if old is None:
        return NEW
    if new is None:
        return ""
    metric = new["metric"]
    versions = golden.metrics.get(metric), now.metrics.get(metric)
    if versions[0] != versions[1]:
        return f"metric {metric} has version {versions[1]}, golden rows are of {versions[0]}"
    for name in new:
        if old.get(name) != new[name]:
            return f"protocol: {name} is {new[name]}, golden rows are of {old.get(name)}"
    return ""


# --------------------------------------------------------------------------------------------- frozen
def _frozen(golden: Snapshot, now: Snapshot, asked: Criteria) -> Iterator[GateRow]:
    changed = {file for file, hash_ in golden.motions.items() if now.motions.get(file) != hash_}
    for row in sorted(golden.frozen.keys() | now.frozen.keys()):
        old, new = golden.frozen.get(row, {}), now.frozen.get(row, {})
        file = f"{row.split('/')[0]}.npz"
        for value, columns in _by_value(asked, old, new):
            why = _why_incomparable(golden, now, value)
            if file in changed:
                why = f"the frozen motion {file} is another"
            fact = _fact(golden, now, value)
            part = fact.get("metric", "")
            of_metric = part in golden.metrics or part in now.metrics
            limit = EXACT if of_metric else Tolerance(EXACT.absolute, RELATIVE)
            if "networks" in fact:
                limit = Tolerance(fact["tolerance"], LEARNED.relative)
            pairs = [(_index(column), old.get(column), new.get(column), limit) for column in columns]
            failure = now.failures.get(f"{row} {part}", now.failures.get(part, ""))
            yield _line(FROZEN if of_metric else INPUTS, row, fact, pairs, why, failure)


# -------------------------------------------------------------------------------------------- methods
def _method(golden: Snapshot, now: Snapshot, label: str, asked: Criteria) -> Iterator[GateRow]:
    old_facts, facts = golden.methods.get(label), now.methods[label]
    reason = _why_other_data(golden, now)
    if old_facts is None:
        reason = NEW
    elif old_facts["weights"] != facts["weights"]:
        reason = f"other weights: {old_facts['weights'] or 'none'} before, {facts['weights'] or 'none'} now"
    before, after = golden.rows.get(label, {}), now.rows.get(label, {})
    if not before and not after:
        why = next(iter(now.problems.get(label, {}).values()), "no case gave a row")
        yield GateRow(Status.UNMEASURED, label, why=f"it answers nothing: {why}")
        return
    for split in now.smoke:
        if not reason and golden.smoke.get(split) != now.smoke[split]:
            yield GateRow(Status.INCOMPARABLE, label, split, why="other cases were asked")
            continue
        yield _answered(golden, now, label, split, reason)
        old, new = _of_split(before, split), _of_split(after, split)
        if not old and not new:
            continue
        # the cases answered before and now; with the mean where these are all, or there is none
        cases = sorted((old.keys() & new.keys()) - {MEAN})
        if not cases or old.keys() == new.keys():
            cases.append(MEAN)
        failure = _first_problem(golden, now, label, split)
        for value, columns in _by_value(asked, *old.values(), *new.values()):
            tolerance = now.values.get(value, {}).get("tolerance", EXACT.absolute)
            limit = Tolerance(tolerance, RELATIVE)
            if facts["weights"]:
                limit = Tolerance(LEARNED.absolute * tolerance, LEARNED.relative)
            if allowed := asked.tolerance(value):
                limit = Tolerance(
                    max(limit.absolute, allowed.absolute), max(limit.relative, allowed.relative)
                )
            pairs = [
                (case + _index(column), old.get(case, {}).get(column), new.get(case, {}).get(column), limit)
                for column in columns
                for case in cases
            ]
            why = reason or _why_incomparable(golden, now, value)
            by_mean = allowed is not None and MEAN in cases
            yield _line(label, split, _fact(golden, now, value), pairs, why, failure, by_mean)


def _answered(golden: Snapshot, now: Snapshot, label: str, split: str, reason: str) -> GateRow:
    """The line for the number of cases that the method answered."""
    old, new = (
        sum(f"{split} {case}" in each.rows.get(label, {}) for case in each.smoke.get(split, ()))
        for each in (golden, now)
    )
    status, why = Status.SAME, reason
    if reason:
        status = Status.INCOMPARABLE
    elif first := _first_problem(golden, now, label, split):
        status, why = Status.FAILING, first
    elif new > old:
        status = Status.BETTER
    return GateRow(status, label, split, "answered", "cases", float(old), float(new), why=why)


def _first_problem(golden: Snapshot, now: Snapshot, label: str, split: str) -> str:
    """The first case that was answered and is not any more, and why."""
    old, new = golden.problems.get(label, {}), now.problems.get(label, {})
    fresh = [row for row in new if row not in old and row.split(" ", 1)[0] == split]
    return f"{fresh[0].split(' ', 1)[1]}: {new[fresh[0]]}" if fresh else ""


def _of_split(table: Table, split: str) -> Table:
    """Case (or mean) -> columns."""
    return {row.split(" ", 1)[1]: each for row, each in table.items() if row.split(" ", 1)[0] == split}


# ----------------------------------------------------------------------------------------------- rows
Pair = tuple[str, float | None, float | None, Tolerance]
"""Name of a number, golden, now, and by how much it may differ."""


def _index(column: str) -> str:
    """The point of a curve that a column is for; "" for a value that is one number."""
    return " at " + column.split("@", 1)[1] if "@" in column else ""


def _by_value(asked: Criteria, *rows: Iterable[str]) -> Iterable[tuple[str, list[str]]]:
    """Value id -> its columns in any of the rows, of the values that are asked for."""
    found: dict[str, list[str]] = {}
    for column in sorted(set().union(*rows)):
        found.setdefault(column.split("@", 1)[0], []).append(column)
    return [(value, columns) for value, columns in found.items() if asked.asks(value)]


def _fact(golden: Snapshot, now: Snapshot, value: str) -> dict[str, Any]:
    facts = now.values.get(value) or golden.values.get(value) or {"unit": "", "better": "none"}
    return {**facts, "id": value}


def _line(
    subject: str,
    where: str,
    fact: Mapping[str, Any],
    pairs: list[Pair],
    why: str,
    failure: str,
    by_mean: bool = False,
) -> GateRow:
    """why: the numbers cannot be compared; failure: the error of values that are gone; by_mean: only means
    can have moved."""
    gone = [name for name, old, new, _ in pairs if old is not None and new is None]
    come = [name for name, old, new, _ in pairs if old is None and new is not None]
    both = [
        (limit.ratio(old, new), name, old, new)
        for name, old, new, limit in pairs
        if old is not None and new is not None
    ]
    moved = [each for each in both if not each[0] <= 1.0 and (_is_mean(each[1]) or not by_mean)]
    worst = ""
    ratio, _, before, after = max(both, default=(0.0, "", None, None))
    for _, name, old, new in moved or both:
        if _is_mean(name):  # the mean is shown where it moved, or nothing did
            before, after = old, new
            break
    status = Status.SAME
    if why:
        status = Status.INCOMPARABLE
    elif gone:
        status = Status.FAILING
        why = failure or "no value any more" + _first(gone)
    elif moved:
        status = Status.MOVED if subject in (FROZEN, INPUTS) else _direction(fact, before, after)
        _, most, old, new = max((each for each in both if not _is_mean(each[1])), default=max(moved))
        if len(both) > 1:
            worst = f"{most.strip()}: {old:.4g} -> {new:.4g}"
            why = f"{len(moved)} of {len(both)}, most {worst}"
    elif come:
        status, why = Status.MOVED, "a value where there was none" + _first(come)
    family = fact["id"].split(".")[0] if "." in fact["id"] else fact.get("metric", "")
    return GateRow(
        status, subject, where, fact["id"], fact["unit"], before, after, ratio, why, family, worst=worst
    )


def _is_mean(name: str) -> bool:
    return name.split(" at ")[0] == MEAN


def _first(names: list[str]) -> str:
    more = f" and {len(names) - 1} more" if len(names) > 1 else ""
    return f": {names[0].strip()}{more}" if names[0] else ""


def _direction(fact: Mapping[str, Any], before: float | None, after: float | None) -> Status:
    """Better or worse; a value that has no better side has moved."""
    if fact["better"] == "none":
        return Status.MOVED
    old, new = losses(np.array([before, after], dtype=float), fact["better"], fact.get("goal", 1.0))
    return Status.BETTER if new < old else Status.WORSE
