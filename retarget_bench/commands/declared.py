"""Options of a command made from a class of options."""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from pathlib import Path
from typing import Any

import click
from click.shell_completion import CompletionItem

from retarget_bench.options import Declared, declared
from retarget_bench.plugins import registry

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
