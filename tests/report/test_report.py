"""The page as text: whole, harmless, and with the numbers that the results have."""

import csv
import json
import re
import shutil
from collections import defaultdict
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest

from retarget_bench.errors import BenchError, printable
from retarget_bench.figures import method_order
from retarget_bench.motion.character import Character
from retarget_bench.motion.mesh import Mesh
from retarget_bench.report import chapters, motions
from retarget_bench.report.page import page
from retarget_bench.results import store
from tests.engine import stored
from tests.report.odd_runs import LABEL, report
from tests.report.report_toys.odd_moves import BODIES, CLIPS, JOINTS

KNOWN = re.findall(
    r"\w+",
    """html head meta title style body header main section nav form label select input button noscript
    details summary div span p a ul li dl dt dd h1 h2 h3 h4 em strong small code sup br
    table thead tbody tfoot tr th td i svg g path rect text use defs clippath script""",
)
"""Tags that the page is made of."""


class Tags(HTMLParser):
    """Every tag with its attributes, the text of scripts by their id, and all other text."""

    def __init__(self, source: str) -> None:
        super().__init__()
        self.tags: list[tuple[str, dict[str, str]]] = []
        self.scripts: dict[str, str] = {}
        self.text, self.inside = "", ""
        self.feed(source)
        self.close()

    def handle_starttag(self, tag, attributes):
        self.tags.append((tag, {name: value or "" for name, value in attributes}))
        self.inside = tag

    def handle_endtag(self, tag):
        self.inside = ""

    def handle_data(self, data):
        if self.inside == "script":
            self.scripts[self.tags[-1][1].get("id", "")] = data
        elif self.inside != "style":
            self.text += data


@pytest.fixture(scope="module")
def tags(report_file):
    return Tags(report_file.read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def data(tags):
    return json.loads(tags.scripts["report-data"])


def test_names_are_text_and_nothing_else(tags, data):
    assert {tag for tag, _ in tags.tags} <= set(KNOWN)
    assert not [a for _, attributes in tags.tags for a in attributes if a.startswith("on")]
    for name in (*map(printable, BODIES), *JOINTS, LABEL):
        assert name in tags.text or any(name in v for _, each in tags.tags for v in each.values())
    cases = [case for each in data["chapters"] for split in each["splits"] for case in split["cases"]]
    assert {case["kind"] for case in cases} == set(CLIPS.values())
    assert "49" not in re.findall(r"it's (\S+)", tags.text)


def test_nothing_is_loaded_from_elsewhere(report_file, tags):
    policy = next(each["content"] for tag, each in tags.tags if "http-equiv" in each)
    assert "default-src 'none'" in policy
    links = [each.get("href", each.get("src")) for _, each in tags.tags if {"href", "src"} & each.keys()]
    assert links
    assert all(link.startswith("#") for link in links)
    assert not re.search(
        r"url\((?!#)|@import|https?://(?!www\.w3\.org)", report_file.read_text(encoding="utf-8")
    )


def test_ids_are_there_once_and_every_link_leads_somewhere(tags):
    ids = [each["id"] for _, each in tags.tags if "id" in each]
    assert len(ids) == len(set(ids))
    assert {each["href"][1:] for _, each in tags.tags if "href" in each} <= set(ids)


def test_every_chart_says_in_words_what_it_shows(tags):
    charts = [each for tag, each in tags.tags if tag == "svg" and each.get("class", "").startswith("chart")]
    picks = [each for tag, each in tags.tags if each.get("class") == "pick"]
    assert len(charts) > 5
    assert all(len(each["aria-label"]) > 10 for each in (*charts, *picks))


def test_controls_are_out_of_the_charts_at_first_and_a_legend_says_so(tags):
    buttons = {each["data-style"]: each for tag, each in tags.tags if "data-style" in each}
    (chapter,) = (each for tag, each in tags.tags if each.get("class", "").startswith("chapter"))
    off = {name for name, each in buttons.items() if each["aria-pressed"] == "false"}
    assert {f"off-{name}" for name in off} == set(chapter["class"].split()[1:])
    assert "Controls and variants are out at first" in tags.text or not off


def test_the_page_holds_the_numbers_of_the_results(results, data):
    rows = defaultdict(dict)
    for place in store.find_results(results):
        label = json.loads(place.header.read_text(encoding="utf-8"))["method"]["label"]
        with place.rows.open(encoding="utf-8") as file:
            for row in csv.DictReader(file):
                if row["value_id"] == "mpjpe_h.world":
                    rows[place.split, printable(label)][printable(row["case"])] = float(row["value"])
    count = 0
    for split in data["chapters"][0]["splits"]:
        for label, numbers in zip(split["methods"], split["numbers"]["mpjpe_h.world"], strict=True):
            shown = {c["id"]: n for c, n in zip(split["cases"], numbers, strict=True) if n is not None}
            assert shown == pytest.approx(rows[split["name"], label], rel=5e-4)
            count += len(shown)
    assert count > 20


def test_tables_are_those_of_bench_table(results, tags):
    rows = [each["data-row"] for tag, each in tags.tags if tag == "tr" and "data-row" in each]
    assert rows.count(LABEL) == 3
    tables = [each for tag, each in tags.tags if tag == "table" and each.get("class") == "results"]
    assert [each["data-split"] for each in tables] == ["", "cross", "intra"]  # the first has both


# ---------------------------------------------------------------------------------------------- motion
def test_scenes_are_as_many_as_asked_and_their_cases_say_which(tags, data):
    scenes = [json.loads(text) for name, text in tags.scripts.items() if name.startswith("scene-")]
    assert len(scenes) == 4
    shown = {
        case["scene"]: case["id"]
        for split in data["chapters"][0]["splits"]
        for case in split["cases"]
        if case["scene"] >= 0
    }
    assert [printable(scene["case"]) for scene in scenes] == [shown[k] for k in range(4)]


def test_a_case_can_be_asked_for(results, tmp_path):
    (chapter,) = chapters.chapters([results])
    case = chapter.splits[0].matrix.cases[-1].id
    report(results, "-o", tmp_path / "one.html", "--clips", 0, "--cases", case)
    (scene,) = (
        json.loads(text)
        for name, text in Tags((tmp_path / "one.html").read_text(encoding="utf-8")).scripts.items()
        if name.startswith("scene-")
    )
    assert scene["case"] == case
    with pytest.raises(BenchError, match="no case 'odd'"):
        report(results, "-o", tmp_path / "none.html", "--cases", "odd")


def test_skins_are_there_when_asked_for_and_only_then(results, tmp_path, monkeypatch):
    def triangle(body: Character) -> Mesh:
        weights = np.eye(len(body.skeleton))[[0, 0, 0]]
        return Mesh(np.eye(3), np.array([[0, 1, 2]]), weights)

    monkeypatch.setattr(Character, "mesh", property(triangle))
    for options in ([], ["--skins"]):
        report(results, "-o", tmp_path / "r.html", "--clips", 1, *options)
        (scene,) = (
            json.loads(text)
            for name, text in Tags((tmp_path / "r.html").read_text(encoding="utf-8")).scripts.items()
            if name.startswith("scene-")
        )
        assert any("skin" in body for body in scene["bodies"]) is bool(options)
        assert any(figure["skin"] for figure in scene["figures"]) is bool(options)


def test_what_does_not_fit_is_left_out_and_told(results):
    report_chapters = chapters.chapters([results])
    cases = [(0, 0, 0), (0, 0, 1), (0, 1, 0)]
    (first,) = motions.motions(report_chapters, cases[:1]).scenes
    shown = motions.motions(report_chapters, cases, room=len(first.encode()))
    assert len(shown.scenes) == 1
    assert "2 more cases" in shown.notes[0]
    assert (
        shown.notes[0]
        in Tags(page(report_chapters, shown, method_order.ranked(report_chapters[0].places))).text
    )


def test_predictions_that_are_gone_are_told(results, tmp_path):
    root = tmp_path / "runs"
    shutil.copytree(results, root)
    (chapter,) = chapters.chapters([root])
    place = chapter.splits[0].matrix.rows[0].paths
    case = chapter.splits[0].matrix.cases[0].id
    place.prediction(case).unlink()
    report(root, "-o", tmp_path / "gone.html", "--clips", 0, "--cases", case)
    split = json.loads(Tags((tmp_path / "gone.html").read_text(encoding="utf-8")).scripts["report-data"])[
        "chapters"
    ][0]["splits"][0]
    assert "not there any more" in split["lost"][0]["0"]
    for each in chapter.places:
        shutil.rmtree(each.folder / each.method)
    output = report(root, "-o", tmp_path / "none.html", "--clips", 1)
    assert "Predictions are not stored" in output
    assert "Predictions are not stored" in Tags((tmp_path / "none.html").read_text(encoding="utf-8")).text


def test_results_of_data_that_are_not_here_have_tables_and_a_reason(tmp_path):
    numbers = [(f"a>{b}", f"c{k}", {"mpjpe_h.world": 1.0 + k}) for b in "xy" for k in range(12)]
    for method in ("one", "two"):
        stored.store(tmp_path / "runs", "intra", method, numbers)
    output = report(tmp_path / "runs", "-o", tmp_path / "r.html", "--clips", 2)
    assert "2 cases cannot be shown: " in output
    assert "Distribution over clips" in Tags((tmp_path / "r.html").read_text(encoding="utf-8")).text


def test_without_the_player_no_motion_is_packed(results, tmp_path):
    report(results, "-o", tmp_path / "r.html", "--clips", "0", "-m", LABEL)
    page_tags = Tags((tmp_path / "r.html").read_text(encoding="utf-8"))
    assert not [name for name in page_tags.scripts if name.startswith("scene-")]
    assert "RetargetPlayer = " not in "".join(page_tags.scripts.values())
    assert json.loads(page_tags.scripts["report-data"])["chapters"][0]["splits"][0]["methods"] == [LABEL]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["nowhere"], "no results in nowhere"),
        (["{runs}", "-o", "r.png"], "end its name in .html"),
        (["{runs}", "-m", "toy_metod[does=noise]"], "did you mean"),
        (["{runs}", "--task", "denoise"], "no such results here; there are those of retarget on"),
        (["{runs}", "-d", "mixamo"], "no results of mixamo in"),
    ],
)
def test_what_cannot_be_done_is_told_in_a_sentence(results, tmp_path, monkeypatch, arguments, message):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(BenchError, match=re.escape(message)):
        report(*(each.format(runs=results) for each in arguments))
    assert list(Path().iterdir()) == []
