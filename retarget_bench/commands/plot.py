"""``bench plot``: charts of results as files, of ``bench run`` and of the tasks."""

from __future__ import annotations

import difflib
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from retarget_bench.commands import options
from retarget_bench.commands.motion_files import MOTION_FILE, MotionFile
from retarget_bench.commands.terminal import echo
from retarget_bench.errors import BenchError
from retarget_bench.plugins import registry
from retarget_bench.python.plans import dataset_spec

if TYPE_CHECKING:
    from retarget_bench.figures.data.model import Figure
    from retarget_bench.motion.character import Character
    from retarget_bench.motion.motion import Motion
    from retarget_bench.plugins.spec import Spec
    from retarget_bench.results.result_matrix import ResultMatrix
    from retarget_bench.results.store import ResultPaths

ERROR = "mpjpe_h.world"
RESULTS = "\n\nRESULTS: folders written by `bench run`. [default: runs]"
Make = Callable[[Sequence["ResultPaths"], Sequence[str], dict[str, Any]], "Figure"]
"""From the results that are drawn, the order of all methods and the options of a kind to its charts."""


RESULTS_OPTIONS = (
    options.roots_argument,
    click.option(
        "-o", "--output", required=True, type=options.FILE, help="The picture: .pdf, .png or .svg."
    ),
    click.option(
        "--width",
        type=click.Choice(("column", "page")),
        default="page",
        show_default=True,
        help="How wide, in a two-column paper: one column (3.25 inches) or the page (6.75).",
    ),
    click.option("--no-title", is_flag=True, help="Leave the title to the paper's caption."),
    click.option("-m", "--method", "methods", multiple=True, metavar="METHOD", help="Only these methods."),
    options.only_dataset_option,
)

VARIANTS = click.option("--variants", is_flag=True, help="Show variants of methods, too.")


def _command(name: str, told: str, make: Make, *more: Any, task: str = "") -> click.Command:
    """``bench plot NAME``: the results asked for as one figure. more: options of this kind alone. task:
    whose results these are, of retargeting unasked."""

    choice = [] if task else [options.bodies_option, VARIANTS, options.split_option]

    @options.together(*RESULTS_OPTIONS, *choice, *more[::-1])
    def drawing(
        roots: tuple[Path, ...],
        output: Path,
        methods: tuple[str, ...],
        dataset: str | None,
        width: str,
        no_title: bool,
        **asked: Any,
    ) -> None:
        from retarget_bench.figures import method_order
        from retarget_bench.figures.plotting import canvas
        from retarget_bench.figures.plotting.drawing import draw

        canvas.ending(output)
        folders = roots or (Path("runs"),)
        if task:
            places = _task_places(folders, dataset, methods, task)
        else:
            places = _places(folders, dataset, asked.pop("splits"))
            places = method_order.of_methods(places, methods) if methods else places
            asked["variants"] |= bool(methods)
        # colours are by rank among all results, so that they are the same in every picture
        ranked = method_order.ranked(method_order.everything(folders))
        page = canvas.Page(canvas.WIDTHS[width], not no_title, ranked)
        draw(output, make(places, list(ranked), asked), page)
        echo(f"wrote {output}")

    results = RESULTS.replace("bench run", f"bench task {task}") if task else RESULTS
    return click.command(name, help=told + results)(drawing)


def _places(
    roots: Sequence[Path], dataset: str | None, splits: Sequence[str], task: str = "retarget"
) -> list[ResultPaths]:
    """The results asked for, of one data set. Raises BenchError where there are none, or of several."""
    from retarget_bench.analysis.selection import of_dataset
    from retarget_bench.results import dataset_names, store

    found = [place for root in roots for place in store.find_results(root, task)]
    asked = of_dataset(found, dataset) if dataset and found else found
    asked = [place for place in asked if place.split in splits or not splits]
    if not asked:
        there = sorted({f"{place.dataset} ({place.split})" for place in found})
        hint = f"there are those of {', '.join(there)}: choose by -d and -s"
        if not there:
            hint = f"{'bench run' if task == 'retarget' else f'bench task {task}'} makes some"
        where = ", ".join(map(str, roots))
        wanted = dataset or ", ".join(splits)
        raise BenchError(f"no results{f' of {wanted}' if wanted else ''} in {where}; {hint}")
    if len(sets := dataset_names.listed(dataset_names.headers(asked))) > 1:
        raise BenchError(
            f"these are results of several data sets: choose one by -d out of {', '.join(sets)}"
        )
    return asked


def _task_places(
    roots: Sequence[Path], dataset: str | None, methods: Sequence[str], task: str
) -> list[ResultPaths]:
    """The results of a task, of one data set and with the same levels. Raises BenchError otherwise."""
    from retarget_bench.figures import method_order

    found = _places(roots, dataset, (), task)
    if len(folders := sorted({place.task for place in found})) > 1:
        usual = [place for place in found if place.task == task]
        if not usual:
            raise BenchError(
                f"these are results of {task} with several sets of levels or motions "
                f"({', '.join(folders)}): run the one to draw with an --out of its own, and give that"
            )
        found = usual
    return method_order.of_methods(found, methods) if methods else found


# kinds of charts
def _value(default: str) -> Any:
    return click.option("--value", default=default, show_default=True, metavar="ID", help="What to draw.")


def _of_value(module: str, kind: str) -> Make:
    """A kind that draws one value, all splits in one figure."""

    def make(places: Sequence[ResultPaths], order: Sequence[str], asked: dict[str, Any]) -> Figure:
        import importlib

        data: Any = importlib.import_module(f"retarget_bench.figures.data.{module}")
        matrices = _matrices(places, asked.pop("bodies"), asked.pop("variants"))
        if "value" in asked:
            asked["value"] = _value_id(matrices, asked["value"])
        found: Figure = getattr(data, kind)(matrices, **asked, order=order)
        return found

    return make


def _of_levels(kind: str) -> Make:
    """A kind over the levels of a task; what training had and had not is drawn apart."""

    def make(places: Sequence[ResultPaths], order: Sequence[str], asked: dict[str, Any]) -> Figure:
        from retarget_bench.analysis import seen_unseen
        from retarget_bench.analysis.selection import Selection
        from retarget_bench.figures.data import lines
        from retarget_bench.results.result_matrix import result_matrices

        del asked
        (matrix,) = map(_told, Selection(variants=True, apart=False).parts(result_matrices(places)))
        found: Figure = getattr(lines, kind)(matrix, seen_unseen.seen_and_unseen(places, "level"), order)
        return found

    return make


def _joints(places: Sequence[ResultPaths], order: Sequence[str], asked: dict[str, Any]) -> Figure:
    from retarget_bench.figures.data import bodies

    *_, found = _matrices(places, asked["bodies"], asked["variants"])
    value = _value_id([found], asked["value"])
    if asked["dots"]:
        return bodies.joint_rows(found, value, asked["structure"], order)
    characters = _bodies(places[0], asked["root"])
    return bodies.skeletons([found], value, characters, asked["structure"], order)


def _matrices(places: Sequence[ResultPaths], bodies: str | None, variants: bool) -> list[ResultMatrix]:
    """The results between bodies of one group, without variants of methods unless asked, as in tables."""
    from retarget_bench.analysis.selection import Selection, of_bodies
    from retarget_bench.results.result_matrix import result_matrices

    chosen = Selection(variants=variants, apart=False).parts(result_matrices(places))
    return [_told(each) for each in of_bodies(chosen, bodies or "")]


def _told(matrix: ResultMatrix) -> ResultMatrix:
    """The results with what they lack behind the name of their data set."""
    return replace(matrix, dataset=f"{matrix.dataset} ({matrix.so_far})") if matrix.so_far else matrix


def _value_id(matrices: Sequence[ResultMatrix], name: str) -> str:
    """The id that a value's name stands for; an id that no result has is for the chart to answer.

    Raises BenchError for a value of sets.
    """
    from retarget_bench.tables import names

    of_cases, of_sets = names.declared(matrices)
    known = of_cases | of_sets
    found = names.value_id(name, known) if names.candidates(name, known) else name
    if found in of_sets:
        names.check_of_cases(found, of_cases, of_sets)
    return found


def _bodies(place: ResultPaths, root: str | None) -> dict[str, Character]:
    """The characters of the data set that results are of. Raises BenchError where it is not here."""
    from retarget_bench.plugins import bound
    from retarget_bench.plugins.spec import Spec
    from retarget_bench.results import store

    told = store.read_header(place.any_header).dataset
    spec = Spec(told.name, told.parameters)
    try:
        data = bound.dataset(spec if root is None else spec.with_parameters(root=root)).built
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
        "at the top, and 95 % intervals. Of several splits the last is drawn.",
        _joints,
        click.option(
            "--root", metavar="DIR", type=click.Path(), help="Where the data set lies, for its bodies."
        ),
        click.option("--dots", is_flag=True, help="A row per joint, with intervals, and no skeleton."),
        click.option("--structure", metavar="NAME", help="Of the targets. [default: that of most cases]"),
        _value("mpjpe_h.joint"),
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
        "Draw methods by their means, with intervals, and join those that the data cannot tell from the "
        "best, which tables mark as tied.",
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


@click.command("attention")
@click.argument("method", metavar="METHOD", shell_complete=options.plugin_names("methods"))
@click.option("-o", "--output", required=True, type=options.FILE)
@click.option("--case", "case_id", metavar="ID", help="The source of this case of DATASET.")
@click.option("--source", metavar="FILE", type=MOTION_FILE, help="Or this motion file.")
@options.dataset_option
@options.root_option
@click.option("--at", metavar="SECONDS,...", help="When to show the body. [default: five times]")
def attention(
    method: str,
    output: Path,
    case_id: str | None,
    source: MotionFile | None,
    dataset: str,
    root: str | None,
    at: str | None,
) -> None:
    """Draw what a learned method attends to in a motion: a heat map on the body, and over time (PAN's
    Figure 8).

    The output's ending chooses: .png, .pdf or .svg, or .csv for the numbers, of all frames or of those
    nearest to --at. How FILE is read is said behind it: 'walk.bvh[unit=cm]'.
    """
    numbers = output.suffix.lower() == ".csv"
    if not numbers and output.suffix.lower() not in (".png", ".pdf", ".svg"):
        raise BenchError(f"{output}: attention is written as .png, .pdf, .svg or .csv; end the name in one")
    if (case_id is None) == (source is None):
        raise BenchError("say whose motion: the source of --case ID, or --source FILE, and not both")
    times = _times(at)
    from retarget_bench.evaluation import attention as asking
    from retarget_bench.figures.plotting import attention as picture

    spec = named.parse(method).alone
    looked = registry.create("methods", spec)
    if source is not None:
        motion, title = source.load().motion, source.path.name
    else:
        motion, title = _of_case(dataset_spec(dataset, root), str(case_id)), str(case_id)
    found = asking.ask(looked, motion, spec.name)
    frames = asking.frames_at(times, motion)
    if numbers:
        asking.write(output, found, motion, frames or range(motion.frames))
    else:
        picture.draw(
            output, found, motion, frames or picture.spread(motion.frames), f"{spec.name}: {title}"
        )
    echo(f"wrote {output}" + (f"; {found.note}" if found.note else ""))


def _times(text: str | None) -> list[float]:
    """Seconds, from ``0.5,1,2``. Raises BenchError."""
    try:
        return [float(each) for each in (text or "").split(",") if each.strip()]
    except ValueError:
        raise BenchError(
            f"--at takes seconds with commas between them, such as 0.5,1,2; got {text}"
        ) from None


def _of_case(spec: Spec, case_id: str) -> Motion:
    """The source of a case. Raises BenchError where there is no such case, or it has no rotations."""
    from retarget_bench.motion.motion import Motion
    from retarget_bench.plugins import bound

    data = bound.dataset(spec).built
    infos = {info.id: info for split in data.card.splits for info in data.cases("retarget", split)}
    if case_id not in infos:
        near = difflib.get_close_matches(case_id, infos, 3, 0.5) or list(infos)[:3]
        hint = f"near it: {', '.join(near)}" if near else "it has no case at all"
        raise BenchError(f"{data.label} has no case {case_id!r}; {hint}")
    source = data.load(infos[case_id]).source
    if not isinstance(source, Motion):
        raise BenchError(
            f"the source of {case_id} is known by positions only, and has no rotations to attend to"
        )
    return source


@click.group("plot")
def command() -> None:
    """Draw charts of results, as .png, .pdf or .svg."""


for _each in (*COMMANDS, attention):
    command.add_command(_each)
