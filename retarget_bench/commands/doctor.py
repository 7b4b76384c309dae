"""``bench doctor``: how files are read, and a reading as a file that is corrected and passed back;
without a file the installation."""

from __future__ import annotations

import json
import textwrap
from functools import partial
from pathlib import Path

import click

from retarget_bench.commands import echo
from retarget_bench.commands.motion_files import MOTION_FILE, MotionFile
from retarget_bench.commands.options import screen_width
from retarget_bench.errors import BenchError
from retarget_bench.files import check_writable, digest, write_text
from retarget_bench.motion.files.reading import Reading
from retarget_bench.motion.findings import NO_ROLE
from retarget_bench.motion.importer import Imported
from retarget_bench.options import declared

_READING = "\n".join(f"{name}: {each.help}" for name, each in declared(Reading).items())


@click.command("doctor", epilog=f"What can be said in brackets:\n\n\b\n{_READING}")
@click.argument("files", nargs=-1, metavar="[FILE]...", type=MOTION_FILE)
@click.option(
    "--sheet",
    metavar="FILE.png",
    type=click.Path(path_type=Path),
    help="Also draw the body of one FILE at rest, with the roles of its joints.",
)
@click.option(
    "--save",
    metavar="FILE.toml",
    type=click.Path(path_type=Path),
    help="Also write how one FILE is read, to be corrected and passed back as 'FILE[reading=FILE.toml]'.",
)
def command(files: tuple[MotionFile, ...], sheet: Path | None, save: Path | None) -> int:
    """Say what was found in motion files, and what to say where that is wrong.

    Joints and their roles, unit, up axis, rest pose, frame rate and floor: what every other command goes
    by. What is said in brackets behind a name counts more than what is found, here and in bench retarget:
    'walk.bvh[unit=cm,up=z]'.

    Without a FILE: versions, weights, threads, GPU and folders of this installation, for bug reports, and
    what is wrong with it; exit status 1 if something is.
    """
    from retarget_bench.motion.editing import start
    from retarget_bench.motion.importer import load

    for option, path, ending in (("--sheet", sheet, ".png"), ("--save", save, ".toml")):
        if path is not None:
            if len(files) != 1 or path.suffix.lower() != ending:
                what = "is of one file" if len(files) != 1 else f"is a {ending} file"
                raise BenchError(f"{option} {path}: what is written {what}")
            check_writable(path)
    if not files:
        return _installation()
    unreadable = 0
    for number, file in enumerate(files):
        try:
            imported = load(file.path, file.reading)
            if sheet is not None:
                _draw_roles(sheet, imported)
            if save is not None:
                _save(save, imported)
        except BenchError as error:
            echo(f"bench: {error}", err=True)
            unreadable += 1
        else:
            echo(("\n" if number else "") + imported.findings.text())
            if (begins := start.find(imported.motion)) is not None:
                ways = ", or ".join(f"--{each.replace('=', ' ')}" for each in begins.options)
                echo(f"\nIn front of the motion {begins}. In bench retarget:\n  {ways}")
            if save is not None:
                echo(f"\nwrote {save}")
    return 2 if unreadable else 0


def _installation() -> int:
    """Print how the installation is; 1 where something is wrong with it."""
    from retarget_bench.commands import installation
    from retarget_bench.python.progress import stepped

    with stepped("bench doctor") as over:
        findings = installation.findings(over)
    width = max(map(len, findings)) + 2
    wrapped = partial(textwrap.wrap, width=screen_width(), break_long_words=False, break_on_hyphens=False)
    for name, (fact, _) in findings.items():
        echo("\n".join(wrapped(f"{name:<{width}}{fact}", subsequent_indent=" " * width)))
    problems = [problem for _, wrong in findings.values() for problem in wrong]
    echo("\nTo be mended:" if problems else "\nNothing is wrong.")
    for problem in problems:
        echo("\n".join(wrapped(f"- {problem}", subsequent_indent="  ")))
    return 1 if problems else 0


def _draw_roles(sheet: Path, imported: Imported) -> None:
    from retarget_bench.viewer.clips import write_still
    from retarget_bench.viewer.role_sheet import role_sheet

    write_still(sheet, role_sheet(imported))


# --------------------------------------------------------------------------------------- saved readings
def _save(path: Path, imported: Imported) -> None:
    """Write how a file is read. Raises BenchError where the path holds anything but an earlier, unchanged
    reading of a file of this name."""
    head = f"# how {imported.findings.path.name} is read"
    if not _may_replace(path, head):
        raise BenchError(
            f"--save would overwrite {path}, which was changed since or is not of "
            f"{imported.findings.path.name}; choose another name, or remove it"
        )
    body = reading_text(imported)
    try:
        body.encode()
    except UnicodeEncodeError as error:
        broken = error.object[error.start : error.end]
        raise BenchError(f"{path}: a joint's name holds {broken!r}, which no TOML file can hold") from None
    write_text(path, f"{head}; written as {digest(body, 12)}\n{body}")


def reading_text(imported: Imported) -> str:
    """A reading as TOML, with all joints in its table of roles: those without a role are "none", with the
    reason."""
    stated = imported.settled.stated
    lines = [
        f"{name} = {json.dumps(value) if isinstance(value, int | float) else _quoted(str(value))}"
        for name, value in stated.items()
        if name != "roles"
    ]
    lines += ["", "[roles]"]
    if imported.findings.missing:
        lines.append(f"# no joint is known as {', '.join(imported.findings.missing)}")
    for joint, meaning in imported.findings.joints:
        why = NO_ROLE.get(meaning, "").strip("-? ()")
        lines.append(f"{_quoted(joint)} = " + (f'"none"  # {why}' if why else f'"{meaning}"'))
    return "\n".join(lines) + "\n"


def _quoted(text: str) -> str:
    """A text in quotes of TOML: as JSON quotes it, but that DEL is escaped too."""
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")


def _may_replace(path: Path, head: str) -> bool:
    """Whether there is no file, or one that was written under this heading and is as it was."""
    try:
        first, _, body = path.read_text(encoding="utf-8").partition("\n")
    except FileNotFoundError:
        return True
    except (OSError, ValueError):
        return False
    return first == f"{head}; written as {digest(body, 12)}"
