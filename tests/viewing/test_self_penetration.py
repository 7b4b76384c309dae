"""Self-penetration is lit where the metric finds it, and nowhere else, in pictures and in the player."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from playing import button, frame, picture

from retarget_bench.motion.motion import PointSets, Surface
from retarget_bench.motion.penetration import inside_mask
from retarget_bench.motion.point_sets import unknown_body
from retarget_bench.viewer.colours import LIT
from retarget_bench.viewer.drawing import Drawing
from retarget_bench.viewer.packing import inside_at
from retarget_bench.viewer.renderer import DrawingStyle
from retarget_bench.viewer.scene import Scene, figure_of
from tests.motion.tubes import fleshed, hand_to_belly

FRAMES = 7


def bad(as_surface: bool = False) -> Scene:
    """One whose hands go into the belly, in the middle of the clip alone, and one who stands still."""
    person = fleshed()
    moved = hand_to_belly(person, FRAMES)
    still = moved.at(np.zeros(FRAMES, dtype=int))
    answer = Surface(person, person.mesh.skinned(moved), 30.0) if as_surface else moved
    figures = (figure_of("still", "reference", still), figure_of("deep", "prediction", answer))
    figures = tuple(replace(each, joints=None, planted=None) for each in figures)  # marks are yellow, too
    return Scene("tubes", figures, 30.0)


def yellow(image) -> int:
    """Pixels that are as yellow as what is lit, in any light."""
    red, green, blue = np.asarray(image).astype(int).transpose(2, 0, 1)
    return int(((red > 120) & (green > 0.8 * red) & (blue < 0.3 * red)).sum())


@pytest.mark.parametrize("as_surface", [False, True])
def test_what_is_lit_is_inside_now_and_was_not_at_rest(as_surface):
    person = fleshed()
    still, deep = bad(as_surface).figures
    inside = inside_mask(person, person.mesh.skinned(hand_to_belly(person, FRAMES)))
    np.testing.assert_array_equal([deep.inside_at(frame) for frame in range(FRAMES)], inside)
    assert deep.inside_at(3).sum() > still.inside_at(3).sum()
    assert deep.motion is None if as_surface else deep.surface is None


@pytest.mark.parametrize("as_surface", [False, True])
def test_pictures_stripe_it_in_the_frames_that_have_it(as_surface):
    scene = bad(as_surface)
    deep = replace(scene, figures=scene.figures[1:])
    key = (slice(0, 25), slice(150, 300))  # says in yellow what stripes mean
    striped = Drawing(deep, DrawingStyle((300, 300), skin=True), range(FRAMES))
    lit, plain = (np.array(striped.at(frame)) for frame in (3, 0))
    lit[key] = plain[key] = 255
    assert yellow(lit) > 60
    assert yellow(plain) == 0
    bones = Drawing(deep, DrawingStyle((300, 300)), range(FRAMES))
    assert yellow(bones.at(3)) == 0
    assert LIT[0] > LIT[2]


def test_points_are_drawn_in_place_of_a_body():
    chance = np.random.default_rng(3)
    points = tuple(chance.normal((0, 1, 0), 0.1, (200, 3)) for _ in range(2))
    scene = Scene(
        "scan", (figure_of("scan", "source", PointSets(unknown_body("scan"), points, 30.0)),), 30.0
    )
    style = DrawingStyle((200, 200), skin=True)
    dots, ball = (np.asarray(Drawing(scene, each).at(0)) for each in (style, replace(style, skin=False)))
    assert (dots != ball).any()
    dark = (dots.max(axis=2) < 190)[30:170]
    assert 100 < dark.sum() < 6000
    assert np.ptp(np.argwhere(dark), axis=0).min() > 40  # all over, not one ball


def test_points_of_a_known_motion_are_drawn_on_its_skin():
    """Those on the far side are hidden, and the skin stays in sight."""
    person = fleshed()
    still = hand_to_belly(person, FRAMES).at(np.zeros(1, dtype=int))
    skin, figure = person.mesh.skinned(still)[0], figure_of("source", "source", still)
    style = DrawingStyle((300, 300), view="front", skin=True)

    def drawn(*points) -> np.ndarray:
        shown = replace(figure, points=(np.array(points),)) if points else figure
        return np.asarray(Drawing(Scene("tubes", (shown,), 30.0), style).at(0)).astype(int)

    def changed(*points) -> int:
        return int((np.abs(drawn() - drawn(*points)).max(axis=2) > 20).sum())

    trunk = skin[(np.abs(skin[:, 0]) < 0.05) & (np.abs(skin[:, 1] - 1.1) < 0.1)]
    assert changed(trunk[trunk[:, 2].argmin()]) == 0
    assert 1 <= changed(trunk[trunk[:, 2].argmax()]) < 30
    assert 100 < changed(*skin) < 0.1 * 300 * 300


SURFACE_AT = """async (frames) => {
    const { figures, frames: all } = await RetargetPlayer.decode(packed(0));
    return frames.map((frame) => [...RetargetPlayer.surfaceAt(figures[1], frame, all)]);
}"""


LOOKED_INSIDE = """(known) => {
    window.asked = [];
    const inside = (figure, frame) => {
        asked.push([figure, frame]);
        return Promise.resolve(figure === 1 ? known[frame] : []);
    };
    return show(0, { skins: true, inside }).ready;
}"""


def test_players_ask_for_the_frame_that_is_looked_at_and_keys_switch_it(mounted):
    scene = bad()
    opened = mounted(scene, skins=True)
    assert button(opened, "Flesh inside").count() == 0, "a page from disk has nobody to ask"
    known = [inside_at(scene.figures[1], frame, 3000) for frame in range(FRAMES)]
    assert len(known[3]) == scene.figures[1].inside_at(3).sum()  # few triangles: each corner is a vertex
    opened.evaluate(LOOKED_INSIDE, known)
    frame(opened)
    opened.evaluate("view.seek(3)")
    frame(opened)
    frame(opened)
    assert opened.evaluate("asked") == [[0, 0], [1, 0], [0, 3], [1, 3]]
    assert not opened.locator(".rp-search").is_visible()
    lit = picture(opened)
    button(opened, "Flesh inside").click()
    assert picture(opened) != lit
    opened.locator(".rp-canvas").focus()
    opened.keyboard.press("x")
    assert picture(opened) == lit
    assert len(opened.evaluate("asked")) == 4


def test_pages_have_a_surface_to_the_millimetre(mounted):
    scene = bad(as_surface=True)
    surfaces = mounted(scene, skins=True).evaluate(SURFACE_AT, [0, 3])
    mesh = scene.figures[1].character.mesh
    used = np.unique(mesh.faces)
    for at, places in zip((0, 3), surfaces, strict=True):
        drawn, expected = np.array(places).reshape(-1, 3), scene.figures[1].surface[at][used]
        order = [np.lexsort(np.round(each / 0.004).T) for each in (drawn, expected)]
        assert len(order[0]) == len(order[1])
        apart = np.linalg.norm(drawn[:, None] - expected[None], axis=-1).min(axis=1)
        assert apart.max() < 2e-3
