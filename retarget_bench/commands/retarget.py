"""``bench retarget``: one file in, one file out. ``bench doctor``: how files are read."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from retarget_bench import defaults
from retarget_bench.commands import options
from retarget_bench.errors import BenchError
from retarget_bench.plugins import registry

if TYPE_CHECKING:
    from retarget_bench.motion.importer import Imported
    from retarget_bench.motion.motion import Motion


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
def command(
    source: Path, target: Path, out: Path, method: str, fps: float | None, seed: int, **reading: Any
) -> None:
    """Retarget the motion of SOURCE, a BVH file, to the character of another.

    The result has the target file's joints, names, channels, unit and axes. bench doctor shows how files
    are read. Joint positions are converted to rotations by a fit, whose residual is printed.
    """
    if out.suffix.lower() != ".bvh":
        raise BenchError(f"{out}: the result is a BVH file; give it a name that ends in .bvh")
    for given in (source, target):
        if out.exists() and given.exists() and out.samefile(given):
            raise BenchError(f"{out} would overwrite {given}; choose another name for the result")
    from retarget_bench.motion.bvh import write_like
    from retarget_bench.motion.transfer import correspondence

    performer = options.imported(source, reading, fps=fps)
    body = options.imported(target, reading, "target")
    bodies = (side.motion.character for side in (performer, body))
    if len({each.four_legged for each in bodies}) == 2:
        click.echo(
            "one body has four legs and the other two: what each limb should do is a guess", err=True
        )
    answer = _retargeted(method, performer, body, seed)
    for note in write_like.write(out, answer, body, root=reading["target_root_place"]):
        click.echo(f"{out}: {note}", err=True)
    moved, target_body = performer.motion, body.motion.character
    followed = int((correspondence(moved.character, target_body) >= 0).sum())
    click.echo(
        f"{out}: {moved.frames} frames of {moved.character.name} at {moved.fps:g} per second on the "
        f"body of {target_body.name}, by {method}; {followed} of {len(target_body.skeleton)} joints follow "
        f"it; unit {body.findings.unit[0]}, {body.findings.up} up"
    )


def _retargeted(method: str, performer: Imported, body: Imported, seed: int) -> Motion:
    """The method's answer, with rotations fitted where it has none; raises BenchError with its reason where
    there is no answer."""
    from retarget_bench.api import Case, CaseInfo, Context
    from retarget_bench.evaluation.predict import predict
    from retarget_bench.motion.motion import Motion

    source, target = performer.motion, body.motion.character
    names = (source.character.name, target.name)
    case = Case(CaseInfo("file", "retarget", "cross", *names, clip=names[0]), source, target)
    asked = registry.create("methods", method)
    getattr(asked, "weights_hash", "")  # weights that are not there, or do not fit, are told as such
    outcome = predict(asked, case, Context(seed=seed))
    if outcome.prediction is None:
        raise BenchError(f"{method} gave no motion ({outcome.status}): {outcome.message}")
    if isinstance(outcome.prediction, Motion):
        return outcome.prediction
    from retarget_bench.motion.fitting import fit

    fitted = fit.fit(outcome.prediction)
    click.echo(f"rotations were fitted to positions: {fitted}")
    return fitted.motion


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
