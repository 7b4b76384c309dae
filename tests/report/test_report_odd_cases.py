"""Answers that failed, are positions only or none; one frame, 200 joints, a dog: in reports, pictures."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
from PIL import Image

from retarget_bench.errors import BenchError
from retarget_bench.figures import palette
from tests.report import odd_folder
from tests.report.odd_runs import bench, report
from tests.report.test_report import Tags
from tests.viewing import small_runs

POSITIONS, RAISES = "odd_answers", "odd_answers[does=raise]"


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """BVH files, ``runs`` on them, and ``report.html`` with all cases in motion."""
    root = tmp_path_factory.mktemp("odd")
    odd_folder.write(root / "bvh", odd_folder.BODIES, odd_folder.CLIPS)
    odd_folder.ran(root / "bvh", root / "runs", ("copy_rotations", POSITIONS, RAISES), ("cross",))
    report(root / "runs", "-o", root / "report.html", "--root", root / "bvh")
    return root


@pytest.fixture
def page(folder, open_page):
    opened = open_page(folder / "report.html", width=1200)
    opened.wait_for_selector("#player canvas")
    return opened


def chips(page) -> dict[str, str]:
    """Figure -> what stands beside its name, in the order in which they are listed."""
    page.locator("#player .rp-chip").first.wait_for()  # motion is unpacked after the click
    texts = (each.split("\n") for each in page.locator("#player .rp-chip").all_inner_texts())
    return {name: "".join(rest) for name, *rest in texts}


def figures(page) -> int:
    """How many pixels of the player's picture are darker than paper, floor and shadows."""
    return page.locator("#player .rp-canvas").evaluate(
        """(canvas) => {
          const copy = new OffscreenCanvas(canvas.width, canvas.height);
          const drawn = copy.getContext("2d", { willReadFrequently: true });
          drawn.drawImage(canvas, 0, 0);
          const all = drawn.getImageData(0, 0, canvas.width, canvas.height).data;
          let dark = 0;
          for (let k = 0; k < all.length; k += 4) dark += Math.min(all[k], all[k + 1], all[k + 2]) < 110;
          return dark;
        }"""
    )


def test_every_case_is_drawn_with_all_that_answered(page):
    count = 0
    for bodies in ("people", "mixed"):
        chapters = page.locator("#chapter option").all_inner_texts()
        page.locator("#chapter").select_option(
            index=[each.endswith(bodies) for each in chapters].index(True)
        )
        count += cases_are_drawn(page)
    assert count == 12  # of three bodies and two clips


def cases_are_drawn(page) -> int:
    """Shows every case of the chapter; how many there are."""
    titles = page.locator("#cases button").all_inner_texts()
    for title in titles:
        page.locator("#cases button", has_text=title).click()
        clip, bodies = title.removeprefix("▶ ").split(": ")
        assert page.inner_text("#caption") == f"cross: {clip}, {bodies}"
        beside_name = chips(page)
        assert list(beside_name)[:2] == ["source", "reference"]
        assert beside_name[RAISES] == "failed"
        assert all(beside_name[each].endswith("%") for each in ("copy_rotations", POSITIONS))
        assert "out of <b>ideas</b> & 'words'" in page.inner_text("#player")
        pixels = []
        for label in ("copy_rotations", POSITIONS):
            page.locator("#method").select_option(label=label)
            pixels.append(figures(page))
        assert min(pixels) > 2000
        assert pixels[1] == pytest.approx(pixels[0], rel=0.5)  # solid bodies both
    return len(titles)


def test_a_clip_of_one_frame_can_be_played_and_scrubbed(page):
    page.locator("#chapter").select_option(index=1)
    page.locator("#cases button", has_text="still: dog to many").click()
    page.locator("#player", has_text="1 / 1").wait_for()  # with the next picture
    page.locator("#player .rp-play").click()
    page.locator("#player .rp-canvas").focus()
    for key in ("End", "ArrowRight", "Home"):
        page.keyboard.press(key)
    assert "1 / 1" in page.inner_text("#player")


def test_joints_of_all_bodies_are_drawn_and_failures_are_counted(page):
    skeletons = page.locator("[id$='-joints'] svg.chart")
    bones = skeletons.evaluate_all(
        "all => all.map((each) => each.querySelector('path').getAttribute('d').split('M').length - 1)"
    )
    assert set(bones) == {len(joints) - 1 for joints in odd_folder.BODIES.values()}
    row = page.locator(f'main table.results tr[data-row="{RAISES}"]')
    assert row.locator(".num").all_inner_texts() == ["0/4", "0/8"]
    row.locator(".num").nth(1).click()
    assert page.locator("#cases tr", has_text="failed: RuntimeError: out of <b>ideas</b>").count() == 8


@pytest.mark.parametrize(
    ("case", "file"),
    [("person>many/nod", "a.mp4"), ("many>dog/nod", "b.gif"), ("dog>person/still", "c.mp4")],
)
def test_clips_and_sheets_of_them(folder, tmp_path, case, file):
    source = ("--results", folder / "runs", "--root", folder / "bvh")
    output = bench("render", case, *source, "--size", "640x180", "-o", tmp_path / file)
    assert f"{RAISES}: failed: RuntimeError: out of <b>ideas</b>" in output
    assert (tmp_path / file).stat().st_size > 1000
    bench("render", case, *source, "--size", "1000x200", "-o", tmp_path / "still.png")
    picture = np.asarray(Image.open(tmp_path / "still.png").convert("RGB"), dtype=int)
    assert picture.shape == (200, 1000, 3)
    panels = np.split(picture, 5, axis=1)  # source, reference, three methods
    dark = [(panel.min(axis=2) < 110)[40:].mean() for panel in panels]
    assert min(dark[:4]) > 0.01
    bench("render", case, *source, "--sheet", "-o", tmp_path / "sheet.png")


# ------------------------------------------------------------------------------------- nothing was answered
@pytest.fixture(scope="module")
def failed(tmp_path_factory):
    """Results of two methods, neither of which answered anything."""
    root = tmp_path_factory.mktemp("failed")
    small_runs.ran(root, "raise", "nan")
    return root


def test_a_report_shows_the_sources_and_why_there_is_no_answer(failed, tmp_path, open_page):
    file = tmp_path / "failed.html"
    assert "with 2 cases in motion" in report(failed, "-o", file)
    tags = Tags(file.read_text(encoding="utf-8"))
    split = json.loads(tags.scripts["report-data"])["chapters"][0]["splits"][0]
    assert split["numbers"] == {"mpjpe_h.world": [[None, None]] * 2}
    assert "RuntimeError: out of ideas" in tags.text
    page = open_page(file)
    assert page.locator("#player .rp-canvas").count() == 1
    assert "2 cases, 2 with motion" in page.inner_text("#what")
    assert "out of ideas" in page.inner_text("#cases") + page.inner_text("#player")
    assert not page.locator("svg.chart").count()


@pytest.mark.parametrize("kind", ["growth", "methods"])
def test_a_picture_of_nothing_is_not_drawn(failed, tmp_path, kind):
    with pytest.raises(
        BenchError, match=r"know nothing per second|nobody is ranked|no method of these results has"
    ):
        bench("plot", kind, "-r", failed, "-o", tmp_path / "nothing.png")
    assert list(tmp_path.iterdir()) == []


def test_what_is_infinitely_far_off_has_the_darkest_shade():
    assert palette.shade(math.inf) == palette.shade(1.0) == palette.SHADES - 1
    assert palette.shade(0.0) == palette.shade(-1.0) == 0
