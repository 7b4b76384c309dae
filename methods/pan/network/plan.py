"""Who reads whom: slots of parts, and rows of attention that see the same rows.

The root's slot, the last one, belongs to every part.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

from ..design import Design
from ..layout import Layout

Parts = tuple[tuple[int, ...], ...]


class Group(NamedTuple):
    """Rows of attention, the queries, and the rows that any of them sees, the keys.

    sees: for each query, which of the keys.
    """

    queries: tuple[int, ...]
    keys: tuple[int, ...]
    sees: tuple[tuple[bool, ...], ...]


class Rows(NamedTuple):
    """Who attends to whom. Rows are the tokens of the parts, then ``slots``.

    tokens: a group for each token. parts: one for each token with the slots of its part alone. shared: of
    all slots that are of several parts; the root's, and so the group, sees every slot.
    """

    slots: tuple[int, ...]
    tokens: tuple[Group, ...]
    parts: tuple[Group, ...]
    shared: Group | None


def body_parts(layout: Layout, design: Design) -> Parts:
    """The slots of each part for attention and skeletons, the root's last.

    Where the body is one part, that is every slot that is of a part.
    """
    parts = layout.parts if design.by_part else (tuple(sorted(set().union(*layout.parts))),)
    return tuple((*part, layout.slots) for part in parts)


def convolved_parts(layout: Layout, design: Design) -> Parts:
    """The slots of each part for convolutions. The released code shifts all but the root's by one."""
    parts = body_parts(layout, design)
    if design.conv_mask == "paper" or not design.by_part:
        return parts
    return tuple((*(slot - 1 for slot in part[:-1] if slot > 0), part[-1]) for part in parts)


def written(layout: Layout, design: Design) -> Parts:
    """The slots that the decoder writes from each part.

    A slot of several parts is written from all of these, the root's and one of no part from all there are.
    """
    parts = convolved_parts(layout, design)
    everywhere = set(range(layout.slots)) - {slot for part in parts for slot in part}
    return tuple(tuple(sorted({*part, *everywhere})) for part in parts)


def attending(parts: Parts, mutual: bool) -> Rows:
    """A token sees itself and its part; a slot what shares a part with it, if ``mutual`` tokens too."""
    slots = tuple(sorted({slot for part in parts for slot in part}))
    row = {slot: len(parts) + place for place, slot in enumerate(slots)}
    sees = {token: {token, *(row[slot] for slot in part)} for token, part in enumerate(parts)}
    alone: list[list[int]] = [[token] for token in sees]
    shared: list[int] = []
    for slot in slots:
        own = {token for token, part in enumerate(parts) if slot in part}
        (alone[min(own)] if len(own) == 1 else shared).append(row[slot])
        seen = set().union(*(sees[token] for token in own))
        sees[row[slot]] = seen if mutual else seen - own
    return Rows(
        slots,
        tuple(_group([token], sees) for token in range(len(parts))),
        tuple(_group(rows, sees) for rows in alone),
        _group(shared, sees) if shared else None,
    )


def _group(queries: Sequence[int], sees: Mapping[int, set[int]]) -> Group:
    keys = tuple(sorted(set().union(*(sees[row] for row in queries))))
    return Group(tuple(queries), keys, tuple(tuple(key in sees[row] for key in keys) for row in queries))
