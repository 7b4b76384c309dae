"""Forward kinematics in torch: differentiable, and for batches that mix different skeletons.

Inside, joints come first and quaternion components second, ``(rows, 4, sequences, frames)``: long
contiguous runs. The joints of a mixed batch are the rows of one forest, so that one level of all its trees
is one array operation.

The gradient is written in closed form instead of being recorded. A small turn d of joint i about world
axes moves each bone b below it by d x b, so the gradient is a torque: the sum of b x (pull on b's far end)
below i, where the pull is itself the sum of the position gradients from there on. Both sums are one
product with the matrix of ancestors. Nothing is divided by, so gradients are finite everywhere.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
import torch
from torch import Tensor

from retarget_bench.errors import SkeletonError
from retarget_bench.motion.kinematics import doublings, levels
from retarget_bench.motion.skeleton import Skeleton

Steps = tuple[tuple[Tensor, Tensor], ...]

_MANY = 20_000
"""From so many quaternions on, on a processor, fewer products matter more than fewer calls."""
_SOURCE = (0, 1, 2, 3, 1, 0, 3, 2, 2, 3, 0, 1, 3, 2, 1, 0)
_SIGN = (1, -1, -1, -1, 1, 1, 1, -1, 1, -1, 1, 1, 1, 1, -1, 1)
"""Hamilton's product: (a b)_c = sum over k of sign[c, k] a_k b_source[c, k]."""


@dataclass(frozen=True, eq=False)
class Tree:
    """Parents of the joints of one skeleton (``Tree.of``), or of a padded batch of several (``batch``).

    mask: ``(joints,)``, or ``(sequences, joints)`` for a batch, bool: False at padding.

    The rest is bookkeeping over rows, which are the joints, sequence by sequence: every row's parent
    (-1, and in ``above`` the row itself, where there is none), whether it has one (``inner``), which rows
    are its ancestors within its sequence, the steps of ``kinematics.levels`` and ``doublings``, and the
    multiplication table of quaternions.
    """

    mask: Tensor
    parents: tuple[int, ...]
    above: Tensor
    inner: Tensor
    ancestors: Tensor
    levels: Steps
    doublings: Steps
    source: Tensor
    sign: Tensor

    @classmethod
    def of(cls, skeleton: Skeleton) -> Tree:
        """The tree of one skeleton, for any number of sequences and bodies that share it."""
        tree = cls.batch([skeleton])
        squeezed = {"mask": tree.mask[0], "ancestors": tree.ancestors[0]}
        return cls(**{**{each.name: getattr(tree, each.name) for each in fields(cls)}, **squeezed})

    @classmethod
    def batch(cls, skeletons: Sequence[Skeleton]) -> Tree:
        """One skeleton per sequence, each padded at the end to the longest."""
        if not skeletons:
            raise SkeletonError("a batch needs at least one skeleton")
        size = max(len(skeleton) for skeleton in skeletons)
        parents = np.full((len(skeletons), size), -1)
        mask = np.zeros((len(skeletons), size), dtype=bool)
        for k, skeleton in enumerate(skeletons):
            row = skeleton.parents
            parents[k, : len(row)] = np.where(row >= 0, row + k * size, -1)
            mask[k, : len(row)] = True
        rows = parents.reshape(-1)
        own = np.arange(len(rows))
        return cls(
            mask=torch.from_numpy(mask),
            parents=tuple(rows.tolist()),
            above=torch.from_numpy(np.where(rows >= 0, rows, own)),
            inner=torch.from_numpy(rows >= 0)[:, None, None, None],
            ancestors=torch.from_numpy(_ancestors(rows, size)),
            levels=_tensors(levels(rows)),
            doublings=_tensors(doublings(rows)),
            source=torch.tensor(_SOURCE),
            sign=torch.tensor(_SIGN, dtype=torch.float32).view(4, 4, 1, 1),
        )

    def to(self, device: torch.device | str) -> Tree:
        """The same tree on another device."""

        def moved(value: Any) -> Any:
            if isinstance(value, Tensor):
                return value.to(device)
            return tuple(moved(each) for each in value) if isinstance(value, tuple) else value

        return Tree(**{each.name: moved(getattr(self, each.name)) for each in fields(self)})


def pad(arrays: Sequence[np.ndarray | Tensor], dtype: torch.dtype = torch.float32) -> Tensor:
    """``(sequences, ..., joints, n)`` from arrays ``(..., joints, n)`` with different numbers of joints.

    Padding is zero. Use it for offsets ``(joints, 3)``, rotations ``(frames, joints, 4)``, positions.
    """
    tensors = [
        each.to(dtype) if isinstance(each, Tensor) else torch.tensor(each, dtype=dtype) for each in arrays
    ]
    size = max(each.shape[-2] for each in tensors)
    return torch.stack(
        [torch.nn.functional.pad(each, (0, 0, 0, size - each.shape[-2])) for each in tensors]
    )


def forward(tree: Tree, offsets: Tensor, rotations: Tensor, root: Tensor) -> tuple[Tensor, Tensor]:
    """Places and orientations of all joints in the world.

    offsets:   ``(joints, 3)`` metres, or ``(sequences, joints, 3)``: one body per sequence.
    rotations: ``(sequences, frames, joints, 4)`` local unit quaternions, w first; for the tree of one
               skeleton also ``(frames, joints, 4)``.
    root:      ``(sequences, frames, 3)`` or ``(frames, 3)`` metres, the root joint's place.
    Returns positions ``(sequences, frames, joints, 3)`` and orientations ``(..., 4)``; they are views
    with joints first in memory. Padding is zero and the identity whatever was given there.

    Differentiable, twice too, in rotations, root and offsets. The gradient of a quaternion lies along the
    unit sphere, as if it had been normalised first. Half precision is raised to single.
    Raises SkeletonError when shapes do not fit the tree.
    """
    if rotations.dtype in (torch.float16, torch.bfloat16):
        rotations = rotations.float()
    offsets, root = offsets.to(rotations.dtype), root.to(rotations.dtype)
    _check(tree, offsets, rotations, root)
    if rotations.ndim == 3:
        positions, turned = _kinematics(tree, _column(offsets), rotations[None], root[None])
        return positions[0], turned[0]
    if tree.mask.ndim == 1:
        return _kinematics(tree, _column(offsets), rotations, root)
    real = tree.mask[:, None, :, None]
    zero, unturned = rotations.new_zeros(()), rotations.new_tensor([1.0, 0.0, 0.0, 0.0])
    column = torch.where(tree.mask[..., None], offsets, zero).reshape(-1, 3, 1, 1)
    positions, turned = _kinematics(tree, column, torch.where(real, rotations, unturned), root)
    return torch.where(real, positions, zero), torch.where(real, turned, unturned)


def _column(offsets: Tensor) -> Tensor:
    """``(joints, 3, 1 or sequences, 1)``"""
    return (offsets.unsqueeze(-1) if offsets.ndim == 2 else offsets.permute(1, 2, 0)).unsqueeze(-1)


def _kinematics(tree: Tree, offsets: Tensor, rotations: Tensor, root: Tensor) -> tuple[Tensor, Tensor]:
    """``forward`` without padding; offsets: ``(rows, 3, 1 or s, 1)``."""
    if rotations.requires_grad and torch.is_grad_enabled():
        return _with_gradient(tree, offsets, rotations, root)
    chain = _chain(tree, _inward(tree, rotations))
    reach = _along(tree.ancestors, _bones(tree, offsets, chain))
    return _outward(rotations, reach) + root.unsqueeze(2), _outward(rotations, chain)


class _Kinematics(torch.autograd.Function):
    """``_kinematics`` of rotations that have a gradient; they are made unit first."""

    @staticmethod
    def forward(
        ctx: Any, tree: Tree, offsets: Tensor, rotations: Tensor, root: Tensor
    ) -> tuple[Tensor, Tensor]:
        outputs, inner = _unit_first(tree, offsets, rotations, root)
        ctx.tree = tree
        ctx.save_for_backward(offsets, rotations, root, *inner)
        ctx.set_materialize_grads(False)
        return outputs

    @staticmethod
    def backward(
        ctx: Any, to_positions: Tensor | None, to_turned: Tensor | None
    ) -> tuple[Tensor | None, ...]:
        tree: Tree = ctx.tree
        offsets, rotations, root, per_length, chain, bones = ctx.saved_tensors
        if torch.is_grad_enabled():
            inputs, gradients = (offsets, rotations, root), (to_positions, to_turned)
            return None, *_recorded(tree, inputs, ctx.needs_input_grad[1:], gradients)
        below = tree.ancestors.mT
        conjugates = chain * tree.sign[0].to(chain.dtype)
        torque = to_offsets = to_root = None  # torque: twice that on all joints, about the world's axes
        if to_turned is not None:
            spin = _product(tree, _inward(tree, to_turned), conjugates)
            torque = _along(below, spin.narrow(1, 1, 3))
        above = conjugates.index_select(0, tree.above)
        if to_positions is not None:
            to_root = to_positions.sum(2) if ctx.needs_input_grad[3] else None
            pull = _along(below, _inward(tree, to_positions))
            lever = _cross(bones + bones, pull)
            strictly_below = _along(below, lever) - lever
            torque = strictly_below if torque is None else torque + strictly_below
            if ctx.needs_input_grad[1]:
                force = torch.stack(_turn(above.unbind(1), pull.unbind(1)), 1)
                to_offsets = (force * tree.inner).sum_to_size(offsets.shape)
        if torque is None:
            return None, None, None, None
        # of a unit quaternion q = p* c, parent's and own orientation, the gradient is p* (0, torque) c
        turning = _product(tree, torch.nn.functional.pad(torque, (0, 0, 0, 0, 1, 0)), chain)
        to_unit = torch.where(tree.inner, _product(tree, above, turning), turning)
        return None, to_offsets, _outward(rotations, to_unit * per_length), to_root


_with_gradient: Callable[[Tree, Tensor, Tensor, Tensor], tuple[Tensor, Tensor]] = _Kinematics.apply


def _unit_first(
    tree: Tree, offsets: Tensor, rotations: Tensor, root: Tensor
) -> tuple[tuple[Tensor, Tensor], tuple[Tensor, Tensor, Tensor]]:
    """Positions and orientations, and what their gradient takes: one over the rotations' lengths,
    orientations and turned bones as rows."""
    local = _inward(tree, rotations)
    # torch's own norm takes longer along an inner axis
    per_length = (local * local).sum(1, keepdim=True).clamp_min(1e-24).rsqrt()
    chain = _doubled(tree, local * per_length)
    bones = _bones(tree, offsets, chain)
    positions = _outward(rotations, _along(tree.ancestors, bones)) + root.unsqueeze(2)
    return (positions, _outward(rotations, chain)), (per_length, chain, bones)


def _recorded(
    tree: Tree,
    inputs: tuple[Tensor, ...],
    needed: tuple[bool, ...],
    gradients: tuple[Tensor | None, Tensor | None],
) -> list[Tensor | None]:
    """Gradients that have gradients themselves, by autograd."""
    outputs, _ = _unit_first(tree, *inputs)
    known = [both for both in zip(outputs, gradients, strict=True) if both[1] is not None]
    found = iter(
        torch.autograd.grad(
            [output for output, _ in known],
            [each for each, needs in zip(inputs, needed, strict=True) if needs],
            [gradient for _, gradient in known],
            create_graph=True,
            allow_unused=True,
        )
    )
    return [next(found) if needs else None for needs in needed]


def _inward(tree: Tree, values: Tensor) -> Tensor:
    """``(rows, n, s, f)`` from values ``(sequences, frames, joints, n)``: rows are the joints of the tree
    that all sequences have, or else those of the first sequence, then of the second ..."""
    sequences, frames, joints, size = values.shape
    if tree.mask.ndim == 1:
        columns = values.reshape(sequences * frames, joints * size).t()
        return columns.contiguous().view(joints, size, sequences, frames)
    columns = values.flatten(2).transpose(1, 2)
    return columns.contiguous().view(sequences * joints, size, 1, frames)


def _outward(like: Tensor, rows: Tensor) -> Tensor:
    """The inverse of ``_inward``, a view; sequences, frames and joints are those of ``like``."""
    sequences, _, joints, _ = like.shape
    if len(rows) == joints:
        return rows.permute(2, 3, 0, 1)
    return rows.view(sequences, joints, rows.shape[1], -1).permute(0, 3, 1, 2)


def _bones(tree: Tree, offsets: Tensor, chain: Tensor) -> Tensor:
    """``(rows, 3, s, f)`` from the parent to each joint; offsets: ``(rows, 3, 1 or s, 1)``."""
    above = chain.index_select(0, tree.above).unbind(1)
    return torch.stack(_turn(above, (offsets * tree.inner).unbind(1)), 1)


# ------------------------------------------------------------------------------------------ the chain
def _chain(tree: Tree, local: Tensor) -> Tensor:
    """Global from local orientations, by the way that is fastest for this size and device."""
    if _few(local):
        return _doubled(tree, local)
    chain = local.clone()
    if tree.mask.ndim == 1:
        places, turns = chain.unbind(0), local.unbind(0)
        for joint, parent in enumerate(tree.parents):
            if parent >= 0:
                _product_into(places[joint], places[parent], turns[joint], 0)
    else:
        for rows, above in tree.levels:
            left, right = chain.index_select(0, above), local.index_select(0, rows)
            chain.index_copy_(0, rows, _product_into(torch.empty_like(right), left, right, 1))
    return chain


def _doubled(tree: Tree, local: Tensor) -> Tensor:
    """The same, rounded alike whatever the size."""
    chain = local.clone()
    for rows, above in tree.doublings:
        left, right = chain.index_select(0, above), chain.index_select(0, rows)
        chain.index_copy_(0, rows, _product(tree, left, right))
    return chain


def _few(quaternions: Tensor) -> bool:
    return quaternions.device.type != "cpu" or quaternions.numel() < 4 * _MANY


def _product(tree: Tree, a: Tensor, b: Tensor) -> Tensor:
    """``(rows, 4, s, f)`` a after b: in few calls, or of many quaternions in few passes over memory. Both
    round alike."""
    if _few(b):
        rows, _, *rest = b.shape
        right = b.index_select(1, tree.source).view(rows, 4, 4, *rest) * tree.sign.to(b.dtype)
        return (right * a.unsqueeze(1)).sum(2)
    (p, q, r, s), (t, u, v, o) = a.unbind(1), b.unbind(1)
    parts = (
        p * t - q * u - r * v - s * o,
        p * u + q * t + r * o - s * v,
        p * v - q * o + r * t + s * u,
        p * o + q * v - r * u + s * t,
    )
    return torch.stack(parts, 1)


def _product_into(out: Tensor, a: Tensor, b: Tensor, axis: int) -> Tensor:
    """a after b, in few passes over memory; the components lie along ``axis``."""
    (w, x, y, z), (p, q, r, s), (t, u, v, o) = out.unbind(axis), a.unbind(axis), b.unbind(axis)
    torch.mul(p, t, out=w).addcmul_(q, u, value=-1).addcmul_(r, v, value=-1).addcmul_(s, o, value=-1)
    torch.mul(p, u, out=x).addcmul_(q, t).addcmul_(r, o).addcmul_(s, v, value=-1)
    torch.mul(p, v, out=y).addcmul_(q, o, value=-1).addcmul_(r, t).addcmul_(s, u)
    torch.mul(p, o, out=z).addcmul_(q, v).addcmul_(r, u, value=-1).addcmul_(s, t)
    return out


def _along(matrix: Tensor, values: Tensor) -> Tensor:
    """Sums of values ``(rows, 3, s, f)`` over ancestors; in double precision where TF32 or autocast might
    round metres to three digits."""
    kind = values.dtype
    plain = values.device.type == "cpu" and not torch.is_autocast_enabled("cpu")
    exact = values if plain else values.double()
    batched = exact.reshape(*matrix.shape[:-1], -1)
    return (matrix.to(exact.dtype) @ batched).view(values.shape).to(kind)


_CYCLES = ((0, 1, 2), (1, 2, 0), (2, 0, 1))


def _turn(q: Sequence[Tensor], v: Sequence[Tensor]) -> list[Tensor]:
    """Vectors v turned by unit quaternions q = (w, u): v + 2 u x (w v + u x v)."""
    w, u = q[0], q[1:]
    inner = [
        torch.addcmul(torch.addcmul(w * v[i], u[j], v[k]), u[k], v[j], value=-1) for i, j, k in _CYCLES
    ]
    return [
        torch.addcmul(torch.addcmul(v[i], u[j], inner[k], value=2), u[k], inner[j], value=-2)
        for i, j, k in _CYCLES
    ]


def _cross(a: Tensor, b: Tensor) -> Tensor:
    u, v = a.unbind(1), b.unbind(1)
    return torch.stack([torch.addcmul(u[j] * v[k], u[k], v[j], value=-1) for _, j, k in _CYCLES], 1)


# -------------------------------------------------------------------------------------------- building
def _tensors(steps: tuple[tuple[np.ndarray, np.ndarray], ...]) -> Steps:
    return tuple((torch.from_numpy(rows), torch.from_numpy(above)) for rows, above in steps)


def _ancestors(parents: np.ndarray, size: int) -> np.ndarray:
    """``(sequences, size, size)``: 1 where the second joint is the first or one of its ancestors."""
    matrix = np.zeros((len(parents), size), dtype=np.float32)
    rows, at = np.arange(len(parents)), np.arange(len(parents))
    while rows.size:
        matrix[rows, at % size] = 1.0
        at = parents[at]
        rows, at = rows[at >= 0], at[at >= 0]
    return matrix.reshape(-1, size, size)


def _check(tree: Tree, offsets: Tensor, rotations: Tensor, root: Tensor) -> None:
    *sequences, joints = tree.mask.shape
    lead = rotations.shape[:-2]
    fits = (
        rotations.shape[-2:] == (joints, 4)
        and len(lead) in ((2,) if sequences else (1, 2))
        and (not sequences or lead[0] == sequences[0])
        and root.shape == (*lead, 3)
        and (offsets.shape == (joints, 3) or (len(lead) == 2 and offsets.shape == (lead[0], joints, 3)))
    )
    if not fits:
        batch = f"{sequences[0] if sequences else 'sequences'}, frames"
        raise SkeletonError(
            f"a tree of {joints} joints needs rotations ({batch}, {joints}, 4), a root ({batch}, 3) and "
            f"offsets ({joints}, 3) or one such per sequence; got {tuple(rotations.shape)}, "
            f"{tuple(root.shape)} and {tuple(offsets.shape)}"
        )
