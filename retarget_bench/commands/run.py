"""``bench run``, its two stages alone (``bench predict``, ``bench score``), ``bench task``; their plans."""

import json
import shlex
from collections.abc import Sequence
from copy import copy
from pathlib import Path
from typing import Any

import click

from retarget_bench import defaults, files
from retarget_bench.commands import options
from retarget_bench.commands.terminal import echo
from retarget_bench.errors import BenchError, FileError
from retarget_bench.plugins.spec import Spec
from retarget_bench.python.progress import progress_bar

MANIFEST = "manifest.json"
NAMED = 3
"""So many methods at most are named beside a progress bar."""
OVERWRITE = ("never", "missing", "failed", "always")
_SUITE_NAMES = {"split": "splits", "plugin": "plugins", "metrics": "metric", "overwrite": "redo"}


def _read_suite(ctx: click.Context, param: click.Parameter, path: Path | None) -> None:
    """Use a suite file as the defaults of the other options, so that flags win."""
    del param
    if path is not None:
        from retarget_bench.plugins import suite

        settings = {_SUITE_NAMES.get(name, name): value for name, value in suite.read(path).items()}
        ctx.default_map = {**(ctx.default_map or {}), **settings}


suite_option = click.option(
    "--suite",
    metavar="FILE",
    type=click.Path(exists=True, dir_okay=False, path_type=Path),
    is_eager=True,
    expose_value=False,
    callback=_read_suite,
    help="A TOML file with the options of this command; options given here win.",
)


metric_option = click.option(
    "-m",
    "--metric",
    multiple=True,
    metavar="NAME",
    shell_complete=options.plugin_names("metrics"),
    help="Metrics to compute, by name or by a value of theirs (MPJPE), or `default`: those of a plain run; "
    "may be repeated. [default: default]",
)


class _WithOldName(click.Option):
    """An option with a former name, the last one, that is still accepted and no longer shown."""

    def get_help_record(self, ctx: click.Context) -> tuple[str, str] | None:
        record = super().get_help_record(ctx)
        return record and (record[0].replace(f", {self.opts[-1]}", ""), record[1])


overwrite_option = click.option(
    "--overwrite",
    "--redo",
    "redo",
    cls=_WithOldName,
    type=click.Choice(OVERWRITE),
    default="missing",
    show_default=True,
    help="Results to compute. never: none; missing: missing and outdated ones; failed: these and failed "
    "ones; always: all.",
)


def _patterns(ctx: click.Context, param: click.Parameter, given: tuple[str, ...]) -> tuple[str, ...]:
    from retarget_bench.evaluation import clips

    try:
        return clips.patterns(given)
    except BenchError as error:
        raise click.BadParameter(str(error), ctx, param) from error


clip_options = options.together(
    click.option(
        "--clips",
        multiple=True,
        metavar="PATTERN",
        callback=_patterns,
        help="Only clips of these names ('walk*,jump'); may be repeated. A later run without it does the "
        "rest.",
    ),
    click.option(
        "--limit",
        type=click.IntRange(min=1),
        metavar="N",
        help="Only N clips of each split, evenly spread.",
    ),
)


_pairs_option = click.option(
    "--task",
    type=click.Choice(options.RUN_TASKS),
    default=options.RUN_TASKS[0],
    show_default=True,
    help="points: the source is known by points on its surface alone, of data sets with meshes.",
)


common_options = options.together(
    suite_option,
    _pairs_option,
    options.dataset_option,
    options.root_option,
    options.split_option,
    clip_options,
    overwrite_option,
    options.out_option,
    options.jobs_option,
    options.executor_option,
    options.seed_option,
    options.seeds_option,
    options.limit_options,
    options.plugin_option,
)
"""All options of a plan."""


def _show(places: list[Any], root: Path, *, variants: bool, task: str) -> None:
    """The first table, and where there is more, or how to go on where results are not complete.

    task: as ``bench table --task`` takes it.
    """
    from retarget_bench.analysis.selection import Selection
    from retarget_bench.tables import requested
    from retarget_bench.tables.rendering import text

    paired = not places or places[0].task in options.RUN_TASKS
    select = Selection(variants=variants or not paired, apart=paired)
    made = requested.tables(places, requested.Request(select=select))
    echo(text(made, columns=options.screen_width()), nl=False)
    if not all(place.complete for place in places):
        options.say("A run without --clips and --limit does the rest of the cases, then FID and speeds.")
        return
    there = [] if root == Path(defaults.OUT) else [root]
    of = [] if task in ("", options.RUN_TASKS[0]) else ["--task", task]
    columns = [column for table in made for column in table.columns if column.split]
    split = f"-s {columns[0].split}; " if columns else ""
    more = [f"{options.command('bench table', *there, *of)} ({split}--all; --notes)"]
    ranked = [row.label for table in made for group in table.groups for row in group.ranked]
    if len(ranked) > 1 and not of:
        two = " ".join(shlex.quote(label) for label in ranked[:2])
        more.append(options.command("bench compare", two, *(("--results", root) if there else ())))
    options.say(f"More: {', '.join([*more, options.command('bench report', *there)])}.")


@click.command("run")
@options.methods_argument("[METHOD]...")
@common_options
@metric_option
def command(methods: tuple[str, ...], **given: Any) -> None:
    """Run methods on a data set, score them, and print the table.

    With no METHOD: all that are untrained or come with weights. Results are kept; a second run computes
    only what is missing, and an interrupted one goes on where it stopped.
    """
    from retarget_bench.python import plans

    plan = make_plan(methods, **given)
    places = carry_out(plan, "bench run", timed=True)
    _show(plans.existing(places, plan.root), plan.root, variants=bool(methods), task=plan.task)


@click.command("predict")
@options.methods_argument("METHOD...", required=True)
@common_options
def predict(methods: tuple[str, ...], **given: Any) -> None:
    """Write the predictions of methods on a data set; `bench score` scores them later."""
    plan = make_plan(methods, stage="predict", **given)
    for place in carry_out(plan, "bench predict"):
        folder = place.folder / place.method
        echo(f"{sum(1 for _ in folder.glob('*.npz'))} predictions in {folder}")
        if notes := sorted(folder.glob("*.json")):
            first = json.loads(notes[0].read_text(encoding="utf-8"))
            echo(f"  {len(notes)} cases without one; the first: {first['status']}, {first['message']}")
    if plan.clips or plan.limit:
        options.say("These are of some clips; bench predict without --clips and --limit makes the others.")


@click.command("score")
@click.argument("what", nargs=-1, required=True, metavar="METHOD... | FOLDER")
@click.option("--name", metavar="NAME", help="What tables call the folder's method. [default: its name]")
@common_options
@metric_option
def score(what: tuple[str, ...], name: str | None, **given: Any) -> None:
    """Score predictions: those of METHODs made by `bench predict`, or a FOLDER of motions.

    A FOLDER holds one .npz or .bvh per case, named as in the manifest that `bench export-cases` wrote;
    where the manifest lies in the folder, its data set is used, and only splits of which it lists cases.
    """
    from retarget_bench.python import plans

    folder = Path(what[0])
    if folder.is_dir():
        if len(what) > 1:
            raise BenchError("give one folder at a time")
        given |= _manifest(folder, given["splits"])
        given["external"] = folder
        what = (name or files.slug(folder.resolve().name),)
    elif name:
        raise BenchError(f"--name is what a folder's method is called, and {what[0]} is no folder")
    plan = make_plan(what, stage="score", **given)
    _show(
        plans.existing(carry_out(plan, "bench score"), plan.root), plan.root, variants=True, task=plan.task
    )


def _manifest(folder: Path, splits: Sequence[str]) -> dict[str, Any]:
    """The data set that the cases were exported from, and those of the splits asked for, or of all, that
    they are of.

    Raises BenchError where they are of none of them.
    """
    path = folder / MANIFEST
    if not path.exists():
        return {}
    try:
        facts = files.read_json(path)
        dataset, there = str(facts["dataset"]), dict.fromkeys(str(case["split"]) for case in facts["cases"])
    except (KeyError, TypeError) as error:
        raise FileError(path, f"is not a manifest of bench export-cases ({error})") from error
    if not (both := tuple(split for split in there if split in splits or not splits)):
        known = " and ".join(there)
        raise BenchError(f"{path} lists no case of {' or '.join(splits)}; there are those of {known}")
    return {"dataset": dataset, "splits": both}


# derived tasks
@click.group("task")
def task() -> None:
    """Run reconstruction, denoising or joint completion on the motions of a data set.

    The clean motions of any data set are the references. `bench table --task TASK` and `bench plot TASK`
    show the results, which are stored beside those of `bench run`.
    """


_task_options = options.together(
    options.methods_argument("[METHOD]..."),
    click.option(
        "--motions",
        type=click.IntRange(1),
        metavar="N",
        help="At most so many motions, evenly over structures and clips. [default: all]",
    ),
    options.dataset_option,
    options.root_option,
    metric_option,
    overwrite_option,
    options.out_option,
    options.jobs_option,
    options.executor_option,
    options.seed_option,
    options.seeds_option,
    options.limit_options,
    options.plugin_option,
)


@task.command("reconstruct")
@_task_options
def reconstruct(**given: Any) -> None:
    """Reconstruct motions through a method, and measure its loss in centimetres (HuMoT, Table 2).

    With no METHOD: all that take part in a plain run.
    """
    _run_task("reconstruct", None, **given)


@task.command("denoise")
@click.option(
    "--levels", metavar="CM,CM", help="Standard deviations of the noise. [default: 0 to 10, nine levels]"
)
@_task_options
def denoise(levels: str | None, **given: Any) -> None:
    """Denoise positions with Gaussian noise (HuMoT, Figure 8).

    With no METHOD: all that take part in a plain run and can read positions.
    """
    _run_task("denoise", levels, **given)


@task.command("joint-completion")
@click.option(
    "--levels",
    metavar="P,P",
    help="Proportions of joints given, drawn at random, or major: ankles, knees, hips, shoulders, elbows "
    "and wrists. [default: 0.1 to 1 in tenths, and major]",
)
@_task_options
def joint_completion(levels: str | None, **given: Any) -> None:
    """Complete motions of which some joints' positions are given (HuMoT, Figures 9 and 12).

    With no METHOD: all that take part in a plain run and can read positions.
    """
    _run_task("upsample", levels, **given)


_alias = copy(joint_completion)
_alias.hidden = True
for _name in ("joint_completion", "upsample"):
    task.add_command(_alias, _name)


def _run_task(
    name: str, levels: str | None, methods: tuple[str, ...], motions: int | None, **given: Any
) -> None:
    from retarget_bench.evaluation import tasks
    from retarget_bench.python import plans

    spec = str(tasks.canonical(name, levels, motions or 0))
    plan = make_plan(methods, task=spec, **given)
    shown = options.task_name(name)
    places = plans.existing(carry_out(plan, f"bench task {shown}"), plan.root)
    _show(places, plan.root, variants=True, task=shown)


# plans
def make_plan(
    methods: Sequence[str],
    *,
    dataset: str,
    root: str | None,
    out: Path,
    metric: Sequence[str] = (),
    timeout: float | None = None,
    memory: float | None = None,
    isolate: str | None = None,
    limit: int | None = None,
    **others: Any,
) -> Any:
    """A Plan. Without methods or metrics: those that take part in the task by default."""
    from retarget_bench.python import plans

    data = options.dataset_spec(dataset, root)
    others |= {"root": out, "timeout": timeout or 0.0, "memory": memory or 0.0, "limit": limit or 0}
    others["isolate"] = isolate or ""
    return plans.make_plan(list(map(Spec.parse, methods)), [data], metric, _left_out, **others)


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
    return ", ".join(names) if len(names) <= NAMED else f"({len(names)} methods)"
