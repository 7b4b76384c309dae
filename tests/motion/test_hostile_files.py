"""Named faults of motion files: small files that unpack to much, deep trees, and what is no file at all.

Each is told in one sentence that names the file, before anything large is made of it.
"""

from __future__ import annotations

import os
import socket
import tracemalloc
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from fbx_files import Id, Joint, Node, binary, person
from fbx_files import Made as FbxMade
from gltf_files import packed
from gltf_files import person as gltf_person
from refusal import told

from retarget_bench.errors import FileError, NotSupported
from retarget_bench.motion import files, importer
from retarget_bench.motion.files.catalogue import catalogue
from retarget_bench.motion.files.reading import Reading

SUFFIXES = files.suffixes()
MEMORY = 400e6
"""Bytes that reading any of these may take meanwhile; all that they unpack to is gigabytes."""


def zeros(path: Path) -> Path:
    """Thirty animated nodes, each with 4,000,000 keys that are zeros without data."""
    many = range(30)
    one = {"componentType": 5126, "count": 4_000_000}
    accessors = [{**one, "type": "SCALAR"}, *({**one, "type": "VEC4"} for _ in many)]
    nodes = [{"name": f"n{n}", "children": [n + 1] if n + 1 < len(many) else []} for n in many]
    animation = {
        "samplers": [{"input": 0, "output": n + 1} for n in many],
        "channels": [{"sampler": n, "target": {"node": n, "path": "rotation"}} for n in many],
    }
    content = {
        "asset": {"version": "2.0"},
        "nodes": nodes,
        "accessors": accessors,
        "animations": [animation],
    }
    path.write_bytes(packed(content, b""))
    return path


def shared_data(path: Path) -> Path:
    """Many tracks that say the same few bytes over and over, each with many elements of them."""
    asset = gltf_person(np.random.default_rng(1), frames=4)
    view = asset.view(bytes(4_000_000))
    tracks = {}
    for node in range(1, 16):
        for what, kind in (("translation", "VEC3"), ("rotation", "VEC4"), ("scale", "VEC3")):
            common = {"bufferView": view, "componentType": 5126, "count": 250_000}
            numbers = [asset.add("accessors", {**common, "type": each}) for each in ("SCALAR", kind)]
            tracks[node, what] = tuple(numbers)
    asset.content["animations"] = []
    asset.animate("act", tracks)
    path.write_bytes(asset.bytes())
    return path


def buffers(path: Path) -> Path:
    """Buffers of more than 4 GB in all, each of them the same sparse file."""
    asset = gltf_person(np.random.default_rng(1), frames=4)
    asset.save(path)
    (path.parent / "large.bin").write_bytes(b"")
    os.truncate(path.parent / "large.bin", 5 << 30)
    asset.content["buffers"] = [{"byteLength": len(asset.data), "uri": "large.bin"}]
    path.write_bytes(packed(asset.content, b""))
    return path


def packed_zeros(path: Path) -> Path:
    """Meshes with 48,000,000 numbers, which zlib packs to a thousandth."""
    nodes = person(np.random.default_rng(0), frames=3).nodes()
    vertices = np.zeros(12_000_000)
    for number in range(4):
        mesh, model = Id(5_000_000 + number), Id(6_000_000 + number)
        faces = np.array([0, 1, -3], dtype="i4")
        own = [Node("Vertices", [vertices]), Node("PolygonVertexIndex", [faces])]
        nodes[2].children += [
            Node("Geometry", [mesh, "Geometry::", "Mesh"], own),
            Node("Model", [model, f"Model::mesh {number}", "Mesh"]),
        ]
        nodes[3].children += [Node("C", ["OO", mesh, model]), Node("C", ["OO", model, Id(0)])]
    path.write_bytes(binary(nodes))
    return path


@pytest.mark.parametrize(
    ("make", "name", "sentence"),
    [
        (
            zeros,
            "a.glb",
            "unpacks to 20,000,000 numbers up to accessors[1], from 0 bytes of data: it is damaged",
        ),
        (shared_data, "a.glb", "bytes of data: it is damaged"),
        (buffers, "a.gltf", "large.bin: has 5.369 GB; files of up to 4.3 GB are read"),
        (packed_zeros, "a.fbx", "needs more memory than a motion file should: it is damaged"),
    ],
    ids=lambda each: getattr(each, "__name__", ""),
)
def test_what_unpacks_to_much_is_not_unpacked(tmp_path: Path, make: Callable, name: str, sentence: str):
    path = make(tmp_path / name)
    tracemalloc.start()
    try:
        message = told(path)
        assert tracemalloc.get_traced_memory()[1] < MEMORY
    finally:
        tracemalloc.stop()
    assert sentence in message


def gltf_chain(path: Path, count: int) -> Path:
    nodes = [{"name": f"n{n}", "children": [n + 1] if n + 1 < count else []} for n in range(count)]
    content = {"asset": {"version": "2.0"}, "nodes": nodes, "skins": [{"joints": list(range(count))}]}
    path.write_bytes(packed(content, b""))
    return path


def bvh_chain(path: Path, count: int) -> Path:
    joints = (
        f"JOINT n{n}\n{{\nOFFSET 0 1 0\nCHANNELS 3 Zrotation Xrotation Yrotation" for n in range(count)
    )
    head = "\n".join(joints).replace("JOINT", "ROOT", 1)
    path.write_text(
        f"HIERARCHY\n{head}\n" + "}\n" * count + f"MOTION\nFrames: 1\nFrame Time: .1\n{'0 ' * 3 * count}\n"
    )
    return path


def fbx_chain(path: Path, count: int) -> Path:
    return FbxMade([Joint(f"n{n}", n - 1, np.array([0, 1.0, 0])) for n in range(count)]).save(path)


@pytest.mark.parametrize(
    ("make", "name", "count", "sentence"),
    [
        (gltf_chain, "a.glb", 100_000, "has nodes 99999 deep; up to 10000 are read"),
        (gltf_chain, "a.glb", 9_000, "has a body of 9000 joints; 2000 are read"),
        (bvh_chain, "a.bvh", 100_000, "more than 10000 joints"),
        (bvh_chain, "a.bvh", 3_000, "has 3000 joints; bodies of up to 2000 are read"),
        (fbx_chain, "a.fbx", 6_000, "has nodes more than 5000 deep: it is damaged"),
        (fbx_chain, "a.fbx", 2_500, "has a body of 2500 joints; 2000 are read"),
    ],
)
def test_a_chain_of_joints_is_too_deep(
    tmp_path: Path, make: Callable, name: str, count: int, sentence: str
):
    with pytest.raises(FileError) as error:
        importer.load(make(tmp_path / name, count))
    assert sentence in str(error.value)


def device(path: Path) -> None:
    path.symlink_to("/dev/zero")


def pipe(path: Path) -> None:
    os.mkfifo(path)


def listening(path: Path) -> None:
    where = Path.cwd()
    os.chdir(path.parent)  # the path of a socket has to be short
    try:
        with socket.socket(socket.AF_UNIX) as one:
            one.bind(path.name)
    finally:
        os.chdir(where)


def sparse(path: Path) -> None:
    """A file that begins as what it is called and has a terabyte."""
    begins = {".bvh": b"HIERARCHY\n", ".glb": b"glTF", ".gltf": b"{", ".fbx": b"Kaydara FBX Binary  \0"}
    path.write_bytes(begins.get(path.suffix, b""))
    os.truncate(path, 1 << 40)


NO_FILES = [
    (device, "is not an ordinary file but a device: save what it gives to a file"),
    (pipe, "is not an ordinary file but a pipe"),
    (listening, "is not an ordinary file but a socket"),
    (Path.mkdir, "is a folder"),
    (sparse, "has 1,100 GB; files of up to 4.3 GB are read: cut it into parts"),
]


@pytest.mark.parametrize("suffix", SUFFIXES)
@pytest.mark.parametrize(("make", "sentence"), NO_FILES, ids=lambda each: getattr(each, "__name__", ""))
def test_what_is_no_file_is_never_opened(tmp_path: Path, suffix: str, make: Callable, sentence: str):
    path = tmp_path / f"a{suffix}"
    make(path)
    assert told(path).startswith(sentence)
    with pytest.raises(FileError):
        files.takes(path)
    (entry,) = catalogue(tmp_path, [path]).values()  # among others it costs itself alone
    assert entry.problem.startswith(sentence)


@pytest.mark.parametrize("suffix", sorted({*SUFFIXES} - {".amc"}))
def test_a_file_that_is_not_there(tmp_path: Path, suffix: str):
    assert told(tmp_path / f"none{suffix}").startswith("cannot be read")


@pytest.mark.parametrize(("make", "sentence"), NO_FILES[:3], ids=lambda each: getattr(each, "__name__", ""))
def test_files_that_motion_depends_on_are_looked_at_too(tmp_path: Path, make: Callable, sentence: str):
    (tmp_path / "walk.amc").write_text("#!OML:ASF\n:FULLY-SPECIFIED\n:DEGREES\n1\nroot 0 0 0 0 0 0\n")
    np.savez(tmp_path / "walk.npz", poses=np.zeros((3, 66)), trans=np.zeros((3, 3)), mocap_framerate=30.0)
    for name, option in (("a.asf", "skeleton"), ("a.npz", "body_model")):
        make(tmp_path / name)
        motion = tmp_path / ("walk.amc" if option == "skeleton" else "walk.npz")
        with pytest.raises((FileError, NotSupported), match=sentence):
            importer.load(motion, Reading(**{option: tmp_path / name}))
