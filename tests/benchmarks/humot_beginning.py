"""What lets HuMoT's networks learn within hours: its loss after few steps, with one change after the other.

    python tests/benchmarks/humot_beginning.py [--steps 100] [--rows 16] [--dataset 'puppets[size=default]']

Every row trains the same way from the same seed, on the same windows: the mean of eq. 1 over the last
quarter of the steps, in square metres per joint, and as a distance in cm. The rate falls along a cosine.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import torch
from torch import nn
from tqdm import tqdm

from retarget_bench.methods.humot import HuMoT
from retarget_bench.methods.humot.features import body
from retarget_bench.methods.humot.network.layers import TemporalConvolution
from retarget_bench.methods.humot.settings import PAPER_COUNT, SMALL, Design, Settings
from retarget_bench.methods.humot.training import HumotTraining
from retarget_bench.plugins.spec import Spec
from retarget_bench.training.config import TrainingConfig
from retarget_bench.training.data import TrainingData, gather
from retarget_bench.training.phases import optimiser_phases, to_device

HALF = replace(
    PAPER_COUNT, width=64, latent=64, blocks=(2, 2), motion=(3, 16, 32), norm="layer", affine=True
)
CALM = replace(HALF, scale=SMALL.scale, time=SMALL.time)
ROWS = (
    ("published form at half width and depth, torch's own beginning", HALF, False, True),
    ("... beginning orthogonal, frame by frame", HALF, False, False),
    ("... small layer scales and code of time", CALM, False, False),
    ("... anchors", replace(CALM, anchored=True), False, False),
    ("full width, one block a side", SMALL, False, False),
    ("... windows turned ahead: `small`", SMALL, True, False),
)


def as_torch_begins(network: nn.Module) -> None:
    """Layers of chains with the weights that torch would have given them."""
    for layer in network.modules():
        if isinstance(layer, nn.Linear):
            layer.reset_parameters()
        elif isinstance(layer, TemporalConvolution):
            outputs, inputs, taps = layer.weight.shape
            plain = nn.Conv1d(inputs, outputs, taps)
            layer.weight.data, layer.bias.data = plain.weight.data, plain.bias.data


def losses(
    training_data: TrainingData, design: Design, facing: bool, plain: bool, config: TrainingConfig
) -> Iterator[float]:
    """Eq. 1 of every step."""
    settings = Settings(
        subsampling=True,
        consistency=0.5,
        facing=facing,
        sized=False,
        varied=False,
        turned=not facing,
        mirrored=True,
        hop=6,
        split="clip",
    )
    torch.manual_seed(0)
    bodies = {name: body(training_data.characters[name]) for name in training_data.clips}
    module = HumotTraining(training_data, config, bodies, design, settings, lambda _: HuMoT())
    if plain:
        as_torch_begins(module.modules)
    (turn,) = optimiser_phases(module, config, torch.device("cpu"))
    for step in range(config.steps):
        batch = to_device(module.draw(np.random.default_rng(step), config.batch), torch.device("cpu"))
        found = turn(batch, {}, config.rate_at(step, step / config.steps))
        yield float(found["autoencoder.reconstruction"])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--steps", type=int, default=100)
    parser.add_argument("--rows", type=int, default=16)
    parser.add_argument("--dataset", default="puppets[size=default]")
    asked = parser.parse_args()
    bar = tqdm(desc="motion", leave=False)

    def shown(done: int, total: int) -> None:
        bar.n, bar.total = done, total
        bar.refresh()

    training_data = gather(Spec.parse(asked.dataset), Spec.parse("humot"), 30.0, 1, shown)
    bar.close()
    config = TrainingConfig(asked.steps, asked.rows, 30, 1e-3, schedule="cosine", warm_up=asked.steps // 4)
    print(f"{asked.steps} steps of {asked.rows} windows; loss over the last quarter")
    for label, design, facing, plain in ROWS:
        steps = losses(training_data, design, facing, plain, config)
        every = list(tqdm(steps, label, config.steps, leave=False))
        mean = float(np.mean(every[-(asked.steps // 4) :]))
        print(f"{mean:8.4f} m2  {100 * math.sqrt(mean):5.1f} cm  {label}", flush=True)


if __name__ == "__main__":
    main()
