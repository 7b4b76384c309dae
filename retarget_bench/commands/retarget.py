"""``bench retarget``: a motion in, a motion out."""

from __future__ import annotations

from pathlib import Path

import click

from retarget_bench.commands.declared import takes
from retarget_bench.commands.motion_files import MOTION_FILE, MotionFile
from retarget_bench.commands.retargeting.options import Options


@click.command("retarget")
@click.argument("sources", metavar="SOURCE...", nargs=-1, required=True, type=MOTION_FILE)
@click.option(
    "--target",
    "targets",
    required=True,
    multiple=True,
    metavar="FILE|FOLDER",
    type=MOTION_FILE,
    help="File of the target character, or a folder of such files; may be repeated. For scans its mesh in "
    "T-pose.",
)
@takes(Options)
def command(sources: tuple[MotionFile, ...], targets: tuple[MotionFile, ...], options: Options) -> int:
    """Retarget the motion of SOURCE, a motion file, a folder of them or a folder of scans, to another
    character.

    A result of the target file's format keeps all of it: joints, names, channels, unit and axes, in a GLB
    also mesh, materials and other animations. A result of another format is in metres, Y up. Joint
    positions are converted to rotations by a fit, whose residual is printed. A line warns where the method
    is known to be worse than the default one on bodies like these, and where the source begins with
    something else than its motion. Loops stay loops.

    The verdict at the end lists frames to look at: knees and elbows that snap, feet in the floor or
    sliding, joints beyond the source's speed, hands in the body.

    How a file is read is found from it, and said in brackets where that is wrong, or in a file that bench
    doctor writes, of sources and targets alike; bench doctor --help lists what can be said.

    Several sources or targets give OUT/TARGET/SOURCE.ext, of one target OUT/SOURCE.ext, and so does one
    source where OUT is a folder or ends in a slash. The same command again does what is new or has changed,
    and goes on where it was interrupted.

    Scans are mesh or point files, one for each frame (PLY, OBJ, GLB, STL, OFF). The target is then a mesh
    file, and the result a folder of PLY files with its vertices and faces, in metres, Y up.

    \b
    bench retarget walk.bvh --target me.glb -o out.glb --preview out.mp4
    bench retarget mocap/ --target me.glb --target you.bvh -o out/ --jobs 4
    bench retarget 'walk.bvh[unit=cm,up=z]' --target 'me.glb[reading=me.toml]' -o out.glb
    """
    from retarget_bench.commands.retargeting import plan, runs, scans
    from retarget_bench.commands.retargeting.job import Job

    first = Job(sources[0], targets[0], Path(options.out), options)
    if plan.are_scans(sources, targets):
        return scans.retarget(first)
    if plan.is_many(sources, targets, options.out):
        return runs.many(sources, targets, options)
    return runs.one(first)
