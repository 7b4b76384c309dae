"""``bench run``: methods on a data set, scored, as a table. ``bench score``: predictions made elsewhere."""

import json
import shlex
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import click

from retarget_bench import defaults, files
from retarget_bench.commands import echo
from retarget_bench.commands.options import plugin_names, say, screen_width, takes, unbroken
from retarget_bench.commands.suite import read_suite
from retarget_bench.errors import BenchError, FileError
from retarget_bench.evaluation.settings import Stage
from retarget_bench.options import listed, option
from retarget_bench.plugins import named
from retarget_bench.python.progress import progress_bar
from retarget_bench.python.run_options import RunOptions

MANIFEST = "manifest.json"
MOST_NAMES = 3
"""So many methods at most are named beside a progress bar."""


class Options(RunOptions):
    """``bench run``."""

    stage: Stage = option(
        "Both stages, or one alone: predict writes predictions, score scores them.", default="run"
    )


def _used(ctx: click.Context, param: click.Parameter, path: Path | None) -> None:
    """Use a suite file as the defaults of the other options, so that options of the command line win."""
    del param
    if path is not None:
        ctx.default_map = {**(ctx.default_map or {}), **read_suite(path)}


@click.command("run")
@click.argument("methods", nargs=-1, metavar="[METHOD]...", shell_complete=plugin_names("methods"))
@click.option(
    "--suite",
    metavar="FILE",
    type=click.Path(exists=True, dir_okay=False, path_type=Path),
    is_eager=True,
    expose_value=False,
    callback=_used,
    help="A TOML file with options of this command in the same words (bench info suite: its JSON schema); "
    "options given here win.",
)
@takes(Options, "methods")
def command(options: Options) -> None:
    """Run methods on a data set, score them, and print the table.

    METHOD is a name, with parameters in brackets and post-processors behind a +, or the file of your own
    (my_method.py). With no METHOD: all that are untrained or come with weights. Results are kept; a second
    run computes only what is missing, and an interrupted one goes on where it stopped.
    """
    from retarget_bench.python import plans

    plan = plans.plan_of(options, _left_out, stage=options.stage)
    places = carry_out(plan, "bench run", timed=plan.stage == "run")
    if plan.stage == "predict":
        _say_predictions(places, plan)
    else:
        places = plans.existing(places, plan.out)
        _show(places, plan.out, variants=bool(options.methods))


def _say_predictions(places: Sequence[Any], plan: Any) -> None:
    for place in places:
        folder = place.folder / place.method
        echo(f"{sum(1 for _ in folder.glob('*.npz'))} predictions in {folder}")
        if notes := sorted(folder.glob("*.json")):
            first = json.loads(notes[0].read_text(encoding="utf-8"))
            echo(f"  {len(notes)} cases without one; the first: {first['status']}, {first['message']}")
    if plan.clips or plan.limit:
        say("These are of some clips; a run without --clips and --limit makes the others.")


def _show(places: list[Any], out: Path, *, variants: bool) -> None:
    """The first table, and where there is more, or how to go on where results are not complete."""
    from retarget_bench.tables import requested
    from retarget_bench.tables.rendering import text

    task = places[0].kind
    tables = requested.tables(places, requested.Request(variants=variants))
    echo(text(tables, columns=screen_width()), nl=False)
    if not all(place.complete for place in places):
        say("A run without --clips and --limit does the rest of the cases, then path fits, FID and speeds.")
        return
    there = [] if out == Path(defaults.OUT) else ["-r", out]
    of = [] if task == defaults.TASK else ["--task", task]
    columns = [column for table in tables for column in table.columns if column.split]
    split = f"-s {columns[0].split}; " if columns else ""
    more = [f"{unbroken('bench table', *there, *of)} ({split}--all; --notes)"]
    ranked = [row.label for table in tables for group in table.groups for row in group.ranked]
    if len(ranked) > 1 and not of:
        two = " ".join(shlex.quote(label) for label in ranked[:2])
        more.append(unbroken("bench compare", two, *there))
    say(f"More: {', '.join([*more, unbroken('bench report', *there)])}.")


_SCORED_WITH = ("dataset", "root", "splits", "metrics", "task", "overwrite", "out", "jobs")


@click.command("score")
@click.argument("folder", type=click.Path(exists=True, file_okay=False, path_type=Path))
@click.option("--name", metavar="NAME", help="What tables call the method. [default: the folder's name]")
@takes(RunOptions, only=_SCORED_WITH)
def score(folder: Path, name: str | None, options: RunOptions) -> None:
    """Score predictions that another program made: a FOLDER of motions.

    It holds one .npz or .bvh per case, named as in the manifest that `bench export --questions` wrote;
    where the manifest lies in the folder, its data set is used, and only splits of which it lists cases.
    """
    from dataclasses import replace

    from retarget_bench.python import plans

    named.parse(options.dataset)  # a manifest has the name of a data set, which may be that of a file
    name = name or files.slug(folder.resolve().name)
    options = replace(options, methods=name, **_manifest(folder, listed(options.splits)))
    plan = plans.plan_of(options, _left_out, stage="score", external=folder)
    _show(plans.existing(carry_out(plan, "bench score"), plan.out), plan.out, variants=True)


def _manifest(folder: Path, splits: Sequence[str]) -> dict[str, Any]:
    """The data set of an export, and its splits, or those of them that were requested.

    Raises BenchError where none of the requested splits has a case.
    """
    path = folder / MANIFEST
    if not path.exists():
        return {}
    try:
        facts = files.read_json(path)
        dataset, there = str(facts["dataset"]), dict.fromkeys(str(case["split"]) for case in facts["cases"])
    except (KeyError, TypeError) as error:
        raise FileError(path, f"is not a manifest of bench export ({error})") from error
    if not (both := tuple(split for split in there if split in splits or not splits)):
        known = " and ".join(there)
        raise BenchError(f"{path} lists no case of {' or '.join(splits)}; there are those of {known}")
    return {"dataset": dataset, "splits": both}


def _left_out(problem: str) -> None:
    echo(f"bench: left out: {problem}", err=True)


def carry_out(plan: Any, what: str, *, timed: bool = False) -> list[Any]:
    """Run a plan under a progress bar (elsewhere a line a minute) that names the methods, which answer in
    turns; returns the places of its results."""
    from retarget_bench.evaluation import runner

    with progress_bar(f"{what} {_named(plan)}", "answers") as progress:
        return runner.run(plan, progress, timed=timed)


def _named(plan: Any) -> str:
    """The methods of a plan; their number where they are many."""
    names = list(map(str, plan.methods))
    return ", ".join(names) if len(names) <= MOST_NAMES else f"({len(names)} methods)"
