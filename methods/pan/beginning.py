"""Where training begins: structures that mean the same by their codes."""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Iterator, Sequence

import torch
from torch import Tensor

from .design import Design
from .layout import Layout
from .network.plan import Parts, body_parts, convolved_parts, written
from .structure import Structure

ROOT = "root"


def begin_alike(structures: Sequence[Structure], design: Design) -> None:
    """Gives what two structures share the same first weights, those of the first that has it.

    Layers of one shape are shared as they are; of layers whose weights belong to slots, those of slots
    that lead to a joint of the same role in the same part. The codes of a motion are then nearly the same
    from every encoder before training, and have to drift apart instead of having to find each other.
    """
    with torch.no_grad():
        known: dict[Hashable, Tensor] = {}
        for structure in structures:
            slotwise = dict(_slotwise(structure.layout, design))
            for name, weights in structure.named_parameters():
                if name in slotwise:
                    _share(known, name, slotwise[name], weights)
                else:
                    key = (name, tuple(weights.shape))
                    weights.copy_(known.setdefault(key, weights.detach().clone()))


def _share(known: dict[Hashable, Tensor], name: str, keys: Sequence[Hashable], weights: Tensor) -> None:
    """Weights whose rows go by slot, as many for each key."""
    each = len(weights) // len(keys)
    for number, key in enumerate(keys):
        rows = weights[number * each : (number + 1) * each]
        rows.copy_(known.setdefault((name, key), rows.detach().clone()))


def _slotwise(layout: Layout, design: Design) -> Iterator[tuple[str, list[Hashable]]]:
    """Name of a parameter whose rows belong to slots -> what each slot is, in their order."""
    bones: Parts = tuple(part[:-1] for part in body_parts(layout, design))
    yield "skeleton.layers.0.weight", _keys(layout, bones)
    if design.raw:
        yield "encoder.raw.weight", _keys(layout, convolved_parts(layout, design))
    if design.decoder == "parts" and design.by_part:
        yield "decoder.outer.weight", _keys(layout, written(layout, design))
    slots = range(layout.slots + 1)
    yield "decoder.outer.bias", [_meaning(layout, slot, 0) for slot in slots]


def _keys(layout: Layout, parts: Iterable[Sequence[int]]) -> list[Hashable]:
    names = layout.names
    return [(names[n], _meaning(layout, slot, n)) for n, part in enumerate(parts) for slot in part]


def _meaning(layout: Layout, slot: int, part: int) -> Hashable:
    """The role of the joint that a slot leads to; one without a role is like no other."""
    if slot == layout.slots:
        return ROOT
    return layout.roles[slot + 1] or (id(layout), slot, part)
