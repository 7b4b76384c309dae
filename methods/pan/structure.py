"""PAN's networks of one structure, their tensors and their initialisation."""

from collections.abc import Hashable, Iterable, Iterator, Mapping, Sequence

import torch
from torch import Tensor

from retarget_bench.training.layers.skeletal.layout import Layout
from retarget_bench.training.layers.skeletal.structure import StructureNetworks, arranged, described

from .network import Decoder, Encoder, SkeletonEncoder, convolved_parts, seen_bones, written
from .parts import Parts, layout_of
from .settings import Design


class Structure(StructureNetworks):
    """Encoder, skeleton encoder, decoder and statistics (eq. 15) of a structure (G of section 5.5)."""

    def __init__(self, layout: Layout, design: Design, cast: Sequence[str] = ()) -> None:
        super().__init__(layout, cast)
        self.encoder = Encoder(layout, design)
        self.skeleton = SkeletonEncoder(layout, design)
        self.decoder = Decoder(layout, design)

    def code(self, edges: Tensor, bones: Tensor) -> Tensor:
        """``(rows, frames / 4, parts, width)``, whatever the bones."""
        code: Tensor = self.encoder(edges)
        return code

    def rearranged(self, code: Tensor, source: Layout) -> Tensor:
        return arranged(code, source, self.layout)

    def answer(self, code: Tensor, bones: Tensor) -> Tensor:
        answer: Tensor = self.decoder(code + self.skeleton(bones).unsqueeze(1))
        return answer


def rebuilt(tensors: Mapping[str, Tensor], parts: Parts, four_legged: bool, design: Design) -> Structure:
    """The structure that ``marks`` and the state of its modules describe."""
    parents, roles, cast = described(tensors)
    layout = layout_of(parents, roles, parts, four_legged, design.slots)
    structure = Structure(layout, design, cast)
    structure.load(tensors)
    return structure.eval()


def share_initialisation(structures: Sequence[Structure], design: Design) -> None:
    """Copy the initial weights of the first structure to all others where they have the same meaning.

    Layers of one shape are shared as they are; of layers whose weights belong to edges, those of edges
    that lead to a joint of the same role in the same part. So all encoders give a motion nearly the same
    code before training.
    """
    with torch.no_grad():
        initial: dict[Hashable, Tensor] = {}
        for structure in structures:
            edgewise = dict(_edgewise(structure.layout, design))
            for name, weights in structure.named_parameters():
                if name in edgewise:
                    _share(initial, name, edgewise[name], weights)
                else:
                    key = (name, tuple(weights.shape))
                    weights.copy_(initial.setdefault(key, weights.detach().clone()))


def _share(initial: dict[Hashable, Tensor], name: str, keys: Sequence[Hashable], weights: Tensor) -> None:
    """Share weights whose rows belong to edges, equally many rows for each key."""
    each = len(weights) // len(keys)
    for number, key in enumerate(keys):
        rows = weights[number * each : (number + 1) * each]
        rows.copy_(initial.setdefault((name, key), rows.detach().clone()))


def _edgewise(layout: Layout, design: Design) -> Iterator[tuple[str, list[Hashable]]]:
    """Names of parameters whose rows belong to edges, and the meaning of each edge in their order."""
    yield "skeleton.layers.0.weight", _keys(layout, seen_bones(layout, design))
    if design.raw:
        yield "encoder.raw.weight", _keys(layout, convolved_parts(layout, design))
    if design.decoder == "parts" and design.by_part:
        yield "decoder.outer.weight", _keys(layout, written(layout, design))
    edges = range(layout.edges + 1)
    yield "decoder.outer.bias", [_meaning(layout, edge, 0) for edge in edges]


def _keys(layout: Layout, parts: Iterable[Sequence[int]]) -> list[Hashable]:
    names = layout.names
    return [(names[n], _meaning(layout, edge, n)) for n, part in enumerate(parts) for edge in part]


def _meaning(layout: Layout, edge: int, part: int) -> Hashable:
    """The role of the joint that an edge leads to; unique where it has none."""
    if edge == layout.edges:
        return "root"
    return layout.roles[layout.leads[edge]] or (id(layout), edge, part)
