"""A motion written in the dress of another file is that motion, and the file keeps its dress."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from retarget_bench.errors import FileError
from retarget_bench.motion import bvh, importer, rotation
from retarget_bench.motion.bvh import write_like
from retarget_bench.motion.files.reading import Reading

BODY = """JOINT Spine
{{
OFFSET 0 {up} 0
CHANNELS 3 {order}
JOINT Head
{{
OFFSET 0 {up} 0
CHANNELS 3 {order}
End Site
{{
OFFSET 0 {up} 0
}}
}}
{arms}
}}
{legs}
"""
LIMB = """JOINT {side}{a}
{{
OFFSET {x} {y} 0
CHANNELS 3 Zrotation Xrotation Yrotation
JOINT {side}{b}
{{
OFFSET {along}
CHANNELS {second}
JOINT {side}{c}
{{
OFFSET {along}
CHANNELS 3 Zrotation Xrotation Yrotation
End Site
{{
OFFSET {along}
}}
}}
}}
}}
"""
POSITIONS = "Xposition Yposition Zposition "
MIXED = "3 Yrotation Zrotation Xrotation"


def body(knee: str = MIXED) -> str:
    """A figure of 3 units height in a T-pose, hips to feet 2 units, with several channel orders."""
    arms = "".join(
        LIMB.format(
            side=s, a="Arm", b="ForeArm", c="Hand", x=0.3 * i, y=0.4, along=f"{0.5 * i} 0 0", second=MIXED
        )
        for s, i in (("Left", 1), ("Right", -1))
    )
    legs = "".join(
        LIMB.format(side=s, a="UpLeg", b="Leg", c="Foot", x=0.2 * i, y=0, along="0 -1 0", second=knee)
        for s, i in (("Left", 1), ("Right", -1))
    )
    return BODY.format(up=0.5, order="Xrotation Yrotation Zrotation", arms=arms, legs=legs)


def hierarchy(
    channels: str = f"6 {POSITIONS}Zrotation Xrotation Yrotation", offset: str = "0 2 0", **kind
) -> str:
    return f"HIERARCHY\nROOT Hips\n{{\nOFFSET {offset}\nCHANNELS {channels}\n{body(**kind)}}}\n"


def with_dummy(above: str, hips: str) -> str:
    inner = f"JOINT Hips\n{{\nOFFSET 0 2 0\nCHANNELS {hips}\n{body()}}}\n"
    return f"HIERARCHY\nROOT Root\n{{\nOFFSET 0 0 0\nCHANNELS {above}\n{inner}}}\n"


def columns(text: str) -> list[str]:
    return " ".join(re.findall(r"CHANNELS \d+(.*)", text)).split()


def target(path: Path, text: str, place: tuple[float, float, float], spin: float = 0.0) -> Path:
    """The figure standing still; the first position channels found hold its place."""
    names = columns(text)
    row = [0.0] * len(names)
    at = {axis: [i for i, n in enumerate(names) if n == f"{axis}position"][-1] for axis in "XYZ"}
    for axis, value in zip("XYZ", place, strict=True):
        row[at[axis]] = value
    row[names.index("Yrotation")] = spin
    line = " ".join(map(str, row))
    path.write_text(f"{text}MOTION\nFrames: 3\nFrame Time: 0.04\n" + f"{line}\n" * 3)
    return path


def performance(like: importer.Imported, frames: int = 40):
    """Anything that turns every joint through more than a whole turn and moves the root."""
    random = np.random.default_rng(3)
    joints = len(like.motion.skeleton)
    time = np.linspace(0, 1, frames)[:, None, None]
    axes = random.normal(size=(1, joints, 3))
    axes /= np.linalg.norm(axes, axis=-1, keepdims=True)
    turns = rotation.from_rotation_vector(axes * (7.0 * time + random.normal(size=(1, joints, 1))))
    root = np.array([0.3, 1.0, -0.4]) + np.cumsum(random.normal(scale=0.02, size=(frames, 3)), axis=0)
    return like.motion.character.motion(turns, root, fps=48.0)


DRESSES = {
    "absolute root": (hierarchy(), (0, 2, 0)),
    "relative root": (hierarchy(), (0.1, 0, 0.2)),
    "other order": (hierarchy("6 Xrotation Yrotation Zrotation Zposition Yposition Xposition"), (1, 2, 3)),
    "dummy that carries": (
        with_dummy(f"6 {POSITIONS}Zrotation Xrotation Yrotation", "3 Xrotation Yrotation Zrotation"),
        (0, 0, 0),
    ),
    "dummy that stands": (
        with_dummy(
            f"6 {POSITIONS}Zrotation Xrotation Yrotation", f"6 {POSITIONS}Xrotation Yrotation Zrotation"
        ),
        (0, 2, 0),
    ),
}


@pytest.mark.parametrize("rewrite", DRESSES)
@pytest.mark.parametrize("unit", ["m", "cm", "0.37"])
@pytest.mark.parametrize("up", ["y", "z", "-x"])
def test_the_file_holds_the_motion_and_keeps_its_own_hierarchy(tmp_path, rewrite, unit, up):
    text, place = DRESSES[rewrite]
    path = target(tmp_path / "target.bvh", text, place)
    like = importer.load(path, Reading(unit=unit, up=up))
    motion = performance(like)
    assert write_like.write(tmp_path / "out.bvh", motion, like) == ()

    before, after = bvh.parse(path), bvh.parse(tmp_path / "out.bvh")
    assert after.hierarchy.names == before.hierarchy.names
    assert after.hierarchy.channels == before.hierarchy.channels
    assert np.array_equal(after.hierarchy.offsets, before.hierarchy.offsets)
    reading = "relative" if rewrite.startswith("relative") else "absolute"
    back = importer.load(tmp_path / "out.bvh", Reading(unit=unit, up=up, root_place=reading)).motion
    assert back.fps == 48
    size = motion.character.height
    np.testing.assert_allclose(back.positions, motion.positions, atol=2e-6 * size)
    np.testing.assert_allclose(rotation.angle(back.rotations, motion.rotations), 0, atol=1e-6)


def test_angles_do_not_jump(tmp_path):
    like = importer.load(target(tmp_path / "target.bvh", hierarchy(), (0, 2, 0)))
    body_ = like.motion.character
    spin = rotation.about(np.array([0.0, 1.0, 0.0]), np.linspace(0, 12.0, 200))
    turned = np.tile(rotation.identity(), (200, len(body_.skeleton), 1))
    turned[:, body_.joint_of["head"]] = spin
    motion = body_.motion(turned, np.tile([0.0, 1.0, 0.0], (200, 1)), 30.0)
    write_like.write(tmp_path / "out.bvh", motion, like)
    values = bvh.parse(tmp_path / "out.bvh").values
    assert np.abs(np.diff(values, axis=0)).max() < 4  # degrees; 12 radians in 199 steps are 3.5 each
    assert np.ptp(values, axis=0).max() == pytest.approx(np.degrees(12.0), abs=1e-3)


def test_a_joint_with_too_few_channels_is_named_and_turned_as_far_as_it_goes(tmp_path):
    path = target(tmp_path / "target.bvh", hierarchy(knee="1 Xrotation"), (0, 2, 0))
    like = importer.load(path)
    body_ = like.motion.character
    turned = np.tile(rotation.identity(), (2, len(body_.skeleton), 1))
    knee = body_.joint_of["left_leg"]
    turned[1, knee] = rotation.from_euler(np.radians([20.0, 0.0, 15.0]), "XYZ")
    motion = body_.motion(turned, np.tile([0.0, 1.0, 0.0], (2, 1)), 30.0)
    notes = write_like.write(tmp_path / "out.bvh", motion, like)
    assert notes == ("LeftLeg has 1 rotation channels: 15.0 degrees lost",)
    back = importer.load(tmp_path / "out.bvh").motion
    expected = rotation.about(np.array([1.0, 0.0, 0.0]), np.radians(20.0))
    np.testing.assert_allclose(rotation.angle(back.rotations[1, knee], expected), 0, atol=1e-6)


def test_a_body_that_cannot_move_is_refused_and_nothing_is_left(tmp_path):
    text = hierarchy(channels="3 Zrotation Xrotation Yrotation")
    path = tmp_path / "target.bvh"
    row = " ".join(["0"] * len(columns(text)))
    path.write_text(f"{text}MOTION\nFrames: 1\nFrame Time: 0.04\n{row}\n")
    like = importer.load(path)
    with pytest.raises(FileError, match="no position channels"):
        write_like.write(tmp_path / "out.bvh", performance(like), like)
    assert [p.name for p in tmp_path.iterdir()] == ["target.bvh"]
