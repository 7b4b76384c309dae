"""Who reads whom: slots of parts, and rows of attention that see the same rows.

The root's slot, the last one, belongs to every part.
"""

from __future__ import annotations

from typing import NamedTuple

from ..design import Design
from ..layout import Layout

Parts = tuple[tuple[int, ...], ...]


class Group(NamedTuple):
    """Neighbouring rows of attention, the queries, that see the same rows, the keys."""

    queries: slice
    keys: tuple[int, ...]


class Rows(NamedTuple):
    """Who attends to whom. Rows are the tokens of the parts, then slots in the order of ``slots``.

    tokens: a group for each token. others: groups of slots.
    """

    slots: tuple[int, ...]
    tokens: tuple[Group, ...]
    others: tuple[Group, ...]


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
    alike: dict[tuple[int, ...], list[int]] = {}
    for slot in sorted({slot for part in parts for slot in part}):
        own = tuple(token for token, part in enumerate(parts) if slot in part)
        alike.setdefault(own, []).append(slot)
    slots = tuple(slot for several in alike.values() for slot in several)
    row = {slot: len(parts) + place for place, slot in enumerate(slots)}
    tokens = tuple(
        Group(slice(token, token + 1), (token, *(row[slot] for slot in part)))
        for token, part in enumerate(parts)
    )
    others = []
    for own, several in alike.items():
        seen = sorted({row[slot] for token in own for slot in parts[token]})
        start = row[several[0]]
        others.append(Group(slice(start, start + len(several)), (*(own if mutual else ()), *seen)))
    return Rows(slots, tokens, tuple(others))
