"""Table builder: columns, decimals, groups and notes of the tables of split summaries."""

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
"""Default columns."""
STAND_INS = {"plant_recall": ("contact_recall",), "plant_precision": ("contact_precision",)}
"""Value id -> its replacement where no case has it: contacts by speed for contacts by position."""
WHERE_KNOWN = frozenset(["touch_gap"])
"""Default columns that are left out silently where a data set has no labels for them."""
_DUST, _ROUNDING = 1e-6, 1e-5
"""Numbers below this size, or this share of the column's largest, count as rounding errors."""

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
    if by:
        groups = [
            by_part(each, key, by, builder) for each in _splits(found) for key in keys if _has(each, key)
        ]
    else:
        groups = _groups(found, wanted, sets, declared, builder)
    return Table(
        title=title,
        groups=tuple(groups),
        notes=(*_set_notes(found, sets, of_sets), *_notes(found)),
        footnotes=tuple(builder.footnotes.sentences),
        problems=tuple(_problems(found)),
        provenance=provenance.provenance(found),
        data=provenance.data_facts(found),
        subjects=tuple(builder.column(key) for key in keys),
    )


def _groups(
    found: Sequence[SplitSummary],
    wanted: Sequence[str],
    sets: Sequence[str],
    declared: Values,
    builder: GroupBuilder,
) -> list[Group]:
    """Per split: the values of cases, then those of sets, structure by structure."""
    of_sets = set_groups.declared(found)
    cases = wanted if wanted is DEFAULT_COLUMNS else [key for key in wanted if key not in of_sets]
    groups = []
    for section in found:
        if cases:
            groups.append(by_method(section, *_columns(section, cases, declared), builder))
        if sets:
            groups += set_groups.by_set(section, sets, builder)
    return groups


def _set_notes(found: Sequence[SplitSummary], wanted: Sequence[str], of_sets: Iterable[str]) -> list[str]:
    """Notes on values of sets: how to read them, which are missing, or how to show them."""
    if wanted:
        lacking = [sentence for section in found for sentence in set_groups.without(section, wanted)]
        return [set_groups.READING, *lacking]
    ids = ",".join(of_sets)
    return [f"Not shown: values of all answers as one set (--columns {ids})."] if ids else []


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
            absent.setdefault(missing.lacking([declared[key]], *section.scores), []).append(key)
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
def _notes(found: Sequence[SplitSummary]) -> list[str]:
    """Notes of the data sets, and notes on results of other versions."""
    notes = {note: None for section in found for note in section.notes}
    known = compatibility.newest([score.header for section in found for score in section.scores])
    for section in found:
        for score in section.scores:
            if stale := known.stale_data(score.header):
                notes[f"{section.split}: {score.label} was {stale}."] = None
    fresh = [s.header for section in found for s in section.scores if not known.stale_data(s.header)]
    if other := compatibility.other_code(fresh):
        notes[
            f"Some rows were scored by other code under the same version: {', '.join(other)}. Run bench "
            "score to bring them together."
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
    """Problems, with the refusals of a method on a split merged where they have more than two reasons."""
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
