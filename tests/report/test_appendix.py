"""The page for a paper's appendix: what it says, and that no words overlap or leave it."""

from __future__ import annotations

import csv
import hashlib
import json
import re
import shlex
import zlib
from dataclasses import replace
from pathlib import Path

import matplotlib as mpl
import numpy as np
import pytest

import retarget_bench as rb
from retarget_bench.errors import BenchError
from retarget_bench.figures.plotting import canvas
from retarget_bench.plugins import bound, registry
from retarget_bench.plugins.spec import Spec
from retarget_bench.python.results import load_results
from retarget_bench.report import chapters, sheet
from retarget_bench.report.appendix import Appendix, appendix
from retarget_bench.tables.model import Group
from tests.engine import stored
from tests.engine.small_plans import asked
from tests.in_process import run_here, without_processes
from tests.rendering.small_tables import HOSTILE, make_table
from tests.report.odd_runs import bench, report

LONG = "a_method_with_a_long_name[variant=as_published,weights=local-0123abcd,steps=1000]+footlock"
TOYS = Path(__file__).parents[1] / "tasks" / "toys" / "toy_people.py"


def ran(
    root: Path,
    splits: str = "cross",
    clips: int = 12,
    methods: int = 3,
    failing: int = 0,
) -> Path:
    """Results of so many methods, of which the third fails on some cases and some have long names."""
    random = np.random.default_rng(0)
    for split in splits.split():
        for k in range(methods):
            values = [{"mpjpe_h.world": each} for each in random.uniform(k + 1, k + 2, clips)]
            values[clips - failing * (k == 2) :] = ["failed"] * failing * (k == 2)
            cases = [("a>b", f"c{number}", each) for number, each in enumerate(values)]
            label = f"{LONG}{k}" if k % 5 == 1 else f"m{k}"
            about = {"label": label, "trained_on": {"clips": ["x"]} if k % 2 else None}
            stored.store(root, split, f"m{k}", cases, **about)
    return root


def pages(root: Path) -> list[Appendix]:
    return [appendix(chapter) for chapter in chapters.chapters([root])]


def words(page: Appendix, foot: str = "Page 1 of 1.") -> str:
    """All words of a drawn page, of which no two overlap and none stands in its margins."""
    with canvas.styled(), mpl.rc_context({"text.hinting": "none"}):  # as in PDF
        figure = sheet.drawn(page, foot)
        figure.set_dpi(360)
        renderer = figure.canvas.get_renderer()
        boxes = np.array([each.get_window_extent(renderer).extents for each in figure.texts]) / 5
    texts, slack = [each.get_text() for each in figure.texts], 0.5  # points
    low, high = boxes[:, :2], boxes[:, 2:]
    edge = sheet.MARGIN - slack
    outside = (low < edge) | (high > np.array([sheet.WIDTH, sheet.HEIGHT]) - edge)
    assert not [(texts[i], boxes[i]) for i in np.flatnonzero(outside.any(axis=1))]
    shared = np.minimum(high[:, None], high[None]) - np.maximum(low[:, None], low[None])
    overlap = (shared > slack).all(axis=-1) & ~np.eye(len(boxes), dtype=bool)
    assert not [(texts[i], texts[k]) for i, k in np.argwhere(overlap)]
    return " ".join(texts)


@pytest.mark.parametrize(
    "hard",
    [
        {"splits": "a b c", "methods": 25},
        {"splits": "a b c d e f", "methods": 7},
        {"clips": 14, "failing": 5},
        {"clips": 4},
    ],
    ids=str,
)
def test_the_page_has_the_numbers_of_the_table_or_says_which_it_leaves_out(tmp_path, hard):
    (page,) = pages(ran(tmp_path, **hard))
    said = words(page)
    drawn = said.partition(" method ")[2].partition("Left out")[0].partition("Numbers")[0]
    rows = re.findall(r"(?<= )m\d+(?= )|footlock\d+", drawn)
    left = re.search(r"Left out for want of room: (\d+) more rows", said)
    assert len(rows) + int(left[1] if left else 0) == hard.get("methods", 3)
    table = bench("table", "-r", tmp_path, "--intervals")
    for line in table.splitlines():
        if (name := line.split()[0] if line.split() else "") in rows:
            assert set(re.findall(r"\d+\.\d+", line)) <= set(re.findall(r"\d+\.\d+", said))
    assert ("–" in said) == ("–" in table) == (hard.get("clips", 12) >= 10), name


def test_columns_that_do_not_fit_are_named_and_hostile_words_are_drawn(tmp_path):
    table = make_table()
    group = table.groups[0]
    many = Appendix(
        title=" ".join(HOSTILE),
        lead="",
        groups=(repeated(group, 5), *table.groups * 5),
        below=(*HOSTILE, "x" * 900),
        items=tuple((f"h{k}", each * 40) for k, each in enumerate(HOSTILE)),
    )
    said = words(many)
    assert re.search(r"Left out for want of room: columns .*recall", said)
    assert re.search(r"Left out for want of room: (cross|intra): \d+ cases", said)
    assert sheet.MORE in said
    assert "$ # _" in said


def repeated(group: Group, times: int) -> Group:
    """The group with its columns so many times."""

    def wider(rows):
        return tuple(replace(row, cells=row.cells * times) for row in rows)

    return replace(
        group, columns=group.columns * times, ranked=wider(group.ranked), unranked=wider(group.unranked)
    )


def test_of_another_task_methods_are_rows_by_level_and_the_command_names_the_task(tmp_path):
    registry.add_file(TOYS)
    about = {"splits": ("self",), "metrics": ("restoration",), "task": "denoise[levels='0,5']"}
    run_here(asked(tmp_path, "identity", "gaussian_filter", data="toy_people[clips=2]", **about))
    (page,) = pages(tmp_path)
    said = words(page)
    assert "the clean motion" in said
    assert re.findall(r"(\S+ \S+) \(n \d+\)", said)[:2] == [row.label for row in page.groups[0].rows]
    command = shlex.split(dict(page.items)["The numbers again"])
    assert command[:2] == ["bench", "run"]
    assert set(command[2:4]) == {"identity", "gaussian_filter"}
    assert command[command.index("--task") + 1] == about["task"]


def test_checksums_are_those_of_the_files_and_what_is_unknown_is_said_to_be(tmp_path):
    (page,) = pages(ran(tmp_path))
    items = dict(page.items)
    for file in (tmp_path / "data" / "retarget" / "cross").glob("m?.csv"):
        checksum = hashlib.sha256(file.read_bytes()).hexdigest()[:8]
        assert f"cross unknown/{checksum}" in items["Methods, licences, keys, checksums"]
    assert "licence: unknown; to get it: unknown" in items["Data and licence"]
    assert "unknown" in items["Compute"]
    assert f"{LONG}1 windows, time and seed unknown" in items["Training of learned methods"]


def test_training_is_that_of_the_weights_that_gave_the_results(tmp_path):
    built = bound.method(Spec("nkn")).built
    seen = {name: list(each) for name, each in built.training_manifest.items()}
    cases = [("a>b", f"c{k}", {"mpjpe_h.world": 1.0 + k}) for k in range(3)]
    known = {"version": built.card.version, "trained_on": seen}
    stored.store(tmp_path, "cross", "nkn", cases, **known)
    (page,) = pages(tmp_path)
    record = built.weights_card
    assert (
        f"{record.steps * record.recipe.batch:,} windows" in dict(page.items)["Training of learned methods"]
    )
    stored.store(tmp_path, "cross", "nkn", cases, **known | {"trained_on": {"clips": ["others"]}})
    (page,) = pages(tmp_path)
    assert "nkn windows, time and seed unknown" in dict(page.items)["Training of learned methods"]


def text(data: bytes) -> str:
    """The words of a PDF, as a search finds them."""
    streams = re.findall(rb"stream\r?\n(x.*?)\r?\nendstream", data, re.S)
    shown = re.findall(rb"\(((?:\\.|[^\\)])*)\)", b"".join(map(zlib.decompress, streams)))
    return b"".join(shown).replace(b"\0", b"").decode("latin-1")


def test_the_file_is_the_same_again_with_a_page_a_chapter_and_text_that_can_be_found(tmp_path, monkeypatch):
    ran(tmp_path / "r")
    files = [tmp_path / "one.pdf", tmp_path / "two.pdf"]
    report(tmp_path / "r", "-o", files[0])
    assert load_results(tmp_path / "r").report(files[1]) == files[1]
    data = files[0].read_bytes()
    assert data == files[1].read_bytes()
    assert b"/FontFile2" in data
    assert b"/Type3" not in data
    assert b"CreationDate" not in data
    assert "What may not be concluded" in text(data)
    sheet.write(files[1], pages(tmp_path / "r") * 2)
    assert "Page 2 of 2; page 1: Motion retargeting" in text(files[1].read_bytes())
    monkeypatch.setattr(sheet, "drawn", lambda *_: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        report(tmp_path / "r", "-o", files[0])
    assert files[0].read_bytes() == data
    assert sorted(tmp_path.glob("*.pdf")) == sorted(files)


def test_motion_in_a_pdf_is_refused(tmp_path):
    with pytest.raises(BenchError, match="has no motion"):
        report(ran(tmp_path), "-o", tmp_path / "x.pdf", "--skins")
    assert not (tmp_path / "x.pdf").exists()


@pytest.mark.parametrize("name", ["x.pdf", "x.html"])
def test_results_without_any_number_are_refused_in_a_sentence(tmp_path, name):
    registry.add_file(TOYS)
    about = {"splits": ("self",), "metrics": ("restoration",), "task": "denoise[levels='5']"}
    run_here(asked(tmp_path, "ik", data="toy_people[clips=2]", **about))  # which needs rotations
    with pytest.raises(BenchError, match="no result here has a number"):
        report(tmp_path, "-o", tmp_path / name)


def test_facts_are_those_of_cards_and_cases(tmp_path):
    """Of a small run with a learned and a stochastic method: beside what their files say."""
    with without_processes():
        rb.run(["pan", "ik", "other_clip"], splits="cross", limit=2, metrics="position", out=str(tmp_path))
    (page,) = pages(tmp_path)
    items = dict(page.items)
    card = Path(__file__).parents[2] / "methods" / "pan" / "weights" / "puppets.json"
    pan = json.loads(card.read_text())
    windows = f"{pan['steps'] * pan['recipe']['batch']:,}"
    training = items["Training of learned methods"]
    assert re.search(
        rf"{pan['data']['clips']} clips, .*: pan {windows} windows in 62 min, seed {pan['seed']} ", training
    )
    assert "licence: CC0 1.0" in items["Data and licence"]
    assert items["Seeds and runs"].endswith("seed: 0. Stochastic methods: other_clip.")
    assert "tests: none" in items["Protocol"]  # of fewer than ten clips
    rows = csv.DictReader(next(tmp_path.rglob("cases.csv")).open(encoding="utf-8"))
    done = {name for row in [*rows] for name in (row["source"], row["target"])}
    (count,) = re.findall(r"(\d+) characters in all", items["Protocol"])
    assert 2 <= int(count) <= len(done)
    assert re.search(
        r"share of the papers' windows: pan at least 0\.\d+ %", items["What may not be concluded"]
    )
    assert "Licence of the benchmark: ik" in items["Methods, licences, keys, checksums"]


def test_a_page_of_tested_methods_says_how_they_were_tested(tmp_path):
    (page,) = pages(ran(tmp_path))
    items = dict(page.items)
    assert "paired sign flips of clips" in items["Protocol"]
    assert (
        "A difference that is not significant does not mean equality." in items["What may not be concluded"]
    )
    assert "2 characters in all" in items["Protocol"]
