"""Dialects of BVH, in small files whose meaning is known by construction."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from retarget_bench.errors import FileError, NotSupported
from retarget_bench.motion import bvh, kinematics, rotation
from retarget_bench.motion.bvh.document import frame_rate
from retarget_bench.motion.recording import Recording

POSITION = "Xposition Yposition Zposition"


def spell(order: str) -> str:
    return " ".join(f"{axis}rotation" for axis in order)


def two_bones(
    root: str = f"6 {POSITION} {spell('ZXY')}",
    child: str = f"3 {spell('ZXY')}",
    frames: str = "1 2 3 10 20 30 40 50 60",
    *,
    offset: str = "0 0 0",
    names: tuple[str, str] = ("Hips", "Spine"),
    count: str = "Frames: 1",
    time: str = "Frame Time: 0.033333",
) -> str:
    """A root and one child ten units above it, with a tip two further up."""
    return f"""HIERARCHY
ROOT {names[0]}
{{
	OFFSET {offset}
	CHANNELS {root}
	JOINT {names[1]}
	{{
		OFFSET 0 10 0
		CHANNELS {child}
		End Site
		{{
			OFFSET 0 2 0
		}}
	}}
}}
MOTION
{count}
{time}
{frames}
"""


def save(folder: Path, text: str | bytes, name: str = "a.bvh") -> Path:
    path = folder / name
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path


def turned(recording: Recording, joint: int = 0, frame: int = 0) -> np.ndarray:
    """The rotation matrix of a joint."""
    return rotation.to_matrix(recording.rotations[frame, joint])


def test_a_plain_file(tmp_path: Path) -> None:
    recording = bvh.read(save(tmp_path, two_bones()))
    assert recording.skeleton.names == ("Hips", "Spine")
    assert recording.skeleton.parents.tolist() == [-1, 0]
    assert recording.skeleton.offsets.tolist() == [[0, 0, 0], [0, 10, 0]]
    assert [(site.parent, site.offset) for site in recording.skeleton.end_sites] == [(1, (0, 2, 0))]
    assert recording.root.tolist() == [[1, 2, 3]]
    assert recording.fps == 30
    assert recording.notes == ()


@pytest.mark.parametrize("order", ["XYZ", "XZY", "YXZ", "YZX", "ZXY", "ZYX"])
def test_every_rotation_order_and_several_in_one_file(tmp_path: Path, order: str) -> None:
    path = save(tmp_path, two_bones(f"6 {POSITION} {spell(order)}", f"3 {spell(order[::-1])}"))
    recording = bvh.read(path)
    first = Rotation.from_euler(order, [10, 20, 30], degrees=True).as_matrix()
    second = Rotation.from_euler(order[::-1], [40, 50, 60], degrees=True).as_matrix()
    np.testing.assert_allclose(turned(recording, 0), first, atol=1e-12)
    np.testing.assert_allclose(turned(recording, 1), second, atol=1e-12)


def test_channels_in_any_arrangement(tmp_path: Path) -> None:
    root = "6 Zrotation Yposition Xrotation Xposition Yrotation Zposition"
    recording = bvh.read(save(tmp_path, two_bones(root, frames="10 2 20 1 30 3 40 50 60")))
    assert recording.root.tolist() == [[1, 2, 3]]
    expected = Rotation.from_euler("ZXY", [10, 20, 30], degrees=True).as_matrix()
    np.testing.assert_allclose(turned(recording), expected, atol=1e-12)


def test_a_hinge_and_a_joint_without_channels(tmp_path: Path) -> None:
    hinge = bvh.read(save(tmp_path, two_bones(child="1 Xrotation", frames="1 2 3 10 20 30 40")))
    expected = Rotation.from_euler("X", 40, degrees=True).as_matrix()
    np.testing.assert_allclose(turned(hinge, 1), expected, atol=1e-12)
    stiff = bvh.read(save(tmp_path, two_bones(child="0", frames="1 2 3 10 20 30")))
    np.testing.assert_allclose(turned(stiff, 1), np.eye(3), atol=1e-12)


def test_a_root_without_position_channels_stays_at_its_offset(tmp_path: Path) -> None:
    text = two_bones(f"3 {spell('ZXY')}", frames="10 20 30 40 50 60", offset="0 90 5")
    recording = bvh.read(save(tmp_path, text))
    assert recording.root.tolist() == [[0, 90, 5]]


DRESS = {
    "CRLF": {"\n": "\r\n"},
    "CR": {"\n": "\r"},
    "both line ends": {"OFFSET 0 10 0\n": "OFFSET 0 10 0\r\n"},
    "tab after Frames": {"Frames: ": "Frames:\t"},
    "blanks around the colon": {"Frame Time: ": "Frame  Time : "},
    "blanks": {"1 2 3": "  1\t2   3 ", "60\n": "60 \t \n"},
    "no line end at the end": {"60\n": "60"},
    "blank lines at the end": {"60\n": "60\n\n \n\n"},
    "blank line after MOTION": {"MOTION\n": "MOTION\n\n"},
    "no indentation": {"\n\t": "\n"},
    "brace on the same line": {"\n{": " {", "\n\t{": "{"},
    "case": {"HIERARCHY": "hierarchy", "MOTION": "Motion", "rotation": "Rotation", "OFFSET": "offset"},
    "byte order mark": {"HIERARCHY": "\ufeffHIERARCHY"},
    "exponents": {"10 20 30": "1e1 +2.0E+1 30."},
}


@pytest.mark.parametrize("dress", DRESS)
def test_the_same_file_in_other_dress(tmp_path: Path, dress: str) -> None:
    text = two_bones()
    for old, new in DRESS[dress].items():
        assert old in text
        text = text.replace(old, new)
    plain = bvh.parse(save(tmp_path, two_bones()))
    other = bvh.parse(save(tmp_path, text, "other.bvh"))
    assert other.hierarchy.names == plain.hierarchy.names
    assert other.hierarchy.channels == plain.hierarchy.channels
    assert other.hierarchy.end_sites == plain.hierarchy.end_sites
    np.testing.assert_array_equal(other.hierarchy.offsets, plain.hierarchy.offsets)
    np.testing.assert_array_equal(other.values, plain.values)
    assert other.fps == plain.fps


@pytest.mark.parametrize("name", ["mixamorig:Hips", "Left Arm", "骨盆", "a.b-c_d", "JOINT", "x (1)"])
def test_names_are_kept(tmp_path: Path, name: str) -> None:
    assert bvh.read(save(tmp_path, two_bones(names=("Base", name)))).skeleton.names == ("Base", name)


def test_names_that_are_not_utf8_are_kept_apart(tmp_path: Path) -> None:
    data = (
        two_bones(names=("A", "B"))
        .encode()
        .replace(b"ROOT A", b"ROOT \xe9")
        .replace(b"JOINT B", b"JOINT \xe8")
    )
    assert bvh.read(save(tmp_path, data)).skeleton.names == ("é", "è")


def test_a_name_in_two_branches_gets_a_number(tmp_path: Path) -> None:
    branch = f"JOINT Hand\n{{\nOFFSET 1 0 0\nCHANNELS 3 {spell('ZXY')}\n}}\n"
    text = two_bones().replace("\tJOINT Spine", branch * 2 + "\tJOINT Spine")
    recording = bvh.read(save(tmp_path, text.replace("40 50 60", "0 0 0 0 0 0 40 50 60")))
    assert recording.skeleton.names == ("Hips", "Hand", "Hand_2", "Spine")
    assert any("'Hand_2'" in note for note in recording.notes)


@pytest.mark.parametrize(
    ("seconds", "fps"),
    [
        (0.008333, 120),
        (0.016667, 60),
        (0.033333, 30),
        (0.033, 30),
        (0.041667, 24),
        (0.04, 25),
        (0.008, 125),
        (0.0417083, 24 / 1.001),
        (0.0333667, 30 / 1.001),
        (1 / 29.97, 29.97),
        (0.00694444, 144),
        (1 / 37, 37),
        (1.0, 1),
        (2.5, 0.4),
    ],
)
def test_frame_rates_are_freed_of_rounding(seconds: float, fps: float) -> None:
    assert frame_rate(seconds) == pytest.approx(fps, rel=1e-12)


def test_scale_multiplies_every_length(tmp_path: Path) -> None:
    path = save(tmp_path, two_bones(offset="0 90 0"))
    plain, scaled = bvh.read(path), bvh.read(path, scale=0.01)
    np.testing.assert_allclose(scaled.root, plain.root * 0.01)
    np.testing.assert_allclose(scaled.skeleton.offsets, plain.skeleton.offsets * 0.01)
    assert scaled.skeleton.end_sites[0].offset == (0, 0.02, 0)
    np.testing.assert_array_equal(scaled.rotations, plain.rotations)


def test_rotations_are_continuous_in_sign(tmp_path: Path) -> None:
    lines = [f"0 0 0 {angle} 0 0 0 0 0" for angle in (170, 179, -172, -163)]
    recording = bvh.read(save(tmp_path, two_bones(frames="\n".join(lines), count="Frames: 4")))
    steps = (recording.rotations[1:] * recording.rotations[:-1]).sum(-1)
    assert (steps > 0.9).all()


def test_header_alone(tmp_path: Path) -> None:
    header = bvh.parse_header(save(tmp_path, two_bones(count="Frames: 77", frames="nothing like numbers")))
    assert header.hierarchy.names == ("Hips", "Spine")
    assert (header.frames, header.fps) == (77, 30)


def test_header_longer_than_one_piece(tmp_path: Path) -> None:
    bones = "".join(f"JOINT J{i}\n{{\nOFFSET 0 {i} 0\nCHANNELS 0\n}}\n" for i in range(9000))
    text = two_bones().replace("\tJOINT Spine", bones + "\tJOINT Spine") + "1 2 3 4 5 6 7 8 9\n" * 5000
    header = bvh.parse_header(save(tmp_path, text))
    assert len(header.hierarchy) == 9002


def legged(frames: list[str], *, hips: str, order: str = f"6 {POSITION} {spell('ZXY')}") -> str:
    """Hips with a leg of 90 units straight below and a spine of 50 above."""
    text = two_bones(order, frames="\n".join(frames), count=f"Frames: {len(frames)}", offset=hips)
    leg = f"JOINT Foot\n{{\nOFFSET 0 -90 0\nCHANNELS 3 {spell('ZXY')}\n}}\n"
    return text.replace("\tJOINT Spine", leg + "\tJOINT Spine").replace("OFFSET 0 10 0", "OFFSET 0 50 0")


ROOTS = {
    "standing, absolute": ((0, 95, 0), [(0, 94, 0), (5, 93, 9)], "absolute"),
    "standing, relative": ((0, 95, 0), [(0, -1, 0), (5, -2, 9)], "relative"),
    "not moving, relative": ((0, 95, 0), [(0, 0, 0), (0, 0, 0)], "relative"),
    "hanging half a body low": ((0, 95, 0), [(0, 45, 0), (0, 45, 0)], "absolute"),
    "OFFSET is the first frame": ((-131, 91, -190), [(-131, 91, -190), (0, 1, 9)], "absolute"),
    "far away, relative": ((302, 92, -502), [(-308, -3, 616), (-300, -4, 620)], "relative"),
    "OFFSET is anything": ((-10, 7, -472), [(-5, 95, -456), (-5, 94, -450)], "absolute"),
    "on a table": ((0, 95, 0), [(0, 190, 0), (0, 185, 0)], "absolute"),
}


@pytest.mark.parametrize(("hips", "places", "expected"), ROOTS.values(), ids=ROOTS)
def test_auto_finds_out_how_root_places_are_meant(
    tmp_path: Path, hips: tuple[int, ...], places: list[tuple[int, ...]], expected: str
) -> None:
    frames = [" ".join(map(str, place)) + " 0" * 9 for place in places]
    path = save(tmp_path, legged(frames, hips=" ".join(map(str, hips))))
    shift = np.array(hips) if expected == "relative" else 0
    recording = bvh.read(path)
    np.testing.assert_allclose(recording.root, np.array(places) + shift)
    assert any(f"read as {expected}" in note for note in recording.notes)


def test_the_option_overrides_auto(tmp_path: Path) -> None:
    path = save(tmp_path, legged(["0 94 0" + " 0" * 9], hips="0 95 0"))
    assert bvh.read(path, root="relative").root.tolist() == [[0, 189, 0]]
    assert bvh.read(path, root="absolute").root.tolist() == [[0, 94, 0]]
    with pytest.raises(NotSupported, match="auto, absolute, relative"):
        bvh.read(path, root="both")


def dummy(frames: list[str], child: str = f"6 {POSITION} {spell('ZXY')}") -> str:
    return two_bones(
        child=child,
        frames="\n".join(frames),
        count=f"Frames: {len(frames)}",
        names=("joint_Root", "Hips"),
    )


def test_a_moving_dummy_root_is_folded_exactly(tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    rows = rng.uniform(-90, 90, (5, 12)).round(3)
    recording = bvh.read(save(tmp_path, dummy([" ".join(map(str, row)) for row in rows])))
    assert recording.skeleton.names == ("Hips",)
    for frame, row in enumerate(rows):
        carrier = Rotation.from_euler("ZXY", row[3:6], degrees=True)
        hips = carrier * Rotation.from_euler("ZXY", row[9:], degrees=True)
        np.testing.assert_allclose(recording.root[frame], row[:3] + carrier.apply(row[6:9]), atol=1e-9)
        np.testing.assert_allclose(turned(recording, 0, frame), hips.as_matrix(), atol=1e-12)
    assert any("folded" in note for note in recording.notes)
    assert [site.parent for site in recording.skeleton.end_sites] == [0]


def test_a_dummy_root_is_known_by_name_too(tmp_path: Path) -> None:
    path = save(tmp_path, dummy(["1 2 3 90 0 0 0 0 0", "1 2 3 90 0 0 0 0 5"], f"3 {spell('ZXY')}"))
    assert bvh.read(path).skeleton.names == ("Hips",)
    np.testing.assert_allclose(bvh.read(path).root, [[-9, 2, 3]] * 2, atol=1e-12)
    unfolded = bvh.read(path, fold=False)
    assert unfolded.skeleton.names == ("joint_Root", "Hips")
    places, _ = kinematics.forward(unfolded.skeleton, unfolded.rotations, unfolded.root)
    np.testing.assert_allclose(places[:, 1], bvh.read(path).root, atol=1e-12)


@pytest.mark.parametrize("stated", ["0 10 0", "0 0 0", "0 10.00004 0"])
def test_constant_position_channels_confirm_the_offset(tmp_path: Path, stated: str) -> None:
    rows = [f"0 0 {i} 0 0 0 {stated} 0 0 {i}" for i in range(3)]
    text = dummy(rows).replace("joint_Root", "Hips").replace("JOINT Hips", "JOINT Spine")
    recording = bvh.read(save(tmp_path, text))
    assert recording.skeleton.offsets[1].tolist() == [0, 10, 0]
    assert any("position channels" in note for note in recording.notes)


def test_constant_position_channels_replace_another_offset(tmp_path: Path) -> None:
    rows = [f"0 0 {i} 0 0 0 0 12 1 0 0 {i}" for i in range(3)]
    text = dummy(rows).replace("joint_Root", "Hips").replace("JOINT Hips", "JOINT Spine")
    assert bvh.read(save(tmp_path, text)).skeleton.offsets[1].tolist() == [0, 12, 1]


def test_a_stretching_bone_is_refused(tmp_path: Path) -> None:
    rows = [f"0 0 {i} 0 0 0 0 {10 + i} 0 0 0 0" for i in range(3)]
    path = save(tmp_path, dummy(rows))
    with pytest.raises(FileError, match=r"'Hips' moves by up to 2 against its parent"):
        bvh.read(path, fold=False)


def test_half_a_position_is_refused(tmp_path: Path) -> None:
    path = save(tmp_path, two_bones("4 Xposition " + spell("ZXY"), frames="1 2 3 4 5 6 7"))
    with pytest.raises(FileError, match="1 position channels"):
        bvh.read(path)
