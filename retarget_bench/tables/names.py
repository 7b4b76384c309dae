"""Names of columns as people write them: ids of values, labels, families and metrics."""

import difflib
import re
from collections.abc import Iterable, Mapping, Sequence

from retarget_bench.analysis.summary import SplitSummary
from retarget_bench.errors import BenchError
from retarget_bench.plugins import registry
from retarget_bench.plugins.spec import folded
from retarget_bench.results.header import DeclaredValue
from retarget_bench.results.result_matrix import ResultMatrix, set_values
from retarget_bench.tables.builder import DEFAULT_COLUMNS, LISTED
from retarget_bench.tables.groups import FPS, declared_sets

Known = Mapping[str, DeclaredValue]
UNLIKE = {
    "n": "n is the number of cases, no value: tables of one split (-s cross) have it as their last column",
    "speed": "speed (fps) is no value of single cases; bench table --columns speed shows it",
}
"""Columns and lines of tables that are no values -> where they are."""


def column_ids(
    asked: Iterable[str], found: Sequence[SplitSummary], shown: Sequence[SplitSummary] = ()
) -> list[str]:
    """The columns that these names stand for in these results: ids of values, or ``fps``.

    shown: those of the results that are shown. Of a name that means several values, those that nothing
    shown has a number of are left out. Raises BenchError for a name of no value, and for one of several.
    """
    known = {key: value for section in found for key, value in section.values.items()}
    known |= declared_sets(found)
    there = _with_numbers(shown or found)
    columns: dict[str, None] = {}
    for name in _whole(asked, known):
        ids = meant(name, known, (FPS,))
        columns |= dict.fromkeys([key for key in ids if key in there] or ids[:1])
    return list(columns)


def _with_numbers(found: Iterable[SplitSummary]) -> set[str]:
    """The values that anything here has a number of."""
    scores = [score for section in found for score in section.scores]
    of_cases = {key for score in scores for key in score.means}
    return of_cases | {each.value_id for score in scores for each in score.sets if each.value is not None}


def value_ids(asked: Iterable[str], known: Known, also: Sequence[str] = ()) -> list[str]:
    """The ids that these names stand for, each once. also: ids without a declaration."""
    return list(dict.fromkeys(key for name in _whole(asked, known) for key in meant(name, known, also)))


def value_id(asked: str, known: Known, also: Sequence[str] = ()) -> str:
    """The id of the one value that a name stands for: of several the first, as tables have it."""
    return meant(asked, known, also)[0]


def meant(asked: str, known: Known, also: Sequence[str] = ()) -> list[str]:
    """The ids of the values that a name stands for, mostly one.

    The name may be a label (``MPJPE``; where case, spaces, underscores and hyphens do not count), an id
    (where case does not), the words of a label in another order (``root-aligned MPJPE``), or a family: the
    part of an id before the dot, that of a label before the comma, or a metric. A name that is the label of
    one value and the id of another means both, the label's first: ``contact_recall`` is the column *contact
    recall*, and the id of a value by another rule. Else, of several values of one name, the one that stands
    first among the default columns is meant. Raises BenchError for a name of no value, with near ones, and
    for one of several.
    """
    if FPS in also and asked.casefold() == "speed":
        return [FPS]
    ids = _of_id(asked, (*known, *also))
    found = candidates(asked, known, also)
    if not found:
        unknown = f"no result has a value {asked!r}; {cure(asked, known)}"
        raise BenchError(UNLIKE.get(asked.casefold(), unknown))
    if ids or len(found) == 1:
        return found
    if found[0] in DEFAULT_COLUMNS:
        return found[:1]
    usual = [key for key in DEFAULT_COLUMNS if key in known and folded(asked) in folded(known[key].label)]
    found = list(dict.fromkeys([*usual, *found]))
    raise BenchError(
        f"{asked!r} may be one of {len(found)} values; give the id: {', '.join(told(found, known))}"
    )


def candidates(asked: str, known: Known, also: Sequence[str] = ()) -> list[str]:
    """The ids of all values that a name may stand for, likely ones first; [] for none: see ``meant``."""
    if found := [*labelled(asked, known), *_of_id(asked, (*known, *also))]:
        return list(dict.fromkeys(found))
    name, words = folded(asked), _words(asked)
    found = [key for key in known if folded(key) == name]
    found = found or [key for key, value in known.items() if words and _words(value.label) == words]
    return _usual_first(found or [key for key, value in known.items() if name in _families(key, value)])


def labelled(asked: str, known: Known) -> list[str]:
    """The ids of the values of this label, default columns first."""
    return _usual_first([key for key, value in known.items() if folded(value.label) == folded(asked)])


def _of_id(asked: str, ids: Sequence[str]) -> list[str]:
    """The ids of this name; where none is written so, those that differ in case."""
    exactly = [key for key in ids if key == asked]
    return exactly or [key for key in ids if key.casefold() == asked.casefold()]


def _usual_first(found: Sequence[str]) -> list[str]:
    places = {key: place for place, key in enumerate(DEFAULT_COLUMNS)}
    return sorted(found, key=lambda key: places.get(key, len(places)))


def _whole(asked: Iterable[str], known: Known) -> list[str]:
    """The names, with labels that were split at their commas in one piece again."""
    labels = {folded(value.label) for value in known.values()}
    parts, whole = list(asked), []
    while parts:
        lengths = range(len(parts), 1, -1)
        n = next((n for n in lengths if folded(",".join(parts[:n])) in labels), 1)
        whole.append(", ".join(parts[:n]))
        parts = parts[n:]
    return whole


def declared(matrices: Iterable[ResultMatrix]) -> tuple[dict[str, DeclaredValue], dict[str, DeclaredValue]]:
    """The values of cases and the values of sets of these results."""
    matrices = list(matrices)
    of_cases = {key: value for matrix in matrices for key, value in matrix.values.items()}
    return of_cases, set_values(row.header for matrix in matrices for row in matrix.rows)


def check_of_cases(key: str, declared: Known, of_sets: Known) -> None:
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


def told(ids: Iterable[str], known: Known) -> list[str]:
    """Values by id and label, as messages name them."""
    return [f"{key} ({known[key].label})" for key in ids]


def close(asked: str, known: Known, also: Sequence[str] = (), cutoff: float = 0.6) -> list[str]:
    """The values that were perhaps meant, each by its id and label."""
    names = {folded(each): each for each in also}
    for key, value in known.items():
        names[folded(key)] = names[folded(value.label)] = f"{key} ({value.label})"
    near = difflib.get_close_matches(folded(asked), names, 3, cutoff)
    return list(dict.fromkeys(names[each] for each in near))


def cure(asked: str, known: Known) -> str:
    """The values that were perhaps meant, else the nearest few and how to list all."""
    if near := close(asked, known):
        return f"did you mean {' or '.join(near)}?"
    near = close(asked, known, cutoff=0.3)
    few = (
        f"the nearest are {' and '.join(near)}"
        if near
        else f"there are {', '.join(some(known))} and others"
    )
    return f"{few}; {LISTED}"


def some(known: Known) -> list[str]:
    """A few values that are no curves, default columns first: examples for a message."""
    return told(_usual_first([key for key, value in known.items() if not value.index])[:3], known)
