"""``bench plot joints``, ``pairs``, ``ties``, ``speed``, ``kinds``, ``growth``: plain results."""

from __future__ import annotations

import importlib
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from retarget_bench.commands import options, plot_options
from retarget_bench.errors import BenchError

if TYPE_CHECKING:
    from retarget_bench.motion.character import Character
    from retarget_bench.results.store import ResultPaths

ERROR = "mpjpe_h.world"
RESULTS = "\n\nRESULTS: folders written by `bench run`. [default: runs]"


def _command(name: str, value: str, told: str) -> click.Command:
    """``bench plot NAME``: all splits asked for in one picture, of one value."""

    @click.command(name, help=told + RESULTS)
    @plot_options.results_options
    @options.split_option
    @click.option("--value", default=value, show_default=True, metavar="ID", help="What to draw.")
    def drawing(
        roots: tuple[Path, ...],
        output: Path,
        methods: tuple[str, ...],
        dataset: str | None,
        splits: tuple[str, ...],
        value: str,
        width: str,
        no_title: bool,
    ) -> None:
        from retarget_bench.figures.plotting import canvas
        from retarget_bench.results.result_matrix import result_matrices

        canvas.ending(output)
        picture: Any = importlib.import_module(f"retarget_bench.figures.plotting.{name}")
        found = result_matrices(plot_options.places(roots, dataset, methods, splits))
        picture.draw(output, found, value, plot_options.page(width, no_title, roots))
        click.echo(f"wrote {output}")

    return drawing


PLAIN = (
    _command(
        "pairs",
        ERROR,
        "Draw errors by source and target: a heat map per method, on one scale. Where there are more than "
        "14 bodies they are taken together by structure.",
    ),
    _command(
        "ties",
        ERROR,
        "Draw methods by their means, with intervals, and join those that the data cannot tell apart "
        "(paired sign-flip tests over clips, Holm-corrected for all pairs of methods).",
    ),
    _command(
        "speed",
        ERROR,
        "Draw quality against speed; faint steps join the methods that no other beats in both.",
    ),
    _command("kinds", ERROR, "Draw errors by kind of performance: a row per kind, a mark per method."),
    _command("growth", "growth.world", "Draw how the error grows over the seconds of a clip."),
)


@click.command("joints")
@plot_options.results_options
@click.option(
    "-s",
    "--split",
    type=click.Choice(options.SPLITS),
    default="cross",
    show_default=True,
    help="Which pairs: self, intra (same structure) or cross (another structure).",
)
@click.option("--value", default="mpjpe_h.joint", show_default=True, metavar="ID", help="What to draw.")
@click.option("--structure", metavar="NAME", help="Of the targets. [default: that of most cases]")
@click.option("--dots", is_flag=True, help="A row per joint, with intervals, and no skeleton.")
@click.option("--root", metavar="DIR", type=click.Path(), help="Where the data set lies, for its bodies.")
def joints(
    roots: tuple[Path, ...],
    output: Path,
    methods: tuple[str, ...],
    dataset: str | None,
    split: str,
    value: str,
    structure: str | None,
    dots: bool,
    root: str | None,
    width: str,
    no_title: bool,
) -> None:
    """Draw errors by joint: a skeleton per method, its joints larger and darker the farther off they are.

    The body is one of the targets, in the common reference pose: people from the front, four-legged bodies
    from their left. With --dots a row per joint, the worst at the top, and 95 % intervals.
    RESULTS: folders written by `bench run`. [default: runs]
    """
    from retarget_bench.figures.plotting import canvas
    from retarget_bench.figures.plotting import joints as picture
    from retarget_bench.results.result_matrix import result_matrices

    canvas.ending(output)
    places = plot_options.places(roots, dataset, methods, (split,))
    (found,) = result_matrices(places)
    bodies = None if dots else _bodies(places[0], root)
    picture.draw(output, found, value, bodies, structure, plot_options.page(width, no_title, roots))
    click.echo(f"wrote {output}")


def _bodies(place: ResultPaths, root: str | None) -> dict[str, Character]:
    """The characters of the data set that results are of. Raises BenchError where it is not here."""
    from retarget_bench.evaluation import plan
    from retarget_bench.plugins import registry
    from retarget_bench.plugins.spec import Spec
    from retarget_bench.results import store

    told = store.read_header(place.header).dataset
    spec = Spec(told.name, told.parameters)
    try:
        data = plan.dataset(
            registry.canonical("datasets", spec if root is None else spec.with_parameters(root=root))
        )
        return dict(data.characters())
    except BenchError as error:
        raise BenchError(
            f"{error}; the skeletons are the data set's, and --dots draws without them"
        ) from error
