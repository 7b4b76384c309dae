"""How fast training data streams, and how much memory that takes, against the training steps of methods.

    python tests/benchmarks/training_data.py [--data 'puppets[size=large,bodies=200]' ...]
        [--methods pan humot] [--rows 32] [--draws 200] [--step 3.5] [--groups N] [--augment]

Exact pairs: how many a second are generated into an empty cache, and read from it in random order. Windows:
what ``bench train`` gathers (motion that is not in the cache is made first), and how long the drawing of
one batch takes beside ``--step``, the seconds of a training step (PAN's of 32 windows). Memory is that of
the process itself, mapped files left out. The bar: a batch is drawn in a fiftieth of a step. With
``--augment`` windows are changed; what that alone takes, without what the method makes of the changed
motion, is printed too.
"""

from __future__ import annotations

import argparse
import os
import resource
import statistics
import tempfile
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from retarget_bench.api import optional
from retarget_bench.plugins import bound
from retarget_bench.plugins.spec import Spec
from retarget_bench.training import joint_datasets
from retarget_bench.training.augmentation.augmenter import Augmenter
from retarget_bench.training.config import Augmentation
from retarget_bench.training.data import TrainingData, gather

BAR = 50.0


def memory() -> tuple[float, float]:
    """MB of this process that are its own, and the largest that it ever was, mapped files included."""
    lines = Path("/proc/self/status").read_text().splitlines()
    facts = dict(line.split(":", 1) for line in lines)
    own = float(facts["RssAnon"].split()[0]) / 1e3
    return own, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3


def pairs(data: str, groups: int, step: float, rows: int) -> None:
    """Generated and read pairs a second, of processor time."""
    usual = os.environ.get("RETARGET_BENCH_CACHE")
    numbers = np.random.default_rng(0)
    with tempfile.TemporaryDirectory() as folder:
        os.environ["RETARGET_BENCH_CACHE"] = folder
        try:
            found = optional.training_pairs(bound.dataset(Spec.parse(data)).built)
            if found is None:
                return
            begun = time.process_time()
            for group in range(groups):
                found[group * found.together]
            made = groups / (time.process_time() - begun)
            size = sum(path.stat().st_size for path in Path(folder).rglob("*.safetensors")) / 1e6
            asked = numbers.integers(groups * found.together, size=2000)
            before, begun, frames = memory()[0], time.process_time(), 0
            for index in asked:
                frames += found[int(index)].source.motion.frames
            read = len(asked) / (time.process_time() - begun)
            total = len(found) // found.together
            print(f"{data}: {len(found)} pairs in {total} groups, {size / groups * total:.0f} MB;")
            print(f"  made: {made:.1f} groups or {made * found.together:.0f} pairs a second;")
            print(f"  read: {read:.0f} pairs of {frames / len(asked) / 30:.1f} s a second, {rows} of them")
            print(f"  {step * read / rows:.0f} times as fast as a step of {step:g} s;")
            print(f"  memory grew by {memory()[0] - before:.0f} MB.")
        finally:
            os.environ.pop("RETARGET_BENCH_CACHE")
            if usual is not None:
                os.environ["RETARGET_BENCH_CACHE"] = usual


def windows(data: str, method: str, rows: int, draws: int, step: float, augment: bool) -> None:
    """Gathering, and the drawing of batches by the method's own training module."""
    spec, built = Spec.parse(method), bound.method(Spec.parse(method)).built
    config: Any = built.presets["default"]  # type: ignore[attr-defined]
    before = memory()
    begun = time.perf_counter(), time.process_time()
    joint = joint_datasets.joint_spec([Spec.parse(each) for each in data.split("+")])
    augmentation = Augmentation() if augment else None
    motion = gather(joint, spec, config.fps, 1, lambda *_: None, augmentation)
    gathered, own = time.perf_counter() - begun[0], memory()
    hours = motion.frames / config.fps / 3600.0
    module = built.training_module(motion, config)  # type: ignore[attr-defined]
    ready, numbers = memory(), np.random.default_rng(0)
    module.draw(numbers, rows)
    begun = time.perf_counter(), time.process_time()
    for _ in range(draws):
        module.draw(numbers, rows)
    each = (time.process_time() - begun[1]) / draws
    after = memory()
    verdict = "held" if step / each >= BAR else "MISSED"
    told = f"{step / each:.0f} times as fast as a step of {step:g} s"
    print(f"{data}, {method}: {hours:.1f} h of {len(motion.clips)} bodies gathered in {gathered:.0f} s;")
    print(f"  a batch of {rows}: {1e3 * each:.1f} ms, {told};")
    print(f"  bar of {BAR:.0f}: {verdict}; memory in MB: {before[0]:.0f} before, {own[0]:.0f} gathered,")
    print(f"  {ready[0]:.0f} with the module, {after[0]:.0f} after {draws} draws; {after[1]:.0f} at most.")
    if augmentation is not None:
        keys = next(iter(motion.clips.values()))[0].arrays
        nothing = Augmenter(augmentation, config.fps, lambda _: dict.fromkeys(keys, np.zeros(())))
        rates = [
            drawn(each, rows, config.window, draws) for each in (replace(motion, augmenter=nothing), motion)
        ]
        print(f"  windows a second: {rates[0]:.0f} changed, {rates[1]:.0f} changed and seen by the method.")


def drawn(motion: TrainingData, rows: int, frames: int, draws: int) -> float:
    """Windows of all characters that are drawn in a second of processor time."""
    cast = motion.cast(np.random.default_rng(0), rows)
    seconds = []
    for seed in range(draws + 1):
        begun = time.process_time()
        motion.draw(np.random.default_rng(seed), cast, frames)
        seconds.append(time.process_time() - begun)
    return rows / statistics.median(seconds[1:])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("--data", nargs="+", default=["puppets[size=default,bodies=100]"])
    parser.add_argument("--methods", nargs="+", default=["pan", "humot"])
    parser.add_argument("--rows", type=int, default=32)
    parser.add_argument("--draws", type=int, default=200)
    parser.add_argument("--step", type=float, default=3.5, help="seconds of a training step")
    parser.add_argument("--groups", type=int, default=30, help="groups of pairs to make; 0: no pairs")
    parser.add_argument(
        "--augment", action="store_true", help="change windows as bench train --augment does"
    )
    asked = parser.parse_args()
    for data in asked.data:
        if asked.groups and "+" not in data:
            pairs(data, asked.groups, asked.step, asked.rows)
        for method in asked.methods:
            windows(data, method, asked.rows, asked.draws, asked.step, asked.augment)


if __name__ == "__main__":
    main()
