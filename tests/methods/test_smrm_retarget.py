"""SMRM as a method: any length, in chunks, in batches, at other rates; with weights and without."""

from __future__ import annotations

from dataclasses import replace

import method_bodies
import numpy as np
import pytest
import smrm_material
import torch

from retarget_bench.api import Context
from retarget_bench.methods.smrm import SMRM
from retarget_bench.methods.smrm.inference import retargeted
from retarget_bench.motion import root_rules
from retarget_bench.motion.motion import resampled_frames

BODIES = smrm_material.BODIES


@pytest.fixture(scope="module")
def training_module():
    made = smrm_material.training_module()
    with torch.no_grad():  # answers that differ from frame to frame, as trained ones do
        made.generator.turns.weight.mul_(10.0)
    return made


@pytest.fixture(scope="module")
def method(training_module):
    return training_module.method()


def carried(method, source, target):
    return method.retarget(source, target, context=Context())


def apart(one, other) -> float:
    """The largest distance between two motions, in heights."""
    return float(np.abs(one.positions - other.positions).max()) / one.character.height


@pytest.mark.parametrize("chunk", [1, 7, 64, 1000])
@pytest.mark.parametrize("path", ["integrated", "relative"])
@pytest.mark.parametrize("root", ["height", "displacement", "position"])
def test_chunks_of_any_size_give_what_the_whole_gives(chunk, root, path):
    module = smrm_material.training_module(root=root)
    source = smrm_material.dances("one", (90,))[0]
    whole, parts = (
        retargeted(module.generator.eval(), module.features, [source], [BODIES["legs"]], size, path)[0]
        for size in (90, chunk)
    )
    assert apart(whole, parts) < 1e-6


def test_what_comes_later_changes_nothing_before(method):
    """Online: a frame depends on no later one."""
    source = smrm_material.dances("one", (60,))[0]
    whole, begun = (carried(method, source.at(slice(frames)), BODIES["tall"]) for frames in (60, 20))
    assert apart(whole.at(slice(20)), begun) < 1e-6


def test_a_batch_gives_what_its_rows_give_alone(method):
    sources = [
        smrm_material.dances(name, (frames,))[0]
        for name, frames in (("one", 300), ("legs", 20), ("tall", 77))
    ]
    targets = [BODIES[name] for name in ("legs", "tall", "tall")]
    contexts = [Context() for _ in sources]
    beside = method.retarget_batch(sources, targets, contexts=contexts)
    backwards = method.retarget_batch(sources[::-1], targets[::-1], contexts=contexts)[::-1]
    for source, target, one, other in zip(sources, targets, beside, backwards, strict=True):
        alone = carried(method, source, target)
        assert one.frames == source.frames
        assert one.character is target
        assert apart(alone, one) < 1e-5
        assert apart(alone, other) < 1e-5


def test_threads_change_nothing(method):
    source, threads = smrm_material.dances("one", (50,))[0], torch.get_num_threads()
    found = []
    for count in (1, 2):
        torch.set_num_threads(count)
        found.append(carried(method, source, BODIES["tall"]))
    torch.set_num_threads(threads)
    assert apart(*found) < 1e-5


@pytest.mark.parametrize("fps", [30.0, 60.0, 25.0, 24.0, 120.0])
@pytest.mark.parametrize("frames", [1, 2, 31])
def test_rate_and_number_of_frames_are_the_source_s(method, fps, frames):
    source = smrm_material.dances("one", (frames,))[0]
    source = source.character.motion(source.rotations, source.root, fps)
    found = carried(method, source, BODIES["tall"])
    assert (found.frames, found.fps) == (frames, fps)
    assert np.isfinite(found.positions).all()
    # what is asked at 30 fps is answered at 30 fps, whatever the rate that it came from
    plain = carried(method, source.resample(30.0), BODIES["tall"])
    back = found.resample(30.0)
    shared = min(back.frames, plain.frames)
    assert shared >= resampled_frames(frames, fps, 30.0) - 1
    if fps in (30.0, 60.0, 120.0):
        assert apart(back.at(slice(shared)), plain.at(slice(shared))) < 1e-6


@pytest.mark.parametrize("fps", [25.0, 29.0, 50.0, 59.94, 90.0, 240.0, 1000.0])
def test_no_clip_stands_still_at_its_end(method, fps):
    source = smrm_material.dances("one", (170,))[0]
    found = carried(method, replace(source, fps=fps), BODIES["tall"]).positions
    assert (np.abs(np.diff(found[-40:], axis=0)).max(axis=(1, 2)) > 0).all()


@pytest.mark.parametrize("fps", [29.97, 30000 / 1001, 30.03])
def test_rounded_rates_are_thirty(method, fps):
    source = smrm_material.dances("one", (170,))[0]
    found, plain = (carried(method, replace(source, fps=rate), BODIES["tall"]) for rate in (fps, 30.0))
    assert found.fps == fps
    np.testing.assert_array_equal(found.positions, plain.positions)


@pytest.mark.parametrize("fps", [24.0, 30.0, 60.0])
@pytest.mark.parametrize("yaw", ["removed", "kept"])
def test_positions_alone_are_answered_like_the_motion_they_are_of(fps, yaw):
    method = smrm_material.training_module(yaw=yaw).method()
    motion = replace(smrm_material.dances("one", (50,))[0], fps=fps)
    places = motion.character.positions(motion.positions, fps)
    assert "positions" in method.card.accepts
    # at 24 fps, joints of the one move straight on in between, those of the other turn
    near = 0.005 if fps == 24.0 else 1e-5
    assert apart(*(carried(method, source, BODIES["tall"]) for source in (motion, places))) < near


def test_nothing_asked_is_nothing_answered(method):
    assert method.retarget_batch([], [], contexts=[]) == []


def test_begins_where_the_source_begins_for_a_body_of_that_size(method):
    source, target = smrm_material.dances("one", (20,))[0], BODIES["tall"]
    ratio = root_rules.ratio("hip_height", source.character, target)
    found = carried(method, source, target)
    np.testing.assert_allclose(found.root[0, [0, 2]], ratio * source.root[0, [0, 2]], atol=1e-9)


def test_where_one_stands_and_looks_changes_nothing(method):
    from test_smrm_features import turned_about

    source = smrm_material.dances("one", (30,))[0]
    there = turned_about(source, 130.0, np.zeros(3))
    one, other = carried(method, source, BODIES["tall"]), carried(method, there, BODIES["tall"])
    assert apart(turned_about(one, 130.0, np.zeros(3)), other) < 1e-5


def test_answers_depend_on_source_and_target(method):
    one, other = smrm_material.dances("one", (30, 30))
    assert apart(carried(method, one, BODIES["tall"]), carried(method, other, BODIES["tall"])) > 0.01
    pose = [carried(method, one, BODIES[name]).rotations for name in ("tall", "legs")]
    assert np.abs(pose[0] - pose[1]).max() > 1e-4


def test_training_goes_on_as_it_was(training_module):
    training_module.generator.train()
    carried(training_module.method(), smrm_material.dances("one", (10,))[0], BODIES["tall"])
    assert training_module.generator.training
    assert training_module.generator.encoder.training


def test_says_what_it_cannot_do(method):
    assert method.supports(BODIES["one"], BODIES["tall"]) is None
    handless = method_bodies.without(BODIES["one"], "LeftHand")
    assert "left_hand" in method.supports(BODIES["one"], handless)


def test_facts_make_the_method_again():
    method = SMRM(rotation_cycle=0.0, context=10, yaw="kept", hidden=32)
    again = SMRM(**method.facts())
    assert again.facts() == method.facts()
    assert set(method.facts()) | {"noise", "path", "variant", "weights"} == set(method.card.parameters)
