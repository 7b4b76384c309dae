"""glTF files against what they mean by 4 x 4 matrices, and scipy's splines."""

from __future__ import annotations

import json

import numpy as np
import pytest
from gltf_files import NAMES, PARENTS, Made, at, person, skinned, values_of, world
from scipy.interpolate import CubicHermiteSpline
from scipy.spatial.transform import Rotation

from retarget_bench.errors import FileError, NotSupported
from retarget_bench.motion import files, importer, kinematics
from retarget_bench.motion.files.reading import Reading
from retarget_bench.motion.recording import Recording

ABOVE = {
    "nothing": ({},),
    "scaled": (
        {"scale": [0.01, 0.01, 0.01], "rotation": [-0.5, 0.5, 0.5, 0.5]},
        {"translation": [3, 2, 1]},
    ),
    "twice": ({"scale": [10, 10, 10]}, {"scale": [0.1, 0.1, 0.1], "translation": [1, 0, 2]}),
    "matrix": ({"matrix": [0, 0, 2, 0, 2, 0, 0, 0, 0, 2, 0, 0, 5, 6, 7, 1]},),
    "mirrored": ({"scale": [-1, 1, 1]}, {"translation": [0, 1, 0]}),
}


@pytest.fixture
def random():
    return np.random.default_rng(5)


def positions(recording: Recording) -> np.ndarray:
    return kinematics.forward(recording.skeleton, recording.rotations, recording.root)[0]


def expected(asset: Made, first: int, frames: int, fps: float) -> np.ndarray:
    places = []
    for frame in range(frames):
        total = world(asset, at(asset, 0, float(np.float32(frame / fps))))
        places.append([total[first + joint][:3, 3] for joint in range(len(NAMES))])
    return np.array(places)


@pytest.mark.parametrize("above", ABOVE)
def test_joints_are_where_the_matrices_of_their_nodes_put_them(tmp_path, random, above):
    asset = person(random, above=ABOVE[above])
    recording = files.read(asset.save(tmp_path / "a.glb"))
    assert recording.skeleton.names == NAMES
    assert recording.skeleton.parents.tolist() == list(PARENTS)
    assert (recording.fps, len(recording.root)) == (30.0, 12)
    expected_places = expected(asset, len(ABOVE[above]), 12, 30.0)
    np.testing.assert_allclose(
        positions(recording), expected_places, atol=1e-5 * np.abs(expected_places).max()
    )


@pytest.mark.parametrize("above", ABOVE)
def test_the_surface_moves_as_the_specification_says(tmp_path, random, above):
    """The pose at rest is the bind pose here, so that skinning twice is skinning once."""
    asset = person(random, above=ABOVE[above])
    recording = files.read(asset.save(tmp_path / "a.glb"))
    mesh = recording.skin()
    body = importer.load(tmp_path / "a.glb", Reading(unit="m")).motion
    surface = mesh.skinned(body)
    node = len(asset.content["nodes"]) - 1
    for frame in (0, 5, 11):
        total = world(asset, at(asset, 0, float(np.float32(frame / 30))))
        expected = skinned(asset, node, total)
        np.testing.assert_allclose(surface[frame], expected, atol=2e-5 * np.abs(expected).max())
    np.testing.assert_allclose(body.character.mesh.skinned(body), surface, atol=1e-9)


def test_the_skeleton_stands_in_the_bind_pose_and_not_in_that_of_the_nodes(tmp_path, random):
    asset = person(random)
    bound = positions(files.read(asset.save(tmp_path / "a.glb")))
    for node in asset.content["nodes"][2:17]:  # all joints but the root are left in some other pose
        node["rotation"] = Rotation.random(random_state=random).as_quat().tolist()
    recording = files.read(asset.save(tmp_path / "b.glb"))
    np.testing.assert_allclose(positions(recording), bound, atol=1e-6)
    upright = recording.skeleton.rest_positions
    np.testing.assert_allclose(upright[6] - upright[5], [0.25, 0, 0], atol=1e-6)
    assert importer.load(tmp_path / "b.glb").findings.rest_pose == "T-pose"


# -------------------------------------------------------------------------------------- interpolation
def tracks_of_the_root(asset: Made) -> tuple[dict, dict]:
    """The samplers of the hips' translation and rotation."""
    item = asset.content["animations"][0]
    channels = {c["target"]["path"]: c["sampler"] for c in item["channels"] if c["target"]["node"] == 1}
    return item["samplers"][channels["translation"]], item["samplers"][channels["rotation"]]


def test_steps_hold_the_last_value(tmp_path, random):
    asset = person(random, frames=31)
    times = np.array([0.0, 0.5, 1.0])
    places = np.array([[0, 1, 0], [1, 1, 0], [0, 1, 2]], dtype=float)
    sampler, _ = tracks_of_the_root(asset)
    sampler |= {"input": asset.array(times), "output": asset.array(places), "interpolation": "STEP"}
    root = files.read(asset.save(tmp_path / "a.glb")).root
    np.testing.assert_allclose(root[[0, 14, 15, 29, 30]], places[[0, 0, 1, 1, 2]])


def test_cubic_splines_are_hermite_s(tmp_path, random):
    asset = person(random, frames=31)
    times = np.array([0.0, 0.3, 0.5, 1.0])
    values, tangents = random.normal(size=(4, 3)), random.normal(size=(4, 3))
    turns = random.normal(size=(4, 3, 4))  # in-tangent, value, out-tangent
    place, turn = tracks_of_the_root(asset)
    stacked = np.stack([tangents, values, tangents], axis=1).reshape(-1, 3)
    how = {"input": asset.array(times), "interpolation": "CUBICSPLINE"}
    place |= how | {"output": asset.array(stacked)}
    turn |= how | {"output": asset.array(turns.reshape(-1, 4))}
    recording = files.read(asset.save(tmp_path / "a.glb"))
    seconds = np.arange(31) / 30
    keys = np.float32(times).astype(float)
    spline = CubicHermiteSpline(keys, values, tangents)
    np.testing.assert_allclose(recording.root, spline(seconds), atol=1e-5)
    rest = Rotation.from_quat(asset.content["nodes"][1]["rotation"])
    for frame, key in ((4, 0), (12, 1), (23, 2)):
        ends = turns[key, 1], turns[key + 1, 1]
        piece = CubicHermiteSpline(keys[key : key + 2], ends, (turns[key, 2], turns[key + 1, 0]))
        expected = Rotation.from_quat(piece(seconds[frame]))  # made unit
        measured = Rotation.from_quat(recording.rotations[frame, 0, [1, 2, 3, 0]])
        assert (measured * rest * expected.inv()).magnitude() < 1e-5


@pytest.mark.parametrize("fps", [24.0, 25.0, 29.97, 37.5, 60.0, 120.0])
def test_evenly_spaced_keys_are_the_frames(tmp_path, random, fps):
    asset = person(random, fps=fps, frames=40)
    recording = files.read(asset.save(tmp_path / "a.glb"))
    assert recording.fps == pytest.approx(fps, rel=1e-5)
    assert len(recording.root) == 40


@pytest.mark.parametrize(
    ("frames", "fps"), [((0, 3, 4, 25), 25.0), ((0, 1, 7, 24), 24.0), ((0.0, 1.3, 9.51, 28.2), 30.0)]
)
def test_other_keys_are_sampled_at_the_rate_whose_frames_they_lie_on(tmp_path, random, frames, fps):
    asset = person(random, frames=4)
    keys = np.array(frames) / fps
    for sampler in asset.content["animations"][0]["samplers"]:
        sampler["input"] = asset.array(keys)
    recording = files.read(asset.save(tmp_path / "a.glb"))
    assert recording.fps == fps
    assert len(recording.root) == int(frames[-1]) + 1
    expected = world(asset, at(asset, 0, 2 / fps))[1][:3, 3]
    np.testing.assert_allclose(recording.root[2], expected, atol=1e-5)


# ---------------------------------------------------------------------------------- how numbers are kept
def changed_accessor(asset: Made, number: int, kind: str, most: float) -> None:
    """The numbers of an accessor as normalised whole numbers."""
    item, view = asset.content["accessors"][number], None
    view = asset.content["bufferViews"][item["bufferView"]]
    old = np.frombuffer(bytes(asset.data), "<f4", item["count"] * 4, view["byteOffset"]).reshape(-1, 4)
    new = asset.array(np.round(old * most), kind, normalized=True)
    asset.content["accessors"][number] = asset.content["accessors"][new]


@pytest.mark.parametrize(("kind", "most", "within"), [("i2", 32767, 1e-4), ("i1", 127, 0.03)])
def test_normalised_rotations(tmp_path, random, kind, most, within):
    asset = person(random)
    plain = files.read(asset.save(tmp_path / "a.glb")).rotations
    for channel in asset.content["animations"][0]["channels"]:
        if channel["target"]["path"] == "rotation":
            number = asset.content["animations"][0]["samplers"][channel["sampler"]]["output"]
            changed_accessor(asset, number, kind, most)
    recording = files.read(asset.save(tmp_path / "b.glb")).rotations
    assert 0 < np.abs(recording - plain).max() < within


def test_sparse_and_interleaved_numbers(tmp_path, random):
    asset = person(random)
    plain = files.read(asset.save(tmp_path / "a.glb"))
    place, turn = tracks_of_the_root(asset)
    item = asset.content["accessors"][place["output"]]
    view = asset.content["bufferViews"][item["bufferView"]]
    values = np.frombuffer(bytes(asset.data), "<f4", 36, view["byteOffset"]).reshape(12, 3).copy()
    wrong = values.copy()
    wrong[[3, 7]] = 99.0
    rows, by = asset.view(np.array([3, 7], "<u2").tobytes()), asset.view(values[[3, 7]].tobytes())
    sparse = {
        "count": 2,
        "indices": {"bufferView": rows, "componentType": 5123},
        "values": {"bufferView": by},
    }
    place["output"] = asset.array(wrong, sparse=sparse)
    empty = {"componentType": 5126, "count": 12, "type": "VEC3"}  # zeros, all replaced
    rows, by = asset.view(np.arange(12, dtype="<u1").tobytes()), asset.view(values.tobytes())
    sparse = {
        "count": 12,
        "indices": {"bufferView": rows, "componentType": 5121},
        "values": {"bufferView": by},
    }
    recording = files.read(asset.save(tmp_path / "b.glb"))
    np.testing.assert_array_equal(recording.root, plain.root)
    place["output"] = asset.add("accessors", empty | {"sparse": sparse})
    np.testing.assert_array_equal(files.read(asset.save(tmp_path / "c.glb")).root, plain.root)
    # every quaternion followed by 20 bytes of something else
    item = asset.content["accessors"][turn["output"]]
    view = asset.content["bufferViews"][item["bufferView"]]
    values = np.frombuffer(bytes(asset.data), "<f4", 48, view["byteOffset"]).reshape(12, 4)
    wide = np.full((12, 9), np.nan, "<f4")
    wide[:, 2:6] = values
    asset.content["accessors"][turn["output"]] |= {
        "bufferView": asset.view(wide.tobytes(), byteStride=36), "byteOffset": 8,
    }  # fmt: skip
    np.testing.assert_array_equal(files.read(asset.save(tmp_path / "d.glb")).rotations, plain.rotations)


def test_buffers_beside_and_inside_a_text_file(tmp_path, random):
    asset = person(random)
    plain = files.read(asset.save(tmp_path / "a.glb"))
    for name, linked in (("b.gltf", ""), ("c.gltf", "some data.bin")):
        recording = files.read(asset.save(tmp_path / name, linked=linked))
        np.testing.assert_array_equal(recording.rotations, plain.rotations)
        np.testing.assert_array_equal(recording.skin().vertices, plain.skin().vertices)
    content = json.loads((tmp_path / "c.gltf").read_text())
    content["buffers"][0]["uri"] = "some%20data.bin"
    (tmp_path / "c.gltf").write_text(json.dumps(content))
    assert files.read(tmp_path / "c.gltf").fps == 30


# ---------------------------------------------------------------------------------- takes and bodies
def two_takes(random: np.random.Generator) -> Made:
    asset = person(random)
    asset.animate("wave", {(1, "translation"): ([0.0, 1.0], [[0, 1, 0], [1, 1, 0]])})
    return asset


def test_a_take_is_chosen_by_name_by_number_and_in_the_path(tmp_path, random):
    path = two_takes(random).save(tmp_path / "a.glb")
    assert files.takes(path) == ("act", "wave")
    first, second = files.read(path), files.read(path, Reading(take="wave"))
    assert "animation 1 of 2 'act' (take= chooses another: 2 'wave')" in first.notes[0]
    assert len(second.root) == 31
    for recording in (
        files.read(path, Reading(take="2")),
        files.read(f"{path}#wave"),
        files.read(f"{path}#2"),
        files.read(path, Reading(take="WAVE")),
    ):
        np.testing.assert_array_equal(recording.root, second.root)
    with pytest.raises(NotSupported, match=r"a\.glb has no animation 'run'; it has 1 'act', 2 'wave'"):
        files.read(path, Reading(take="run"))
    (tmp_path / "odd#name.glb").write_bytes(path.read_bytes())
    assert len(files.read(tmp_path / "odd#name.glb").root) == 12
    assert len(files.read(f"{tmp_path}/odd#name.glb#wave").root) == 31


def test_takes_have_one_body_whatever_moves_in_them(tmp_path, random):
    """A root above the hips that moves in one take alone is folded in both."""
    asset = person(random, above=({}, {"name": "Bone"}))
    asset.content["skins"][0]["joints"].append(1)
    matrices = asset.array(np.tile(np.eye(4).ravel(), (17, 1)))
    asset.content["skins"][0]["inverseBindMatrices"] = matrices
    asset.animate("still", {(5, "rotation"): ([0.0, 0.1], [[0, 0, 0, 1], [1, 0, 0, 0]])})
    path = asset.save(tmp_path / "a.glb")
    for take in ("act", "still"):
        recording = files.read(path, Reading(take=take))
        assert recording.skeleton.names[0] == "Hips"
        assert any("'Bone' only carries 'Hips' and is folded" in note for note in recording.notes)


def test_two_skins_on_one_skeleton_are_one_body_and_apart_two(tmp_path, random):
    asset = person(random)
    half = dict(asset.content["skins"][0])
    half |= {
        "joints": half["joints"][4:7],
        "inverseBindMatrices": asset.array(np.tile(np.eye(4).ravel(), (3, 1))),
    }
    asset.add("skins", half)
    assert len(files.read(asset.save(tmp_path / "one.glb")).skeleton) == len(NAMES)
    other = len(asset.content["nodes"])
    asset.add("nodes", {"name": "Tail", "children": [other + 1]})
    asset.add("nodes", {"name": "Tip", "translation": [0, 1, 0]})
    asset.add("skins", {"joints": [other, other + 1]})
    asset.content["scenes"][0]["nodes"].append(other)
    path = asset.save(tmp_path / "two.glb")
    recording = files.read(path)
    assert "body 1 of 2, 'Hips' (body= chooses another: 1 'Hips', 2 'Tail')" in recording.notes[0]
    assert files.read(path, Reading(body="Tail")).skeleton.names == ("Tail", "Tip")
    # the scene that the file shows decides, though the other body is larger
    asset.content["scenes"].append({"nodes": [other]})
    asset.content["scene"] = 1
    assert files.read(asset.save(tmp_path / "scene.glb")).skeleton.names == ("Tail", "Tip")


def test_a_joint_apart_from_the_others_is_left_out(tmp_path, random):
    asset = person(random)
    expected = files.read(asset.save(tmp_path / "a.glb"))
    apart = asset.add("nodes", {"name": "neutral_bone"})
    skin = asset.content["skins"][0]
    matrices = values_of(asset, skin["inverseBindMatrices"])
    skin["joints"].append(apart)
    skin["inverseBindMatrices"] = asset.array(np.vstack([matrices, np.eye(4).reshape(1, 16)]))
    recording = files.read(asset.save(tmp_path / "b.glb"))
    assert recording.skeleton.names == NAMES
    assert "left out beside the body: 'neutral_bone'" in recording.notes
    np.testing.assert_array_equal(recording.rotations, expected.rotations)
    np.testing.assert_array_equal(recording.skin().vertices, expected.skin().vertices)


def test_files_without_skin_or_without_animation(tmp_path, random):
    asset = person(random, skin=False)
    tip = asset.add("nodes", {"name": "HeadTip", "translation": [0, 0.2, 0]})
    asset.content["nodes"][4]["children"] = [tip]
    recording = files.read(asset.save(tmp_path / "a.glb"))
    assert recording.skin is None
    assert recording.skeleton.names == NAMES
    assert [site.parent for site in recording.skeleton.end_sites] == [3]
    assert np.linalg.norm(recording.skeleton.end_sites[0].offset) == pytest.approx(0.2)
    still = person(random)
    del still.content["animations"]
    recording = files.read(still.save(tmp_path / "b.glb"))
    assert len(recording.root) == 1
    assert "one frame, the pose at rest" in recording.notes[0]
    expected = [each[:3, 3] for each in world(still)[1:17]]
    np.testing.assert_allclose(positions(recording)[0], expected, atol=1e-6)
    empty = Made()
    empty.add("nodes", {"name": "cube"})
    with pytest.raises(FileError, match="holds no skeleton"):
        files.read(empty.save(tmp_path / "c.glb"))


@pytest.mark.parametrize("animated", [("LeftArm", "LeftForeArm", "RightArm"), ("Head",), ("Hips", "Spine")])
@pytest.mark.parametrize("prefix", ["", "mixamorig:", "J_Bip_C_"])
def test_a_body_without_skin_is_complete_where_a_part_is_animated(tmp_path, random, animated, prefix):
    asset = person(random, skin=False, above=({}, {"name": "Scene root"}))
    asset.add("nodes", {"name": "Camera", "camera": 0})
    asset.content["nodes"][0]["children"].append(len(asset.content["nodes"]) - 1)
    for node in asset.content["nodes"]:
        node["name"] = prefix + node["name"] if node["name"] in NAMES else node["name"]
    nodes = {prefix + name for name in animated}
    action = asset.content["animations"][0]
    action["channels"] = [
        each
        for each in action["channels"]
        if asset.content["nodes"][each["target"]["node"]]["name"] in nodes
    ]
    recording = files.read(asset.save(tmp_path / "a.glb"))
    assert recording.skeleton.names == tuple(prefix + name for name in NAMES)


def test_what_a_skeleton_cannot_do_is_a_doubt(tmp_path, random):
    asset = person(random)
    times = np.arange(12) / 30
    asset.animate("stretch", {(9, "scale"): (times, 1 + times[:, None] * [1, 1, 1])})
    findings = importer.load(asset.save(tmp_path / "a.glb"), Reading(take="stretch")).findings
    assert any("changes the size of 'RightForeArm'" in each for each in findings.warnings)
    assert not importer.load(tmp_path / "a.glb", Reading(take="act")).findings.doubts


# ------------------------------------------------------------------------------------- what is decided
def test_the_format_says_metres_and_a_file_in_centimetres_is_found_out(tmp_path, random):
    metres = importer.load(person(random).save(tmp_path / "m.glb")).findings
    assert (metres.unit[0], metres.unit_prescribed) == ("m", True)
    assert "m = 1 m (as stated)" in metres.text()
    assert "up axis    y (as stated)" in metres.text()
    large = importer.load(person(random, size=100.0).save(tmp_path / "cm.glb"))
    assert (large.findings.unit[0], large.findings.unit_prescribed) == ("cm", False)
    assert large.motion.character.height == pytest.approx(metres.height, rel=1e-5)
    assert np.ptp(large.motion.character.mesh.vertices, axis=0).max() < 20  # metres, too
    assert importer.load(tmp_path / "cm.glb", Reading(unit="m")).findings.height > 100


def test_a_body_that_stands_along_another_axis_is_doubted_and_can_be_turned(tmp_path, random):
    asset = person(random, above=({"rotation": [np.sqrt(0.5), 0, 0, np.sqrt(0.5)]},), frames=3)
    for node in asset.content["nodes"][:1]:
        del node["rotation"]
    path = asset.save(tmp_path / "z.glb")
    explicit = importer.load(path)
    assert any("the body stands along" in each and "up=" in each for each in explicit.findings.warnings)
    axis = explicit.findings.warnings[0].split("up=")[1].split()[0]
    turned = importer.load(path, Reading(up=axis))
    head, foot = (turned.motion.character.joint_of[role] for role in ("head", "left_foot"))
    assert (turned.motion.positions[:, head, 1] - turned.motion.positions[:, foot, 1]).min() > 1.0
