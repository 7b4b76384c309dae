"""Bodies as graphs side by side: there is no padding, and no edge from one to another."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import torch
from torch import Tensor

from retarget_bench.motion.kinematics import levels

from .bodies import SameBody


class Nodes(NamedTuple):
    """A graph, or what is left of one.

    parents: ``(nodes,)``, -1 for the hips, which come first. shape: ``(nodes, 6)`` cm, see ``SameBody``.
    turning: ``(nodes,)`` bool.
    """

    parents: np.ndarray
    shape: np.ndarray
    turning: np.ndarray

    @classmethod
    def of(cls, body: SameBody) -> "Nodes":
        return cls(body.skeleton.parents, body.shape, body.turning)

    def subset(self, nodes: np.ndarray) -> "Nodes":
        """Some of the nodes, increasing; what hangs from one that is left out has to be left out, too."""
        place = np.full(len(self.parents) + 1, -1)
        place[nodes] = np.arange(len(nodes))
        return Nodes(place[self.parents[nodes]], self.shape[nodes], self.turning[nodes])


class Graphs(NamedTuple):
    """The graphs of the rows of a batch, the nodes of one behind those of the other.

    shape:   ``(nodes, 6)`` cm, see ``SameBody``. turning: which nodes turn.
    row:     ``(nodes,)`` whose node. hips: ``(rows,)`` the first node of each row.
    receivers, senders: ``(edges,)`` nodes and their neighbours: their parents and their children.
    levels:  nodes and what they hang from, by depth.
    """

    shape: Tensor
    turning: Tensor
    row: Tensor
    hips: Tensor
    receivers: Tensor
    senders: Tensor
    levels: tuple[tuple[Tensor, Tensor], ...]

    @classmethod
    def of(cls, rows: Sequence[Nodes]) -> "Graphs":
        counts = np.array([len(each.parents) for each in rows])
        hips = np.cumsum(counts) - counts
        parents = np.concatenate(
            [
                np.where(each.parents < 0, -1, each.parents + first)
                for each, first in zip(rows, hips, strict=True)
            ]
        )
        below = np.flatnonzero(parents >= 0)
        above = parents[below]
        return cls(
            shape=torch.from_numpy(np.concatenate([each.shape for each in rows])),
            turning=torch.from_numpy(np.flatnonzero(np.concatenate([each.turning for each in rows]))),
            row=torch.from_numpy(np.repeat(np.arange(len(rows)), counts)),
            hips=torch.from_numpy(hips),
            receivers=torch.from_numpy(np.concatenate([below, above])),
            senders=torch.from_numpy(np.concatenate([above, below])),
            levels=tuple((torch.from_numpy(a), torch.from_numpy(b)) for a, b in levels(parents)),
        )


def matrices(columns: Tensor) -> Tensor:
    """``(..., 3, 3)`` rotations by their first two columns ``(..., 6)``, made orthonormal (Zhou et al.)."""
    first = torch.nn.functional.normalize(columns[..., :3], dim=-1)
    second = columns[..., 3:]
    second = torch.nn.functional.normalize(second - (first * second).sum(-1, keepdim=True) * first, dim=-1)
    return torch.stack([first, second, torch.linalg.cross(first, second)], -1)


def places(graphs: Graphs, turned: Tensor, height: Tensor) -> Tensor:
    """``(nodes, frames, 3)`` cm: forward kinematics, the hips on the vertical axis.

    turned: ``(nodes, frames, 3, 3)`` local rotations. height: ``(rows, frames)`` of the hips.
    """
    start = torch.stack([0 * height, height, 0 * height], -1)
    chains, reached, order = [turned[graphs.hips]], [start], [graphs.hips]
    place = torch.empty_like(graphs.row)
    for nodes, above in graphs.levels:
        place[order[-1]] = torch.arange(len(order[-1]), device=place.device)
        over = chains[-1].index_select(0, place[above])
        bones = graphs.shape[nodes, :3].view(-1, 1, 3, 1)
        reached.append(reached[-1].index_select(0, place[above]) + (over @ bones).squeeze(-1))
        chains.append(over @ turned.index_select(0, nodes))
        order.append(nodes)
    return torch.cat(reached)[torch.cat(order).argsort()]
