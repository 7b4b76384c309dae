"""Columns and cells of tables: numbers and marks, or why there is no number."""

import math
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

from retarget_bench.analysis.ranking import Ranking, set_ranking
from retarget_bench.analysis.statistics import Interval
from retarget_bench.analysis.summary import MethodSummary, SplitSummary
from retarget_bench.api import INTRA, SELF, TWO_LEGS
from retarget_bench.evaluation.set_metrics import SetValue
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
    Mark,
    count,
)

FPS = "fps"
STALE = "other version of the data"
NEEDS = {
    "touches": "self-contact labels",
    "contacts": "contact labels",
    "mesh": "a mesh of the target",
    "source": "the source's skeleton",
}
"""Needs of values in words, where their ids do not say it."""
PEOPLE_SET = (TWO_LEGS, "")
"""The set of all bodies of a table of people: target structure and kind."""
FPS_MEANING = "frames retargeted per second by one process and one thread, with handing over"


@dataclass(frozen=True)
class GroupBuilder:
    """Builder of columns and cells: what all groups of a table share.

    declared: value id -> its declaration in the newest header.
    whole:    ids of values of sets that are over all bodies of a table, and so columns beside the others.
    decimals: value id -> decimals of its column.
    """

    newest: Newest
    declared: Mapping[str, DeclaredValue]
    decimals: Mapping[str, int]
    whole: frozenset[str] = frozenset()
    footnotes: Footnotes = field(default_factory=Footnotes)

    def column(self, key: str) -> Column:
        if key == FPS:
            return Column(FPS, "fps", "1/s", "higher", FPS_MEANING)
        value = self.declared[key]
        version = f"{value.metric} {self.newest.metrics.get(value.metric, '')}".strip()
        facts = (value.unit, value.better, value.meaning, value.goal, value.formula)
        return Column(key, value.label, *facts, version)

    def cell(self, section: SplitSummary, score: MethodSummary, key: str) -> Cell:
        """The cell of a method and a value, or the reason why it is missing."""
        if absent := self.absent(score):
            return Cell(absent)
        if key == FPS:
            if score.fps is not None:
                slower, shown = section.slower(score), self.shown(score.fps, key)
                note = self.footnotes.number(slower)
                return Cell(shown, score.fps, decimals=self.decimals[key], reason=slower, footnote=note)
            if score.header.method.external:
                return self.footnotes.missing("external predictions are not timed")
            return self.footnotes.missing("speed was not measured", NOT_RUN)
        if key in self.whole:
            return self.set_cell(score, key, usual_value(section, PEOPLE_SET, key), section)
        if key not in score.means:
            return self.missing(score, key)
        mean, ranking = score.means[key], section.rankings.get(key)
        reason = self._remark(score, key, ranking)
        return Cell(
            self.shown(mean.value, key),
            mean.value,
            mean.interval,
            _mark(section, score, key),
            self.decimals[key],
            mean.n,
            mean.clips,
            score.spread.get(key),
            reason,
            self.footnotes.number(reason),
            ranking.order.index(score.label) if ranking and score.label in ranking.order else None,
        )

    def _remark(self, score: MethodSummary, key: str, ranking: Ranking | None) -> str:
        """What a footnote says of a number and its place in the ranking; "" for most."""
        why = ranking.left_out.get(score.label, "") if ranking else ""
        whys = filter(None, [why, why and failed(self.declared[key].metric, [score.header])])
        return f"not ranked by this column: {'; '.join(whys)}" if why else ""

    def set_cell(
        self, score: MethodSummary, key: str, usual: SetValue, section: SplitSummary | None = None
    ) -> Cell:
        """The cell of a method and a value of sets. section: where methods are compared by it.

        usual: the value of the set that most methods have, see ``usual_value``.
        """
        if absent := self.absent(score):
            return Cell(absent)
        if stale := self.newest.why_value_outdated(score.header, key):
            return self.footnotes.missing(stale, OTHER_VERSION)
        if key not in score.header.set_values:
            return self.footnotes.missing(f"scored without {key}; bench run adds it", NOT_RUN)
        if (value := value_like(usual, score)) is None:
            fault = failed(score.header.set_values[key].metric, [score.header])
            return self.footnotes.missing(fault or "no answer on a body of this structure")
        if value.value is None:
            return self.footnotes.missing(value.reason)
        if value.network != usual.network:
            return self.footnotes.missing(
                "computed with another feature network than the newest results", OTHER_VERSION
            )
        reason = "" if value.real == usual.real else self._other_windows(value, key)
        if (seeds := len(score.header.seeds)) > 1:
            reason = "; ".join(filter(None, [f"of the first of its {seeds} seeds", reason]))
        return Cell(
            self.shown(value.value, key),
            value.value,
            _interval(value),
            _set_mark(section, score, usual, self.declared[key]) if section else "",
            decimals=self.decimals[key],
            n=value.n,
            clips=value.clips,
            reason=reason,
            footnote=self.footnotes.number(reason),
        )

    def _other_windows(self, value: SetValue, key: str) -> str:
        floor = "unknown" if value.floor is None else self.shown(value.floor, key)
        return (
            f"over {count(value.n, 'window')} other than those of the other methods, since it did not "
            f"answer the same cases; its own floor is {floor}"
        )

    def shown(self, number: float, key: str) -> str:
        """A number with the decimals of its column; never -0."""
        text = f"{number:.{self.decimals[key]}f}"
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
        elif key not in header.values:
            reason = "scored before this value existed; bench run adds it"
        elif facts.with_self and header.split == INTRA:
            reason = f"pools {SELF} pairs with {INTRA}, and there are no results on the {SELF} split"
        elif refused := header.not_applicable.get(key):
            return self.footnotes.missing(str(refused["reason"]))
        else:
            return self.footnotes.missing(lacking(facts, [score]))
        return self.footnotes.missing(reason, NOT_RUN)


def declared_sets(found: Iterable[SplitSummary]) -> dict[str, DeclaredValue]:
    """Value id -> its declaration in the newest header, for all values of whole sets."""
    return set_values(score.header for section in found for score in section.scores)


def failed(metric: str, headers: Iterable[ResultHeader]) -> str:
    """What a metric did wrong with any answer of these methods, as text; "" where it failed with none."""
    faults = (each for header in headers for each in header.faults if each.metric == metric)
    return next((f"metric {metric} failed: {each.message}" for each in faults), "")


def lacking(value: DeclaredValue, scores: Sequence[MethodSummary]) -> str:
    """Why these rows have no number for a value, as text: its metric failed, or its needs are not met as
    far as other numbers show."""
    if fault := failed(value.metric, (score.header for score in scores)):
        return fault
    alike = (
        (score, key, each)
        for score in scores
        for key, each in score.header.values.items()
        if set(each.needs) & set(value.needs)
    )
    return lacking_beside(value, (each for score, key, each in alike if key in score.means))


def lacking_beside(value: DeclaredValue, having: Iterable[DeclaredValue]) -> str:
    """The needs of a value that none of these, which have numbers, shows to be met, as text."""
    met = {need for each in having for need in each.needs}
    unmet = [NEEDS.get(need, need) for need in value.needs if need not in met]
    return f"needs {' and '.join(unmet)}" if unmet else "undefined for all of these cases"


def usual_value(section: SplitSummary, which: tuple[str, str], key: str) -> SetValue:
    """A value of the newest network over the real windows that most methods were compared with.

    which: target structure and kind. Methods that lack a case have other windows. An empty value where no
    method has any.
    """
    values = [
        each
        for score in sorted(section.scores, key=lambda score: score.header.date)
        for each in score.sets
        if (each.value_id, each.structure, each.kind) == (key, *which) and each.value is not None
    ]
    if not values:
        return SetValue(key, which[0], 0, 0, kind=which[1])
    fresh = [each for each in values if each.network == values[-1].network]
    real = Counter(each.real for each in fresh).most_common(1)[0][0]
    return next(each for each in fresh if each.real == real)


def value_like(usual: SetValue, score: MethodSummary) -> SetValue | None:
    """A method's value of the same id, structure and kind."""
    which = (usual.value_id, usual.structure, usual.kind)
    same = (each for each in score.sets if (each.value_id, each.structure, each.kind) == which)
    return next(same, None)


def _interval(value: SetValue) -> Interval | None:
    return None if value.low is None or value.high is None else Interval(value.low, value.high)


def _mark(section: SplitSummary, score: MethodSummary, key: str) -> Mark:
    """Best or tied; "" where so few clips could not have told the best from the worst, and of results that
    are not complete."""
    ranking = section.rankings.get(key)
    return ranking.mark(score.label) if ranking else ""


def _set_mark(
    section: SplitSummary, score: MethodSummary, usual: SetValue, declared: DeclaredValue
) -> Mark:
    """Best or tied; "" for methods that are not ranked, over other windows, or without intervals."""
    values = {each.label: value_like(usual, each) for each in section.scores if not each.unranked}
    alike = {
        label: value
        for label, value in values.items()
        if value is not None and (value.real, value.network) == (usual.real, usual.network)
    }
    ranking = set_ranking(alike, declared)
    return ranking.mark(score.label) if ranking else ""


def by_number(value: float | None, column: Column | None, label: str) -> tuple[int, float, str]:
    """Sort key of rows that no ranking orders: the better first, those without a number last."""
    if value is None or column is None:
        return 2, 0.0, label
    if column.better == "target":
        return 1, abs(math.log(value / column.goal)) if value > 0 else math.inf, label
    return 1, -value if column.better == "higher" else value, label
