"""Windows a second of whole training steps: by precision, rows of a batch, and ``torch.compile``.

    python benchmarks/training_steps.py pan humot [--rows 16 32 64] [--rounds 3] [--compiled]
        [--dataset puppets] [--preset default] [--threads 1] [--device cpu] [--steps 200] [--shares]

A step is one of ``bench train``: a batch drawn and moved to the device, losses, gradients and Adam of
all phases. Contenders take turns with batches of the same seeds, and the median round counts: of processor
time, on a GPU of wall time with the device waited for, without drawing, which other processes do meanwhile
and which is printed beside it. ``--compiled`` adds contenders whose networks
``torch.compile`` has translated with its CPU backend; what that takes beforehand is printed too. With
``--steps`` both precisions are trained from one beginning on the same batches, and losses are printed. With
``--shares`` the share of every phase, and of the forward passes of every class of network, is printed.
"""

from __future__ import annotations

import argparse
import statistics
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import torch
from torch import nn

from retarget_bench.errors import BenchError
from retarget_bench.plugins import bound
from retarget_bench.plugins.spec import Spec
from retarget_bench.training.config import presets
from retarget_bench.training.data import TrainingData
from retarget_bench.training.gather import gather
from retarget_bench.training.pair_data import gather_pairs
from retarget_bench.training.phases import NORM, optimiser_phases, to_device

PARTS = ("Encoder", "Decoder", "SkeletonEncoder", "Autoencoder", "Corrector", "GRU")
"""Classes of networks that are called as a whole, which is what can be compiled."""


def stepper(
    data: TrainingData, method: Any, rows: int, precision: Any, compiled: bool, options: argparse.Namespace
) -> Callable[[int], tuple[float, float, float]]:
    """A function of a seed: seconds of one step and of drawing its batch, and the sum of the first phase's
    losses."""
    config = replace(presets(method)[options.preset], precision=precision)
    device = torch.device(options.device)
    torch.manual_seed(0)
    module = method.training_module(data, config)
    module.modules.to(device)
    if compiled:
        translate(module.modules)
    phases = optimiser_phases(module, config, device)
    clock = time.process_time if device.type == "cpu" else time.perf_counter

    def step(seed: int) -> tuple[float, float, float]:
        torch.manual_seed(seed)
        begun = clock()
        batch = module.draw(np.random.default_rng(seed), rows)
        drawing = clock() - begun
        batch = to_device(batch, device)
        memory: dict[str, Any] = {}
        measured = [phase(batch, memory, config.rate_at(seed, 0.0)) for phase in phases]
        if device.type == "cuda":
            torch.cuda.synchronize()
            begun += drawing
        seconds = clock() - begun
        terms = {key: each for key, each in measured[0].items() if not key.endswith(NORM)}
        return seconds, drawing, sum(float(each) for each in terms.values())

    return step


def translate(part: nn.Module) -> None:
    """Compile the outermost modules whose class is named in ``PARTS``."""
    for child in part.children():
        if type(child).__name__ in PARTS:
            child.compile(dynamic=False)
        else:
            translate(child)


def compare(name: str, options: argparse.Namespace) -> None:
    spec = Spec.parse(name)
    method: Any = bound.method(spec).built
    collect = gather_pairs if method.from_pairs else gather
    fps = presets(method)[options.preset].fps
    data = collect(Spec.parse(options.dataset), spec, fps, 1, lambda *_: None)
    if options.steps:
        curves(name, method, data, options)
        return
    if options.shares:
        shares(name, method, data, options)
        return
    print(f"{name}, preset {options.preset}: windows a second", flush=True)
    for rows in options.rows:
        choices = [(kind, compiled) for compiled in options.compiled for kind in ("float32", "bfloat16")]
        steps = {each: stepper(data, method, rows, *each, options) for each in choices}
        before = {each: step(0)[0] for each, step in steps.items()}
        times: dict[Any, list[tuple[float, ...]]] = {each: [] for each in choices}
        for round_ in range(1, options.rounds + 1):
            for each, step in steps.items():
                times[each].append(step(round_))
        medians = {
            each: [statistics.median(column) for column in zip(*measured, strict=True)]
            for each, measured in times.items()
        }
        base = medians[choices[0]][0]
        for (kind, compiled), (each, drawing, _) in medians.items():
            first_step = f", {before[kind, compiled]:.0f} s for the first step" if compiled else ""
            print(
                f"  {rows:4d} rows, {kind}{' compiled' * compiled}: {rows / each:8.1f}, "
                f"{1e3 * each:.0f} ms a step, {base / each:.2f} times the first, "
                f"drawing {1e3 * drawing:.0f} ms{first_step}",
                flush=True,
            )


def curves(name: str, method: Any, data: TrainingData, options: argparse.Namespace) -> None:
    """Print mean losses over each quarter of the steps."""
    rows = options.rows[0]
    steps = {kind: stepper(data, method, rows, kind, False, options) for kind in ("float32", "bfloat16")}
    losses = np.array([[step(seed)[2] for step in steps.values()] for seed in range(options.steps)])
    for kind, each in zip(steps, losses.T, strict=True):
        quarters = "  ".join(f"{part.mean():.5g}" for part in np.array_split(each, 4))
        print(f"{name}, {rows} rows, {options.steps} steps, {kind}: {quarters}", flush=True)


def shares(name: str, method: Any, data: TrainingData, options: argparse.Namespace) -> None:
    """Print which part of a step's processor time is drawing, every phase, and networks' forward passes."""
    config = presets(method)[options.preset]
    torch.manual_seed(0)
    module = method.training_module(data, config)
    phases = optimiser_phases(module, config, torch.device("cpu"))
    names = [phase.name for phase in module.phases]
    spent: Counter[str] = Counter()
    clock, begun = time.process_time, {}

    def before(part: nn.Module, _: Any) -> None:
        begun[part] = clock()

    def after(part: nn.Module, *_: Any) -> None:
        spent[f"{type(part).__name__}, forward"] += clock() - begun[part]
        spent[f"{type(part).__name__}, calls"] += 1

    for part in module.modules.modules():
        if type(part).__name__ in (*PARTS, "Discriminator"):
            part.register_forward_pre_hook(before)
            part.register_forward_hook(after)
    for seed in range(options.rounds + 1):
        if seed == 1:
            spent.clear()  # the first step is slower
        torch.manual_seed(seed)
        start, memory = clock(), {}
        batch = to_device(module.draw(np.random.default_rng(seed), options.rows[0]), torch.device("cpu"))
        spent["drawing"] += clock() - start
        for label, phase in zip(names, phases, strict=True):
            start = clock()
            phase(batch, memory, config.rate_at(seed, 0.0))
            spent[f"phase {label}"] += clock() - start
    total = spent["drawing"] + sum(spent[f"phase {label}"] for label in names)
    print(f"{name}, {options.rows[0]} rows: {total / options.rounds:.2f} s a step")
    for label, value in spent.items():
        if label.endswith("calls"):
            print(f"  {label}: {value / options.rounds:g} a step")
        else:
            print(f"  {label}: {value / total:.0%}")


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n", 1)[0])
    parser.add_argument("methods", nargs="+")
    parser.add_argument("--rows", type=int, nargs="+", default=[16, 32, 64])
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--dataset", default="puppets")
    parser.add_argument("--preset", default="default")
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--device", default="cpu")
    parser.add_argument("--steps", type=int, default=0)
    parser.add_argument("--shares", action="store_true")
    parser.add_argument("--compiled", action="store_const", const=(False, True), default=(False,))
    options = parser.parse_args()
    torch.set_num_threads(options.threads)
    failed = False
    for name in options.methods:
        try:
            compare(name, options)
        except (BenchError, RuntimeError) as error:  # out of a GPU's memory, for one; others go on
            failed = True
            print(f"{name}: {error}", flush=True)
    raise SystemExit(failed)


if __name__ == "__main__":
    main()
