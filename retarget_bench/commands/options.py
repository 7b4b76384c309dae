"""Options and helpers that several commands share, and shell completion."""

from __future__ import annotations

import re
import shutil
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import click

from retarget_bench import defaults, files
from retarget_bench.api import TASKS
from retarget_bench.commands.declared import plugin_names
from retarget_bench.commands.terminal import echo
from retarget_bench.errors import BenchError

if TYPE_CHECKING:
    from retarget_bench.results.store import ResultPaths

Decorator = Callable[[Any], Any]
FILE = click.Path(dir_okay=False, path_type=Path)
FOLDER = click.Path(file_okay=False, path_type=Path)
PATH = click.Path(path_type=Path)


def together(*options: Decorator) -> Decorator:
    """Several options as one decorator, shown in this order."""

    def add(command: Any) -> Any:
        for option in reversed(options):
            command = option(command)
        return command

    return add


SEED = click.IntRange(0, 2**63 - 1)
"""The range of seeds that torch accepts."""


def maker(task: str) -> str:
    """The command that makes results of a task."""
    return "bench run" if task == TASKS[0] else f"bench run --task {task}"


def split_names(ctx: click.Context, param: click.Parameter, given: tuple[str, ...]) -> tuple[str, ...]:
    """``-s self -s cross`` and ``-s self,cross`` are the same; none means every split."""
    del ctx, param
    return tuple(dict.fromkeys(name for each in given for name in ids(each)))


def _job_count(ctx: click.Context, param: click.Parameter, given: int | None) -> int:
    del ctx, param
    return given or defaults.jobs()


dataset_option = click.option(
    "-d",
    "--dataset",
    metavar="DATASET",
    default=defaults.DATASET,
    show_default=True,
    shell_complete=plugin_names("datasets"),
    help="The data set, with its parameters in brackets.",
)
root_option = click.option(
    "--root", metavar="DIR", type=click.Path(), help="Folder of the data: short for DATASET[root=DIR]."
)
split_option = click.option(
    "-s",
    "--split",
    "splits",
    multiple=True,
    metavar="SPLIT",
    callback=split_names,
    help="A split of the data set, such as cross (bench info DATASET lists them); may be repeated. "
    "[default: all]",
)
jobs_option = click.option(
    "-j",
    "--jobs",
    type=click.IntRange(min=1),
    callback=_job_count,
    metavar="N",
    help=f"Number of processes. [default: one per core, at most {defaults.MOST_JOBS}]",
)
seed_option = click.option(
    "--seed",
    type=click.IntRange(min=0),
    default=0,
    show_default=True,
    metavar="N",
    help="Base seed, from which the seed of every case is derived.",
)
roots_argument = click.argument("roots", nargs=-1, metavar="[RESULTS]...", type=PATH)
only_dataset_option = click.option(
    "-d",
    "--dataset",
    metavar="DATASET",
    help="Only results of this data set, as bench run was given it ('folder[root=DIR]') or as tables call "
    "it.",
)
results_option = click.option(
    "-r",
    "--results",
    multiple=True,
    metavar="RESULTS",
    type=PATH,
    help="Folders written by bench run; may be repeated. [default: runs]",
)
methods_option = click.option(
    "-m",
    "--method",
    "methods",
    multiple=True,
    metavar="METHOD",
    shell_complete=plugin_names("methods"),
    help="Only these methods, in this order; may be repeated. [default: all that there are]",
)
task_option = click.option("--task", default="retarget", show_default=True, help="Results of this task.")
device_option = click.option(
    "--device",
    type=click.Choice(("cpu", "cuda", "auto")),
    default="auto",
    show_default=True,
    help="Device.",
)
output_option = click.option("-o", "--output", type=FILE, is_eager=True, help="Write to this file.")


def methods_argument(metavar: str, *, required: bool = False) -> Decorator:
    """METHODs, with completion by name."""
    return click.argument(
        "methods", nargs=-1, required=required, metavar=metavar, shell_complete=plugin_names("methods")
    )


class FormatChoice(click.Choice[str]):
    """A format by its ending or its name (``tex``, ``latex``; ``md``, ``markdown``). Gives the ending."""

    NAMES: ClassVar = {"latex": "tex", "markdown": "md", "txt": "text", "htm": "html"}
    ALL = ("text", "md", "tex", "html", "csv")

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> str:
        return super().convert(self.NAMES.get(value, value), param, ctx)


bodies_option = click.option(
    "--bodies",
    type=click.Choice(["people", "four-legged", "mixed", "all"]),
    help="Bodies on two legs, on four, or one of each. [default: people, where there are any]",
)


def format_option(*forms: str) -> Decorator:
    """``-f``; without it the format that the ending of ``-o`` says, or the first where it has no ending."""

    def form(ctx: click.Context, param: click.Parameter, given: str | None) -> str:
        output = ctx.params.get("output")
        if given is not None or output is None:
            return given or forms[0]
        ending = output.suffix.lower().removeprefix(".")
        meant = FormatChoice.NAMES.get(ending, ending)
        if meant and meant not in forms:
            known = ", ".join(forms)
            raise click.BadParameter(f"{output} is to be {meant}; there are {known}", ctx, param)
        return meant or forms[0]

    kind = FormatChoice(forms)
    usual = f"Format.  [default: by the ending of -o, else {forms[0]}]"
    return click.option("-f", "--format", "form", type=kind, callback=form, help=usual)


def ids(text: str) -> list[str]:
    """``ID,ID`` as a list."""
    return [each.strip() for each in text.split(",") if each.strip()]


def method_names(text: str) -> list[str]:
    """``METHOD,METHOD`` as a list; commas in brackets separate parameters."""
    return [each.strip() for each in re.split(r",(?![^\[\]]*\])", text) if each.strip()]


def results(
    roots: Sequence[Path],
    dataset: str | None = None,
    task: str = "retarget",
    maker: str = "bench run",
    what: str = "results",
) -> list[ResultPaths]:
    """Results in these folders. Raises BenchError where one has none, or none are of the data set."""
    from retarget_bench.analysis.selection import of_dataset
    from retarget_bench.results import store

    places: list[ResultPaths] = []
    for root in roots:
        if not (found := store.find_results(root, task)):
            raise BenchError(f"no {what} in {root}; {maker} makes some")
        places += found
    return places if dataset is None else of_dataset(places, dataset)


def screen_width() -> int:
    """Characters in a line: of ``COLUMNS`` or of the terminal, 80 to 200; 100 elsewhere."""
    return min(200, max(80, shutil.get_terminal_size((100, 24)).columns))


def say(sentence: str) -> None:
    """Print a sentence on lines that fit the screen and break no command made by ``command``."""
    from retarget_bench.tables.rendering import words

    echo("\n".join(words.filled(sentence, screen_width(), indent="  ")))


def command(*parts: object) -> str:
    """A command that ``say`` does not break."""
    from retarget_bench.tables.rendering.words import NO_BREAK

    return " ".join(map(str, parts)).replace(" ", NO_BREAK)


def write_out(text: str, output: Path | None) -> None:
    """Print a text, or write it to the file that ``-o`` names."""
    if output is None:
        echo(text, nl=False)
    else:
        files.write_text(output, text)
        echo(f"wrote {output}")
