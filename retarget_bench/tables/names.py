"""Names of columns as people write them: ids of values, labels, families and metrics."""

import difflib
import re
from collections.abc import Iterable, Mapping, Sequence

from retarget_bench import api
from retarget_bench.analysis.summary import SplitSummary
from retarget_bench.errors import BenchError
from retarget_bench.plugins import registry
from retarget_bench.plugins.spec import folded
from retarget_bench.results.header import DeclaredValue
from retarget_bench.results.result_matrix import ResultMatrix, set_values
from retarget_bench.tables.builder import DEFAULT_COLUMNS, LISTED, entries
from retarget_bench.tables.cells import FPS, declared_sets, declared_values

Declared = Mapping[str, DeclaredValue]
SPEED = DeclaredValue(
    label="speed",
    meaning="",
    unit="1/s",
    better="higher",
    goal=1.0,
    tolerance=0.0,
    index="",
    with_self=False,
)
"""``fps`` as if a metric declared it."""
UNLIKE = {
    "n": "n is the number of cases, no value: tables of one split (-s cross) have it as their last column",
    "speed": "speed (fps) is no value of single cases; bench table --columns speed shows it",
}
"""Columns and lines of tables that are no values -> where they are."""


def column_ids(names: Iterable[str], sections: Sequence[SplitSummary]) -> list[str]:
    """The columns that these names stand for in these results: ids of values, or ``fps``.

    Raises BenchError for a name of no value, and for one of several.
    """
    return value_ids(names, {**declared_values(sections), **declared_sets(sections), FPS: SPEED})


def value_ids(names: Iterable[str], declared: Declared) -> list[str]:
    """The ids that these names stand for, each once."""
    return list(dict.fromkeys(value_id(name, declared) for name in _rejoined(names, declared)))


def value_id(name: str, declared: Declared) -> str:
    """The id of the value that a name stands for.

    The name may be an id, a label (``MPJPE``; where case, spaces, underscores and hyphens do not count),
    the words of a label in another order (``root-aligned MPJPE``), or a family: the part of an id before
    the dot, that of a label before the comma, or a metric. The first way that fits counts; of several
    values that it fits, the one that stands first among the default columns. Raises BenchError for a name
    of no value, with near ones, of several, and of a value against the source (``against_the_source``).
    """
    declared, every = {key: declared[key] for key in entries(declared)}, declared
    if name in every and name not in declared:
        raise BenchError(f"{name} is no column: bench table --against source shows {every[name].label}")
    matches = candidates(name, declared)
    if not matches:
        unknown = f"no result has a value {name!r}; {_cure(name, declared)}"
        raise BenchError(UNLIKE.get(name.casefold(), unknown))
    if len(matches) == 1 or matches[0] in DEFAULT_COLUMNS:
        return matches[0]
    usual = [
        key for key in DEFAULT_COLUMNS if key in declared and folded(name) in folded(declared[key].label)
    ]
    matches = list(dict.fromkeys([*usual, *matches]))
    raise BenchError(
        f"{name!r} may be one of {len(matches)} values; give the id: {', '.join(_shown(matches, declared))}"
    )


def candidates(text: str, declared: Declared) -> list[str]:
    """The ids of all values that a name may stand for, likely ones first; [] for none: see ``value_id``."""
    if text in declared:
        return [text]
    name, words = folded(text), _words(text)
    ways = (
        [key for key, value in declared.items() if folded(value.label) == name],
        [key for key in declared if folded(key) == name],
        [key for key, value in declared.items() if words and _words(value.label) == words],
        [key for key, value in declared.items() if name in _families(key, value)],
    )
    return _usual_first(next(filter(None, ways), []))


def _usual_first(ids: Sequence[str]) -> list[str]:
    places = {key: place for place, key in enumerate(DEFAULT_COLUMNS)}
    return sorted(ids, key=lambda key: places.get(key, len(places)))


def _rejoined(names: Iterable[str], declared: Declared) -> list[str]:
    """The names, with labels that were split at their commas in one piece again."""
    labels = {folded(value.label) for value in declared.values()}
    parts, joined = list(names), []
    while parts:
        lengths = range(len(parts), 1, -1)
        n = next((n for n in lengths if folded(",".join(parts[:n])) in labels), 1)
        joined.append(", ".join(parts[:n]))
        parts = parts[n:]
    return joined


def declared(matrices: Iterable[ResultMatrix]) -> tuple[dict[str, DeclaredValue], dict[str, DeclaredValue]]:
    """The values of cases and the values of sets of these results."""
    matrices = list(matrices)
    of_cases = {key: value for matrix in matrices for key, value in matrix.values.items()}
    return of_cases, set_values(row.header for matrix in matrices for row in matrix.rows)


def against_the_source(
    columns: Sequence[str], sections: Sequence[SplitSummary], explicit: bool
) -> list[str]:
    """The values against the source in the place of these columns; those that need no reference stay.

    explicit: somebody named the columns. Raises BenchError for a named one that needs a reference and does
    not exist against the source, and where no column is left.
    """
    declared = declared_values(sections)
    replaced, lost = [], []
    for key in columns:
        twin = api.against_source(key)
        if twin in declared:
            replaced.append(twin)
        elif key in declared and "reference" in declared[key].needs:
            lost.append(key)
        else:
            replaced.append(key)
    if lost and (explicit or not replaced):
        having = [key for key in declared if api.against_source(key) in declared]
        there = f"those that are: {', '.join(_shown(having, declared))}" if having else "no value here is"
        raise BenchError(
            f"{lost[0]} ({declared[lost[0]].label}) is not computed against the source; {there}"
        )
    return replaced


def check_of_cases(key: str, declared: Declared, of_sets: Declared) -> None:
    """Raises BenchError for a value of sets and for a curve: they have no number per case."""
    if key in of_sets:
        raise BenchError(
            f"{of_sets[key].label} ({key}) is a value of all answers as one set: no case has a number, and "
            "its interval stands in the table (bench table --intervals, or .table().frame)"
        )
    if index := declared[key].index:
        raise BenchError(
            f"{key} ({declared[key].label}) is a curve with a number per {index}, not one per case; "
            f"bench table --columns {key} shows it"
        )


def installed() -> dict[str, DeclaredValue]:
    """Every value of the installed metrics, by id; broken metrics are left out."""
    metrics, _ = registry.working("metrics")
    return {
        value.id: DeclaredValue.of(value, name)
        for name, metric in metrics.items()
        for value in metric.card.values
    }


def _families(key: str, value: DeclaredValue) -> set[str]:
    return {folded(each) for each in (key.split(".")[0], value.label.split(",")[0], value.metric) if each}


def _words(text: str) -> list[str]:
    """The words of a name, in order of the alphabet."""
    return sorted(re.findall(r"[^\W_]+", text.casefold()))


def _shown(ids: Iterable[str], declared: Declared) -> list[str]:
    """Values by id and label, as messages name them."""
    return [f"{key} ({declared[key].label})" for key in ids]


def close(name: str, declared: Declared, also: Sequence[str] = (), cutoff: float = 0.6) -> list[str]:
    """The values that were perhaps meant, each by its id and label. also: names of what is no value."""
    names = {folded(each): each for each in also}
    for key, value in declared.items():
        names[folded(key)] = names[folded(value.label)] = f"{key} ({value.label})"
    near = difflib.get_close_matches(folded(name), names, 3, cutoff)
    return list(dict.fromkeys(names[each] for each in near))


def _cure(name: str, declared: Declared) -> str:
    """The values that were perhaps meant; else the nearest or a few usual ones, and how to list all."""
    if near := close(name, declared):
        return f"did you mean {' or '.join(near)}?"
    if near := close(name, declared, cutoff=0.3):
        return f"the nearest are {' and '.join(near)}; {LISTED}"
    few = _usual_first([key for key, value in declared.items() if not value.index])[:3]
    return f"there are {', '.join(_shown(few, declared))} and others; {LISTED}"
