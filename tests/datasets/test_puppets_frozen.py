"""The corpus that comes with the package is what the generator makes, and is read without it."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import get_args

import numpy as np
import pytest

from retarget_bench.api import SPLITS, CaseInfo
from retarget_bench.datasets import puppets
from retarget_bench.datasets.puppets import archives, frozen
from retarget_bench.datasets.puppets import plugin as Puppets
from retarget_bench.datasets.puppets.contract import Part
from retarget_bench.datasets.puppets.frozen import FOLDER, Frozen
from retarget_bench.datasets.puppets.generator.corpus import freezing
from retarget_bench.datasets.puppets.generator.corpus.generated import Generated
from retarget_bench.errors import FileError
from retarget_bench.motion import bvh
from retarget_bench.motion.motion import Motion

ROOT = Path(__file__).parents[2]
NEAR = 1e-6
"""Metres."""
READERS = {"archives", "cones", "contract", "dataset", "frozen"}
"""Modules of the puppets that are no part of the generator."""


def assert_same_motion(one: Motion | None, other: Motion | None, what: str) -> None:
    assert one is not None
    assert other is not None
    assert (one.character.name, one.fps) == (other.character.name, other.fps)
    assert np.abs(one.positions - other.positions).max() < NEAR, what
    assert np.abs(one.rotations - other.rotations).max() < NEAR, what


def turned(phase: np.ndarray) -> np.ndarray:
    """Differences of phases: the last digit decides whether a cycle's end is 1 or already 0."""
    return np.abs(phase - np.round(phase))


def assert_same_case(frozen: Frozen, generated: Generated, info: CaseInfo) -> None:
    case, expected = frozen.load(info), generated.load(info)
    assert_same_motion(case.source, expected.source, info.id)
    if expected.reference is None:
        assert (case.reference, case.alternative, case.contacts, case.touches) == (None,) * 4
        return
    assert_same_motion(case.reference, expected.reference, info.id)
    if info.source != info.target or case.alternative is not None:
        assert_same_motion(case.alternative, expected.alternative, info.id)
    assert case.contacts.roles == expected.contacts.roles
    assert np.array_equal(case.contacts.planted, expected.contacts.planted)
    assert np.array_equal(case.contacts.pivoting, expected.contacts.pivoting)
    assert (case.ground.heights is None) == (expected.ground.heights is None)
    if expected.ground.heights is not None:
        assert np.abs(case.ground.heights - expected.ground.heights).max() < NEAR
        assert case.ground.origin == pytest.approx(expected.ground.origin, abs=NEAR)
        assert case.ground.spacing == pytest.approx(expected.ground.spacing, abs=NEAR)
    for one, other in zip(case.touches, expected.touches, strict=True):
        assert (one.end, one.bearing) == (other.end, other.bearing)
        assert np.abs(np.array([one.point, one.place]) - [other.point, other.place]).max() < NEAR
        assert np.array_equal(one.rests, other.rests)
    one, other = frozen.labels(info), generated.labels(info)
    assert one.kind.tolist() == other.kind.tolist()
    assert turned(one.phase - other.phase).max() < NEAR
    assert list(one.touches) == list(other.touches)
    assert all(np.array_equal(one.touches[name], other.touches[name]) for name in one.touches)
    assert frozen.unseen(info) == generated.unseen(info)


def every(corpus: Frozen | Generated) -> Iterator[CaseInfo]:
    """All cases, and the real motion that those between legs are compared with."""
    for split in SPLITS:
        yield from corpus.cases(split)
    yield from corpus.between_legs()
    for structure in dict.fromkeys(body.structure for body in corpus.cast.values()):
        yield from corpus.real(structure)


@pytest.mark.parametrize("part", get_args(Part))
def test_the_lists_are_those_of_the_generator(part: Part) -> None:
    frozen, generated = Frozen(part), Generated("tiny", part)
    assert list(every(frozen)) == list(every(generated))
    assert list(frozen.clips.items()) == list(generated.clips.items())
    assert list(frozen.performers().items()) == list(generated.performers().items())
    assert frozen.exclusions() == generated.exclusions()
    assert (frozen.bodies, list(frozen.cast)) == (generated.bodies, list(generated.cast))
    assert frozen.training_manifest() == generated.training_manifest()
    for structure, cast in generated.training().items():
        for name, clips in cast.items():
            stored = frozen.training()[structure][name]
            assert (stored.names, stored.frames, stored.character) == (clips.names, clips.frames, name)


def test_some_of_all_is_what_the_generator_makes() -> None:
    """A case of each structure and of stairs, a case between legs, a training clip, and a skin."""
    frozen, generated = Frozen("test"), Generated("tiny", "test")
    of_structure = {frozen.cast[info.target].structure: info for info in frozen.cases("intra")}
    stairs = next(info for info in frozen.cases("cross") if info.kind == "stairs_down")
    touching = next(info for info in frozen.cases("cross") if info.kind == "hands_on_hips")
    for info in (*of_structure.values(), stairs, touching, frozen.between_legs()[0]):
        assert_same_case(frozen, generated, info)
    name = next(iter(frozen.training()["dog21"]))
    assert_same_motion(frozen.training()["dog21"][name][0], generated.training()["dog21"][name][0], name)
    assert_same_body(frozen, generated, "pip")


def assert_same_body(frozen: Frozen, generated: Generated, name: str) -> None:
    one, other = frozen.cast[name], generated.cast[name]
    assert one.skeleton.same_as(other.skeleton, NEAR)
    assert (one.structure, one.roles) == (other.structure, other.roles)
    assert one.measures.__dict__ == pytest.approx(other.measures.__dict__, abs=NEAR)
    assert np.abs(one.reference_pose - other.reference_pose).max() < NEAR
    for site, there in zip(one.skeleton.end_sites, other.skeleton.end_sites, strict=True):
        assert (site.parent, site.offset) == (there.parent, pytest.approx(there.offset, abs=NEAR))
    mesh, expected = one.mesh, other.mesh
    assert mesh is not None
    assert expected is not None
    assert np.array_equal(mesh.faces, expected.faces)
    assert np.abs(mesh.vertices - expected.vertices).max() < NEAR
    assert np.abs(mesh.weights - expected.weights).max() < NEAR


@pytest.mark.slow
@pytest.mark.parametrize("part", get_args(Part))
def test_all_is_what_the_generator_makes(part: Part) -> None:
    frozen, generated = Frozen(part), Generated("tiny", part)
    for info in every(frozen):
        assert_same_case(frozen, generated, info)
    if part == "test":
        for structure, cast in generated.training().items():
            for name, clips in cast.items():
                for number, motion in enumerate(clips):
                    assert_same_motion(frozen.training()[structure][name][number], motion, name)
        for name in frozen.cast:
            assert_same_body(frozen, generated, name)


@pytest.mark.slow
def test_the_files_are_written_as_they_are(tmp_path: Path) -> None:
    """The same lists, and arrays of the same names and shapes, to a micrometre."""
    freezing.write(tmp_path)
    assert archives.read(tmp_path, "index.json") == archives.read(FOLDER, "index.json")
    names = {path.name for path in FOLDER.iterdir()}
    assert {path.name for path in tmp_path.iterdir()} == names
    for name in (name for name in names if name.endswith(".npz")):
        one, other = (archives.Archive(archives.read(folder, name)) for folder in (tmp_path, FOLDER))
        assert list(one) == list(other)
        for key in one:
            assert (one[key].dtype, one[key].shape) == (other[key].dtype, other[key].shape)
            apart = one[key].astype(float) - other[key]
            apart = turned(apart) if key.endswith(" phases") else np.abs(apart)
            assert apart.max(initial=0.0) < NEAR, key


def test_equal_arrays_give_equal_bytes_and_come_back(tmp_path: Path) -> None:
    numbers = np.random.default_rng(1)
    arrays = {
        "a b": numbers.normal(size=(3, 5, 4)),
        "single": numbers.normal(size=7).astype(np.float32),
        "one": np.array(2.5),
        "told": numbers.normal(size=(2, 3)) > 0,
        "corners": np.arange(6, dtype=np.uint16),
    }
    for folder in ("first", "second"):
        archives.write(tmp_path / folder, {"x": arrays}, {"some": ["facts"]})
    for path in (tmp_path / "first").iterdir():
        assert path.read_bytes() == (tmp_path / "second" / path.name).read_bytes()
    back = archives.Archive(archives.read(tmp_path / "first", "x.npz"))
    assert list(back) == list(arrays)
    for name, array in arrays.items():
        assert back[name].dtype == array.dtype
        np.testing.assert_array_equal(back[name], array)
    with np.load(tmp_path / "first" / "x.npz") as plain:  # whoever has no more than NumPy
        first = np.moveaxis(plain["single"], 0, -1).copy().view("<f4")[..., 0]
        np.testing.assert_array_equal(first, arrays["single"])


def forget() -> None:
    """What this process has read of the files."""
    for each in (frozen._index, frozen._archive, frozen._cast, frozen._take):
        each.cache_clear()


@pytest.fixture
def copied(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A copy of the files, which is read in their place."""
    shutil.copytree(FOLDER, tmp_path / "tiny")
    monkeypatch.setattr(frozen, "FOLDER", tmp_path / "tiny")
    forget()
    yield tmp_path / "tiny"
    forget()


def everything() -> None:
    """Something of every file."""
    data = Puppets()
    for part in data.parts().values():
        part.load(part.cases("retarget", "self")[0])
    assert data.training()["body22"]["ada"][0].frames
    assert data.characters()["ada"].mesh


@pytest.mark.parametrize("name", sorted(path.name for path in FOLDER.iterdir()))
@pytest.mark.parametrize("harm", ["flip", "cut", "lose"])
def test_damaged_files_are_told_in_one_sentence(copied: Path, name: str, harm: str) -> None:
    path = copied / name
    content, half = path.read_bytes(), path.stat().st_size // 2
    if harm == "lose":
        path.unlink()
    else:
        flipped = bytes([content[half] ^ 1]) + content[half + 1 :]
        path.write_bytes(content[:half] + flipped * (harm == "flip"))
    with pytest.raises(FileError, match=r"install the package again$") as caught:
        everything()
    assert str(caught.value).startswith(str(copied))
    assert "\n" not in str(caught.value)


def test_a_checkout_may_change_line_ends(copied: Path) -> None:
    for path in copied.glob("*.json"):
        path.write_bytes(path.read_bytes().replace(b"\n", b"\r\n"))
    everything()


ALL_OF_IT = f"""
import sys
from {puppets.__name__} import plugin
data = plugin()
assert data.content and data.notes and data.training_manifest()
for part in data.parts().values():
    for split in ("self", "intra", "cross"):
        info = part.cases("retarget", split)[0]
        assert part.load(info).reference.frames == len(part.labels(info).kind)
assert data.training()["body22"]["ada"][0].frames
assert data.characters()["ada"].mesh
prefix = "{puppets.__name__}."
print(*(name.removeprefix(prefix) for name in sys.modules if name.startswith(prefix)))
"""


def test_the_embedded_data_needs_nothing_of_the_generator_and_keeps_nothing(tmp_path: Path) -> None:
    environment = os.environ | {"RETARGET_BENCH_CACHE": str(tmp_path / "cache")}
    command = [sys.executable, "-c", ALL_OF_IT]
    result = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True, check=True)
    assert set(result.stdout.split()) == READERS
    assert not (tmp_path / "cache").exists()


@pytest.mark.parametrize(
    "asked",
    [
        lambda: Puppets(size="default").content,
        lambda: Puppets(flesh="clothed").characters(),
        lambda: Puppets(version="1.1").content,
        lambda: (captured := Puppets(source="captured")).load(captured.cases("retarget", "self")[0]),
        lambda: Puppets().training_pairs(),
        lambda: Puppets().matched(),
    ],
)
def test_without_the_generator_a_sentence_says_what_is_missing(
    monkeypatch: pytest.MonkeyPatch, asked: Callable[[], object]
) -> None:
    monkeypatch.setitem(sys.modules, f"{puppets.__name__}.generator", None)
    for name in [name for name in sys.modules if name.startswith(f"{puppets.__name__}.generator.")]:
        monkeypatch.delitem(sys.modules, name)
    everything()
    with pytest.raises(
        FileError, match=r"generator: is missing, .*; use these, or install the package again$"
    ):
        asked()


@pytest.mark.slow
def test_the_main_job_gives_the_same_rows_without_the_generator(tmp_path: Path) -> None:
    """All default methods, all cases; the gate of an unpacked wheel does some in every run of the tests."""
    copy = tmp_path / "copy"
    for name in ("retarget_bench", "methods", "metrics", "datasets"):
        ignored = shutil.ignore_patterns("__pycache__", "generator")
        shutil.copytree(ROOT / name, copy / name, ignore=ignored)
    assert not (copy / "datasets" / "puppets" / "generator").exists()
    rows = [rows_of_the_main_job(tree, tmp_path / tree.name) for tree in (ROOT, copy)]
    assert len(rows[0]) > 90
    assert rows[0] == rows[1]


def rows_of_the_main_job(tree: Path, folder: Path) -> dict[str, bytes]:
    """Every table of ``bench run`` in a checkout but those of speeds."""
    command = [sys.executable, "-m", "retarget_bench", "run", "--out", str(folder / "runs")]
    environment = os.environ | {"PYTHONPATH": str(tree), "RETARGET_BENCH_CACHE": str(folder / "cache")}
    subprocess.run(command, cwd=tree, env=environment, capture_output=True, check=True)
    files = sorted((folder / "runs").rglob("*.csv"))
    return {
        str(path.relative_to(folder)): path.read_bytes()
        for path in files
        if not path.name.endswith(".timing.csv")
    }


@pytest.mark.slow
def test_retargeting_a_file_imports_none_of_the_puppets(tmp_path: Path) -> None:
    data = Puppets()
    case = data.load(data.cases("retarget", "cross")[0])
    for name, motion in (("source", case.source), ("target", case.reference)):
        assert isinstance(motion, Motion)
        bvh.write(tmp_path / f"{name}.bvh", motion.at(slice(0, 12)), scale=100.0)
    source, target = (f"{tmp_path / name}.bvh[unit=cm]" for name in ("source", "target"))
    words = ("retarget", source, "--target", target, "-o", str(tmp_path / "out.bvh"), "-m", "pan")
    command = [sys.executable, "-m", "retarget_bench", *words]
    environment = os.environ | {"PYTHONPROFILEIMPORTTIME": "1"}  # of all processes
    result = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True)
    assert result.returncode == 0, result.stderr[-2000:]
    assert "retarget_bench.motion" in result.stderr
    assert puppets.__name__ not in result.stderr
