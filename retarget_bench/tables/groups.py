"""Groups of a table: methods by values on one split, or parts of a breakdown by methods."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from retarget_bench.analysis.breakdown import CURVES
from retarget_bench.analysis.statistics import ENOUGH_CLIPS
from retarget_bench.analysis.summary import MethodSummary, SplitSummary
from retarget_bench.results.compatibility import Newest
from retarget_bench.results.header import DeclaredValue, ResultHeader
from retarget_bench.tables import missing
from retarget_bench.tables.model import (
    NOT_APPLICABLE,
    NOT_RUN,
    Cell,
    Column,
    Common,
    Footnotes,
    Group,
    Mark,
    Row,
    count,
)

FPS = "fps"
ABSENT = "not run here"
STALE = "other version of the data"
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
        metric = value.metric
        return Column(
            key,
            value.label,
            value.unit,
            value.better,
            value.meaning,
            value.goal,
            value.formula,
            f"{metric} {self.newest.metrics.get(metric, '')}".strip(),
        )

    def cell(self, section: SplitSummary, score: MethodSummary, key: str) -> Cell:
        """The cell of a method and a value, or the reason why it is missing."""
        if absent := missing.of_row(score, self.newest):
            return self.empty(absent)
        if key == FPS:
            if score.fps is not None:
                return Cell(self.shown(score.fps, key), score.fps, decimals=self.decimals[key])
            elsewhere = score.header.method.external
            told = "external predictions are not timed" if elsewhere else "speed was not measured"
            return self.empty((NOT_APPLICABLE if elsewhere else NOT_RUN, told))
        if key not in score.means:
            return self.empty(missing.of_value(score, key, self.declared[key], self.newest))
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

    def empty(self, why: missing.MissingValue) -> Cell:
        kind, reason = why
        return self.footnotes.missing(reason, kind)


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
    fresh = [score for score in section.scores if not builder.newest.stale_data(score.header)]
    if keys:
        rows.sort(key=lambda pair: _place(section, pair[1], keys[0], builder))
    there = {score.label for score in section.scores}
    missing = [label for label in builder.methods if label not in there]
    nothing = tuple(Cell(NOT_RUN) for _ in keys)
    return Group(
        title=_title(section, fresh),
        split=section.split,
        columns=tuple(builder.column(key) for key in keys),
        ranked=tuple(row for row, score in rows if not row.mark),
        unranked=(
            *(row for row, score in rows if row.mark),
            *(Row(label, ABSENT, nothing, "0", about(builder.methods[label])) for label in missing),
        ),
        common=tuple(_common(section, key) for key in keys),
        absent=(*absent, *_nothing_in_common(section, keys, builder)),
    )


def _nothing_in_common(section: SplitSummary, keys: Sequence[str], builder: GroupBuilder) -> list[str]:
    """Sentences about columns without cases that all ranked methods have a number for."""
    found = []
    for key in keys:
        having = [score for score in section.scores if not score.unranked and key in score.means]
        if len(having) > 1 and key not in section.rankings and builder.declared[key].better != "none":
            found.append(
                f"{section.split}: no method is ranked by {builder.column(key).label}, since no case has "
                "a number of all ranked methods. Each number is over other cases."
            )
    return found


def _title(section: SplitSummary, scores: Sequence[MethodSummary]) -> str:
    asked = max((score.asked for score in scores), default=0)
    frames = f", {section.frames} frames" if section.frames else ""
    return (
        f"{section.split}: {count(asked, 'case')} of {count(section.clips, 'clip')} and "
        f"{count(section.pairs, 'pair')}{frames}"
    )


def _row(section: SplitSummary, score: MethodSummary, keys: Sequence[str], builder: GroupBuilder) -> Row:
    stale = bool(builder.newest.stale_data(score.header))
    n = "0" if stale else f"{score.ok}" if score.ok == score.asked else f"{score.ok}/{score.asked}"
    cells = tuple(builder.cell(section, score, key) for key in keys)
    return Row(score.label, STALE if stale else score.unranked, cells, n, about(score.header))


def about(header: ResultHeader) -> str:
    """Summary of a method; "" where its header has none."""
    return header.method.summary


def _common(section: SplitSummary, key: str) -> Common | None:
    ranking = section.rankings.get(key)
    return Common(ranking.cases, ranking.clips) if ranking else None


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
        n = max(asked, *(_counted(score, key) for score in section.scores))
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
                about(first[label].header) or "a method",
                value.goal,
                mark=marks[label],
            )
            for label in labels
        ),
        ranked=tuple(rows),
        unranked=(),
        common=(None,) * len(labels),
        heading=heading,
        subject=key,
    )


def _counted(score: MethodSummary, key: str) -> int:
    return score.means[key].n if key in score.means else 0


def _never_ranked(sections: Sequence[SplitSummary], label: str) -> str:
    """Why a method is ranked in no part; "" where it is in any."""
    scores = [score for section in sections for score in section.scores if score.label == label]
    reasons = {score.unranked for score in scores if score.asked}
    if not reasons or "" in reasons:
        return ""
    return reasons.pop() if len(reasons) == 1 else "answered too few"
