"""Groups of a table: methods by values on one split, or parts of a breakdown by methods."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from retarget_bench.analysis.breakdown import CURVES
from retarget_bench.analysis.statistics import ENOUGH_CLIPS
from retarget_bench.analysis.summary import MethodSummary, SplitSummary
from retarget_bench.results.compatibility import Newest, metric_versions
from retarget_bench.results.header import DeclaredValue, ResultHeader
from retarget_bench.tables.model import (
    FAILED,
    NOT_APPLICABLE,
    NOT_RUN,
    OTHER_VERSION,
    Cell,
    Column,
    Footnotes,
    Group,
    Mark,
    Row,
    count,
)

FPS = "fps"
ABSENT = "not run here"
STALE = "other version of the data"
NEEDS = {"touches": "self-contact labels", "contacts": "contact labels"}
"""Needs of values in words, where their ids do not say it."""
FPS_MEANING = "frames retargeted per second by one process and one thread, reading and writing aside"


@dataclass(frozen=True)
class GroupBuilder:
    """Builder of columns and cells: what all groups of a table share.

    declared: value id -> its declaration in the newest header.
    decimals: value id -> decimals of its column.
    methods:  label -> a header, of every method that has results anywhere.
    """

    newest: Newest
    declared: Mapping[str, DeclaredValue]
    decimals: Mapping[str, int]
    methods: Mapping[str, ResultHeader]
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
                return Cell(self.shown(score.fps, key), score.fps, decimals=self.decimals[key])
            if score.header.method.external:
                return self.footnotes.missing("external predictions are not timed")
            return self.footnotes.missing("speed was not measured", NOT_RUN)
        if key not in score.means:
            return self.missing(score, key)
        mean, ranking = score.means[key], section.rankings.get(key)
        why = ranking.left_out.get(score.label, "") if ranking else ""
        reason = f"not ranked by this column: {why}" if why else ""
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
            reason = f"scored without the metric {facts.metric}; bench score adds it"
        elif key not in header.values:
            reason = "scored before this value existed; bench score adds it"
        elif facts.with_self and header.split == "intra":
            reason = "pools self pairs with intra, and there are no results on the self split"
        elif refused := header.not_applicable.get(key):
            return self.footnotes.missing(str(refused["reason"]))
        else:
            return self.footnotes.missing(lacking(facts, [score]))
        return self.footnotes.missing(reason, NOT_RUN)


def lacking(value: DeclaredValue, scores: Sequence[MethodSummary]) -> str:
    """The needs of a value that no number of these rows shows to be met, as text."""
    met = {
        need
        for score in scores
        for key in score.means
        if key in score.header.values
        for need in score.header.values[key].needs
    }
    unmet = [NEEDS.get(need, need) for need in value.needs if need not in met]
    return f"needs {' and '.join(unmet)}" if unmet else "undefined for all of these cases"


def _mark(section: SplitSummary, score: MethodSummary, key: str) -> Mark:
    """Best or tied; "" below two ranked methods, and with too few clips for intervals."""
    ranking = section.rankings.get(key)
    if ranking is None or len(ranking.order) < 2 or ranking.clips < ENOUGH_CLIPS:
        return ""
    if score.label == ranking.best:
        return "best"
    return "tied" if score.label in ranking.tied else ""


# -------------------------------------------------------------------------------- methods by values
def by_method(
    section: SplitSummary, keys: Sequence[str], absent: Sequence[str], builder: GroupBuilder
) -> Group:
    """All methods on one split: a row each, a column per value. ``absent`` are sentences for the foot."""
    rows = [(_row(section, score, keys, builder), score) for score in section.scores]
    fresh = [score for score in section.scores if not builder.newest.why_outdated(score.header)]
    if keys:
        rows.sort(key=lambda pair: _place(section, pair[1], keys[0], builder))
    asked = max((score.asked for score in fresh), default=0)
    frames = f", {section.frames} frames" if section.frames else ""
    there = {score.label for score in section.scores}
    missing = [label for label in builder.methods if label not in there]
    alone = []
    for key in keys:
        having = [score for score in section.scores if not score.unranked and key in score.means]
        if len(having) > 1 and key not in section.rankings and builder.declared[key].better != "none":
            alone.append(
                f"{section.split}: no method is ranked by {builder.column(key).label}, since no case has "
                "a number of all ranked methods. Each number is over other cases."
            )
    nothing = tuple(Cell(NOT_RUN) for _ in keys)
    return Group(
        title=f"{section.split}: {count(asked, 'case')} of {count(section.clips, 'clip')} and "
        f"{count(section.pairs, 'pair')}{frames}",
        split=section.split,
        columns=tuple(builder.column(key) for key in keys),
        ranked=tuple(row for row, score in rows if not row.mark),
        unranked=(
            *(row for row, score in rows if row.mark),
            *(Row(label, ABSENT, nothing, "0", builder.methods[label].method.summary) for label in missing),
        ),
        common=tuple(section.rankings.get(key) for key in keys),
        absent=(*absent, *alone),
    )


def _row(section: SplitSummary, score: MethodSummary, keys: Sequence[str], builder: GroupBuilder) -> Row:
    stale = bool(builder.newest.why_outdated(score.header))
    n = "0" if stale else f"{score.ok}" if score.ok == score.asked else f"{score.ok}/{score.asked}"
    cells = tuple(builder.cell(section, score, key) for key in keys)
    return Row(score.label, STALE if stale else score.unranked, cells, n, score.header.method.summary)


def _place(
    section: SplitSummary, score: MethodSummary, key: str, builder: GroupBuilder
) -> tuple[int, float]:
    """Sort key of rows: by ranking, then by number, then those without one."""
    ranking = section.rankings.get(key)
    if ranking and score.label in ranking.order:
        return 0, ranking.order.index(score.label)
    cell = builder.cell(section, score, key)
    if cell.value is None:
        return 2, 0.0
    column = builder.column(key)
    if column.better == "target":
        return 1, abs(math.log(cell.value / column.goal)) if cell.value > 0 else math.inf
    return 1, -cell.value if column.better == "higher" else cell.value


# --------------------------------------------------------------------------------- parts by methods
def by_part(sections: Sequence[SplitSummary], key: str, heading: str, builder: GroupBuilder) -> Group:
    """One value on one split, broken down: a row per part, a column per method. The title has the unit."""
    value = builder.column(key)
    first = {score.label: score for section in reversed(sections) for score in section.scores}
    marks = {label: _never_ranked(sections, label) for label in first}
    labels = sorted(first, key=lambda label: bool(marks[label]))
    rows = []
    for section in sections:
        if not any(score.asked or key in score.means for score in section.scores):
            continue  # self pairs, which only legacy protocols count here
        scores = {score.label: score for score in section.scores}
        cells = (
            builder.cell(section, scores[label], key) if label in scores else Cell(NOT_RUN)
            for label in labels
        )
        # not every body has every joint, nor every clip every second
        whole = heading not in ("joint", "part", *CURVES)
        asked = max(score.asked for score in section.scores) if whole else 0
        n = max(asked, *(score.means[key].n for score in section.scores if key in score.means), 0)
        rows.append(Row(section.part, "", tuple(cells), f"{n}"))
    split = sections[0].split
    unit = f" in {value.unit}" if value.unit != "1" else ""
    return Group(
        title=f"{split}: {value.label} {value.arrow}".rstrip() + f"{unit}, by {heading}",
        split=split,
        columns=tuple(
            Column(
                label,
                label,
                "1",
                value.better,
                first[label].header.method.summary or "a method",
                value.goal,
                mark=marks[label],
            )
            for label in labels
        ),
        ranked=tuple(rows),
        unranked=(),
        heading=heading,
        subject=key,
    )


def _never_ranked(sections: Sequence[SplitSummary], label: str) -> str:
    """The reason why a method is ranked in no part; "" where it is in any."""
    scores = [score for section in sections for score in section.scores if score.label == label]
    reasons = {score.unranked for score in scores if score.asked}
    if not reasons or "" in reasons:
        return ""
    return reasons.pop() if len(reasons) == 1 else "answered too few"
