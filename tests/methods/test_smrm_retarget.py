"""SMRM as a method: any length, in chunks, in batches, at other rates; with weights and without."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import smrm_material
import torch
from method_bodies import apart, carried, dance

from retarget_bench.methods.smrm.inference import retargeted
from retarget_bench.motion import root_rules

BODIES = smrm_material.BODIES


@pytest.fixture(scope="module")
def training_module():
    module = smrm_material.training_module()
    with torch.no_grad():  # answers that differ from frame to frame, as trained ones do
        module.generator.turns.weight.mul_(10.0)
    return module


@pytest.fixture(scope="module")
def method(training_module):
    return training_module.method()


@pytest.mark.parametrize("chunk", [1, 7, 64, 1000])
@pytest.mark.parametrize("path", ["integrated", "relative"])
@pytest.mark.parametrize("root", ["height", "displacement", "position"])
def test_chunks_of_any_size_give_what_the_whole_gives(chunk, root, path):
    module = smrm_material.training_module(root=root)
    source = dance(smrm_material.BODIES["one"], 90)
    at_once, parts = (
        retargeted(module.generator.eval(), module.features, [source], [BODIES["legs"]], size, path)[0]
        for size in (90, chunk)
    )
    assert apart(at_once, parts) < 1e-6


def test_what_comes_later_changes_nothing_before(method):
    """Online: a frame depends on no later one."""
    source = dance(smrm_material.BODIES["one"], 60)
    complete, begun = (carried(method, source.at(slice(frames)), BODIES["tall"]) for frames in (60, 20))
    assert apart(complete.at(slice(20)), begun) < 1e-6


@pytest.mark.parametrize("fps", [25.0, 29.0, 50.0, 59.94, 90.0, 240.0, 1000.0])
def test_no_clip_stands_still_at_its_end(method, fps):
    source = dance(smrm_material.BODIES["one"], 170)
    positions = carried(method, replace(source, fps=fps), BODIES["tall"]).positions
    assert (np.abs(np.diff(positions[-40:], axis=0)).max(axis=(1, 2)) > 0).all()


@pytest.mark.parametrize("fps", [29.97, 30000 / 1001, 30.03])
def test_rounded_rates_are_thirty(method, fps):
    source = dance(smrm_material.BODIES["one"], 170)
    actual, plain = (carried(method, replace(source, fps=rate), BODIES["tall"]) for rate in (fps, 30.0))
    assert actual.fps == fps
    np.testing.assert_array_equal(actual.positions, plain.positions)


def test_begins_where_the_source_begins_for_a_body_of_that_size(method):
    source, target = dance(smrm_material.BODIES["one"], 20), BODIES["tall"]
    level = root_rules.ratios("hip_height", source.character, target)
    answer = carried(method, source, target)
    np.testing.assert_allclose(answer.root[0, [0, 2]], level[0] * source.root[0, [0, 2]], atol=1e-9)


def test_where_one_stands_and_looks_changes_nothing(method):
    from test_smrm_features import turned_about

    source = dance(smrm_material.BODIES["one"], 30)
    there = turned_about(source, 130.0, np.zeros(3))
    one, other = carried(method, source, BODIES["tall"]), carried(method, there, BODIES["tall"])
    assert apart(turned_about(one, 130.0, np.zeros(3)), other) < 1e-5


def test_training_goes_on_as_it_was(training_module):
    training_module.generator.train()
    carried(training_module.method(), dance(smrm_material.BODIES["one"], 10), BODIES["tall"])
    assert training_module.generator.training
    assert training_module.generator.encoder.training
