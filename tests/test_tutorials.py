"""The tutorials, carried out: each command as it stands there, each output beside what the command prints.

A block of ``sh`` is run in one folder after those before it. A block of ``text`` is what it prints: ``...``
stands for lines left out or, within a line, for a part of it. A block with a title is a file.
"""

from __future__ import annotations

import io
import os
import re
import shlex
import shutil
import subprocess
import sys
from collections.abc import Iterator, Sequence
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path
from typing import NamedTuple

import pytest

from retarget_bench import cli
from retarget_bench.commands.retargeting import batch
from retarget_bench.plugins import registry
from retarget_bench.python import progress
from retarget_bench.training import clips, pair_data
from tests.in_process import carried_out_here, without_processes

DOCS = Path(__file__).parents[1] / "docs"
TUTORIALS = sorted((DOCS / "tutorials").glob("*.md"))


class Block(NamedTuple):
    """A fenced block: the line of the page on which its text begins, language, name of the file."""

    line: int
    language: str
    title: str
    text: str


def blocks(page: Path) -> Iterator[Block]:
    text = page.read_text(encoding="utf-8")
    for found in re.finditer(
        r'^```(\w+)(?: title="([\w.]+)")?\n(.*?)^```$', text, re.MULTILINE | re.DOTALL
    ):
        yield Block(text.count("\n", 0, found.start(3)) + 1, found[1], found[2] or "", found[3])


def first_difference(shown: Sequence[str], printed: Sequence[str]) -> int | None:
    """The index of the first line shown that was not printed; their number where more was printed."""
    reached = {0}  # how many lines may have been printed up to here
    for index, line in enumerate(shown):
        if line == "...":
            reached = set(range(min(reached), len(printed) + 1))
            continue
        pattern = ".*".join(map(re.escape, line.split("...")))
        fits = [at for at in reached if at < len(printed) and re.fullmatch(pattern, printed[at])]
        if not (reached := {at + 1 for at in fits}):
            return index
    return None if len(printed) in reached else len(shown)


class Shell:
    """Runs lines as a shell would: ``bench`` in this process, all else in ``sh``."""

    def __init__(self) -> None:
        self.status = 0

    def run(self, script: str) -> str:
        """What the lines print, errors included. Raises AssertionError where one fails unasked."""
        printed = io.StringIO()
        for part in re.findall(
            r"^(?:bench .*\n|(?:(?!bench ).*\n)+)", script.replace("\\\n", " "), re.MULTILINE
        ):
            if part.startswith("bench "):
                self._passed(printed)
                self.status = _bench(shlex.split(part, comments=True)[1:], printed)
            else:
                done = subprocess.run(
                    ["sh", "-c", f"(exit {self.status})\n{part}"],
                    env=os.environ | {"PATH": f"{Path(sys.executable).parent}:{os.environ['PATH']}"},
                    capture_output=True,
                    text=True,
                    check=False,
                )
                printed.write(done.stdout + done.stderr)
                self.status = done.returncode
        self._passed(printed)
        return printed.getvalue()

    def _passed(self, printed: io.StringIO) -> None:
        assert self.status == 0, f"exit status {self.status}\n{printed.getvalue()}"


def _bench(words: list[str], printed: io.StringIO) -> int:
    """The exit status of a command in this process, which knows no plug-in file of an earlier one."""
    registry._FILES.clear()
    outputs = redirect_stdout(printed), redirect_stderr(printed)
    with without_processes(), outputs[0], outputs[1], pytest.raises(SystemExit) as stop:
        cli.main(words)
    return int(stop.value.code or 0)


def carry_out(page: Path) -> None:
    """Run a page's blocks in the present folder. Raises AssertionError with the page and line."""
    shell, printed = Shell(), None
    for block in blocks(page):
        if block.title:
            Path(block.title).write_text(block.text, encoding="utf-8")
        elif block.language == "sh":
            try:
                printed = shell.run(block.text)
            except AssertionError as error:
                pytest.fail(f"{page.name}:{block.line}: {error}", pytrace=False)
        elif block.language == "text":
            assert printed is not None, f"{page.name}:{block.line}: no command prints this"
            shown, came = (
                [line.rstrip() for line in text.strip("\n").splitlines()] for text in (block.text, printed)
            )
            if (index := first_difference(shown, came)) is not None:
                line = shown[index] if index < len(shown) else "nothing more"
                pytest.fail(
                    f"{page.name}:{block.line + index}: shows {line!r}; printed:\n{printed}", pytrace=False
                )
            printed = None


@pytest.fixture
def reader(tmp_path, monkeypatch) -> Path:
    """The empty folder of a reader, who sees of progress nothing that stays."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(registry, "_FILES", {})
    monkeypatch.setattr(progress._Lines, "__call__", lambda *_: None)
    for module in (batch, clips, pair_data):
        monkeypatch.setattr(module, "carried_out", carried_out_here)
    return tmp_path


def test_there_are_six():
    names = ["ci", "compare", "data", "method", "retarget", "train"]
    assert [page.stem for page in TUTORIALS] == names


@pytest.mark.parametrize("page", TUTORIALS, ids=lambda page: page.stem)
def test_a_tutorial_prints_what_it_shows(page, reader):
    for name in re.findall(r"\]\(\.\./examples/([\w.]+)\)", page.read_text(encoding="utf-8")):
        shutil.copy(DOCS / "examples" / name, reader)
    carry_out(page)


@pytest.mark.parametrize("page", TUTORIALS, ids=lambda page: page.stem)
def test_a_tutorial_leads_on(page):
    _, _, onward = page.read_text(encoding="utf-8").partition("\n## Next\n")
    assert len(re.findall(r"^- \[", onward, re.MULTILINE)) in (2, 3)


# ------------------------------------------------------------------------------------- the check itself
@pytest.mark.parametrize(
    ("shown", "printed", "index"),
    [
        ("a|b", "a|b", None),
        ("a|...|c", "a|b|b|c", None),
        ("...|b", "a|b|b", None),  # whichever b is the last
        ("a ... m", "a 3.1 m", None),
        ("a|...", "a", None),
        ("a.c", "abc", 0),  # a point is a point
        ("a|b", "a|x", 1),
        ("a", "a|b", 1),
        ("a|b", "a", 1),
        ("...|b", "a|b|c", 2),
        ("a ... m", "a 3.1 km", 0),
    ],
)
def test_lines_are_compared(shown, printed, index):
    assert first_difference(shown.split("|"), printed.split("|")) == index


PAGE = """# Page

```text title="words.txt"
one
```

```sh
{command}
```

```text
{output}
```
"""


@pytest.mark.parametrize(
    ("command", "output", "said"),
    [
        ("cat words.txt", "two", r"page.md:12: shows 'two'; printed:\none"),
        ("bench info nothing", "x", r"page.md:8: exit status 2\n.*nothing"),
        ("cat nowhere", "x", r"page.md:8: exit status 1\n.*nowhere"),
        ("bench info nothing\nbench --version", "x", "page.md:8: exit status 2"),
    ],
)
def test_a_page_that_shows_something_else_is_named_with_its_line(reader, command, output, said):
    page = reader / "page.md"
    page.write_text(PAGE.format(command=command, output=output), encoding="utf-8")
    with pytest.raises(pytest.fail.Exception, match=said):
        carry_out(page)


def test_lines_see_the_exit_status_of_the_one_before(reader):
    page = reader / "page.md"
    command = "bench info nothing\necho $?\ncat words.txt"
    page.write_text(PAGE.format(command=command, output="...\n2\none"), encoding="utf-8")
    carry_out(page)
