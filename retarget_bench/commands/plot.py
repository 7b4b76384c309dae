"""``bench plot``: pictures of results."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click

from retarget_bench import registry
from retarget_bench.commands import options
from retarget_bench.commands.reading import reading_options
from retarget_bench.errors import BenchError

if TYPE_CHECKING:
    from retarget_bench.motion.motion import Motion
    from retarget_bench.records import Place
    from retarget_bench.spec import Spec


F = TypeVar("F", bound=Callable[..., Any])


@click.group("plot")
def command() -> None:
    """Draw pictures of results, as .png, .pdf or .svg."""


def _task_options(function: F) -> F:
    """Which results of a task are drawn, and where."""
    for option in (
        click.option(
            "-d", "--dataset", help="Only results of this data set (a folder name under RESULTS)."
        ),
        click.option(
            "-m", "--method", "methods", multiple=True, metavar="METHOD", help="Only these methods."
        ),
        click.option("-o", "--output", required=True, type=click.Path(dir_okay=False, path_type=Path)),
        click.argument("roots", nargs=-1, metavar="[RESULTS]...", type=click.Path(path_type=Path)),
    ):
        function = option(function)
    return function


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


@command.command("denoise")
@_task_options
def denoise(roots: tuple[Path, ...], output: Path, methods: tuple[str, ...], dataset: str | None) -> None:
    """Draw the error after denoising over the error before (HuMoT's Figure 8).

    The dotted diagonal is doing nothing, and what leaves the picture at the top is far worse.
    RESULTS: folders written by `bench task denoise`. [default: runs]
    """
    from retarget_bench import summary
    from retarget_bench.plotting import canvas
    from retarget_bench.plotting import denoise as picture

    canvas.ending(output)
    places = _task_places(roots, dataset, methods, "denoise")
    picture.draw(output, summary.sections(places, "level"))
    click.echo(f"wrote {output}")


@command.command("upsample")
@_task_options
def upsample(roots: tuple[Path, ...], output: Path, methods: tuple[str, ...], dataset: str | None) -> None:
    """Draw the error over the proportion of joints that are given (HuMoT's Figure 9).

    RESULTS: folders written by `bench task upsample`. [default: runs]
    """
    from retarget_bench import summary
    from retarget_bench.plotting import canvas
    from retarget_bench.plotting import upsample as picture

    canvas.ending(output)
    places = _task_places(roots, dataset, methods, "upsample")
    picture.draw(output, summary.sections(places, "level"), picture.major_share(places))
    click.echo(f"wrote {output}")


def _task_places(
    roots: Sequence[Path], dataset: str | None, methods: Sequence[str], task: str
) -> list[Place]:
    """The results of a task, of one data set and with the same levels. Raises BenchError otherwise."""
    places = _places(roots or (Path("runs"),), dataset, ("self",), task)
    if len(folders := sorted({place.task for place in places})) > 1:
        usual = [place for place in places if place.task == task]
        if not usual:
            raise BenchError(
                f"these are results of {task} with several sets of levels or motions "
                f"({', '.join(folders)}): run the one to draw with an --out of its own, and give that"
            )
        places = usual
    return _of_methods(places, methods) if methods else places


def _places(
    roots: Sequence[Path], dataset: str | None, splits: Sequence[str], task: str = "retarget"
) -> list[Place]:
    """The results asked for, of one data set. Raises BenchError where there are none, or of several."""
    from retarget_bench import records

    maker = "bench run" if task == "retarget" else f"bench task {task}"
    found = [place for root in roots for place in records.find_results(root, task) if place.split in splits]
    places = [place for place in found if dataset in (None, place.dataset)]
    known = ", ".join(sorted({place.dataset for place in found}))
    if not places:
        where = ", ".join(map(str, roots))
        hint = f"; there are results of {known}" if known else f"; {maker} makes some"
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


@command.command("attention")
@click.argument("method", metavar="METHOD", shell_complete=options.plugin_names("methods"))
@click.option("-o", "--output", required=True, type=click.Path(dir_okay=False, path_type=Path))
@click.option("--case", "case_id", metavar="ID", help="The source of this case of DATASET.")
@click.option("--source", metavar="FILE", type=click.Path(path_type=Path), help="Or this BVH file.")
@options.dataset_option
@options.root_option
@click.option("--at", metavar="SECONDS,...", help="When to show the body. [default: five times]")
@reading_options()
@options.plugin_option
def attention(
    method: str,
    output: Path,
    case_id: str | None,
    source: Path | None,
    dataset: str,
    root: str | None,
    at: str | None,
    plugins: tuple[str, ...],
    **reading: str | None,
) -> None:
    """Draw what a learned method attends to in a motion: a heat map on the body, and over time (PAN's
    Figure 8).

    The output's ending chooses: .png, .pdf or .svg, or .csv for the numbers, of all frames or of those
    nearest to --at. --unit, --up, --roles and --root-place are for FILE.
    """
    del plugins
    numbers = output.suffix.lower() == ".csv"
    if not numbers and output.suffix.lower() not in (".png", ".pdf", ".svg"):
        raise BenchError(f"{output}: attention is written as .png, .pdf, .svg or .csv; end the name in one")
    if (case_id is None) == (source is None):
        raise BenchError("say whose motion: the source of --case ID, or --source FILE, and not both")
    times = _times(at)
    from retarget_bench import attention as asking
    from retarget_bench.plotting import attention as picture
    from retarget_bench.spec import Spec

    spec = Spec.parse(method).alone
    looked = registry.create("methods", spec)
    if source is not None:
        motion, title = _from_file(source, reading), source.name
    else:
        motion, title = _of_case(options.dataset_spec(dataset, root), str(case_id)), str(case_id)
    found = asking.ask(looked, motion, spec.name)
    frames = asking.frames_at(times, motion)
    if numbers:
        asking.write(output, found, motion, frames or range(motion.frames))
    else:
        picture.draw(
            output, found, motion, frames or picture.spread(motion.frames), f"{spec.name}: {title}"
        )
    click.echo(f"wrote {output}" + (f"; {found.note}" if found.note else ""))


def _times(text: str | None) -> list[float]:
    """Seconds, from ``0.5,1,2``. Raises BenchError."""
    try:
        return [float(each) for each in (text or "").split(",") if each.strip()]
    except ValueError:
        raise BenchError(
            f"--at takes seconds with commas between them, such as 0.5,1,2; got {text}"
        ) from None


def _from_file(path: Path, reading: Mapping[str, str | None]) -> Motion:
    from retarget_bench.motion import importer

    unit, up, root = (str(reading[name]) for name in ("unit", "up", "root_place"))
    performer = importer.load(path, unit=unit, up=up, root=root, roles=reading["roles"])
    for warning in performer.findings.warnings:
        click.echo(f"{path}: {warning}", err=True)
    return performer.motion


def _of_case(spec: Spec, case_id: str) -> Motion:
    """The source of a case. Raises BenchError where there is no such case, or it has no rotations."""
    import difflib

    from retarget_bench import plan
    from retarget_bench.motion.motion import Motion

    data = plan.dataset(registry.canonical("datasets", spec))
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
