"""Rankings: the order of methods by one value, and which of them the data cannot tell from the best.

One test is behind all marks, verdicts and charts: ``statistics.against_best`` over the ranked methods.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import compress
from typing import Any, Literal

import numpy as np

from retarget_bench.analysis import statistics
from retarget_bench.evaluation.set_metrics import SetValue
from retarget_bench.results.header import DeclaredValue, MethodInfo, ResultHeader
from retarget_bench.results.result_matrix import ResultMatrix

MOST_DOUBTED = 5.0
"""Per cent of cases in which a reference may be beyond what a value allows, and methods be ranked by it."""
COVERAGE = 0.95
"""A method that has a value for a smaller share of the cases than others is not ranked by it."""


@dataclass(frozen=True)
class Ranking:
    """Order of the ranked methods by one value, on the cases that all of them have it for.

    Values that are best at a goal are compared as |log(value / goal)| of every case.

    order: labels of the ranked methods, best first.
    equal: how many of these are best: means differ from the first's by no more than the value's tolerance.
    p:     label -> p-value of the difference from the best, adjusted for all pairs of methods.
    cases: common cases (of values of sets, windows), of ``clips`` source clips.
    left_out: label -> why a ranked method is not ranked by this value.
    complete: False while cases are missing.
    common: ``(cases,)`` bool, the common ones among those of the matrix; None for values of sets.
    """

    order: tuple[str, ...]
    p: Mapping[str, float]
    cases: int
    clips: int
    equal: int = 1
    left_out: Mapping[str, str] = field(default_factory=dict)
    complete: bool = True
    common: np.ndarray | None = field(default=None, compare=False, repr=False)

    @property
    def best(self) -> str:
        return self.order[0]

    @property
    def separable(self) -> bool:
        """True if so many clips could have told the best from another."""
        return len(self.order) > 1 and self.clips >= statistics.ENOUGH_CLIPS

    @property
    def tied(self) -> tuple[str, ...]:
        """Those behind the first, up to one whose difference from it is significant; some may be equal."""
        behind = self.order[1:]
        first = next((i for i, label in enumerate(behind) if self.p[label] < statistics.ALPHA), len(behind))
        return behind[:first]

    @property
    def unclear(self) -> tuple[str, ...]:
        """Those whose difference from the best is not significant, though that of a better one is: it
        varies more. They are not marked as tied."""
        later = self.order[1 + len(self.tied) :]
        return tuple(label for label in later if self.p[label] >= statistics.ALPHA)

    def mark(self, label: str) -> Literal["best", "tied", ""]:
        """``best`` of all that are equal to the best, ``tied`` or "": no mark where so few clips could tell
        nobody apart, nor while cases are missing."""
        if not (self.separable and self.complete):
            return ""
        return "best" if label in self.order[: self.equal] else "tied" if label in self.tied else ""


def never_ranked(method: MethodInfo) -> str:
    """The reason why a method is never ranked (a control, privileged inputs); "" where it may be."""
    seen = ", ".join(name.replace("_", " ") for name in method.privileged)
    return "control" if method.control else f"sees {seen}" if seen else ""


def unranked(header: ResultHeader) -> str:
    """The reason why a method with this header is not ranked; "" where it is.

    A method that leaves out a case would choose the cases on which all are compared, so it is not ranked.
    """
    counts = header.counts
    fewer = f"answered {counts.ok} of {counts.asked}" if counts.ok < counts.asked else ""
    return never_ranked(header.method) or fewer


def doubt(matrix: ResultMatrix, value: str) -> str:
    """Why nobody is ranked by a value on these cases, though methods have it; "": there is no doubt."""
    doubted = matrix.values[value].doubt
    numbers = matrix.numbers((doubted, "")) if doubted else np.empty((0, 0))
    present = numbers[:, ~np.isnan(numbers).all(axis=0)]
    if not present.size or (share := float(np.nanmax(present, axis=0).mean())) <= MOST_DOUBTED:
        return ""
    return f"the references themselves are beyond what it allows in {share:.0f} % of the cases"


def ranking(
    matrix: ResultMatrix, value: str, numbers: np.ndarray, among: np.ndarray, left_out: Mapping[int, str]
) -> Ranking | None:
    """The ranking of the methods ``among`` ``(methods,)`` bool by their numbers ``(methods, cases)``; None
    where there are none, or a value is a description, or in doubt on these cases."""
    labels, declared = [row.label for row in matrix.rows], matrix.values[value]
    if not among.any() or declared.better == "none" or doubt(matrix, value):
        return None
    worse = statistics.losses(numbers[among], declared.better, declared.goal)
    there = ~np.isnan(worse).any(axis=0)
    per_clip = statistics.per_clip(worse[:, there], matrix.clips[there])
    return _ranked(
        dict(zip(compress(labels, among), per_clip, strict=True)),
        declared.tolerance,
        cases=int(there.sum()),
        clips=per_clip.shape[1],
        left_out={labels[i]: why for i, why in left_out.items()},
        complete=not matrix.so_far,
        common=there,
    )


def set_ranking(values: Mapping[str, SetValue], declared: DeclaredValue) -> Ranking | None:
    """The ranking of methods by a value of all their answers as one set; None where fewer than two have
    one with an interval.

    values: label -> value, over the same windows. The units are the tenths of the clips: a method's number
    of a tenth is how its value changes without that tenth, scaled so that mean and standard error of the
    numbers are the value and its jackknife's.
    """
    numbers = {label: each.tenths for label, each in values.items() if each.tenths is not None}
    if declared.better == "none" or len(numbers) < 2:
        return None
    worse = {label: statistics.losses(each, declared.better) for label, each in numbers.items()}
    first = next(iter(values.values()))
    return _ranked(worse, declared.tolerance, cases=first.n, clips=first.clips)


def _ranked(losses: Mapping[str, np.ndarray], tolerance: float, **facts: Any) -> Ranking:
    """losses: label -> ``(units,)``, less is better. facts: the rest of the ranking."""
    labels = sorted(losses)  # so that equals stand in one order however the results were listed
    worse = np.array([losses[label] for label in labels])
    means = worse.mean(axis=1)
    order = np.argsort(means, kind="stable")
    best, p = statistics.against_best(worse, tolerance)
    adjusted = {labels[i]: float(p[i]) for i in order if i != best}
    equal = int((means - means[best] <= tolerance).sum())
    return Ranking(tuple(labels[i] for i in order), adjusted, equal=equal, **facts)


def common_cases(
    numbers: np.ndarray, ranked: np.ndarray, never: np.ndarray | np.bool_ = np.False_
) -> tuple[np.ndarray, np.ndarray, dict[int, str]]:
    """``(cases,)`` bool: cases that all ranked methods have a number for; ``(methods,)`` bool: those whose
    means are over these; and why ranked methods are left out.

    numbers: ``(methods, cases)``; outside the common cases those of the methods that are compared, or in
    ``never``, are set to nan. ranked, never: ``(methods,)`` bool: methods that may be ranked, and that
    never are. Not every answer has every number: a method that has it for less than ``COVERAGE`` of the
    cases that any ranked method has it for is left out, lest it shrink the set.
    """
    there = ~np.isnan(numbers)
    any_of = there[ranked].any(axis=0)
    counts = there.sum(axis=1)
    few = ranked & (counts < COVERAGE * any_of.sum())
    left_out = {int(i): f"has it for {counts[i]} of {any_of.sum()} cases" for i in np.flatnonzero(few)}
    common = any_of & there[ranked & ~few].all(axis=0)
    among = ranked & ~few & common.any()
    if among.any():
        numbers[(among | never)[:, None] & ~common] = np.nan
    return common, among, left_out
