"""``bench train-features``: the feature networks of FID and other metrics of sets."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import click

from retarget_bench.commands import options
from retarget_bench.commands.terminal import echo
from retarget_bench.plugins import bound
from retarget_bench.python.plans import dataset_spec
from retarget_bench.python.progress import progress_bar


@click.command("train-features")
@click.argument("dataset", shell_complete=options.plugin_names("datasets"))
@click.option(
    "--structure",
    "structures",
    multiple=True,
    metavar="NAME",
    help="Only these, or 'two legs'. [default: all]",
)
@click.option(
    "-o",
    "--out",
    type=options.FOLDER,
    metavar="DIR",
    help="Folder of the networks. [default: features/ in the cache folder]",
)
@click.option(
    "--steps", type=click.IntRange(1), metavar="N", help="Training steps. [default: the training config's]"
)
@click.option(
    "--seed", type=click.IntRange(0), default=0, show_default=True, help="Seed of weights and batches."
)
@options.root_option
@options.jobs_option
def command(
    dataset: str,
    structures: tuple[str, ...],
    out: Path | None,
    steps: int | None,
    seed: int,
    root: str | None,
    jobs: int,
) -> None:
    """Train the feature network of every structure of DATASET on its training motion, and the one of all
    bodies on two legs.

    Each is an autoencoder of 64-frame windows, written as half-precision weights and a card that says what
    it was trained on and how. The card's hash stands beside every FID. Test clips are never used.
    """
    from tqdm import tqdm

    from retarget_bench.api import TWO_LEGS
    from retarget_bench.training.features import data as material
    from retarget_bench.training.features import network
    from retarget_bench.training.features.train import CONFIG_OF_TWO_LEGS, FeatureTrainingConfig, train

    spec = dataset_spec(dataset, root)
    data, folder = bound.dataset(spec).built, out or network.own_folder()
    for source in material.sources(data, structures):
        config = CONFIG_OF_TWO_LEGS if source.structure == TWO_LEGS else FeatureTrainingConfig()
        config = replace(config, seed=seed, steps=config.steps if steps is None else steps)
        with progress_bar(f"motion for {source.structure}", "bodies") as progress:
            clips = material.gather(spec, source, jobs, progress)
        with tqdm(total=config.steps, desc=source.structure, unit="step", leave=False, disable=None) as bar:

            def show(step: int, loss: float, bar: Any = bar) -> None:
                bar.update(step - bar.n)
                bar.set_postfix_str(f"loss {loss:.3f}", refresh=False)

            card = train(source, clips, _facts(spec, data, source), folder, config, show).card
        last, lent = card["loss"][-1], f" (motion of {card['trained_on']})" if "note" in card else ""
        echo(
            f"{card['structure']}{lent}: {card['windows']} windows, loss {last['train']:g}, validation "
            f"{last['validation']:g}, {card['seconds']} s, {card['hash']} in {folder}"
        )


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
