"""Comparison of what is measured now with golden rows: facts by name, rows by result matrices."""

import math
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from typing import NamedTuple

import numpy as np
import pandas as pd

from retarget_bench.analysis import statistics
from retarget_bench.plugins import bound
from retarget_bench.results import store
from retarget_bench.results.header import DeclaredValue, ResultHeader
from retarget_bench.results.store import Results
from retarget_bench.verification.gate.golden import CLOUDS, MOTION, PROTOCOL, Measured, flat, parsed


class Status(StrEnum):
    """How something is not as it was, most severe first."""

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

    def asks(self, value: str) -> bool:
        return not self.values or value in self.values

    def tolerance(self, value: str) -> Tolerance | None:
        return self.tolerances.get(value, self.tolerances.get(""))


EVERYTHING = Criteria()


@dataclass(frozen=True)
class Change:
    """Something that is not as it was: a fact, or a value of a method on one split.

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
    """What is not as it was, most severe first, and how many facts and values were compared."""

    changes: tuple[Change, ...]
    compared: int

    @property
    def verdict(self) -> int:
        """0: all is the same; 1: something moved; 2: something could not be measured, or nothing was."""
        if not self.compared or any(each.status is Status.UNMEASURED for each in self.changes):
            return 2
        return int(bool(self.changes))


def compare(golden: Measured, now: Measured, asked: Criteria = EVERYTHING) -> Comparison:
    """Golden rows beside what is measured now, which may hold fewer methods. Raises FileError."""
    stale = Stale.of(golden, now)
    found: list[Change | None] = [Change(Status.UNMEASURED, why=why) for why in now.missing]
    found += [
        Change(Status.UNMEASURED, key, why=why)
        for key, why in now.errors.items()
        if not any(name.startswith(f"{key.rpartition('/')[0] or key}/") for name in golden.facts)
    ]
    found += [*stale.changes, *_gone(golden), *_unmeasured(now, asked)]
    found += _facts(golden, now, asked, stale) if now.complete else ()
    found += _methods(golden, now, asked, stale)
    order = list(Status)
    changes = sorted(filter(None, found), key=lambda each: (order.index(each.status), -each.size))
    return Comparison(tuple(changes), len(found))


def _gone(golden: Measured) -> Iterator[Change]:
    """The splits that golden facts speak of and golden rows lack."""
    there = {place.split for place in store.find_results(golden.rows)}
    for split, told in golden.under("cases").items():
        if split not in there and told.split()[0] != "0":
            why = "the golden rows of this split are gone; restore them"
            yield Change(Status.UNMEASURED, "golden rows", where=split, why=why)


def _unmeasured(now: Measured, asked: Criteria) -> Iterator[Change]:
    """The values asked for that nothing has that was measured."""
    if not asked.values:
        return
    there = {value for part, _, value in map(parsed, now.facts) if part not in PROTOCOL}
    for place in store.find_results(now.rows):
        there |= {value for entry in store.read_results(place).entries for value in entry.values}
    for value in sorted(set(asked.values) - there):
        why = "not measured of methods; without --methods it is, on frozen motions"
        yield Change(Status.UNMEASURED, value=value, why=why)


# ------------------------------------------------------------------------------------------ protocols
@dataclass(frozen=True)
class Stale:
    """What cannot be compared, since what its numbers hang on is not as it was; ``changes`` say what.

    data: all rows of methods. files: names of frozen motions.
    """

    changes: tuple[Change, ...]
    data: bool
    methods: frozenset[str]
    files: frozenset[str]
    values: frozenset[str]

    @classmethod
    def of(cls, golden: Measured, now: Measured) -> "Stale":
        moved = {}
        for kind in PROTOCOL:
            before, after = golden.under(kind), now.under(kind)
            moved[kind] = {name for name, text in after.items() if before.get(name) != text}
        other_data = bool(moved["dataset"])
        metric_of = {name: text.partition(":")[0] for name, text in now.under("value").items()}
        values = {name for name, metric in metric_of.items() if metric in moved["metric"]} | moved["value"]
        values |= {f"{name.partition('/')[0]}.features" for name in moved["network"]}
        hidden = {name for name in moved["value"] if metric_of[name] in moved["metric"]}
        changes = tuple(
            _other_list(golden, now, name) if kind == "cases" else _other(golden, now, kind, name)
            for kind, names in moved.items()
            for name in sorted(names - hidden)
            if not (kind == "cases" and other_data)
        )
        sets = (frozenset(each) for each in (moved["weights"], moved["file"], values))
        return cls(changes, other_data, *sets)


def _other(golden: Measured, now: Measured, kind: str, name: str) -> Change:
    before, after = (each.facts.get(f"{kind}/{name}") for each in (golden, now))
    why = "there is no golden row yet" if before is None else ""
    return Change(Status.INCOMPARABLE, f"{kind} {name}", before=before, after=after, why=why)


def _other_list(golden: Measured, now: Measured, split: str) -> Change:
    """A list of cases that changed although the data set says that its content did not."""
    before, after = (each.under("cases").get(split, "0 cases") for each in (golden, now))
    fewer = int(after.split()[0]) < int(before.split()[0])
    why = "its list of cases changed though the data set claims to hold what it held"
    status = Status.UNMEASURED if fewer else Status.INCOMPARABLE
    return Change(status, now.facts["dataset/spec"], "cases", split, before, after, why)


# ---------------------------------------------------------------------------------------------- facts
def _facts(golden: Measured, now: Measured, asked: Criteria, stale: Stale) -> Iterator[Change | None]:
    """A change, or None, for every fact of either side that can be compared."""
    for name in sorted(golden.facts.keys() | now.facts.keys()):
        part, row, value = parsed(name)
        if part in PROTOCOL or not asked.asks(value):
            continue
        if not (value in stale.values or (part == MOTION and row.split("/")[0] in stale.files)):
            yield _fact(name, golden.facts.get(name), now.facts.get(name), now.errors)


def _fact(name: str, old: str | None, new: str | None, errors: Mapping[str, str]) -> Change | None:
    part, row, value = parsed(name)
    if old == new:
        return None
    if new is None:
        told = (why for key, why in errors.items() if name.startswith(key.rpartition("/")[0] or key))
        return Change(Status.FAILING, part, value, row, old, None, next(told, "no value any more"))
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


def _number(text: str) -> float | None:
    try:
        found = float(text)
    except ValueError:
        return None
    return found if math.isfinite(found) else None


def _share(before: float, after: float, typical: float = 0.0) -> float:
    """By how much a number moved, as a share of its size."""
    apart = abs(after - before)
    return apart / (max(abs(before), typical) or apart or 1.0)


# -------------------------------------------------------------------------------------------- methods
def _methods(golden: Measured, now: Measured, asked: Criteria, stale: Stale) -> Iterator[Change | None]:
    """A change, or None, for every value of a method on a split that can be compared."""
    before, after = (
        {(each.method, each.split): each for each in store.find_results(side.rows)}
        for side in (golden, now)
    )
    declared: dict[str, DeclaredValue] = {}
    numbers: dict[Name, list[_Number]] = {}
    learned = set()
    for spec, weights in now.under("weights").items():
        known, headers = bound.method(spec).known_as, []
        for split in now.under("cases"):
            old, new = (
                store.read_results(there[key]) if (key := (known.slug, split)) in there else None
                for there in (before, after)
            )
            headers += [each.header for each in (new, old) if each]
            if new is None or stale.data or spec in stale.methods:
                continue
            if old is None or old.cases != new.cases:
                why = "there is no golden row yet" if old is None else "other cases were asked"
                yield Change(Status.INCOMPARABLE, str(known), where=split, why=why)
                continue
            yield _answered(str(known), old.header, new.header)
            declared |= {**old.header.values, **new.header.values}
            learned |= {str(known)} if weights else set()
            for name, number in _numbers(str(known), old, new):
                numbers.setdefault(name, []).append(number)
        if not any(each.counts.ok for each in headers):
            why = next((each.message for header in headers for each in header.problems), "no case")
            yield Change(Status.UNMEASURED, str(known), why=f"it answers nothing: {why}")
    typical = _typical(numbers)
    for (label, value, split), listed in numbers.items():
        if asked.asks(value) and value not in stale.values:
            tolerance = declared[value].tolerance
            limit = Tolerance(tolerance, RELATIVE)
            if label in learned:
                limit = Tolerance(LEARNED.absolute * tolerance, LEARNED.relative)
            name = label, value, split
            yield _value(name, listed, limit, typical.get(value, 0.0), declared[value], asked)


def _answered(label: str, old: ResultHeader, new: ResultHeader) -> Change | None:
    """Whether the cases that were answered still are, and those alone."""
    name = label, "answered cases", new.split, float(old.counts.ok), float(new.counts.ok)
    if lost := new.unanswered - old.unanswered:
        why = next(each.message for each in new.problems if lost & set(each.cases))
        return Change(Status.FAILING, *name, f"{min(lost)}: {why}")
    return Change(Status.BETTER, *name) if old.unanswered - new.unanswered else None


class _Number(NamedTuple):
    """A number of a method, as it was and as it is; nan where there is none. point: index of a curve."""

    point: str
    case: str
    clip: str
    before: float
    after: float


Name = tuple[str, str, str]
"""Label of a method, value id, and split."""


def _numbers(label: str, old: Results, new: Results) -> Iterator[tuple[Name, _Number]]:
    """Every number of the cases that both answered."""
    before, after = ({entry.case: flat(entry.values) for entry in each.entries} for each in (old, new))
    for case in sorted(new.cases.keys() - old.header.unanswered - new.header.unanswered):
        old_row, new_row = before.get(case, {}), after.get(case, {})
        for column in dict.fromkeys((*old_row, *new_row)):
            value, _, point = column.partition("@")
            sides = (each.get(column, math.nan) for each in (old_row, new_row))
            yield (label, value, new.header.split), _Number(point, case, new.cases[case].clip, *sides)


def _typical(numbers: Mapping[Name, Sequence[_Number]]) -> dict[str, float]:
    """Value id -> the median size of its golden numbers that are not 0."""
    sizes: dict[str, list[float]] = {}
    for (_, value, _), listed in numbers.items():
        sizes.setdefault(value, []).extend(abs(each.before) for each in listed if abs(each.before) > 0)
    return {value: float(np.median(each)) for value, each in sizes.items() if each}


def _value(
    name: Name,
    numbers: Sequence[_Number],
    limit: Tolerance,
    typical: float,
    declared: DeclaredValue,
    asked: Criteria,
) -> Change | None:
    """One value of a method on one split: every number, or its mean where a tolerance is given for that."""
    before, after = np.array([(each.before, each.after) for each in numbers]).T
    for wrong, status, why in (
        (np.isnan(after), Status.FAILING, "no value any more"),
        (np.isnan(before), Status.MOVED, "a value where there was none"),
    ):
        if wrong.any():
            return Change(status, *name, why=f"{why}: {numbers[int(np.argmax(wrong))].case}")
    moved = limit.passed(before, after, typical)
    if not moved.any():
        return None
    # of clips first, as in tables
    means = pd.DataFrame(numbers).groupby(["point", "clip"])[["before", "after"]].mean()
    means = means.groupby("point").mean()
    if allowed := asked.tolerance(name[1]):
        passed = limit.wider(allowed).passed(means.before.to_numpy(), means.after.to_numpy(), typical)
        moved &= np.isin([each.point for each in numbers], means.index[passed])
        if not moved.any():
            return None
    most = numbers[int(np.argmax(np.where(moved, np.abs(after - before), -1.0)))]
    mean = float(means.before[most.point]), float(means.after[most.point])
    status = _direction(declared, *mean)
    if asked.worse_only and status is not Status.WORSE:
        return None
    where = f"{most.case} {most.point}".rstrip()
    why = f"{moved.sum()} of {len(numbers)}, most {where}: {most.before:.4g} -> {most.after:.4g}"
    return Change(status, *name, *mean, why, _share(*mean, typical))


def _direction(declared: DeclaredValue, before: float, after: float) -> Status:
    """Better or worse; a value that has no better side has moved."""
    if declared.better == "none":
        return Status.MOVED
    old, new = statistics.losses(np.array([before, after]), declared.better, declared.goal)
    return Status.BETTER if new < old else Status.WORSE
