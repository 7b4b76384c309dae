"""Numbers that no motion has are said, with what to do; real motion is not doubted."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from editing_bodies import body, gait

from retarget_bench.motion import bvh, rotation
from retarget_bench.motion.importer import load
from retarget_bench.motion.plausibility import doubts


def walking(path: Path, *, angles: float = 1.0, places: float = 1.0) -> Path:
    """A walk as a BVH file in centimetres, with all angles and the root's places multiplied."""
    bvh.write(path, gait(body(), 60), scale=100.0)
    document = bvh.parse(path)
    values = np.array(document.values)
    values[:, 3:] *= angles
    values[:, :3] *= places
    bvh.write_document(path, replace(document, values=values))
    return path


def test_a_walk_is_not_doubted(tmp_path):
    assert load(walking(tmp_path / "walk.bvh")).findings.doubts == ()


def test_angles_in_radians(tmp_path):
    (doubt,) = load(walking(tmp_path / "walk.bvh", angles=np.pi / 180.0)).findings.doubts
    assert "are the angles radians? Then multiply them by 57.3" in doubt


def test_a_body_that_stands_or_does_not_bend_has_no_radians():
    """Breathing on the spot, and a statue that somebody moves."""
    walk = gait(body(), 60)
    slight = rotation.from_rotation_vector(rotation.to_rotation_vector(walk.rotations) / 57.3)
    standing = replace(walk, rotations=slight, root=np.repeat(walk.root[:1], 60, axis=0))
    statue = replace(walk, rotations=np.repeat(walk.rotations[:1], 60, axis=0))
    assert [*doubts(standing), *doubts(statue)] == []


@pytest.mark.parametrize(
    ("places", "words"),
    [(0.01, "100 times too short"), (0.0254, "39.37 times too short"), (10.0, "10 times too long")],
)
def test_path_and_bones_in_different_units(tmp_path, places, words):
    found = load(walking(tmp_path / "walk.bvh", places=places)).findings.doubts
    assert [each for each in found if words in each and "the places of the root by that" in each]


def test_a_treadmill_has_no_other_unit():
    """The body goes up and down as its legs say, and a little to and fro."""
    walk = gait(body(), 60)
    assert list(doubts(replace(walk, root=walk.root * [0.01, 1.0, 0.01]))) == []


def test_a_root_that_rests_but_for_rounding_has_no_other_unit():
    walk = gait(body(), 60)
    assert list(doubts(replace(walk, root=walk.root[:1] + 1e-6 * walk.root))) == []
