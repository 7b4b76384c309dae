"""``bench retarget``: a motion in, a motion out. ``bench doctor``: how files are read."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from retarget_bench.commands import editing_options, motion_files, options
from retarget_bench.commands.retargeting import options as retarget_options
from retarget_bench.errors import BenchError


@click.command("retarget")
@click.argument("source", metavar="SOURCE", type=options.PATH)
@retarget_options.target_option
@retarget_options.out_option
@retarget_options.method_option
@retarget_options.fps_option
@motion_files.reading_options()
@motion_files.reading_options("target")
@editing_options.editing_options()
@options.seed_option
@options.plugin_option
@retarget_options.quiet_option
def command(
    source: Path,
    target: Path,
    out: Path,
    method: str | None,
    fps: float | None,
    seed: int,
    quiet: bool,
    **asked: Any,
) -> None:
    """Retarget the motion of SOURCE, a BVH, GLB or glTF file or a folder of scans, to another
    character.

    A result of the target file's format keeps all of it: joints, names, channels, unit and axes, in a GLB
    also mesh, materials and other animations. A result of another format is in metres, Y up. bench doctor
    shows how files are read. Joint positions are converted to rotations by a fit, whose residual is
    printed. A line warns where the method is known to be worse than the default one on bodies like these,
    and where the source begins with something else than its motion. Loops stay loops.

    Scans are mesh or point files, one for each frame (PLY, OBJ, GLB, STL, OFF). The target is then a mesh
    file, and the result a folder of PLY files with its vertices and faces, in metres, Y up. Options of root
    places, roles, start, path and hands are of files with a skeleton.
    """
    from retarget_bench.commands.retargeting import job, scans
    from retarget_bench.python.scans import check_pair

    asked_for = job.Job(source, target, out, method, seed, fps, asked)
    (scans if check_pair(source, target) else job).retarget(asked_for, quiet)


@click.command("doctor")
@click.argument("files", nargs=-1, required=True, metavar="FILE...", type=click.Path())
@motion_files.reading_options()
def doctor(files: tuple[str, ...], root_place: str, **reading: Any) -> int:
    """Say what was found in motion files, and what to override where that is wrong.

    Joints and their roles, unit, up axis, rest pose, frame rate and floor: what every other command goes
    by. The options tell it better, and are the same in bench retarget.
    """
    from retarget_bench.motion.importer import load

    unreadable = 0
    for number, file in enumerate(files):
        try:
            text = load(file, root=root_place, **reading).findings.text()
        except BenchError as error:
            click.echo(f"bench: {error}", err=True)
            unreadable += 1
        else:
            click.echo(("\n" if number else "") + text)
    return 2 if unreadable else 0
