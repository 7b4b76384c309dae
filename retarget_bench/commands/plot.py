"""``bench plot``: pictures of results."""

from __future__ import annotations

from pathlib import Path

import click

from retarget_bench.commands import options, plot_attention, plot_options, plot_results, plot_tasks


@click.group("plot")
def command() -> None:
    """Draw pictures of results, as .png, .pdf or .svg."""


for _each in (
    *(plot_tasks.denoise, plot_tasks.upsample),
    *(plot_results.joints, *plot_results.PLAIN),
    plot_attention.attention,
):
    command.add_command(_each)


@command.command("recall")
@plot_options.results_options
@options.split_option
@click.option("--by-height", is_flag=True, help="Thresholds in heights, which mean the same on every body.")
def recall(
    roots: tuple[Path, ...],
    output: Path,
    methods: tuple[str, ...],
    dataset: str | None,
    splits: tuple[str, ...],
    by_height: bool,
    width: str,
    no_title: bool,
) -> None:
    """Draw how many foot contacts are kept, over how slow a foot counts as planted (PAN's Figure 7).

    Precision is drawn below recall, which alone says nothing: a foot that never moves keeps every contact.
    RESULTS: folders written by `bench run` with the metric pan_contact. [default: runs]
    """
    from retarget_bench.analysis import summary
    from retarget_bench.figures.plotting import canvas
    from retarget_bench.figures.plotting import recall as picture

    canvas.ending(output)
    places = plot_options.places(roots, dataset, methods, splits)
    picture.draw(
        output, summary.split_summaries(places), by_height, plot_options.page(width, no_title, roots)
    )
    click.echo(f"wrote {output}")
