"""What a report draws, loosely: small grey pictures that a person looked at, and found right.

``python -m tests.report.test_report_pictures`` draws them anew; look at them before they are committed.
"""

from __future__ import annotations

import io
import tempfile
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from tests.report import odd_runs
from tests.viewing.browser import found

PICTURES = Path(__file__).parent / "pictures"
SIZE = (96, 64)
TOLERANCE = 0.4
"""Of 255, mean over the picture, as for the player; letters are left out, since fonts differ."""
PARTS = {
    "clips": ("#chapter-1-clips svg.chart >> nth=0", ".clip, .box"),
    "pairs": ("#chapter-1-pairs svg.chart >> nth=0", ".heat"),
    "recall": ("#chapter-1-recall svg.chart >> nth=0", ".line, .dot"),
}
"""Name -> what is drawn, and what of it must not be missing."""

AT_CORNER = """(node) => {
  const { width, height } = node.getBoundingClientRect();
  Object.assign(node.style, { position: "fixed", top: 0, left: 0, zIndex: 9, background: "white",
    width: `${Math.round(width)}px`, height: `${Math.round(height)}px` });
}"""
"""Whole pixels, so that what stands above it on the page does not change what is drawn."""


def drawn(page, part: str) -> np.ndarray:
    """``SIZE`` as rows and columns: grey values of a part of the page."""
    chart = page.locator(part)
    chart.evaluate(AT_CORNER)
    image = Image.open(io.BytesIO(chart.screenshot()))
    chart.evaluate("(node) => node.removeAttribute('style')")
    return np.asarray(image.convert("L").resize(SIZE, Image.Resampling.BOX), dtype=float)


def apart(one: np.ndarray, name: str) -> float:
    stored = np.asarray(Image.open(PICTURES / f"{name}.png"), dtype=float)
    return float(np.abs(one - stored).mean())


def alone(page) -> None:
    """Takes away letters, and the player, which stays in sight and covers what is below it."""
    page.evaluate("document.getElementById('watch').remove()")
    page.evaluate("document.querySelectorAll('svg text').forEach((each) => { each.style.opacity = 0; })")


@pytest.fixture
def page(made, open_page):
    opened = open_page(made, width=1000)
    opened.wait_for_selector("#player canvas")
    alone(opened)
    return opened


def test_pictures_are_as_they_were_and_differ_where_marks_are_missing(page):
    for name, (part, marks) in PARTS.items():
        assert apart(drawn(page, part), name) < TOLERANCE, name
        page.locator(part).evaluate(
            "(node, marks) => node.querySelectorAll(marks).forEach((each) => { each.style.opacity = 0; })",
            marks,
        )
        assert apart(drawn(page, part), name) > TOLERANCE, name


def remake() -> None:
    """Draws the stored pictures."""
    from playwright.sync_api import sync_playwright

    PICTURES.mkdir(exist_ok=True)
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as running:
        odd_runs.ran(Path(folder) / "runs")
        file = Path(folder) / "report.html"
        odd_runs.report(Path(folder) / "runs", "-o", file, "--clips", 4)
        browser = running.chromium.launch(executable_path=found(), args=["--no-sandbox"])
        page = browser.new_page(viewport={"width": 1000, "height": 800})
        page.goto(file.as_uri())
        page.wait_for_selector("#player canvas")
        alone(page)
        for name, (part, _) in PARTS.items():
            grey = drawn(page, part).round().astype(np.uint8)
            Image.fromarray(grey).save(PICTURES / f"{name}.png", optimize=True)
        browser.close()


if __name__ == "__main__":
    remake()
