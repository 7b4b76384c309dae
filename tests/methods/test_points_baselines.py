"""Baselines where the source is points: nearest frame, and the copy that knows the motion under them."""

from __future__ import annotations

import method_bodies
import numpy as np
import pytest
from skinned_toys import scan, skinned_body

from retarget_bench.api import Context
from retarget_bench.errors import BenchError, NotSupported
from retarget_bench.methods.nearest_frame import _RADII, _TURNS, NearestFrame, _Album, _described, _middle
from retarget_bench.methods.skinned_copy import SkinnedCopy
from retarget_bench.motion import facing, scan_path, transfer
from retarget_bench.motion.character import Character
from retarget_bench.motion.motion import Motion

ONE, TALL = skinned_body("one"), skinned_body("tall", scale=1.5)


def turned(points: np.ndarray, angle: float) -> np.ndarray:
    return facing.placed(points, np.exp(1j * angle))


class Clips(list[Motion]):
    """Training clips of one body."""

    @property
    def names(self) -> list[str]:
        return [str(number) for number in range(len(self))]


def cast(body: Character, *seeds: int) -> dict[str, dict[str, Clips]]:
    clips = Clips([method_bodies.dance(body, 20, seed) for seed in seeds])
    return {body.structure: {body.name: clips}}


# -------------------------------------------------------------------------------------- nearest frame


def test_descriptions_are_distances_to_the_nearest_point() -> None:
    points = np.random.default_rng(1).normal(size=(50, 3))
    description = _described(points, 2.0)
    assert description.shape == (7 * len(_RADII), _TURNS)
    place = np.array([0.0, -1.0, 2.0 * _RADII[0]])  # the lowest inner ring, ahead
    assert description[0, 0] == pytest.approx(np.linalg.norm(points - place, axis=-1).min())


def test_descriptions_are_compared_as_if_every_turn_were_described() -> None:
    album = _Album.of(cast(ONE, 1), ONE, 20)
    noisy = album.vertices[4] + np.random.default_rng(2).normal(size=album.vertices[4].shape) * 0.02
    even = np.full(len(noisy), 1.0 / len(noisy))
    each = [
        ((_described(noisy - _middle(noisy, even), album.stature) - np.roll(one, k, axis=1)) ** 2).sum()
        for one in album.described
        for k in range(_TURNS)
    ]
    pose, step = divmod(int(np.argmin(each)), _TURNS)
    best = turned(album.vertices[pose], 2.0 * np.pi * step / _TURNS)
    np.testing.assert_allclose(album.nearest(noisy, 1), best, atol=1e-6)


def test_training_motion_of_that_body_is_found_again_from_its_points() -> None:
    material = cast(ONE, 1, 2)
    motion = method_bodies.dance(ONE, 20, 2)
    answer = NearestFrame(poses=40).retarget(
        scan(motion, 600),
        ONE,
        context=Context(training=material),  # type: ignore[arg-type]
    )
    assert ONE.mesh is not None
    expected = ONE.mesh.skinned(motion)
    apart = [each - scan_path.centre(each)[:, None] for each in (answer.vertices, expected)]
    near = np.linalg.norm(apart[0] - apart[1], axis=-1).mean()
    other = np.linalg.norm(apart[0] - apart[1][::-1], axis=-1).mean()
    assert near < 0.05 * ONE.height
    assert near < 0.5 * other


def test_without_training_motion_or_a_mesh_it_refuses() -> None:
    source = scan(method_bodies.dance(ONE, 3))
    with pytest.raises(NotSupported, match="no motion to train on"):
        NearestFrame().retarget(source, TALL, context=Context())
    assert "no mesh" in (NearestFrame().supports(source.character, method_bodies.body()) or "")
    for wrong in ({"poses": 0}, {"best": 0}):
        with pytest.raises(BenchError, match="one or more"):
            NearestFrame(**wrong)


# --------------------------------------------------------------------------------------- skinned copy
def test_the_copy_is_that_of_the_motion_under_the_points() -> None:
    motion = method_bodies.dance(ONE, 9)
    answer = SkinnedCopy().retarget(scan(motion), TALL, context=Context(source_motion=motion))
    expected = transfer.carry(motion, TALL, "hip_height")
    np.testing.assert_array_equal(answer.rotations, expected.rotations)
    np.testing.assert_array_equal(answer.root, expected.root)


def test_the_copy_needs_that_motion_and_a_mesh() -> None:
    assert SkinnedCopy().card.needs == ("source_motion",)
    with pytest.raises(NotSupported, match="needs the motion"):
        SkinnedCopy().retarget(scan(method_bodies.dance(ONE, 2)), TALL, context=Context())
    assert "no mesh" in (SkinnedCopy().supports(ONE, method_bodies.body()) or "")
    with pytest.raises(NotSupported, match="no root rule"):
        SkinnedCopy(root_rule="reference")  # type: ignore[arg-type]
