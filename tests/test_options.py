"""Options: declared once for commands, Python and files; they check themselves; one letter, one meaning."""

from __future__ import annotations

import inspect
from collections.abc import Iterator

import click
import pytest

import retarget_bench as rb
from retarget_bench import cli
from retarget_bench.commands.options import takes
from retarget_bench.errors import BenchError
from retarget_bench.motion.files.reading import Reading
from retarget_bench.options import Names, OptionSet, declared, listed, option
from retarget_bench.python.run_options import RunOptions

LETTERS = {
    "-d": "dataset",
    "-f": "format",
    "-j": "jobs",
    "-m": "method",
    "-o": "out",
    "-r": "results",
    "-s": "splits",
}


def commands() -> Iterator[tuple[str, click.Command]]:
    group = cli.LazyGroup("bench")
    context = click.Context(group)
    for name in cli.COMMANDS:
        command = group.get_command(context, name)
        assert command is not None
        yield name, command


def options() -> Iterator[tuple[str, click.Option]]:
    for name, command in commands():
        yield from ((name, each) for each in command.params if isinstance(each, click.Option))


def test_there_are_as_many_commands_and_options_as_a_person_can_hold():
    """Keys of readings count."""
    assert len(dict(commands())) <= 20
    assert len([*options()]) + len(declared(Reading)) <= 180
    assert sum(name == "retarget" for name, _ in options()) <= 15


def test_a_letter_has_one_meaning():
    for name, each in options():
        for letter in (flag for flag in each.opts if len(flag) == 2):
            assert (each.name or "").removesuffix("s") == LETTERS[letter].removesuffix("s"), name


def test_no_command_has_a_flag_twice():
    for name, command in commands():
        flags = [flag for each in command.params if isinstance(each, click.Option) for flag in each.opts]
        assert len(flags) == len(set(flags)), name


# --------------------------------------------------------------------------------------- a class of them
class Wide(OptionSet):
    """Of a test."""

    width: float = option("How wide.", default=1.0, above=0, below=10, letter="w", metavar="M")
    names: Names = option("Whose.", default=())
    bare: bool = option("Without anything on it.", default=False)


class Wider(Wide):
    """With a field of its own in the place of an inherited one."""

    width: float = option("How wide it may be.", default=20.0, above=0)


def seen(options: type[OptionSet], *words: str) -> OptionSet:
    received: list[OptionSet] = []
    command = click.command()(takes(options)(lambda options: received.append(options)))
    command.main(list(words), standalone_mode=False)
    return received[0]


def test_a_command_and_python_build_the_same():
    assert seen(Wide, "-w", "2.5", "--names", "a,b[c=1,d=2]", "--names", "a") == Wide(
        width=2.5, names=("a,b[c=1,d=2]", "a")
    )
    assert listed(("a,b[c=1,d=2]", "a")) == ("a", "b[c=1,d=2]")
    assert seen(Wide) == Wide()


def test_a_field_in_the_place_of_another_is_an_option_once():
    command = click.command()(takes(Wider)(lambda options: None))
    assert [each.name for each in command.params].count("width") == 1
    assert seen(Wider, "--width", "12") == Wider(width=12.0)


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"width": 0.0}, "width is 0; it must be above 0 and below 10"),
        ({"width": float("nan")}, "width is nan"),
        ({"width": 10**20}, "width is 100000000000000000000;"),
        ({"width": "2"}, "width is '2', of type str; it takes a number"),
        ({"width": True}, "width is True, of type bool; it takes a number"),
        ({"bare": "no"}, "bare is 'no', of type str; it takes True or False"),
        ({"names": 3}, "names is 3, of type int; it takes text or a list of text"),
        ({"names": " , "}, "names: ' , ' names nothing; leave it out for all, or name some"),
        ({"names": [",", ""]}, "names: ', ' names nothing"),
    ],
)
def test_values_that_cannot_be_are_told_by_the_name_of_the_field(values, words):
    with pytest.raises(BenchError) as caught:
        Wide(**values)
    assert words in str(caught.value)


def test_python_shows_the_signature_and_the_help_of_its_options():
    assert set(inspect.signature(rb.run).parameters) == set(declared(RunOptions))
    assert all(each.help in (rb.run.__doc__ or "") for each in declared(RunOptions).values())
