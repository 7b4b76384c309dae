"""Pictures of scenes: what is drawn where, against projections and distances written out here."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from viewing_toys.toy_moves import DOG, PERSON, body, moving

from retarget_bench.api import Ground
from retarget_bench.errors import BenchError
from retarget_bench.motion.character import Character
from retarget_bench.motion.skeleton import Skeleton
from retarget_bench.viewer import bodies, drawing
from retarget_bench.viewer.bodies import RIM, tube
from retarget_bench.viewer.camera import DISTANCE, Camera, fitted, track
from retarget_bench.viewer.colours import CONTACT, STAGE, TROUBLE, colours
from retarget_bench.viewer.drawing import Drawing, DrawingStyle
from retarget_bench.viewer.scene import Figure, Scene, figure_of
from retarget_bench.viewer.text import font, plain, short, wrapped
from tests.examples import examples

LEVEL = Ground(heights=np.zeros((2, 2)))
"""A floor without shadows."""
NAMES = (
    "<script>alert(1)</script>",
    "two\nlines\tand\x00more",
    "\u202egnirts",
    "日本語 ünïcödé 🐕",
    "x" * 500,
    "",
)


def scene(*figures: Figure, **changes) -> Scene:
    return Scene(**{"title": "a walk", "figures": figures, "fps": 30.0, **changes})


def walker(frames: int = 12, **changes) -> Figure:
    return replace(figure_of("walker", "motion", moving(body("small"), frames)), **changes)


def pixels(picture) -> np.ndarray:
    return np.asarray(picture).astype(int)


def has(picture, colour, at_least: int = 1) -> bool:
    return int((pixels(picture) == colour).all(axis=-1).sum()) >= at_least


def test_a_camera_is_a_pinhole():
    """Looking along -Z from 4 m away: similar triangles."""
    camera = Camera(np.array([[1.0, 0, 0], [0, 1, 0], [0, 0, -1]]), 4.0, 100.0, (320.0, 240.0))
    projected, depth, scale = camera.project(np.array([0.5, 1.0, 2.0]), np.array([0.0, 0.0, 0.0]))
    assert depth == pytest.approx(2.0)
    assert scale == pytest.approx(200.0)
    assert projected == pytest.approx([320 + 0.5 * 200, 240 - 1.0 * 200])


@examples(40)
@given(st.integers(0, 2**32 - 1), st.floats(0.01, 100), st.sampled_from([(300, 200), (90, 400)]))
def test_whatever_is_fitted_is_in_the_picture_and_fills_it(seed, scale, size):
    points = scale * np.random.default_rng(seed).normal(size=(30, 3))
    turned = np.linalg.qr(np.random.default_rng(seed + 1).normal(size=(3, 3)))[0]
    (camera,) = fitted([(turned, points)], 0.0, size)
    projected = camera.project(points, np.zeros(3))[0]
    assert (projected >= 0).all()
    assert (projected <= np.array(size)).all()
    assert (np.ptp(projected, axis=0) / size).max() == pytest.approx(0.92)
    assert camera.distance == pytest.approx(DISTANCE * np.linalg.norm(points, axis=1).max())


def test_a_following_camera_keeps_up_with_an_even_way():
    way = np.linspace(0, 3, 40)[:, None] * np.array([1.0, 0.2, -2.0])
    aim = track(way, 0.1, 30.0, follow=True)
    assert np.allclose(aim[:, [0, 2]], way[:, [0, 2]], atol=1e-9)
    assert (aim[:, 1] == 0.1).all()
    assert np.allclose(track(way, 0.0, 30.0, follow=False), [1.5, 0, -3])


@examples(60)
@given(st.tuples(*[st.floats(-50, 50)] * 4), st.floats(0.5, 30), st.floats(0.5, 30))
def test_the_outline_of_a_bone_is_convex_and_goes_around_its_discs(ends, first, second):
    middles = np.array(ends).reshape(2, 2)
    corners = tube(middles[None], np.array([[first, second]]))[0]
    to_first, to_second = (np.linalg.norm(corners - middle, axis=1) for middle in middles)
    assert (np.isclose(to_first, first) | np.isclose(to_second, second)).all()
    if np.linalg.norm(middles[0] - middles[1]) > abs(first - second) + 1e-3:
        way = np.diff(np.concatenate([corners, corners[:2]]), axis=0)
        turn = way[:-1, 0] * way[1:, 1] - way[:-1, 1] * way[1:, 0]
        assert turn.max() <= 1e-6 or turn.min() >= -1e-6


def test_bodies_are_drawn_where_their_bones_are_and_nowhere_else():
    figure = walker(3, joints=None, planted=None)
    picture = Drawing(scene(figure, ground=LEVEL), DrawingStyle((400, 400), camera="fit"))
    (stage,), (box,) = picture._stages, picture._boxes
    drawn = pixels(picture.at(1))[box.top :, box.left :][: box.height, : box.width]
    alone = pixels(stage._ground(tuple(stage.targets[1].tolist())).reduce(2))
    changed = (np.abs(drawn - alone) > 3).any(axis=-1)
    places, _, scale = stage.camera.project(figure.positions[1], stage.targets[1])
    across, down = np.meshgrid(np.arange(box.width) + 0.5, np.arange(box.height) + 0.5)
    at = np.stack([across, down], axis=-1)
    inside, outside = np.zeros(at.shape[:2], bool), np.ones(at.shape[:2], bool)
    radii = bodies.radii(figure.character)
    for joint, parent in enumerate(figure.parents.tolist()):
        if parent < 0:
            continue
        start, way = places[parent], places[joint] - places[parent]
        share = np.clip(((at - start) @ way) / max(way @ way, 1e-9), 0, 1)
        away = np.linalg.norm(at - start - share[..., None] * way, axis=-1)
        thick, thin = radii[joint].max() * scale[[parent, joint]].max(), radii[joint].min() * scale[joint]
        inside |= away < 0.8 * thin - 1
        outside &= away > thick + RIM + 1
    head = np.linalg.norm(at - places[figure.character.joint_of["head"]], axis=-1)
    outside &= head > 3 * bodies.HEAD * figure.character.height * scale.max()
    assert inside.sum() > 1000
    assert changed[inside].all()
    assert not changed[outside].any()


def test_what_carries_a_body_and_handles_beside_it_are_not_drawn():
    plain = body("small")
    skeleton = plain.skeleton
    names = ("root", "handle", *skeleton.names)
    parents = np.array([-1, 0, *np.where(skeleton.parents < 0, 0, skeleton.parents + 2)])
    rig = Skeleton(names, parents, np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], *skeleton.offsets]))
    thick = bodies.radii(Character.of("rig", rig))
    assert not thick[:3].any(), "root, handle, and the way from the root to the hips"
    np.testing.assert_allclose(thick[3:], bodies.radii(plain)[1:])


def test_left_is_lighter_than_right():
    """From the front, a body's left is at the right of the picture."""
    figure = walker(2, joints=None, planted=None)
    picture = Drawing(scene(figure, ground=LEVEL), DrawingStyle((400, 400), view="front"))
    stage = picture._stages[0]
    light = {}
    for side in ("left", "right"):
        ends = figure.positions[0][figure.character.joints([f"{side}_up_leg", f"{side}_leg"])]
        across, down = stage.camera.project(ends, stage.targets[0])[0].mean(axis=0)
        light[side] = (across, pixels(stage.picture(0))[int(down), int(across)].sum())
    assert light["left"][0] > light["right"][0]
    assert light["left"][1] > light["right"][1] + 60


def test_what_rests_is_lit_and_nothing_else():
    rests = np.zeros((12, 1), bool)
    rests[5] = True
    toe = walker().character.joint_of["left_toe"]
    picture = Drawing(scene(walker(joints=(toe,), planted=rests)), DrawingStyle((300, 300)))
    assert has(picture.at(5), CONTACT, 20)
    assert not has(picture.at(4), CONTACT)


def test_a_failed_prediction_is_an_empty_panel_with_words():
    lost = Figure(
        "ik", "prediction", body("small"), None, status="failed", message="ValueError: " + 40 * "no "
    )
    picture = Drawing(scene(walker(), lost), DrawingStyle((600, 300)))
    box = picture._boxes[1]
    panel = picture.at(0).crop((box.left, box.top, box.left + box.width, box.top + box.height))
    assert has(panel, STAGE, box.width * box.height // 2)
    assert has(panel, TROUBLE, 5)
    assert has(Drawing(scene(walker(), lost), DrawingStyle((600, 300), overlay=True)).at(0), TROUBLE, 5)


def test_who_is_elsewhere_is_said_to_be_out_of_view():
    far = walker(label="far", part="prediction", positions=walker().positions + np.array([40.0, 0, 0]))
    reference = walker(label="reference", part="reference")
    picture = Drawing(scene(reference, far), DrawingStyle((600, 300)))
    near, away = picture._stages
    assert near.in_picture(0)
    assert not away.in_picture(0)
    assert has(picture.at(0), TROUBLE, 5)


def two_hundred() -> Character:
    """A chain of 200 joints without roles."""
    offsets = np.tile([0.0, 0.01, 0.004], (200, 1))
    return Character.of("worm", Skeleton(tuple(f"j{k}" for k in range(200)), np.arange(-1, 199), offsets))


@pytest.mark.parametrize("overlay", [False, True])
@pytest.mark.parametrize(
    "figure",
    [
        walker(1),
        walker(motion=None),
        figure_of("dog", "motion", moving(body("rex", DOG), 4)),
        figure_of(
            "worm",
            "motion",
            two_hundred().motion(np.tile([1.0, 0, 0, 0], (3, 200, 1)), np.ones((3, 3)), 30),
        ),
        figure_of("point", "motion", moving(body("point", {"Hips": ("", (0, 1, 0))}), 2)),
    ],
    ids=["one frame", "positions", "dog", "200 joints", "one joint"],
)
def test_every_body_is_drawn(figure, overlay):
    shown = scene(figure)
    picture = Drawing(shown, DrawingStyle((300, 260), overlay=overlay)).at(shown.frames - 1)
    assert picture.size == (300, 260)
    (colour,) = colours(shown)
    assert (np.abs(pixels(picture) - colour).sum(axis=-1) < 90).sum() > 25


@pytest.mark.parametrize("name", NAMES)
def test_names_of_any_kind_are_harmless(name):
    figure = walker(label=name, message=name)
    lost = replace(figure, positions=None, motion=None, status="failed")
    for overlay in (False, True):
        picture = Drawing(
            scene(figure, lost, title=name, kind=name), DrawingStyle((400, 240), overlay=overlay)
        )
        assert picture.at(0).size == (400, 240)
    assert drawing.sheet(scene(figure, lost, title=name), DrawingStyle((600, 400)), [0, 5]).size == (
        600,
        400,
    )


def test_words_fit_their_room():
    letters = font(14)
    for name in NAMES:
        assert letters.getlength(short(name, letters, 80)) <= 80
        assert all(letters.getlength(line) <= 90 for line in wrapped(name, letters, 90, 3))
    assert plain("a\u202eb\n c\x00") == "a b c"
    assert short("copy_rotations", letters, 500) == "copy_rotations"
    assert short("copy_rotations[root=height]", letters, 100).count("…") == 1


def test_a_skin_is_drawn_where_the_mesh_is():
    """A cube around the hips, one metre wide, in front of a camera that looks at a face of it."""
    from retarget_bench.motion.mesh import Mesh

    corners = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (0.0, 1.0) for z in (-0.5, 0.5)])
    square = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    faces = np.array([tri for a, b, c, d in square for tri in ((a, b, c), (a, c, d))])
    weights = np.zeros((8, 18))
    weights[:, 0] = 1.0
    person = replace(body("cube"), skin=lambda: Mesh(corners, faces, weights))
    still = person.motion(np.tile([1.0, 0, 0, 0], (1, 18, 1)), person.skeleton.offsets[:1], 30.0)
    shown = scene(figure_of("cube", "motion", still), ground=LEVEL)
    picture = Drawing(shown, DrawingStyle((400, 400), view="front", skin=True))
    stage = picture._stages[0]
    front = stage.camera.project(corners[[1, 3, 7, 5]], stage.targets[0])[0]
    low, high = front.min(axis=0).astype(int), front.max(axis=0).astype(int)
    inner = pixels(stage.picture(0))[low[1] + 25 : high[1] - 25, low[0] + 25 : high[0] - 25]
    assert inner.size > 3000
    assert (np.abs(inner - inner[0, 0]).max(axis=-1) <= 3).all()  # one flat face of one shade
    plainly = pixels(Drawing(shown, DrawingStyle((400, 400), view="front"))._stages[0].picture(0))
    assert np.abs(plainly - pixels(stage.picture(0))).max() > 30


def test_a_sheet_has_a_row_per_figure_and_a_column_per_moment():
    figures = [walker(label=f"m{k}", part="prediction") for k in range(3)]
    shown = scene(*figures)
    assert drawing.moments(range(12), 4) == [0, 4, 7, 11]
    assert drawing.moments(range(2), 8) == [0, 1]
    size = drawing.usual_size(shown, 4, False)
    picture = pixels(drawing.sheet(shown, DrawingStyle(size), drawing.moments(range(12), 4)))
    for k, colour in enumerate(colours(shown)):
        coloured = np.argwhere(np.abs(picture - colour).sum(axis=-1) < 8)
        cells = coloured[coloured[:, 1] > 180]
        third = (cells[:, 0] - 60) * 3 // (size[1] - 60)
        assert np.bincount(third, minlength=3).argmax() == k
        assert (np.histogram(cells[:, 1], bins=4, range=(170, size[0]))[0] > 20).all()
    with pytest.raises(BenchError, match="do not fit on 200 x 60 pixels"):
        drawing.sheet(shown, DrawingStyle((200, 60)), [0, 1])


def test_sizes_and_views_that_cannot_be_are_told_in_words():
    with pytest.raises(BenchError, match="4 x 4 pixels cannot be drawn"):
        DrawingStyle((4, 4))
    with pytest.raises(BenchError, match="no view 'above'; views are front, side"):
        DrawingStyle(view="above")


def test_what_has_no_role_and_no_skin_is_a_thin_grey_line():
    """A handle as long as a leg changes few pixels, and is no reason to look from farther away."""
    handled = body("a", PERSON | {"Pivot": ("Hips", (0, -0.9, 0)), "Hat": ("Head", (0, 0.6, 0))})
    radii, plain = bodies.radii(handled), body("a")
    assert radii[-2:].max() < 0.2 * radii[handled.joint_of["left_hand"]].min()
    assert bodies.sides(handled) == bodies.sides(plain) + "hh"

    def picture(drawn: Character) -> np.ndarray:
        scene = Scene("a", (replace(figure_of("a", "motion", moving(drawn, 1)), joints=None),), 30.0)
        return np.asarray(Drawing(scene, DrawingStyle((400, 400))).at(0)).astype(int)

    changed = np.abs(picture(handled) - picture(plain)).max(axis=-1) > 30
    assert 0 < changed.sum() < 400
    nobody = body("a", {"a": ("", (0, 1, 0)), "b": ("a", (0, 1, 0))})  # without any role all is a limb
    assert "h" not in bodies.sides(nobody)
