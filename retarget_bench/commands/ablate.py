"""``bench ablate``: a published ablation of a method, trained and scored."""

from pathlib import Path
from typing import Any

import click

from retarget_bench.commands import options, planning
from retarget_bench.commands.table import FORMATS


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
    type=click.Path(file_okay=False, path_type=Path),
    default="runs/ablate",
    show_default=True,
    metavar="DIR",
    help="The folder of training runs and results.",
)
@click.option("-f", "--format", "form", type=click.Choice(FORMATS), default="text", show_default=True)
@options.output_option
@options.jobs_option
@options.plugin_option
def command(
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
    from retarget_bench.commands.train import ConsoleReporter
    from retarget_bench.evaluation import plan
    from retarget_bench.plugins import registry
    from retarget_bench.plugins.spec import Spec
    from retarget_bench.tables.rendering import WITH_INTERVALS
    from retarget_bench.training import ablation_runner
    from retarget_bench.training.train import TrainingOptions

    spec = Spec.parse(method)
    data = registry.canonical("datasets", options.dataset_spec(dataset, root))
    tested = Spec.parse(test) if test else data
    ablation = ablation_runner.find(spec, table)
    ablation_runner.check(ablation, tested)
    # "" for no budget of one's own: a folder that was trained under one must not pass for this
    asked = TrainingOptions(spec, data, preset, budget or "", seed, jobs=jobs, device=device)
    reporter: Any = ConsoleReporter()
    try:
        trained = ablation_runner.train_rows(ablation, asked, out, reporter)
    finally:
        reporter.close()
    wanted = ablation_runner.plan_of(ablation, trained, tested, out / "results", jobs)
    planning.carry_out(wanted, "bench ablate")
    found = ablation_runner.numbers_of(wanted, trained)
    on, by = (plan.dataset(each).label.strip() for each in (data, tested))
    recipe = f"preset {preset}, {f'budget {budget}, ' if budget else ''}seed {seed}"
    made = ablation_runner.table(ablation, trained, found, on, by, recipe)
    options.write_out(WITH_INTERVALS[form]([made]), output)
