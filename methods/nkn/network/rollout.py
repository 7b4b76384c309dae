"""The decoder's loop over time, fed with its own answers, with a hand-written backward pass.

The backward pass goes by hand through the recurrent parts and leaves all gradients of weights to one
product over time (see ``cells.py``); that of a frame's forward kinematics is recorded as usual.
Time comes first: ``(frames, rows, ...)``.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import torch
from torch import Tensor
from torch.autograd.function import once_differentiable

from .bodies import Bodies
from .cells import Cell, Saved


@dataclass(frozen=True)
class Memory:
    """The state of a decoder after a frame.

    lower, upper: ``(rows, hidden)`` states. pose: ``(rows, channels)`` its last answer.
    rise: ``(rows, 1)`` centimetres of the hips above their first place. first: nothing came before.
    """

    lower: Tensor
    upper: Tensor
    pose: Tensor
    rise: Tensor
    first: bool = False


class Weights(NamedTuple):
    """Of a decoder, as its loop needs them. fed: ``(channels, 3 hidden)``, of the last answer."""

    fed: Tensor
    lower: Tensor
    lower_bias: Tensor
    kernel: Tensor
    bias: Tensor
    upper: Tensor
    upper_bias: Tensor
    out: Tensor
    out_bias: Tensor


class Drops(NamedTuple):
    """Dropout masks ``(frames, rows, ...)`` of the last answer and of the upper layer's input."""

    fed: Tensor
    upper: Tensor


class Frame(NamedTuple):
    """Values of one frame that the gradient needs; all but the cells' are ``(rows, ...)``."""

    fed: Tensor
    lower: Saved
    raised: Tensor
    upper: Saved
    state: Tensor
    raw: Tensor
    rise_before: Tensor
    pose: Tensor
    rise: Tensor


@dataclass(eq=False)
class Rollout:
    """One way through the frames of a batch. ``memory`` moves on with it."""

    cell: Cell
    bodies: Bodies
    drops: Drops | None
    memory: Memory

    def advance(self, frame: int, projected: Tensor, weights: Weights, record: bool = False) -> Frame:
        """One frame. projected: ``(rows, 3 hidden)`` what bones and code give to the lower layer."""
        memory, drops = self.memory, self.drops
        fed = memory.pose * drops.fed[frame] if drops else memory.pose
        gates = torch.addmm(projected, fed, weights.fed)
        lower, of_lower = self.cell.step(gates, memory.lower, weights.lower, weights.lower_bias)
        raised = lower * drops.upper[frame] if drops else lower
        gates = torch.addmm(weights.bias, raised, weights.kernel)
        upper, of_upper = self.cell.step(gates, memory.upper, weights.upper, weights.upper_bias)
        raw, before = torch.addmm(weights.out_bias, upper, weights.out), memory.rise
        with torch.set_grad_enabled(record):
            if record:
                raw, before = raw.requires_grad_(), before.detach().requires_grad_()
            pose, rise = self.bodies.express(raw, before, memory.first)
        self.memory = Memory(lower, upper, pose.detach(), rise.detach())
        return Frame(fed, of_lower, raised, of_upper, upper, raw, before, pose, rise)

    def answers(self, projected: Tensor, weights: Weights) -> tuple[Tensor, Tensor]:
        """Poses and raw outputs of all frames, nothing recorded."""
        outputs = []
        for number, each in enumerate(projected):
            frame = self.advance(number, each, weights)
            outputs.append((frame.pose, frame.raw))  # the rest would be gigabytes in the end
        poses, raw = zip(*outputs, strict=True)
        return torch.stack(poses), torch.stack(raw)

    def back(self, frame: Frame, number: int, gradients: Gradients, weights: Weights) -> Gradients:
        """Gradients one frame further back."""
        to_raw, to_rise = torch.autograd.grad(
            (frame.pose, frame.rise), (frame.raw, frame.rise_before), (gradients.pose, gradients.rise)
        )
        to_raw = to_raw + gradients.raw
        upper = torch.addmm(gradients.upper, to_raw, weights.out.T)
        to_upper, upper = self.cell.back(upper, frame.upper, weights.upper)
        raised = to_upper @ weights.kernel.T
        lower = gradients.lower + (raised * self.drops.upper[number] if self.drops else raised)
        to_lower, lower = self.cell.back(lower, frame.lower, weights.lower)
        pose = to_lower @ weights.fed.T
        if self.drops:
            pose = pose * self.drops.fed[number]
        return Gradients(lower, upper, pose, to_rise, to_raw, to_lower, to_upper)


class Gradients(NamedTuple):
    """Gradients on their way back: in states, answer, rise and raw output; in both layers' gates."""

    lower: Tensor
    upper: Tensor
    pose: Tensor
    rise: Tensor
    raw: Tensor
    to_lower: Tensor
    to_upper: Tensor


class Rolled(torch.autograd.Function):
    """``Rollout.answers`` with a gradient in known inputs and weights; none in the memory.

    With the plain loop in its place a whole training step of nkn takes 1.2 to 1.35 times as long (as in
    ``cells.py``); with ``cell=torch`` 0.95 to 1.1, with hidden 256 as long.
    """

    @staticmethod
    def forward(ctx: Any, rollout: Rollout, projected: Tensor, *tensors: Tensor) -> tuple[Tensor, Tensor]:
        weights = Weights(*(each.detach() for each in tensors))
        frames = [rollout.advance(number, each, weights, True) for number, each in enumerate(projected)]
        ctx.save_for_backward(*tensors)
        ctx.frames, ctx.rollout = frames, rollout
        return (
            torch.stack([each.pose.detach() for each in frames]),
            torch.stack([each.raw.detach() for each in frames]),
        )

    @staticmethod
    @once_differentiable
    def backward(ctx: Any, to_poses: Tensor, to_raw: Tensor) -> tuple[Tensor | None, ...]:
        weights, frames, rollout = Weights(*ctx.saved_tensors), ctx.frames, ctx.rollout
        ctx.frames = None
        rest = torch.zeros_like(frames[0].state)
        none = torch.zeros_like(frames[0].pose)
        gradients = Gradients(rest, rest, none, torch.zeros_like(frames[0].rise), none, rest, rest)
        back: list[Gradients] = []
        for number in reversed(range(len(frames))):
            arriving = gradients._replace(pose=gradients.pose + to_poses[number], raw=to_raw[number])
            gradients = rollout.back(frames[number], number, arriving, weights)
            back.append(gradients)
        back.reverse()
        return (
            None,
            torch.stack([each.to_lower for each in back]),
            *_sums(rollout.cell, frames, back, weights),
        )


def _sums(cell: Cell, frames: Sequence[Frame], back: Sequence[Gradients], weights: Weights) -> Weights:
    """Gradients of the weights, over all frames at once."""
    to_lower, to_upper, to_raw = (
        torch.stack([getattr(each, name) for each in back]) for name in ("to_lower", "to_upper", "raw")
    )
    fed, raised, state = (
        torch.cat([getattr(each, name) for each in frames]) for name in ("fed", "raised", "state")
    )
    lower, lower_bias = cell.gather([each.lower for each in frames], to_lower, weights.lower_bias)
    upper, upper_bias = cell.gather([each.upper for each in frames], to_upper, weights.upper_bias)
    flat_lower, flat_upper, flat_raw = (each.flatten(0, 1) for each in (to_lower, to_upper, to_raw))
    return Weights(
        fed=fed.T @ flat_lower,
        lower=lower,
        lower_bias=lower_bias,
        kernel=raised.T @ flat_upper,
        bias=flat_upper.sum(0),
        upper=upper,
        upper_bias=upper_bias,
        out=state.T @ flat_raw,
        out_bias=flat_raw.sum(0),
    )
