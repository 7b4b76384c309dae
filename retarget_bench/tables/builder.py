"""Table builder: columns, decimals, groups and notes of the tables of split summaries."""

import math
from collections.abc import Collection, Iterable, Mapping, Sequence

from retarget_bench.analysis.breakdown import CURVES, By
from retarget_bench.analysis.summary import MethodSummary, SplitSummary, split_summaries
from retarget_bench.errors import BenchError
from retarget_bench.results import compatibility
from retarget_bench.results.header import DeclaredValue, ResultHeader
from retarget_bench.results.store import ResultPaths
from retarget_bench.tables import provenance, set_groups
from retarget_bench.tables.groups import FPS, GroupBuilder, by_method, by_part, lacking
from retarget_bench.tables.model import Group, Problem, Table

DEFAULT_COLUMNS = (
    "mpjpe_h.world",
    "mpjpe_h.root",
    "plant_recall",
    "plant_precision",
    "touch_gap",
    "foot_slide",
    "jerk_ratio",
    FPS,
)
"""Value ids of the default columns, in order; the first also decides the order of rows and the colours of
methods. ``STAND_INS`` and ``WHERE_KNOWN`` replace or leave out some on data without labels."""
STAND_INS = {"plant_recall": ("contact_recall",), "plant_precision": ("contact_precision",)}
"""Value id -> its replacement where no case has it: contacts by speed for contacts by position."""
WHERE_KNOWN = frozenset(["touch_gap"])
"""Default columns that are left out silently where a data set has no labels for them."""
_DUST, _ROUNDING = 1e-6, 1e-5
"""Numbers below this size, or this share of the column's largest, count as rounding errors."""

TASK_COLUMNS = {
    "reconstruct": ("restored_cm", "jerk_ratio"),
    "denoise": ("restored_cm", "jerk_ratio"),
    "upsample": ("restored_cm", "restored_cm.missing"),
}
"""Derived task -> its default columns."""
TASK_BREAKDOWN: dict[str, By] = {"reconstruct": "structure", "denoise": "level", "upsample": "level"}
"""Derived task -> its default breakdown, since a mean over levels says little."""

Values = Mapping[str, DeclaredValue]


def tables(
    found: Sequence[SplitSummary],
    columns: Sequence[str] = DEFAULT_COLUMNS,
    by: str = "",
    *,
    with_sets: bool = False,
) -> list[Table]:
    """One table per data set. ``columns`` are value ids, or ``fps``.

    by: the breakdown of ``found``. Then there is a group per split and column; without requested columns,
        only the first default column that exists (or all values where none does).
    with_sets: add every value of whole sets, requested or not.
    Raises BenchError for an empty list of columns, an unknown one (listing those that exist), and a curve.
    """
    declared = _declared(found)
    by_dataset: dict[str, list[SplitSummary]] = {}
    for section in found:
        by_dataset.setdefault(section.dataset, []).append(section)
    if columns is not DEFAULT_COLUMNS:
        _check_columns(columns, declared, by, set_groups.declared(found))
    methods = {score.label: score.header for section in found for score in section.scores}
    return [
        _table(title, each, columns, declared, methods, by, with_sets) for title, each in by_dataset.items()
    ]


def task_tables(places: Sequence[ResultPaths], task: str, by: By | None = None) -> list[Table]:
    """The tables of a task: by level or structure, or whatever else is asked for; of ``reconstruct`` also
    one over all structures."""
    whole = split_summaries(places) if by is None and TASK_BREAKDOWN[task] == "structure" else []
    by = by or TASK_BREAKDOWN[task]
    parts, wanted = split_summaries(places, by), TASK_COLUMNS[task]
    return [
        *tables(whole, _known_columns(whole, wanted)),
        *tables(parts, _known_columns(parts, wanted[: 1 if whole else None]), by),
    ]


def _known_columns(found: Sequence[SplitSummary], wanted: Sequence[str]) -> Sequence[str]:
    """Those that any result has; the default columns of all tables where none has."""
    there = {key for section in found for key in section.values}
    return tuple(key for key in wanted if key in there) or DEFAULT_COLUMNS


def all_columns(found: Sequence[SplitSummary]) -> list[str]:
    """Every value that is one number per case, in declared order, then fps, then values of sets."""
    single = [key for key, value in _declared(found).items() if not value.index]
    return [*single, FPS, *set_groups.declared(found)]


def curve_index(found: Sequence[SplitSummary], columns: Sequence[str]) -> By | None:
    """The common index of these curves, if there is a breakdown by it."""
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
                f"{column} has a number per {index} and cannot stand beside single numbers: {known}"
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
    builder = GroupBuilder(known, {**declared, **of_sets}, decimals, methods)
    sets = [key for key in of_sets if with_sets or key in wanted]
    keys = _broken_down(found, wanted, declared) if by else []
    groups: list[Group] = []
    if by:
        splits: dict[str, list[SplitSummary]] = {}
        for section in found:
            splits.setdefault(section.split, []).append(section)
        for parts in splits.values():
            groups += [by_part(parts, key, by, builder) for key in keys if key in _present(parts)]
    else:
        cases = wanted if wanted is DEFAULT_COLUMNS else [key for key in wanted if key not in of_sets]
        for section in found:
            if cases:
                groups.append(by_method(section, *_columns(section, cases, declared), builder))
            if sets:
                groups += set_groups.by_set(section, sets, builder)
    notes = []
    if sets:
        notes = [set_groups.READING, *(line for each in found for line in set_groups.without(each, sets))]
    elif of_sets:
        notes = [f"Not shown: values of all answers as one set (--columns {','.join(of_sets)})."]
    return Table(
        title=title,
        groups=tuple(groups),
        notes=(*notes, *_notes(found, known)),
        footnotes=tuple(builder.footnotes.sentences),
        problems=tuple(_problems(found)),
        provenance=provenance.provenance(found),
        data=provenance.data_facts(found),
        subjects=tuple(builder.column(key) for key in keys),
    )


# --------------------------------------------------------------------------------------------- columns
def _columns(section: SplitSummary, wanted: Sequence[str], declared: Values) -> tuple[list[str], list[str]]:
    """The columns that a split has, and sentences about those it lacks."""
    if not any(score.means for score in section.scores):
        return [key for key in wanted if key == FPS or key in declared], []
    present = _present([section])
    keys: list[str] = []
    absent: dict[str, list[str]] = {}
    for key in wanted:
        if (shown := stand_in(key, present)) is not None:
            keys.append(shown)
        elif key in declared and not (wanted is DEFAULT_COLUMNS and key in WHERE_KNOWN):
            absent.setdefault(lacking(declared[key], section.scores), []).append(key)
    lost = [
        f"{section.split}: not shown: {', '.join(declared[key].label for key in each)} ({why})"
        for why, each in absent.items()
    ]
    return list(dict.fromkeys(keys)), lost


def stand_in(key: str, present: Collection[str]) -> str | None:
    """The column, or its replacement where no case has it, last of all relative to the source; or None."""
    options = (key, *STAND_INS.get(key, ()))
    found = (each for each in (*options, *(f"{option}_src" for option in options)) if each in present)
    return FPS if key == FPS else next(found, None)


def _broken_down(found: Sequence[SplitSummary], wanted: Sequence[str], declared: Values) -> list[str]:
    """The values of a breakdown, a group each; by default the first default column, or else all."""
    present = _present(found)
    shown = (stand_in(key, present) for key in wanted if key != FPS)
    keys = list(dict.fromkeys(key for key in shown if key is not None))
    if wanted is not DEFAULT_COLUMNS:
        return keys
    return keys[:1] or [key for key in declared if key in present]


def _present(found: Iterable[SplitSummary]) -> set[str]:
    return {key for section in found for score in section.scores for key in score.means}


# --------------------------------------------------------------------------------------------- numbers
def _numbers(found: Sequence[SplitSummary], key: str) -> list[float]:
    """Numbers that decide the decimals of a column: of ranked methods, or of all where these have none.

    Numbers that are rounding errors beside the others are left out: predictions are in single precision.
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
    """Decimals that show three significant digits of the column's typical number; two for zeros alone."""
    sizes = sorted(numbers)
    sizes = [size for size in sizes if size > 1e-3 * sizes[-1]]
    if not sizes:
        return 2
    return min(7, max(0, 2 - math.floor(math.log10(sizes[len(sizes) // 2]))))


# ----------------------------------------------------------------------------------------------- below
def _notes(found: Sequence[SplitSummary], known: compatibility.Newest) -> list[str]:
    """Notes of the data sets, and notes on results of other versions."""
    notes = [note for section in found for note in section.notes]
    fresh = []
    for section in found:
        for score in section.scores:
            if stale := known.why_outdated(score.header):
                notes.append(f"{section.split}: {score.label} was {stale}.")
            else:
                fresh.append(score.header)
    if other := compatibility.other_code(fresh):
        notes.append(
            f"Some rows were scored by other code under the same version: {', '.join(other)}. Run bench "
            "score to bring them together."
        )
    return list(dict.fromkeys(notes))


def _problems(found: Sequence[SplitSummary]) -> list[Problem]:
    """Problems, with the refusals of a method on a split merged where they have more than two reasons."""
    cases: dict[tuple[str, str, str, str], dict[str, None]] = {}
    refusals: dict[tuple[str, str], dict[str, None]] = {}
    for section in found:
        for score in section.scores:
            for each in score.header.problems:
                key = (section.split, score.label, each.status, each.message)
                cases.setdefault(key, {}).update(dict.fromkeys(each.cases))
                if each.status == "unsupported":
                    refusals.setdefault(key[:2], {})[each.message] = None
    problems = []
    for (split, label, status, message), mine in cases.items():
        reasons = list(refusals.get((split, label), ())) if status == "unsupported" else []
        if len(reasons) <= 2:
            problems.append(Problem(split, label, status, message, tuple(mine)))
        elif message == reasons[0]:
            every = [case for reason in reasons for case in cases[split, label, status, reason]]
            problems.append(Problem(split, label, status, message, tuple(every), len(reasons) - 1))
    return problems
