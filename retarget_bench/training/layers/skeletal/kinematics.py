"""Forward kinematics of a structure: rotations of edges to joint positions, and these in the world."""

from collections.abc import Sequence

import numpy as np
import torch
from torch import Tensor
from torch.nn import functional

from retarget_bench.motion.kinematics_torch import Tree, forward
from retarget_bench.motion.skeleton import Skeleton
from retarget_bench.training.layers.skeletal.body import LayoutBody
from retarget_bench.training.layers.skeletal.features import Root


class Kinematics:
    """Forward kinematics of one structure (PAN, eq. 13): rotations of edges to joint positions.

    body: any of the structure. end_sites: joints whose ``LayoutBody.end_sites`` are positions as well, the
    last ones; of layouts of joints alone.
    """

    def __init__(self, body: LayoutBody, end_sites: Sequence[int] = ()) -> None:
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
    turned = turn[..., None] * torch.complex(positions[..., 2].contiguous(), positions[..., 0].contiguous())
    moved = turned + level[..., None]
    return torch.stack([moved.imag, positions[..., 1] + up[..., None], moved.real], -1)
