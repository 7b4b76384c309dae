"""Packed scenes: what comes out is what went in, to half a millimetre, small and harmless in a page."""

from __future__ import annotations

import base64
import json
import zlib
from dataclasses import replace
from html.parser import HTMLParser

import numpy as np
import pytest
from acted import EVIL, acted, figure, hostile, many_joints, scene
from hypothesis import given
from hypothesis import strategies as st
from viewing_toys.toy_moves import DOG, PERSON, body

from retarget_bench.api import Ground
from retarget_bench.errors import BenchError
from retarget_bench.viewer import bodies, player
from retarget_bench.viewer.packing import STEP, packed
from retarget_bench.viewer.scene import Figure, Scene
from tests.examples import examples

HALF_A_MILLIMETRE = 5e-4


def numbers(data: str) -> list[int]:
    """The whole numbers of a packed scene, read one by one as the format says."""
    values, value, shift = [], 0, 0
    for byte in zlib.decompress(base64.b64decode(data)):
        value |= (byte & 127) << shift
        shift += 7
        if byte < 128:
            values.append(-(value + 1) // 2 if value & 1 else value // 2)
            value, shift = 0, 0
    assert shift == 0
    return values


def rows(values: list[int], count: int, columns: int) -> np.ndarray:
    """The next rows of values in steps, taken off the numbers."""
    steps = np.array(values[: count * columns], dtype=np.int64).reshape(count, columns)
    del values[: count * columns]
    return steps.cumsum(axis=1).cumsum(axis=1)


def positions(packed_scene: dict, values: list[int], joints: int) -> np.ndarray:
    frames = packed_scene["frames"]
    return rows(values, 3 * joints, frames).reshape(joints, 3, frames).transpose(2, 0, 1) * STEP


def test_every_series_comes_back_to_half_a_millimetre():
    original = scene(ground=Ground(heights=np.arange(12.0).reshape(3, 4) / 7, origin=(-1, 2), spacing=0.5))
    packed_scene = json.loads(json.dumps(packed(original), allow_nan=False))
    values = numbers(packed_scene["data"])
    for each in original.figures[:-1]:
        back = positions(packed_scene, values, each.positions.shape[1])
        assert np.linalg.norm(back - each.positions, axis=-1).max() < HALF_A_MILLIMETRE
        assert np.array_equal(rows(values, each.planted.shape[1], original.frames).T, each.planted)
        if each.error is not None:
            assert np.abs(0.01 * rows(values, 1, original.frames)[0] - each.error).max() <= 0.005 + 1e-9
    assert np.abs(rows(values, 3, 4) * STEP - original.ground.heights).max() <= STEP / 2
    assert values == []
    assert (packed_scene["ground"]["rows"], packed_scene["ground"]["columns"]) == (3, 4)


@given(st.lists(st.tuples(*[st.floats(-1e5, 1e5, allow_subnormal=False)] * 3), min_size=1, max_size=9))
@examples(60)
def test_places_however_far_and_jumps_however_wide_come_back(places):
    point = many_joints(1, 1).figures[0].character
    original = Scene("far", (Figure("far", "motion", point, np.array(places)[:, None]),), 30.0)
    packed_scene = packed(original)
    back = positions(packed_scene, numbers(packed_scene["data"]), 1)[:, 0]
    assert np.linalg.norm(back - np.array(places), axis=-1).max() < HALF_A_MILLIMETRE


def test_errors_that_are_not_known_are_less_than_nothing():
    walker = acted(body("T"), 3)
    with_gap = replace(figure("a", "motion", walker), error=np.array([1.0, np.nan, 2.0]), planted=None)
    packed_scene = packed(Scene("gap", (with_gap,), 30.0))
    values = numbers(packed_scene["data"])[-3:]
    assert rows(values, 1, 3)[0].tolist() == [100, -1, 200]


def test_positions_that_are_not_finite_are_told():
    broken = replace(many_joints(2, 2).figures[0], positions=np.full((2, 2, 3), np.nan))
    with pytest.raises(BenchError, match="snake has positions that are not finite"):
        packed(Scene("bad", (broken,), 30.0))


def test_bodies_are_told_once_and_figures_without_positions_have_words_only():
    packed_scene = packed(scene())
    assert [each["name"] for each in packed_scene["bodies"]] == ["S", "T"]
    assert [each["body"] for each in packed_scene["figures"]] == [0, 1, 1, 1, 1, 1]
    broken = packed_scene["figures"][-1]
    assert (broken["shown"], broken["status"], broken["contacts"]) == (False, "failed", None)
    assert broken["message"] == "ValueError: no luck at all"


def test_values_that_are_no_numbers_are_left_out():
    original = replace(scene(), values={"good": {"a": 1.5, "b": float("nan"), "c": float("inf")}})
    assert packed(original)["figures"][2]["values"] == {"a": 1.5}


def test_a_long_walk_of_many_is_small():
    """12 MB for 20 clips of 10 figures are 300 bytes for each of 200 frames; there is far more room."""
    original = scene(200)
    shown = sum(figure.positions is not None for figure in original.figures)
    assert len(player.data(packed(original))) < 40 * shown * original.frames


class Scripts(HTMLParser):
    """Which elements a page has, and the text of its scripts."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.tags: list[str] = []
        self.text = ""
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        self.tags.append(tag)

    def handle_data(self, data):
        self.text += data


def test_no_name_ends_the_element_that_it_lies_in():
    packed_scene = packed(hostile())
    read = Scripts(f'<script type="application/json">{player.data(packed_scene)}</script>')
    assert read.tags == ["script"]
    assert json.loads(read.text) == packed_scene
    assert packed_scene["title"] == EVIL


@pytest.mark.parametrize("joints", [PERSON, DOG])
def test_bodies_are_as_thick_left_as_right_and_no_thicker_than_long(joints):
    character = body("T", joints, 1.3)
    radii = bodies.radii(character)
    assert radii.shape == (len(joints), 2)
    assert (radii[1:] > 0).all()
    assert not radii[0].any()
    for left, name in enumerate(joints):
        if name.startswith("Left"):
            right = list(joints).index(name.replace("Left", "Right"))
            assert np.array_equal(radii[left], radii[right])
            assert radii[left].max() <= 0.5 * character.skeleton.bone_lengths[left]
    sides = dict(zip(joints, bodies.sides(character), strict=True))
    assert (sides["LeftArm"], sides["RightFoot"], sides["Spine"]) == ("l", "r", "-")
