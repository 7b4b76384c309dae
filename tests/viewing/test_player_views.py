"""Where the player looks: bodies are whole in their panels, scrolling is no turning, the far may leave."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from acted import FRAMES, acted, figure, scene
from playing import RED, button, frame, picture
from viewing_toys.toy_moves import DOG, body

from retarget_bench.viewer.scene import Figure, Scene

HEARD = """() => {
    window.said = new Set();
    const letters = CanvasRenderingContext2D.prototype.fillText;
    CanvasRenderingContext2D.prototype.fillText = function (text, ...where) {
        said.add(text);
        letters.call(this, text, ...where);
    };
}"""
"""From now on, everything that is written on the picture is in ``said``."""


def test_heads_and_tails_are_in_the_panel_with_all_that_is_round_about_them(mounted):
    joints = DOG | {"Head": ("Neck", (0, 0.05, 0.5))}  # farther from the hips than anything else
    long = figure("long", "motion", acted(body("dog", joints), 2))
    options = {"colours": {"long": "#d00000"}}
    opened = mounted(Scene("dog", (long,), 30.0), options=options, width=400)
    for name in ("Side", "Contacts"):
        button(opened, name).click()
    frame(opened)
    assert opened.evaluate(RED, 0.5) > 500
    assert opened.evaluate(RED, 0.004) == 0


def test_a_finger_that_scrolls_the_page_leaves_the_view_as_it_was(mounted):
    opened = mounted(has_touch=True, width=400, height=500)
    box = opened.locator(".rp-canvas").bounding_box()
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    session = opened.context.new_cdp_session(opened)
    still = picture(opened)
    opened.evaluate(
        "() => { window.turned = 0; window.ended = [];"
        " const canvas = document.querySelector('.rp-canvas');"
        " canvas.addEventListener('pointermove', () => turned++);"
        " for (const name of ['pointerup', 'pointercancel'])"
        "   canvas.addEventListener(name, () => ended.push(name)); }"
    )
    moves = [("touchStart", y), *(("touchMove", y - far) for far in range(5, 90, 5)), ("touchEnd", None)]
    for kind, at in moves:
        points = [] if at is None else [{"x": x + (y - at) / 4, "y": at, "id": 0}]
        session.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})
    assert picture(opened) == still
    assert opened.evaluate("scrollY") > 20
    assert opened.evaluate("turned") > 0, "the view was turned before the browser took the finger away"
    assert opened.evaluate("ended") == ["pointercancel"]


def gone(original: Scene, label: str, far: float) -> Scene:
    """The same, but a figure goes so many metres away by the last frame."""
    way = np.linspace(0.0, far, original.frames)[:, None, None] * [1.0, 0.0, 0.0]

    def moved(each: Figure) -> Figure:
        return replace(each, positions=each.positions + way, motion=None)

    return replace(original, figures=tuple(moved(f) if f.label == label else f for f in original.figures))


def alone_and_among(opened, labels: list[str], label: str) -> tuple[int, int, list[str]]:
    """Red pixels of some figures, and with one more; and what is said to be out of view then."""
    opened.evaluate("(labels) => view.select(labels)", labels)
    frame(opened)
    before = opened.evaluate(RED, 0.5)
    opened.evaluate(HEARD)
    opened.evaluate("(labels) => view.select(labels)", [*labels, label])
    frame(opened)
    out_of_view = [text for text in opened.evaluate("[...said]") if "out of view" in text]
    return before, opened.evaluate(RED, 0.5), [text.split()[0] for text in out_of_view]


def test_who_goes_far_away_does_not_make_the_others_tiny(mounted):
    options = {"overlay": True, "frame": FRAMES - 1, "colours": {"reference": "#d00000"}}
    opened = mounted(gone(scene(), "leaning", 30.0), options=options)
    button(opened, "Contacts").click()  # slides are red, too
    before, after, out_of_view = alone_and_among(opened, ["source", "reference", "good", "sunk"], "leaning")
    assert before > 500
    assert abs(after - before) < 0.05 * before
    assert out_of_view == ["leaning"]


def test_alone_it_is_in_view_wherever_it_goes(mounted):
    opened = mounted(gone(scene(), "leaning", 30.0), options={"overlay": True, "frame": FRAMES - 1})
    assert alone_and_among(opened, [], "leaning")[2] == []
