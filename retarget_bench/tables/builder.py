"""From sections of results to tables: which columns, what they are written with, and what stands below."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import replace

from retarget_bench.analysis.breakdown import CURVES, By
from retarget_bench.analysis.summary import MethodSummary, SplitSummary
from retarget_bench.errors import BenchError
from retarget_bench.results import compatibility
from retarget_bench.results.header import DeclaredValue, ResultHeader
from retarget_bench.tables import missing, provenance, set_groups
from retarget_bench.tables.groups import FPS, GroupBuilder, by_method, by_part
from retarget_bench.tables.model import Group, Problem, Table

FIRST_SIGHT = (
    "mpjpe_h.world",
    "mpjpe_h.root",
    "plant_recall",
    "plant_precision",
    "touch_gap",
    "foot_slide",
    "jerk_ratio",
    FPS,
)
"""The columns of a table when nobody asks for others."""
STAND_INS = {"plant_recall": ("contact_recall",), "plant_precision": ("contact_precision",)}
"""Value id -> what is shown instead where no case has it: contacts by speed where none are known truly."""
WHERE_KNOWN = frozenset(["touch_gap"])
"""Usual columns that nobody misses where a data set does not know them."""
_DUST, _ROUNDING = 1e-6, 1e-5
"""Numbers that are rounding: of this size, or by this share of the column's largest."""

Values = Mapping[str, DeclaredValue]


def tables(
    found: Sequence[SplitSummary],
    columns: Sequence[str] = FIRST_SIGHT,
    by: str = "",
    *,
    with_sets: bool = False,
) -> list[Table]:
    """One table per data set. ``columns`` are value ids, or ``fps``.

    by: what ``found`` is broken down by; then there is a group per split and column, and where no columns
        are asked for only the first that there is (where none of the usual ones is there: all).
    with_sets: also every value of whole sets that there is, asked for or not.
    Raises BenchError for no column at all, for one that no result declares, listing those there are, and
    for one that is a curve.
    """
    declared = _declared(found)
    by_dataset: dict[str, list[SplitSummary]] = {}
    for section in found:
        by_dataset.setdefault(section.dataset, []).append(section)
    if columns is not FIRST_SIGHT:
        _check_columns(columns, declared, by, set_groups.declared(found))
    methods = {score.label: score.header for section in found for score in section.scores}
    return [
        _table(title, each, columns, declared, methods, by, with_sets) for title, each in by_dataset.items()
    ]


def all_columns(found: Sequence[SplitSummary]) -> list[str]:
    """Every value that is one number per case, in declared order, then fps, then values of sets."""
    single = [key for key, value in _declared(found).items() if not value.index]
    return [*single, FPS, *set_groups.declared(found)]


def curve_index(found: Sequence[SplitSummary], columns: Sequence[str]) -> By | None:
    """What all these values are curves over, where there is a breakdown by that."""
    declared = _declared(found)
    over = {declared[column].index if column in declared else "" for column in columns}
    known: tuple[By, ...] = ("joint", *CURVES)
    return next((by for by in known if over == {by}), None)


def _declared(found: Sequence[SplitSummary]) -> dict[str, DeclaredValue]:
    return {key: value for section in found for key, value in section.values.items()}


def _check_columns(columns: Sequence[str], declared: Values, by: str, of_sets: Iterable[str]) -> None:
    shown = sorted(key for key, value in declared.items() if not value.index)
    whole = [] if by else [FPS, *of_sets]
    known = ", ".join([*whole, *shown])
    if not columns:
        raise BenchError(f"name at least one column; there are {known}")
    for column in columns:
        if column in whole:
            continue
        if column not in declared:
            raise BenchError(f"no result has a value {column!r}; there are {known}")
        if column not in shown:
            index = declared[column].index
            raise BenchError(
                f"{column} has a number per {index}, and stands alone or beside such values; single "
                f"numbers are {known}"
            )


def _table(
    title: str,
    found: Sequence[SplitSummary],
    wanted: Sequence[str],
    declared: Values,
    methods: Mapping[str, ResultHeader],
    by: str,
    with_sets: bool,
) -> Table:
    known = compatibility.newest([score.header for section in found for score in section.scores])
    of_sets = set_groups.declared(found)
    decimals = {key: _decimals(_numbers(found, key)) for key in (*declared, FPS, *of_sets)}
    making = GroupBuilder(known, {**declared, **of_sets}, decimals, methods)
    sets = [key for key in of_sets if with_sets or key in wanted]
    keys = _broken_down(found, wanted, declared) if by else []
    if by:
        groups = [
            by_part(each, key, by, making) for each in _splits(found) for key in keys if _has(each, key)
        ]
    else:
        groups = _groups(found, wanted, sets, declared, making)
    return Table(
        title=title,
        groups=tuple(groups),
        notes=(*_set_notes(found, sets, of_sets), *_notes(found)),
        footnotes=tuple(making.footnotes.sentences),
        problems=tuple(_problems(found)),
        origins=provenance.origins(found),
        data=provenance.data_facts(found),
        subjects=tuple(making.column(key) for key in keys),
    )


def _groups(
    found: Sequence[SplitSummary],
    wanted: Sequence[str],
    sets: Sequence[str],
    declared: Values,
    making: GroupBuilder,
) -> list[Group]:
    """Per split: the values of cases, then those of sets, structure by structure."""
    of_sets = set_groups.declared(found)
    cases = wanted if wanted is FIRST_SIGHT else [key for key in wanted if key not in of_sets]
    groups = []
    for section in found:
        if cases:
            groups.append(by_method(section, *_columns(section, cases, declared), making))
        if sets:
            groups += set_groups.by_set(section, sets, making)
    return groups


def _set_notes(found: Sequence[SplitSummary], wanted: Sequence[str], of_sets: Iterable[str]) -> list[str]:
    """How to read values of sets and which there are not, or how to see them."""
    if wanted:
        lacking = [sentence for section in found for sentence in set_groups.without(section, wanted)]
        return [set_groups.READING, *lacking]
    ids = ",".join(of_sets)
    return [f"Not shown here: values of all answers as one set (--columns {ids})."] if ids else []


# --------------------------------------------------------------------------------------------- columns
def _columns(section: SplitSummary, wanted: Sequence[str], declared: Values) -> tuple[list[str], list[str]]:
    """The columns that a split has, and sentences about those that it has not."""
    if not any(score.means for score in section.scores):
        return [key for key in wanted if key == FPS or key in declared], []
    present = _present([section])
    keys: list[str] = []
    absent: dict[str, list[str]] = {}
    for key in wanted:
        if (shown := stand_in(key, present)) is not None:
            keys.append(shown)
        elif key in declared and not (wanted is FIRST_SIGHT and key in WHERE_KNOWN):
            absent.setdefault(missing.lacking([declared[key]], *section.scores), []).append(key)
    lost = [
        f"{section.split}: not shown are {', '.join(declared[key].label for key in each)}: {why}"
        for why, each in absent.items()
    ]
    return list(dict.fromkeys(keys)), lost


def stand_in(key: str, present: Collection[str]) -> str | None:
    """The column itself, or where no case has it what stands for it, at last against the source."""
    options = (key, *STAND_INS.get(key, ()))
    found = (each for each in (*options, *(f"{option}_src" for option in options)) if each in present)
    return FPS if key == FPS else next(found, None)


def _broken_down(found: Sequence[SplitSummary], wanted: Sequence[str], declared: Values) -> list[str]:
    """The values of a breakdown: a group each. Unasked, the first of the usual columns, or else all."""
    present = _present(found)
    shown = (stand_in(key, present) for key in wanted if key != FPS)
    keys = list(dict.fromkeys(key for key in shown if key is not None))
    if wanted is not FIRST_SIGHT:
        return keys
    return keys[:1] or [key for key in declared if key in present]


def _splits(found: Sequence[SplitSummary]) -> list[list[SplitSummary]]:
    by_split: dict[str, list[SplitSummary]] = {}
    for section in found:
        by_split.setdefault(section.split, []).append(section)
    return list(by_split.values())


def _has(found: Sequence[SplitSummary], key: str) -> bool:
    return key in _present(found)


def _present(found: Iterable[SplitSummary]) -> set[str]:
    return {key for section in found for score in section.scores for key in score.means}


# --------------------------------------------------------------------------------------------- numbers
def _numbers(found: Sequence[SplitSummary], key: str) -> list[float]:
    """Those of the ranked methods, which decide how a column is written; of all where these have none.

    A number is none where it is rounding beside the others: single precision is what predictions keep.
    """
    scores = [score for section in found for score in section.scores]
    numbers = [(score.unranked, abs(number)) for score in scores for number in _number(score, key)]
    dust = max(_DUST, _ROUNDING * max((size for _, size in numbers), default=0.0))
    ranked = [size for unranked, size in numbers if not unranked and size > dust]
    return ranked or [size for _, size in numbers if size > dust]


def _number(score: MethodSummary, key: str) -> list[float]:
    if key == FPS:
        return [] if score.fps is None else [score.fps]
    if key in score.means:
        return [score.means[key].value]
    return [each.value for each in score.sets if each.value_id == key and each.value is not None]


def _decimals(numbers: Sequence[float]) -> int:
    """As many as show three significant digits of the column's typical number; two for zeros alone."""
    sizes = sorted(numbers)
    sizes = [size for size in sizes if size > 1e-3 * sizes[-1]]
    if not sizes:
        return 2
    return min(7, max(0, 2 - math.floor(math.log10(sizes[len(sizes) // 2]))))


# ----------------------------------------------------------------------------------------------- below
def _notes(found: Sequence[SplitSummary]) -> list[str]:
    """What the data sets say, and which versions met."""
    notes = {note: None for section in found for note in section.notes}
    known = compatibility.newest([score.header for section in found for score in section.scores])
    for section in found:
        for score in section.scores:
            if stale := known.stale_data(score.header):
                notes[f"{section.split}: {score.label} was {stale}."] = None
    fresh = [s.header for section in found for s in section.scores if not known.stale_data(s.header)]
    if other := compatibility.other_code(fresh):
        notes[
            f"Not all of these rows were scored by the same code, though under the same version: "
            f"{', '.join(other)}. bench score brings them together."
        ] = None
    return list(notes)


def _problems(found: Sequence[SplitSummary]) -> list[Problem]:
    problems: dict[tuple[str, str, str, str], dict[str, None]] = {}
    for section in found:
        for score in section.scores:
            for each in score.header.problems:
                key = (section.split, score.label, each.status, each.message)
                problems.setdefault(key, {}).update(dict.fromkeys(each.cases))
    return _merged([Problem(*key, tuple(cases)) for key, cases in problems.items()])


def _merged(problems: Sequence[Problem]) -> list[Problem]:
    """The same, with a method's refusals of a split in one where they have more than two reasons."""
    refusals: dict[tuple[str, str], list[Problem]] = {}
    for each in problems:
        if each.status == "unsupported":
            refusals.setdefault((each.split, each.label), []).append(each)
    found: list[Problem] = []
    for each in problems:
        mine = refusals.get((each.split, each.label), [])
        if each.status != "unsupported" or len(mine) <= 2:
            found.append(each)
        elif each is mine[0]:
            cases = tuple(case for other in mine for case in other.cases)
            found.append(replace(each, cases=cases, more=len(mine) - 1))
    return found
