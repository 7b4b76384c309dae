"""One structure: its networks, statistics and tensors, and the initial weights that structures share."""

from collections.abc import Hashable, Iterator, Mapping, Sequence

import torch
from torch import Tensor

from retarget_bench.training.layers.skeletal.layout import Layout
from retarget_bench.training.layers.skeletal.structure import StructureNetworks, arranged, described

from .network import Decoder, Design, Encoder, Skeletal, StaticEncoder
from .skeleton import Slots, layout_of

Codes = tuple[Tensor, ...]


class Structure(StructureNetworks):
    """Static encoder, encoder, decoder and statistics of a structure."""

    def __init__(self, layout: Layout, design: Design, cast: Sequence[str] = ()) -> None:
        super().__init__(layout, cast)
        self.design, self.levels = design, design.levels(layout)
        self.skeleton = StaticEncoder(self.levels)
        self.encoder = Encoder(self.levels)
        self.decoder = Decoder(self.levels, design.padded)

    def codes(self, bones: Tensor) -> Codes:
        """The codes of bodies with these bones ``(bodies, edges + 1, 3)``, the last of which is zero."""
        codes: Codes = self.skeleton(self.design.arranged(bones))
        return codes

    def code(self, edges: Tensor, bones: Tensor) -> Tensor:
        """``(rows, frames / 4, chains + 1, width)``"""
        code: Tensor = self.encoder(edges, self.codes(bones))
        return code

    def rearranged(self, code: Tensor, source: Layout) -> Tensor:
        return carried(code, source, self.layout)

    def answer(self, code: Tensor, bones: Tensor) -> Tensor:
        edges: Tensor = self.decoder(code, self.codes(bones))
        return edges

    def freeze(self) -> None:
        """Make all dense weights once: they do not change any more."""
        for each in self.modules():
            if isinstance(each, Skeletal):
                each.freeze()


def carried(code: Tensor, source: Layout, target: Layout) -> Tensor:
    """A code ``(rows, frames, chains + 1, width)``, the root's last, with the chains of another structure;
    those that the source does not have are zero."""
    return torch.cat([arranged(code[:, :, :-1], source, target), code[:, :, -1:]], 2)


def rebuilt(tensors: Mapping[str, Tensor], design: Design) -> Structure:
    """The structure that its marks (see ``Structure.marks``) and the state of its modules describe, its
    weights frozen."""
    parents, roles, cast = described(tensors)
    structure = Structure(layout_of(parents, roles), design, cast)
    structure.load(tensors)
    structure.freeze()
    return structure.eval()


def share_initialisation(structures: Sequence[Structure]) -> None:
    """Copy the initial weights of the first structure to all others where they have the same meaning.

    Weights belong to a slot and a neighbour; the meaning of a slot is its chain, and how far it is from the
    chain's end. So all encoders give a motion nearly the same code before training.
    """
    initial: dict[Hashable, Tensor] = {}
    with torch.no_grad():
        for structure in structures:
            for name, layer, meaning in _skeletal(structure):
                keys: list[Hashable] = [
                    (name, meaning[slot], meaning[other]) for slot, other in layer.pairs
                ]
                _share(initial, keys, layer.weight)
                if layer.bias is not None:
                    _share(initial, [(name, each) for each in meaning], layer.bias)


def _share(initial: dict[Hashable, Tensor], keys: Sequence[Hashable], weights: Tensor) -> None:
    for key, rows in zip(keys, weights, strict=True):
        rows.copy_(initial.setdefault(key, rows.clone()))


def _skeletal(structure: Structure) -> Iterator[tuple[str, Skeletal, list[Hashable]]]:
    """The layers of a structure, and the meaning of their slots."""
    levels, layout = structure.levels, structure.layout
    fine = _meaning(layout.names, layout.parts, layout.edges)
    coarse = _meaning(layout.names, levels.chains[:-1], len(levels.first) - 1)
    for name, layer in structure.named_modules():
        if isinstance(layer, Skeletal):
            unpooled = layer.pairs[-1][0] == layout.edges  # the root's slot is the last
            yield name, layer, fine if unpooled else coarse


def _meaning(names: Sequence[str], chains: Slots, edges: int) -> list[Hashable]:
    """The meaning of each slot; edges: how many there are before the root's."""
    meanings: list[Hashable] = ["root"] * (edges + 1)
    for name, chain in zip(names, chains, strict=True):
        for rank, edge in enumerate(reversed(chain)):
            meanings[edge] = (name, rank)
    return meanings
