"""Groups of a table: methods by values, of cases or of sets; or parts of a breakdown by methods."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from retarget_bench import defaults
from retarget_bench.analysis import statistics
from retarget_bench.analysis.breakdown import CURVES
from retarget_bench.analysis.ranking import Ranking, doubt, never_ranked
from retarget_bench.analysis.summary import PEOPLE_SET, MethodSummary, SplitSummary, of_set, usual_value
from retarget_bench.api import TWO_LEGS
from retarget_bench.results.header import MetricFault
from retarget_bench.tables.cells import FITTED_CLIPS, FPS, PATH_FITTED, STALE, CellBuilder, by_number
from retarget_bench.tables.model import NOT_RUN, Cell, Group, Row, count, listed

ColumnKey = tuple[SplitSummary, str]
"""The split and the value of a column."""
SETS = "Not ranked: compare such values by their intervals and with the floor, and none of different n."


# -------------------------------------------------------------------------------- methods by values
@dataclass(frozen=True)
class MethodGroup:
    """A row per method, a column per split and value; rows are in the order of the first split.

    keys: split -> value ids.
    """

    sections: Sequence[SplitSummary]
    keys: Mapping[str, Sequence[str]]
    builder: CellBuilder

    @property
    def column_keys(self) -> list[ColumnKey]:
        return [(section, key) for section in self.sections for key in self.keys[section.split]]

    @property
    def several(self) -> bool:
        return len(self.sections) > 1

    def group(self, absent: Sequence[str]) -> Group:
        """``absent`` are sentences about columns that are left out."""
        there = {score.label: score for section in self.sections for score in section.scores}
        speeds_alone = {key for _, key in self.column_keys} == {FPS}
        if speeds_alone:  # a control says nothing of how fast motion is made
            there = {label: each for label, each in there.items() if not each.header.method.control}
        shown = (label for label in there if not self._refused(label))
        rows = [self._row(label) for label in sorted(shown, key=self._place)]
        return Group(
            title=self._title(),
            split="" if self.several else self.sections[0].split,
            columns=tuple(
                replace(self.builder.column(key), split=section.split if self.several else "")
                for section, key in self.column_keys
            ),
            ranked=tuple(row for row in rows if not row.mark),
            unranked=tuple(row for row in rows if row.mark),
            common=self._common(),
            below=(
                *self._floors(rows),
                *root_rules(self.sections),
                *clips_of_fits(self.sections),
                *absent,
                *(f"{each.split}: {each.so_far}." for each in self.sections if each.so_far),
                *filter(None, (self._beside_best(row.label) for row in rows)),
                *self._failed(),
                *self._without_marks(),
            ),
        )

    def _floors(self, rows: Sequence[Row]) -> list[str]:
        """The references' scores by values of sets, unless the row of a control shows them."""
        at = [number for number, (_, key) in enumerate(self.column_keys) if key in self.builder.pooled]
        sets = [self.column_keys[number] for number in at]
        floor_of = [(usual_value(section.scores, key).floor, key) for section, key in sets]
        texts = ["" if floor is None else self.builder.shown(floor, key) for floor, key in floor_of]
        if any(row.mark and [row.cells[number].text for number in at] == texts for row in rows):
            return []
        return floors(sets, PEOPLE_SET, self.builder)

    def _title(self) -> str:
        """The splits, and how many cases they have."""
        shown = []
        for section in self.sections:
            fresh = (each for each in section.scores if not self.builder.newest.why_outdated(each.header))
            cases = count(max((score.asked for score in fresh), default=0), "case")
            cases += f" of {count(section.clip_count, 'clip')}"
            if not self.several:
                frames = sum(info.frames for info in section.infos)
                cases += f" and {count(section.pair_count, 'pair')}"
                cases += f", {frames} frames" if frames else ""
            shown.append(f"{section.split}: {cases}")
        return "; ".join(shown)

    def _common(self) -> tuple[Ranking | None, ...]:
        """The ranking of every column of cases, without the mask of those of the matrix; none where the
        title has their numbers of cases."""
        of_cases = (
            None if key in self.builder.pooled else section.rankings.get(key)
            for section, key in self.column_keys
        )
        rankings = tuple(each and replace(each, common=None) for each in of_cases)
        counts = [max(score.asked for score in section.scores) for section, _ in self.column_keys]
        alike = all(each is None or each.cases == n for each, n in zip(rankings, counts, strict=True))
        return tuple(None for _ in rankings) if self.several and alike else rankings

    # --------------------------------------------------------------------------------------------- rows
    def _row(self, label: str) -> Row:
        scores = self._scores(label)
        cells = tuple(
            self.builder.cell(section, scores[section.split], key)
            if section.split in scores
            else Cell(NOT_RUN)
            for section, key in self.column_keys
        )
        first = next(iter(scores.values()))
        method = first.header.method
        old = any(self.builder.newest.why_outdated(score.header) for score in scores.values())
        some = dict.fromkeys(f"{each.ok} of {each.asked}" for each in scores.values())
        fewer = any(score.unranked for score in scores.values())
        mark = STALE if old else never_ranked(method) or (f"answered {', '.join(some)}" if fewer else "")
        answered = f"{first.ok}" if first.ok == first.asked else f"{first.ok}/{first.asked}"
        n = "" if self.several else "0" if old else answered
        return Row(label, mark, cells, n, method.summary, method.trained_on is not None)

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

    def _place(self, label: str) -> tuple[int, float, str]:
        """Sort key of rows: by ranking, then by number, then those without one."""
        section, score = self.sections[0], self._scores(label).get(self.sections[0].split)
        key = next(iter(self.keys[section.split]), "")
        ranking = section.rankings.get(key)
        if ranking and label in ranking.order:
            return 0, ranking.order.index(label), label
        value = self.builder.cell(section, score, key).value if score and key else None
        return by_number(value, self.builder.column(key) if key else None, label)

    # ---------------------------------------------------------------------------------------- sentences
    def _beside_best(self, label: str) -> str:
        """Numbers of the best ranked method on the cases of a method that did not answer all."""
        score = next(iter(self._scores(label).values()))
        if not score.unranked or never_ranked(score.header.method):
            return ""
        for section in self.sections:
            keys = [key for key in self.keys[section.split] if key in section.rankings]
            best = section.rankings[keys[0]].best if keys else ""
            if shared := section.on_cases_of(label, best, keys):
                numbers = [
                    f"{self.builder.column(key).label} {self.builder.shown(its.value, key)} "
                    f"({label} {self.builder.shown(own.value, key)})"
                    for key, (own, its) in shared.items()
                ]
                cases = count(next(iter(shared.values()))[0].n, "case")
                return f"{section.split}: on the {cases} of {label}, {best} has {listed(numbers)}."
        return ""

    def _failed(self) -> list[str]:
        """A sentence for each metric that failed on answers of a split."""
        faults: dict[tuple[str, str], list[tuple[str, MetricFault]]] = {}
        for section in self.sections:
            for score in section.scores:
                for fault in score.header.faults:
                    faults.setdefault((section.split, fault.metric), []).append((score.label, fault))
        sentences = []
        for (split, metric), each in faults.items():
            labels, answers = {label for label, _ in each}, sum(len(fault.cases) for _, fault in each)
            whose = f"of {min(labels)}" if len(labels) == 1 else f"of {len(labels)} methods"
            first = each[0][1]
            sentences.append(
                f"{split}: metric {metric} failed on {count(answers, 'answer')} {whose} (first "
                f"{first.cases[0]}), which lack its values alone: {first.message}"
            )
        return sentences

    def _without_marks(self) -> list[str]:
        """Why columns have no marks, and why rows have none that are not significantly worse."""
        splits_of: dict[str, list[str]] = {}
        for section, key in self.column_keys:
            ranking, label, sentence = section.rankings.get(key), self.builder.column(key).label, ""
            if ranking is None:
                if why := self._not_ranked(section, key):
                    sentence = f"no method is ranked by {label}, since {why}."
            elif len(ranking.order) > 1 and not ranking.separable:
                sentence = (
                    f"{count(ranking.clips, 'clip')} cannot tell the best method from others (that takes "
                    f"{statistics.ENOUGH_CLIPS}), so none is marked best or tied."
                )
            elif ranking.complete and ranking.unclear:
                sentence = (
                    f"by {label} {listed(ranking.unclear)} cannot be told from {ranking.best} either, "
                    "though better methods can: the difference varies more."
                )
            splits_of.setdefault(sentence, []).append(section.split)
        splits_of.pop("", None)
        return [f"{', '.join(dict.fromkeys(splits))}: {sentence}" for sentence, splits in splits_of.items()]

    def _not_ranked(self, section: SplitSummary, key: str) -> str:
        """Why nobody is ranked by a value; "" where fewer than two have it, or it is a description."""
        methods = [score for score in section.scores if not never_ranked(score.header.method)]
        having = [score for score in methods if key in score.means]
        if len(having) < 2 or self.builder.column(key).better == "none":
            return ""
        if why := doubt(section, key):
            return why
        ranked = any(not score.unranked for score in having)
        why = "no case has a number of all ranked methods" if ranked else "none answered all cases"
        return f"{why}. Each number is over other cases"


def root_rules(sections: Sequence[SplitSummary]) -> list[str]:
    """What root paths are scaled by, on the papers' clips, where it decides most of the error, and wherever
    paths are fitted."""
    labels_of: dict[str, dict[str, None]] = {}
    for section in sections:
        if _fitted(section) or section.rows[0].header.dataset.name == defaults.PAPERS_DATASET:
            for score in section.scores:
                method = score.header.method
                if not never_ranked(method):
                    labels_of.setdefault(method.root_rule or "unknown", {})[score.label] = None
    if not labels_of:
        return []
    usual = max(labels_of, key=lambda rule: len(labels_of[rule]))
    others = [f"{rule} for {listed(list(each))}" for rule, each in labels_of.items() if rule != usual]
    rest = f"{usual} for all others" if others else f"{usual} for all"
    return [f"Rule that scales root paths: {'; '.join([*others, rest])}."]


def clips_of_fits(sections: Sequence[SplitSummary]) -> list[str]:
    """Over how many clips of a pair paths are fitted."""
    fitted = [(section.split, score) for section in sections for score in _fitted(section)]
    clips = {f"{split} {score.means[FITTED_CLIPS].value:.0f}" for split, score in fitted}
    over = f"Paths are fitted over all clips of a pair of bodies (clips, about: {listed(sorted(clips))})."
    return [over] if clips else []


def _fitted(section: SplitSummary) -> list[MethodSummary]:
    """The methods with an error after a fit."""
    having = [score for score in section.scores if FITTED_CLIPS in score.header.values]
    # asked one by one: a comparison with all keys would compute every value
    return [score for score in having if PATH_FITTED in score.means and FITTED_CLIPS in score.means]


def speeds(section: SplitSummary) -> list[str]:
    """Frames per second of the methods, in a sentence; and one for each that is not comparable."""
    methods = [score for score in section.scores if not never_ranked(score.header.method)]
    timed = [(score.fps, score) for score in methods if score.fps is not None]
    timed.sort(key=lambda each: (-each[0], each[1].label))
    shown = [f"{score.label} {fps:,.0f}" for fps, score in timed if not section.slower(score)]
    lead = "Speed in frames/s of one process and thread, with handing over"
    return [
        *([f"{lead}: {', '.join(shown)}."] if shown else []),
        *(
            f"Not comparable: {score.label} {fps:,.0f}, {slower}."
            for fps, score in timed
            if (slower := section.slower(score))
        ),
    ]


# ---------------------------------------------------------------------------------------- values of sets
def floors(column_keys: Sequence[ColumnKey], which: tuple[str, str], builder: CellBuilder) -> list[str]:
    """A sentence for each value of a set: the references' scores."""
    floor_of: dict[str, list[str]] = {}
    for section, key in column_keys:
        if (floor := usual_value(section.scores, key, which).floor) is not None:
            floor_of.setdefault(builder.column(key).label, []).append(
                f"{section.split} {builder.shown(floor, key)}"
            )
    return [f"Floor of {label}, that of real motion: {', '.join(of)}." for label, of in floor_of.items()]


def by_set(section: SplitSummary, keys: Sequence[str], builder: CellBuilder) -> list[Group]:
    """A group per set (target structure and kind) that any method has a value for, a row per method."""
    computed: dict[tuple[str, str], dict[str, None]] = {}
    for each in (each for score in section.scores for each in score.sets):
        if each.value_id in keys and each.value is not None:
            computed.setdefault((each.structure, each.kind), {})[each.value_id] = None
    return [
        _of_set(section, which, [key for key in keys if key in present], builder)
        for which, present in sorted(computed.items())
    ]


def _of_set(
    section: SplitSummary, which: tuple[str, str], keys: Sequence[str], builder: CellBuilder
) -> Group:
    (structure, kind), columns = which, tuple(map(builder.column, keys))
    usual = {key: usual_value(section.scores, key, which) for key in keys}
    rows = []
    for score in section.scores:
        mark = STALE if builder.newest.why_outdated(score.header) else score.unranked
        values = [of_set(score.sets, key, which) for key in keys]
        n = max((each.n for each in values if each is not None), default=0)
        cells = tuple(builder.cell(section, score, key, which) for key in keys)
        method = score.header.method
        rows.append(Row(score.label, mark, cells, f"{n}", method.summary, method.trained_on is not None))
    rows.sort(key=lambda row: by_number(row.cells[0].value, columns[0], row.label))
    n, clips = max((each.n, each.clips) for each in usual.values())
    bodies = f"on {TWO_LEGS}" if structure == TWO_LEGS else f"of structure {structure}"
    bodies += f", kind {kind}" if kind else ""
    return Group(
        title=f"{section.split}, all answers on bodies {bodies} as one set: {count(n, 'window')} of "
        f"{count(clips, 'clip')}",
        split=section.split,
        columns=columns,
        ranked=tuple(row for row in rows if not row.mark),
        unranked=tuple(row for row in rows if row.mark),
        below=(*floors([(section, key) for key in keys], which, builder), SETS),
        counted="windows",
        structure=structure,
        kind=kind,
    )


def without_sets(sections: Sequence[SplitSummary], keys: Sequence[str]) -> list[str]:
    """A sentence about the sets for which no method has any of these values; [] for none."""
    reasons: dict[str, str] = {}
    for section in sections:
        values = [each for score in section.scores for each in score.sets if each.value_id in keys]
        having = {(each.structure, each.kind) for each in values if each.value is not None}
        for each in values:
            if (each.structure, each.kind) not in having:
                name = f"{section.split} {each.structure} {each.kind}".strip()
                reasons.setdefault(name, each.reason)
    if not reasons:
        return []
    first = next(iter(reasons.values()))
    return [f"No values of sets on bodies of these structures: {', '.join(reasons)}. The first: {first}."]


# --------------------------------------------------------------------------------- parts by methods
def by_part(sections: Sequence[SplitSummary], key: str, heading: str, builder: CellBuilder) -> Group:
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
        cells = []
        for label in labels:
            cell = builder.cell(section, scores[label], key) if label in scores else Cell(NOT_RUN)
            if cell.value is not None and scores[label].unranked and not marks[label]:
                reason = "over the cases that it answered, which are not all of this line"
                cell = replace(cell, reason=reason, footnote=builder.footnotes.number(reason))
            cells.append(cell)
        # not every body has every joint, nor every clip every second
        same_cases = heading not in ("joint", "part", *CURVES)
        counted = max(score.asked for score in section.scores) if same_cases else 0
        n = max(counted, *(score.means[key].n for score in section.scores if key in score.means), 0)
        rows.append(Row(section.part, "", tuple(cells), f"{n}"))
    split = sections[0].split
    unit = f" in {value.unit}" if value.unit != "1" else ""
    so_far = dict.fromkeys(section.so_far for section in sections if section.so_far)
    return Group(
        title=f"{split}: {value.label} {value.arrow}".rstrip() + f"{unit}, by {heading}",
        split=split,
        columns=tuple(
            replace(
                value,
                id=label,
                label=label,
                unit="1",
                meaning=first[label].header.method.summary or "a method",
                formula="",
                version="",
                mark=marks[label],
            )
            for label in labels
        ),
        ranked=tuple(rows),
        unranked=(),
        heading=heading,
        subject=key,
        below=(*root_rules(sections), *(f"{split}: {each}." for each in so_far)),
    )


def _never_ranked(sections: Sequence[SplitSummary], label: str) -> str:
    """The reason why a method is ranked in no part; "" where it is in any."""
    scores = [score for section in sections for score in section.scores if score.label == label]
    reasons = {score.unranked for score in scores if score.asked}
    if not reasons or "" in reasons:
        return ""
    return reasons.pop() if len(reasons) == 1 else "answered fewer"
