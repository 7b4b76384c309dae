"""``bench retarget``: one file in, one file out. ``bench doctor``: how files are read."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from retarget_bench import defaults
from retarget_bench.commands import options
from retarget_bench.errors import BenchError


@click.command("retarget")
@click.argument("source", metavar="SOURCE", type=options.PATH)
@click.option(
    "--target", required=True, metavar="FILE", type=options.PATH, help="BVH file of the target character."
)
@click.option("-o", "--out", required=True, metavar="FILE", type=options.PATH, help="Output BVH file.")
@click.option(
    "-m",
    "--method",
    default=defaults.METHOD,
    show_default=True,
    metavar="METHOD",
    shell_complete=options.plugin_names("methods"),
    help="The method, with parameters in brackets.",
)
@click.option("--fps", type=click.FloatRange(1, 1000), help="Frames per second. [default: the source's]")
@options.reading_options()
@options.reading_options("target")
@options.seed_option
@options.plugin_option
@click.option("--quiet", is_flag=True, help="Print errors only.")
def command(
    source: Path,
    target: Path,
    out: Path,
    method: str,
    fps: float | None,
    seed: int,
    quiet: bool,
    **reading: Any,
) -> None:
    """Retarget the motion of SOURCE, a BVH file, to the character of another.

    The result has the target file's joints, names, channels, unit and axes. bench doctor shows how files
    are read. Joint positions are converted to rotations by a fit, whose residual is printed. A line warns
    where the method is known to be worse than the default one on bodies like these.
    """
    from retarget_bench.motion.transfer import correspondence
    from retarget_bench.python import motions

    motions.check_output(out, source, target)
    performer = options.imported(source, reading, fps=fps, quiet=quiet)
    body = options.imported(target, reading, "target", quiet=quiet)
    moved, target_body = performer.motion, motions.imported(body, reading["target_root_place"]).character
    answer = motions.answer(moved, target_body, method, seed)
    lost = motions.write(out, answer)
    if quiet:
        return
    for caution in motions.cautions(method, moved.character, target_body):
        click.echo(f"bench: {caution}", err=True)
    for note in answer.notes:
        click.echo(note)
    for note in lost:
        click.echo(f"{out}: {note}", err=True)
    followed = int((correspondence(moved.character, target_body) >= 0).sum())
    click.echo(
        f"{out}: {moved.frames} frames of {moved.character.name} at {moved.fps:g} per second on the "
        f"body of {target_body.name}, by {method}; {followed} of {len(target_body.skeleton)} joints follow "
        f"it; unit {body.findings.unit[0]}, {body.findings.up} up"
    )


@click.command("doctor")
@click.argument("files", nargs=-1, required=True, metavar="FILE...", type=click.Path())
@options.reading_options()
def doctor(files: tuple[str, ...], unit: str, up: str, root_place: str, roles: str | None) -> int:
    """Say what was found in motion files, and what to override where that is wrong.

    Joints and their roles, unit, up axis, rest pose, frame rate and floor: what every other command goes
    by. The options tell it better, and are the same in bench retarget.
    """
    from retarget_bench.motion.importer import load

    unreadable = 0
    for number, file in enumerate(files):
        try:
            text = load(file, unit=unit, up=up, root=root_place, roles=roles).findings.text()
        except BenchError as error:
            click.echo(f"bench: {error}", err=True)
            unreadable += 1
        else:
            click.echo(("\n" if number else "") + text)
    return 2 if unreadable else 0
