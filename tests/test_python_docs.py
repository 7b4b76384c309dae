"""The examples of docs/python.md and the notebook, run as they stand there."""

from __future__ import annotations

import base64
import json
import os
import re
from collections.abc import Iterator
from html import unescape
from pathlib import Path
from typing import Any

import pytest

import retarget_bench as rb
from retarget_bench.motion import bvh
from retarget_bench.plugins import registry
from tests.in_process import without_processes
from tools import execute_notebook
from tools.execute_notebook import NOTEBOOK, carried_out

DOCS = Path(__file__).parents[1] / "docs"
CASE = "boris>clara/leap"


def cells() -> list[dict[str, Any]]:
    return json.loads(NOTEBOOK.read_text(encoding="utf-8"))["cells"]


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Iterator[Path]:
    """One folder for both, as what the one has computed the other need not; no processes."""
    before = Path.cwd()
    session = tmp_path_factory.mktemp("session")
    with without_processes(), pytest.MonkeyPatch.context() as patch:
        patch.setattr(registry, "_FILES", {})
        os.chdir(session)
        yield session
        os.chdir(before)


@pytest.fixture(scope="module")
def shown(folder) -> dict[str, Any]:
    """Source of a cell -> what it shows."""
    names: dict[str, Any] = {}
    return {
        source: carried_out(source, names)
        for cell in cells()
        if cell["cell_type"] == "code"
        for source in ["".join(cell["source"])]
    }


def of(shown: dict[str, Any], *words: str) -> list[Any]:
    """What the cells show that have these words in their last line."""
    return [
        value for source, value in shown.items() if all(word in source.split("\n")[-1] for word in words)
    ]


@pytest.mark.slow
def test_the_notebook_answers_its_five_questions(shown, folder):
    best, user_rows = of(shown, "table().best()")
    assert list(best.columns) == ["cross", "intra", "self"]
    # copies put no foot where it was, and inverse kinematics does
    assert best.loc["contact_recall", "cross"].startswith("ik")
    assert best.loc["mpjpe_h.world", "self"].startswith("copy_rotations")
    assert "my_method" in " ".join(user_rows.to_numpy().ravel())

    (compared,) = of(shown, 'compare("ik"')
    verdicts = compared.frame.set_index(["split", "value"]).verdict
    assert verdicts["cross", "contact_recall"].startswith("ik better")

    worst = next(value for source, value in shown.items() if source.endswith("\nworst"))
    assert worst["mpjpe_h.world"].is_monotonic_decreasing
    (player,) = of(shown, "results.show(")
    assert player.scene.case == worst.case[0]
    assert {figure.label for figure in player.scene.figures} >= {"source", "reference", "ik"}

    (own,) = of(shown, 'compare("my_method"')
    assert set(own.frame.verdict) != {"the same"}

    written = bvh.parse("answer.bvh")
    assert written.hierarchy.names == bvh.parse("my_character.bvh").hierarchy.names
    assert written.frames == bvh.parse("my_motion.bvh").frames
    assert (folder / "report.html").stat().st_size > 100_000


@pytest.mark.slow
def test_what_a_notebook_shows_is_rich(shown):
    for value in shown.values():
        if value is not None and not isinstance(value, Path | str):
            assert "<" in (value._repr_html_() if hasattr(value, "_repr_html_") else f"<{value!r}>")
    table = of(shown, "results.table()")[0]
    html = table._repr_html_()
    assert html.count('<table class="results"') == 1  # all splits side by side
    assert "<script" not in html
    assert "body {" not in html


@pytest.mark.slow
def test_a_comparison_is_shown_in_lines_that_are_not_broken(shown):
    (compared,) = of(shown, 'compare("ik"')
    page = compared._repr_html_()
    assert page.startswith('<pre style="white-space: pre;')
    assert unescape(re.sub("<.*?>", "", page)) == str(compared)


def stored(cell: dict[str, Any]) -> str:
    """The text that a code cell of the notebook shows."""
    return "".join(line for output in cell["outputs"] for line in output["data"]["text/plain"])


@pytest.mark.slow
def test_the_notebook_shows_what_todays_code_does(shown):
    for cell in cells():
        if cell["cell_type"] == "code":
            value = shown["".join(cell["source"])]
            now = "" if value is None else execute_notebook.text(value)
            assert stored(cell) == now, "write it again: python -m tools.execute_notebook"


def test_the_notebook_is_stored_with_its_outputs():
    first, install, *_ = cells()
    assert "colab.research.google.com/github/OWNER/retarget-bench/blob/main/docs/" in first["source"][0]
    assert "%pip install --quiet retarget-bench" in install["source"][-1]
    code = [cell for cell in cells() if cell["cell_type"] == "code"]
    assert [cell["execution_count"] for cell in code] == [*range(1, len(code) + 1)]
    pictures = [
        each for cell in code for output in cell["outputs"] if (each := output["data"].get("image/png"))
    ]
    assert len(pictures) == 2
    assert all(base64.b64decode(each).startswith(b"\x89PNG") for each in pictures)
    assert NOTEBOOK.stat().st_size < 400_000


@pytest.mark.slow
def test_a_player_of_the_notebook_plays(shown, open_page, tmp_path):
    (player,) = of(shown, "results.show(")
    page = tmp_path / "notebook.html"
    page.write_text(f"<!doctype html><title>notebook</title>{player._repr_html_()}", encoding="utf-8")
    opened = open_page(page)
    frame = opened.frame_locator("iframe")
    frame.get_by_role("button", name="Play", exact=True).wait_for()
    assert frame.locator(".rp-readout").inner_text().startswith(f"1 / {player.scene.frames} ")
    assert frame.get_by_role("checkbox", name="reference").is_checked()
    opened.wait_for_function(
        "(frame => frame.clientHeight === frame.contentDocument.documentElement.scrollHeight)"
        "(document.querySelector('iframe'))"
    )


@pytest.mark.slow
def test_the_examples_of_the_page_run(shown, folder, capsys):
    results = rb.load_results()
    for name in ("walk", "run"):
        results.motion(CASE, "source").save(f"{name}.bvh")
    results.motion(CASE).at(slice(1)).save("me.bvh")
    blocks = re.findall(r"```python\n(.*?)```", (DOCS / "python.md").read_text(encoding="utf-8"), re.DOTALL)
    assert len(blocks) > 8
    names: dict[str, Any] = {}
    for block in blocks:
        carried_out(block, names)
    assert Path("paper_results").is_dir()
    assert len(rb.load_results("quick").methods) == 3
    assert capsys.readouterr().out.endswith(blocks[-1].split("# ")[-1])


def test_the_python_of_the_readme_runs(folder, capsys):
    text = (DOCS.parent / "README.md").read_text(encoding="utf-8")
    (block,) = re.findall(r"```python\n(.*?)```", text, re.DOTALL)
    carried_out(block, {})
    printed = capsys.readouterr().out
    assert "ik against pan: puppets-1.0 tiny: people, cross" in printed
    assert Path("report.html").stat().st_size > 100_000
