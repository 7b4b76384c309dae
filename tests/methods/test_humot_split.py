"""HuMoT's two splits: which windows are trained on, and which are kept aside for the paper's validation."""

from __future__ import annotations

import humot_material
import numpy as np
import pytest
import training_material

from retarget_bench.errors import BenchError
from retarget_bench.methods.humot import HuMoT
from retarget_bench.methods.humot.features import body
from retarget_bench.methods.humot.training import held_out
from retarget_bench.plugins.registry import create
from retarget_bench.training.data import ClipArrays

WINDOW, HOP = humot_material.WINDOW, 6
NAMES, LENGTHS = ("one", "legs"), (132, 9)
CAST = {name: humot_material.BODIES[name] for name in NAMES}
PLAIN = {"subsampling": False, **humot_material.PLAIN}


def clip(frames, name="walk", character="one"):
    return ClipArrays(character, name, {"places": np.zeros((frames, 1, 3), np.float32)})


def drawn(split, rows=400):
    """By character, the starts of all windows drawn from its long clip, and how often the short one was."""
    module = humot_material.training_module(NAMES, LENGTHS, split=split, **PLAIN)
    clips = training_material.training_data(HuMoT(), CAST, LENGTHS).clips
    drawn_batch = module.draw(np.random.default_rng(0), rows)
    starts, short = {name: [] for name in NAMES}, 0
    for places, joints, mask in zip(
        drawn_batch["source"]["places"], drawn_batch["source"]["joints"], drawn_batch["frames"], strict=True
    ):
        if not mask.all():
            short += 1
            continue
        name = next(name for name in NAMES if len(body(humot_material.BODIES[name]).joints) == joints.sum())
        starts[name].append(where(places[:, joints], clips[name][0]))
    return starts, short


def where(places, full_clip):
    """The start of a window in a clip, but for one shift."""
    apart = [
        np.ptp(places - full_clip.arrays["places"][start : start + WINDOW], axis=(0, 1)).max()
        for start in full_clip.starts(WINDOW, HOP)
    ]
    best = int(np.argmin(apart))
    assert sorted(apart)[1] > 1e-3 > 1e-5 > apart[best]
    return HOP * best


def test_windows_kept_aside_are_never_drawn_and_all_others_are():
    starts, short = drawn("chunk")
    assert short > 0  # the one window of the clip that is shorter than it
    for name in NAMES:
        full_clip = training_material.training_data(HuMoT(), CAST, LENGTHS).clips[name][0]
        every = full_clip.starts(WINDOW, HOP)
        aside = held_out(full_clip, every)
        assert (len(every), len(aside)) == (21, 2)
        assert set(starts[name]) == set(every) - aside
        beside = {start + step for start in aside for step in (-HOP, HOP)} & set(every) - aside
        assert beside  # windows that share half of their frames (four fifths with 30 of them) are drawn
        assert beside <= set(starts[name])


def test_all_windows_are_drawn_unless_told_and_as_ever():
    starts, _ = drawn("clip")
    assert all(set(clip_starts) == set(range(0, 121, HOP)) for clip_starts in starts.values())
    one, other = (humot_material.training_module(**options) for options in ({}, {"split": "clip"}))
    for seed in range(3):
        batches = [training_material.batch(each, seed=seed)["source"]["places"] for each in (one, other)]
        assert batches[0].equal(batches[1])


@pytest.mark.parametrize(("windows", "aside"), [(1, 0), (4, 0), (5, 1), (14, 1), (15, 2), (100, 10)])
def test_a_tenth_of_each_clip_rounded(windows, aside):
    full_clip = clip(30 + HOP * (windows - 1))
    every = full_clip.starts(30, HOP)
    held = held_out(full_clip, every)
    assert (len(every), len(held)) == (windows, aside)
    assert held <= set(every)


def test_the_choice_is_stable_and_each_clips_own():
    every = range(0, 6000, HOP)
    chosen = [held_out(clip(1, *names), every) for names in (("a", "x"), ("a", "y"), ("b", "x"))]
    assert chosen[0] == held_out(clip(99, "a", "x"), every[::-1])
    for k in range(3):  # two tenths of 1000 that are drawn apart share about ten
        assert len(chosen[k]) == 100
        assert len(chosen[k] & chosen[k - 1]) < 25
        # neither the beginning nor the end: the mean of 100 of 0 to 5994, six standard errors wide
        assert abs(np.mean(list(chosen[k])) - 2997) < 6 * 1732 / 10
    # weights trained with another choice would be measured on windows that they have seen
    assert sorted(held_out(clip(1, "a", "x"), range(0, 180, HOP))) == [12, 36, 162]


def test_weights_depend_on_it():
    assert HuMoT().facts()["split"] == "clip"
    assert create("methods", "humot[split=chunk]").facts()["split"] == "chunk"
    with pytest.raises(BenchError, match="split"):
        create("methods", "humot[split=frame]")
