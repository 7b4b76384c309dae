"""What a training step of nkn costs beside a bare loop of as many GRU cells, and how fast it retargets.

Run it with ``python tests/benchmarks/recurrent_speed.py [--threads N] [--rounds N]``. The step is the
generator's, 16 rows of 60 frames there and back, forward and backward: dropout, feedback, forward
kinematics and the losses of ``cycle`` included. The bare loop is four ``nn.GRUCell`` per frame and
direction, of the same sizes, forward and backward, and nothing else. Both take turns. Inference is 32
clips of 300 frames in one batch, without reading or writing motions.
"""

from __future__ import annotations

import argparse
import statistics
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor, nn

sys.path.insert(0, str(Path(__file__).parents[2]))

from retarget_bench.evaluation.plan import dataset, method
from retarget_bench.methods.nkn import plugin as Nkn
from retarget_bench.methods.nkn.network.cells import KINDS, Layer
from retarget_bench.plugins.spec import Spec
from retarget_bench.training.config import TrainingConfig
from retarget_bench.training.data import ClipArrays, TrainingData
from retarget_bench.training.phases import to_device

ROWS, FRAMES, HIDDEN, CHANNELS, BONES = 16, 60, 512, 70, 63
CLIPS, LONG = 32, 300
CAST = 3


def training_data(trainee: Any) -> TrainingData:
    """The answers of a few puppets' cases."""
    puppets = dataset(Spec.parse("puppets[size=tiny]"))
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


def training_step(cell: str) -> Callable[[], None]:
    trainee = method(Spec.parse(f"nkn[cell={cell},losses=cycle]"))
    module = trainee.training_module(training_data(trainee), TrainingConfig(1, ROWS, FRAMES, 1e-4))  # type: ignore[attr-defined]
    batch = to_device(module.draw(np.random.default_rng(0), ROWS), torch.device("cpu"))

    def step() -> None:
        module.modules.zero_grad(set_to_none=True)
        torch.stack(list(module.losses("generator", batch, {}).values())).sum().backward()

    return step


def bare_step() -> Callable[[], None]:
    widths = (CHANNELS, HIDDEN, BONES + CHANNELS + HIDDEN, HIDDEN)
    cells = nn.ModuleList(nn.GRUCell(width, HIDDEN) for width in widths)
    inputs = [torch.randn(FRAMES, ROWS, width) for width in (CHANNELS, BONES + CHANNELS)]

    def step() -> None:
        cells.zero_grad(set_to_none=True)
        loss = torch.zeros(())
        for _ in range(2):
            states = [torch.zeros(ROWS, HIDDEN) for _ in cells]
            for frame in range(FRAMES):
                states[0] = cells[0](inputs[0][frame], states[0])
                states[1] = cells[1](states[0], states[1])
                states[2] = cells[2](torch.cat([inputs[1][frame], states[1]], 1), states[2])
                states[3] = cells[3](states[2], states[3])
                loss = loss + states[3].sum()
        loss.backward()

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
        stream = ready.stream([body] * CLIPS, [body] * CLIPS, np.zeros((CLIPS, 3)), np.ones(CLIPS, complex))
        start = time.perf_counter(), time.process_time()
        stream.advance(poses)
        taken = time.perf_counter() - start[0], time.process_time() - start[1]
        best = [min(pair) for pair in zip(best, taken, strict=True)]
    return CLIPS * LONG / best[0], CLIPS * LONG / best[1]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--rounds", type=int, default=7)
    options = parser.parse_args()
    torch.set_num_threads(options.threads)
    print(f"torch {torch.__version__}, {options.threads} threads, layers agree to {agree():.0e}")
    steps = {"bare": bare_step(), **{cell: training_step(cell) for cell in KINDS}}
    taken: dict[str, list[float]] = {name: [] for name in steps}
    for number in range(options.rounds + 1):
        for name, step in steps.items():
            start = time.perf_counter()
            step()
            if number:  # the first round warms up
                taken[name].append(time.perf_counter() - start)
    for name, each in taken.items():
        ratio = statistics.median(a / b for a, b in zip(each, taken["bare"], strict=True))
        print(f"training step, {name:6}{statistics.median(each):7.3f} s{ratio:7.2f} x the bare loop")
    for cell in KINDS:
        clock, processor = frames_per_second(cell, 3)
        print(f"inference, {cell:6}{clock:7.0f} frames/s, {processor:.0f} per second of processor time")


if __name__ == "__main__":
    main()
