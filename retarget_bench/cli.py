"""The ``bench`` command. A command's module is imported only when that command is run."""

import importlib
import os
import signal
import sys
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import NoReturn

import click
from click.shell_completion import CompletionItem

from retarget_bench import __version__
from retarget_bench.commands import echo
from retarget_bench.errors import BenchError

COMMANDS = {
    "run": ("run", "Predict, score and show the table. Start here."),
    "score": ("run.score", "Score a folder of predictions that another program made."),
    "work": ("work", "Carry out shards of a run with --executor, by hand or by a scheduler."),
    "table": ("table", "Show the results that exist, or a published table beside them."),
    "compare": ("compare", "Compare two methods, or two versions of one: differences and p-values."),
    "report": ("report", "Make one page of results, with charts and the motion behind every number."),
    "plot": ("plot", "Draw a chart of results, as .png, .pdf or .svg."),
    "render": ("render", "Draw a case or motion files as a clip (.mp4, .gif, .webp), a still or a sheet."),
    "view": ("view", "Show results, a running run or motion files live in the browser."),
    "retarget": ("retarget", "Retarget motion files to other characters, and say what to look at."),
    "doctor": (
        "doctor",
        "Show how a motion file is read, and how to correct it; without one, check the installation.",
    ),
    "list": ("plugins.list_plugins", "List methods, metrics, data sets and post-processors."),
    "info": ("plugins.info", "Show what a method, metric, value, data set or post-processor is."),
    "new": (
        "plugins.new",
        "Start a method, metric, data set or post-processor of your own from a template.",
    ),
    "test": (
        "test",
        "Check that a plug-in keeps its contract, or give a method equivalent inputs.",
    ),
    "check": ("check", "Regression gate: check that metrics and methods still give the same numbers."),
    "train": ("train", "Train a learned method: weights and their card."),
    "ablate": ("train.ablate", "Train and score the rows of a published ablation table."),
    "export": ("exchange.export", "Write a data set as files, or its questions for other programs."),
    "submit": ("exchange.submit", "Make or check a submission to a leaderboard, or draw the leaderboard."),
}
"""Command -> its module in ``commands`` (and its name there, if not ``command``), and its help line."""

CONTINUED = ("run", "score", "export", "train", "work", "retarget")
"""Commands that keep what they finished and continue from there."""


class LazyGroup(click.Group):
    """A group that knows its commands by name and one help line, and imports none to list them."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        del ctx
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        del ctx
        if cmd_name not in COMMANDS:
            return None
        path, _, name = COMMANDS[cmd_name][0].partition(".")
        try:
            module = importlib.import_module(f"retarget_bench.commands.{path}")
        except ImportError as error:
            raise BenchError(
                f"bench {cmd_name} cannot start: {error}; install retarget-bench again"
            ) from error
        command: click.Command = getattr(module, name or "command")
        return command

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        if args[0] not in COMMANDS and not args[0].startswith("-") and not ctx.resilient_parsing:
            import difflib

            close = difflib.get_close_matches(args[0], COMMANDS, 2, 0.5)
            cure = f"did you mean {' or '.join(close)}?" if close else "bench --help lists them."
            ctx.fail(f"no command is called {args[0]!r}; {cure}")
        return super().resolve_command(ctx, args)

    def shell_complete(self, ctx: click.Context, incomplete: str) -> list[CompletionItem]:
        named = [
            CompletionItem(name, help=line)
            for name, (_, line) in COMMANDS.items()
            if name.startswith(incomplete)
        ]
        return [*named, *click.Command.shell_complete(self, ctx, incomplete)]

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        del ctx
        with formatter.section("Commands"):
            formatter.write_dl([(name, line) for name, (_, line) in COMMANDS.items()])


COMPLETION = """Completion with Tab: put this into ~/.bashrc (with zsh_source, into ~/.zshrc).

\b
eval "$(_BENCH_COMPLETE=bash_source bench)"
"""


@click.command(cls=LazyGroup, epilog=COMPLETION, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(__version__, prog_name="retarget-bench")
@click.option("--traceback", is_flag=True, help="Show where in the code an error arose.")
def group(traceback: bool) -> None:
    """Run, score and compare motion-retargeting methods.

    \b
    bench run                                        every method, embedded motion
    bench run copy_rotations ik -d mixamo --root DIR
    bench info 'copy_rotations'                      what a method is and takes
    """
    if traceback:
        os.environ["RETARGET_BENCH_TRACEBACK"] = "1"


def _terminated(number: int, frame: object) -> NoReturn:
    """Leave as after Ctrl-C: what runs for this process is ended, what it has written is kept."""
    del frame
    sys.exit(128 + number)


def main(arguments: Sequence[str] | None = None) -> NoReturn:
    """Run the command line and exit: 0 done, 1 a check failed, 2 an error, 130 interrupted, 143
    terminated."""
    name = "retarget-bench" if Path("".join(sys.argv[:1])).stem == "retarget-bench" else "bench"
    arguments = sys.argv[1:] if arguments is None else list(arguments)
    with suppress(ValueError):  # only the main thread may
        signal.signal(signal.SIGTERM, _terminated)
    try:
        status = group.main(list(arguments), prog_name=name, standalone_mode=False)
    except click.ClickException as error:
        error.show()
        sys.exit(error.exit_code)
    except click.Abort:
        continues = any(name in arguments for name in CONTINUED)
        hint = " What was finished is kept; the same command continues from there." if continues else ""
        echo(f"bench: interrupted.{hint}", err=True)
        sys.exit(130)
    except BenchError as error:
        if os.environ.get("RETARGET_BENCH_TRACEBACK"):
            raise
        echo(f"bench: {error}", err=True)
        sys.exit(2)
    sys.exit(status if isinstance(status, int) else 0)
