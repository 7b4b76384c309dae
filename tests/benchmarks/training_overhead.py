"""What the training loop costs beside a bare one with the same learner, and what a checkpoint costs.

Run it with ``python tests/benchmarks/training_overhead.py [--steps N] [--rounds N]``. A learner with two
phases of one small matrix each is trained by the loop of ``bench train`` (seeds, freezing, gradient norms,
checks of what is not finite, a row of the log every ten steps) and by a bare loop (draw, losses, backward,
Adam). They take turns, on one thread; processor time is compared. The checkpoint is that of a generator
and a discriminator of the size of NKN with their optimisers.
"""

from __future__ import annotations

import argparse
import statistics
import tempfile
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor, nn

from retarget_bench.training import checkpoint
from retarget_bench.training.config import Budget, TrainingConfig
from retarget_bench.training.contract import Phase
from retarget_bench.training.loop import Loop

NKN = 5_870_172 + 280_413


class Small:
    """Two matrices, one per phase."""

    phases = (Phase("generator", ("one",), clip=25.0), Phase("critic", ("two",)))

    def __init__(self) -> None:
        self.modules = nn.ModuleDict({"one": nn.Linear(16, 16), "two": nn.Linear(16, 1)})

    def draw(self, numbers: np.random.Generator, rows: int) -> dict[str, np.ndarray]:
        return {"seen": numbers.standard_normal((rows, 16), dtype=np.float32)}

    def losses(self, phase: str, batch: Mapping[str, Any], memory: dict[str, Any]) -> dict[str, Tensor]:
        seen = batch["seen"]
        if phase == "generator":
            memory["made"] = self.modules["one"](seen)
            return {"same": (memory["made"] - seen).square().mean()}
        return {"told": self.modules["two"](memory["made"].detach()).square().mean()}


def looped(steps: int, folder: Path) -> None:
    config = TrainingConfig(steps=steps, batch=16, window=1, rate=1e-3, validate=0)
    module: Any = Small()
    Loop(
        module,
        config,
        Budget(steps=steps),
        0,
        torch.device("cpu"),
        folder,
        None,
        lambda moment: None,
        lambda at, better: None,
    ).run()


def bare(steps: int) -> None:
    module = Small()
    phases = [(phase.name, list(module.modules[phase.modules[0]].parameters())) for phase in module.phases]
    optimisers = {name: torch.optim.Adam(each, lr=1e-3, fused=True) for name, each in phases}
    numbers = np.random.default_rng(0)
    for _ in range(steps):
        batch = {"seen": torch.from_numpy(module.draw(numbers, 16)["seen"])}
        memory: dict[str, Any] = {}
        for name, _ in phases:
            loss = torch.stack(list(module.losses(name, batch, memory).values())).sum()
            optimisers[name].zero_grad()
            loss.backward()  # type: ignore[no-untyped-call]
            optimisers[name].step()


def spent(call: Any, *arguments: Any) -> float:
    """Processor seconds."""
    begun = time.process_time()
    call(*arguments)
    return time.process_time() - begun


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--steps", type=int, default=300)
    parser.add_argument("--rounds", type=int, default=5)
    options = parser.parse_args()
    torch.set_num_threads(1)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        looped(20, folder)
        bare(20)
        pairs = [
            (spent(looped, options.steps, folder), spent(bare, options.steps))
            for _ in range(options.rounds)
        ]
        ours, theirs = (1e3 * statistics.median(each) / options.steps for each in zip(*pairs, strict=True))
        print(f"a step of two phases: {ours:.2f} ms in the loop, {theirs:.2f} ms in a bare one")
        tensors = {f"modules/{part}": torch.randn(NKN) for part in ("weight", "mean", "square")}
        made = checkpoint.Checkpoint(1, 0.0, tensors)
        seconds = statistics.median(spent(checkpoint.write, folder, made) for _ in range(options.rounds))
        size = (folder / "step-1.safetensors").stat().st_size / 1e6
        print(f"a checkpoint of NKN's size: {size:.0f} MB, {seconds:.2f} s")


if __name__ == "__main__":
    main()
