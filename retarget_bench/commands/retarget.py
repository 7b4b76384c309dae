"""``bench retarget``: a motion in, a motion out. ``bench doctor``: how files are read."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from retarget_bench.commands import editing_options, motion_files, options
from retarget_bench.commands.retargeting import options as retarget_options
from retarget_bench.commands.terminal import echo
from retarget_bench.errors import BenchError
from retarget_bench.files import check_writable

if TYPE_CHECKING:
    from retarget_bench.motion.importer import Imported


@click.command("retarget")
@click.argument("sources", metavar="SOURCE...", nargs=-1, required=True, type=options.PATH)
@retarget_options.target_option
@retarget_options.out_option
@retarget_options.method_option
@retarget_options.fps_option
@motion_files.reading_options()
@motion_files.reading_options("target")
@editing_options.editing_options()
@retarget_options.folder_options
@retarget_options.look_options
@options.seed_option
@retarget_options.quiet_option
def command(
    sources: tuple[Path, ...],
    targets: tuple[Path, ...],
    out: str,
    method: str | None,
    fps: float | None,
    seed: int,
    **asked: Any,
) -> int:
    """Retarget the motion of SOURCE, a motion file, a folder of them or a folder of scans, to another
    character.

    A result of the target file's format keeps all of it: joints, names, channels, unit and axes, in a GLB
    also mesh, materials and other animations. A result of another format is in metres, Y up. bench doctor
    shows how files are read. Joint positions are converted to rotations by a fit, whose residual is
    printed. A line warns where the method is known to be worse than the default one on bodies like these,
    and where the source begins with something else than its motion. Loops stay loops.

    The verdict at the end lists frames to look at: knees and elbows that snap, feet in the floor or
    sliding, joints beyond the source's speed, hands in the body.

    Several sources or targets give OUT/TARGET/SOURCE.ext, of one target OUT/SOURCE.ext, and so does one
    source where OUT is a folder or ends in a slash. The same command again does what is new or has changed,
    and goes on where it was interrupted.

    Scans are mesh or point files, one for each frame (PLY, OBJ, GLB, STL, OFF). The target is then a mesh
    file, and the result a folder of PLY files with its vertices and faces, in metres, Y up. Options of root
    places, roles, start, path and hands are of files with a skeleton.

    \b
    bench retarget walk.bvh --target me.glb -o out.glb --preview out.mp4
    bench retarget mocap/ --target me.glb --target you.bvh -o out/ --jobs 4
    """
    from retarget_bench.commands.retargeting import plan, runs
    from retarget_bench.commands.retargeting.job import Job

    wanted = runs.Wanted(**{each.name: asked.pop(each.name) for each in fields(runs.Wanted)})
    like = Job(sources[0], targets[0], Path(out), method, seed, fps, asked)
    if plan.are_scans(sources, targets):
        return runs.scans(like, wanted)
    if plan.is_many(sources, targets, out):
        return runs.many(sources, targets, like, wanted)
    return runs.one(like, wanted)


@click.command("doctor")
@click.argument("files", nargs=-1, required=True, metavar="FILE...", type=click.Path())
@click.option(
    "--sheet",
    metavar="FILE.png",
    type=options.PATH,
    help="Also draw the body of one FILE at rest, with the roles of its joints.",
)
@motion_files.reading_options()
def doctor(files: tuple[str, ...], sheet: Path | None, root_place: str, **reading: Any) -> int:
    """Say what was found in motion files, and what to override where that is wrong.

    Joints and their roles, unit, up axis, rest pose, frame rate and floor: what every other command goes
    by. The options tell it better, and are the same in bench retarget.
    """
    from retarget_bench.motion.editing import start
    from retarget_bench.motion.importer import load

    if sheet is not None:
        if len(files) > 1 or sheet.suffix.lower() != ".png":
            what = "of one file" if len(files) > 1 else "a .png file"
            raise BenchError(f"--sheet {sheet}: the picture is {what}")
        check_writable(sheet)
    unreadable = 0
    for number, file in enumerate(files):
        try:
            found = load(file, root=root_place, **reading)
            if sheet is not None:
                _draw_roles(sheet, found)
        except BenchError as error:
            echo(f"bench: {error}", err=True)
            unreadable += 1
        else:
            echo(("\n" if number else "") + found.findings.text())
            if (begins := start.find(found.motion)) is not None:
                echo(f"\nIn front of the motion {begins}. In bench retarget:")
                echo(f"  {', or '.join(begins.options)}")
    return 2 if unreadable else 0


def _draw_roles(sheet: Path, found: Imported) -> None:
    from retarget_bench.viewer.clips import write_still
    from retarget_bench.viewer.role_sheet import role_sheet

    write_still(sheet, role_sheet(found))
