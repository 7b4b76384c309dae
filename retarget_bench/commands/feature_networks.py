"""``bench train fid``: the feature networks of FID and other metrics of sets."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

from retarget_bench.commands import echo
from retarget_bench.errors import BenchError
from retarget_bench.plugins import bound
from retarget_bench.plugins.spec import Spec
from retarget_bench.python.progress import progress_bar

if TYPE_CHECKING:
    from retarget_bench.training.settings import TrainingSettings


def train(metric: Spec, spec: Spec, settings: TrainingSettings) -> int:
    """Train the feature network of every structure of a data set on its training motion, and the one of all
    bodies on two legs.

    Each is an autoencoder of 64-frame windows, written as half-precision weights and a card that says what
    it was trained on and how. The card's hash stands beside every FID. Test clips are never used.
    metric: its ``structure`` is the only one to train for. Raises BenchError.
    """
    from tqdm import tqdm

    from retarget_bench.api import TWO_LEGS
    from retarget_bench.training.config import Budget
    from retarget_bench.training.features import data as material
    from retarget_bench.training.features import network
    from retarget_bench.training.features.train import CONFIG_OF_TWO_LEGS, FeatureTrainingConfig
    from retarget_bench.training.features.train import train as train_network

    if unknown := sorted(set(metric.parameters) - {"structure"}):
        raise BenchError(f"{metric}: networks are trained by structure, not by {unknown[0]}")
    steps = Budget.parse(settings.budget).steps if settings.budget else None
    if steps == 0:
        raise BenchError(
            f"a budget of {settings.budget} is one of time; networks are trained by steps: 20000it"
        )
    structures = [str(each) for each in metric.parameters.values()]
    data, folder = bound.dataset(spec).built, settings.out or network.own_folder()
    for source in material.sources(data, structures):
        config = CONFIG_OF_TWO_LEGS if source.structure == TWO_LEGS else FeatureTrainingConfig()
        config = replace(config, seed=settings.seed or 0, steps=config.steps if steps is None else steps)
        with progress_bar(f"motion for {source.structure}", "bodies") as progress:
            clips = material.gather(spec, source, settings.jobs, progress)
        with tqdm(total=config.steps, desc=source.structure, unit="step", leave=False, disable=None) as bar:

            def show(step: int, loss: float, bar: Any = bar) -> None:
                bar.update(step - bar.n)
                bar.set_postfix_str(f"loss {loss:.3f}", refresh=False)

            card = train_network(source, clips, _facts(spec, data, source), folder, config, show).card
        last, lent = card["loss"][-1], f" (motion of {card['trained_on']})" if "note" in card else ""
        echo(
            f"{card['structure']}{lent}: {card['windows']} windows, loss {last['train']:g}, validation "
            f"{last['validation']:g}, {card['seconds']} s, {card['hash']} in {folder}"
        )
    return 0


def _facts(spec: Any, data: Any, source: Any) -> dict[str, Any]:
    """Facts of the data for the card."""
    from retarget_bench.training.features.data import performers

    facts = {
        "dataset": str(spec),
        "content": data.content,
        "trained_on": source.lender,
        "joints": list(source.joints),
        "characters": list(performers(data, source)),
    }
    if source.borrowed:
        facts["note"] = (
            f"no motion of structure {source.structure} was used; its joints are those of {source.lender} "
            "that lie nearest in the reference pose"
        )
    return facts
