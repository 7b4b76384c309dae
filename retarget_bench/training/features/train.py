"""Training a feature network: a convolutional autoencoder of windows, after Holden et al. (2015, 2016)."""

import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import asdict, dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor, nn

from retarget_bench.training.features import network, windows
from retarget_bench.training.features.data import Source
from retarget_bench.training.features.network import (
    KERNEL,
    OF_STRUCTURE,
    STRIDE,
    Design,
    Network,
    NetworkCard,
)

DROPPED = 1e-6
"""A channel or feature that varies less never varies: it is left out."""


@dataclass(frozen=True)
class FeatureTrainingConfig:
    """hop: frames between training windows. least: the smallest deviation that a place (heights) and any
    other channel is divided by. validation: one clip in so many is kept aside."""

    steps: int = 200
    batch: int = 48
    rate: float = 1e-3
    hop: int = 16
    least: tuple[float, float] = (0.01, 0.05)
    validation: int = 10
    checks: int = 8
    seed: int = 0


CONFIG_OF_TWO_LEGS = FeatureTrainingConfig(steps=700, batch=64)


class Autoencoder(nn.Module):
    """Three convolutions with stride 2 and tanh, and their mirror image."""

    def __init__(self, inputs: int, design: Design = OF_STRUCTURE) -> None:
        super().__init__()
        widths = (inputs, *design.layers)
        half = KERNEL // 2
        self.down = nn.ModuleList(nn.Conv1d(a, b, KERNEL, STRIDE, half) for a, b in pairwise(widths))
        back = widths[::-1]
        self.up = nn.ModuleList(
            nn.ConvTranspose1d(a, b, KERNEL, STRIDE, half, output_padding=1) for a, b in pairwise(back)
        )

    def forward(self, signal: Tensor) -> Tensor:
        """Windows ``(batch, channels, frames)`` rebuilt from their deepest activations."""
        for layer in self.down:
            signal = torch.tanh(layer(signal))
        for layer in self.up[:-1]:
            signal = torch.tanh(layer(signal))
        rebuilt: Tensor = self.up[-1](signal)
        return rebuilt


def train(
    source: Source,
    clips: Mapping[str, np.ndarray],
    facts: Mapping[str, Any],
    folder: Path,
    config: FeatureTrainingConfig,
    progress: Callable[[int, float], None],
) -> Network:
    """Train on clips of channels and write the network to a folder.

    facts: fields of its card, on the training motion. progress is called after every step with the steps
    done and the loss.
    """
    begun = time.perf_counter()
    design = source.design
    cut = [windows.windows(channels, config.hop, design.frames) for channels in clips.values()]
    held = slice(config.validation - 1, None, config.validation)
    aside = np.concatenate(cut[held] or cut[:1])
    del cut[held]
    training = np.concatenate(cut)
    mean, scale = _statistics(training, config)
    curve, model = _fit((training - mean) * scale, (aside - mean) * scale, design, config, progress)
    tensors = _tensors(model, mean, scale)
    card = NetworkCard(structure=source.structure, roles=source.roles, **facts)
    still = {"feature_mean": np.zeros(design.features), "feature_scale": np.ones(design.features)}
    bare = Network(tensors | still, card)
    deepest = np.concatenate(
        [bare.activations(training[at : at + 64]) for at in range(0, len(training), 64)]
    )
    spread = deepest.std(axis=0)
    scales = np.where(spread > DROPPED, 1.0 / np.maximum(spread, DROPPED), 0.0)
    tensors["feature_mean"] = deepest.mean(axis=0).astype(np.float32)
    tensors["feature_scale"] = scales.astype(np.float32)
    full_card = replace(
        card,
        clips=len(clips),
        windows=len(training),
        validation_windows=len(aside),
        features=int((tensors["feature_scale"] > 0).sum()),
        recipe=asdict(config),
        loss=curve,
        seconds=round(time.perf_counter() - begun),
        torch=torch.__version__,
    )
    return network.write(folder, tensors, full_card)


def _statistics(training: np.ndarray, config: FeatureTrainingConfig) -> tuple[np.ndarray, np.ndarray]:
    """``(channels,)`` mean, and one over the standard deviation (0 for what never varies)."""
    mean, spread = (
        each.astype(np.float32) for each in (training.mean(axis=(0, 1)), training.std(axis=(0, 1)))
    )
    joints = (training.shape[2] - 3) // 5
    least = np.repeat(np.array(config.least, np.float32), (3 * joints, 2 * joints + 3))
    return mean, np.where(spread > DROPPED, 1.0 / np.maximum(spread, least), 0.0).astype(np.float32)


def _fit(
    training: np.ndarray,
    aside: np.ndarray,
    design: Design,
    config: FeatureTrainingConfig,
    progress: Callable[[int, float], None],
) -> tuple[list[dict[str, float]], Autoencoder]:
    """The loss curve and the trained network."""
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(config.seed)
        model = Autoencoder(training.shape[2], design)
    optimiser = torch.optim.Adam(model.parameters(), lr=config.rate)
    schedule = torch.optim.lr_scheduler.CosineAnnealingLR(optimiser, config.steps)
    here, there = (
        torch.from_numpy(np.ascontiguousarray(each.transpose(0, 2, 1))) for each in (training, aside)
    )
    every = max(config.steps // config.checks, 1)
    curve, recent = [], []
    for step, batch in enumerate(_batches(len(here), config), 1):
        inputs = here[batch]
        loss = nn.functional.mse_loss(model(inputs), inputs)
        optimiser.zero_grad()
        loss.backward()  # type: ignore[no-untyped-call]
        optimiser.step()
        schedule.step()
        recent.append(loss.item())
        progress(step, recent[-1])
        if step % every == 0 or step == config.steps:
            mean = sum(recent) / len(recent)
            curve.append({"step": step, "train": _short(mean), "validation": _check(model, there)})
            recent = []
    return curve, model


def _batches(count: int, config: FeatureTrainingConfig) -> Iterator[Tensor]:
    """Indices of the windows of each step: every window once before any comes again."""
    numbers = torch.Generator().manual_seed(config.seed + 1)
    waiting = torch.randperm(count, generator=numbers)
    for _ in range(config.steps):
        while len(waiting) < config.batch:
            waiting = torch.cat([waiting, torch.randperm(count, generator=numbers)])
        yield waiting[: config.batch]
        waiting = waiting[config.batch :]


@torch.no_grad()
def _check(model: Autoencoder, windows_: Tensor) -> float:
    batches = [windows_[at : at + 64] for at in range(0, len(windows_), 64)]
    parts = [nn.functional.mse_loss(model(part), part).item() * len(part) for part in batches]
    return _short(sum(parts) / len(windows_))


def _short(number: float) -> float:
    return float(f"{number:.4g}")


def _tensors(model: Autoencoder, mean: np.ndarray, scale: np.ndarray) -> dict[str, np.ndarray]:
    """The encoder in half precision, and the statistics of its input."""
    tensors = {"input_mean": mean, "input_scale": scale}
    for number, layer in enumerate(model.down):
        for kind in ("weight", "bias"):
            tensors[f"{kind}_{number}"] = getattr(layer, kind).detach().numpy().astype(np.float16)
    return tensors
