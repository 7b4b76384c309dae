"""``bench train``: weights for a learned method. ``bench ablate``: the rows of a published ablation."""

from __future__ import annotations

import os
import shlex
import time
from collections.abc import Sequence
from contextlib import closing
from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from retarget_bench import defaults
from retarget_bench.commands import echo, run
from retarget_bench.commands.options import plugin_names, takes
from retarget_bench.errors import BenchError
from retarget_bench.files import write_text
from retarget_bench.options import Names, option
from retarget_bench.plugins import bound, named, registry
from retarget_bench.plugins.spec import Spec
from retarget_bench.python.progress import progress_bar
from retarget_bench.training.settings import TrainingSettings

if TYPE_CHECKING:
    from retarget_bench.training.loop import TrainingStatus
    from retarget_bench.training.record import Run
    from retarget_bench.training.train import TrainingOptions


class Options(TrainingSettings):
    """``bench train``."""

    dataset: Names = option(
        "The training data, with parameters in brackets; several are trained on at once.",
        default=(),
        letter="d",
        metavar="DATASET",
        names=("datasets",),
    )
    root: str | None = option(
        "Folder of the data: short for DATASET[root=DIR].", default=None, metavar="DIR"
    )
    prepare: bool = option(
        "Make training motion and pairs of the data set and keep them in the "
        "cache folder, and train nothing.",
        default=False,
    )

    @property
    def datasets(self) -> Sequence[str]:
        """The data sets as they were named, repeated ones included."""
        return [self.dataset] if isinstance(self.dataset, str) else self.dataset


@click.command("train")
@click.argument("method", required=False, shell_complete=plugin_names("methods"))
@takes(Options)
def command(method: str | None, options: Options) -> int:
    """Train METHOD on the training motion of data sets, and keep the weights that validate best.

    The folder gets run.json, a checkpoint about every minute, log.csv, loss.png, and the weights with their
    card. --resume continues an interrupted or killed run with the same result.

    \b
    bench train nkn -d 'puppets[size=default]' --budget 2h
    bench train nkn -d 'puppets[size=default]' -d 'folder[root=DIR,protocol=train]'
    bench train --resume -o runs/train/nkn
    torchrun --standalone --nproc-per-node 4 -m retarget_bench train nkn -d 'puppets[size=default]'
    """
    begun = time.perf_counter()
    if options.prepare:
        return _prepare(options)
    if method is None and not options.resume:
        raise BenchError("say which METHOD to train, or --resume -o DIR to go on with a run")
    spec = named.parse(method) if method else None
    from retarget_bench.training import parallel
    from retarget_bench.training.train import TrainingOptions, folder_of, train

    settings = {each.name: getattr(options, each.name) for each in fields(TrainingSettings)}
    training = TrainingOptions(spec, _data(options.datasets, options.root), **settings)
    with closing(ConsoleReporter()) as reporter:
        try:
            run = train(training, reporter, begun)
        except KeyboardInterrupt:
            reporter.close()
            echo(f"bench: interrupted{_how_to_go_on(training)}", err=True)
            return 130
        except BenchError as error:
            parallel.record(error)
            raise
    if os.environ.get("RANK", "0") == "0":  # the first process, see training/parallel.py
        echo(_ending(run, folder_of(training)))
    return 0


def _one(options: Options) -> str:
    """The one data set that is named. Raises BenchError for none or several."""
    if len(datasets := options.datasets) != 1:
        raise BenchError("name one data set: -d DATASET")
    return datasets[0]


def _prepare(options: Options) -> int:
    """Make the training motion and training pairs of a data set and keep them in the cache folder.

    Training makes what it needs by itself; this does it beforehand. Interrupted, it goes on where it
    stopped.
    """
    from retarget_bench.errors import some
    from retarget_bench.files import cache_folder
    from retarget_bench.training.prepare import prepare

    spec, total = registry.canonical("datasets", named.dataset(_one(options), options.root)), 0
    unusable: list[str] = []
    with progress_bar("bench train --prepare", "items") as progress:
        for done, total in prepare(spec, options.jobs, unusable):
            progress(done, total)
    if unusable:
        echo(f"left out: {len(unusable)} clips: {some(unusable, 10)}")
    echo(f"{spec}: {total} bodies and groups of pairs are in {cache_folder()}")
    return 0


def _data(datasets: Sequence[str], root: str | None) -> Spec | None:
    """The data set that ``-d`` and ``--root`` name, or several of them as one. Raises BenchError."""
    from retarget_bench.training.joint_datasets import joint_spec

    if not datasets:
        if root is not None:
            raise BenchError("--root says where a data set lies; say by -d which one")
        return None
    spec = joint_spec([named.parse(each) for each in datasets])
    if spec.posts and root is not None:
        raise BenchError(
            "--root is of one data set; with several, each says where it lies: -d 'NAME[root=DIR]'"
        )
    return spec if root is None else spec.with_parameters(root=root)


class ConsoleReporter:
    """A bar for gathering motion and one for training, and a line for every validation."""

    def __init__(self) -> None:
        self._bar: Any = None
        self._timed = False

    def say(self, text: str) -> None:
        from tqdm import tqdm

        tqdm.write(text)

    def gathering(self, done: int, total: int) -> None:
        self._count("motion", "body", done, total)

    def loading(self, done: int, total: int) -> None:
        self._count("validation", "case", done, total)

    def _count(self, what: str, unit: str, done: int, total: int) -> None:
        if self._bar is None:
            self._open(what, unit, total)
        self._bar.update(done - self._bar.n)
        if done == total:
            self.close()

    def _open(self, what: str, unit: str, total: int | None, initial: int = 0) -> None:
        from tqdm import tqdm

        self.close()
        self._bar = tqdm(total=total, initial=initial, desc=what, unit=unit, leave=False, disable=None)

    def began(self, run: Run) -> None:
        if run.ended:
            self.say(f"the budget ended at step {run.steps}; with a longer --budget it goes on")
        elif run.steps:
            self.say(f"continuing from step {run.steps}")
        if seconds := run.limit.seconds:
            self._timed = True
            self._open(run.scored_as, "s", round(seconds), round(run.seconds))
        else:
            self._timed = False
            self._open(run.scored_as, "step", run.limit.steps, run.steps)

    def show(self, status: TrainingStatus) -> None:
        from retarget_bench.training.card_text import hours
        from retarget_bench.training.record import error

        self._bar.update((round(status.seconds) if self._timed else status.step) - self._bar.n)
        losses = _losses(status)
        best = f"best {error(status.best.scores):.2f} at {status.best.step}" if status.best else ""
        self._bar.set_postfix_str(f"step {status.step}, {losses} {best}".strip(), refresh=False)
        if status.validation is not None:
            mark = " (best so far)" if status.best and status.best.step == status.step else ""
            self.say(
                f"step {status.step}, {hours(status.seconds)}: {losses}; "
                f"validation {_scores(status.validation)}{mark}"
            )
            if status.problem:
                self.say(f"not every validation case got an answer: {status.problem}")

    def close(self) -> None:
        if self._bar is not None:
            self._bar.close()
            self._bar = None


def _losses(status: TrainingStatus) -> str:
    """The sum of each phase's terms."""
    sums: dict[str, float] = {}
    for name, value in status.losses.items():
        phase, _, term = name.partition(".")
        if term != "norm":
            sums[phase] = sums.get(phase, 0.0) + value
    return ", ".join(f"{phase} {value:.4g}" for phase, value in sums.items())


def _scores(scores: Any) -> str:
    """``intra 8.1 / 5.2`` for each split: the errors in the world and of the pose."""
    numbers = {
        split: " / ".join(f"{value:.2f}" for name, value in values.items() if name != "n")
        for split, values in scores.items()
    }
    each = ", ".join(f"{split} {values}" for split, values in numbers.items())
    return f"{each} % of height, in the world / root-aligned"


def _how_to_go_on(training: TrainingOptions) -> str:
    from retarget_bench.training import run_folder
    from retarget_bench.training.train import folder_of

    run = run_folder.read(folder_of(training))
    if run is None or not run.steps:
        return " before the first checkpoint; there is nothing to go on from."
    where = f" -o {training.out}" if training.out else ""
    method = f" '{named.written(training.method)}'" if training.method else ""
    return f". bench train{method} --resume{where} goes on from the last checkpoint."


def _ending(run: Run, folder: Path) -> str:
    from retarget_bench.training.card_text import hours
    from retarget_bench.training.joint_datasets import tested, without_places

    method = named.parse(run.scored_as).with_parameters(weights=str(folder))
    data = tested(named.parse(run.dataset))
    root = data.parameters.get("root") if data else None
    where = f" --root {shlex.quote(str(root))}" if root else ""
    on = f"'{named.written(without_places(data))}'{where}" if data else "DATASET"
    best = run.best
    outcome = f"best at step {best.step}: {_scores(best.scores)}" if best else "the last weights are kept"
    return (
        f"{run.scored_as}: {run.steps} steps in {hours(run.seconds)}; {outcome}.\n"
        f"Use them: bench run '{named.written(method)}' -d {on}"
    )


class AblationOptions(TrainingSettings):
    """``bench ablate``: data, and the settings of every row."""

    dataset: str = option(
        "The training data.",
        default=defaults.DATASET,
        letter="d",
        metavar="DATASET",
        names=("datasets",),
    )
    out: Path = option(
        "The folder of training runs and results.",
        default=Path("runs/ablate"),
        letter="o",
        metavar="DIR",
    )
    test: str = option(
        "The data set to test on.",
        default="",
        shown="the one that is trained on",
        metavar="DATASET",
        names=("datasets",),
    )


@click.command("ablate")
@click.argument("method", shell_complete=plugin_names("methods"))
@click.argument("table")
@takes(
    AblationOptions,
    only=("dataset", "test", "preset", "budget", "out", "seed", "jobs"),
)
def ablate(method: str, table: str, options: AblationOptions) -> None:
    """Train and score every row of a published ablation TABLE of METHOD, and print the table.

    All rows have the same data, seed, training config and budget. The same command continues an interrupted
    one, and rows that several tables share are trained once.

    \b
    bench ablate smrm table2 -d puppets --budget 2000it
    bench ablate pan table5 -d 'puppets[size=default]' --test puppets
    """
    from retarget_bench.python import ablations
    from retarget_bench.tables.rendering import WITH_INTERVALS
    from retarget_bench.training.train import TrainingOptions

    spec = named.parse(method)
    data = registry.canonical("datasets", named.parse(options.dataset))
    tested = named.parse(options.test) if options.test else data
    ablation = ablations.find(spec, table)
    ablations.check(ablation, tested)
    # "" for no budget of one's own: a folder that was trained under one must not pass for this
    preset, seed, out = options.preset or "default", options.seed or 0, options.out
    shared = TrainingOptions(
        spec,
        data,
        preset=preset,
        budget=options.budget or "",
        seed=seed,
        jobs=options.jobs,
    )
    with closing(ConsoleReporter()) as reporter:
        trained = ablations.train_rows(ablation, shared, out, reporter)
    plan = ablations.plan_of(ablation, trained, tested, out / "results", options.jobs)
    run.carry_out(plan, "bench ablate")
    budget = f"budget {options.budget}, " if options.budget else ""
    recipe = f"preset {preset}, {budget}seed {seed}"
    result = ablations.table(ablation, trained, plan, bound.dataset(data).built.label.strip(), recipe)
    echo(WITH_INTERVALS["text"]([result]), nl=False)
    for ending in ("md", "tex", "html", "csv"):
        write_text(out / f"{spec.name}-{table}.{ending}", WITH_INTERVALS[ending]([result]))
    echo(f"wrote {out / f'{spec.name}-{table}'}.md, .tex, .html and .csv")
