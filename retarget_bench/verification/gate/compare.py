"""Comparison of two snapshots, row by row."""

import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

from retarget_bench.verification.gate.method_rows import MEAN
from retarget_bench.verification.gate.snapshot import Snapshot
from retarget_bench.verification.gate.table import Table, value_id


class Status(StrEnum):
    """The result for a row, gravest first."""

    UNMEASURED = "could not measure"
    FAILING = "newly failing"
    WORSE = "worse"
    BETTER = "better"
    MOVED = "moved"
    INCOMPARABLE = "not comparable"
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
single precision twice (motions as they are kept, predictions as files have them), 1e-7 each."""
LEARNED = Tolerance(10.0, 1e-3)
"""Of methods with weights: ten metric tolerances, or a thousandth: networks run in single precision, and
their sums are taken in an order that differs between processors and versions of the library."""


@dataclass(frozen=True)
class GateRow:
    """One row of the report: a value of a metric on one frozen prediction, or of a method on one split.

    subject: the method, or ``frozen motions``; where: the split, or the prediction; value: the value's id.
    before, after: the mean, or the number that moved most; ``ratio`` times the tolerance apart.
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


FROZEN = "frozen motions"
NEW = "there is no golden row yet"


def compare(golden: Snapshot, now: Snapshot) -> list[GateRow]:
    """A line per row of either side, gravest first; unmeasured and changed lists included."""
    lines = [GateRow(Status.UNMEASURED, "", why=why) for why in now.missing]
    lines += _lists(golden, now)
    if golden.complete and now.complete:
        lines += _frozen(golden, now)
    for label in now.methods:
        lines += _method(golden, now, label)
    order = list(Status)
    return sorted(lines, key=lambda line: (order.index(line.status), -line.ratio))


def verdict(lines: Iterable[GateRow]) -> int:
    """0: all is the same; 1: something moved; 2: something could not be measured, or nothing was."""
    statuses = {line.status for line in lines}
    if not statuses or Status.UNMEASURED in statuses:
        return 2
    return int(statuses != {Status.SAME})


# ------------------------------------------------------------------------------------------ protocols
def _lists(golden: Snapshot, now: Snapshot) -> Iterator[GateRow]:
    """Lists of cases that changed although the data set says that its content did not."""
    if _data_moved(golden, now):
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


def _data_moved(golden: Snapshot, now: Snapshot) -> str:
    for name in ("name", "parameters", "content"):
        old, new = golden.dataset.get(name), now.dataset.get(name)
        if old != new and new is not None:
            return f"the data set is another: {old} before, {new} now"
    return ""


def _value_moved(golden: Snapshot, now: Snapshot, value: str) -> str:
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
def _frozen(golden: Snapshot, now: Snapshot) -> Iterator[GateRow]:
    changed = {name.rsplit(".", 1)[0] for name, hash_ in _union(golden.motions, now.motions) if hash_}
    for row in sorted(golden.frozen.keys() | now.frozen.keys()):
        old, new = golden.frozen.get(row, {}), now.frozen.get(row, {})
        file = row.split("/")[0]
        for value, columns in _by_value(old, new):
            why = _value_moved(golden, now, value)
            if file in changed and f"{file}.npz" in golden.motions:
                why = f"the frozen motion {file}.npz is another"
            fact = _fact(golden, now, value)
            metric = fact.get("metric")
            limit = Tolerance(fact["tolerance"], LEARNED.relative) if "networks" in fact else EXACT
            failure = now.failures.get(f"{row} {metric}", "")
            yield _line(
                FROZEN,
                row,
                fact,
                [(_index(column), old.get(column), new.get(column), limit) for column in columns],
                why,
                failure,
            )


def _union(old: Mapping[str, str], new: Mapping[str, str]) -> Iterator[tuple[str, bool]]:
    """Name -> whether the two differ."""
    for name in old.keys() | new.keys():
        yield name, old.get(name) != new.get(name)


# -------------------------------------------------------------------------------------------- methods
def _method(golden: Snapshot, now: Snapshot, label: str) -> Iterator[GateRow]:
    old_facts, facts = golden.methods.get(label), now.methods[label]
    reason = _data_moved(golden, now)
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
        cases = _common(old, new)
        for value, columns in _by_value(_merged(old), _merged(new)):
            limit = _limit(now, value, bool(facts["weights"]))
            pairs = [
                (case + _index(column), old.get(case, {}).get(column), new.get(case, {}).get(column), limit)
                for column in columns
                for case in cases
            ]
            why = reason or _value_moved(golden, now, value)
            failure = _first_problem(golden, now, label, split)
            yield _line(label, split, _fact(golden, now, value), pairs, why, failure)


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
    parts = {tuple(row.split(" ", 1)): columns for row, columns in table.items()}
    return {case: columns for (of, case), columns in parts.items() if of == split}


def _common(old: Table, new: Table) -> list[str]:
    """The cases answered before and now; with the mean where these are all, or there is none."""
    both = sorted((old.keys() & new.keys()) - {MEAN})
    return [*both, MEAN] if not both or old.keys() == new.keys() else both


def _merged(table: Table) -> dict[str, float]:
    return {column: number for row in table.values() for column, number in row.items()}


def _limit(now: Snapshot, value: str, learned: bool) -> Tolerance:
    tolerance = now.values.get(value, {}).get("tolerance", EXACT.absolute)
    if learned:
        return Tolerance(LEARNED.absolute * tolerance, LEARNED.relative)
    return Tolerance(tolerance, RELATIVE)


# ----------------------------------------------------------------------------------------------- rows
Pair = tuple[str, float | None, float | None, Tolerance]
"""Name of a number, golden, now, and by how much it may differ."""


def _index(column: str) -> str:
    """The point of a curve that a column is for; "" for a value that is one number."""
    return " at " + column.split("@", 1)[1] if "@" in column else ""


def _by_value(old: Iterable[str], new: Iterable[str]) -> Iterator[tuple[str, list[str]]]:
    """Value id -> its columns on either side."""
    found: dict[str, list[str]] = {}
    for column in sorted({*old, *new}):
        found.setdefault(value_id(column), []).append(column)
    yield from found.items()


def _fact(golden: Snapshot, now: Snapshot, value: str) -> dict[str, Any]:
    facts = now.values.get(value) or golden.values.get(value) or {"unit": "", "better": "none"}
    return {**facts, "id": value}


def _line(
    subject: str, where: str, fact: Mapping[str, Any], pairs: list[Pair], why: str, failure: str
) -> GateRow:
    """why: the numbers cannot be compared; failure: the error of values that are gone."""
    gone = [name for name, old, new, _ in pairs if old is not None and new is None]
    come = [name for name, old, new, _ in pairs if old is None and new is not None]
    both = [
        (limit.ratio(old, new), name, old, new)
        for name, old, new, limit in pairs
        if old is not None and new is not None
    ]
    moved = [each for each in both if not each[0] <= 1.0]
    ratio, before, after = _shown(both, moved)
    status = Status.SAME
    if why:
        status = Status.INCOMPARABLE
    elif gone:
        status = Status.FAILING
        why = failure or "no value any more" + _first(gone)
    elif moved:
        status = Status.MOVED if subject == FROZEN else _direction(fact, before, after)
        why = _most(moved, len(both))
    elif come:
        status, why = Status.MOVED, "a value where there was none" + _first(come)
    return GateRow(status, subject, where, fact["id"], fact["unit"], before, after, ratio, why)


def _shown(
    both: list[tuple[float, str, float, float]], moved: list[tuple[float, str, float, float]]
) -> tuple[float, float | None, float | None]:
    """The largest move in limits, and the numbers to show: the mean where it moved or
    nothing did, else the number that moved most."""
    means = [each for each in (moved or both) if each[1].split(" at ")[0] == MEAN]
    if not both:
        return 0.0, None, None
    most = max(both)
    _, _, before, after = means[0] if means else most
    return most[0], before, after


def _most(moved: list[tuple[float, str, float, float]], count: int) -> str:
    """The number of several that moved most; "" where there is only one."""
    _, name, before, after = max(moved)
    return f"{len(moved)} of {count}, most {name.strip()}: {before:.6g} -> {after:.6g}" if count > 1 else ""


def _first(names: list[str]) -> str:
    more = f" and {len(names) - 1} more" if len(names) > 1 else ""
    return f": {names[0].strip()}{more}" if names[0] else ""


def _direction(fact: Mapping[str, Any], before: float | None, after: float | None) -> Status:
    """Better or worse; a value that has no better side has moved."""
    assert before is not None
    assert after is not None
    better, goal = fact["better"], fact.get("goal", 1.0)
    if better == "lower":
        return Status.BETTER if after < before else Status.WORSE
    if better == "higher":
        return Status.BETTER if after > before else Status.WORSE
    if better == "target" and min(before, after, goal) > 0:
        nearer = abs(math.log(after / goal)) < abs(math.log(before / goal))
        return Status.BETTER if nearer else Status.WORSE
    return Status.MOVED
