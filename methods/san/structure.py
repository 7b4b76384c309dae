"""One structure: its networks, statistics and tensors, and the initial weights that structures share."""

from collections.abc import Hashable, Iterator, Mapping, Sequence
from typing import Any

import torch
from torch import Tensor, nn

from ..pan.layout import Layout
from ..pan.structure import CAST, PARENTS, ROLES, ROWS
from ..pan.structure import Structure as PanStructure
from .network import Decoder, Design, Encoder, Skeletal, StaticEncoder
from .skeleton import Slots, layout_of

Codes = tuple[Tensor, ...]


class Structure(PanStructure):
    """PAN's, of which it has the statistics and tensors, with SAN's networks."""

    skeleton: Any
    encoder: Any
    decoder: Any

    def __init__(self, layout: Layout, design: Design, cast: Sequence[str] = ()) -> None:
        nn.Module.__init__(self)  # PAN's networks are not built
        self.layout, self.cast, self.design = layout, tuple(cast), design
        self.levels = design.levels(layout)
        self.skeleton = StaticEncoder(self.levels)
        self.encoder = Encoder(self.levels)
        self.decoder = Decoder(self.levels, design.padded)
        shape = (1 + len(self.cast), layout.edges + 1, 4)
        self.register_buffer("mean", torch.zeros(shape))
        self.register_buffer("deviation", torch.ones(shape))

    def codes(self, bones: Tensor) -> Codes:
        """Of bodies with these bones ``(bodies, edges + 1, 3)``, the last of which is zero."""
        found: Codes = self.skeleton(self.design.arranged(bones))
        return found

    def answer(self, code: Tensor, bones: Tensor) -> Tensor:
        """``(rows, frames, edges + 1, 4)`` normalised channels of bodies with these bones.

        code: ``(rows, frames / 4, chains + 1, width)``. bones: ``(rows, edges + 1, 3)``."""
        found: Tensor = self.decoder(code, self.codes(bones))
        return found

    def freeze(self) -> None:
        """Make all dense weights once: they do not change any more."""
        for each in self.modules():
            if isinstance(each, Skeletal):
                each.freeze()


def rebuilt(tensors: Mapping[str, Tensor], design: Design) -> Structure:
    """The structure that its marks (see ``Structure.marks``) and the state of its modules describe, its
    weights frozen."""
    roles, cast = (bytes(tensors[name].tolist()).decode().strip("\0").split(ROWS) for name in (ROLES, CAST))
    layout = layout_of([int(each) for each in tensors[PARENTS]], [role or None for role in roles])
    structure = Structure(layout, design, [name for name in cast if name])
    structure.load(tensors)
    structure.freeze()
    return structure.eval()


def share_initialisation(structures: Sequence[Structure]) -> None:
    """Copy the initial weights of the first structure to all others where they have the same meaning.

    Weights belong to a slot and a neighbour; the meaning of a slot is its chain, and how far it is from the
    chain's end. So all encoders give a motion nearly the same code before training.
    """
    known: dict[Hashable, Tensor] = {}
    with torch.no_grad():
        for structure in structures:
            for name, layer, meaning in _skeletal(structure):
                keys: list[Hashable] = [
                    (name, meaning[slot], meaning[other]) for slot, other in layer.pairs
                ]
                _share(known, keys, layer.weight)
                if layer.bias is not None:
                    _share(known, [(name, each) for each in meaning], layer.bias)


def _share(known: dict[Hashable, Tensor], keys: Sequence[Hashable], weights: Tensor) -> None:
    for key, rows in zip(keys, weights, strict=True):
        rows.copy_(known.setdefault(key, rows.clone()))


def _skeletal(structure: Structure) -> Iterator[tuple[str, Skeletal, list[Hashable]]]:
    """The layers of a structure, and the meaning of their slots."""
    levels, layout = structure.levels, structure.layout
    fine = _meaning(layout.names, layout.parts, layout.edges)
    coarse = _meaning(layout.names, levels.chains[:-1], len(levels.first) - 1)
    for name, layer in structure.named_modules():
        if isinstance(layer, Skeletal):
            whole = layer.pairs[-1][0] == layout.edges  # the root's slot is the last
            yield name, layer, fine if whole else coarse


def _meaning(names: Sequence[str], chains: Slots, edges: int) -> list[Hashable]:
    """Of each slot; edges: how many there are before the root's."""
    found: list[Hashable] = ["root"] * (edges + 1)
    for name, chain in zip(names, chains, strict=True):
        for rank, edge in enumerate(reversed(chain)):
            found[edge] = (name, rank)
    return found
