"""Differentiable forward kinematics of edges, and the path of a window through the world."""

import torch
from torch import Tensor
from torch.nn import functional

from retarget_bench.motion.kinematics_torch import Tree, forward

from .body import Body
from .features import Root
from .layout import Layout


class Kinematics:
    """Forward kinematics of one structure (eq. 13): rotations of edges to joint positions."""

    def __init__(self, body: Body) -> None:
        """body: any of the structure."""
        layout = body.layout
        self._tree = Tree.of(body.chains)
        self._above, self._ends = torch.from_numpy(layout.above), torch.from_numpy(layout.ends)
        self._node, self._parents = torch.tensor(_nodes(layout)), torch.tensor(layout.parents[1:])

    def __call__(self, edges: Tensor, bones: Tensor) -> Tensor:
        """``(rows, frames, joints, 3)`` relative to the hips, in the unit of the bones.

        edges: ``(rows, frames, edges + 1, 4)``, need not be unit; the last is not read.
        bones: ``(rows, edges + 1, 3)``, the last zero.
        """
        if self._tree.mask.device != edges.device:
            self._move(edges.device)
        turns = functional.normalize(edges[..., :-1, :].float(), dim=-1, eps=1e-6)
        identity = turns.new_tensor([1.0, 0.0, 0.0, 0.0])
        first = identity.expand(*turns.shape[:2], 1, 4)
        last = identity.expand(*turns.shape[:2], len(self._ends), 4)
        offsets = torch.cat(
            [torch.zeros_like(bones[:, :1]), bones[:, self._above], bones[:, self._ends]], 1
        )
        hips = turns.new_zeros(*turns.shape[:2], 3)
        return forward(self._tree, offsets, torch.cat([first, turns, last], 2), hips)[0][:, :, self._node]

    def _move(self, device: torch.device) -> None:
        self._tree = self._tree.to(device)
        for name in ("_above", "_ends", "_node", "_parents"):
            setattr(self, name, getattr(self, name).to(device))

    def vectors(self, positions: Tensor) -> Tensor:
        """``(rows, frames, edges, 3)`` from each joint to the one that hangs from it."""
        return positions[:, :, 1:] - positions[:, :, self._parents]


def _nodes(layout: Layout) -> list[int]:
    """The joint of ``Body.chains`` at each joint of the layout."""
    found = [0]
    ends = layout.ends.tolist()
    for joint in range(1, len(layout.parents)):
        leaving = [edge for edge, parent in enumerate(layout.parents[1:]) if parent == joint]
        found.append(leaving[0] + 1 if leaving else 1 + layout.edges + ends.index(joint - 1))
    return found


def world(positions: Tensor, root: Tensor, kind: Root, turn: Tensor | None = None) -> Tensor:
    """Places ``(rows, frames, joints, 3)`` in the world, level from where the window's first frame is.

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
