"""The pages: README.md is short and true of the Makefile; links lead somewhere; words are few."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import pytest

from retarget_bench.analysis import protocols
from retarget_bench.api import MetricCard
from retarget_bench.plugins import registry

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")
GENERATED = "docs/protocols.md"
PAGES = sorted(
    path.relative_to(ROOT).as_posix()
    for pattern in (
        "*.md",
        "docs/*.md",
        "docs/tutorials/*.md",
        "results/*.md",
        "datasets/**/*.md",
        "benchmarks/*.md",
    )
    for path in ROOT.glob(pattern)
)


def test_it_is_short():
    assert len(README.splitlines()) <= 100


def test_its_two_commands_are_targets_of_the_makefile():
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    blocks = re.findall(r"```sh\n(.*?)```", README, re.DOTALL)
    commands = [line for block in blocks for line in block.splitlines() if line.startswith("make ")]
    assert commands == ["make bench", "make test"]
    for line in commands:
        assert re.search(rf"^{line.split()[1]}:", makefile, re.MULTILINE)


def test_there_are_few_pages_of_few_words():
    written = [page for page in PAGES if page.startswith("docs/") and page != GENERATED]
    assert len(written) <= 20
    assert sum(len((ROOT / page).read_text(encoding="utf-8").split()) for page in written) <= 27_000
    assert len(list((ROOT / "results").glob("*.md"))) <= 11  # ten, and the log of accepted changes


def test_addresses_are_those_of_the_project():
    """Of the repository and its site, wherever they stand: [project.urls] is where they are decided."""
    urls = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["urls"]
    owner = urls["Repository"].split("/")[-2]
    patterns = (
        "*.md",
        "*.yml",
        "*.cff",
        "*.toml",
        "docs/**/*.md",
        "docs/*.ipynb",
        ".github/**/*.yml",
        "tools/*",
    )
    written = {
        found
        for pattern in patterns
        for path in ROOT.glob(pattern)
        if path.is_file()
        for found in re.findall(
            r"(?:github\.com/|github/|https://|uses: )([\w-]+)(?:\.github\.io)?/retarget-bench\b",
            path.read_text(encoding="utf-8"),
        )
    }
    assert written == {owner}


def headings(page: Path) -> set[str]:
    """The anchors that a page offers: its headings outside of code, as GitHub spells them."""
    text = re.sub(r"^```.*?^```", "", page.read_text(encoding="utf-8"), flags=re.DOTALL | re.MULTILINE)
    lines = re.findall(r"^#+ (.*)$", text, re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", line).lower().replace(" ", "-") for line in lines}


@pytest.mark.parametrize("page", PAGES)
def test_links_lead_to_files_and_headings(page):
    text = (ROOT / page).read_text(encoding="utf-8")
    for target in re.findall(r"\]\(([^)\s]+)\)", text):
        if "://" in target:
            continue
        path, _, heading = target.partition("#")
        there = (ROOT / page).parent / path if path else ROOT / page
        assert there.exists(), f"{page} links to {target}"
        assert not heading or heading in headings(there), f"{page} links to {target}"


def test_pages_that_code_names_exist():
    """In docstrings, messages and scripts, ``docs/x.md`` and ``results/x.md``."""
    folders = ("retarget_bench", "methods", "metrics", "datasets", "tools", "benchmarks")
    files = [
        file for name in folders for end in ("py", "sh", "json") for file in (ROOT / name).rglob(f"*.{end}")
    ]
    references = {
        (file.relative_to(ROOT).as_posix(), page)
        for file in files
        for page in re.findall(r"\b(?:docs|results)/\w+\.md", file.read_text(encoding="utf-8"))
    }
    assert len(references) > 10
    assert not [(file, page) for file, page in references if not (ROOT / page).is_file()]


def test_files_that_pages_name_exist():
    """Paths in backticks: from the root of the repository, in ARCHITECTURE.md anywhere in the core, too."""
    rooms = "retarget_bench|methods|metrics|datasets|tests|tools|results|docs"
    references = {
        (page, path)
        for page in PAGES
        if page != "ARCHITECTURE.md"
        for path in re.findall(rf"`((?:{rooms})/[\w./-]+)", (ROOT / page).read_text(encoding="utf-8"))
        if "my_" not in path  # the reader's own
    }
    assert len(references) > 20
    assert not [(page, path) for page, path in references if not (ROOT / path).exists()]
    architecture = (ROOT / "ARCHITECTURE.md").read_text(encoding="utf-8")
    inside = {path.rstrip("/") for path in re.findall(r"`(\w+/[\w./-]*)`", architecture)}
    assert len(inside) > 20
    core = ROOT / "retarget_bench"
    folders = [ROOT, core, *(path for path in core.rglob("*") if path.is_dir())]
    assert not [path for path in inside if not any((folder / path).exists() for folder in folders)]


# ------------------------------------------------------------------------------------ the page of protocols
PAGE = Path(__file__).parents[1] / "docs" / "protocols.md"


def built_in() -> list[MetricCard]:
    return [
        registry.create("metrics", entry.name).card
        for entry in registry.names("metrics")
        if entry.origin == registry.BUILT_IN
    ]


def test_the_committed_page_is_up_to_date() -> None:
    assert PAGE.read_text(encoding="utf-8") == protocols.render(built_in()), (
        "a metric card has changed: write the page again with bench info protocols > docs/protocols.md"
    )
