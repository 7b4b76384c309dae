"""Shared options of ``bench plot``: results, methods, output and page."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click

from retarget_bench.commands import options
from retarget_bench.errors import BenchError

if TYPE_CHECKING:
    from retarget_bench.figures.plotting.canvas import Page
    from retarget_bench.results.store import ResultPaths

F = TypeVar("F", bound=Callable[..., Any])

WIDTHS = ("column", "page")


def output_option(function: F) -> F:
    """``-o/--output FILE`` as the path ``output``."""
    return click.option(
        "-o",
        "--output",
        required=True,
        type=click.Path(dir_okay=False, path_type=Path),
        help="The picture: .pdf, .png or .svg.",
    )(function)


def results_options(function: F) -> F:
    """RESULTS, ``-d``, ``-m`` and ``-o``: which results are drawn, and where; ``page_options`` too."""
    for option in (
        options.only_dataset_option,
        click.option(
            "-m", "--method", "methods", multiple=True, metavar="METHOD", help="Only these methods."
        ),
        page_options,
        output_option,
        click.argument("roots", nargs=-1, metavar="[RESULTS]...", type=click.Path(path_type=Path)),
    ):
        function = option(function)
    return function


def page_options(function: F) -> F:
    """``--width`` and ``--no-title`` as the texts that ``page`` takes."""
    for option in (
        click.option("--no-title", is_flag=True, help="Leave the title to the paper's caption."),
        click.option(
            "--width",
            type=click.Choice(WIDTHS),
            default="page",
            show_default=True,
            help="How wide, in a two-column paper: one column (3.25 inches) or the page (6.75).",
        ),
    ):
        function = option(function)
    return function


def page(width: str, no_title: bool, roots: Sequence[Path]) -> Page:
    """What ``--width`` and ``--no-title`` ask for, with colours by rank among all results in RESULTS."""
    from retarget_bench.figures import method_order
    from retarget_bench.figures.plotting import canvas

    ranked = method_order.ranked(method_order.everything(roots or (Path("runs"),)))
    return canvas.Page(canvas.WIDTHS[width], not no_title, ranked)


def places(
    roots: Sequence[Path],
    dataset: str | None,
    methods: Sequence[str],
    splits: Sequence[str],
    task: str = "retarget",
) -> list[ResultPaths]:
    """The results asked for, of one data set. Raises BenchError where there are none, or of several."""
    from retarget_bench.figures import method_order
    from retarget_bench.results import store

    roots = roots or (Path("runs"),)
    maker = "bench run" if task == "retarget" else f"bench task {task}"
    found = [place for root in roots for place in store.find_results(root, task)]
    asked = [place for place in found if dataset in (None, place.dataset) and place.split in splits]
    known = ", ".join(sorted({place.dataset for place in asked or found}))
    if not asked:
        where = ", ".join(map(str, roots))
        hint = _instead(found, dataset, splits) or f"; {maker} makes some"
        raise BenchError(f"no results of {dataset or ', '.join(splits)} in {where}{hint}")
    if len({place.dataset for place in asked}) > 1:
        raise BenchError(f"these are results of several data sets: choose one by -d out of {known}")
    return method_order.of_methods(asked, methods) if methods else asked


def _instead(found: Sequence[ResultPaths], dataset: str | None, splits: Sequence[str]) -> str:
    """What to ask for instead, to get some of the results that there are."""
    asked = [place for place in found if place.dataset == dataset] or found
    there = sorted({(place.dataset, place.split) for place in asked}, key=lambda each: each[::-1])
    if not there:
        return ""
    ways = [
        " ".join(
            ([f"-d {name}"] if dataset not in (None, name) else [])
            + ([f"-s {split}"] if split not in splits else [])
        )
        for name, split in there
    ]
    told = ", ".join(f"{name} ({split})" for name, split in there)
    return f"; there are results of {told}: ask for them by {' or '.join(dict.fromkeys(ways))}"


def task_places(
    roots: Sequence[Path], dataset: str | None, methods: Sequence[str], task: str
) -> list[ResultPaths]:
    """The results of a task, of one data set and with the same levels. Raises BenchError otherwise."""
    from retarget_bench.figures import method_order

    found = places(roots, dataset, (), ("self",), task)
    if len(folders := sorted({place.task for place in found})) > 1:
        usual = [place for place in found if place.task == task]
        if not usual:
            raise BenchError(
                f"these are results of {task} with several sets of levels or motions "
                f"({', '.join(folders)}): run the one to draw with an --out of its own, and give that"
            )
        found = usual
    return method_order.of_methods(found, methods) if methods else found
