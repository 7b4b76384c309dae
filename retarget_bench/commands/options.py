"""Options of a command made from a class of options, those that several commands share, and what commands
read and write by them."""

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
from retarget_bench.options import Declared, OptionSet, declared, option
from retarget_bench.plugins import registry

if TYPE_CHECKING:
    from retarget_bench.results.store import ResultPaths

Decorator = Callable[[Any], Any]


def takes(options: type, *positional: str, only: tuple[str, ...] = ()) -> Decorator:
    """Give a command the options of a class; its function gets the object, under the name ``options``.

    positional: fields that are arguments of the command, which it declares itself. only: fields that it
    has; none: all but those of Python.
    """
    known = {name: each for name, each in declared(options).items() if not each.option.python}
    own_first = dict.fromkeys(
        name for kind in options.__mro__ for name in vars(kind).get("__annotations__", ())
    )
    shown = set(only or known) - set(positional)
    mine = [known[name] for name in own_first if name in shown]

    def add(function: Any) -> Any:
        @wraps(function)
        def call(**given: Any) -> Any:
            said = {name: given.pop(name) for name in known if name in given}
            told = {name: value for name, value in said.items() if value not in (None, ())}
            return function(options=options(**told), **given)

        for each in reversed(mine):
            call = _option(each)(call)
        return call

    return add


def _option(each: Declared) -> Decorator:
    """``--name``, or its letter, with its help and its default."""
    told, flag = each.option, f"--{each.name.replace('_', '-')}"
    silent = (None, "", (), False)
    usual = told.shown or ("" if each.required or each.default in silent else str(each.default))
    help = f"{told.help}  [default: {usual}]" if usual else told.help
    letters = [f"-{told.letter}"] if told.letter else []
    if each.is_a(bool):
        return click.option(*letters, flag, each.name, is_flag=True, help=help)
    return click.option(
        *letters,
        flag,
        each.name,
        type=_type(each),
        multiple=each.several,
        required=each.required,
        metavar=told.metavar or None,
        shell_complete=plugin_names(*told.names) if told.names else None,
        help=help,
    )


def _type(each: Declared) -> Any:
    if each.choices:
        return click.Choice([choice for choice in each.choices if choice])
    if each.is_a(Path):
        return click.Path(path_type=Path)
    return next((kind for kind in (int, float) if each.is_a(kind)), str)


def plugin_names(
    *kinds: registry.Kind,
) -> Callable[[click.Context, click.Parameter, str], list[CompletionItem]]:
    """Shell completion by names of plug-ins, none imported; post-processors after a ``+``."""

    def complete(ctx: click.Context, param: click.Parameter, incomplete: str) -> list[CompletionItem]:
        del ctx, param
        before, plus, begun = incomplete.rpartition("+")
        offered: tuple[registry.Kind, ...] = ("posts",) if plus else kinds
        entries = [entry for kind in offered for entry in registry.names(kind)]
        fitting = [entry for entry in entries if entry.name.startswith(begun)]
        return [CompletionItem(before + plus + e.name, help=e.summary) for e in fitting]

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
    )

    @property
    def roots(self) -> list[Path]:
        return list(self.results) or [Path(defaults.OUT)]

    @property
    def only(self) -> str | None:
        """The data set, which is added to the registry where it is given by its file."""
        from retarget_bench.plugins import named

        return None if self.dataset is None else named.with_names(self.dataset)

    def of(self, folders: Sequence[Path]) -> Self:
        """The same of other folders."""
        return replace(self, results=folders)

    def places(
        self, task: str = defaults.TASK, what: str = "results", maker: str = ""
    ) -> list[ResultPaths]:
        """The results of a task. Raises BenchError where a folder has none, or none are of the data set.

        what, maker: what they are and the command that makes them, for the error.
        """
        from retarget_bench.analysis.selection import of_dataset
        from retarget_bench.results import store

        check_task(task)
        found: list[ResultPaths] = []
        for root in self.roots:
            if not (here := store.find_results(root, task)):
                of = "" if task == defaults.TASK else f" --task {task}"
                raise BenchError(f"no {what} in {root}; {maker or f'bench run{of}'} makes some")
            found += here
        return found if self.only is None else of_dataset(found, self.only)


class ToFile(OptionSet):
    """Where a text goes."""

    out: Path | None = option("Write to this file.", default=None, letter="o", metavar="FILE")

    def form(self, asked: str, forms: Sequence[str]) -> str:
        """The format asked for; else the one that the file's ending says, or the first where it has none.

        Raises BenchError for an ending of another format.
        """
        ending = "" if self.out is None else self.out.suffix.lower().removeprefix(".")
        meant = asked or {"txt": "text", "htm": "html"}.get(ending, ending)
        if meant and meant not in forms:
            raise BenchError(f"{self.out} is to be {meant}; there are {', '.join(forms)}")
        return meant or forms[0]

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

    if task not in (known := (*TASKS, "probe")):
        raise BenchError(f"there is no task {task!r}; results are of {', '.join(known)}")


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
