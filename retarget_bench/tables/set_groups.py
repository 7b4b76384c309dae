"""Groups of a table for metrics of whole sets (FID and others): one per split and target structure."""

from collections.abc import Iterable, Sequence

from retarget_bench.analysis.summary import SplitSummary
from retarget_bench.api import TWO_LEGS
from retarget_bench.evaluation.set_metrics import SetValue
from retarget_bench.results.header import DeclaredValue
from retarget_bench.results.result_matrix import set_values
from retarget_bench.tables.groups import STALE, GroupBuilder, usual_value, value_like
from retarget_bench.tables.model import NOT_APPLICABLE, Cell, Group, Row, count

FLOOR, FLOOR_MARK = "floor", "references, against other real motion"
APART_MARK = "real motion, against other real motion"
"""Mark of the floor on data without references."""
READING = (
    "Values of sets: n is the number of windows in each of the two sets that are compared. They are not "
    "ranked. Compare them by their intervals and with the floor, the score of the references (or of real "
    "motion where there are none). Values with different n are not comparable."
)


def declared(found: Iterable[SplitSummary]) -> dict[str, DeclaredValue]:
    """Value id -> its declaration in the newest header, for all values of sets."""
    return set_values(score.header for section in found for score in section.scores)


def by_set(section: SplitSummary, keys: Sequence[str], builder: GroupBuilder) -> list[Group]:
    """A group per target structure that any method has a value for, a row per method.

    The floor stands among the rows that are not ranked.
    """
    return [
        _group(section, *each, _computed(section, each, keys), builder)
        for each, why in _structures(section, keys)
        if not why
    ]


def _computed(section: SplitSummary, which: tuple[str, str], keys: Sequence[str]) -> list[str]:
    """Those of the values that are of this set: metrics may have sets of their own."""
    there = {each.value_id for score in section.scores for each in score.sets if _of(each) == which}
    return [key for key in keys if key in there]


def _of(value: SetValue) -> tuple[str, str]:
    return value.structure, value.kind


def without(found: Sequence[SplitSummary], keys: Sequence[str]) -> list[str]:
    """A sentence about the target structures, and kinds, for which no method has a value; [] for none."""
    splits: dict[str, list[str]] = {}
    reasons = []
    for section in found:
        lacking = [each for each in _structures(section, keys) if each[1]]
        empty = [structure for (structure, kind), _ in lacking if not kind]
        shown = [each for each in lacking if not (each[0][1] and each[0][0] in empty)]
        reasons += [why for _, why in shown]
        if shown:
            names = ", ".join(f"{structure} {kind}".strip() for (structure, kind), _ in shown)
            splits.setdefault(names, []).append(section.split)
    where = "; ".join(f"{', '.join(each)}: {names}" for names, each in splits.items())
    return (
        [f"No values of sets on bodies of these structures: {where}. The first: {reasons[0]}."]
        if where
        else []
    )


def _named(structure: str, kind: str) -> str:
    bodies = f"on {TWO_LEGS}" if structure == TWO_LEGS else f"of structure {structure}"
    return f"{bodies}, kind {kind}" if kind else bodies


def _structures(section: SplitSummary, keys: Sequence[str]) -> list[tuple[tuple[str, str], str]]:
    """Every target structure and kind, and why no method has any of these values for it ("": one has)."""
    values: dict[tuple[str, str], list[SetValue]] = {}
    for score in section.scores:
        for each in score.sets:
            if each.value_id in keys:
                values.setdefault((each.structure, each.kind), []).append(each)
    found = []
    for which, mine in sorted(values.items()):
        reasons = "; ".join(dict.fromkeys(each.reason for each in mine))
        found.append((which, "" if any(each.value is not None for each in mine) else reasons))
    return found


def _group(
    section: SplitSummary, structure: str, kind: str, keys: Sequence[str], builder: GroupBuilder
) -> Group:
    usual = {key: usual_value(section, (structure, kind), key) for key in keys}
    rows = []
    for score in section.scores:
        cells = tuple(builder.set_cell(score, key, usual[key]) for key in keys)
        mark = STALE if builder.newest.why_outdated(score.header) else score.unranked
        n = max((each.n for key in keys if (each := value_like(usual[key], score)) is not None), default=0)
        rows.append(Row(score.label, mark, cells, f"{n}", score.header.method.summary))
    sign = -1.0 if builder.column(keys[0]).better == "higher" else 1.0
    rows.sort(key=lambda row: (row.cells[0].value is None, sign * (row.cells[0].value or 0.0)))
    n, clips = max((each.n, each.clips) for each in usual.values())
    apart = any(score.header.four_legged is not None for score in section.scores)
    floors = []
    for key, each in usual.items():
        if each.floor is None:
            floors.append(Cell(NOT_APPLICABLE))
        else:
            shown, decimals = builder.shown(each.floor, key), builder.decimals[key]
            floors.append(Cell(shown, each.floor, decimals=decimals, n=each.n, clips=each.clips))
    return Group(
        title=f"{section.split}, all answers on bodies {_named(structure, kind)} as one set: "
        f"{count(n, 'window')} of {count(clips, 'clip')}",
        split=section.split,
        columns=tuple(builder.column(key) for key in keys),
        ranked=tuple(row for row in rows if not row.mark),
        unranked=(
            *(row for row in rows if row.mark),
            Row(FLOOR, APART_MARK if apart else FLOOR_MARK, tuple(floors), f"{n}"),
        ),
        counted="windows",
        structure=structure,
        kind=kind,
    )
