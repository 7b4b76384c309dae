"""``bench score``: the second stage alone, also for predictions of other programs."""

import json
from pathlib import Path
from typing import Any

import click

from retarget_bench.commands import planning
from retarget_bench.errors import BenchError, FileError

MANIFEST = "manifest.json"


@click.command("score")
@click.argument("what", nargs=-1, required=True, metavar="METHOD... | FOLDER")
@click.option("--name", metavar="NAME", help="What tables call the folder's method. [default: its name]")
@planning.common_options
@planning.metric_option
def command(what: tuple[str, ...], name: str | None, **given: Any) -> None:
    """Score predictions: those of METHODs made by `bench predict`, or a FOLDER of motions.

    A FOLDER holds one .npz or .bvh per case, named as in the manifest that `bench export-cases` wrote;
    where the manifest lies in the folder, its data set is used.
    """
    from retarget_bench.analysis import summary
    from retarget_bench.tables import builder
    from retarget_bench.tables.rendering import text

    folder = Path(what[0])
    if folder.is_dir():
        if len(what) > 1:
            raise BenchError("give one folder at a time")
        given |= _manifest(folder)
        given["external"] = folder
        what = (name or _label(folder),)
    elif name:
        raise BenchError(f"--name is what a folder's method is called, and {what[0]} is no folder")
    plan = planning.make_plan(what, stage="score", **given)
    places = planning.carry_out(plan, "bench score")
    found = summary.split_summaries(place for place in places if place.header.exists())
    click.echo(text(builder.tables(found)), nl=False)


def _label(folder: Path) -> str:
    from retarget_bench.files import slug

    return slug(folder.resolve().name)


def _manifest(folder: Path) -> dict[str, Any]:
    """The data set that the cases were exported from."""
    path = folder / MANIFEST
    if not path.exists():
        return {}
    try:
        facts = json.loads(path.read_text(encoding="utf-8"))
        return {"dataset": str(facts["dataset"])}
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise FileError(path, f"is not a manifest of bench export-cases ({error})") from error
