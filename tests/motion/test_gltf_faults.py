"""Damaged and hostile glTF files: one sentence each that names the file, and never anything else."""

from __future__ import annotations

import numpy as np
import pytest
from gltf_files import Made, packed, person
from refusal import told


@pytest.fixture
def asset() -> Made:
    return person(np.random.default_rng(1), frames=4)


def put(content: dict, where: str, value: object) -> None:
    """Change one place of a JSON: ``accessors.0.count``."""
    *way, last = (int(step) if step.isdecimal() else step for step in where.split("."))
    for step in way:
        content = content[step]
    content[last] = value


NAN = float("nan")


@pytest.mark.parametrize(
    ("where", "value", "sentence"),
    [
        ("accessors.0.count", 10**9, "has 1000000000 elements, which do not fit"),
        ("accessors.0.count", -1, "count=-1, which is no count"),
        ("accessors.0.count", 2, "times and 4 values"),
        ("accessors.0.componentType", 5130, "unknown componentType 5130"),
        ("accessors.0.type", "VEC2", "needs SCALAR"),
        ("accessors.0.bufferView", 10**6, "refers to bufferViews[1000000], and there are"),
        ("accessors.0.sparse", {"count": 10**6}, "unknown componentType"),
        ("bufferViews.0.byteOffset", 2**40, "of a buffer of"),
        ("bufferViews.0.buffer", 3, "refers to buffers[3], and there are 1"),
        ("bufferViews.0.byteStride", 1, "lie 1 bytes apart"),
        ("bufferViews.0.extensions", {"EXT_meshopt_compression": {}}, "compressed by meshopt"),
        ("buffers.0.byteLength", 10**12, "it is cut off"),
        ("buffers.0.uri", "../elsewhere.bin", "which is no file in the same folder"),
        ("buffers.0.uri", "http://example.org/a.bin", "which is no file in the same folder"),
        ("buffers.0.uri", "/etc/passwd", "which is no file in the same folder"),
        ("buffers.0.uri", "gone.bin", "which is not beside it"),
        ("buffers.0.uri", "data:application/octet-stream;base64,*", "cannot be decoded"),
        ("nodes.4.children", [1], "is a child of two nodes"),
        ("nodes.4.children", [10**9], "refers to nodes[1000000000]"),
        ("nodes.4.children", "abc", "'children' that are no list"),
        ("nodes.4.children", ["a"], "'children' of the wrong kind"),
        ("nodes.4.rotation", [0, 0, 1], "is not 4 finite numbers"),
        ("nodes.4.translation", [0, 0, 1e300], "is not 3 finite numbers"),
        ("nodes.4.scale", [0, 0, 0], "scales 'Head' to nothing"),
        ("nodes", {}, "'nodes' is no list of objects"),
        ("skins.0.joints", [99], "refers to nodes[99]"),
        ("skins.0.inverseBindMatrices", 0, "needs MAT4"),
        ("animations.0.samplers.1.interpolation", "BEZIER", "unknown interpolation 'BEZIER'"),
        ("animations.0.channels.0.sampler", 99, "refers to sampler 99 of"),
        ("animations.0.channels.0.target", 7, "has a 'target' that is no object"),
        ("meshes.0.primitives.0.attributes.POSITION", 0, "needs VEC3"),
        ("meshes.0.primitives.0.extensions", {"KHR_draco_mesh_compression": {}}, "compressed by Draco"),
        ("scene", 5, "refers to scenes[5]"),
        ("asset.version", "1.0", "glTF 1.0; glTF 2.0 is read"),
    ],
)
def test_what_is_wrong_is_said(tmp_path, asset, where, value, sentence):
    asset.bytes()
    put(asset.content, where, value)
    path = tmp_path / "odd.glb"
    path.write_bytes(packed(asset.content, bytes(asset.data)))
    assert sentence in told(path)


@pytest.mark.parametrize(
    ("view", "kind", "value", "sentence"),
    [
        (0, "<f4", NAN, "holds NaN or infinity"),
        (1, "<f4", NAN, "holds NaN or infinity"),
        (17, "<f4", 1e10, "holds numbers above 1e+09"),
        (19, "u1", 200, "follows joints that its skin of 16 does not have"),
        (20, "<f4", 1e7, "has weights above 1"),
        (21, "<u2", 999, "has faces with vertices that it has not"),
        (22, "<f4", 1e10, "has bind matrices above 1e+09"),
    ],
    ids=["times", "rotations", "places", "joints", "weights", "faces", "bind matrices"],
)
def test_numbers_that_cannot_be(tmp_path, asset, view, kind, value, sentence):
    asset.bytes()
    start, number = asset.content["bufferViews"][view]["byteOffset"], np.array(value, kind).tobytes()
    asset.data[start : start + len(number)] = number
    assert sentence in told(asset.save(tmp_path / "odd.glb"))


def test_nodes_in_a_circle(tmp_path, asset):
    asset.content["nodes"].append({"name": "a", "children": [19]})
    asset.content["nodes"].append({"name": "b", "children": [18]})
    assert "form a circle" in told(asset.save(tmp_path / "odd.glb"))


def test_an_animation_without_end(tmp_path, asset):
    for sampler in asset.content["animations"][0]["samplers"]:
        sampler["input"] = asset.array([0.0, 1.0, 2.5, 1e8])
    assert "lasts 1e+08 s" in told(asset.save(tmp_path / "odd.glb"))


@pytest.mark.parametrize(
    ("data", "sentence"),
    [
        (b"glTF", "is cut off after 4 bytes"),
        (b"glTF" + b"\1\0\0\0" + b"\x14\0\0\0" + b"\0" * 8, "GLB version 1"),
        (b"glTF" + b"\2\0\0\0" + b"\xff\xff\xff\x7f" + b"\0" * 8, "and 2147483647 are declared"),
        (b"glTF" + b"\2\0\0\0" + b"\x14\0\0\0" + b"\xff\xff\xff\xff" + b"JSON", "has 4294967295 bytes"),
        (b"glTF" + b"\2\0\0\0" + b"\x14\0\0\0" + b"\0\0\0\0" + b"BIN\0", "has no JSON chunk"),
        (b'{"asset": ' + b"[" * 100_000, "no readable JSON"),
        (b'{"asset": NaN}', "NaN is no number of JSON"),
        (b'{"asset": {"version": "2.0"}, "nodes": [{"mesh": ' + b"9" * 5000 + b"}]}", "no readable JSON"),
        (b'{"asset": {"version": "2.0"}}', "holds no skeleton"),
        (b'{"some": "json"}', "it has no 'asset'"),
        (b"\xff\xfe{", "is not glTF but UTF-16 text: save it as UTF-8"),
    ],
)
def test_what_is_no_gltf_at_all(tmp_path, data, sentence):
    path = tmp_path / "odd.glb"
    path.write_bytes(data)
    assert sentence in told(path)
