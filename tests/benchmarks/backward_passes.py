"""What each hand-written backward pass brings in a whole training step.

Run it with ``python tests/benchmarks/backward_passes.py METHOD [--preset P] [--threads N] [--rounds N]
[--rows N]``, METHOD being ``pan``, with parameters in brackets if need be.

A step is one of ``bench train``: drawing a batch of the tiny puppets, losses, gradients, Adam, all phases.
The forms take turns, one of them plain (``tests/methods/plain_passes.py``) and the others hand-written; the
ratio of plain to hand-written is taken round by round, and its median printed: of processor time, and of
wall time behind it. A pass that brings less than 1.15 of a whole step is not worth its code.

Two shared cores, one thread if not said otherwise, processor time:

| plain instead | pan | 2 threads | pan[variant=released], paper, 32 rows | decision |
|---|---:|---:|---:|---|
| MLP | 1.43 | 1.28 | 1.25 | stays |
| ... plain, a piece at a time, by ``checkpoint`` | 1.26 | | | |
| attention in groups | 1.08 | 1.05 | 1.06 | dropped; masked attention of all rows is faster |
| gathering rows | 1.02 | 1.01 | 0.94 | dropped |
| forward kinematics | 1.05 | 1.03 | 0.98 | dropped (smrm 0.99, nkn 1.02) |
| the last three | 1.19 | 1.10 | 1.13 | |
| all | 1.47 | 1.33 | 1.36 | |

| plain instead | humot | humot[variant=paper_count], paper | decision |
|---|---:|---:|---|
| feed-forward layers, all tokens at once | 0.99 | 0.97 | dropped |
| ... and mixing of channels by ``torch.split`` | 0.99 | 0.96 | dropped |
| ... and sums over tokens likewise | 1.00 | 1.00 | dropped |
| local interaction and its norm | 0.96 | 1.06 | dropped |
| means of a frame | 1.01 | 0.98 | dropped |
| adding them | 0.99 | 0.98 | dropped |
| styles | 0.97 | 0.99 | dropped |
| products of frequencies | 1.02 | 0.99 | dropped |
| ... convolutions without frequencies | 1.24 | 1.06 | frequencies stay, recorded |

Sums and mixing were worth 1.18 and 1.22 (``paper_count``; all 1.49) over plain forms that cut each sequence
out of all tokens: the gradient of every cut is as large as all tokens. That of ``torch.split`` is one
concatenation.

HuMoT's columns are of a busy machine (4 to 15 rounds, wall time up to 0.1 apart from processor time); its
runs on two threads scattered too much to be used. Dropped passes were measured before they were dropped,
against plain forms that are not in all details those that took their place. There is no figure of a GPU:
none was at hand.

A whole step against the code that had all passes (interleaved processes, one thread, medians of 11 rounds
on a busy machine): pan 0.97 times the processor time. Against the code that had the last three of HuMoT's:
humot 1.00, humot[variant=paper_count] with 32 rows 1.02.
"""

from __future__ import annotations

import argparse
import statistics
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
import torch

sys.path.insert(0, str(Path(__file__).parents[2]))
sys.path.insert(0, str(Path(__file__).parents[1] / "methods"))

import plain_passes as plain

from retarget_bench.plugins import bound
from retarget_bench.plugins.spec import Spec
from retarget_bench.training.data import gather
from retarget_bench.training.phases import optimiser_phases, to_device

PASSES: Mapping[str, Mapping[str, tuple[str, Callable[..., Any]]]] = {
    "pan": {"mlp": ("retarget_bench.methods.pan.network.layers._mlp", plain.mlp)},
}


@contextmanager
def patched(chosen: Mapping[str, Callable[..., Any]]) -> Iterator[None]:
    patches = [patch(name, form) for name, form in chosen.items()]
    for each in patches:
        each.start()
    try:
        yield
    finally:
        for each in patches:
            each.stop()


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("method")
    parser.add_argument("--dataset", default="puppets")
    parser.add_argument("--preset", default="default")
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--rounds", type=int, default=7)
    parser.add_argument("--rows", type=int)
    options = parser.parse_args()
    torch.set_num_threads(options.threads)
    spec, data = Spec.parse(options.method), Spec.parse(options.dataset)
    method: Any = bound.method(spec).built
    recipe = method.presets[options.preset]
    material = gather(data, spec, recipe.fps, 1, lambda done, total: None)
    torch.manual_seed(0)
    learner = method.training_module(material, recipe)
    phases = optimiser_phases(learner, recipe, torch.device("cpu"))
    passes = PASSES[spec.name]
    combos: dict[str, dict[str, Callable[..., Any]]] = {"hand-written": {}}
    combos |= {name: dict([target]) for name, target in passes.items()}
    if len(passes) > 1:
        combos["all plain"] = dict(passes.values())
    rows = options.rows or recipe.batch

    def step(seed: int) -> tuple[float, float]:
        numbers = np.random.default_rng(seed)
        torch.manual_seed(seed)
        start = time.process_time(), time.perf_counter()
        batch = to_device(learner.draw(numbers, rows), torch.device("cpu"))
        memory: dict[str, Any] = {}
        for each in phases:
            each(batch, memory, 1e-6)
        return time.process_time() - start[0], time.perf_counter() - start[1]

    taken: dict[str, list[tuple[float, float]]] = {name: [] for name in combos}
    for round_ in range(options.rounds + 1):
        for name, chosen in combos.items():
            with patched(chosen):
                found = step(round_)
            if round_:
                taken[name].append(found)
    base = taken["hand-written"]
    print(f"{options.method} {options.preset}, {rows} rows, {options.threads} threads")
    for name, each in taken.items():
        processor, wall = ([a[k] / b[k] for a, b in zip(each, base, strict=True)] for k in range(2))
        ms = 1e3 * statistics.median(a[0] for a in each)
        print(
            f"{name:14} {ms:8.0f} ms processor  {statistics.median(processor):.2f} "
            f"(wall {statistics.median(wall):.2f})",
            flush=True,
        )


if __name__ == "__main__":
    main()
