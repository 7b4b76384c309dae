"""``bench plot``: pictures of results."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from retarget_bench.commands import options
from retarget_bench.errors import BenchError

if TYPE_CHECKING:
    from retarget_bench.records import Place


@click.group("plot")
def command() -> None:
    """Draw pictures of results, as .png, .pdf or .svg."""


@command.command("recall")
@click.argument("roots", nargs=-1, metavar="[RESULTS]...", type=click.Path(path_type=Path))
@click.option("-o", "--output", required=True, type=click.Path(dir_okay=False, path_type=Path))
@click.option("-m", "--method", "methods", multiple=True, metavar="METHOD", help="Only these methods.")
@click.option("-d", "--dataset", help="Only results of this data set (a folder name under RESULTS).")
@options.split_option
@click.option("--by-height", is_flag=True, help="Thresholds in heights, which mean the same on every body.")
def recall(
    roots: tuple[Path, ...],
    output: Path,
    methods: tuple[str, ...],
    dataset: str | None,
    splits: tuple[str, ...],
    by_height: bool,
) -> None:
    """Draw how many foot contacts are kept, over how slow a foot counts as planted (PAN's Figure 7).

    Precision is drawn below recall, which alone says nothing: a foot that never moves keeps every contact.
    RESULTS: folders written by `bench run` with the metric pan_contact. [default: runs]
    """
    from retarget_bench import summary
    from retarget_bench.plotting import canvas
    from retarget_bench.plotting import recall as picture

    canvas.ending(output)
    places = _places(roots or (Path("runs"),), dataset, splits)
    if methods:
        places = _of_methods(places, methods)
    picture.draw(output, summary.sections(places), by_height)
    click.echo(f"wrote {output}")


def _places(roots: Sequence[Path], dataset: str | None, splits: Sequence[str]) -> list[Place]:
    """The results asked for, of one data set. Raises BenchError where there are none, or of several."""
    from retarget_bench import records

    found = [place for root in roots for place in records.find_results(root) if place.split in splits]
    places = [place for place in found if dataset in (None, place.dataset)]
    known = ", ".join(sorted({place.dataset for place in found}))
    if not places:
        where = ", ".join(map(str, roots))
        hint = f"; there are results of {known}" if known else "; bench run makes some"
        raise BenchError(f"no results of {dataset or ', '.join(splits)} in {where}{hint}")
    if len({place.dataset for place in places}) > 1:
        raise BenchError(f"these are results of several data sets: choose one by -d out of {known}")
    return places


def _of_methods(places: Sequence[Place], names: Sequence[str]) -> list[Place]:
    """The results of these methods, in the order of the names. Raises BenchError for an unknown one."""
    from retarget_bench import panel, records, versus

    label_of = {place: str(records.read_header(place.header)["method"]["label"]) for place in places}
    chosen: list[Place] = []
    for name in names:
        label = versus.label_of(name, set(label_of.values()))
        if label is None:
            raise versus.unknown(panel.panels(places), name)
        chosen += [place for place in places if label_of[place] == label and place not in chosen]
    return chosen
