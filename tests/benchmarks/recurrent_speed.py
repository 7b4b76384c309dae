"""Measures a training step of nkn with plain and hand-written backward passes, and how fast it retargets.

Run it with ``python tests/benchmarks/recurrent_speed.py [--threads N] [--rounds N]``. The step is a whole
one: generator and discriminator with their optimisers, 16 rows of 60 frames. Plain forms are loops that
autograd records, of the layers (``network/cells.py``), the decoder (``network/rollout.py``) and both; all
take turns. Inference is 32 clips of 300 frames in one batch, without reading or writing motions.
"""

from __future__ import annotations

import argparse
import statistics
import sys
import time
from collections.abc import Callable
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor, nn

sys.path.insert(0, str(Path(__file__).parents[2]))

from retarget_bench.methods.nkn import network
from retarget_bench.methods.nkn import plugin as Nkn
from retarget_bench.methods.nkn.network.cells import KINDS, Layer, raised, unrounded
from retarget_bench.methods.nkn.network.rollout import Memory, Rollout, Weights
from retarget_bench.plugins import bound
from retarget_bench.plugins.spec import Spec
from retarget_bench.training.config import TrainingConfig
from retarget_bench.training.data import ClipArrays, TrainingData
from retarget_bench.training.layers.kinematic.retargeter import Cases
from retarget_bench.training.phases import optimiser_phases, to_device

ROWS, FRAMES, HIDDEN, CHANNELS = 16, 60, 512, 70
CLIPS, LONG = 32, 300
CAST = 3


def training_data(trainee: Any) -> TrainingData:
    """The answers of a few puppets' cases."""
    puppets = bound.dataset(Spec.parse("puppets[size=tiny]")).built
    clips: dict[str, list[ClipArrays]] = {}
    bodies = {}
    for info in puppets.cases("retarget", "intra"):
        fits = not trainee.unfit(puppets.characters()[info.target])
        if fits and len(clips) < CAST and info.target not in clips:
            motion: Any = puppets.load(info).reference
            motion = motion.resample(30.0)
            bodies[info.target] = motion.character
            arrays = {key: np.asarray(each) for key, each in trainee.prepare(motion).items()}
            clips[info.target] = [ClipArrays(info.target, info.clip, arrays)]
    return TrainingData(bodies, clips)


def plain_states(layer: Layer, inputs: Tensor, state: Tensor) -> Tensor:
    """``Layer.forward`` as autograd records it."""
    known, states = raised(layer.known(inputs)), []
    with unrounded(known):
        for each in known:
            state, _ = layer.cell.step(each, state, layer.weights, layer.state_bias)
            states.append(state)
    return torch.stack(states)


class PlainRolled:
    """``Rolled`` as autograd records it."""

    @staticmethod
    def apply(rollout: Rollout, known: Tensor, *tensors: Tensor) -> tuple[Tensor, Tensor]:
        w, memory, drops, cell = Weights(*tensors), rollout.memory, rollout.drops, rollout.cell
        lower, upper, pose, rise, first = (getattr(memory, each.name) for each in fields(memory))
        poses, raws = [], []
        for number, each in enumerate(known):
            fed = pose * drops.fed[number] if drops else pose
            lower, _ = cell.step(torch.addmm(each, fed, w.fed), lower, w.lower, w.lower_bias)
            inputs = lower * drops.upper[number] if drops else lower
            upper, _ = cell.step(torch.addmm(w.bias, inputs, w.kernel), upper, w.upper, w.upper_bias)
            raws.append(torch.addmm(w.out_bias, upper, w.out))
            pose, rise = rollout.bodies.express(raws[-1], rise, first)
            poses.append(pose)
            first = False
        rollout.memory = Memory(*(each.detach() for each in (lower, upper, pose, rise)))
        return torch.stack(poses), torch.stack(raws)


FORMS: dict[str, tuple[Any, Any]] = {
    "hand-written": (Layer.forward, network.Rolled),
    "plain layers": (plain_states, network.Rolled),
    "plain decoder": (Layer.forward, PlainRolled),
    "plain": (plain_states, PlainRolled),
}


def training_step(spec: str, form: str) -> Callable[[], None]:
    """One step of all phases, at a learning rate that leaves the weights as they are."""
    trainee: Any = bound.method(spec).built
    config = TrainingConfig(1, ROWS, FRAMES, 1e-9)
    module = trainee.training_module(training_data(trainee), config)
    batch = to_device(module.draw(np.random.default_rng(0), ROWS), torch.device("cpu"))
    phases = optimiser_phases(module, config, torch.device("cpu"))

    def step() -> None:
        Layer.forward, network.Rolled = FORMS[form]
        memory: dict[str, Any] = {}
        for phase in phases:
            phase(batch, memory, 1e-9)
        Layer.forward, network.Rolled = FORMS["hand-written"]

    return step


def agree() -> float:
    """The largest difference of a layer's states to those of ``nn.GRUCell`` with its weights."""
    layer, peer = Layer(CHANNELS, HIDDEN, "torch"), nn.GRUCell(CHANNELS, HIDDEN)
    for name, value in zip(
        ("weight_ih", "weight_hh", "bias_ih", "bias_hh"),
        (layer.kernel.T, layer.weights.T, layer.bias, layer.state_bias),
        strict=True,
    ):
        getattr(peer, name).data.copy_(value)
    inputs, state, states = torch.randn(FRAMES, ROWS, CHANNELS), torch.zeros(ROWS, HIDDEN), []
    with torch.no_grad():
        for frame in inputs:
            state = peer(frame, state)
            states.append(state)
        worst: Tensor = (layer(inputs, torch.zeros(ROWS, HIDDEN)) - torch.stack(states)).abs().max()
    if not worst < 1e-5:
        raise SystemExit(f"a layer and nn.GRUCell disagree by {worst:g}")
    return float(worst)


def frames_per_second(cell: str, rounds: int) -> tuple[float, float]:
    """Per second of the clock, and of the processor: the same on idle cores with one thread."""
    trainee: Any = Nkn(cell=cell)
    found = training_data(trainee)
    module = trainee.training_module(found, TrainingConfig(1, ROWS, FRAMES, 1e-4))
    ready, body = module.method(), next(iter(found.characters.values()))
    poses = np.zeros((LONG, CLIPS, CHANNELS), np.float32)
    best = [float("inf"), float("inf")]
    for _ in range(rounds):
        stream = ready.stream(Cases([body] * CLIPS, [body] * CLIPS))
        start = time.perf_counter(), time.process_time()
        stream.advance(poses, np.ones((LONG, CLIPS), complex), np.zeros((LONG, CLIPS, 3)))
        taken = time.perf_counter() - start[0], time.process_time() - start[1]
        best = [min(pair) for pair in zip(best, taken, strict=True)]
    return CLIPS * LONG / best[0], CLIPS * LONG / best[1]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--rounds", type=int, default=7)
    parser.add_argument("--method", nargs="*", default=["nkn", "nkn[cell=torch]", "nkn[hidden=256]"])
    options = parser.parse_args()
    torch.set_num_threads(options.threads)
    print(f"torch {torch.__version__}, {options.threads} threads, layers agree to {agree():.0e}")
    for spec in options.method:
        steps = {form: training_step(spec, form) for form in FORMS}
        taken: dict[str, list[float]] = {name: [] for name in steps}
        for number in range(options.rounds + 1):
            for name, step in steps.items():
                start = time.perf_counter()
                step()
                if number:  # the first round warms up
                    taken[name].append(time.perf_counter() - start)
        for name, each in taken.items():
            ratios = (a / b for a, b in zip(each, taken["hand-written"], strict=True))
            print(f"{spec}, {name:14}{statistics.median(each):7.3f} s{statistics.median(ratios):7.2f} x")
    for cell in KINDS:
        clock, processor = frames_per_second(cell, 3)
        print(f"inference, {cell:6}{clock:7.0f} frames/s, {processor:.0f} per second of processor time")


if __name__ == "__main__":
    main()
