"""``bench plot denoise`` and ``upsample``: pictures of derived tasks."""

from __future__ import annotations

from pathlib import Path

import click

from retarget_bench.commands import plot_options


@click.command("denoise")
@plot_options.results_options
def denoise(
    roots: tuple[Path, ...],
    output: Path,
    methods: tuple[str, ...],
    dataset: str | None,
    width: str,
    no_title: bool,
) -> None:
    """Draw the error after denoising over the error before (HuMoT's Figure 8).

    The dotted diagonal is doing nothing, and what leaves the picture at the top is far worse. Learned
    methods have two lines of one colour: full for structures that training had, dashed for others.
    RESULTS: folders written by `bench task denoise`. [default: runs]
    """
    from retarget_bench.analysis import seen_unseen, summary
    from retarget_bench.figures.plotting import canvas
    from retarget_bench.figures.plotting import denoise as picture

    canvas.ending(output)
    places = plot_options.task_places(roots, dataset, methods, "denoise")
    sections, apart = summary.split_summaries(places, "level"), seen_unseen.seen_and_unseen(places, "level")
    picture.draw(output, sections, apart, plot_options.page(width, no_title, roots))
    click.echo(f"wrote {output}")


@click.command("upsample")
@plot_options.results_options
def upsample(
    roots: tuple[Path, ...],
    output: Path,
    methods: tuple[str, ...],
    dataset: str | None,
    width: str,
    no_title: bool,
) -> None:
    """Draw the error over the proportion of joints that are given (HuMoT's Figure 9).

    Learned methods have two lines of one colour: full for structures that training had, dashed for others.
    RESULTS: folders written by `bench task upsample`. [default: runs]
    """
    from retarget_bench.analysis import seen_unseen, summary
    from retarget_bench.figures.plotting import canvas
    from retarget_bench.figures.plotting import upsample as picture

    canvas.ending(output)
    places = plot_options.task_places(roots, dataset, methods, "upsample")
    sections, apart = summary.split_summaries(places, "level"), seen_unseen.seen_and_unseen(places, "level")
    major = picture.major_share(places)
    picture.draw(output, sections, major, apart, plot_options.page(width, no_title, roots))
    click.echo(f"wrote {output}")
