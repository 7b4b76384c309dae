"""Left-handed files are said to be, and read as right-handed ones where they are to be mirrored."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import animal_rigs
import numpy as np
import pytest
from editing_bodies import body, fingers, gait

from retarget_bench.errors import BenchError
from retarget_bench.motion import bvh
from retarget_bench.motion.bvh import Document
from retarget_bench.motion.files import read, writing
from retarget_bench.motion.files.reading import Reading
from retarget_bench.motion.importer import load
from retarget_bench.motion.skeleton import EndSite


def left_handed(document: Document) -> Document:
    """The document with X to the other side: places along it, and angles about the two other axes."""
    hierarchy = document.hierarchy
    channels = [name for joint in hierarchy.channels for name in joint]
    signs = [-1.0 if name in ("Xposition", "Yrotation", "Zrotation") else 1.0 for name in channels]
    sites = tuple(EndSite(s.parent, (-s.offset[0], *s.offset[1:])) for s in hierarchy.end_sites)
    mirrored = replace(hierarchy, offsets=hierarchy.offsets * [-1.0, 1.0, 1.0], end_sites=sites)
    return replace(document, hierarchy=mirrored, values=document.values * signs)


@pytest.fixture
def pair(tmp_path: Path) -> tuple[Path, Path]:
    """A walk with fingers that is right-handed, and the same left-handed."""
    right, left = tmp_path / "right.bvh", tmp_path / "left.bvh"
    bvh.write(right, gait(body(fingers()), 60), scale=100.0)
    bvh.write_document(left, left_handed(bvh.parse(right)))
    return right, left


def test_it_is_said_and_mirrored(pair):
    right, left = map(load, pair)
    assert right.findings.doubts == ()
    (doubt,) = left.findings.doubts
    assert "left and right arms and legs are exchanged" in doubt
    assert "is the file left-handed? Then say mirror=true" in doubt
    mirrored = load(pair[1], Reading(mirror=True))
    assert mirrored.findings.doubts == ()
    assert ",mirror=true]'" in mirrored.findings.text()
    np.testing.assert_allclose(mirrored.motion.positions, right.motion.positions, atol=1e-7)
    np.testing.assert_allclose(mirrored.motion.skeleton.offsets, right.motion.skeleton.offsets, atol=1e-9)
    (doubt,) = load(pair[0], Reading(mirror=True)).findings.doubts
    assert "is the file right-handed? Then leave out mirror=true" in doubt


def test_only_true_mirrors():
    assert Reading.of({"mirror": True}).mirror
    assert not Reading.of({"mirror": False}).mirror
    for value in ("maybe", "no", 1, None):
        with pytest.raises(BenchError, match=r"mirror is .*; it takes True or False"):
            Reading.of({"mirror": value})


def test_a_left_handed_target_keeps_its_dress(pair, tmp_path):
    """What is written into a left-handed file is left-handed as that file is."""
    target = load(pair[1], Reading(mirror=True))
    writing.write(tmp_path / "out.bvh", target.motion, target)
    written, stated = read(tmp_path / "out.bvh"), read(pair[1])
    np.testing.assert_allclose(written.root, stated.root, atol=1e-5)
    np.testing.assert_allclose(np.abs((written.rotations * stated.rotations).sum(axis=-1)), 1.0, atol=1e-9)


@pytest.mark.parametrize(
    ("animal", "hocks"),
    [(animal_rigs.horse, 0.0), (animal_rigs.horse, 0.3), (animal_rigs.bird, 0.0), (animal_rigs.bird, 0.06)],
)
def test_animals_tell_it_by_their_trunk(tmp_path, animal, hocks):
    """Whatever way the bend of a leg is that a rig has: calves forward, or backward as those that end at a
    hock."""
    bones = {
        name: (above, (x, y, z - hocks * ("Calf" in name))) for name, (above, (x, y, z)) in animal().items()
    }
    right = animal_rigs.written(tmp_path / "right.bvh", bones, scale=100.0, facing=30.0)
    bvh.write_document(tmp_path / "left.bvh", left_handed(bvh.parse(right)))
    assert not [each for each in load(right).findings.doubts if "exchanged" in each]
    (doubt,) = (each for each in load(tmp_path / "left.bvh").findings.doubts if "exchanged" in each)
    assert "is the file left-handed?" in doubt


def test_a_mesh_is_mirrored_with_its_body(real_data):
    path = real_data / "gltf/Xbot.glb"
    if not path.exists():
        pytest.skip("no mesh")
    right, mirrored = load(path), load(path, Reading(mirror=True))
    (doubt,) = mirrored.findings.doubts
    assert "right-handed" in doubt
    ones, others = right.motion.character.skin(), mirrored.motion.character.skin()
    np.testing.assert_allclose(others.vertices, ones.vertices * [-1.0, 1.0, 1.0], atol=1e-9)
    first = (right.motion.at(slice(0, 1)), mirrored.motion.at(slice(0, 1)))
    posed = [mesh.skinned(each) for mesh, each in zip((ones, others), first, strict=True)]
    np.testing.assert_allclose(posed[1], posed[0] * [-1.0, 1.0, 1.0], atol=1e-6)
