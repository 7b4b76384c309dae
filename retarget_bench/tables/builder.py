"""Table builder: columns, decimals, groups and notes of the tables of split summaries."""

from collections.abc import Collection, Iterable, Mapping, Sequence
from typing import Literal

from retarget_bench.analysis.breakdown import CURVES, By
from retarget_bench.analysis.summary import SplitSummary
from retarget_bench.api import CROSS, INTRA, SELF, TWO_LEGS, against_source
from retarget_bench.errors import BenchError
from retarget_bench.results import compatibility
from retarget_bench.results.header import DeclaredValue
from retarget_bench.tables import provenance
from retarget_bench.tables.cells import (
    FPS,
    PATH_FITTED,
    CellBuilder,
    declared_sets,
    declared_values,
    lacking,
)
from retarget_bench.tables.finding import finding
from retarget_bench.tables.method_groups import MethodGroup, by_part, by_set, speeds, without_sets
from retarget_bench.tables.model import Group, Problem, Table

DEFAULT_COLUMNS = (
    "mpjpe_h.world",
    PATH_FITTED,
    "mpjpe_h.root",
    "contact_recall",
    "contact_precision",
    "fid",
    "foot_slide",
    "jerk_ratio",
    "joint_speed_excess",
)
"""Value ids of the default columns of a split, in order; the first also decides the order of rows and the
colours of methods."""
OVERVIEW_COLUMNS = ("mpjpe_h.world", "contact_recall", "fid")
"""Of the table of all splits side by side."""
LISTED = "bench info protocols (in Python rb.metrics()) lists all"
"""The end of messages about values, of which there are too many to name."""
HARDEST_FIRST = (CROSS, INTRA, SELF)
"""The usual splits as tables show them: in the last one copying is exact."""

Values = Mapping[str, DeclaredValue]
Layout = Literal["splits", "overview", "both"]


def tables(
    sections: Sequence[SplitSummary],
    columns: Sequence[str] | None = None,
    by: str = "",
    *,
    with_sets: bool = False,
    layout: Layout = "splits",
) -> list[Table]:
    """One table per data set and group of bodies.

    columns: value ids, or ``fps``; None: ``DEFAULT_COLUMNS`` and ``OVERVIEW_COLUMNS``, of which results may
        lack some, and show what they have where they lack all.
    by: the breakdown of ``sections``. Then there is a group per split and column; without requested
        columns, only the first default column that exists (or all values where none does).
    with_sets: add every value of whole sets, requested or not.
    layout: a group per split, one of all splits side by side with ``OVERVIEW_COLUMNS`` or those requested,
        or both. Values of whole sets beside others, and more columns than ``OVERVIEW_COLUMNS`` has, need a
        group per split.
    Raises BenchError for an empty list of columns, an unknown one, and a curve.
    """
    declared = declared_values(sections)
    if columns is not None:
        _check_columns(columns, declared, by, declared_sets(sections))
    elif not by:
        columns = _own_columns(sections) or None
    grouped: dict[str, list[SplitSummary]] = {}
    for section in sections:
        bodies = f": {section.bodies}" if section.bodies else ""
        grouped.setdefault(section.dataset + bodies, []).append(section)
    return [
        _table(title, in_order(each), columns, declared, by, with_sets, layout)
        for title, each in grouped.items()
    ]


def in_order(sections: Sequence[SplitSummary]) -> list[SplitSummary]:
    """Sections as tables show them: ``HARDEST_FIRST``, then other splits in the order of the data set."""
    places = {split: place for place, split in enumerate(HARDEST_FIRST)}
    return sorted(sections, key=lambda section: places.get(section.split, len(places)))


def all_columns(sections: Sequence[SplitSummary]) -> list[str]:
    """Every value that is one number per case, in declared order, then fps, then values of sets; none that
    only stands in for another."""
    declared = declared_values(sections)
    single = [key for key in entries(declared) if not declared[key].index]
    return [*single, FPS, *declared_sets(sections)]


def curve_index(sections: Sequence[SplitSummary], columns: Sequence[str]) -> By | None:
    """The common index of these curves, if there is a breakdown by it."""
    declared = declared_values(sections)
    over = {declared[column].index if column in declared else "" for column in columns}
    indices: tuple[By, ...] = ("joint", *CURVES)
    return next((by for by in indices if over == {by}), None)


def _table(
    title: str,
    sections: Sequence[SplitSummary],
    columns: Sequence[str] | None,
    declared: Values,
    by: str,
    with_sets: bool,
    layout: Layout,
) -> Table:
    of_sets = declared_sets(sections)
    builder = CellBuilder(sections, {**declared, **of_sets})
    apart = [key for key in of_sets if key not in builder.pooled]
    sets = [key for key in apart if with_sets or key in (columns or ())]
    keys = _broken_down(sections, columns) if by else []
    cases = [key for key in columns or DEFAULT_COLUMNS if key not in apart]
    groups: list[Group] = []
    if by:
        for split in dict.fromkeys(section.split for section in sections):
            parts = [section for section in sections if section.split == split]
            groups += [by_part(parts, key, by, builder) for key in keys if key in _present(parts, keys)]
    else:
        beside = OVERVIEW_COLUMNS if columns is None else cases
        layout = (
            "splits" if layout == "overview" and (sets or len(beside) > len(OVERVIEW_COLUMNS)) else layout
        )
        if layout != "splits":
            groups.append(_methods(_timed(sections) if set(beside) == {FPS} else sections, beside, builder))
        for section in sections if layout != "overview" else ():
            groups += [_methods([section], cases, builder, among=sections)] if cases else []
            groups += by_set(section, sets, builder)
    speed_notes = speeds(_timed(sections)[0]) if not by and FPS not in cases else []
    left = (
        []
        if sets or not apart
        else [f"Not shown: values of all answers as one set (--columns {','.join(apart)})."]
    )
    return Table(
        title=title,
        groups=tuple(groups),
        finding=finding(groups[0], sections) if groups and layout != "splits" and not by else "",
        notes=(*speed_notes, *left, *_notes(sections, builder.newest)),
        footnotes=tuple(builder.footnotes.sentences),
        problems=tuple(_problems(sections)),
        provenance=provenance.provenance(sections),
        data=provenance.data_facts(sections),
        subjects=tuple(builder.column(key) for key in keys),
        hints=(*_unreadable(sections), *without_sets(sections, sets)),
        splits={section.split: section.meaning for section in sections if section.meaning},
    )


def _methods(
    sections: Sequence[SplitSummary],
    requested: Sequence[str],
    builder: CellBuilder,
    among: Sequence[SplitSummary] = (),
) -> Group:
    """Methods on these splits, with a sentence about columns and methods that are only ``among`` others."""
    columns = [_columns(section, requested, builder) for section in sections]
    shown = {section.split: keys for section, (keys, _) in zip(sections, columns, strict=True)}
    here = {score.label for section in sections for score in section.scores}
    elsewhere = dict.fromkeys(s.label for section in among for s in section.scores if s.label not in here)
    absent = [line for _, lost in columns for line in lost]
    if elsewhere:
        absent.append(f"{sections[0].split}: not run here: {', '.join(elsewhere)}.")
    return MethodGroup(sections, shown, builder).group(absent)


def _timed(sections: Sequence[SplitSummary]) -> Sequence[SplitSummary]:
    """The split that speeds were measured on, alone: they are measured once."""
    timed = [each for each in sections if any(score.fps is not None for score in each.scores)]
    return (timed or sections)[:1]


# --------------------------------------------------------------------------------------------- columns
def _own_columns(sections: Sequence[SplitSummary]) -> list[str]:
    """The values with a number, of results that have none of the usual ones; else []."""
    sets = {each.value_id for section in sections for score in section.scores for each in score.sets}
    if _present(sections, DEFAULT_COLUMNS) or sets & set(DEFAULT_COLUMNS):
        return []
    numbers = {key for section in sections for score in section.scores for key in score.means}
    return [key for key, value in declared_values(sections).items() if key in numbers and not value.index]


def _check_columns(columns: Sequence[str], declared: Values, by: str, of_sets: Iterable[str]) -> None:
    without_parts = [FPS, *of_sets]
    if not columns:
        raise BenchError(f"name at least one column, such as {DEFAULT_COLUMNS[0]}; {LISTED}")
    for column in columns:
        if column in without_parts:
            if by:
                raise BenchError(f"{column} has no number per {by}; leave it, or --by")
            continue
        if column not in declared:
            raise BenchError(f"no result has a value {column!r}; {LISTED}")
        if index := declared[column].index:
            raise BenchError(
                f"{column} has a number per {index} and cannot stand beside single numbers; ask it alone"
            )


def _columns(
    section: SplitSummary, requested: Sequence[str], builder: CellBuilder
) -> tuple[list[str], list[str]]:
    """The columns that a split has, and sentences about those it lacks."""
    present = _present([section], requested)
    if not present and not any(score.means for score in section.scores):
        return [key for key in requested if key == FPS or key in builder.declared], []
    keys: list[str] = []
    absent: dict[str, list[str]] = {}
    for key in requested:
        of_sets = key in builder.pooled or (section.so_far and key in declared_sets([section]))
        shown = key if of_sets else stand_in(key, present)
        reason = _no_set(section, key) if of_sets else ""
        if shown is not None and not reason:
            keys.append(shown)
        elif key in builder.declared:
            reason = reason or lacking(builder.declared[key], section.scores)
            absent.setdefault(reason, []).append(builder.declared[key].label)
    lost = [f"{section.split}: not shown: {', '.join(each)} ({why})" for why, each in absent.items()]
    return list(dict.fromkeys(keys)), lost


def _no_set(section: SplitSummary, key: str) -> str:
    """Reason why no method has this value of the set of all bodies; "" where one has."""
    if section.so_far:
        return "computed of all cases, once they are done"
    values = [each for score in section.scores for each in score.sets if each.value_id == key]
    values = [each for each in values if each.structure == TWO_LEGS]
    if any(each.value is not None for each in values):
        return ""
    return "; ".join(dict.fromkeys(each.reason for each in values)) or "no case is between two legs"


def entries(ids: Collection[str]) -> list[str]:
    """The ids without those against the source of any of them, which are no entries of their own."""
    twins = set(map(against_source, ids))
    return [key for key in ids if key not in twins]


def stand_in(key: str, present: Collection[str]) -> str | None:
    """The column, or the same relative to the source where no case has it; or None."""
    either = (key, against_source(key))
    return FPS if key == FPS else next((each for each in either if each in present), None)


def _broken_down(sections: Sequence[SplitSummary], columns: Sequence[str] | None) -> list[str]:
    """The values of a breakdown, a group each; by default the first default column, or else all."""
    candidates = [key for key in columns or DEFAULT_COLUMNS if key != FPS]
    present = _present(sections, candidates)
    keys = list(dict.fromkeys(filter(None, (stand_in(key, present) for key in candidates))))
    if columns is not None:
        return keys
    declared = declared_values(sections)
    return keys[:1] or [key for key in declared if key in _present(sections, declared)]


def _present(sections: Sequence[SplitSummary], keys: Iterable[str]) -> set[str]:
    """Those of the values that any method has, and of what stands in for those that none has."""
    means = [score.means for section in sections for score in section.scores]
    either = ((key, against_source(key)) for key in keys)
    first = (next((k for k in both if any(k in each for each in means)), "") for both in either)
    return set(filter(None, first))


# ----------------------------------------------------------------------------------------------- below
def _notes(sections: Sequence[SplitSummary], newest: compatibility.Newest) -> list[str]:
    """Notes of the data sets, and notes on results of other versions."""
    notes = [note for section in sections for note in section.rows[0].header.dataset.notes]
    fresh = []
    for section in sections:
        for score in section.scores:
            if stale := newest.why_outdated(score.header):
                notes.append(f"{section.split}: {score.label} was {stale}.")
            else:
                fresh.append(score.header)
    if other := compatibility.other_code(fresh):
        notes.append(
            f"Some rows were scored by other code under the same version: {', '.join(other)}; bench run "
            "brings them together."
        )
    return list(dict.fromkeys(notes))


def _unreadable(sections: Sequence[SplitSummary]) -> list[str]:
    """Sentences on files of the data sets that cannot be read: means are over what is left."""
    facts = [row.header.dataset.unreadable for section in sections for row in section.rows]
    return list(dict.fromkeys(each.sentence for each in facts if each is not None))


def _problems(sections: Sequence[SplitSummary]) -> list[Problem]:
    """Problems, with the refusals of a method on a split merged where they have more than two reasons."""
    cases: dict[tuple[str, str, str, str], dict[str, None]] = {}
    refusals: dict[tuple[str, str], dict[str, None]] = {}
    for section in sections:
        for score in section.scores:
            for each in (*score.header.problems, *score.header.doubts):
                key = (section.split, score.label, each.status, each.message)
                cases.setdefault(key, {}).update(dict.fromkeys(each.cases))
                if each.status == "unsupported":
                    refusals.setdefault(key[:2], {})[each.message] = None
    problems = []
    for (split, label, status, message), ids in cases.items():
        reasons = list(refusals.get((split, label), ())) if status == "unsupported" else []
        if len(reasons) <= 2:
            problems.append(Problem(split, label, status, message, tuple(ids)))
        elif message == reasons[0]:
            every = [case for reason in reasons for case in cases[split, label, status, reason]]
            problems.append(Problem(split, label, status, message, tuple(every), len(reasons) - 1))
    return problems
