"""GRU cells, unrolled over time with a hand-written backward pass.

Recorded step by step, a loop of cells spends most of its time on weights: every step reads them, and every
step of the backward pass adds a whole matrix of gradients to another. Here products with inputs that are
known beforehand are made for all steps at once, and so are the gradients of all weights.

Time comes first in this file: ``(frames, rows, ...)``.
"""

from collections.abc import Sequence
from typing import Any, Literal

import torch
from torch import Tensor, nn
from torch.autograd.function import once_differentiable

Kind = Literal["tf", "torch"]
KINDS: tuple[Kind, ...] = ("tf", "torch")
Saved = tuple[Tensor, ...]


class TfCell:
    """TensorFlow's GRU: one bias per gate, reset applied before the product with the state.

    Gates lie in the order reset, update, candidate.
    """

    def step(self, projected: Tensor, state: Tensor, weights: Tensor, bias: Tensor) -> tuple[Tensor, Saved]:
        """The next state ``(rows, hidden)``, and what the gradient needs.

        projected: ``(rows, 3 hidden)``: the input's products, its bias included.
        weights:   ``(hidden, 3 hidden)`` of the state. bias: ``(3 hidden)`` of the state, or empty.
        """
        size = state.shape[1]
        gates = torch.addmm(projected[:, : 2 * size], state, weights[:, : 2 * size]).sigmoid_()
        reset, update = gates.chunk(2, 1)
        held = reset * state
        candidate = torch.addmm(projected[:, 2 * size :], held, weights[:, 2 * size :]).tanh_()
        return torch.lerp(candidate, state, update), (state, gates, held, candidate)

    def back(self, gradient: Tensor, saved: Saved, weights: Tensor) -> tuple[Tensor, Tensor]:
        """Gradients in ``projected`` and in the state before, from that in the state after."""
        state, gates, _, candidate = saved
        size = state.shape[1]
        reset, update = gates.chunk(2, 1)
        to_projected = torch.empty_like(weights[:1].expand(len(state), -1))
        to_reset, to_update, to_candidate = to_projected.chunk(3, 1)
        carried = gradient * update
        torch.mul((gradient - carried), 1.0 - candidate * candidate, out=to_candidate)
        to_held = to_candidate @ weights[:, 2 * size :].T
        torch.mul(gradient, state - candidate, out=to_update)
        torch.mul(to_held, state, out=to_reset)
        to_projected[:, : 2 * size] *= gates * (1.0 - gates)
        before = torch.addmm(
            carried.addcmul_(to_held, reset), to_projected[:, : 2 * size], weights[:, : 2 * size].T
        )
        return to_projected, before

    def gather(self, saved: Sequence[Saved], gradients: Tensor, bias: Tensor) -> tuple[Tensor, Tensor]:
        """Gradients in weights and bias of all steps together, from what ``back`` gave for ``projected``,
        ``(frames, rows, 3 hidden)``."""
        size = gradients.shape[-1] // 3
        states, held = (torch.cat([each[k] for each in saved]) for k in (0, 2))
        flat = gradients.flatten(0, 1)
        weights = torch.cat([states.T @ flat[:, : 2 * size], held.T @ flat[:, 2 * size :]], 1)
        return weights, torch.zeros_like(bias)


class TorchCell:
    """PyTorch's GRU: two biases per gate, reset applied to the product with the state."""

    def step(self, projected: Tensor, state: Tensor, weights: Tensor, bias: Tensor) -> tuple[Tensor, Saved]:
        size = state.shape[1]
        own = torch.addmm(bias, state, weights)
        gates = (projected[:, : 2 * size] + own[:, : 2 * size]).sigmoid_()
        reset, update = gates.chunk(2, 1)
        candidate = torch.addcmul(projected[:, 2 * size :], reset, own[:, 2 * size :]).tanh_()
        return torch.lerp(candidate, state, update), (state, gates, own[:, 2 * size :], candidate)

    def back(self, gradient: Tensor, saved: Saved, weights: Tensor) -> tuple[Tensor, Tensor]:
        state, gates, own, candidate = saved
        size = state.shape[1]
        reset, update = gates.chunk(2, 1)
        to_projected = torch.empty_like(weights[:1].expand(len(state), -1))
        to_reset, to_update, to_candidate = to_projected.chunk(3, 1)
        carried = gradient * update
        torch.mul((gradient - carried), 1.0 - candidate * candidate, out=to_candidate)
        torch.mul(gradient, state - candidate, out=to_update)
        torch.mul(to_candidate, own, out=to_reset)
        to_projected[:, : 2 * size] *= gates * (1.0 - gates)
        return to_projected, torch.addmm(carried, self._to_own(to_projected, reset), weights.T)

    def gather(self, saved: Sequence[Saved], gradients: Tensor, bias: Tensor) -> tuple[Tensor, Tensor]:
        size = gradients.shape[-1] // 3
        states, gates = (torch.cat([each[k] for each in saved]) for k in (0, 1))
        own = self._to_own(gradients.flatten(0, 1), gates[:, :size])
        return states.T @ own, own.sum(0)

    def _to_own(self, to_projected: Tensor, reset: Tensor) -> Tensor:
        """The gradient in the state's products: as in the input's, but for the reset of the last."""
        size = reset.shape[1]
        return torch.cat([to_projected[:, : 2 * size], to_projected[:, 2 * size :] * reset], 1)


Cell = TfCell | TorchCell
CELLS: dict[Kind, Cell] = {"tf": TfCell(), "torch": TorchCell()}


class Layer(nn.Module):
    """The weights of one GRU layer, drawn as TensorFlow (Glorot, gates open) or PyTorch draws them."""

    state_bias: Tensor

    def __init__(self, inputs: int, hidden: int, kind: Kind) -> None:
        super().__init__()
        self.cell = CELLS[kind]
        self.kernel = nn.Parameter(torch.empty(inputs, 3 * hidden))
        self.weights = nn.Parameter(torch.empty(hidden, 3 * hidden))
        self.bias = nn.Parameter(torch.zeros(3 * hidden))
        if kind == "torch":
            self.state_bias = nn.Parameter(torch.zeros(3 * hidden))
            for each in self.parameters():
                nn.init.uniform_(each, -(hidden**-0.5), hidden**-0.5)
            return
        self.register_buffer("state_bias", torch.zeros(0), persistent=False)
        for gates, columns in ((slice(2 * hidden), 2 * hidden), (slice(2 * hidden, None), hidden)):
            bound = (6.0 / (inputs + hidden + columns)) ** 0.5
            nn.init.uniform_(self.kernel.data[:, gates], -bound, bound)
            nn.init.uniform_(self.weights.data[:, gates], -bound, bound)
        self.bias.data[: 2 * hidden] = 1.0

    @property
    def hidden(self) -> int:
        return len(self.weights)

    def projected(self, inputs: Tensor) -> Tensor:
        """``(..., 3 hidden)``: the products of inputs ``(..., inputs)``, for all steps at once."""
        return torch.addmm(self.bias, inputs.flatten(0, -2), self.kernel).view(*inputs.shape[:-1], -1)

    def forward(self, inputs: Tensor, start: Tensor) -> Tensor:
        """``(frames, rows, hidden)`` states from inputs ``(frames, rows, inputs)``."""
        projected = raised(self.projected(inputs))
        if torch.is_grad_enabled():
            with unrounded(projected):
                states: Tensor = _Unrolled.apply(projected, start, self.weights, self.state_bias, self.cell)  # type: ignore[no-untyped-call]
            return states
        states = start.new_empty(len(inputs), *start.shape)
        for frame, each in enumerate(projected):
            start, _ = self.cell.step(each, start, self.weights, self.state_bias)
            states[frame] = start
        return states


class _Unrolled(torch.autograd.Function):
    """A layer over known inputs, with its gradient.

    With the plain loop in its place a whole training step of nkn takes 1.15 to 1.2 times as long (16 rows
    of 60 frames, hidden 512, one thread); with ``cell=torch`` 0.95 to 1.05, with hidden 256 as long. Two
    series of rounds each, on a busy machine.
    """

    @staticmethod
    def forward(
        ctx: Any, projected: Tensor, start: Tensor, weights: Tensor, bias: Tensor, cell: Cell
    ) -> Tensor:
        ctx.cell, ctx.saved, states = cell, [], projected.new_empty(len(projected), *start.shape)
        for frame, each in enumerate(projected):
            start, saved = cell.step(each, start, weights, bias)
            states[frame] = start
            ctx.saved.append(saved)
        ctx.save_for_backward(weights, bias)
        return states

    @staticmethod
    @once_differentiable
    def backward(ctx: Any, gradients: Tensor) -> tuple[Tensor | None, ...]:
        weights, bias = ctx.saved_tensors
        to_projected = gradients.new_empty(*gradients.shape[:2], weights.shape[1])
        gradient = torch.zeros_like(gradients[0])
        for frame in reversed(range(len(gradients))):
            to_projected[frame], gradient = ctx.cell.back(
                gradient + gradients[frame], ctx.saved[frame], weights
            )
        to_weights, to_bias = ctx.cell.gather(ctx.saved, to_projected, bias)
        ctx.saved = None
        return to_projected, gradient, to_weights, to_bias, None


def raised(values: Tensor) -> Tensor:
    """A tensor that autocast may have rounded, in single precision again."""
    return values.float() if values.dtype in (torch.bfloat16, torch.float16) else values


def unrounded(like: Tensor) -> torch.autocast:
    """No autocast: gradients by hand need the dtypes that they are written for, and what is rounded at
    every step of a loop adds up."""
    return torch.autocast(like.device.type, enabled=False)


def dropped(inputs: Tensor, keep: float) -> Tensor:
    """Dropout by a mask that is drawn apart from the inputs: ``(...)``, 0 or 1 / keep."""
    return torch.empty_like(inputs).bernoulli_(keep).div_(keep)
