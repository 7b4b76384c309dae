"""Train every shipped method with fixed configs and budgets, ship what validates better, write the tables.

    python -m tools.train_release                  all: half an hour of a GPU, or 28 hours of a core
    python -m tools.train_release --only pan --budget-scale 0.1

The training data are made first, by all cores. Then every method is trained in a folder of its own, on from
its shipped weights. New weights take the place of the shipped ones if they validate better on the same
cases. The main job is run with what is then shipped. An interrupted command goes on where it stopped when
it is given again.
"""

from __future__ import annotations

import json
import os
import sys
from contextlib import closing
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import click
import torch
from torch import nn

from retarget_bench import defaults
from retarget_bench.commands.options import takes
from retarget_bench.commands.train import ConsoleReporter
from retarget_bench.errors import BenchError
from retarget_bench.evaluation import plan
from retarget_bench.files import write_text
from retarget_bench.options import option
from retarget_bench.plugins import bound
from retarget_bench.plugins.spec import Spec
from retarget_bench.python.progress import progress_bar
from retarget_bench.python.results import Results
from retarget_bench.python.running import run
from retarget_bench.tables import requested
from retarget_bench.tables.rendering import markdown
from retarget_bench.tables.requested import Request
from retarget_bench.training import joint_datasets, parallel, prepare, run_folder, weights
from retarget_bench.training.settings import TrainingSettings
from retarget_bench.training.train import TrainingOptions, finished, train
from retarget_bench.training.validate import Validator


@dataclass(frozen=True)
class Training:
    """A method as it is shipped. hours: on a CPU, of preset ``default``. minutes: on a GPU, of ``gpu``.
    cmu: what it is trained on beside ``DATA`` where CMU's files are at hand; "": nothing, for methods that
    learn from meshes."""

    method: str
    hours: float
    minutes: float
    cmu: str = "cmu[bodies=200]"


TRAININGS = (
    Training("paired", hours=2, minutes=3.5),
    Training("pan", hours=4, minutes=4.5, cmu="cmu[bodies=200,own=false]"),
    Training("pan[parts=three]", hours=2, minutes=2, cmu="cmu[bodies=200,own=false]"),
    Training("humot", hours=4, minutes=3.5),
    Training("nkn", hours=2, minutes=2),
    Training("smrm", hours=2, minutes=2),
    Training("san", hours=2, minutes=2, cmu="cmu[bodies=200,own=false]"),
    Training("nkn_cross", hours=2, minutes=1.5, cmu="cmu[bodies=200,own=false]"),
    Training("pmnet", hours=1, minutes=1),
    Training("pmnet_cross", hours=1, minutes=1, cmu="cmu[bodies=200,own=false]"),
    Training("r2et", hours=1, minutes=1),
    Training("same", hours=1, minutes=1),
    Training("skr", hours=2, minutes=2.5, cmu=""),
    Training("skin", hours=1, minutes=1, cmu=""),  # learns with the joints that the shipped skr finds
    Training("npt", hours=1, minutes=1.5, cmu=""),
)
DATA = "puppets[size=large,bodies=200]"
"""The training data of all of them."""
TINY = "puppets"
CMU_FOLDER = "RETARGET_BENCH_CMU"
"""The variable that says where CMU's files lie."""
CASES = 48
"""Validation cases of each split by which new weights are compared with shipped ones."""
VERDICT = "verdict.json"


@dataclass(frozen=True)
class Verdict:
    """Validation errors of the shipped weights (None: there were none that fit) and of the new ones."""

    method: str
    steps: int
    seconds: float
    before: float | None
    after: float
    hash: str

    @property
    def shipped(self) -> bool:
        return self.before is None or self.after < self.before


class Options(TrainingSettings):
    """Options that all trainings share."""

    out: Path = option(
        "The folder of runs and results.", default=Path("runs/release"), letter="o", metavar="DIR"
    )


@click.command()
@click.option("--only", multiple=True, metavar="METHOD", help="Train only this one; may be repeated.")
@click.option(
    "--budget-scale", type=click.FloatRange(0, min_open=True), default=1.0, help="Of all budgets."
)
@click.option("--tiny", is_flag=True, help="Two steps of preset quick on little data, to try the command.")
@takes(Options, only=("out", "device", "jobs"))
def command(only: tuple[str, ...], budget_scale: float, tiny: bool, options: Options) -> None:
    """Train the shipped methods, ship what validates better, and write the tables of results."""
    chosen = [each for each in TRAININGS if each.method in only or not only]
    if unknown := set(only) - {each.method for each in chosen}:
        raise BenchError(
            f"{', '.join(sorted(unknown))}: trained are {', '.join(t.method for t in TRAININGS)}"
        )
    where, jobs, out = parallel.device(options.device), options.jobs, options.out
    data = {each.method: data_of(each, tiny) for each in chosen}
    for each in dict.fromkeys(part for spec in data.values() for part in joint_datasets.split_spec(spec)):
        prepare_data(each, jobs)
    verdicts = []
    for training in chosen:
        kind, budget = "default", f"{3600 * training.hours * budget_scale:g}s"
        if where.type == "cuda":
            kind, budget = "gpu", f"{60 * training.minutes * budget_scale:g}s"
        if tiny:
            kind, budget = "quick", "2it"
        spec = Spec.parse(training.method)
        run_options = TrainingOptions(
            spec,
            data[training.method],
            preset=kind,
            budget=budget,
            out=out / spec.slug,
            resume=True,
            jobs=jobs,
            device=where.type,  # type: ignore[arg-type]
        )
        verdicts.append(trained(run_options, where, 4 if tiny else CASES))
    click.echo(summary(verdicts))
    results = run([*only, "copy_rotations"] if only else (), out=out / "results", jobs=jobs)
    write_tables(out / "tables.md", results)
    write_text(out / "summary.md", summary(verdicts))
    click.echo(f"{out / 'tables.md'} has the results of the shipped weights.")


def data_of(training: Training, tiny: bool) -> Spec:
    """The training data, several as one."""
    beside = training.cmu if os.environ.get(CMU_FOLDER) else ""
    names = [TINY] if tiny else [DATA, *([beside] if beside else [])]
    return joint_datasets.joint_spec([Spec.parse(each) for each in names])


def prepare_data(data: Spec, jobs: int) -> None:
    """Make the motion and the pairs of a data set, so far as they are not in the cache."""
    unusable: list[str] = []
    with progress_bar(str(data), "items") as progress:
        for done, total in prepare.prepare(data, jobs, unusable):
            progress(done, total)


def trained(options: TrainingOptions, device: torch.device, cases: int) -> Verdict:
    """Train a method, or go on with it, and ship the weights if they are better than the shipped ones.

    Raises BenchError where its folder holds a run with other options.
    """
    assert options.method is not None
    assert options.dataset is not None
    assert options.out is not None
    place = options.out / VERDICT
    if place.exists():
        return Verdict(**json.loads(place.read_text(encoding="utf-8")))
    if not finished(options):
        begun = run_folder.read(options.out) is not None
        with closing(ConsoleReporter()) as reporter:
            click.echo(f"{options.method}: {'going on' if begun else 'training'}, {options.budget}")
            train(options if begun else with_initial_weights(options), reporter)
    new, name = weights.read(options.out), str(options.method)
    before, after = validated(options, device, cases)
    verdict = Verdict(name, new.card.steps, new.card.seconds, before, after, new.hash)
    if verdict.shipped:
        built: Any = bound.method(options.method).built
        folder = Path(sys.modules[type(built).__module__].__file__ or "").parent / "weights"
        weights.write(folder, built.config.weights, new.tensors, new.card)
        plan.forget()
    write_text(place, json.dumps(asdict(verdict), indent=1) + "\n")
    return verdict


def shipped(method: Spec) -> Any:
    """The method with its shipped weights; None where there are none that fit."""
    built: Any = bound.method(method).built
    try:
        return None if built.untrained else built
    except BenchError:
        return None


def with_initial_weights(options: TrainingOptions) -> TrainingOptions:
    assert options.method is not None
    built = shipped(options.method)
    return options if built is None else replace(options, init=built.config.weights)


def validated(options: TrainingOptions, device: torch.device, cases: int) -> tuple[float | None, float]:
    """Mean over splits of the validation error, of the shipped weights and of the new ones, on the cases
    that the shipped ones support. New ones that fail in one of them have an infinite error."""
    assert options.method is not None
    assert options.dataset is not None
    aside = joint_datasets.dataset(options.dataset).validation()
    if aside is None:
        raise BenchError(f"{options.dataset} has no validation cases to compare weights by")
    old = shipped(options.method)
    new = bound.method(options.method.with_parameters(weights=str(options.out))).built
    validator = Validator(aside, old or new, cases, device, lambda *_: None)
    before, after = (
        validator.decisive(validator(nn.Module(), each)) if each is not None else None
        for each in (old, new)
    )
    assert after is not None
    return before, after


def write_tables(path: Path, results: Results) -> None:
    write_text(path, markdown(requested.tables(results.places, Request())))


def summary(verdicts: list[Verdict]) -> str:
    """A Markdown table."""
    _, (value, _) = defaults.VALIDATION
    lines = [
        f"| method | steps | seconds | {value} before | after | shipped |",
        "|---|---:|---:|---:|---:|---|",
    ]
    for each in verdicts:
        before = "" if each.before is None else f"{each.before:.3f}"
        lines.append(
            f"| {each.method} | {each.steps} | {each.seconds:.0f} | {before} | {each.after:.3f} | "
            f"{'yes' if each.shipped else 'no, they are not better'} |"
        )
    return "\n".join(lines) + "\n"


def main() -> None:
    try:
        command.main(standalone_mode=False)
    except KeyboardInterrupt:
        sys.exit("interrupted; the same command goes on")
    except click.exceptions.Abort:
        sys.exit("interrupted; the same command goes on")
    except (BenchError, click.ClickException) as error:
        sys.exit(f"train_release: {error}")


if __name__ == "__main__":
    main()
