"""Damaged and hostile glTF files: one sentence each that names the file, and never anything else."""

from __future__ import annotations

import contextlib
import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from gltf_files import Made, damaged, packed, person

from retarget_bench.errors import BenchError, FileError
from retarget_bench.motion import files, importer
from retarget_bench.motion.files.gltf import write_into

FLIPS, MANY = 300, 5_000


@pytest.fixture
def made() -> Made:
    return person(np.random.default_rng(1), frames=4)


def told(path: Path) -> str:
    """The sentence about a file that cannot be read."""
    with pytest.raises(FileError) as error:
        files.read(path).skin()
    message = str(error.value)
    assert message.startswith(str(path.parent))
    assert "\n" not in message
    return message.partition(": ")[2]


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
        ("accessors.0.count", "4", "count='4', which is no count"),
        ("accessors.0.count", 2, "times and 4 values"),
        ("accessors.0.componentType", 5130, "unknown componentType 5130"),
        ("accessors.0.type", "VEC2", "needs SCALAR"),
        ("accessors.0.bufferView", 10**6, "refers to bufferViews[1000000], and there are"),
        ("accessors.0.byteOffset", 10**12, "do not fit"),
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
        ("nodes.3.children", [1], "is a child of two nodes"),
        ("nodes.4.children", [1], "is a child of two nodes"),
        ("nodes.4.children", [10**9], "refers to nodes[1000000000]"),
        ("nodes.4.children", "abc", "'children' that are no list"),
        ("nodes.4.rotation", [0, 0, 1], "is not 4 finite numbers"),
        ("nodes.4.translation", [0, 0, 1e300], "is not 3 finite numbers"),
        ("nodes.4.scale", [0, 0, 0], "scales 'Head' to nothing"),
        ("nodes.4.matrix", ["a"] * 16, "is not 16 finite numbers"),
        ("nodes", {}, "'nodes' is no list of objects"),
        ("nodes", [1, 2], "'nodes' is no list of objects"),
        ("skins.0.joints", [99], "refers to nodes[99]"),
        ("skins.0.inverseBindMatrices", 0, "needs MAT4"),
        ("animations.0.samplers.1.interpolation", "BEZIER", "unknown interpolation 'BEZIER'"),
        ("animations.0.channels.0.sampler", 99, "refers to sampler 99 of"),
        ("animations.0.channels.0.target", 7, "has a 'target' that is no object"),
        ("meshes.0.primitives.0.attributes.POSITION", 0, "needs VEC3"),
        ("meshes.0.primitives.0.extensions", {"KHR_draco_mesh_compression": {}}, "compressed by Draco"),
        ("scene", 5, "refers to scenes[5]"),
        ("asset.version", "1.0", "glTF 1.0; glTF 2.0 is read"),
        ("asset", None, "it has no 'asset'"),
    ],
)
def test_what_is_wrong_is_said(tmp_path, made, where, value, sentence):
    made.bytes()
    put(made.content, where, value)
    path = tmp_path / "odd.glb"
    path.write_bytes(packed(made.content, bytes(made.data)))
    assert sentence in told(path)


@pytest.mark.parametrize("place", [0, 1])
def test_nan_among_the_numbers(tmp_path, made, place):
    made.bytes()
    start = made.content["bufferViews"][place]["byteOffset"]
    made.data[start : start + 4] = np.float32(NAN).tobytes()
    assert "holds NaN or infinity" in told(made.save(tmp_path / "odd.glb"))


def test_nodes_in_a_circle_and_a_very_deep_tree(tmp_path, made):
    made.content["nodes"].append({"name": "a", "children": [19]})
    made.content["nodes"].append({"name": "b", "children": [18]})
    assert "form a circle" in told(made.save(tmp_path / "odd.glb"))
    deep = [{"name": f"n{n}", "children": [n + 1]} for n in range(50_000)] + [{"name": "end"}]
    (tmp_path / "deep.glb").write_bytes(
        packed({"asset": {"version": "2.0"}, "nodes": deep, "skins": [{"joints": [0, 50_000]}]}, b"")
    )
    assert "has nodes 50000 deep; up to 10000 are read" in told(tmp_path / "deep.glb")


def test_an_animation_without_end(tmp_path, made):
    for sampler in made.content["animations"][0]["samplers"]:
        sampler["input"] = made.array([0.0, 1.0, 2.5, 1e8])
    assert "lasts 1e+08 s" in told(made.save(tmp_path / "odd.glb"))


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
        (b"\xff\xfe{", "holds no readable JSON"),
    ],
)
def test_what_is_no_gltf_at_all(tmp_path, data, sentence):
    path = tmp_path / "odd.glb"
    path.write_bytes(data)
    assert sentence in told(path)


def test_every_way_to_cut_a_file_off(tmp_path, made):
    whole = made.bytes()
    path = tmp_path / "odd.glb"
    for size in range(4, len(whole), 997):
        path.write_bytes(whole[:size])
        told(path)


def mutated(content: dict, data: bytes, random: np.random.Generator) -> bytes:
    """A file with something wrong: bytes, a value of the JSON, or the end of it."""
    kind = random.integers(0, 4)
    if kind == 0:
        body = bytearray(packed(content, data))
        for place in random.integers(0, len(body), random.integers(1, 3)):
            body[place] = random.integers(0, 256)
        return bytes(body)
    if kind == 1:
        body = bytearray(data)
        for place in random.integers(0, len(body), random.integers(1, 4)):
            body[place] = random.integers(0, 256)
        return packed(content, bytes(body))
    if kind == 2:
        return packed(content, data)[: random.integers(0, len(data))]
    return packed(damaged(content, random), data)


def read_all(path: Path, seed: int, count: int) -> dict[str, int]:
    """Read so many mutated files; whatever is no sentence is raised. Counts of what became of them."""
    random = np.random.default_rng(seed)
    made = person(random, frames=4)
    made.bytes()
    data = bytes(made.data)
    outcomes = {"read": 0, "refused": 0}
    for _ in range(count):
        path.write_bytes(mutated(made.content, data, random))
        try:
            found = importer.load(path)
            mesh = found.motion.character.mesh
            assert np.isfinite(found.motion.positions).all()
            assert mesh is None or np.isfinite(mesh.vertices).all()
            assert mesh is None or np.isfinite(mesh.weights).all()
        except BenchError as error:
            sentence = str(error)
        else:
            sentence = ""
            if outcomes["read"] % 5 == 0:
                with contextlib.suppress(FileError):
                    write_into.write(path.with_name("out.glb"), found.motion, found)
        assert len(sentence) < 1000
        assert "\n" not in sentence
        outcomes["refused" if sentence else "read"] += 1
    return outcomes


@pytest.mark.filterwarnings("error")
def test_mutated_files_are_read_or_refused_in_a_sentence(tmp_path):
    outcomes = read_all(tmp_path / "odd.glb", 7, FLIPS)
    assert min(outcomes.values()) > FLIPS // 10


LIMITED = """
import json, resource, sys
resource.setrlimit(resource.RLIMIT_AS, (4 << 30, 4 << 30))
resource.setrlimit(resource.RLIMIT_CPU, (900, 900))
from pathlib import Path
from test_gltf_faults import read_all
print(json.dumps(read_all(Path(sys.argv[1]), 11, int(sys.argv[2]))))
"""


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="limits of a process are POSIX")
def test_thousands_of_mutated_files_in_a_limited_process(tmp_path):
    folder = Path(__file__).parent
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", LIMITED, str(tmp_path / "odd.glb"), str(MANY)],
        capture_output=True, text=True, timeout=1200, check=False, cwd=folder,
        env={"PYTHONPATH": f"{folder}:{folder.parents[1]}", "RETARGET_BENCH_CACHE": str(tmp_path)},
    )  # fmt: skip
    assert done.returncode == 0, done.stderr[-2000:]
    outcomes = json.loads(done.stdout)
    assert sum(outcomes.values()) == MANY
    assert min(outcomes.values()) > MANY // 10
