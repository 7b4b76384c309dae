"""Columns and cells of tables: numbers and marks, or why there is no number."""

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache, cached_property

from retarget_bench.analysis.statistics import Interval
from retarget_bench.analysis.summary import MethodSummary, SplitSummary, of_set, usual_value
from retarget_bench.api import INTRA, SELF, TWO_LEGS
from retarget_bench.evaluation.set_metrics import SetValue
from retarget_bench.results import compatibility
from retarget_bench.results.compatibility import Newest, metric_versions
from retarget_bench.results.header import DeclaredValue, ResultHeader
from retarget_bench.results.result_matrix import set_values
from retarget_bench.tables.model import (
    FAILED,
    NOT_APPLICABLE,
    NOT_RUN,
    OTHER_VERSION,
    Cell,
    Column,
    Footnotes,
    count,
)

FPS = "fps"
PATH_FITTED, FITTED_CLIPS = "mpjpe_h.path_fitted", "path_fit.clips"
"""MPJPE without what the rule of the root's path decides, and the clips that it is fitted to."""
STALE = "other version of the data"
NEEDS = {
    "touches": "self-contact labels",
    "contacts": "contact labels",
    "mesh": "a mesh of the target",
    "source": "the source's skeleton",
    "clips": "more answered clips of a pair of bodies",
}
"""Needs of values in words, where their ids do not say it."""
DUST, ROUNDING = 1e-6, 1e-5
"""Numbers below this size, or this share of the column's largest, count as rounding errors."""
FPS_MEANING = "frames retargeted per second by one process and one thread, with handing over"


@dataclass(frozen=True, eq=False)
class CellBuilder:
    """Builder of columns and cells: what all groups of a table share.

    sections: all of the table. declared: value id -> its declaration in the newest header.
    """

    sections: Sequence[SplitSummary]
    declared: Mapping[str, DeclaredValue]
    footnotes: Footnotes = field(default_factory=Footnotes)

    @cached_property
    def newest(self) -> Newest:
        """The newest data and versions of metrics of the table."""
        return compatibility.newest(score.header for each in self.sections for score in each.scores)

    @cached_property
    def pooled(self) -> frozenset[str]:
        """Ids of values of sets that are over all bodies of the table, and so columns beside the others."""
        scores = (score for section in self.sections if section.bodies for score in section.scores)
        return frozenset(
            each.value_id for score in scores for each in score.sets if each.structure == TWO_LEGS
        )

    @cached_property
    def decimals(self) -> Callable[[str], int]:
        """Column -> its decimals."""
        return cache(self._decimals)

    def _decimals(self, key: str) -> int:
        """Decimals of a column: three significant digits of its typical number; two for zeros alone.

        Numbers of ranked methods count, or of all where these have none; none that are rounding errors
        beside the others, since predictions are in single precision.
        """
        scores = [score for section in self.sections for score in section.scores]
        sizes = [(score.unranked, abs(number)) for score in scores for number in _numbers(score, key)]
        least = max(DUST, ROUNDING * max((size for _, size in sizes), default=0.0))
        ranked = [size for unranked, size in sizes if not unranked and size > least]
        typical = sorted(ranked or [size for _, size in sizes if size > least])
        typical = [size for size in typical if size > 1e-3 * typical[-1]]
        if not typical:
            return 2
        return min(7, max(0, 2 - math.floor(math.log10(typical[len(typical) // 2]))))

    def column(self, key: str) -> Column:
        if key == FPS:
            return Column(FPS, "fps", "1/s", "higher", FPS_MEANING)
        value = self.declared[key]
        version = f"{value.metric} {self.newest.metrics.get(value.metric, '')}".strip()
        facts = (value.unit, value.better, value.meaning, value.goal, value.formula)
        return Column(key, value.label, *facts, version)

    def cell(
        self, section: SplitSummary, score: MethodSummary, key: str, which: tuple[str, str] | None = None
    ) -> Cell:
        """The cell of a method and a value, or the reason why it is missing.

        which: target structure and kind, of a value of sets that is no column beside others.
        """
        if absent := self.absent(score):
            return Cell(absent)
        if key == FPS and score.fps is not None:
            slower, shown = section.slower(score), self.shown(score.fps, FPS)
            note = self.footnotes.number(slower)
            return Cell(shown, score.fps, decimals=self.decimals(FPS), reason=slower, footnote=note)
        if key == FPS and score.header.method.external:
            return self.footnotes.missing("external predictions are not timed")
        if key == FPS:
            return self.footnotes.missing("speed was not measured", NOT_RUN)
        if which is not None:
            return self._of_set(score, key, usual_value(section.scores, key, which))
        if key in self.pooled:
            cell = self._of_set(score, key, usual_value(section.scores, key))
        elif key in score.means:
            cell = self._of_cases(section, score, key)
        elif section.so_far and key in score.header.set_values:
            return self.footnotes.missing("is of all answers as one set, once all are there", NOT_RUN)
        else:
            return self.missing(score, key)
        ranking = section.rankings.get(key)
        if cell.value is None or ranking is None or score.label not in ranking.order:
            return cell
        return replace(cell, mark=ranking.mark(score.label), place=ranking.order.index(score.label))

    def _of_cases(self, section: SplitSummary, score: MethodSummary, key: str) -> Cell:
        """A mean over cases, with a footnote where the method is not ranked by it though others are."""
        mean, ranking, reason = score.means[key], section.rankings.get(key), ""
        if ranking and (why := ranking.left_out.get(score.label)):
            fault = failed(self.declared[key].metric, [score.header])
            reason = f"not ranked by this column: {'; '.join(filter(None, [why, fault]))}"
        return Cell(
            self.shown(mean.value, key),
            mean.value,
            mean.interval,
            decimals=self.decimals(key),
            n=mean.n,
            clips=mean.clips,
            spread=score.spread.get(key),
            reason=reason,
            footnote=self.footnotes.number(reason),
        )

    def _of_set(self, score: MethodSummary, key: str, usual: SetValue) -> Cell:
        """A value of sets. usual: that of the set that most methods have, see ``usual_value``."""
        if stale := self.newest.why_value_outdated(score.header, key):
            return self.footnotes.missing(stale, OTHER_VERSION)
        if key not in score.header.set_values:
            return self.footnotes.missing(f"scored without {key}; bench run adds it", NOT_RUN)
        if (value := of_set(score.sets, key, (usual.structure, usual.kind))) is None:
            fault = failed(score.header.set_values[key].metric, [score.header])
            return self.footnotes.missing(fault or "no answer on a body of this structure")
        if value.value is None:
            return self.footnotes.missing(value.reason)
        reasons = [f"of the first of its {seeds} seeds"] if (seeds := len(score.header.seeds)) > 1 else []
        if value.real != usual.real:
            floor = "unknown" if value.floor is None else self.shown(value.floor, key)
            reasons.append(
                f"over {count(value.n, 'window')} other than those of the other methods, since it did not "
                f"answer the same cases; its own floor is {floor}"
            )
        reason = "; ".join(reasons)
        return Cell(
            self.shown(value.value, key),
            value.value,
            None if value.low is None or value.high is None else Interval(value.low, value.high),
            decimals=self.decimals(key),
            n=value.n,
            clips=value.clips,
            reason=reason,
            footnote=self.footnotes.number(reason),
        )

    def shown(self, number: float, key: str) -> str:
        """A number with the decimals of its column; never -0."""
        text = f"{number:.{self.decimals(key)}f}"
        return text if float(text) else text.removeprefix("-")

    def absent(self, score: MethodSummary) -> str:
        """The kind of all cells of a row without any number; "" where some cells have one."""
        if self.newest.why_outdated(score.header):
            return OTHER_VERSION
        if score.ok or score.means:
            return ""
        counts = score.header.counts
        if counts.asked and counts.failed + counts.invalid:
            return FAILED
        return NOT_APPLICABLE if counts.asked and not counts.missing else NOT_RUN

    def missing(self, score: MethodSummary, key: str) -> Cell:
        """The cell of a method with answers that has no number for a value, and why."""
        facts, header = self.declared[key], score.header
        if stale := self.newest.why_value_outdated(header, key):
            return self.footnotes.missing(stale, OTHER_VERSION)
        computed = metric_versions(header)
        if facts.metric and computed and facts.metric not in computed:
            reason = f"scored without the metric {facts.metric}; bench run adds it"
        elif key in header.set_values:
            return self.footnotes.missing("is of all answers as one set, to which no case here belongs")
        elif key not in header.values:
            reason = "scored before this value existed; bench run adds it"
        elif facts.with_self and header.split == INTRA:
            reason = f"pools {SELF} pairs with {INTRA}, and there are no results on the {SELF} split"
        elif refused := header.not_applicable.get(key):
            return self.footnotes.missing(str(refused["reason"]))
        else:
            return self.footnotes.missing(lacking(facts, [score]))
        return self.footnotes.missing(reason, NOT_RUN)


def _numbers(score: MethodSummary, key: str) -> list[float]:
    """The numbers of a method in a column; several of values of sets."""
    if key == FPS:
        return [] if score.fps is None else [score.fps]
    if key in score.means:
        return [score.means[key].value]
    return [each.value for each in score.sets if each.value_id == key and each.value is not None]


def declared_values(sections: Iterable[SplitSummary]) -> dict[str, DeclaredValue]:
    """Value id -> its declaration, for all values of cases."""
    return {key: value for section in sections for key, value in section.values.items()}


def declared_sets(sections: Iterable[SplitSummary]) -> dict[str, DeclaredValue]:
    """Value id -> its declaration in the newest header, for all values of whole sets."""
    return set_values(score.header for section in sections for score in section.scores)


def failed(metric: str, headers: Iterable[ResultHeader]) -> str:
    """The failure of a metric on an answer of these methods, as text; "" where it failed on none."""
    faults = (each for header in headers for each in header.faults if each.metric == metric)
    return next((f"metric {metric} failed: {each.message}" for each in faults), "")


def lacking(value: DeclaredValue, scores: Sequence[MethodSummary]) -> str:
    """The reason why these rows have no number for a value: its metric failed, or its needs are not met as
    far as other numbers show."""
    if fault := failed(value.metric, (score.header for score in scores)):
        return fault
    met = {
        need
        for score in scores
        for key, each in score.header.values.items()
        for need in set(each.needs) & set(value.needs)
        if key in score.means
    }
    unmet = [NEEDS.get(need, need) for need in value.needs if need not in met]
    return f"needs {' and '.join(unmet)}" if unmet else "undefined for all of these cases"


def by_number(value: float | None, column: Column | None, label: str) -> tuple[int, float, str]:
    """Sort key of rows that no ranking orders: the better first, those without a number last."""
    if value is None or column is None:
        return 2, 0.0, label
    if column.better == "target":
        return 1, abs(math.log(value / column.goal)) if value > 0 else math.inf, label
    return 1, -value if column.better == "higher" else value, label
