"""``bench train``: weights for a learned method. ``bench ablate``: the rows of a published ablation."""

from __future__ import annotations

import os
import shlex
from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from retarget_bench.commands import options, run
from retarget_bench.commands.table import FORMATS
from retarget_bench.commands.terminal import echo
from retarget_bench.errors import BenchError
from retarget_bench.plugins import bound, registry
from retarget_bench.plugins.spec import Spec
from retarget_bench.python.plans import dataset_spec

if TYPE_CHECKING:
    from retarget_bench.training.checkpoint import Checkpoint
    from retarget_bench.training.loop import TrainingStatus
    from retarget_bench.training.request import Request
    from retarget_bench.training.train import TrainingOptions, TrainingResult


@click.command("train")
@click.argument("method", required=False, shell_complete=options.plugin_names("methods"))
@click.option(
    "-d",
    "--dataset",
    "datasets",
    multiple=True,
    metavar="DATASET",
    shell_complete=options.plugin_names("datasets"),
    help="The training data, with parameters in brackets; may be repeated, to train on several at once.",
)
@options.root_option
@click.option(
    "--preset", metavar="NAME", help="Training config: paper, default or quick. [default: default]"
)
@click.option(
    "--budget", metavar="BUDGET", help="Time (90s, 30m, 2h) or steps (20000it). [default: the preset's]"
)
@click.option(
    "--out", type=options.FOLDER, metavar="DIR", help="The run's folder. [default: runs/train/METHOD]"
)
@click.option("--seed", type=options.SEED, metavar="N", help="Seed of weights and batches. [default: 0]")
@options.device_option
@click.option(
    "--precision",
    type=click.Choice(("float32", "bfloat16")),
    help="Precision of matrix products in training. [default: the preset's, float32]",
)
@click.option(
    "--augment", is_flag=True, help="Train on changed windows too: limbs, turns, mirror images, speeds."
)
@click.option("--resume", is_flag=True, help="Continue the run in DIR from its last checkpoint.")
@click.option("--init", metavar="WEIGHTS", help="Initial weights: shipped ones, a card, or a run.")
@options.jobs_option
def command(
    method: str | None, datasets: tuple[str, ...], root: str | None, resume: bool, **given: Any
) -> int:
    """Train METHOD on the training motion of data sets, and keep the weights that validate best.

    The folder gets run.json, a checkpoint about every minute, log.csv, loss.png, and the weights with their
    card. --resume continues an interrupted or killed run with the same result.

    \b
    bench train nkn -d 'puppets[size=default]' --budget 2h
    bench train nkn -d 'puppets[size=default]' -d 'folder[root=DIR,protocol=train]'
    bench train --resume --out runs/train/nkn
    torchrun --standalone --nproc-per-node 4 -m retarget_bench train nkn -d 'puppets[size=default]'
    """
    if method is None and not resume:
        raise click.UsageError("say which METHOD to train, or --resume --out DIR to go on with a run")
    from retarget_bench.training import parallel
    from retarget_bench.training.train import TrainingOptions, train

    spec = named.parse(method) if method else None
    asked = TrainingOptions(method=spec, dataset=_data(datasets, root), resume=resume, **given)
    with closing(ConsoleReporter()) as reporter:
        try:
            done = train(asked, reporter)
        except KeyboardInterrupt:
            reporter.close()
            echo(f"bench: interrupted{_how_to_go_on(asked)}", err=True)
            return 130
        except BenchError as error:
            parallel.record(error)
            raise
    if os.environ.get("RANK", "0") == "0":  # the first process, see training/parallel.py
        echo(_ending(done))
    return 0


def _data(datasets: tuple[str, ...], root: str | None) -> Spec | None:
    """The data set that ``-d`` and ``--root`` name, or several of them as one."""
    from retarget_bench.training.joint_datasets import joint_spec

    if not datasets:
        if root is not None:
            raise click.UsageError("--root says where a data set lies; say by -d which one")
        return None
    spec = joint_spec([named.parse(each) for each in datasets])
    if not spec.posts:
        return dataset_spec(str(spec), root)
    if root is not None:
        raise click.UsageError(
            "--root is of one data set; with several, each says where it lies: -d 'NAME[root=DIR]'"
        )
    return spec


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
        from tqdm import tqdm

        if self._bar is None:
            self._bar = tqdm(total=total, desc=what, unit=unit, leave=False, disable=None)
        self._bar.update(done - self._bar.n)
        if done == total:
            self.close()

    def began(self, asked: Request, at: Checkpoint) -> None:
        from tqdm import tqdm

        self.close()
        limit = asked.limit
        self._timed = bool(limit.seconds)
        if at.step:
            self.say(f"continuing from step {at.step}")
        self._bar = tqdm(
            total=round(limit.seconds) if self._timed else limit.steps,
            initial=round(at.seconds) if self._timed else at.step,
            desc=asked.method,
            unit="s" if self._timed else "step",
            leave=False,
            disable=None,
        )

    def show(self, status: TrainingStatus) -> None:
        from retarget_bench.training.card_text import hours

        self._bar.update((round(status.seconds) if self._timed else status.step) - self._bar.n)
        losses = _losses(status)
        best = f"best {status.best.score:.2f} at {status.best.step}" if status.best else ""
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
    return ", ".join(f"{split} {each}" for split, each in numbers.items()) + " % of height"


def _how_to_go_on(asked: TrainingOptions) -> str:
    from retarget_bench.training import checkpoint
    from retarget_bench.training.train import folder_of

    if not (folder_of(asked) / checkpoint.NAME).exists():
        return " before the first checkpoint; there is nothing to go on from."
    where = f" --out {asked.out}" if asked.out else ""
    method = f" '{asked.method}'" if asked.method else ""
    return f". bench train{method} --resume{where}{_plugins()} goes on from the last checkpoint."


def _ending(done: TrainingResult) -> str:
    from retarget_bench.training.card_text import hours
    from retarget_bench.training.joint_datasets import tested
    from retarget_bench.training.request import without_places

    method = named.parse(done.asked.method).with_parameters(weights=str(done.folder))
    data = tested(named.parse(done.asked.dataset))
    root = data.parameters.get("root") if data else None
    where = f" --root {shlex.quote(str(root))}" if root else ""
    on = f"'{without_places(str(data))}'{where}" if data else "DATASET"
    best = done.at.best
    found = f"best at step {best.step}: {_scores(best.scores)}" if best else "the last weights are kept"
    return (
        f"{done.asked.method}: {done.at.step} steps in {hours(done.at.seconds)}; {found}.\n"
        f"Use them: bench run '{method}' -d {on}{_plugins()}"
    )


def _plugins() -> str:
    """The plug-in files that were given, as options."""
    return "".join(f" --plugin {shlex.quote(path)}" for path, _ in registry.files())


@click.command("ablate")
@click.argument("method", shell_complete=options.plugin_names("methods"))
@click.argument("table")
@options.dataset_option
@options.root_option
@click.option(
    "--test",
    metavar="DATASET",
    shell_complete=options.plugin_names("datasets"),
    help="The data set to test on. [default: the one that is trained on]",
)
@click.option(
    "--preset", metavar="NAME", default="default", show_default=True, help="Training config of every row."
)
@click.option(
    "--budget",
    metavar="BUDGET",
    help="Budget of every row: 90s, 30m, 2h, or 20000it. [default: the preset's]",
)
@click.option(
    "--seed", type=options.SEED, default=0, show_default=True, metavar="N", help="Seed of every row."
)
@options.device_option
@click.option(
    "--out",
    type=options.FOLDER,
    default="runs/ablate",
    show_default=True,
    metavar="DIR",
    help="The folder of training runs and results.",
)
@options.format_option(*FORMATS)
@options.output_option
@options.jobs_option
def ablate(
    method: str,
    table: str,
    dataset: str,
    root: str | None,
    test: str | None,
    preset: str,
    budget: str | None,
    seed: int,
    device: str,
    out: Path,
    form: str,
    output: Path | None,
    jobs: int,
) -> None:
    """Train and score every row of a published ablation TABLE of METHOD, and print the table.

    All rows have the same data, seed, training config and budget. The same command continues an interrupted
    one, and rows that several tables share are trained once.

    \b
    bench ablate smrm table2 -d puppets --budget 2000it
    bench ablate pan table5 -d 'puppets[size=default]' --test puppets
    """
    from retarget_bench.plugins import registry
    from retarget_bench.python import ablations
    from retarget_bench.tables.rendering import WITH_INTERVALS
    from retarget_bench.training.train import TrainingOptions

    spec = named.parse(method)
    data = registry.canonical("datasets", dataset_spec(dataset, root))
    tested = named.parse(test) if test else data
    ablation = ablations.find(spec, table)
    ablations.check(ablation, tested)
    # "" for no budget of one's own: a folder that was trained under one must not pass for this
    asked = TrainingOptions(spec, data, preset, budget or "", seed, jobs=jobs, device=device)
    with closing(ConsoleReporter()) as reporter:
        trained = ablations.train_rows(ablation, asked, out, reporter)
    wanted = ablations.plan_of(ablation, trained, tested, out / "results", jobs)
    run.carry_out(wanted, "bench ablate")
    recipe = f"preset {preset}, {f'budget {budget}, ' if budget else ''}seed {seed}"
    made = ablations.table(ablation, trained, wanted, bound.dataset(data).built.label.strip(), recipe)
    options.write_out(WITH_INTERVALS[form]([made]), output)
