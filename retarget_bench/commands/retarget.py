"""``bench retarget``: one file in, one file out."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from retarget_bench import defaults
from retarget_bench.commands.options import plugin_names, plugin_option, reading_options, seed_option
from retarget_bench.errors import BenchError
from retarget_bench.plugins import registry

if TYPE_CHECKING:
    from retarget_bench.motion.importer import Imported
    from retarget_bench.motion.motion import Motion


@click.command("retarget")
@click.argument("source", metavar="SOURCE", type=click.Path(path_type=Path))
@click.option(
    "--target",
    required=True,
    metavar="FILE",
    type=click.Path(path_type=Path),
    help="BVH file of the target character.",
)
@click.option(
    "-o", "--out", required=True, metavar="FILE", type=click.Path(path_type=Path), help="Output BVH file."
)
@click.option(
    "-m",
    "--method",
    default=defaults.METHOD,
    show_default=True,
    metavar="METHOD",
    shell_complete=plugin_names("methods"),
    help="The method, with parameters in brackets.",
)
@click.option("--fps", type=click.FloatRange(1, 1000), help="Frames per second. [default: the source's]")
@reading_options()
@reading_options("target")
@seed_option
@plugin_option
def command(
    source: Path,
    target: Path,
    out: Path,
    method: str,
    fps: float | None,
    unit: str,
    up: str,
    root_place: str,
    roles: str | None,
    target_unit: str,
    target_up: str,
    target_root_place: str,
    target_roles: str | None,
    seed: int,
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
    from retarget_bench.motion import importer
    from retarget_bench.motion.bvh import write_like

    performer = importer.load(source, unit=unit, up=up, root=root_place, roles=roles, fps=fps)
    body = importer.load(target, unit=target_unit, up=target_up, root=target_root_place, roles=target_roles)
    for side, option in ((performer, "--"), (body, "--target-")):
        for warning in side.findings.warnings:
            click.echo(f"{side.findings.path}: {warning.replace('--', option)}", err=True)
    bodies = (side.motion.character for side in (performer, body))
    if len({each.four_legged for each in bodies}) == 2:
        click.echo(
            "one body has four legs and the other two: what each limb should do is a guess", err=True
        )
    answer = _retargeted(method, performer, body, seed)
    for note in write_like.write(out, answer, body, root=target_root_place):
        click.echo(f"{out}: {note}", err=True)
    click.echo(_summary(out, method, performer, body))


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


def _summary(out: Path, method: str, performer: Imported, body: Imported) -> str:
    from retarget_bench.motion.transfer import correspondence

    source, target = performer.motion, body.motion.character
    followed = int((correspondence(source.character, target) >= 0).sum())
    found = body.findings
    return (
        f"{out}: {source.frames} frames of {source.character.name} at {source.fps:g} per second on the "
        f"body of {target.name}, by {method}; {followed} of {len(target.skeleton)} joints follow it; "
        f"unit {found.unit[0]}, {found.up} up"
    )
