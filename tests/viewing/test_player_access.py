"""The player for everybody: names, words, contrast, small screens, and no motion that nobody asked for."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from acted import acted, figure, hostile, scene
from playing import SHOWN, button, until
from viewing_toys.toy_moves import PERSON, body

from retarget_bench.figures import palette
from retarget_bench.viewer import player

EVERY = palette.COLOURS + palette.CONTROLS + (palette.SOURCE, palette.REFERENCE)


def test_it_starts_by_itself_only_where_motion_is_welcome(mounted):
    opened = mounted(options={"autoplay": True}, reduced_motion="reduce")
    assert button(opened, "Play").is_visible()
    opened = mounted(options={"autoplay": True, "overlay": True})
    assert button(opened, "Pause").is_visible()
    assert button(opened, "Overlay").get_attribute("aria-pressed") == "true"


def test_everything_has_a_name_and_the_picture_is_told_when_it_rests(mounted):
    opened = mounted()
    for each in opened.locator(".rp button, .rp input, .rp select, .rp canvas").all():
        name = each.evaluate(
            "(e) => e.getAttribute('aria-label') || (e.labels?.length ? e.labels[0] : e).textContent"
        )
        assert name.strip(), each.evaluate("(e) => e.outerHTML")
    opened.evaluate("view.seek(4)")
    live = opened.locator(".rp-live")
    assert live.get_attribute("aria-live") == "polite"
    until(opened, "document.querySelector('.rp-live').textContent === 'Frame 5 of 24'")
    label = opened.locator(".rp-canvas").get_attribute("aria-label")
    assert "a walk. Frame 5 of 24, side by side: source (S); reference (T); good (T)" in label
    assert "broken: failed" in label
    button(opened, "Play").click()
    until(opened, f"{SHOWN} > 9")
    assert live.inner_text() == "Frame 5 of 24", "who listens is not told of every frame"


@pytest.mark.parametrize("dark", [False, True])
def test_it_fits_a_phone(mounted, dark):
    scheme = "dark" if dark else "light"
    opened = mounted(hostile(), scene(), width=360, height=640, color_scheme=scheme)
    for number in (0, 1):
        opened.evaluate("(i) => show(i).ready", number)
        assert opened.evaluate("document.documentElement.scrollWidth") <= 360
    for each in opened.locator(".rp button, .rp select").all():
        box = each.bounding_box()
        assert min(box["width"], box["height"]) >= 24


@pytest.mark.parametrize(("width", "words"), [(360, "under"), (1000, "under the floor")])
def test_how_deep_a_figure_is_can_be_read_in_narrow_panels_too(mounted, width, words):
    opened = mounted(width=width)
    opened.evaluate("""() => {
        window.said = [];
        const letters = CanvasRenderingContext2D.prototype.fillText;
        CanvasRenderingContext2D.prototype.fillText = function (text, ...where) {
            said.push(text);
            letters.call(this, text, ...where);
        };
        view.seek(9);
    }""")
    until(opened, "said.length > 0")
    texts = opened.evaluate("said")
    assert any(re.fullmatch(rf"\d+\.\d cm {words}", each) for each in texts), texts


def luminance(hex_colour: str) -> float:
    """Relative luminance as WCAG 2 defines it."""
    channels = [int(hex_colour[i : i + 2], 16) / 255 for i in (1, 3, 5)]
    linear = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in channels]
    return float(np.dot([0.2126, 0.7152, 0.0722], linear))


@pytest.mark.parametrize("scheme", [0, 1], ids=["light", "dark"])
@pytest.mark.parametrize(
    ("front", "back", "least"),
    [
        ("ink", "paper", 4.5), ("ink", "band", 4.5), ("ink", "stage", 4.5), ("ink", "stage-far", 4.5),
        ("faint", "paper", 4.5), ("faint", "band", 4.5), ("faint", "stage", 4.5),
        ("faint", "stage-far", 4.5), ("on", "accent", 4.5), ("edge", "paper", 3),
        ("focus", "paper", 3), ("slide", "stage", 3), ("sunk", "stage", 3),
    ],
)  # fmt: skip
def test_letters_and_edges_stand_out(front, back, least, scheme):
    css = player.style().split("prefers-color-scheme: dark")[scheme]
    colours = dict(re.findall(r"--rp-([a-z-]+): (#[0-9a-f]{6})\b", css))
    lights = sorted(luminance(colours[name]) + 0.05 for name in (front, back))
    assert lights[1] / lights[0] >= least


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_colours_of_figures_stand_out_from_all_that_is_behind_their_swatches(mounted, scheme):
    person = body("S", PERSON, 1)
    figures = [
        figure(f"m{k}", "prediction", acted(person), acted(person, lean=0.1)) for k in range(len(EVERY))
    ]
    options = {"colours": {each.label: colour for each, colour in zip(figures, EVERY, strict=True)}}
    opened = mounted(replace(scene(), figures=tuple(figures)), options=options, color_scheme=scheme)
    swatches = opened.locator(".rp-swatch").evaluate_all("all => all.map((e) => e.style.backgroundColor)")
    assert len(swatches) == len(EVERY)
    style = "(name) => getComputedStyle(document.querySelector('.rp')).getPropertyValue('--rp-' + name)"
    for name in ("paper", "band", "stage"):
        behind = luminance(opened.evaluate(style, name)) + 0.05
        for each in swatches:
            light = luminance("#{:02x}{:02x}{:02x}".format(*map(int, re.findall(r"\d+", each)))) + 0.05
            assert max(light, behind) / min(light, behind) >= 3, (each, name)


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_source_and_reference_are_told_apart_on_dark_paper_too(mounted, scheme):
    opened = mounted(color_scheme=scheme)
    swatches = opened.locator(".rp-chip .rp-swatch")
    backgrounds = swatches.evaluate_all("all => all.map((e) => e.style.backgroundColor)")[:2]
    hexes = ["#{:02x}{:02x}{:02x}".format(*map(int, re.findall(r"\d+", each))) for each in backgrounds]
    lights = sorted(luminance(each) + 0.05 for each in hexes)
    assert lights[1] / lights[0] >= 3, hexes


def test_every_part_of_the_script_is_in_it_and_every_rule_stays_inside():
    files = {file.stem for file in (Path(player.PAGES) / "player").glob("*.js")}
    assert files == set(player.PARTS)
    rules = re.sub(r"@media[^{]+\{", "", player.style())
    selectors = re.findall(r"([^{}]+)\{[^}]*\}", rules)
    assert len(selectors) > 40
    for each in ",".join(selectors).split(","):
        assert re.match(r"\.rp\b", each.strip()), each
