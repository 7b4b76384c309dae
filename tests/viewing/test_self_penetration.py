"""Self-penetration is lit where the metric finds it, and nowhere else, in pictures and in the player."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from playing import button, frame, picture

from retarget_bench.motion.motion import PointSets, Surface
from retarget_bench.motion.penetration import inside_mask
from retarget_bench.motion.point_sets import unknown_body
from retarget_bench.report.penetration import penetration, penetration_figure
from retarget_bench.viewer import player, scene_builder, self_penetration
from retarget_bench.viewer.colours import LIT
from retarget_bench.viewer.drawing import Drawing
from retarget_bench.viewer.packing import packed
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
    return scene_builder.dressed(Scene("tubes", figures, 30.0))


def yellow(image) -> int:
    """Pixels that are as yellow as what is lit, in any light."""
    red, green, blue = np.asarray(image).astype(int).transpose(2, 0, 1)
    return int(((red > 120) & (green > 0.8 * red) & (blue < 0.3 * red)).sum())


@pytest.mark.parametrize("as_surface", [False, True])
def test_what_is_lit_is_inside_now_and_was_not_at_rest(as_surface):
    person = fleshed()
    still, deep = bad(as_surface).figures
    inside = inside_mask(person, person.mesh.skinned(hand_to_belly(person, FRAMES)))
    np.testing.assert_array_equal(deep.inside, inside)
    assert deep.inside[3].sum() > still.inside[3].sum()
    faces = self_penetration.lit_faces(deep, 3)
    corners = person.mesh.faces
    assert [any(deep.inside[3][k] for k in face) for face in corners.tolist()] == faces.tolist()
    assert deep.motion is None if as_surface else deep.surface is None


@pytest.mark.parametrize("as_surface", [False, True])
def test_pictures_stripe_it_in_the_frames_that_have_it(as_surface):
    scene = bad(as_surface)
    deep = replace(scene, figures=scene.figures[1:])
    dark = replace(deep, figures=(replace(deep.figures[0], inside=np.zeros_like(deep.figures[0].inside)),))
    style = DrawingStyle((300, 300), skin=True)
    lit, plain = (Drawing(each, style, range(FRAMES)) for each in (deep, dark))
    assert yellow(lit.at(3)) > 60
    assert yellow(plain.at(3)) == 0
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


LIT_AT = """async (scene) => {
    const { figures, frames } = await RetargetPlayer.decode(packed(scene));
    const { lit } = figures[1], count = lit.length / frames;
    const at = (frame) => lit.subarray(frame * count, (frame + 1) * count);
    return Array.from({ length: frames }, (_, frame) => at(frame).reduce((a, b) => a + b));
}"""
SURFACE_AT = """async (frames) => {
    const { figures, frames: all } = await RetargetPlayer.decode(packed(0));
    return frames.map((frame) => [...RetargetPlayer.surfaceAt(figures[1], frame, all)]);
}"""


def test_pages_light_the_same_corners_and_keys_switch_it(mounted):
    scene = bad()
    opened = mounted(scene, skins=True)
    counts = scene.figures[1].inside.sum(axis=1)  # so few triangles that each corner is a vertex
    assert opened.evaluate(LIT_AT, 0) == counts.tolist()
    opened.evaluate("view.seek(3)")
    for skins in (False, True):
        if skins:
            button(opened, "Skins").click()
        lit = picture(opened)
        button(opened, "Flesh inside").click()
        assert picture(opened) != lit
        opened.locator(".rp-canvas").focus()
        opened.keyboard.press("x")
        assert picture(opened) == lit
    frame(opened)


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


def test_the_mask_costs_little_and_scenes_without_it_nothing():
    scene = bad()
    dark = replace(scene, figures=tuple(replace(each, inside=None) for each in scene.figures))
    none = replace(
        scene, figures=tuple(replace(each, inside=np.zeros_like(each.inside)) for each in scene.figures)
    )
    sizes = [len(player.data(packed(each, skins=True))) for each in (scene, dark)]
    assert sizes[0] - sizes[1] < 0.15 * sizes[1]
    assert packed(none, skins=True) == packed(dark, skins=True)
    assert packed(scene) == packed(dark)


def test_the_reports_figure_is_of_answers_with_more_flesh_inside_than_the_reference():
    scene = bad()
    assert penetration(scene) > 0
    assert penetration(replace(scene, figures=scene.figures[:1])) == 0
    same = tuple(replace(each, part="reference") for each in scene.figures)
    assert penetration(replace(scene, figures=same)) == 0
    report_figure = penetration_figure(scene)
    assert "deep" in report_figure.caption
    assert "still" not in report_figure.caption
    assert len(report_figure.png) < 120_000
