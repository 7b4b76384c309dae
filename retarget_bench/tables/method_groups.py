"""Groups of a table: methods by values, on one split or several side by side; or parts by methods."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from retarget_bench.analysis import statistics
from retarget_bench.analysis.breakdown import CURVES
from retarget_bench.analysis.ranking import Ranking, doubt, never_ranked
from retarget_bench.analysis.summary import MethodSummary, SplitSummary
from retarget_bench.api import TWO_LEGS
from retarget_bench.results.header import MetricFault
from retarget_bench.tables.groups import ABSENT, FPS, STALE, GroupBuilder, usual_value
from retarget_bench.tables.model import NOT_APPLICABLE, NOT_RUN, Cell, Column, Group, Row, count


# -------------------------------------------------------------------------------- methods by values
@dataclass(frozen=True)
class MethodGroup:
    """A row per method, a column per split and value; rows are in the order of the last split.

    keys: split -> value ids.
    """

    sections: Sequence[SplitSummary]
    keys: Mapping[str, Sequence[str]]
    builder: GroupBuilder

    @property
    def spots(self) -> list[tuple[SplitSummary, str]]:
        """The split and the value of every column."""
        return [(section, key) for section in self.sections for key in self.keys[section.split]]

    @property
    def several(self) -> bool:
        return len(self.sections) > 1

    def group(self, absent: Sequence[str]) -> Group:
        """``absent`` are sentences for the foot."""
        there = {score.label for section in self.sections for score in section.scores}
        missing = (item for item in self.builder.methods.items() if item[0] not in there)
        shown = (label for label in there if not (self._refused(label) or self._untold(label)))
        listed = [self._row(label) for label in sorted(shown, key=self._place)]
        nothing = tuple(Cell(NOT_RUN) for _ in self.spots)
        n = "" if self.several else "0"
        return Group(
            title=self._title(),
            split="" if self.several else self.sections[0].split,
            columns=tuple(self._column(*spot) for spot in self.spots),
            ranked=tuple(row for row in listed if not row.mark),
            unranked=(
                *(each for row in listed if row.apart for each in (row, *self._companion(row))),
                *(row for row in listed if row.mark and not row.apart),
                *(Row(label, ABSENT, nothing, n, header.method.summary) for label, header in missing),
            ),
            common=self._common(),
            absent=(*absent, *self._failed(), *self._alone(), *self._too_few_clips()),
            below=tuple(self._speeds()),
            floors=self._floors(),
            learned=self._learned(),
        )

    def _title(self) -> str:
        """The splits, and how many cases they have."""
        shown = []
        for section in self.sections:
            asked = [
                score.asked
                for score in section.scores
                if not self.builder.newest.why_outdated(score.header)
            ]
            cases = f"{count(max(asked, default=0), 'case')} of {count(section.clips, 'clip')}"
            if not self.several:
                frames = f", {section.frames} frames" if section.frames else ""
                cases += f" and {count(section.pairs, 'pair')}{frames}"
            shown.append(f"{section.split}: {cases}")
        return "; ".join(shown)

    def _common(self) -> tuple[Ranking | None, ...]:
        """The ranking of every column; none where the title has their numbers of cases."""
        found = tuple(section.rankings.get(key) for section, key in self.spots)
        asked = [max(score.asked for score in section.scores) for section, _ in self.spots]
        alike = all(each is None or each.cases == n for each, n in zip(found, asked, strict=True))
        return tuple(None for _ in found) if self.several and alike else found

    def _column(self, section: SplitSummary, key: str) -> Column:
        return replace(self.builder.column(key), split=section.split if self.several else "")

    def _row(self, label: str) -> Row:
        scores = self._scores(label)
        cells = tuple(
            self.builder.cell(section, scores[section.split], key)
            if section.split in scores
            else Cell(NOT_RUN)
            for section, key in self.spots
        )
        first = next(iter(scores.values())).header.method
        old = any(self.builder.newest.why_outdated(score.header) for score in scores.values())
        fewer = any(score.unranked for score in scores.values())
        never = never_ranked(first)
        mark = STALE if old else never or (_answered(list(scores.values())) if fewer else "")
        apart = fewer and not (old or never) and any(cell.value is not None for cell in cells)
        n = "" if self.several else "0" if old else _of(next(iter(scores.values())))
        return Row(label, mark, cells, n, first.summary, apart)

    def _scores(self, label: str) -> dict[str, MethodSummary]:
        """Split -> the summary of a method."""
        return {
            each.split: score for each in self.sections for score in each.scores if score.label == label
        }

    def _refused(self, label: str) -> bool:
        """True for a method that is not for these bodies at all; a note says so in place of a row."""
        counts = [score.header.counts for score in self._scores(label).values()]
        alone = bool(self.sections[0].bodies) and any(each.asked for each in counts)
        return alone and all(each.unsupported == each.asked for each in counts)

    def _untold(self, label: str) -> bool:
        """True for a control where all columns are speeds: it says nothing of how fast motion is made."""
        method = next(iter(self._scores(label).values())).header.method
        return method.control and {key for _, key in self.spots} == {FPS}

    def _place(self, label: str) -> tuple[int, float, str]:
        """Sort key of rows: by ranking, then by number, then those without one."""
        section, score = self.sections[-1], self._scores(label).get(self.sections[-1].split)
        key = next(iter(self.keys[section.split]), "")
        ranking = section.rankings.get(key)
        if ranking and label in ranking.order:
            return 0, ranking.order.index(label), label
        value = self.builder.cell(section, score, key).value if score and key else None
        if value is None:
            return 2, 0.0, label
        column = self.builder.column(key)
        if column.better == "target":
            return 1, abs(math.log(value / column.goal)) if value > 0 else math.inf, label
        return 1, -value if column.better == "higher" else value, label

    def _companion(self, row: Row) -> list[Row]:
        """The best ranked method over the cases that a method answered, since all others are over more."""
        every = ((section, key) for section in reversed(self.sections) for key in self.keys[section.split])
        rankings = (section.rankings.get(key) for section, key in every)
        best = next((ranking.best for ranking in rankings if ranking), None)
        if best is None:
            return []
        shared = {
            section.split: section.on_cases_of(row.label, best, self.keys[section.split])
            for section in self.sections
        }
        cells = tuple(
            self.builder.mean_cell(shared[section.split][key][1], key)
            if key in shared[section.split]
            else self._not_kept(key)
            for section, key in self.spots
        )
        return [Row(best, "", cells, row.n.partition("/")[0], apart=True, beside=row.label)]

    def _not_kept(self, key: str) -> Cell:
        if key in self.builder.whole:
            return self.builder.footnotes.missing("known over all answers of a method as one set alone")
        return Cell(NOT_APPLICABLE)

    # ---------------------------------------------------------------------------------------- sentences
    def _failed(self) -> list[str]:
        """A sentence for each metric that failed on answers of a split."""
        found: dict[tuple[str, str], list[tuple[str, MetricFault]]] = {}
        for section in self.sections:
            for score in section.scores:
                for fault in score.header.faults:
                    found.setdefault((section.split, fault.metric), []).append((score.label, fault))
        sentences = []
        for (split, metric), each in found.items():
            labels, answers = {label for label, _ in each}, sum(len(fault.cases) for _, fault in each)
            whose = f"of {min(labels)}" if len(labels) == 1 else f"of {len(labels)} methods"
            first = each[0][1]
            sentences.append(
                f"{split}: metric {metric} failed on {count(answers, 'answer')} {whose} (first "
                f"{first.cases[0]}), which lack its values alone: {first.message}"
            )
        return sentences

    def _alone(self) -> list[str]:
        """Columns that rank nobody though several methods have numbers."""
        found = []
        for section, key in self.spots:
            methods = [score for score in section.scores if not never_ranked(score.header.method)]
            having = [score for score in methods if key in score.means]
            if (
                len(having) > 1
                and key not in section.rankings
                and self.builder.declared[key].better != "none"
            ):
                ranked = any(not score.unranked for score in having)
                why = "no case has a number of all ranked methods" if ranked else "none answered all cases"
                why += ". Each number is over other cases"
                why = (section.matrix and doubt(section.matrix, key)) or why
                label = self.builder.column(key).label
                found.append(f"{section.split}: no method is ranked by {label}, since {why}.")
        return found

    def _too_few_clips(self) -> list[str]:
        """Splits without marks, and how many clips marks would need."""
        found: dict[str, list[str]] = {}
        for section, key in self.spots:
            ranking = section.rankings.get(key)
            if ranking is None or len(ranking.order) < 2 or ranking.separable:
                continue
            sentence = (
                f"{count(ranking.clips, 'clip')} cannot tell the best method from others (that takes "
                f"{statistics.ENOUGH_CLIPS}), so none is marked best or tied"
            )
            found.setdefault(sentence, []).append(section.split)
        return [f"{', '.join(dict.fromkeys(splits))}: {sentence}." for sentence, splits in found.items()]

    def _floors(self) -> tuple[tuple[str, str, str], ...]:
        """The scores of the references by values of sets."""
        found = (
            (key, section.split, usual_value(section, (TWO_LEGS, ""), key).floor)
            for section, key in self.spots
            if key in self.builder.whole
        )
        return tuple(
            (self.builder.column(key).label, split, self.builder.shown(floor, key))
            for key, split, floor in found
            if floor is not None
        )

    def _learned(self) -> tuple[str, ...]:
        """The labels of the learned methods."""
        scores = {score.label: score for section in self.sections for score in section.scores}
        learned = [label for label, score in scores.items() if score.header.method.trained_on is not None]
        return tuple(sorted((each for each in learned if not self._refused(each)), key=self._place))

    def _speeds(self) -> list[str]:
        """Frames per second of the methods."""
        section = self.sections[-1]
        if FPS in self.keys[section.split]:
            return []
        methods = [score for score in section.scores if not never_ranked(score.header.method)]
        speeds = {score.label: score.fps for score in methods if score.fps is not None}
        slower = {score.label: each for score in methods if (each := section.slower(score))}
        ordered = sorted(speeds, key=speeds.__getitem__)[::-1]
        shown = [f"{label} {speeds[label]:,.0f}" for label in ordered if label not in slower]
        said = "Speed in frames/s of one process and thread, with handing over"
        found = [f"{said}: {', '.join(shown)}."] if shown else []
        return [
            *found,
            *(
                f"Not comparable: {each} {speeds[each]:,.0f}, {slower[each]}."
                for each in ordered
                if each in slower
            ),
        ]


def _of(score: MethodSummary) -> str:
    return f"{score.ok}" if score.ok == score.asked else f"{score.ok}/{score.asked}"


def _answered(scores: Sequence[MethodSummary]) -> str:
    """Number of cases that a method answered, on one split or on each of several."""
    if len(scores) == 1:
        return scores[0].unranked
    return f"answered {', '.join(str(score.ok) for score in scores)}"


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
            _of_part(section, scores[label], key, builder, marks[label])
            if label in scores
            else Cell(NOT_RUN)
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


def _of_part(
    section: SplitSummary, score: MethodSummary, key: str, builder: GroupBuilder, mark: str
) -> Cell:
    """The cell of a method and a part, with a footnote where it is ranked in other parts and not in this.

    mark: why it is ranked in none.
    """
    cell = builder.cell(section, score, key)
    if mark or cell.value is None or not score.unranked:
        return cell
    reason = "over the cases that it answered, which are not all of this line"
    return replace(cell, reason=reason, footnote=builder.footnotes.number(reason))


def _never_ranked(sections: Sequence[SplitSummary], label: str) -> str:
    """The reason why a method is ranked in no part; "" where it is in any."""
    scores = [score for section in sections for score in section.scores if score.label == label]
    reasons = {score.unranked for score in scores if score.asked}
    if not reasons or "" in reasons:
        return ""
    return reasons.pop() if len(reasons) == 1 else "answered fewer"
