"""``bench retarget``: a motion in, a motion out. ``bench doctor``: how files are read."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from retarget_bench import defaults
from retarget_bench.commands import motion_files, options
from retarget_bench.errors import BenchError

if TYPE_CHECKING:
    from retarget_bench.motion.importer import Imported


@click.command("retarget")
@click.argument("source", metavar="SOURCE", type=options.PATH)
@click.option(
    "--target",
    required=True,
    metavar="FILE",
    type=options.PATH,
    help="File of the target character; for scans its mesh in T-pose.",
)
@click.option(
    "-o",
    "--out",
    required=True,
    metavar="FILE",
    type=options.PATH,
    help="Output file: .bvh or .glb; for scans a new folder, of PLY files.",
)
@click.option(
    "-m",
    "--method",
    default=None,
    show_default=f"{defaults.METHOD}; for scans {defaults.SCAN_METHOD}",
    metavar="METHOD",
    shell_complete=options.plugin_names("methods"),
    help="The method, with parameters in brackets.",
)
@click.option(
    "--fps",
    type=click.FloatRange(1, 1000),
    help="Frames per second. [default: the source's; of scans 30]",
)
@motion_files.reading_options()
@motion_files.reading_options("target")
@options.seed_option
@options.plugin_option
@click.option("--quiet", is_flag=True, help="Print errors only.")
def command(
    source: Path,
    target: Path,
    out: Path,
    method: str | None,
    fps: float | None,
    seed: int,
    quiet: bool,
    **reading: Any,
) -> None:
    """Retarget the motion of SOURCE, a BVH, GLB, glTF or FBX file or a folder of scans, to
    another character.

    A result of the target file's format keeps all of it: joints, names, channels, unit and axes, in a GLB
    also mesh, materials and other animations. A result of another format is in metres, Y up. bench doctor
    shows how files are read. Joint positions are converted to rotations by a fit, whose residual is
    printed. A line warns where the method is known to be worse than the default one on bodies like these.

    Scans are mesh or point files, one for each frame (PLY, OBJ, GLB, STL, OFF). The target is then a mesh
    file, and the result a folder of PLY files with its vertices and faces, in metres, Y up. Options of root
    places and roles are of files with a skeleton.
    """
    from retarget_bench.python import scans

    if scans.check_pair(source, target):
        _scans(source, target, out, method or defaults.SCAN_METHOD, fps or scans.FPS, seed, quiet, reading)
    else:
        _skeletons(source, target, out, method or defaults.METHOD, fps, seed, quiet, reading)


def _scans(
    source: Path,
    target: Path,
    out: Path,
    method: str,
    fps: float,
    seed: int,
    quiet: bool,
    reading: Mapping[str, Any],
) -> None:
    """A folder of PLY files of scans and a mesh."""
    from retarget_bench.motion.scans.importing import load_body, load_scan
    from retarget_bench.python import scans
    from retarget_bench.python.progress import progress_bar

    scans.check_folder(out)
    for side in ("", "target_"):
        if reading[f"{side}roles"] is not None or reading[f"{side}root_place"] != "auto":
            raise BenchError("roles and root places are of files with a skeleton; scans have no joints")
        if reading[f"{side}rate"] is not None:
            raise BenchError("--rate is of files that state one; the frames of scans are --fps per second")
    body = load_body(target, unit=reading["target_unit"], up=reading["target_up"])
    with progress_bar("reading", "files", not quiet) as progress:
        scan = load_scan(source, unit=reading["unit"], up=reading["up"], fps=fps, progress=progress)
    for findings, option in ((scan.findings, "--"), (body.findings, "--target-")):
        for warning in () if quiet else findings.warnings:
            click.echo(f"{findings.path}: {warning.replace('--', option)}", err=True)
    moved = scans.answer(scan.motion, body.character, method, seed, scan.findings.frames)
    moved.save(out)
    if not quiet:
        click.echo(
            f"{out}: {moved.frames} frames of {source.name} at {fps:g} per second on the mesh of "
            f"{target.name}, by {method}; {source.name}: {scans.facts(scan.findings)}; "
            f"{target.name}: {scans.facts(body.findings)}"
        )


def _skeletons(
    source: Path,
    target: Path,
    out: Path,
    method: str,
    fps: float | None,
    seed: int,
    quiet: bool,
    reading: Mapping[str, Any],
) -> None:
    """A motion file of two motion files."""
    from retarget_bench.motion import files as formats
    from retarget_bench.motion.transfer import correspondence
    from retarget_bench.python import motions

    motions.check_output(out, source, target)
    performer = motion_files.imported(source, reading, fps=fps, quiet=quiet)
    body = motion_files.imported(target, reading, "target", quiet=quiet)
    moved, target_body = performer.motion, motions.imported(body).character
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
    kept = formats.format_of(target) is formats.format_of(out)
    unit, up = (body.findings.unit[0], body.findings.up) if kept else ("m", "y")
    followed = int((correspondence(moved.character, target_body) >= 0).sum())
    click.echo(
        f"{out}: {moved.frames} frames of {moved.character.name} at {moved.fps:g} per second on the "
        f"body of {target_body.name}, by {method}; {followed} of {len(target_body.skeleton)} joints follow "
        f"it; unit {unit}, {up} up"
    )


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
    from retarget_bench.motion.importer import load

    if sheet is not None and (len(files) > 1 or sheet.suffix.lower() != ".png"):
        what = "of one file" if len(files) > 1 else "a .png file"
        raise BenchError(f"--sheet {sheet}: the picture is {what}")
    unreadable = 0
    for number, file in enumerate(files):
        try:
            found = load(file, root=root_place, **reading)
            if sheet is not None:
                _draw_roles(sheet, found)
        except BenchError as error:
            click.echo(f"bench: {error}", err=True)
            unreadable += 1
        else:
            click.echo(("\n" if number else "") + found.findings.text())
    return 2 if unreadable else 0


def _draw_roles(sheet: Path, found: Imported) -> None:
    from retarget_bench.viewer.clips import write_still
    from retarget_bench.viewer.role_sheet import role_sheet

    write_still(sheet, role_sheet(found))
