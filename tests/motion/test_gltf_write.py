"""Motions written as GLB: round trips, what stays of a target's file, and the format's own validator."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from alignment_rigs import t_pose
from gltf_files import Made, person, unpacked

from retarget_bench.errors import FileError
from retarget_bench.motion import importer, rotation
from retarget_bench.motion.character import Character, Motion
from retarget_bench.motion.files import writing
from retarget_bench.motion.files.gltf import write_into
from retarget_bench.motion.files.gltf import writing as gltf
from retarget_bench.motion.files.reading import Reading
from retarget_bench.motion.mesh import Mesh
from retarget_bench.motion.skeleton import EndSite, Skeleton


@pytest.fixture
def random():
    return np.random.default_rng(8)


def performance(
    body: Character, random: np.random.Generator, frames: int = 20, fps: float = 30.0
) -> Motion:
    """Anything in which every joint turns and the root moves."""
    steps = random.normal(scale=0.2, size=(frames, len(body.skeleton), 3)).cumsum(axis=0)
    root = np.array([0.4, 1.0, -3.0]) + random.normal(scale=0.05, size=(frames, 3)).cumsum(axis=0)
    return body.motion(rotation.from_rotation_vector(steps), root, fps)


def same(actual: Motion, expected: Motion) -> None:
    """Within 1e-4 degrees and 1e-5 m in every joint and frame, at the same rate."""
    assert actual.fps == pytest.approx(expected.fps, rel=1e-6)
    assert actual.skeleton.names == expected.skeleton.names
    assert np.degrees(rotation.angle(actual.rotations, expected.rotations)).max() < 1e-4
    assert np.abs(actual.positions - expected.positions).max() < 1e-5


def test_bvh_to_glb_to_bvh(tmp_path, random):
    plain = t_pose()
    tips = tuple(EndSite(plain.index(name), (0.01, 0.1, 0.02)) for name in ("HeadTop_End", "RightHand"))
    body = Character.of("t", Skeleton(plain.names, plain.parents, plain.offsets, tips))
    clip = performance(body, random)
    writing.write(tmp_path / "a.glb", clip)
    between = importer.load(tmp_path / "a.glb", Reading(unit="m", up="y")).motion
    writing.write(tmp_path / "a.bvh", between)
    back = importer.load(tmp_path / "a.bvh", Reading(unit="m", up="y", root_place="absolute")).motion
    same(between, clip)
    same(back, clip)
    for converted in (between, back):
        tips = [(site.parent, *np.round(site.offset, 5)) for site in converted.skeleton.end_sites]
        expected = [(site.parent, *np.round(site.offset, 5)) for site in clip.skeleton.end_sites]
        assert np.abs(np.array(tips) - np.array(expected)).max() < 2e-5


def test_a_motion_of_ten_minutes_keeps_its_frames(tmp_path, random):
    """Times are single precision: 600 s are told to a 30,000th of a second."""
    body = importer.load(person(random).save(tmp_path / "a.glb")).motion.character
    body = Character.of("plain", body.skeleton)
    turned = rotation.identity(18_000, len(body.skeleton))
    turned[:, 0] = rotation.about(np.array([0.0, 1.0, 0.0]), np.linspace(0, 300, 18_000))
    clip = body.motion(turned, np.tile([0.0, 1.0, 0.0], (18_000, 1)), 30.0)
    gltf.write(tmp_path / "long.glb", clip)
    same(importer.load(tmp_path / "long.glb", Reading(unit="m")).motion, clip)


def test_a_mesh_comes_back(tmp_path, random):
    skeleton = importer.load(person(random).save(tmp_path / "a.glb")).motion.skeleton
    joints, count = len(skeleton), 30
    weights = np.zeros((count, joints))
    for row in weights:  # up to six joints a vertex: two sets of four
        row[random.permutation(joints)[: random.integers(1, 7)]] = random.uniform(0.1, 1.0)
    weights /= weights.sum(axis=1, keepdims=True)
    pose = rotation.from_rotation_vector(random.normal(scale=0.3, size=(joints, 3)))
    mesh = Mesh(random.normal(size=(count, 3)), random.integers(0, count, (40, 3)), weights, pose)
    body = replace(Character.of("dressed", skeleton), skin=lambda: mesh)
    clip = performance(body, random)
    gltf.write(tmp_path / "b.glb", clip)
    back = importer.load(tmp_path / "b.glb", Reading(unit="m")).motion
    np.testing.assert_array_equal(back.character.mesh.faces, mesh.faces)
    np.testing.assert_allclose(back.character.mesh.weights, weights, atol=1e-6)
    np.testing.assert_allclose(back.character.mesh.skinned(back), mesh.skinned(clip), atol=1e-5)


ABOVE = {
    "nothing": ({},),
    "scaled": (
        {"scale": [0.01, 0.01, 0.01], "rotation": [-0.5, 0.5, 0.5, 0.5]},
        {"translation": [3, 2, 1]},
    ),
    "matrix": ({"matrix": [0, 0, 2, 0, 2, 0, 0, 0, 0, 2, 0, 0, 5, 6, 7, 1]},),
}


@pytest.mark.parametrize("above", ABOVE)
@pytest.mark.parametrize("size", [1.0, 100.0])
@pytest.mark.parametrize("up", ["y", "-x"])
def test_the_motion_goes_into_the_target_s_file_and_all_else_stays(tmp_path, random, above, size, up):
    asset = person(random, above=ABOVE[above], size=size)
    asset.animate("other", {(3, "rotation"): ([0.0, 1.0], [[0, 0, 0, 1], [0, 1, 0, 0]])}, "STEP")
    asset.content |= {"materials": [{"name": "skin"}], "extras": {"anything": [1, {"a": None}]}}
    path = asset.save(tmp_path / "target.glb")
    like = importer.load(path, Reading(up=up))
    clip = performance(like.motion.character, random, 40, 24.0)
    assert writing.write(tmp_path / "out.glb", clip, like) == ()

    before, data = unpacked(path)
    after, more = unpacked(tmp_path / "out.glb")
    assert more[: len(data)] == data
    for key in ("nodes", "skins", "meshes", "materials", "scenes", "extras", "asset"):
        assert after[key] == before[key]
    assert after["accessors"][: len(before["accessors"])] == before["accessors"]
    assert after["bufferViews"][: len(before["bufferViews"])] == before["bufferViews"]
    assert [each["name"] for each in after["animations"]] == ["out", "act", "other"]
    assert after["animations"][1:] == before["animations"]
    back = importer.load(tmp_path / "out.glb", Reading(unit=str(like.findings.unit[1]), up=up))
    same(back.motion, clip)
    old = importer.load(tmp_path / "out.glb", Reading(take="act", unit=str(like.findings.unit[1]), up=up))
    np.testing.assert_array_equal(old.motion.rotations, like.motion.rotations)


def test_places_and_sizes_of_the_take_that_was_read_are_stated(tmp_path, random):
    """A body that another animation gives longer arms is written with these."""
    asset = person(random)
    place = np.array(asset.content["nodes"][6]["translation"]) * 1.2
    asset.animate(
        "long", {(6, "translation"): ([0.0, 1.0], [place, place]), (2, "scale"): ([0.0], [[1.1] * 3])}
    )
    path = asset.save(tmp_path / "target.glb")
    like = importer.load(path, Reading(take="long"))
    plain = importer.load(path)
    assert not like.motion.skeleton.same_as(plain.motion.skeleton, 1e-3)
    clip = performance(like.motion.character, random)
    write_into.write(tmp_path / "1.glb", clip, like)  # a name that could be a number
    same(importer.load(tmp_path / "1.glb").motion, clip)


HELD = {"uri": "data:image/png;base64,iVBORw0KGgo="}


def test_a_text_file_with_its_buffer_and_picture_becomes_one_glb(tmp_path, random):
    folder = tmp_path / "in"
    folder.mkdir()
    asset = person(random)
    picture = b"\x89PNG some picture"
    (folder / "face.png").write_bytes(picture)
    asset.content["images"] = [{"uri": "face.png"}, {"uri": "gone.png"}, {"uri": "odd.tga"}, HELD]
    (folder / "odd.tga").write_bytes(b"x")
    path = asset.save(folder / "target.gltf", linked="target.bin")
    like = importer.load(path)
    clip = performance(like.motion.character, random)
    notes = writing.write(tmp_path / "out.glb", clip, like)
    assert len(notes) == 2
    assert "gone.png" in notes[0]
    assert "odd.tga" in notes[1]
    after, data = unpacked(tmp_path / "out.glb")
    image = after["images"][0]
    view = after["bufferViews"][image["bufferView"]]
    assert image["mimeType"] == "image/png"
    assert data[view["byteOffset"] : view["byteOffset"] + view["byteLength"]] == picture
    assert after["images"][3] == HELD
    same(importer.load(tmp_path / "out.glb").motion, clip)


def test_several_buffers_become_one(tmp_path, random):
    asset = person(random)
    path = asset.save(tmp_path / "target.glb")
    content, data = unpacked(path)
    half = content["bufferViews"][-3]["byteOffset"]
    for view in content["bufferViews"][-3:]:
        view |= {"buffer": 1, "byteOffset": view["byteOffset"] - half}
    content["buffers"] = [
        {"byteLength": half, "uri": "a.bin"}, {"byteLength": len(asset.data) - half, "uri": "b.bin"}
    ]  # fmt: skip
    (tmp_path / "a.bin").write_bytes(data[:half])
    (tmp_path / "b.bin").write_bytes(data[half:])
    (tmp_path / "two.gltf").write_text(json.dumps(content))
    like = importer.load(tmp_path / "two.gltf")
    writing.write(tmp_path / "out.glb", like.motion, like)
    back = importer.load(tmp_path / "out.glb").motion
    same(back, like.motion)
    np.testing.assert_allclose(
        back.character.mesh.vertices, like.motion.character.mesh.vertices, rtol=0, atol=1e-12
    )


def test_what_cannot_be_written_leaves_nothing(tmp_path, random):
    path = person(random).save(tmp_path / "target.glb")
    like = importer.load(path)
    clip = performance(like.motion.character, random)
    clip.rotations[3, 2] = np.nan
    for like_ in (like, None):
        with pytest.raises(FileError, match="frame 4 of the motion holds NaN"):
            writing.write(tmp_path / "out.glb", clip, like_)
    sheared = person(random, above=({"scale": [1, 2, 1]},))
    like = importer.load(sheared.save(tmp_path / "sheared.glb"), Reading(unit="m"))
    with pytest.raises(FileError, match="cannot state this motion, scaled as they are"):
        writing.write(tmp_path / "out.glb", performance(like.motion.character, random), like)
    with pytest.raises(FileError, match="has no frames"):
        writing.write(tmp_path / "out.glb", clip.at(slice(0, 0)))
    assert sorted(each.name for each in tmp_path.iterdir()) == ["sheared.glb", "target.glb"]


CHECK = """
const validator = require('gltf-validator'), fs = require('fs');
(async () => { const found = {};
for (const file of process.argv.slice(1)) {
  const report = await validator.validateBytes(new Uint8Array(fs.readFileSync(file)));
  found[file] = report.issues.messages.filter(m => m.severity < 2).map(m => m.code + ' ' + m.pointer); }
console.log(JSON.stringify(found)); })()
"""


@pytest.fixture(scope="module")
def validate():
    """The Khronos validator: errors and warnings by file. ``NODE_PATH`` says where npm put it."""
    node = shutil.which("node")
    if node is None:
        pytest.skip("no node to run gltf-validator with")
    there = subprocess.run(
        [node, "-e", "require('gltf-validator')"], capture_output=True, env=dict(os.environ)
    )
    if there.returncode:
        pytest.skip("no gltf-validator: npm install gltf-validator, and set NODE_PATH to node_modules")

    def run(*paths: Path) -> dict[str, list[str]]:
        completed = subprocess.run(
            [node, "-e", CHECK, *map(str, paths)], capture_output=True, text=True, check=True
        )
        return json.loads(completed.stdout)

    return run


def test_files_are_valid(tmp_path, random, validate):
    asset: Made = person(random, above=ABOVE["scaled"])
    target = asset.save(tmp_path / "target.glb")
    like = importer.load(target)
    clip = performance(like.motion.character, random)
    writing.write(tmp_path / "into.glb", clip, like)
    writing.write(tmp_path / "new.glb", clip)
    plain = Character.of("plain", clip.skeleton)
    writing.write(tmp_path / "bare.glb", plain.motion(clip.rotations, clip.root, 30.0))
    writing.write(tmp_path / "one.glb", clip.at(slice(0, 1)))
    reports = validate(*sorted(tmp_path.glob("*.glb")))
    assert len(reports) == 5
    before = reports.pop(str(target))
    # what the target's file had stays, and nothing comes to it
    assert reports.pop(str(tmp_path / "into.glb")) == before
    assert all(each == [] for each in reports.values()), reports
