"""What a training step of smrm costs beside bare fused GRUs of its sizes, and how fast it retargets.

Run it with ``python tests/benchmarks/smrm_speed.py [--threads N] [--rounds N]``. The step is that of the
generator, 32 rows of 30 frames there and back, forward and backward: heads, forward kinematics and all
losses but the adversarial one (and once with it). The bare stack is two ``torch.nn.GRU`` of the same sizes
with the same dropout, each twice, forward and backward, and nothing else. They take turns; processor time
is compared, which other processes on the machine move less. Inference is 32 clips of 300 frames in one
batch: of the networks alone, and as ``retarget_batch`` does it, motions in and motions out.
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
from torch import nn

sys.path.insert(0, str(Path(__file__).parents[2]))
sys.path.insert(0, str(Path(__file__).parents[1] / "methods"))

import method_bodies

from retarget_bench.api import Context
from retarget_bench.methods.smrm import SMRM
from retarget_bench.training.config import TrainingConfig
from retarget_bench.training.data import ClipArrays, TrainingData
from retarget_bench.training.phases import to_device

ROWS, FRAMES, HIDDEN, SEEN, BODY = 32, 30, 512, 69, 66
CLIPS, LONG = 32, 300
BODIES = {name: method_bodies.body(name, scale=scale) for name, scale in (("one", 1.0), ("tall", 1.3))}


def training_module(**parameters: Any) -> Any:
    method = SMRM(**parameters)
    clips = {}
    for name, body in BODIES.items():
        arrays = method.prepare(method_bodies.dance(body, 4 * FRAMES))
        clips[name] = [
            ClipArrays(name, "dance", {key: each.astype(np.float32) for key, each in arrays.items()})
        ]
    return method.training_module(TrainingData(BODIES, clips), TrainingConfig(1, ROWS, FRAMES, 1e-4))


def training_step(**parameters: Any) -> Callable[[], None]:
    trained = training_module(**parameters)
    batch = to_device(trained.draw(np.random.default_rng(0), ROWS), torch.device("cpu"))

    def step() -> None:
        trained.modules.zero_grad(set_to_none=True)
        torch.stack(list(trained.losses("generator", batch, {}).values())).sum().backward()

    return step


def bare_step() -> Callable[[], None]:
    encoder, decoder = (
        nn.GRU(size, HIDDEN, 2, batch_first=True, dropout=0.2) for size in (SEEN, BODY + HIDDEN)
    )
    seen, body = torch.randn(ROWS, FRAMES, SEEN), torch.randn(ROWS, FRAMES, BODY)

    def step() -> None:
        encoder.zero_grad(set_to_none=True)
        decoder.zero_grad(set_to_none=True)
        there, _ = decoder(torch.cat([body, encoder(seen)[0]], -1))
        back, _ = decoder(torch.cat([body, encoder(there[..., :SEEN])[0]], -1))
        back.sum().backward()

    return step


def networks(trained: Any) -> Callable[[], None]:
    """Everything but motions."""
    generator = trained.generator.eval()
    positions, moves = torch.randn(CLIPS, LONG, 22, 3), torch.randn(CLIPS, LONG, 3)
    body = torch.randn(CLIPS, 22, 3)

    def run() -> None:
        with torch.inference_mode():
            generator.decode(generator.encode(positions, moves)[0], body, body)

    return run


def batch(trained: Any) -> Callable[[], None]:
    method = trained.method()
    sources = [method_bodies.dance(BODIES["one"], LONG, seed) for seed in range(CLIPS)]
    targets = [BODIES["tall"]] * CLIPS

    def run() -> None:
        fresh = [source.copy() for source in sources]  # positions of a motion are kept once they are known
        method.retarget_batch(fresh, targets, contexts=[Context()] * CLIPS)

    return run


def seconds(call: Callable[[], None], clock: Callable[[], float] = time.perf_counter) -> float:
    start = clock()
    call()
    return clock() - start


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--rounds", type=int, default=7)
    options = parser.parse_args()
    torch.set_num_threads(options.threads)
    print(f"torch {torch.__version__}, {options.threads} threads")
    steps = {
        "bare": bare_step(),
        "smrm": training_step(adversarial=0.0),
        "adversarial": training_step(),
    }
    taken: dict[str, list[float]] = {name: [] for name in steps}
    for number in range(options.rounds + 1):
        for name, step in steps.items():
            each = seconds(step, time.process_time)
            if number:  # the first round warms up
                taken[name].append(each)
    for name, found in taken.items():
        ratio = statistics.median(a / b for a, b in zip(found, taken["bare"], strict=True))
        print(f"training step, {name:12}{statistics.median(found):7.3f} s{ratio:7.2f} x the bare stack")
    trained = training_module()
    for name, call in (("networks", networks(trained)), ("motions", batch(trained))):
        wall, processor = (
            CLIPS * LONG / min(seconds(call, clock) for _ in range(2))
            for clock in (time.perf_counter, time.process_time)
        )
        print(f"inference, {name:9}{wall:7.0f} frames/s, {processor:.0f} per second of processor time")


if __name__ == "__main__":
    main()
