"""What each hand-written backward pass brings in a whole training step.

Run it with ``python tests/benchmarks/backward_passes.py pan|humot|smrm|nkn [--preset P] [--threads N]
[--rounds N] [--rows N] [--steps N] [--parameters variant=paper ...]``.
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

from retarget_bench.evaluation import plan
from retarget_bench.plugins.spec import Spec
from retarget_bench.training.data import gather
from retarget_bench.training.phases import moved, turns

PAN = "retarget_bench.methods.pan.network"
HUMOT = "retarget_bench.methods.humot.network"
KINEMATICS = {"kinematics": ("retarget_bench.motion.kinematics_torch._kinematics", plain.kinematics)}
LEVELS = {"levels": ("retarget_bench.motion.kinematics_torch._kinematics", plain.kinematics_by_level)}
PASSES: Mapping[str, Mapping[str, tuple[str, Callable[..., Any]]]] = {
    "pan": {
        "attend": (f"{PAN}.core._attend", plain.attend),
        "gather": (f"{PAN}.gather._gather", plain.gather),
        "wide": (f"{PAN}.wide._wide", plain.wide),
        **KINEMATICS,
        **LEVELS,
    },
    "humot": {
        "means": (f"{HUMOT}.common._means", plain.means),
        "added": (f"{HUMOT}.common._added", plain.added),
        "scaled": (f"{HUMOT}.decoder.scaled", plain.scaled),
        "multiplied": (f"{HUMOT}.temporal._multiplied", plain.multiplied),
        "direct": (
            f"{HUMOT}.temporal.TemporalConvolution._by_frequency",
            lambda self, values: self._directly(values),
        ),
        "fed": (f"{HUMOT}.feed._fed", plain.fed),
        "fed_at_once": (f"{HUMOT}.feed._fed", plain.fed_at_once),
        "summed": (f"{HUMOT}.attention._summed", plain.summed),
        "mixed": (f"{HUMOT}.attention._mixed", plain.mixed),
        "locally": (f"{HUMOT}.local._local", plain.locally),
    },
    "smrm": {**KINEMATICS, **LEVELS},
    "nkn": {**KINEMATICS, **LEVELS},
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
    parser.add_argument("--steps", type=int, default=1)
    parser.add_argument("--rows", type=int)
    parser.add_argument("--only", nargs="*")
    options = parser.parse_args()
    torch.set_num_threads(options.threads)
    spec, data = Spec.parse(options.method), Spec.parse(options.dataset)
    method: Any = plan.method(spec)
    recipe = method.presets[options.preset]
    material = gather(data, spec, recipe.fps, 1, lambda done, total: None)
    torch.manual_seed(0)
    learner = method.learner(material, recipe)
    phases = turns(learner, recipe, torch.device("cpu"))
    passes = PASSES[spec.name]
    kept = options.only or list(passes)
    combos: dict[str, dict[str, Callable[..., Any]]] = {"hand-written": {}}
    combos |= {name: dict([passes[name]]) for name in kept}
    if len(kept) > 1 and spec.name in ("pan", "humot"):
        combos["all plain"] = dict(passes[n] for n in kept if n not in ("direct", "fed_at_once", "levels"))
        if spec.name == "humot":
            small = ("means", "added", "scaled", "multiplied")
            combos["small"] = dict(passes[n] for n in small)
            combos["small+fed+mixed"] = dict(passes[n] for n in (*small, "fed", "mixed"))
            combos["all+direct"] = combos["all plain"] | dict([passes["direct"]])
        else:
            combos["all but wide"] = dict(passes[n] for n in ("attend", "gather", "kinematics"))
    rows = options.rows or recipe.batch

    def step(seed: int) -> tuple[float, float]:
        numbers = np.random.default_rng(seed)
        torch.manual_seed(seed)
        start = time.process_time(), time.perf_counter()
        batch = moved(learner.draw(numbers, rows), torch.device("cpu"))
        memory: dict[str, Any] = {}
        for each in phases:
            each(batch, memory, 1e-6)
        return time.process_time() - start[0], time.perf_counter() - start[1]

    taken: dict[str, list[tuple[float, float]]] = {name: [] for name in combos}
    for round_ in range(options.rounds + 1):
        for name, chosen in combos.items():
            with patched(chosen):
                found = [step(options.steps * round_ + k) for k in range(options.steps)]
            if round_:
                taken[name].append(tuple(map(sum, zip(*found, strict=True))))
    base = taken["hand-written"]
    print(f"{options.method} {options.preset}, {rows} rows, {options.threads} threads")
    for name, each in taken.items():
        processor, wall = ([a[k] / b[k] for a, b in zip(each, base, strict=True)] for k in range(2))
        ms = 1e3 * statistics.median(a[0] for a in each) / options.steps
        print(
            f"{name:14} {ms:8.0f} ms processor  {statistics.median(processor):.2f} "
            f"(wall {statistics.median(wall):.2f})",
            flush=True,
        )


if __name__ == "__main__":
    main()
