"""The site and the cards for hubs: every page is in the menu, links lead where the repository's do."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import pytest
import yaml

from retarget_bench.plugins import registry
from tools import build_docs, release_assets

ROOT = Path(__file__).parents[1]
NAMES = {"README.md", "docs/start.md", "results/README.md", "docs/pictures/throw.png"}


def menu(entries):
    """The files of a menu."""
    for entry in entries:
        for below in entry.values():
            yield from [below] if isinstance(below, str) else menu(below)


def test_every_page_is_in_the_menu():
    listed = set(menu(tomllib.loads((ROOT / "tools" / "site.toml").read_text())["project"]["nav"]))
    pages = {
        build_docs.page_name(path.relative_to(ROOT).as_posix())
        for pattern in ("docs/**/*.md", "results/*.md")
        for path in ROOT.glob(pattern)
    }
    assert pages <= listed
    made = {"commands.md", "api.md", "example/index.md"}
    assert all((ROOT / page.replace("index.md", "README.md")).exists() for page in listed - made)


@pytest.mark.parametrize(
    ("page", "link", "expected"),
    [
        ("README.md", "docs/start.md#commands", "docs/start.md#commands"),
        ("docs/start.md", "../README.md", "../index.md"),
        ("README.md", "results/README.md", "results/index.md"),
        ("docs/start.md", "../tools/x.py", "https://here/blob/main/tools/x.py"),
        ("results/README.md", "../methods", "https://here/tree/main/methods"),
        ("docs/start.md", "https://else.where/x.md", "https://else.where/x.md"),
        ("docs/start.md", "pictures/throw.png", "pictures/throw.png"),
    ],
)
def test_links_lead_to_pages_here_and_to_other_files_in_the_repository(page, link, expected):
    assert build_docs.relinked(f"[x]({link})", page, NAMES, "https://here") == f"[x]({expected})"


def test_the_reference_has_every_command_with_its_options():
    text = build_docs.command_reference()
    assert "## bench run\n" in text
    assert re.search(r"^ +--overwrite ", text, re.MULTILINE)


@pytest.mark.parametrize(("method", "name"), [("paired", "puppets"), ("pan", "puppets_three")])
def test_cards_for_hubs_have_metadata_and_a_command_that_is_one(method, name):
    _, head, text = release_assets.hub_card(method, name).split("---\n", 2)
    facts = yaml.safe_load(head)
    assert facts["license"] == "apache-2.0"
    (index,) = facts["model-index"]
    assert {each["task"]["name"].split()[-1] for each in index["results"]} == {"self", "intra", "cross"}
    assert all(number["value"] > 0 for each in index["results"] for number in each["metrics"])
    (spec,) = re.findall(r"bench info '(.*)'", text)
    registry.canonical("methods", spec)


def test_the_python_reference_has_the_keywords_that_calls_take():
    text = build_docs.python_reference()
    run = text.partition("## rb.run\n")[2].partition("\n## ")[0]
    assert "    splits: str | Sequence[str] = (),\n" in run
    assert "- `splits`: Splits" in run
    assert "### Results.compare\n" in text
