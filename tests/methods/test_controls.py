"""The rows that bound every table."""

from __future__ import annotations

import numpy as np
import pytest
from method_bodies import body, dance

from retarget_bench.api import Context
from retarget_bench.errors import NotSupported
from retarget_bench.methods.other_clip import plugin as OtherClip
from retarget_bench.methods.other_clip import to_and_fro
from retarget_bench.methods.reference import plugin as Reference
from retarget_bench.methods.rest_pose import plugin as RestPose


def test_rest_pose_stands_still_on_the_floor_facing_forward():
    source, target = dance(body()), body("small", scale=0.5, droop=45.0)
    result = RestPose().retarget(source, target, context=Context())
    assert np.ptp(result.positions, axis=0).max() == pytest.approx(0.0, abs=1e-12)
    joint = result.positions[0]
    assert joint[target.joints(["left_toe", "right_toe"]), 1] == pytest.approx(0.0, abs=1e-9)
    arm = joint[target.joint_of["left_hand"]] - joint[target.joint_of["left_arm"]]
    assert arm / np.linalg.norm(arm) == pytest.approx([1.0, 0.0, 0.0], abs=1e-6)
    assert result.root[0, [0, 2]] == pytest.approx(0.5 * source.root.mean(axis=0)[[0, 2]])


def test_rest_pose_needs_positions_only():
    source = dance(body())
    positions = source.character.positions(source.positions, source.fps)
    results = [RestPose().retarget(each, body(), context=Context()) for each in (source, positions)]
    np.testing.assert_allclose(results[0].positions, results[1].positions, atol=1e-12)


def test_reference_hands_back_the_right_answer():
    source, right = dance(body()), dance(body(), seed=1)
    assert Reference().retarget(source, right.character, context=Context(reference=right)) is right
    with pytest.raises(NotSupported, match="no reference"):
        Reference().retarget(source, right.character, context=Context())


@pytest.mark.parametrize(("length", "frames"), [(1, 4), (2, 5), (5, 3), (5, 17)])
def test_to_and_fro_walks_back_at_the_ends(length, frames):
    expected, at, step = [], 0, 1
    for _ in range(frames):
        expected.append(at)
        if length > 1:
            step = -step if not 0 <= at + step < length else step
            at += step
    assert to_and_fro(length, frames).tolist() == expected


def test_other_clip_does_not_look_at_the_source():
    target = body("target")
    others = [dance(target, frames=25, seed=seed) for seed in (7, 8, 9)]
    sources = [dance(body(), frames=60, seed=seed) for seed in (1, 2)]
    results = [
        OtherClip().retarget(each, target, context=Context(seed=11, other_clips=others)) for each in sources
    ]
    np.testing.assert_array_equal(results[0].positions, results[1].positions)
    np.testing.assert_array_equal(results[0].positions[:25], others[11 % 3].positions)
    assert results[0].frames == 60
    with pytest.raises(NotSupported, match="no other clip"):
        OtherClip().retarget(sources[0], target, context=Context(other_clips=[]))


def test_other_clip_takes_the_rate_of_the_source():
    target = body("target")
    clip = dance(target, frames=30)
    source = dance(body(), frames=50).resample(15.0)
    result = OtherClip().retarget(source, target, context=Context(other_clips=[clip]))
    assert result.fps == source.fps
    np.testing.assert_allclose(result.positions[:15], clip.positions[::2], atol=1e-12)


def test_controls_are_marked():
    for control in (RestPose, Reference, OtherClip):
        assert control().card.control
    assert Reference().card.needs == ("reference",)
    assert OtherClip().card.needs == ("other_clips",)
