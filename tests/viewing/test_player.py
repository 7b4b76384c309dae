"""The player in a real browser: it plays, scrubs, steps, turns, overlays and jumps, and never complains."""

from __future__ import annotations

import re

import numpy as np
from acted import EVIL, FRAMES, hostile, many_joints, scene
from playing import SHOWN, box_of, button, frame, picture, until

from retarget_bench.api import Ground
from retarget_bench.motion.ground import ground_height

STAIRS = Ground(heights=np.arange(20.0).reshape(4, 5) % 3 / 10, origin=(-1.0, -0.5), spacing=0.5)


# ------------------------------------------------------------------------------------------ what is read
def test_the_page_reads_what_was_packed(mounted):
    original = scene(ground=STAIRS)
    opened = mounted(original)
    read = opened.evaluate(
        """async () => (await RetargetPlayer.decode(packed(0))).figures.map((each) => ({
            positions: each.positions && [...each.positions], planted: each.planted && [...each.planted],
            error: each.error && [...each.error] }))"""
    )
    for decoded, figure in zip(read[:-1], original.figures[:-1], strict=True):
        back = np.array(decoded["positions"]).reshape(figure.positions.shape)
        assert np.linalg.norm(back - figure.positions, axis=-1).max() < 5e-4
        assert np.array_equal(np.array(decoded["planted"]).reshape(figure.planted.shape), figure.planted)
        if figure.error is not None:
            assert np.abs(np.array(decoded["error"]) - figure.error).max() < 0.0051
    assert read[-1] == {"positions": None, "planted": None, "error": None}
    x, z = np.random.default_rng(0).uniform(-2, 2, (2, 40))
    floor = opened.evaluate(
        """async (places) => { const { ground } = await RetargetPlayer.decode(packed(0));
            return places.map(([x, z]) => RetargetPlayer.floorAt(ground, x, z)); }""",
        np.stack([x, z], axis=1).tolist(),
    )
    assert np.abs(np.array(floor) - ground_height(STAIRS, x, z)).max() < 3e-4


# ------------------------------------------------------------------------------------------ time
def test_it_plays_pauses_and_starts_again_from_the_front(mounted):
    opened = mounted()
    assert frame(opened) == 1
    button(opened, "Play").click()
    until(opened, f"{SHOWN} > 3")
    frames = opened.evaluate(
        """() => new Promise((done) => {
            const seen = [];
            const look = () => {
                seen.push(parseInt(document.querySelector('.rp-readout').textContent));
                if (seen.some((each, i) => each < seen[i - 1])) done(seen);
                else requestAnimationFrame(look);
            };
            look(); })"""
    )
    assert max(frames) <= FRAMES
    button(opened, "Pause").click()
    assert frame(opened) == frame(opened)
    assert button(opened, "Play").is_visible()


def test_slider_curve_and_buttons_go_to_frames(mounted):
    opened = mounted()
    opened.get_by_role("slider", name="Frame").fill("11")
    assert frame(opened) == 12
    button(opened, "One frame on").click()
    assert frame(opened) == 13
    button(opened, "One frame back").click(click_count=2)
    assert frame(opened) == 11
    button(opened, "Last frame").click()
    assert frame(opened) == FRAMES
    button(opened, "One frame on").click()
    assert frame(opened) == FRAMES
    button(opened, "First frame").click()
    assert frame(opened) == 1
    box = opened.locator(".rp-curve").bounding_box()
    opened.mouse.click(box["x"] + box["width"] / 2, box["y"] + 20)
    assert frame(opened) in (FRAMES // 2, FRAMES // 2 + 1)
    opened.get_by_role("combobox", name="Speed").select_option("0.25×")
    opened.evaluate("view.seek(7)")
    assert frame(opened) == 8


# ------------------------------------------------------------------------------------------ keys
def test_keys_work_in_the_player_and_nowhere_else(mounted):
    opened = mounted()
    opened.locator("#elsewhere").focus()
    for key in ("ArrowRight", "o", "End"):
        opened.keyboard.press(key)
    assert frame(opened) == 1
    assert button(opened, "Overlay").get_attribute("aria-pressed") == "false"
    opened.locator(".rp-canvas").focus()
    expected = {"ArrowRight": 2, "Shift+ArrowRight": 12, "ArrowLeft": 11, "End": FRAMES, "Home": 1}
    for key, there in expected.items():
        opened.keyboard.press(key)
        assert frame(opened) == there, key
    opened.keyboard.press("Space")
    assert button(opened, "Pause").is_visible()
    opened.keyboard.press("Space")
    opened.keyboard.press("3")
    assert not box_of(opened, "good").is_checked()
    opened.keyboard.press("]")
    assert opened.get_by_role("combobox", name="Speed").input_value() == "2"


def test_every_key_that_is_listed_does_something(mounted):
    opened = mounted()
    opened.evaluate("view.seek(9)")
    opened.locator(".rp-canvas").focus()
    opened.keyboard.press("?")
    listed = opened.locator(".rp-help kbd").all_inner_texts()
    toggles = [key for key in listed if re.fullmatch("[A-Z]", key)]
    assert len(toggles) == len(opened.locator(".rp-toggle").all())
    for key in toggles:
        before = opened.locator(".rp-toggle[aria-pressed=true]").all_inner_texts()
        opened.keyboard.press(key.lower())
        assert opened.locator(".rp-toggle[aria-pressed=true]").all_inner_texts() != before, key
    for key in ("a", "d", "w", "s", "Shift+A", "Shift+W", "+", "-"):
        before = picture(opened)
        opened.keyboard.press(key)
        assert picture(opened) != before, key


# ------------------------------------------------------------------------------------------ views
def test_the_mouse_turns_moves_and_zooms_and_the_view_comes_back(mounted):
    opened = mounted()
    pictures = [picture(opened)]
    canvas = opened.locator(".rp-canvas")
    box = canvas.bounding_box()
    middle = (box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    opened.mouse.move(*middle)
    opened.mouse.wheel(0, -240)
    assert picture(opened) == pictures[0], "the wheel is the page's until the picture has the focus"
    for pressed in ("left", "right"):
        opened.mouse.down(button=pressed)
        opened.mouse.move(middle[0] + 60, middle[1] + 25, steps=3)
        opened.mouse.up(button=pressed)
        pictures.append(picture(opened))
        opened.mouse.move(*middle)
    canvas.focus()
    opened.mouse.wheel(0, -240)
    pictures.append(picture(opened))
    for name in ("Front", "Side", "Top"):
        button(opened, name).click()
        pictures.append(picture(opened))
    assert len(set(pictures)) == len(pictures)
    button(opened, "Reset view").click()
    assert picture(opened) == pictures[0]


def test_touch_turns_and_pinches(mounted):
    opened = mounted(has_touch=True, width=400)
    box = opened.locator(".rp-canvas").bounding_box()
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    session = opened.context.new_cdp_session(opened)

    def touch(kind: str, *places: tuple[float, float]) -> None:
        points = [{"x": a, "y": b, "id": number} for number, (a, b) in enumerate(places)]
        session.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})

    still = picture(opened)
    touch("touchStart", (x, y))
    for moved in range(10, 80, 10):
        touch("touchMove", (x + moved, y))
    touch("touchEnd")
    turned = picture(opened)
    assert turned != still
    touch("touchStart", (x - 20, y), (x + 20, y))
    for moved in range(25, 60, 5):
        touch("touchMove", (x - moved, y), (x + moved, y))
    touch("touchEnd")
    assert picture(opened) not in (still, turned)


def test_overlay_puts_all_in_one_place_and_figures_can_be_left_out(mounted):
    opened = mounted()
    apart = picture(opened)
    button(opened, "Overlay").click()
    assert button(opened, "Overlay").get_attribute("aria-pressed") == "true"
    together = picture(opened)
    assert together != apart
    box_of(opened, "leaning").uncheck()
    fewer = picture(opened)
    assert fewer != together
    opened.evaluate("view.select(['leaning'])")
    assert [box.is_checked() for box in opened.get_by_role("checkbox").all()] == [
        False, False, False, True, False, False,
    ]  # fmt: skip
    assert picture(opened) not in (together, fewer)


def test_marks_contacts_and_colours_are_where_they_should_be(mounted):
    """Looked for by colour: marks of what sank only in its picture, lit feet only while they stand."""
    opened = mounted(options={"labels": ["sunk"]})
    count = """(name) => { const canvas = document.querySelector('.rp-canvas');
        const style = getComputedStyle(document.querySelector('.rp'));
        const hex = style.getPropertyValue('--rp-' + name).trim();
        const asked = [1, 3, 5].map((i) => parseInt(hex.slice(i, i + 2), 16));
        const copy = document.createElement('canvas').getContext('2d', { willReadFrequently: true });
        Object.assign(copy.canvas, { width: canvas.width, height: canvas.height });
        copy.drawImage(canvas, 0, 0);
        const data = copy.getImageData(0, 0, canvas.width, canvas.height).data;
        let found = 0;
        for (let i = 0; i < data.length; i += 4)
            found += asked.every((v, k) => Math.abs(v - data[i + k]) < 12);
        return found; }"""

    def pixels(name: str, at: int, *labels: str) -> int:
        opened.evaluate("([labels, at]) => { view.select(labels); view.seek(at); }", [labels, at])
        frame(opened)
        return opened.evaluate(count, name)

    assert pixels("sunk", 4, "sunk") > 20
    assert pixels("sunk", 4, "reference") == 0
    assert pixels("contact", 4, "reference") > 20
    assert pixels("contact", FRAMES - 1, "reference") == 0
    assert pixels("slide", 8, "good") > 10, "its foot stands by its label, and goes on"
    assert pixels("slide", 0, "good") == 0


# ------------------------------------------------------------------------------------------ odd scenes
def test_a_figure_without_positions_says_why(mounted):
    opened = mounted()
    assert "broken: failed. ValueError: no luck at all" in opened.locator(".rp-missing").inner_text()
    both = picture(opened)
    box_of(opened, "broken").uncheck()
    assert picture(opened) != both
    for box in opened.get_by_role("checkbox").all():
        box.uncheck()
    assert "no figure" in opened.evaluate(
        "new Promise((done) => setTimeout(() => done("
        "document.querySelector('.rp-canvas').getAttribute('aria-label')), 450))"
    )


def test_one_frame_stays_where_it_is(mounted):
    opened = mounted(scene(1))
    button(opened, "Play").click()
    opened.locator(".rp-canvas").focus()
    opened.keyboard.press("ArrowRight")
    assert frame(opened) == 1
    assert button(opened, "Play").is_visible()
    assert opened.get_by_role("slider").is_disabled()
    box = opened.locator(".rp-curve").bounding_box()
    opened.mouse.click(box["x"] + 99, box["y"] + 20)
    assert frame(opened) == 1


def test_other_scenes_follow_in_the_same_place(mounted):
    opened = mounted(scene(), many_joints(), scene(four_legged=True), scene(ground=STAIRS))
    shown = [picture(opened)]
    for number in (1, 2, 3):
        opened.evaluate("(i) => { view.destroy(); return show(i, { frame: 3 }).ready; }", number)
        shown.append(picture(opened))
        assert frame(opened) == 4
        assert opened.locator(".rp").count() == 1
    assert len(set(shown)) == 4
    opened.evaluate("view.destroy()")
    assert opened.locator("#place").inner_html() == ""


def test_what_cannot_be_unpacked_is_told(mounted):
    opened = mounted()
    script = "RetargetPlayer.mount(place, { ...packed(0), schema: 99 }).ready"
    opened.evaluate(script)
    assert "another version" in opened.get_by_role("alert").inner_text()


def test_names_are_text_and_nothing_else(mounted):
    opened = mounted(hostile())
    opened.evaluate("(label) => view.select([label])", EVIL)
    assert opened.locator(".rp img, .rp b, .rp script").count() == 0
    assert opened.locator(".rp-name").first.text_content() == EVIL
    assert EVIL in opened.locator(".rp").get_attribute("aria-label")
