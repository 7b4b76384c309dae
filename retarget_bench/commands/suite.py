"""A run written down: a TOML file with the options of ``bench run`` in the same words.

methods = ["copy_rotations[root_rule=height]", "ik"]
dataset = "mixamo"
root = "PATH/TO/mixamo"
splits = ["cross"]
"""

from pathlib import Path
from typing import Any

import click

from retarget_bench.errors import FileError
from retarget_bench.files import read_toml
from retarget_bench.options import Declared, declared, fits, shown, words
from retarget_bench.python.run_options import RunOptions


def _used(ctx: click.Context, param: click.Parameter, path: Path | None) -> None:
    """Use a suite file as the defaults of the other options, so that what is given wins."""
    del param
    if path is not None:
        ctx.default_map = {**(ctx.default_map or {}), **read(path)}


suite_option = click.option(
    "--suite",
    metavar="FILE",
    type=click.Path(exists=True, dir_okay=False, path_type=Path),
    is_eager=True,
    expose_value=False,
    callback=_used,
    help="A TOML file with options of this command in the same words; options given here win.",
)


def read(path: Path) -> dict[str, Any]:
    """The options that a suite file sets. Raises FileError that lists every mistake with its place."""
    known = {name: each for name, each in declared(RunOptions).items() if not each.option.python}
    entries = read_toml(path)
    mistakes = [_mistake(name, value, known.get(name)) for name, value in entries.items()]
    if wrong := "".join(f"\n  {each}" for each in mistakes if each):
        raise FileError(path, f"is not a suite file (it may set {', '.join(known)}):{wrong}")
    return {
        name: [value] if known[name].several and isinstance(value, str) else value
        for name, value in entries.items()
    }


def _mistake(name: str, value: Any, option: Declared | None) -> str:
    """What is wrong with an entry; "" where nothing is."""
    if option is None:
        return f"{name}: there is no such option"
    read = Path(value) if isinstance(value, str) and option.is_a(Path) else value
    if (isinstance(value, bool) and not option.is_a(bool)) or not fits(read, option.kind):
        return f"{name} is {shown(value)}; it takes {' or '.join(dict.fromkeys(words(option.kind)))}"
    if option.option.range and not option.option.allows(value):
        return f"{name} is {value:g}; it must be {option.option.range}"
    return ""
