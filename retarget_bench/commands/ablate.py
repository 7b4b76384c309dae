"""``bench ablate``: a published table of a method's variants, trained and run here."""

from __future__ import annotations

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
@click.option("--preset", metavar="NAME", default="default", show_default=True, help="Every row's recipe.")
@click.option(
    "--budget", metavar="BUDGET", help="Of every row: 90s, 30m, 2h, or 20000it. [default: the preset's]"
)
@click.option("--seed", type=options.SEED, default=0, show_default=True, metavar="N", help="Every row's.")
@click.option(
    "--device", type=click.Choice(("cpu", "cuda", "auto")), default="auto", show_default=True, help="Where."
)
@click.option(
    "--out",
    type=click.Path(file_okay=False, path_type=Path),
    default="runs/ablate",
    show_default=True,
    metavar="DIR",
    help="The folder of training runs and results.",
)
@click.option("-f", "--format", "form", type=click.Choice(FORMATS), default="text", show_default=True)
@click.option("-o", "--output", type=click.Path(dir_okay=False, path_type=Path), help="Write to this file.")
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
    plugins: tuple[str, ...],
) -> None:
    """Train every row of a published TABLE of METHOD's variants, run them, and print it with our numbers.

    All rows have the same data, seed, recipe and budget. What is done is kept: the same command goes on
    where it was interrupted, and rows that tables share are trained once.

    \b
    bench ablate smrm table2 -d puppets --budget 2000it
    bench ablate pan table5 -d 'puppets[size=default]' --test puppets
    """
    del plugins
    from retarget_bench import files
    from retarget_bench.commands.train import ConsoleReporter
    from retarget_bench.evaluation import plan
    from retarget_bench.plugins import registry
    from retarget_bench.plugins.spec import Spec
    from retarget_bench.tables.rendering import WITH_INTERVALS
    from retarget_bench.training import ablating
    from retarget_bench.training.train import TrainingOptions

    spec = Spec.parse(method)
    data = registry.canonical("datasets", options.dataset_spec(dataset, root))
    tested = Spec.parse(test) if test else data
    ablation = ablating.find(spec, table)
    ablating.check(ablation, tested)
    # "" for no budget of one's own: a folder that was trained under one must not pass for this
    asked = TrainingOptions(spec, data, preset, budget or "", seed, jobs=jobs, device=device)
    reporter: Any = ConsoleReporter()
    try:
        trained = ablating.train_rows(ablation, asked, out, reporter)
    finally:
        reporter.close()
    wanted = ablating.plan_of(ablation, trained, tested, out / "results", jobs)
    planning.carry_out(wanted, "bench ablate")
    found = ablating.numbers_of(wanted, trained)
    on, by = (plan.dataset(each).label.strip() for each in (data, tested))
    recipe = f"preset {preset}, {f'budget {budget}, ' if budget else ''}seed {seed}"
    made = ablating.table(ablation, trained, found, ablating.AblationFacts(on, by, recipe))
    written = WITH_INTERVALS[form]([made])
    if output is None:
        click.echo(written, nl=False)
    else:
        files.write_text(output, written)
        click.echo(f"wrote {output}")
