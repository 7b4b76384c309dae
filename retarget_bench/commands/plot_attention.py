"""``bench plot attention``: attention of a learned method."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import click

from retarget_bench.commands import options
from retarget_bench.commands.options import reading_options
from retarget_bench.errors import BenchError
from retarget_bench.plugins import registry

if TYPE_CHECKING:
    from retarget_bench.motion.motion import Motion
    from retarget_bench.plugins.spec import Spec


@click.command("attention")
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
    **reading: str | None,
) -> None:
    """Draw what a learned method attends to in a motion: a heat map on the body, and over time (PAN's
    Figure 8).

    The output's ending chooses: .png, .pdf or .svg, or .csv for the numbers, of all frames or of those
    nearest to --at. --unit, --up, --roles and --root-place are for FILE.
    """
    numbers = output.suffix.lower() == ".csv"
    if not numbers and output.suffix.lower() not in (".png", ".pdf", ".svg"):
        raise BenchError(f"{output}: attention is written as .png, .pdf, .svg or .csv; end the name in one")
    if (case_id is None) == (source is None):
        raise BenchError("say whose motion: the source of --case ID, or --source FILE, and not both")
    times = _times(at)
    from retarget_bench.evaluation import attention as asking
    from retarget_bench.figures.plotting import attention as picture
    from retarget_bench.plugins.spec import Spec

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

    from retarget_bench.evaluation import plan
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
