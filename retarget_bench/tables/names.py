"""Names of columns as people write them: ids of values, labels, families and metrics."""

import difflib
from collections.abc import Iterable, Mapping, Sequence

from retarget_bench.analysis.summary import SplitSummary
from retarget_bench.errors import BenchError
from retarget_bench.plugins import registry
from retarget_bench.plugins.spec import Spec, folded, write_value
from retarget_bench.results.header import DeclaredValue
from retarget_bench.tables import set_groups
from retarget_bench.tables.builder import DEFAULT_COLUMNS
from retarget_bench.tables.groups import FPS

Known = Mapping[str, DeclaredValue]
UNLIKE = {
    "n": "n is the number of cases, no value: tables of one split (-s cross) have it as their last column",
    "speed": "speed (fps) is no value of single cases; bench table --columns speed shows it",
}
"""Columns and lines of tables that are no values -> where they are."""


def column_ids(asked: Iterable[str], found: Sequence[SplitSummary]) -> list[str]:
    """The columns that these names stand for in these results: ids of values, or ``fps``.

    Raises BenchError for a name of no value, and for one of several.
    """
    known = {key: value for section in found for key, value in section.values.items()}
    return value_ids(asked, known | set_groups.declared(found), (FPS,))


def value_ids(asked: Iterable[str], known: Known, also: Sequence[str] = ()) -> list[str]:
    """The ids that these names stand for, each once. also: ids without a declaration."""
    return list(dict.fromkeys(value_id(each, known, also) for each in asked))


def value_id(asked: str, known: Known, also: Sequence[str] = ()) -> str:
    """The id of the one value that a name stands for.

    An id, as it is written, wins over all else. Then come labels of default columns (``MPJPE``, ``FID``),
    ids in any case, other labels, and then families: the part
    of an id before the dot, that of a label before the comma, or a metric. Case, spaces, underscores and
    hyphens do not count. Of several values of one name, the one that stands first among the default
    columns is meant. Raises BenchError for a name of no value, with close ones, and for one of several.
    """
    ids = {key.casefold(): key for key in (*known, *also)}
    if FPS in also:
        ids.setdefault("speed", FPS)
    if asked in ids.values():
        return asked
    found = candidates(asked, known)
    if found and found[0] in DEFAULT_COLUMNS and known[found[0]].label.casefold() == asked.casefold():
        return found[0]
    if asked.casefold() in ids:
        return ids[asked.casefold()]
    if not found:
        unknown = f"no result has a value {asked!r}; {_cure(asked, known, also)}"
        raise BenchError(UNLIKE.get(asked.casefold(), unknown))
    if len(found) == 1 or found[0] in DEFAULT_COLUMNS:
        return found[0]
    usual = [key for key in DEFAULT_COLUMNS if key in known and folded(asked) in folded(known[key].label)]
    found = list(dict.fromkeys([*usual, *found]))
    choices = ", ".join(f"{each} ({known[each].label})" for each in found)
    raise BenchError(f"{asked!r} may be one of {len(found)} values; give the id: {choices}")


def candidates(asked: str, known: Known) -> list[str]:
    """The ids of the values of this label, or else of this family, default columns first."""
    name = folded(asked)
    found = [key for key, value in known.items() if value.label.casefold() == asked.casefold()]
    found = found or [key for key, value in known.items() if name in (folded(key), folded(value.label))]
    found = found or [key for key, value in known.items() if name in _families(key, value)]
    places = {key: place for place, key in enumerate(DEFAULT_COLUMNS)}
    return sorted(found, key=lambda key: places.get(key, len(places)))


def installed() -> dict[str, DeclaredValue]:
    """Every value of the installed metrics, by id; broken metrics are left out."""
    metrics, _ = registry.working("metrics")
    return {
        value.id: DeclaredValue.of(value, name)
        for name, metric in metrics.items()
        for value in metric.card.values
    }


def method_title(label: str) -> str:
    """A method's label as people write it: ``copy rotations (root rule none)`` for
    ``copy_rotations[root_rule=none]``. Labels of methods that are not installed are left as they are."""
    try:
        spec = Spec.parse(label)
        parts = [
            registry.find("methods", spec.name),
            *(registry.find("posts", each.name) for each in spec.posts),
        ]
    except BenchError:
        return label
    told = ", ".join(
        f"{key.replace('_', ' ')} {write_value(value)}" for key, value in spec.parameters.items()
    )
    return " + ".join(each.title for each in parts) + (f" ({told})" if told else "")


def _families(key: str, value: DeclaredValue) -> set[str]:
    return {folded(each) for each in (key.split(".")[0], value.label.split(",")[0], value.metric) if each}


def close(asked: str, known: Known, also: Sequence[str] = ()) -> list[str]:
    """The values that were perhaps meant, each by its id and label."""
    told = {folded(each): each for each in also}
    for key, value in known.items():
        told |= dict.fromkeys((folded(key), folded(value.label)), f"{key} ({value.label})")
    return list(
        dict.fromkeys(told[each] for each in difflib.get_close_matches(folded(asked), told, 3, 0.6))
    )


def _cure(asked: str, known: Known, also: Sequence[str]) -> str:
    """The values that were perhaps meant, else all that are one number."""
    if meant := close(asked, known, also):
        return f"did you mean {' or '.join(meant)}?"
    single = sorted(key for key, value in known.items() if not value.index)
    return f"there are {', '.join([*also, *single])}"
