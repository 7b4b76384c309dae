"""Where the player looks: bodies are whole in their panels, scrolling is no turning."""

from __future__ import annotations

from acted import acted, figure
from playing import RED, button, frame, picture
from viewing_toys.toy_moves import DOG, body

from retarget_bench.viewing.scene import Scene


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
