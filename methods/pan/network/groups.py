"""The edges that each part reads, and groups of rows of attention that see the same rows.

The root's channels, the last edge, belong to every part.
"""

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
    """The rows that each row attends to. Rows are the tokens of the parts, then ``edges``.

    tokens: a group for each token. parts: one for each token with the edges of its part alone. shared: of
    all edges that are of several parts; the root's, and so the group, sees every edge.
    """

    edges: tuple[int, ...]
    tokens: tuple[Group, ...]
    parts: tuple[Group, ...]
    shared: Group | None


def body_parts(layout: Layout, design: Design) -> Parts:
    """The edges of each part for attention and skeletons, the root's last.

    Where the body is one part, that is every edge that is of a part.
    """
    parts = layout.parts if design.by_part else (tuple(sorted(set().union(*layout.parts))),)
    return tuple((*part, layout.edges) for part in parts)


def convolved_parts(layout: Layout, design: Design) -> Parts:
    """The edges of each part for convolutions. The released code shifts all but the root's by one."""
    parts = body_parts(layout, design)
    if design.conv_mask == "paper" or not design.by_part:
        return parts
    return tuple((*(edge - 1 for edge in part[:-1] if edge > 0), part[-1]) for part in parts)


def written(layout: Layout, design: Design) -> Parts:
    """The edges that the decoder writes from each part.

    A edge of several parts is written from all of these, the root's and one of no part from all there are.
    """
    parts = convolved_parts(layout, design)
    everywhere = set(range(layout.edges)) - {edge for part in parts for edge in part}
    return tuple(tuple(sorted({*part, *everywhere})) for part in parts)


def attending(parts: Parts, mutual: bool) -> Rows:
    """A token sees itself and its part; an edge what shares a part with it, if ``mutual`` tokens too."""
    edges = tuple(sorted({edge for part in parts for edge in part}))
    row = {edge: len(parts) + place for place, edge in enumerate(edges)}
    sees = {token: {token, *(row[edge] for edge in part)} for token, part in enumerate(parts)}
    alone: list[list[int]] = [[token] for token in sees]
    shared: list[int] = []
    for edge in edges:
        own = {token for token, part in enumerate(parts) if edge in part}
        (alone[min(own)] if len(own) == 1 else shared).append(row[edge])
        seen = set().union(*(sees[token] for token in own))
        sees[row[edge]] = seen if mutual else seen - own
    return Rows(
        edges,
        tuple(_group([token], sees) for token in range(len(parts))),
        tuple(_group(rows, sees) for rows in alone),
        _group(shared, sees) if shared else None,
    )


def _group(queries: Sequence[int], sees: Mapping[int, set[int]]) -> Group:
    keys = tuple(sorted(set().union(*(sees[row] for row in queries))))
    return Group(tuple(queries), keys, tuple(tuple(key in sees[row] for key in keys) for row in queries))
