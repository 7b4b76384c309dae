"""``bench plot attention``: what is drawn and written is what the method says."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest

from retarget_bench.api import MethodCard
from retarget_bench.errors import BenchError, NotSupported
from retarget_bench.evaluation import attention as asking
from retarget_bench.figures.plotting import attention as picture
from retarget_bench.motion import bvh
from retarget_bench.motion.character import Character
from retarget_bench.motion.skeleton import Skeleton
from retarget_bench.plugins import registry
from tests.motion.gltf_files import NAMES, PARENTS, PLACES

OFFSETS = PLACES - PLACES[list(PARENTS)] * (np.arange(len(NAMES)) > 0)[:, None]
BODY = Character.of("figure", Skeleton(NAMES, np.array(PARENTS), OFFSETS))

METHOD = '''"""Heeds the hips and two legs."""
import numpy as np
from retarget_bench.api import MethodCard

class Plugin:
    card = MethodCard(name="heeds", summary="", version="1")
    def supports(self, source, target):
        return None
    def retarget(self, source, target, *, context):
        raise NotImplementedError
    def attention(self, source):
        joints = [source.skeleton.names.index(name) for name in ("Hips", "LeftFoot", "RightFoot")]
        ramp = np.linspace(0.1, 0.6, source.frames)
        weights = np.zeros((source.frames, 2, 3))
        weights[:, 0, 0], weights[:, 0, 1] = 0.3, ramp
        weights[:, 1, 0], weights[:, 1, 2] = ramp, 0.2
        sees = [[True, True, False], [True, False, True]]
        return {"parts": ["left_leg", "right_leg"], "joints": joints, "sees": sees, "weights": weights,
                "note": "it is a figure"}

plugin = Plugin
'''


def turning(frames: int = 31):
    """Turns about the vertical axis by a right angle, and stands."""
    half = np.radians(np.linspace(0.0, 90.0, frames)) / 2
    rotations = np.zeros((frames, len(NAMES), 4))
    rotations[..., 0] = 1.0
    rotations[:, 0, 0], rotations[:, 0, 2] = np.cos(half), np.sin(half)
    return BODY.motion(rotations, np.tile([0.3, 0.9, -0.2], (frames, 1)), 30.0)


@pytest.fixture
def method(tmp_path, monkeypatch):
    monkeypatch.setattr(registry, "_FILES", {})
    (tmp_path / "in").mkdir()
    file = tmp_path / "in" / "heeds.py"
    file.write_text(METHOD)
    registry.add_file(file)
    return registry.create("methods", "heeds")


# --------------------------------------------------------------------------------------------- contract
class Says:
    """A method that says this of its attention."""

    card = MethodCard(name="says", summary="", version="1")

    def __init__(self, **changes) -> None:
        self.said = {
            "parts": ["all"], "joints": [0, 1], "sees": [[True, True]], "weights": np.full((31, 1, 2), 0.5),
        } | changes  # fmt: skip

    def supports(self, source, target):
        return self.said.get("why")

    def attention(self, source):
        return {key: value for key, value in self.said.items() if value is not None}


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"weights": np.full((30, 1, 2), 0.5)}, "weights of shape"),
        ({"weights": np.full((31, 1, 2), 0.6)}, "add up to more than 1"),
        ({"weights": np.full((31, 1, 2), -0.1)}, "below 0"),
        ({"weights": np.full((31, 1, 2), np.nan)}, "not finite"),
        ({"sees": [[True, False]]}, "does not see"),
        ({"joints": [0, 0]}, "one joint twice"),
        ({"joints": [0, 99]}, "joints from 0 to 99 of 16"),
        ({"sees": None}, "does not say its attention as Attention wants it: KeyError"),
        ({"parts": [], "weights": np.ones((31, 0, 2)), "sees": np.ones((0, 2))}, "no part"),
    ],
)
def test_what_is_no_attention_is_told(changes, words):
    with pytest.raises(BenchError, match=words):
        asking.ask(Says(**changes), turning(), "says")


def test_a_method_that_refuses_a_body_is_not_asked():
    with pytest.raises(NotSupported, match="says: it has no weights"):
        asking.ask(Says(why="it has no weights"), turning(), "says")


def test_the_motion_stays_as_it_is():
    motion = turning()

    class Spoils(Says):
        def attention(self, source):
            source.rotations[:] = 0.0
            return super().attention(source)

    before = motion.rotations.copy()
    asking.ask(Spoils(), motion, "spoils")
    np.testing.assert_array_equal(motion.rotations, before)


@pytest.mark.parametrize(
    ("seconds", "frames"), [([0.0, 1.0], [0, 30]), ([0.34], [10]), ([1.01], [30]), ([], [])]
)
def test_times_are_the_nearest_frames(seconds, frames):
    assert asking.frames_at(seconds, turning()) == frames


@pytest.mark.parametrize("time", [-0.1, 1.1, float("nan")])
def test_a_time_beyond_the_end_is_told(time):
    with pytest.raises(BenchError, match=r"goes from 0 to 1\.00 s"):
        asking.frames_at([time], turning())


# ---------------------------------------------------------------------------------------------- picture
def test_a_body_is_seen_from_beside_its_front_wherever_it_faces():
    """Turned about the vertical axis and moved, it looks the same; its left is at our right, up is up."""
    motion = turning(91)
    projected = picture.projected(motion, [20, 45, 70])
    still = picture.projected(motion.at(np.zeros(31, dtype=int)), [0])
    np.testing.assert_allclose(projected, np.repeat(still, 3, axis=0), atol=1e-9)
    right, up, near = projected[0].T
    joint = NAMES.index
    assert right[joint("LeftHand")] > 0.3 > -0.3 > right[joint("RightHand")]
    assert up[joint("Head")] > up[joint("Hips")] > up[joint("LeftFoot")]
    assert near[joint("LeftHand")] > near[joint("RightHand")], "from its left"
    lengths = np.linalg.norm(
        projected[0] - projected[0][[max(p, 0) for p in BODY.skeleton.parents]], axis=1
    )
    np.testing.assert_allclose(lengths[1:], BODY.skeleton.bone_lengths[1:], atol=1e-9)


def test_what_is_drawn_is_what_the_method_says(tmp_path, method, figures):
    motion = turning()
    attention = asking.ask(method, motion, "heeds")
    picture.draw(tmp_path / "out.png", attention, motion, [0, 30], "heeds: file")
    poses, strip, _bar = figures[0].axes
    (image,) = strip.images
    expected = [
        attention.weights[:, 0, 0],
        attention.weights[:, 0, 1],
        attention.weights[:, 1, 0],
        attention.weights[:, 1, 2],
    ]
    np.testing.assert_allclose(image.get_array(), expected)
    assert [text.get_text() for text in strip.get_yticklabels()] == [
        "Hips",
        "LeftFoot",
        "Hips",
        "RightFoot",
    ]
    assert [text.get_text().strip() for text in strip.texts] == ["left leg", "right leg"]
    assert [text.get_text() for text in poses.texts] == ["0.00 s", "1.00 s"]
    assert "it is a figure" in figures[0].get_suptitle()
    dots = [each for each in poses.collections if hasattr(each, "get_sizes") and len(each.get_sizes())]
    for frame, each in zip((0, 30), dots, strict=True):
        colours = {tuple(colour) for colour in each.get_facecolors()}
        assert colours == {image.to_rgba(weight) for weight in attention.largest[frame]}


# -------------------------------------------------------------------------------------------- the command


@pytest.fixture
def file(tmp_path) -> Path:
    bvh.write(tmp_path / "in" / "turn.bvh", turning(), scale=100)
    return tmp_path / "in" / "turn.bvh"


def test_numbers_of_a_file(method, file, tmp_path, bench):
    output = tmp_path / "out.csv"
    result = bench("plot", "attention", "-m", "heeds", "--source", file, "-o", output, "--at", "0,1")
    assert result[0] == 0, result[2]
    assert result[1] == f"wrote {output}; it is a figure\n"
    rows = list(csv.reader(output.read_text().splitlines()))
    assert rows[0] == ["frame", "seconds", "part", "joint", "weight"]
    assert rows[1:] == [
        ["0", "0", "left_leg", "Hips", "0.3"],
        ["0", "0", "left_leg", "LeftFoot", "0.1"],
        ["0", "0", "right_leg", "Hips", "0.1"],
        ["0", "0", "right_leg", "RightFoot", "0.2"],
        ["30", "1", "left_leg", "Hips", "0.3"],
        ["30", "1", "left_leg", "LeftFoot", "0.6"],
        ["30", "1", "right_leg", "Hips", "0.6"],
        ["30", "1", "right_leg", "RightFoot", "0.2"],
    ]
    assert bench("plot", "attention", "-m", "heeds", "--source", file, "-o", output)[0] == 0
    assert len(output.read_text().splitlines()) == 1 + 31 * 4


def test_a_picture_of_a_case(method, tmp_path, bench, figures):
    case = CASE
    arguments = ["--source", case, "-d", "puppets[size=tiny]", "-o", tmp_path / "out.svg"]
    result = bench("plot", "attention", "-m", "heeds+footfix", *arguments)
    assert result[0] == 0, result[2]
    assert f"heeds: {case}" in figures[0].get_suptitle()
    assert len(figures[0].axes[0].texts) == picture.UNASKED


CASE = "puppets/ada>ada/walk-001"


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["-m", "heeds", "--source", "puppets/ada>ada/wlk-001"], "near it: 'puppets/ada>ada/walk-001'"),
        (["-m", "heeds"], "whose motion by --source"),
        (["-m", "heeds", "--source", "missing.bvh"], "missing.bvh"),
        (["-m", "heeds", "--source", "missing.bvh[unit=ell]"], "unit='ell' is not known"),
        (["-m", "heeds", "--source", CASE, "--at", "1,x"], "--at takes seconds"),
        (
            ["-m", "heeds", "--source", CASE, "--at", "900"],
            "is no time of this motion",
        ),
        (
            ["-m", "copy_rotations", "--source", CASE],
            "copy_rotations does not say what it attends",
        ),
        (
            ["-m", "heeds", "--source", CASE, "-o", "out.jpg"],
            ".png, .pdf, .svg or .csv",
        ),
        (["-m", "pan[weights=nowhere]", "--source", CASE], "nowhere"),
    ],
)
def test_what_cannot_be_shown_is_a_sentence(method, tmp_path, monkeypatch, bench, arguments, words):
    monkeypatch.chdir(tmp_path)
    output = [] if "-o" in arguments else ["-o", "out.png"]
    code, _, err = bench("plot", "attention", *arguments, *output, "-d", "puppets[size=tiny]")
    assert code == 2
    assert words in err
    assert [each.name for each in tmp_path.iterdir()] == ["in"]


def test_frames_that_are_drawn_unasked():
    assert picture.spread(31) == [0, 8, 15, 22, 30]
    assert picture.spread(1) == [0]
    assert picture.spread(2) == [0, 1]


def test_what_a_method_says_is_what_is_given():
    attention = asking.ask(Says(), turning(), "says")
    assert (attention.parts, attention.joints.tolist(), attention.note) == (("all",), [0, 1], "")
    assert (attention.largest == 0.5).all()
