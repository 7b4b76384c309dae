"""Groups of a table for metrics of whole sets (FID and others): one per split and target structure."""

from collections import Counter
from collections.abc import Iterable, Sequence

from retarget_bench.analysis.statistics import Interval
from retarget_bench.analysis.summary import MethodSummary, SplitSummary
from retarget_bench.evaluation.set_metrics import SetValue
from retarget_bench.results.header import DeclaredValue
from retarget_bench.tables.groups import STALE, GroupBuilder
from retarget_bench.tables.model import NOT_APPLICABLE, NOT_RUN, OTHER_VERSION, Cell, Group, Row, count

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
    headers = sorted(
        (score.header for section in found for score in section.scores), key=lambda header: header.date
    )
    return {key: value for header in headers for key, value in header.set_values.items()}


def by_set(section: SplitSummary, keys: Sequence[str], builder: GroupBuilder) -> list[Group]:
    """A group per target structure that any method has a value for, a row per method.

    The floor stands among the rows that are not ranked.
    """
    return [_group(section, *each, keys, builder) for each, why in _structures(section, keys) if not why]


def without(section: SplitSummary, keys: Sequence[str]) -> list[str]:
    """Sentences about target structures, and kinds, for which no method has a value."""
    found = _structures(section, keys)
    empty = [structure for (structure, kind), why in found if why and not kind]
    return [
        f"{section.split}: no values of sets on bodies of structure {_named(*each)}: {why}."
        for each, why in found
        if why and not (each[1] and each[0] in empty)
    ]


def _named(structure: str, kind: str) -> str:
    return f"{structure}, kind {kind}" if kind else structure


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
    usual = {key: _usual(section, (structure, kind), key) for key in keys}
    rows = []
    for score in section.scores:
        mine = [each for each in score.sets if (each.structure, each.kind) == (structure, kind)]
        values = {each.value_id: each for each in mine}
        cells = tuple(_cell(score, values.get(key), key, builder, usual[key]) for key in keys)
        mark = STALE if builder.newest.why_outdated(score.header) else score.unranked
        n = max((values[key].n for key in keys if key in values), default=0)
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
        title=f"{section.split}, all answers on bodies of structure {_named(structure, kind)} as one set: "
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


def _usual(section: SplitSummary, which: tuple[str, str], key: str) -> SetValue:
    """A value of the newest network over the real windows that most methods were compared with.

    Methods that lack a case have others. An empty value where no method has any."""
    values = [
        each
        for score in sorted(section.scores, key=lambda score: score.header.date)
        for each in score.sets
        if (each.value_id, each.structure, each.kind) == (key, *which) and each.value is not None
    ]
    if not values:
        return SetValue(key, which[0], 0, 0)
    fresh = [each for each in values if each.network == values[-1].network]
    real = Counter(each.real for each in fresh).most_common(1)[0][0]
    return next(each for each in fresh if each.real == real)


def _cell(
    score: MethodSummary, value: SetValue | None, key: str, builder: GroupBuilder, usual: SetValue
) -> Cell:
    missing = builder.footnotes.missing
    if absent := builder.absent(score):
        return Cell(absent)
    if stale := builder.newest.why_value_outdated(score.header, key):
        return missing(stale, OTHER_VERSION)
    if key not in score.header.set_values:
        return missing(f"scored without {key}; bench score adds it", NOT_RUN)
    if value is None:
        return missing("no answer on a body of this structure")
    if value.value is None:
        return missing(value.reason)
    if value.network != usual.network:
        return missing("computed with another feature network than the newest results", OTHER_VERSION)
    reason = "" if value.real == usual.real else _other_windows(value, key, builder)
    if (seeds := len(score.header.seeds)) > 1:
        reason = "; ".join(filter(None, [f"of the first of its {seeds} seeds", reason]))
    low, high = value.low, value.high
    return Cell(
        builder.shown(value.value, key),
        value.value,
        Interval(low, high) if low is not None and high is not None else None,
        decimals=builder.decimals[key],
        n=value.n,
        clips=value.clips,
        reason=reason,
        footnote=builder.footnotes.number(reason),
    )


def _other_windows(value: SetValue, key: str, builder: GroupBuilder) -> str:
    floor = "unknown" if value.floor is None else builder.shown(value.floor, key)
    return (
        f"over {count(value.n, 'window')} other than those of the other methods, since it did not answer "
        f"the same cases; its own floor is {floor}"
    )
