"""The site and the cards for hubs: every page is in the menu, links lead where the repository's do."""

from __future__ import annotations

import ast
import re
import tomllib
from pathlib import Path

import pytest
import yaml

from retarget_bench.plugins import registry
from retarget_bench.training import released
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


def test_every_file_of_weights_gets_a_card_and_the_name_that_is_fetched(tmp_path, monkeypatch):
    release_assets.write(tmp_path)
    cards = sorted((ROOT / "methods").glob("*/weights/*.json"))
    assert len(cards) > 10
    for path in cards:
        method, name = path.parts[-3], path.stem
        _, head, text = (tmp_path / "hub" / f"{method}-{name}" / "README.md").read_text().split("---\n", 2)
        facts = yaml.safe_load(head)
        assert (facts["license"], facts["library_name"]) == ("apache-2.0", "retarget-bench")
        (index,) = facts["model-index"]
        assert all(number["value"] > 0 for each in index["results"] for number in each["metrics"])
        for spec in re.findall(r"bench (?:info|run) '(.*?)'", text):
            registry.canonical("methods", spec)
    asked = []
    monkeypatch.setattr("pooch.retrieve", lambda url, *_, **__: asked.append(url) or 1 / 0)
    for parts in released.listed(ROOT / "methods" / released.LIST):
        with monkeypatch.context() as patch:
            patch.setattr(Path, "exists", lambda path: False)
            with pytest.raises(ZeroDivisionError):
                released.at_hand(ROOT.joinpath("methods", *parts))
    assert {url.rpartition("/")[2] for url in asked} < {
        path.name for path in tmp_path.glob("*.safetensors")
    }


def test_the_python_reference_has_the_keywords_that_calls_take():
    text = build_docs.python_reference()
    run = text.partition("## rb.run\n")[2].partition("\n## ")[0]
    assert "    splits: str | Sequence[str] = (),\n" in run
    assert "- `splits`: Splits" in run
    assert "### Results.compare\n" in text
    for call in re.findall(r"```python\n(.*?)```", text, re.DOTALL):
        ast.parse(f"def call({call.strip().partition('(')[2]}: ...")  # a signature that Python could have
