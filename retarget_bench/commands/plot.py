"""``bench plot``: charts of results as files, of ``bench run`` and of the tasks."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from retarget_bench.commands import options, plot_attention, plot_options
from retarget_bench.errors import BenchError

if TYPE_CHECKING:
    from retarget_bench.figures.data.model import Figure
    from retarget_bench.motion.character import Character
    from retarget_bench.results.store import ResultPaths

ERROR = "mpjpe_h.world"
RESULTS = "\n\nRESULTS: folders written by `bench run`. [default: runs]"
Make = Callable[[Sequence["ResultPaths"], Sequence[str], dict[str, Any]], "Figure"]
"""From the results that are drawn, the order of all methods and the options of a kind to its charts."""


def _command(
    name: str, told: str, make: Make, *more: Any, task: str = "", splits: bool = True
) -> click.Command:
    """``bench plot NAME``: the results asked for as one figure. more: options of this kind alone. task:
    whose results these are, of retargeting unasked."""

    def drawing(
        roots: tuple[Path, ...],
        output: Path,
        methods: tuple[str, ...],
        dataset: str | None,
        width: str,
        no_title: bool,
        **asked: Any,
    ) -> None:
        from retarget_bench.figures.plotting import canvas
        from retarget_bench.figures.plotting.drawing import draw

        canvas.ending(output)
        if task:
            places = plot_options.task_places(roots, dataset, methods, task)
        else:
            which = asked.pop("splits") if splits else (asked["split"],)
            places = plot_options.places(roots, dataset, methods, which)
        page = plot_options.page(width, no_title, roots)
        draw(output, make(places, list(page.ranked), asked), page)
        click.echo(f"wrote {output}")

    wrapped: Any = drawing
    for option in (
        *more,
        *([options.split_option] if splits and not task else []),
        plot_options.results_options,
    ):
        wrapped = option(wrapped)
    results = RESULTS.replace("bench run", f"bench task {task}") if task else RESULTS
    return click.command(name, help=told + results)(wrapped)


def _value(default: str) -> Any:
    return click.option("--value", default=default, show_default=True, metavar="ID", help="What to draw.")


def _of_value(module: str, kind: str) -> Make:
    """A kind that draws one value, all splits in one figure."""

    def make(places: Sequence[ResultPaths], order: Sequence[str], asked: dict[str, Any]) -> Figure:
        import importlib

        from retarget_bench.results.result_matrix import result_matrices

        data: Any = importlib.import_module(f"retarget_bench.figures.data.{module}")
        found: Figure = getattr(data, kind)(result_matrices(places), **asked, order=order)
        return found

    return make


def _of_levels(kind: str) -> Make:
    """A kind over the levels of a task; what training had and had not is drawn apart."""

    def make(places: Sequence[ResultPaths], order: Sequence[str], asked: dict[str, Any]) -> Figure:
        from retarget_bench.analysis import seen_unseen
        from retarget_bench.figures.data import lines
        from retarget_bench.results.result_matrix import result_matrices

        del asked
        (matrix,) = result_matrices(places)
        found: Figure = getattr(lines, kind)(matrix, seen_unseen.seen_and_unseen(places, "level"), order)
        return found

    return make


def _joints(places: Sequence[ResultPaths], order: Sequence[str], asked: dict[str, Any]) -> Figure:
    from retarget_bench.figures.data import bodies
    from retarget_bench.results.result_matrix import result_matrices

    (found,) = result_matrices(places)
    if asked["dots"]:
        return bodies.joint_rows(found, asked["value"], asked["structure"], order)
    characters = _bodies(places[0], asked["root"])
    return bodies.skeletons([found], asked["value"], characters, asked["structure"], order)


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


COMMANDS = (
    _command(
        "recall",
        "Draw how many foot contacts are kept, over how slow a foot counts as planted (PAN's Figure 7). "
        "Precision is drawn below recall, which alone misleads: a foot that never moves keeps all of "
        "them.",
        _of_value("lines", "recall"),
        click.option(
            "--by-height", is_flag=True, help="Thresholds in heights, which mean the same on every body."
        ),
    ),
    _command(
        "denoise",
        "Draw the error after denoising over the error before (HuMoT's Figure 8). The dotted diagonal is "
        "doing nothing, and what leaves the picture at the top is far worse. Learned methods have two "
        "lines of one colour: full for structures that training had, dashed for others.",
        _of_levels("denoise"),
        task="denoise",
    ),
    _command(
        "upsample",
        "Draw the error over the proportion of joints that are given (HuMoT's Figure 9). Learned methods "
        "have two lines of one colour: full for structures that training had, dashed for others.",
        _of_levels("upsample"),
        task="upsample",
    ),
    _command(
        "joints",
        "Draw errors by joint: a skeleton per method, its joints larger and darker the farther off they "
        "are. The body is one of the targets, in the common reference pose: people from the front, "
        "four-legged bodies from their left; controls are left out. With --dots a row per joint, the worst "
        "at the top, and 95 % intervals.",
        _joints,
        click.option(
            "--root", metavar="DIR", type=click.Path(), help="Where the data set lies, for its bodies."
        ),
        click.option("--dots", is_flag=True, help="A row per joint, with intervals, and no skeleton."),
        click.option("--structure", metavar="NAME", help="Of the targets. [default: that of most cases]"),
        _value("mpjpe_h.joint"),
        click.option(
            "-s", "--split", type=click.Choice(options.SPLITS), default="cross", show_default=True,
            help="Which pairs: self, intra (same structure) or cross (another structure).",
        ),
        splits=False,
    ),
    _command(
        "pairs",
        "Draw errors by source and target: a heat map per method, on one scale. Where there are more than "
        "14 bodies they are taken together by structure.",
        _of_value("bodies", "pairs"),
        _value(ERROR),
    ),
    _command(
        "ties",
        "Draw methods by their means, with intervals, and join those that the data cannot tell apart "
        "(paired sign-flip tests over clips, Holm-corrected for all pairs of methods).",
        _of_value("rows", "ties"),
        _value(ERROR),
    ),
    _command(
        "speed",
        "Draw quality against speed; faint steps join the methods that no other beats in both.",
        _of_value("rows", "speed"),
        _value(ERROR),
    ),
    _command(
        "kinds",
        "Draw errors by kind of performance: a row per kind, a mark per method.",
        _of_value("rows", "kinds"),
        _value(ERROR),
    ),
    _command(
        "clips",
        "Draw how errors are spread over source clips: a box per method, a dot per clip.",
        _of_value("rows", "clips"),
        _value(ERROR),
    ),
    _command(
        "growth",
        "Draw how the error grows over the seconds of a clip.",
        _of_value("lines", "growth"),
        _value("growth.world"),
    ),
)  # fmt: skip


@click.group("plot")
def command() -> None:
    """Draw charts of results, as .png, .pdf or .svg."""


for _each in (*COMMANDS, plot_attention.attention):
    command.add_command(_each)
