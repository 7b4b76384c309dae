"""One structure: its networks and statistics, their tensors and initialisation, and its kinematics."""

from collections.abc import Hashable, Iterable, Iterator, Mapping, Sequence

import numpy as np
import torch
from torch import Tensor, nn
from torch.nn import functional

from retarget_bench.errors import BenchError
from retarget_bench.motion.kinematics_torch import Tree, forward
from retarget_bench.motion.skeleton import Skeleton

from .body import PanBody
from .features import Root
from .layout import Layout, Parts
from .network import Decoder, Encoder, SkeletonEncoder, convolved_parts, seen_bones, written
from .settings import Design

ROLES, PARENTS, CAST = "roles", "parents", "cast"
"""Names of the tensors that identify a structure."""
MARKS = (ROLES, PARENTS, CAST)
ROWS = "\n"


class Structure(nn.Module):
    """Encoder, skeleton encoder, decoder and statistics (eq. 15) of a structure (G of section 5.5).

    mean, deviation: ``(1 + characters, edges + 1, 4)``: of all its training motion, then of each character
    of ``cast`` where statistics are by character.
    """

    mean: Tensor
    deviation: Tensor

    def __init__(self, layout: Layout, design: Design, cast: Sequence[str] = ()) -> None:
        super().__init__()
        self.layout, self.cast = layout, tuple(cast)
        self.encoder = Encoder(layout, design)
        self.skeleton = SkeletonEncoder(layout, design)
        self.decoder = Decoder(layout, design)
        shape = (1 + len(self.cast), layout.edges + 1, 4)
        self.register_buffer("mean", torch.zeros(shape))
        self.register_buffer("deviation", torch.ones(shape))

    def statistics_row(self, names: Sequence[str]) -> list[int]:
        """Rows of the statistics: a character's own, or 0, that of all."""
        return [1 + self.cast.index(name) if name in self.cast else 0 for name in names]

    def normalised(self, edges: Tensor, row: Tensor) -> Tensor:
        """Eq. 15. edges: ``(rows, frames, edges + 1, 4)``; row: ``(rows,)`` of the statistics."""
        return (edges - self.mean[row].unsqueeze(1)) / self.deviation[row].unsqueeze(1)

    def plain(self, edges: Tensor, row: Tensor) -> Tensor:
        """The inverse of ``normalised``."""
        return edges * self.deviation[row].unsqueeze(1) + self.mean[row].unsqueeze(1)

    def answer(self, code: Tensor, bones: Tensor) -> Tensor:
        """``(rows, frames, edges + 1, 4)`` normalised edges of bodies with these bones.

        code: ``(rows, frames / 4, parts, width)``. bones: ``(rows, edges + 1, 3)``."""
        answer: Tensor = self.decoder(code + self.skeleton(bones).unsqueeze(1))
        return answer

    def with_path(self, edges: Tensor, root: Tensor, row: Tensor) -> Tensor:
        """Normalised edges ``(rows, frames, edges + 1, 4)`` with a root's plain edge ``(rows, frames, 4)``
        added to the last."""
        path = (root - self.mean[row, -1].unsqueeze(1)) / self.deviation[row, -1].unsqueeze(1)
        return torch.cat([edges[:, :, :-1], edges[:, :, -1:] + path.unsqueeze(2)], 2)

    # -------------------------------------------------------------------------------------- as tensors
    def load(self, tensors: Mapping[str, Tensor]) -> None:
        """Take over the tensors of the same structure. Raises BenchError where they do not fit."""
        state = {name: each.float() for name, each in tensors.items() if name not in MARKS}
        try:
            self.load_state_dict(state)
        except RuntimeError as error:
            raise BenchError(f"the weights do not fit this network: {error}") from None

    def marks(self) -> dict[str, Tensor]:
        """Tensors that identify the structure."""
        roles = ROWS.join(role or "" for role in self.layout.roles)
        return {
            PARENTS: torch.tensor(self.layout.parents, dtype=torch.int16),
            ROLES: _bytes(roles),
            CAST: _bytes(ROWS.join(self.cast)),
        }


def by_structure(tensors: Mapping[str, Tensor]) -> Mapping[str, Mapping[str, Tensor]]:
    """Structure -> its tensors, from all of them by ``structure.name``."""
    found: dict[str, dict[str, Tensor]] = {}
    for key in sorted(tensors):
        structure, _, name = key.partition(".")
        found.setdefault(structure, {})[name] = tensors[key]
    return found


def matching(
    structure: Structure, name: str, known: Mapping[str, Mapping[str, Tensor]]
) -> Mapping[str, Tensor]:
    """The tensors of the structure with these joints and characters; of several, those of this name.

    Raises BenchError where there is none.
    """
    marks = structure.marks()

    def same(tensors: Mapping[str, Tensor]) -> bool:
        return all(torch.equal(tensors[key].to(each.dtype), each) for key, each in marks.items())

    fitting = [each for each in known if all(key in known[each] for key in MARKS) and same(known[each])]
    if not fitting:
        raise BenchError(
            f"the weights know no structure with the joints of {name}; they know {', '.join(known)}"
        )
    return known[name if name in fitting else fitting[0]]


def rebuilt(tensors: Mapping[str, Tensor], parts: Parts, four_legged: bool, design: Design) -> Structure:
    """The structure that ``marks`` and the state of its modules describe."""
    parents = [int(each) for each in tensors[PARENTS]]
    roles = [role or None for role in _text(tensors[ROLES]).split(ROWS)]
    cast = [name for name in _text(tensors[CAST]).split(ROWS) if name]
    layout = Layout.of(parents, roles, parts, four_legged, design.slots)
    structure = Structure(layout, design, cast)
    structure.load(tensors)
    return structure.eval()


def _bytes(text: str) -> Tensor:
    return torch.tensor(list(text.encode()) or [0], dtype=torch.uint8)


def _text(tensor: Tensor) -> str:
    return bytes(tensor.tolist()).decode().strip("\0")


def arranged(code: Tensor, source: Layout, target: Layout) -> Tensor:
    """A code ``(rows, frames, parts, width)`` with the parts of another structure in its order; those that
    the source does not have are zero."""
    if source.names == target.names:
        return code
    there = {name: number for number, name in enumerate(source.names)}
    empty = torch.zeros_like(code[:, :, 0])
    found = [code[:, :, there[name]] if name in there else empty for name in target.names]
    return torch.stack(found, 2)


def shared(source: Layout, target: Layout) -> list[int]:
    """The parts of the target that the source has too, by their numbers."""
    return [number for number, name in enumerate(target.names) if name in source.names]


def share_initialisation(structures: Sequence[Structure], design: Design) -> None:
    """Copy the initial weights of the first structure to all others where they have the same meaning.

    Layers of one shape are shared as they are; of layers whose weights belong to edges, those of edges
    that lead to a joint of the same role in the same part. So all encoders give a motion nearly the same
    code before training.
    """
    with torch.no_grad():
        known: dict[Hashable, Tensor] = {}
        for structure in structures:
            edgewise = dict(_edgewise(structure.layout, design))
            for name, weights in structure.named_parameters():
                if name in edgewise:
                    _share(known, name, edgewise[name], weights)
                else:
                    key = (name, tuple(weights.shape))
                    weights.copy_(known.setdefault(key, weights.detach().clone()))


def _share(known: dict[Hashable, Tensor], name: str, keys: Sequence[Hashable], weights: Tensor) -> None:
    """Share weights whose rows belong to edges, equally many rows for each key."""
    each = len(weights) // len(keys)
    for number, key in enumerate(keys):
        rows = weights[number * each : (number + 1) * each]
        rows.copy_(known.setdefault((name, key), rows.detach().clone()))


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


class Kinematics:
    """Forward kinematics of one structure (eq. 13): rotations of edges to joint positions.

    body: any of the structure. end_sites: joints whose ``PanBody.end_sites`` are positions as well, the
    last ones; of layouts of joints alone.
    """

    def __init__(self, body: PanBody, end_sites: Sequence[int] = ()) -> None:
        layout = body.layout
        if layout.slots == "joints":
            parents = np.array([*layout.parents, *end_sites])
            nodes, joints = list(range(len(parents))), len(layout.parents)
            tree = Skeleton(tuple(map(str, nodes)), parents, np.zeros((len(nodes), 3)))
            bones = [*nodes[:joints], *(node + 1 for node in nodes[joints:])]  # the root's row between
            self._first, self._last = 0, len(end_sites)
        else:
            tree = body.chains
            bones = [layout.edges, *layout.above, *layout.ends]  # row -1: of the root
            # the nodes at the joints: the first that leaves each, or the end there
            leaving = [0, *layout.turned, *(layout.ends + 1)]
            nodes = [leaving.index(joint) for joint in range(len(layout.parents))]
            self._first, self._last = 1, len(layout.ends)
        self._tree = Tree.of(tree)
        self._bones, self._node = torch.tensor(bones), torch.tensor(nodes)
        self._parents = torch.tensor(layout.parents[1:])
        self._identity = torch.tensor([1.0, 0.0, 0.0, 0.0])

    def __call__(self, edges: Tensor, bones: Tensor) -> Tensor:
        """``(rows, frames, joints + end sites, 3)`` relative to the root, in the unit of the bones.

        edges: ``(rows, frames, edges + 1, 4)``, need not be unit; the last is not read.
        bones: ``(rows, edges + 1 + end sites, 3)``, that of the root's movement zero.
        """
        if self._tree.mask.device != edges.device:
            moved = {k: v.to(edges.device) for k, v in vars(self).items() if not isinstance(v, int)}
            self.__dict__.update(moved)
        turns = functional.normalize(edges[..., :-1, :].float(), dim=-1, eps=1e-6)
        still = [self._identity.expand(*turns.shape[:2], n, 4) for n in (self._first, self._last)]
        rotations = torch.cat([still[0], turns, still[1]], 2)
        hips = turns.new_zeros(*turns.shape[:2], 3)
        return forward(self._tree, bones[:, self._bones], rotations, hips)[0][:, :, self._node]

    def vectors(self, positions: Tensor) -> Tensor:
        """``(rows, frames, joints - 1, 3)`` from each joint to the one that hangs from it."""
        return positions[:, :, 1:] - positions[:, :, self._parents]


def world(positions: Tensor, root: Tensor, kind: Root, turn: Tensor | None = None) -> Tensor:
    """Positions ``(rows, frames, joints, 3)`` in the world, level from where the window's first frame is.

    positions: relative to the hips, seen from where the body faces unless ``kind`` is ``position``.
    root:   ``(rows, frames, 4)``, the root's edge; see ``Features``.
    turn:   ``(rows, frames)`` complex, where the body faces; None: the root's turns tell.
    """
    if kind == "position":
        return positions + root[..., None, :3]
    if turn is None:
        angles = torch.cat([torch.zeros_like(root[:, :1, 3]), root[:, 1:, 3].cumsum(1)], 1)
        turn = torch.polar(torch.ones_like(angles), angles)
    steps = turn * torch.complex(root[..., 2], root[..., 0])
    level = steps.cumsum(1) - steps[:, :1]
    rise = root[..., 1]
    up = rise if kind == "height" else rise.cumsum(1) - rise[:, :1]
    seen = turn[..., None] * torch.complex(positions[..., 2].contiguous(), positions[..., 0].contiguous())
    moved = seen + level[..., None]
    return torch.stack([moved.imag, positions[..., 1] + up[..., None], moved.real], -1)


def summed(positions: Tensor, root: Tensor) -> Tensor:
    """Positions as the released code of three parts has them in a window: seen from where the body faces in
    each frame, plus the sum of what the root moved, the first frame's movement included.

    positions: ``(rows, frames, joints, 3)`` relative to the root. root: ``(rows, frames, 4)``, its edge.
    """
    return positions + root[..., None, :3].cumsum(1)
