"""Build the site: the pages of this repository, references made from its code, and the main job's report.

    python -m tools.build_docs              into build/docs/site

Pages keep their places, so that links between them lead to the same files; links to what is no page lead to
the repository. Results of the main job are kept in ``build/docs/runs`` and computed where they are missing.
"""

from __future__ import annotations

import inspect
import posixpath
import re
import shutil
import subprocess
import sys
import tomllib
from itertools import groupby
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[1]
WORK = ROOT / "build" / "docs"
PAGES = ("*.md", "docs/**/*.md", "results/*.md", "benchmarks/*.md", "datasets/*/*.md")
"""Of the repository, as they stand there."""
BESIDE = ("docs/**/*.png", "docs/*.ipynb", "results/*.png", "results/*.csv", "LICENSE")
"""What pages show or link to."""
BENCH: tuple[str | Path, ...] = (sys.executable, "-m", "retarget_bench")
LINK = re.compile(r"(\]\()([^)\s#]+)(#[^)\s]*)?(\))")
EXAMPLE = """\
---
hide: [navigation, toc]
---
# A report to play with

This is what `bench report` makes of the main job (`make bench`), unchanged. Click a number, a mark of a
chart or a case, and the motion behind it plays. [The report alone](report.html){target=_blank}

<iframe src="report.html" title="Report of the main job"
style="width: 100%; height: 85vh; border: 0"></iframe>
"""


def staged(pages: Path, repository: str) -> None:
    """Pages and what they link to, below a folder."""
    names = {file.relative_to(ROOT).as_posix() for each in PAGES + BESIDE for file in ROOT.glob(each)}
    for name in sorted(names):
        place = pages / page_name(name)
        place.parent.mkdir(parents=True, exist_ok=True)
        if name.endswith(".md"):
            text = relinked((ROOT / name).read_text(encoding="utf-8"), name, names, repository)
            text = re.sub(r"(?m)^```(\w+) \w+$", r"```\1", text)  # a word for tests
            wide = "---\nhide: [toc]\n---\n" if name.startswith("results/") else ""
            place.write_text(wide + text, encoding="utf-8")
        else:
            shutil.copy(ROOT / name, place)


def page_name(name: str) -> str:
    """A folder's README is its first page."""
    return re.sub(r"(^|/)README\.md$", r"\1index.md", name)


def relinked(text: str, page: str, names: set[str], repository: str) -> str:
    """Links of a page, to pages by their names here and to other files in the repository."""

    def link(found: re.Match[str]) -> str:
        before, target, heading, after = found.groups(default="")
        if "://" in target or target.startswith("mailto:"):
            return found[0]
        path = posixpath.normpath(posixpath.join(posixpath.dirname(page), target))
        if path in names:
            target = posixpath.relpath(page_name(path), posixpath.dirname(page) or ".")
        else:
            kind = "tree" if (ROOT / path).is_dir() else "blob"
            target = f"{repository}/{kind}/main/{path}"
        return f"{before}{target}{heading}{after}"

    return LINK.sub(link, text)


def command_reference() -> str:
    """The help of every command, as click writes it."""
    import click

    from retarget_bench.cli import COMMANDS, group

    lines = ["# Commands", "", "What `--help` says. `bench` and `retarget-bench` are one command.", ""]
    context = click.Context(group, info_name="bench")
    for name in COMMANDS:
        command = group.get_command(context, name)
        assert command is not None
        help_text = command.get_help(click.Context(command, context, name, max_content_width=100))
        lines += [f"## bench {name}", "", "```text", help_text, "```", ""]
    return "\n".join(lines)


def python_reference() -> str:
    """What ``import retarget_bench`` offers, as it is at run time: options are keywords there, each with
    its help, which no reader of the source alone can know."""
    import retarget_bench as rb

    lines = ["# Python", "", "What `import retarget_bench as rb` offers. [A tour](docs/python.md).", ""]
    for name in sorted(set(rb.__all__) - {"__version__"}, key=str.lower):
        offered = getattr(rb, name)
        lines += documented(f"rb.{name}", offered, "##")
        for part, member in vars(offered).items() if isinstance(offered, type) else ():
            if not part.startswith("_") and (callable(member) or isinstance(member, property)):
                lines += documented(f"{name}.{part}", member, "###")
    return "\n".join(lines)


def documented(name: str, offered: Any, heading: str) -> list[str]:
    """Heading, signature and docstring of a function, class or property."""
    text = (inspect.getdoc(offered) or "").replace("``", "`")
    text, _, options = text.partition("\nOptions\n-------\n")
    lines = [f"{heading} {name}", ""]
    if inspect.isroutine(offered):
        lines += ["```python", signature(name, inspect.signature(offered)), "```", ""]
    return [*lines, text, *re.sub(r"(?m)^(\w+): ", r"- `\1`: ", options).splitlines(), ""]


def signature(name: str, of: inspect.Signature) -> str:
    """A call on one line, or a line for each parameter; without ``self``, and types without modules."""
    given = [each for each in of.parameters.values() if each.name != "self"]
    parts: list[str] = []
    for kind, each in groupby(given, key=lambda parameter: parameter.kind):
        bare = kind is inspect.Parameter.KEYWORD_ONLY and not any("*" in part[:1] for part in parts)
        parts += ["*"] if bare else []
        parts += map(str, each)
        parts += ["/"] if kind is inspect.Parameter.POSITIONAL_ONLY else []
    returned = inspect.formatannotation(of.return_annotation)
    after = "" if of.return_annotation is of.empty else f" -> {returned}"
    line = f"{name}({', '.join(parts)}){after}"
    if len(line) > 80:
        line = f"{name}(\n    " + ",\n    ".join(parts) + f",\n){after}"
    line = re.sub(r"(?<=: )'([^']+)'|(?<=> )'([^']+)'", r"\1\2", line)  # of imports for type checks
    return re.sub(r"\b(?:[a-z_]+\.)+(?=[A-Z])", "", line).replace("<factory>", "...")


def example(folder: Path) -> None:
    """The report of the main job, and a page about it."""
    runs = WORK / "runs"
    subprocess.run([*BENCH, "run", "--out", runs], check=True, stdout=subprocess.DEVNULL)
    folder.mkdir()
    (folder / "index.md").write_text(EXAMPLE, encoding="utf-8")
    page = folder / "report.html"
    subprocess.run([*BENCH, "report", "-r", runs, "-o", page], check=True, stdout=subprocess.DEVNULL)


def main() -> None:
    from retarget_bench.commands import suite

    urls = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["urls"]
    pages = WORK / "pages"
    shutil.rmtree(pages, ignore_errors=True)
    staged(pages, urls["Repository"])
    (pages / "commands.md").write_text(command_reference(), encoding="utf-8")
    (pages / "api.md").write_text(python_reference(), encoding="utf-8")
    shutil.copy(ROOT / "tools" / "site.css", pages)
    (pages / "suite.schema.json").write_text(suite.schema(), encoding="utf-8")
    example(pages / "example")
    config = (ROOT / "tools" / "site.toml").read_text(encoding="utf-8")
    for name, address in urls.items():
        config = config.replace(f"{{{name}}}", address)
    (WORK / "zensical.toml").write_text(config, encoding="utf-8")
    subprocess.run(
        [sys.executable, "-m", "zensical", "build", "--clean", "--strict", "-f", WORK / "zensical.toml"],
        check=True,
        cwd=WORK,
    )


if __name__ == "__main__":
    main()
