"""Ship a mean of the weights of a training run and of the shipped ones that it began from.

    python -m tools.average_weights pan runs/train/pan --share 0.7

Weights that were trained on may fit their data better and foreign bodies worse than those they began from;
between the two there are often some that do well on both (Wortsman et al., "Robust fine-tuning of zero-shot
models", CVPR 2022). The card says what was averaged.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import click
from torch import Tensor

from retarget_bench.errors import BenchError
from retarget_bench.plugins import bound
from retarget_bench.plugins.spec import Spec
from retarget_bench.training import weights
from retarget_bench.training.learned_method import LearnedMethod
from retarget_bench.training.record import Record


@click.command()
@click.argument("method")
@click.argument("run", type=click.Path(path_type=Path))
@click.option(
    "--share", type=click.FloatRange(0, 1), default=0.7, show_default=True, help="Of the run's weights."
)
def command(method: str, run: Path, share: float) -> None:
    """Replace the shipped weights of METHOD by a mean of them and of those of RUN."""
    built: Any = bound.method(Spec.parse(method)).built
    place = built.shipped().get(built.config.weights) if isinstance(built, LearnedMethod) else None
    if place is None:
        raise BenchError(f"{method} has no shipped weights, so there is nothing to take a mean with")
    before, after = weights.read(place), weights.read(run)
    if (init := after.card.init) != before.hash:
        raise BenchError(
            f"{run} did not begin from the shipped weights of {method}, but from {init or 'none'}"
        )
    tensors = mean(before.tensors, after.tensors, share)
    weights.write(place.parent, built.config.weights, tensors, card(after.card, share))
    click.echo(f"{place}: {share:g} of {run}, the rest as it was")


def mean(before: Mapping[str, Tensor], after: Mapping[str, Tensor], share: float) -> dict[str, Tensor]:
    """Tensors between two of the same network; what is counted, not measured, is taken from ``after``."""
    return {
        name: before[name] + share * (each - before[name]) if each.is_floating_point() else each
        for name, each in after.items()
    }


def card(trained: Record, share: float) -> Record:
    """The run's card, which says what its weights are a mean of; its own scores are another's."""
    note = (
        f"a mean of weights: {share:g} of this training's ({trained.hash}), {1 - share:g} of those that "
        f"it began from ({trained.init}); curve and validation are of this training's own"
    )
    return replace(trained, notes=[note, *trained.notes])


def main() -> None:
    try:
        command.main(standalone_mode=False)
    except (BenchError, click.ClickException) as error:
        sys.exit(f"average_weights: {error}")


if __name__ == "__main__":
    main()
