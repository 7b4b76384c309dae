"""What the player draws, loosely: small grey pictures that a person looked at, and found right.

``python tests/viewing/test_player_pictures.py`` draws them anew; look at them before they are committed.
"""

from __future__ import annotations

import io
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from acted import scene
from PIL import Image
from playing import frame

from retarget_bench.viewer.scene import Scene

PICTURES = Path(__file__).parent / "pictures"
SIZE = (120, 60)
TOLERANCE = 0.4
"""Of 255, mean over the picture: another font costs 0.1, a figure that is not there 0.6 at least."""
KINDS: dict[str, tuple[dict, dict]] = {
    "beside": ({"width": 1000}, {}),
    "overlaid": ({"width": 1000, "color_scheme": "dark"}, {"overlay": True}),
    "phone": ({"width": 360, "height": 640}, {}),
}
"""Name -> how the page is opened, and how the player is mounted."""


def shown() -> Scene:
    return scene(12)


def without(label: str) -> Scene:
    """The same scene, in which a figure has nothing to show."""
    made = shown()
    figures = [
        replace(each, positions=None, error=None, planted=None) if each.label == label else each
        for each in made.figures
    ]
    return replace(made, figures=tuple(figures))


def drawn(opened) -> np.ndarray:
    """``SIZE`` as rows and columns: grey values of what the canvas shows on the screen."""
    frame(opened)
    image = Image.open(io.BytesIO(opened.locator(".rp-canvas").screenshot()))
    return np.asarray(image.convert("L").resize(SIZE, Image.Resampling.BOX), dtype=float)


def apart(one: np.ndarray, name: str) -> float:
    stored = np.asarray(Image.open(PICTURES / f"{name}.png"), dtype=float)
    return float(np.abs(one - stored).mean())


@pytest.mark.parametrize("name", KINDS)
def test_pictures_are_as_they_were_and_differ_where_a_figure_is_missing(mounted, name):
    context, options = KINDS[name]
    opened = mounted(shown(), without("sunk"), options={**options, "frame": 6}, **context)
    assert apart(drawn(opened), name) < TOLERANCE
    opened.evaluate("(options) => show(1, options).ready", {**options, "frame": 6})
    assert apart(drawn(opened), name) > TOLERANCE
    opened.evaluate("view.select([])")
    assert apart(drawn(opened), name) > 10 * TOLERANCE


def remake() -> None:
    """Draws the stored pictures."""
    from acted import page
    from browser import found
    from playwright.sync_api import sync_playwright

    PICTURES.mkdir(exist_ok=True)
    with sync_playwright() as running:
        browser = running.chromium.launch(executable_path=found(), args=["--no-sandbox"])
        for name, (context, options) in KINDS.items():
            size = {"width": context["width"], "height": context.get("height", 800)}
            opened = browser.new_page(viewport=size, color_scheme=context.get("color_scheme", "light"))
            opened.set_content(page(shown(), options={**options, "frame": 6}))
            opened.evaluate("view.ready")
            grey = drawn(opened).round().astype(np.uint8)
            Image.fromarray(grey).save(PICTURES / f"{name}.png", optimize=True)
        browser.close()


if __name__ == "__main__":
    remake()
