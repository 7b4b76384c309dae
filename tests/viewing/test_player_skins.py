"""Skins in pages: where Python's are, to two millimetres, and only where they were asked for."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from acted import acted, clad, clad_scene, figure, scene
from playing import RED, button, frame, picture
from viewing_toys.toy_moves import body

from retarget_bench.errors import BenchError
from retarget_bench.motion.mesh import Mesh
from retarget_bench.viewer import player
from retarget_bench.viewer.packing import packed
from retarget_bench.viewer.scene import Scene
from retarget_bench.viewer.skins import FOLLOWED, FULL_WEIGHT, IN_PAGES, Skin, merged

SURFACE = """async (frames) => {
    const { figures, frames: all } = await RetargetPlayer.decode(packed(0));
    const { faces } = figures[0].body.skin;
    const surface = (frame) => [...RetargetPlayer.surfaceAt(figures[0], frame, all)];
    return { faces: [...faces], places: frames.map(surface) };
}"""


def ball(rings: int, joints: int = 1) -> Mesh:
    """A sphere of radius 1 around the origin; its halves left and right follow the joints 0 and 1."""
    up, around = np.meshgrid(
        np.linspace(0, np.pi, rings), np.linspace(0, 2 * np.pi, 2 * rings), indexing="ij"
    )
    places = np.stack([np.sin(up) * np.cos(around), np.cos(up), np.sin(up) * np.sin(around)], axis=-1)
    number = np.arange(2 * rings * rings).reshape(rings, -1)
    a, b, c, d = number[:-1, :-1], number[:-1, 1:], number[1:, 1:], number[1:, :-1]
    faces = np.concatenate([np.stack(each, -1).reshape(-1, 3) for each in ((a, b, c), (a, c, d))])
    vertices = places.reshape(-1, 3)
    weights = np.zeros((len(vertices), joints))
    weights[np.arange(len(vertices)), (vertices[:, 0] > 0) % joints] = 1.0
    return Mesh(vertices, faces, weights)


def test_skins_are_where_those_of_python_are(mounted):
    original = clad_scene()
    moved = original.figures[0].motion
    decoded = mounted(original, skins=True).evaluate(SURFACE, [0, 7, original.frames - 1])
    mesh = moved.character.mesh
    expected = mesh.skinned(moved)[:, mesh.faces.ravel()]
    for at, places in zip((0, 7, original.frames - 1), decoded["places"], strict=True):
        drawn = np.array(places).reshape(-1, 3)[decoded["faces"]]
        assert np.linalg.norm(drawn - expected[at], axis=-1).max() < 2e-3
        assert np.linalg.norm(drawn - expected[(at + 5) % original.frames], axis=-1).max() > 2e-2


def test_they_are_shown_in_place_of_bones_where_a_scene_has_any(mounted):
    opened = mounted(clad_scene(), scene(), skins=True)
    bones = picture(opened)
    button(opened, "Skins").click()
    skins = picture(opened)
    assert skins != bones
    button(opened, "Overlay").click()
    frame(opened)
    opened.locator(".rp-canvas").focus()
    for key in ("o", "k"):
        opened.keyboard.press(key)
    assert picture(opened) == bones
    for label, differs in (("clad", True), ("places", False), ("bare", False)):
        opened.evaluate("(label) => view.select([label])", label)
        before = picture(opened)
        opened.keyboard.press("k")
        assert (picture(opened) != before) is differs, label
        opened.keyboard.press("k")
    opened.evaluate("show(1).ready")
    assert button(opened, "Skins").count() == 0, "no body of this scene has a skin"


@pytest.mark.parametrize("name", ["Reset view", "Side"])
def test_panels_have_room_for_what_skins_are_beside_joints(mounted, name):
    original = clad_scene()
    moved = original.figures[0].motion
    mesh = moved.character.mesh
    places = mesh.vertices.copy()
    places[-6:-3] += [[0.0, 0.0, 2.0], [0.0, 0.5, 2.0], [0.0, 0.0, 0.0]]
    places[-3:] += [[2.0, 0.0, 0.0], [2.0, 0.5, 0.0], [0.0, 0.0, 0.0]]
    long = replace(moved.character, skin=lambda: replace(mesh, vertices=places))
    wide = figure("long", "motion", replace(moved, character=long))
    options = {"colours": {"long": "#d00000"}}
    opened = mounted(replace(original, figures=(wide,)), options=options, skins=True, width=400)
    button(opened, "Skins").click()
    button(opened, name).click()
    frame(opened)
    assert opened.evaluate(RED, 0.5) > 500
    assert opened.evaluate(RED, 0.004) == 0


def test_nobody_pays_for_skins_without_asking():
    clothed, plain = clad_scene(), scene()
    packed_scene = packed(clothed)
    assert packed(plain, IN_PAGES) == packed(plain)
    assert not any("skin" in each for each in packed_scene["bodies"])
    assert not any(each["skin"] for each in packed_scene["figures"])
    worn = packed(clothed, IN_PAGES)
    assert [each["skin"] for each in worn["figures"]] == [True, False, False]
    assert ["skin" in each for each in worn["bodies"]] == [True, False]
    faces = worn["bodies"][0]["skin"]["faces"]
    assert len(player.data(worn)) - len(player.data(packed_scene)) < 60 * faces + 60 * 18 * clothed.frames


def test_corners_follow_the_joints_with_the_largest_shares():
    person = clad(body("T"))
    chance = np.random.default_rng(0)
    mesh = replace(person.mesh, weights=chance.dirichlet(np.ones(18), len(person.mesh.vertices)))
    skin = Skin.of(mesh, IN_PAGES)
    assert (skin.shares.sum(axis=1) == FULL_WEIGHT).all()
    assert (skin.shares >= 0).all()
    largest = np.sort(skin.mesh.weights, axis=1)[:, : -FOLLOWED - 1 : -1]
    followed = np.take_along_axis(skin.mesh.weights, skin.joints[skin.followed], axis=1)
    assert np.array_equal(followed, largest)
    assert (
        np.abs(skin.shares / FULL_WEIGHT - largest / largest.sum(axis=1, keepdims=True)).max()
        < 1.6 / FULL_WEIGHT
    )


@pytest.mark.parametrize("most", [3000, 700, 60])
def test_fewer_triangles_are_nearly_the_same_surface(most):
    mesh = ball(48, 2)
    small = merged(mesh, most)[0]
    assert 0.4 * most < len(small.faces) <= most < len(mesh.faces)
    radii = np.linalg.norm(small.vertices, axis=1)
    step = np.sqrt(4 * np.pi / most)  # between corners that are spread evenly over the sphere
    assert radii.max() <= 1.0 + 1e-12
    assert radii.min() > 1.0 - step
    assert np.array_equal(small.weights[:, 1] > 0.5, small.vertices[:, 0] > 0), "halves stay apart"
    assert np.allclose(small.weights.sum(axis=1), 1.0)
    assert merged(small, most)[0] is small


def test_skins_that_are_not_finite_are_told():
    person = clad(body("T"))
    moved = acted(
        replace(person, skin=lambda: replace(person.mesh, vertices=person.mesh.vertices * np.inf)), 2
    )
    with pytest.raises(BenchError, match="a mesh has vertices that are not finite"):
        packed(Scene("bad", (figure("a", "motion", moved),), 30.0), IN_PAGES)


HOLES = """(least) => {
    const canvas = document.querySelector(".rp-canvas"), { width, height } = canvas;
    const { data } = canvas.getContext("2d").getImageData(0, 0, width, height);
    const inked = (at) => Math.max(...data.slice(at, at + 3)) - Math.min(...data.slice(at, at + 3)) > least;
    let holes = 0, inside = 0;
    for (let at = 0; at < data.length; at += 4) {
        const around = [4, -4, 4 * width, -4 * width].map((step) => at + 3 * step);
        if (inked(at)) inside++;
        else if (around.every(inked)) holes++;
    }
    return [inside, holes];
}"""


def test_nothing_shines_through_a_skin(mounted):
    person = body("T")
    round_one = ball(36, len(person.skeleton))
    weights = np.zeros_like(round_one.weights)
    weights[:, 0] = 1.0
    skin = Mesh(0.8 * round_one.vertices + person.skeleton.offsets[0], round_one.faces, weights)
    moved = acted(replace(person, skin=lambda: skin), 2)
    original = Scene("ball", (figure("ball", "motion", moved),), 30.0)
    opened = mounted(original, skins=True)
    for name in ("Skins", "Contacts"):
        button(opened, name).click()
    frame(opened)
    inside, holes = opened.evaluate(HOLES, 20)
    assert inside > 10_000
    assert holes == 0
