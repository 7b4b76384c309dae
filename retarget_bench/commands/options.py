"""Options of commands: made from classes of options, shared by several, and used to read and write."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

import click
from click.shell_completion import CompletionItem

from retarget_bench import defaults, files
from retarget_bench.commands import echo
from retarget_bench.errors import BenchError
from retarget_bench.options import Option, OptionSet, declared, option
from retarget_bench.plugins import registry

if TYPE_CHECKING:
    from retarget_bench.results.store import ResultPaths

Decorator = Callable[[Any], Any]
PROBED = ("results of probes", "bench test METHOD --probes")
"""Results of the task ``probe``, and the command that makes them."""


def takes(options: type, *positional: str, only: tuple[str, ...] = ()) -> Decorator:
    """Give a command the options of a class; its function gets the object, under the name ``options``.

    positional: fields that are arguments of the command, which it declares itself. only: fields that it
    has; none: all but those of Python.
    """
    fields = {name: each for name, each in declared(options).items() if not each.python}
    own_first = dict.fromkeys(
        name for kind in options.__mro__ for name in vars(kind).get("__annotations__", ())
    )
    shown = set(only or fields) - set(positional)

    def add(function: Any) -> Any:
        @wraps(function)
        def call(**values: Any) -> Any:
            stated = {name: values.pop(name) for name in fields if name in values}
            stated = {name: value for name, value in stated.items() if value not in (None, ())}
            return function(options=options(**stated), **values)

        for name in reversed([name for name in own_first if name in shown]):
            call = _flag(fields[name])(call)
        return call

    return add


def _flag(each: Option) -> Decorator:
    """``--name``, or its letter, with its help and its default."""
    usual = each.shown or ("" if each.required or not each.default else str(each.default))
    names = [*([f"-{each.letter}"] if each.letter else []), f"--{each.name.replace('_', '-')}", each.name]
    help = f"{each.help}  [default: {usual}]" if usual else each.help
    if each.is_a(bool):
        return click.option(*names, is_flag=True, help=help)
    return click.option(
        *names,
        type=_type(each),
        multiple=each.several,
        required=each.required,
        metavar=each.metavar or None,
        shell_complete=_completion(each),
        help=help,
    )


def _type(each: Option) -> Any:
    if each.choices:
        return click.Choice([choice for choice in each.choices if choice])
    if each.is_a(Path):
        return click.Path(path_type=Path)
    return next((kind for kind in (int, float) if each.is_a(kind)), str)


Completion = Callable[[click.Context, click.Parameter, str], list[CompletionItem]]
FILES: Completion = click.Path().shell_complete
"""Shell completion by files."""


def _completion(each: Option) -> Completion | None:
    """Shell completion of an option, where its type has none."""
    if each.names:
        return plugin_names(*each.names)
    folder = each.metavar == "DIR"
    return click.Path(file_okay=not folder).shell_complete if folder or "FILE" in each.metavar else None


def plugin_names(*kinds: registry.Kind) -> Completion:
    """Shell completion by names of plug-ins, none imported; post-processors after a ``+``. Files where no
    name fits, since a plug-in may be named by its file."""

    def complete(ctx: click.Context, param: click.Parameter, incomplete: str) -> list[CompletionItem]:
        before, plus, begun = incomplete.rpartition("+")
        offered: tuple[registry.Kind, ...] = ("posts",) if plus else kinds
        entries = [entry for kind in offered for entry in registry.names(kind)]
        fitting = [entry for entry in entries if entry.name.startswith(begun)]
        items = [CompletionItem(before + plus + e.name, help=e.summary) for e in fitting]
        return items or FILES(ctx, param, incomplete)

    return complete


# ------------------------------------------------------------------------------ of several commands
class OfResults(OptionSet):
    """The results that a command is about."""

    results: Sequence[Path] = option(
        "Folders written by bench run.", default=(), shown=defaults.OUT, letter="r", metavar="DIR"
    )
    dataset: str | None = option(
        "Only results of this data set, as bench run was given it "
        "('folder[root=DIR]') or as tables call it.",
        default=None,
        letter="d",
        metavar="DATASET",
        names=("datasets",),
    )

    @property
    def roots(self) -> list[Path]:
        return list(self.results) or [Path(defaults.OUT)]

    @property
    def only(self) -> str | None:
        """The data set; one that is named by its file is added to the registry."""
        from retarget_bench.plugins import named

        return None if self.dataset is None else named.with_names(self.dataset)

    def of(self, folders: Sequence[Path]) -> Self:
        """These options for other folders of results."""
        return replace(self, results=folders)

    def places(self, task: str = defaults.TASK) -> list[ResultPaths]:
        """The results of a task. Raises BenchError where a folder has none, or none are of the data set."""
        from retarget_bench.analysis.selection import of_dataset
        from retarget_bench.results import store

        check_task(task)
        maker = "bench run" if task == defaults.TASK else f"bench run --task {task}"
        what, maker = PROBED if task == "probe" else ("results", maker)
        places: list[ResultPaths] = []
        for root in self.roots:
            if not (here := store.find_results(root, task)):
                raise BenchError(f"no {what} in {root}; {maker} makes some")
            places += here
        return places if self.only is None else of_dataset(places, self.only)


class ToFile(OptionSet):
    """The destination of a text, the terminal or a file. Classes of these options have a ``format``."""

    out: Path | None = option("Write to this file.", default=None, letter="o", metavar="FILE")

    @property
    def width(self) -> int:
        """Characters in a line of the text: as many as the terminal has, where it is printed."""
        from retarget_bench.tables.rendering import WIDTH

        return screen_width() if self.out is None else WIDTH

    @property
    def form(self) -> str:
        """The requested ``format``; else that of the file's ending, or the first where it has none.

        Raises BenchError for an ending of another format.
        """
        kind: Any = type(self)
        field = declared(kind)["format"]
        forms = [each for each in field.choices if each]
        ending = "" if self.out is None else self.out.suffix.lower().removeprefix(".")
        form = getattr(self, field.name) or {"txt": "text", "htm": "html"}.get(ending, ending)
        if form and form not in forms:
            raise BenchError(f"{self.out} is to be {form}; there are {', '.join(forms)}")
        return form or forms[0]

    def write(self, text: str) -> None:
        """Print a text, or write it to the file."""
        if self.out is None:
            echo(text, nl=False)
        else:
            files.write_text(self.out, text)
            echo(f"wrote {self.out}")


def check_task(task: str) -> None:
    """Raises BenchError for a task that no results are of."""
    from retarget_bench.api import TASKS

    if task not in (tasks := (*TASKS, "probe")):
        raise BenchError(f"there is no task {task!r}; results are of {', '.join(tasks)}")


def screen_width() -> int:
    """Characters in a line: of ``COLUMNS`` or of the terminal, 80 to 200; 100 elsewhere."""
    return min(200, max(80, shutil.get_terminal_size((100, 24)).columns))


def say(sentence: str) -> None:
    """Print a sentence on lines that fit the screen and break no command made by ``unbroken``."""
    from retarget_bench.tables.rendering import words

    echo("\n".join(words.filled(sentence, screen_width(), indent="  ")))


def unbroken(*parts: object) -> str:
    """A command that ``say`` does not break."""
    from retarget_bench.tables.rendering.words import NO_BREAK

    return " ".join(map(str, parts)).replace(" ", NO_BREAK)
