"""Comparison of what is measured now with golden rows: facts by name, numbers of methods by value."""

import math
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from itertools import groupby
from operator import itemgetter

import numpy as np
import pandas as pd

from retarget_bench.analysis import statistics
from retarget_bench.api import CaseInfo
from retarget_bench.plugins import bound
from retarget_bench.results import store
from retarget_bench.results.header import DeclaredValue, ResultHeader
from retarget_bench.results.store import Results
from retarget_bench.verification.gate.golden import CLOUDS, MOTION, PROTOCOL, Measured, parsed


class Status(StrEnum):
    """How something differs from its golden row, most severe first."""

    UNMEASURED = "could not measure"
    FAILING = "newly failing"
    WORSE = "worse"
    BETTER = "better"
    MOVED = "moved"
    INCOMPARABLE = "not comparable"


@dataclass(frozen=True)
class Tolerance:
    """The allowed difference of a number: ``absolute``, or ``relative`` times its size if that is more."""

    absolute: float
    relative: float

    def passed(self, golden: np.ndarray, now: np.ndarray, typical: float = 0.0) -> np.ndarray:
        """Whether numbers differ by more. A golden number of 0 is as large as is typical of its value."""
        size = np.where(golden == 0.0, typical, np.abs(golden))
        return ~(np.abs(now - golden) <= np.maximum(self.absolute, self.relative * size))

    def wider(self, other: "Tolerance") -> "Tolerance":
        """The larger of either difference."""
        return Tolerance(max(self.absolute, other.absolute), max(self.relative, other.relative))


EXACT = Tolerance(1e-9, 1e-9)
"""Of metrics on frozen motions. The same sums in another order, by another processor, differ by 1e-12."""
RELATIVE = 1e-6
"""Floor of deterministic methods, beside the metric's own tolerance: what is measured has been rounded to
single precision twice (motions as they are kept, predictions as files have them), 1e-7 each. Also that of
frozen inputs, whose intervals use quantiles that differ between versions of scipy."""
LEARNED = Tolerance(10.0, 1e-3)
"""Of methods with weights: ten metric tolerances, or a thousandth: networks run in single precision, and
their sums are taken in an order that differs between processors and versions of the library. Also that of
features."""


@dataclass(frozen=True)
class Criteria:
    """Criteria of a check; by default nothing may move.

    values:     the ids of the values that count; none: all. Whether cases are answered always counts.
    worse_only: a method's numbers may get better, and those without a better side may move.
    tolerances: value id ("": all others) -> by how much a method's mean may differ. Such values are judged
                by their mean alone, where both sides have the same numbers.
    """

    values: Collection[str] = ()
    worse_only: bool = False
    tolerances: Mapping[str, Tolerance] = field(default_factory=dict)

    def counts(self, value: str) -> bool:
        """Whether a value may make the check fail."""
        return not self.values or value in self.values


EVERYTHING = Criteria()


@dataclass(frozen=True)
class Change:
    """A difference of a fact, or of a value of a method on one split.

    subject: the method, or the part of the facts. where: the split, or the row.
    before, after: the text of a fact, or the mean of a method; None where there is none.
    size: by how much a number moved, as a share of its size.
    """

    status: Status
    subject: str = ""
    value: str = ""
    where: str = ""
    before: float | str | None = None
    after: float | str | None = None
    why: str = ""
    size: float = 0.0


@dataclass(frozen=True)
class Comparison:
    """All differences, most severe first, and the number of facts and values that were compared."""

    changes: tuple[Change, ...]
    compared: int

    @property
    def verdict(self) -> int:
        """0: all is the same; 1: something moved; 2: something could not be measured, or nothing was."""
        if not self.compared or any(each.status is Status.UNMEASURED for each in self.changes):
            return 2
        return int(bool(self.changes))


def compare(golden: Measured, now: Measured, criteria: Criteria = EVERYTHING) -> Comparison:
    """Golden rows beside what is measured now, which may hold fewer methods. Raises FileError."""
    stale, changes = _protocol(golden, now)
    compared: list[Change | None] = [Change(Status.UNMEASURED, why=why) for why in now.missing]
    compared += [
        Change(Status.UNMEASURED, key, why=why)
        for key, why in now.errors.items()
        if not any(name.startswith(f"{_row(key)}/") for name in golden.facts)
    ]
    compared += [*changes, *_lost_splits(golden), *_unmeasured_values(now, criteria)]
    compared += _facts(golden, now, criteria, stale) if now.complete else ()
    compared += _methods(golden, now, criteria, stale)
    order = list(Status)
    changed = sorted(filter(None, compared), key=lambda each: (order.index(each.status), -each.size))
    return Comparison(tuple(changed), len(compared))


def _lost_splits(golden: Measured) -> Iterator[Change]:
    """The splits that golden facts speak of and golden rows lack."""
    splits = {paths.split for paths in store.find_results(golden.rows)}
    for split, listed in golden.under("cases").items():
        if split not in splits and listed.split()[0] != "0":
            why = "the golden rows of this split are gone; restore them"
            yield Change(Status.UNMEASURED, "golden rows", where=split, why=why)


def _unmeasured_values(now: Measured, criteria: Criteria) -> Iterator[Change]:
    """The values that count and that nothing has that was measured."""
    if not criteria.values:
        return
    measured = {value for part, _, value in map(parsed, now.facts) if part not in PROTOCOL}
    for paths in store.find_results(now.rows):
        measured |= {value for value, _ in store.read_results(paths).numbers}
    for value in sorted(set(criteria.values) - measured):
        why = "not measured of methods; without --methods it is, on frozen motions"
        yield Change(Status.UNMEASURED, value=value, why=why)


# ------------------------------------------------------------------------------------------ protocols
def _protocol(golden: Measured, now: Measured) -> tuple[set[str], list[Change]]:
    """The names of protocol facts that differ, with all values whose numbers therefore cannot be compared
    (``value/<id>``); and the changes to report."""
    kinds = {name: name.partition("/")[0] for name in now.facts}
    stale = {
        name
        for name, text in now.facts.items()
        if kinds[name] in PROTOCOL and golden.facts.get(name) != text
    }
    metrics = {value: text.partition(":")[0] for value, text in now.under("value").items()}
    of_metrics = {f"value/{value}" for value, metric in metrics.items() if f"metric/{metric}" in stale}
    other_data = _other_data(stale)
    changes = [
        _other(golden, now, name)
        for name in sorted(stale - of_metrics, key=lambda name: (PROTOCOL.index(kinds[name]), name))
        if not (other_data and kinds[name] == "cases")
    ]
    return stale | of_metrics, changes


def _other_data(stale: Collection[str]) -> bool:
    return any(name.startswith("dataset/") for name in stale)


def _other(golden: Measured, now: Measured, name: str) -> Change:
    before, after = golden.facts.get(name), now.facts[name]
    kind, _, rest = name.partition("/")
    if kind != "cases":
        why = "there is no golden row yet" if before is None else ""
        return Change(Status.INCOMPARABLE, f"{kind} {rest}", before=before, after=after, why=why)
    before = before or "0 cases"
    fewer = int(after.split()[0]) < int(before.split()[0])
    why = "its list of cases changed though the data set claims to hold what it held"
    status = Status.UNMEASURED if fewer else Status.INCOMPARABLE
    return Change(status, now.facts["dataset/spec"], "cases", rest, before, after, why)


# ---------------------------------------------------------------------------------------------- facts
def _facts(
    golden: Measured, now: Measured, criteria: Criteria, stale: Collection[str]
) -> Iterator[Change | None]:
    """A change, or None, for every fact of either side that can be compared."""
    for name in sorted(golden.facts.keys() | now.facts.keys()):
        part, row, value = parsed(name)
        if part in PROTOCOL or not criteria.counts(value) or f"value/{value}" in stale:
            continue
        if part != MOTION or f"file/{row.split('/')[0]}" not in stale:
            yield _fact(name, golden.facts.get(name), now.facts.get(name), now.errors)


def _fact(name: str, old: str | None, new: str | None, errors: Mapping[str, str]) -> Change | None:
    part, row, value = parsed(name)
    if old == new:
        return None
    if new is None:
        reasons = (why for key, why in errors.items() if name.startswith(_row(key)))
        return Change(Status.FAILING, part, value, row, old, None, next(reasons, "no value any more"))
    if old is None:
        return Change(Status.MOVED, part, value, row, None, new, "a value where there was none")
    before, after = _number(old), _number(new)
    if before is None or after is None:
        return Change(Status.MOVED, part, value, row, old, new, size=math.inf)
    limit = Tolerance(EXACT.absolute, RELATIVE)
    if part in (MOTION, CLOUDS):
        limit = Tolerance(LEARNED.relative, LEARNED.relative) if value.endswith(".features") else EXACT
    if not limit.passed(np.array(before), np.array(after)):
        return None
    return Change(Status.MOVED, part, value, row, before, after, size=_share(before, after))


def _row(key: str) -> str:
    """The row of facts that an error is the reason for: ``<row>/<metric>``, or a part."""
    return key.rpartition("/")[0] or key


def _number(text: str) -> float | None:
    try:
        number = float(text)
    except ValueError:
        return None
    return number if math.isfinite(number) else None


def _share(before: float, after: float, typical: float = 0.0) -> float:
    """The difference of a number, as a share of its size."""
    difference = abs(after - before)
    return difference / (max(abs(before), typical) or difference or 1.0)


# -------------------------------------------------------------------------------------------- methods
@dataclass(frozen=True, eq=False)
class _Numbers:
    """The numbers of one value of a method on one split, of the cases that both sides answered.

    points: of a curve; "" of a single number. before, after: ``(cases, points)``, nan where there is none.
    """

    method: str
    value: str
    split: str
    declared: DeclaredValue
    limit: Tolerance
    points: Sequence[str]
    cases: Sequence[CaseInfo]
    before: np.ndarray
    after: np.ndarray


def _methods(
    golden: Measured, now: Measured, criteria: Criteria, stale: Collection[str]
) -> Iterator[Change | None]:
    """A change, or None, for every value of a method on a split that can be compared."""
    sides = [
        {(each.method, each.split): each for each in store.find_results(side.rows)}
        for side in (golden, now)
    ]
    numbers: list[_Numbers] = []
    for spec, weights in now.under("weights").items():
        method, headers = bound.method(spec).known_as, []
        for split in now.under("cases"):
            key = method.slug, split
            old, new = (store.read_results(side[key]) if key in side else None for side in sides)
            headers += [each.header for each in (new, old) if each]
            if new is None or _other_data(stale) or f"weights/{spec}" in stale:
                continue
            if old is None or old.infos != new.infos:
                why = "there is no golden row yet" if old is None else "other cases were asked"
                yield Change(Status.INCOMPARABLE, str(method), where=split, why=why)
                continue
            yield _answered(str(method), old.header, new.header)
            numbers += _numbers(str(method), old, new, bool(weights))
        if not any(each.counts.ok for each in headers):
            why = next((each.message for header in headers for each in header.problems), "no case")
            yield Change(Status.UNMEASURED, str(method), why=f"it answers nothing: {why}")
    typical = _typical(numbers)
    for each in numbers:
        if criteria.counts(each.value) and f"value/{each.value}" not in stale:
            yield _moved(each, typical[each.value], criteria)


def _answered(label: str, old: ResultHeader, new: ResultHeader) -> Change | None:
    """A change where other cases are answered than before."""
    name = label, "answered cases", new.split, float(old.counts.ok), float(new.counts.ok)
    if lost := new.unanswered - old.unanswered:
        why = next(each.message for each in new.problems if lost & set(each.cases))
        return Change(Status.FAILING, *name, f"{min(lost)}: {why}")
    return Change(Status.BETTER, *name) if old.unanswered - new.unanswered else None


def _numbers(method: str, old: Results, new: Results, learned: bool) -> Iterator[_Numbers]:
    """Every value of the cases that both answered."""
    unanswered = old.header.unanswered | new.header.unanswered
    rows = [row for row, info in enumerate(new.infos) if info.id not in unanswered]
    cases, missing = [new.infos[row] for row in rows], np.full(len(new.infos), np.nan)
    declared = {**old.header.values, **new.header.values}
    for value, keys in groupby(sorted({*old.numbers, *new.numbers}), itemgetter(0)):
        points = [point for _, point in keys]
        before, after = (
            np.stack([each.numbers.get((value, point), missing)[rows] for point in points], axis=1)
            for each in (old, new)
        )
        if np.isnan(before).all() and np.isnan(after).all():
            continue
        facts, wider = declared[value], LEARNED if learned else Tolerance(1.0, RELATIVE)
        limit = Tolerance(wider.absolute * facts.tolerance, wider.relative)
        yield _Numbers(method, value, new.header.split, facts, limit, points, cases, before, after)


def _typical(numbers: Sequence[_Numbers]) -> dict[str, float]:
    """Value id -> the median size of its golden numbers that are not 0; 0 where there are none."""
    sizes: dict[str, list[np.ndarray]] = {}
    for each in numbers:
        sizes.setdefault(each.value, []).append(np.abs(each.before[np.abs(each.before) > 0]))
    flat = {value: np.concatenate(each) for value, each in sizes.items()}
    return {value: float(np.median(each)) if len(each) else 0.0 for value, each in flat.items()}


def _moved(numbers: _Numbers, typical: float, criteria: Criteria) -> Change | None:
    """One value of a method on one split: every number, or its mean where a tolerance is given for that."""
    before, after, limit = numbers.before, numbers.after, numbers.limit
    name = numbers.method, numbers.value, numbers.split
    lacking = np.isnan(before), np.isnan(after)
    for wrong, status, why in (
        (lacking[1] & ~lacking[0], Status.FAILING, "no value any more"),
        (lacking[0] & ~lacking[1], Status.MOVED, "a value where there was none"),
    ):
        if wrong.any():
            return Change(status, *name, why=f"{why}: {numbers.cases[int(wrong.any(axis=1).argmax())].id}")
    moved = limit.passed(before, after, typical) & ~lacking[0]
    if not moved.any():
        return None
    clips = [info.clip for info in numbers.cases]
    # of clips first, as in tables
    old, new = (pd.DataFrame(each).groupby(clips).mean().mean().to_numpy() for each in (before, after))
    if allowed := criteria.tolerances.get(numbers.value, criteria.tolerances.get("")):
        moved &= limit.wider(allowed).passed(old, new, typical)
        if not moved.any():
            return None
    row, point = divmod(int(np.where(moved, np.abs(after - before), -1.0).argmax()), moved.shape[1])
    mean = float(old[point]), float(new[point])
    status = _direction(numbers.declared, *mean)
    if criteria.worse_only and status is not Status.WORSE:
        return None
    where = f"{numbers.cases[row].id} {numbers.points[point]}".rstrip()
    sizes = f"{before[row, point]:.4g} -> {after[row, point]:.4g}"
    why = f"{moved.sum()} of {(~lacking[0]).sum()}, most {where}: {sizes}"
    return Change(status, *name, *mean, why, _share(*mean, typical))


def _direction(declared: DeclaredValue, before: float, after: float) -> Status:
    """Better or worse; a value that has no better side has moved."""
    if declared.better == "none":
        return Status.MOVED
    old, new = statistics.losses(np.array([before, after]), declared.better, declared.goal)
    return Status.BETTER if new < old else Status.WORSE
