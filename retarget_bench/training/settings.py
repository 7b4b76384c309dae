"""Settings of a training run, as they are given; None: not given."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

from retarget_bench.options import Parallel, option


class TrainingSettings(Parallel):
    """Settings of a method's training."""

    preset: str | None = option(
        "Training config: paper, default, gpu or quick.", default=None, shown="default", metavar="NAME"
    )
    budget: str | None = option(
        "Time (90s, 30m, 2h) or steps (20000it).", default=None, shown="the preset's", metavar="BUDGET"
    )
    batch: int | None = option(
        "Rows of a batch.", default=None, shown="the preset's", at_least=1, metavar="N"
    )
    out: Path | None = option(
        "The run's folder.", default=None, shown="runs/train/METHOD", letter="o", metavar="DIR"
    )
    seed: int | None = option(
        "Seed of weights and batches.", default=None, shown="0", at_least=0, below=2**63, metavar="N"
    )
    init: str | None = option(
        "Initial weights: shipped ones, a card, or a run.", default=None, metavar="WEIGHTS"
    )
    resume: bool = option("Continue the run in --out from its last checkpoint.", default=False)
    device: Literal["auto", "cpu", "cuda"] = option("Device.", default="auto")
    precision: Literal["float32", "bfloat16"] | None = option(
        "Precision of matrix products in training.", default=None, shown="the preset's, float32"
    )
    augment: bool = option(
        "Train on changed windows and bodies too: limbs, speeds, paths, slants.", default=False
    )
