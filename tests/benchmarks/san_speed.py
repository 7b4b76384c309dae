"""What a training step of SAN costs, and how fast it retargets, beside its networks built the plain way.

Run it with ``python tests/benchmarks/san_speed.py [--threads N] [--rounds N] [--rows N] [--profile]``. A
step is one update of generators and one of discriminators with the released choices: two structures (22 and
27 edges), each with ``rows`` windows of 64 frames, all four pairs. The plain networks are
``tests/methods/san_reference.py``: dense layers times masks, poolings and unpoolings as products of
matrices, as the authors write them. Both do the same work around the networks, and put calls of one network
together, which the authors' code does not. Inference is of the networks alone, from the larger structure
to the smaller.
Processor time is given beside wall time, because other processes on the machine move it less. Lean and
plain take turns; the ratio is the median of those of the turns.
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
from torch.profiler import ProfilerActivity, profile

sys.path.insert(0, str(Path(__file__).parents[2]))
sys.path.insert(0, str(Path(__file__).parents[1] / "methods"))

import method_bodies
from san_reference import PlainDiscriminator, make_plain

from retarget_bench.methods.san import San
from retarget_bench.methods.san.structure import carried
from retarget_bench.plugins.spec import Spec
from retarget_bench.training.config import TrainingConfig
from retarget_bench.training.data import ClipArrays, TrainingData
from retarget_bench.training.joint_datasets import dataset
from retarget_bench.training.phases import optimiser_phases, to_device

BODIES = ("rosa", "petra", "mina", "clara")
"""Puppets of 23 joints and of 28."""
FRAMES = 64


def training_module(rows: int, plain: bool) -> Any:
    method: Any = San("released")
    known = dataset(Spec.parse("puppets")).characters()
    clips = {}
    for name in BODIES:
        arrays = method.prepare(method_bodies.dance(known[name], 4 * FRAMES))
        clips[name] = [ClipArrays(name, "dance", {k: a.astype(np.float32) for k, a in arrays.items()})]
    torch.manual_seed(0)
    data = TrainingData({name: known[name] for name in BODIES}, clips)
    module = method.training_module(data, TrainingConfig(1, 2 * rows, FRAMES, 1e-4))
    if plain:
        judges = module.modules["discriminator"].discriminators
        for name, structure in module.modules["generator"].items():
            judges[name] = PlainDiscriminator(judges[name], structure.levels)
            make_plain(structure)
    return module


def training_step(rows: int, plain: bool) -> Callable[[], None]:
    module, cpu = training_module(rows, plain), torch.device("cpu")
    phases = optimiser_phases(module, TrainingConfig(1, 2 * rows, FRAMES, 1e-4), cpu)
    batch = to_device(module.draw(np.random.default_rng(0), 2 * rows), cpu)

    def step() -> None:
        memory: dict[str, Any] = {}
        for phase in phases:
            phase(batch, memory, 1e-4)

    return step


def inference(clips: int, frames: int, plain: bool) -> Callable[[], None]:
    module = training_module(1, plain=False)
    target, source = (module.modules["generator"][name].eval() for name in ("body23", "body28"))
    for each in (source, target):
        make_plain(each) if plain else each.freeze()
    motion = torch.randn(clips, frames, source.layout.edges + 1, 4)
    bones = [torch.randn(clips, each.layout.edges + 1, 3) for each in (source, target)]

    def run() -> None:
        with torch.inference_mode():
            code = source.encoder(motion, source.codes(bones[0]))
            target.answer(carried(code, source.layout, target.layout), bones[1])

    return run


def seconds(call: Callable[[], None]) -> tuple[float, float]:
    """Wall and processor."""
    start = time.perf_counter(), time.process_time()
    call()
    return time.perf_counter() - start[0], time.process_time() - start[1]


def compared(name: str, calls: dict[str, Callable[[], None]], rounds: int, times: int = 1) -> None:
    """Prints what each of the calls takes, ``times`` of them in a row, and how many times the first."""
    taken: dict[str, list[tuple[float, float]]] = {key: [] for key in calls}
    for number in range(rounds + 1):
        for key, call in calls.items():
            found = seconds(lambda call=call: [call() for _ in range(times)])
            if number:  # the first round warms up
                taken[key].append(found)
    for key, found in taken.items():
        wall, processor = (statistics.median(column) / times for column in zip(*found, strict=True))
        print(f"{name}, {key:6}{1e3 * wall:9.2f} ms wall {1e3 * processor:9.2f} ms processor")
    lean, plain = taken.values()
    ratio = statistics.median(b[1] / a[1] for a, b in zip(lean, plain, strict=True))
    print(f"{name}: the plain form takes {ratio:.2f} times as long")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--rounds", type=int, default=7)
    parser.add_argument("--rows", type=int, default=32)
    parser.add_argument("--profile", action="store_true")
    options = parser.parse_args()
    torch.set_num_threads(options.threads)
    print(f"torch {torch.__version__}, {options.threads} threads, {options.rows} rows of each structure")
    forms = {"lean": False, "plain": True}
    steps = {key: training_step(options.rows, plain) for key, plain in forms.items()}
    compared("training step", steps, options.rounds)
    if options.profile:
        with profile(activities=[ProfilerActivity.CPU]) as record:
            steps["lean"]()
        print(record.key_averages().table(sort_by="self_cpu_time_total", row_limit=18))
    for clips, frames in ((1, 64), (1, 600), (32, 600)):
        calls = {key: inference(clips, frames, plain) for key, plain in forms.items()}
        compared(
            f"{clips:2} x {frames} frames",
            calls,
            options.rounds,
            times=max(64 // clips // (frames // 64), 1),
        )


if __name__ == "__main__":
    main()
