"""Groups of a table for values of all answers as one set, and the floors of such values."""

from collections.abc import Sequence

from retarget_bench.analysis.summary import SplitSummary
from retarget_bench.api import TWO_LEGS
from retarget_bench.tables.groups import STALE, GroupBuilder, by_number, usual_value, value_like
from retarget_bench.tables.model import Group, Row, count

SETS = "Not ranked: compare such values by their intervals and with the floor, and none of different n."


def floors(spots: Sequence[tuple[SplitSummary, str, tuple[str, str]]], builder: GroupBuilder) -> list[str]:
    """A sentence for each value of sets: the references' scores. spots: split, value, set."""
    found: dict[str, list[str]] = {}
    for section, key, which in spots:
        if (floor := usual_value(section, which, key).floor) is not None:
            found.setdefault(builder.column(key).label, []).append(
                f"{section.split} {builder.shown(floor, key)}"
            )
    return [f"Floor of {label}, that of real motion: {', '.join(of)}." for label, of in found.items()]


def by_set(section: SplitSummary, keys: Sequence[str], builder: GroupBuilder) -> list[Group]:
    """A group per set (target structure and kind) that any method has a value for, a row per method."""
    computed: dict[tuple[str, str], dict[str, None]] = {}
    for each in (each for score in section.scores for each in score.sets):
        if each.value_id in keys and each.value is not None:
            computed.setdefault((each.structure, each.kind), {})[each.value_id] = None
    return [
        _of_set(section, which, [key for key in keys if key in mine], builder)
        for which, mine in sorted(computed.items())
    ]


def _of_set(
    section: SplitSummary, which: tuple[str, str], keys: Sequence[str], builder: GroupBuilder
) -> Group:
    (structure, kind), columns = which, tuple(map(builder.column, keys))
    usual = {key: usual_value(section, which, key) for key in keys}
    rows = []
    for score in section.scores:
        mark = STALE if builder.newest.why_outdated(score.header) else score.unranked
        mine = [value_like(usual[key], score) for key in keys]
        n = max((each.n for each in mine if each is not None), default=0)
        cells = tuple(builder.set_cell(score, key, usual[key]) for key in keys)
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
        below=(*floors([(section, key, which) for key in keys], builder), SETS),
        counted="windows",
        structure=structure,
        kind=kind,
    )


def without_sets(found: Sequence[SplitSummary], keys: Sequence[str]) -> list[str]:
    """A sentence about the sets for which no method has any of these values; [] for none."""
    reasons: dict[str, str] = {}
    for section in found:
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
