"""HuMoT while it is trained: its windows, losses and splits."""

from __future__ import annotations

import humot_material
import numpy as np
import pytest
import torch
import training_material

from retarget_bench.errors import BenchError
from retarget_bench.methods.humot import HuMoT
from retarget_bench.methods.humot.features import body
from retarget_bench.methods.humot.losses import bones, losses, reconstruction
from retarget_bench.methods.humot.training import held_out
from retarget_bench.plugins.registry import create
from retarget_bench.training.data import ClipArrays

BODIES, WINDOW = humot_material.BODIES, humot_material.WINDOW


# ---------------------------------------------------------------------------------------- what is drawn
def test_the_whole_skeleton_where_nothing_is_left_out():
    module = humot_material.training_module(lengths=(WINDOW,), subsampling=False, **humot_material.PLAIN)
    source, target = (training_material.batch(module, 4)[key] for key in ("source", "target"))
    for key in source:
        assert torch.equal(source[key], target[key])
    for row in range(4):
        count = int(source["joints"][row].sum())
        places = source["places"][row, :, :count].numpy()
        name = next(
            name
            for name in humot_material.THREE
            if len(body(BODIES[name]).joints) == count
            and np.allclose(body(BODIES[name]).template, source["template"][row, :count], atol=1e-6)
        )
        humot_body = body(BODIES[name])
        assert np.abs(places[:, humot_body.major].mean((0, 1))).max() < 1e-5
        assert source["parents"][row, :count].tolist() == list(humot_body.parents)
        (clip,) = training_material.training_data(HuMoT(), {name: BODIES[name]}, (WINDOW,)).clips[name]
        apart = places - clip.arrays["places"]
        assert np.abs(apart - apart[:1, :1]).max() < 1e-5  # but for one shift


def test_turned_and_mirrored_windows_keep_their_shape():
    """Distances between joints stay, heights stay; mirrored bodies have mirrored templates."""
    options = {"subsampling": False, "lengths": (WINDOW,)}
    plain = training_material.batch(humot_material.training_module(**humot_material.PLAIN, **options), 12)
    other = training_material.batch(
        humot_material.training_module(
            **(humot_material.PLAIN | {"turned": True, "mirrored": True}), **options
        ),
        12,
    )
    # the numbers that choose the rows are drawn first, so rows are the same
    joints = plain["source"]["joints"]
    assert torch.equal(joints, other["source"]["joints"])
    a, b = (each["source"]["places"] for each in (plain, other))
    torch.testing.assert_close(torch.cdist(a, a), torch.cdist(b, b), atol=1e-4, rtol=1e-4)
    torch.testing.assert_close(a[..., 2], b[..., 2], atol=1e-5, rtol=0.0)
    assert not torch.allclose(a[..., 0], b[..., 0], atol=0.01)
    one, two = (each["source"]["template"] for each in (plain, other))
    mirrored = [not torch.equal(one[row], two[row]) for row in range(12)]
    assert 0 < sum(mirrored) < 12
    for row in range(12):
        sign = torch.tensor([-1.0 if mirrored[row] else 1.0, 1.0, 1.0])
        torch.testing.assert_close(two[row], one[row] * sign)
        # a turn about the vertical axis that keeps the hand of space, after the mirror
        u, _, v = torch.linalg.svd((a[row].flatten(0, 1) * sign).T @ b[row].flatten(0, 1))
        assert torch.linalg.det(u @ v).item() == pytest.approx(1.0, abs=1e-4)


# --------------------------------------------------------------------------------------------------- losses
ROWS = ((9, 5), (6, 3), (9, 4))
"""Frames and joints of each row; what lies beyond is padding."""
PARENTS = ([-1, 0, 1, 1, 0], [-1, 0, -1], [-1, 0, 1, 2])


def rows(seed=0):
    numbers = np.random.default_rng(seed)
    most, longest = max(j for _, j in ROWS), max(f for f, _ in ROWS)
    answer, expected = numbers.normal(size=(2, len(ROWS), longest, most, 3))
    joints = np.array([[j < count for j in range(most)] for _, count in ROWS])
    frames = np.array([[f < count for f in range(longest)] for count, _ in ROWS])
    parents = np.array([[*line, *[-1] * (most - len(line))] for line in PARENTS])
    return tuple(map(torch.from_numpy, (answer, expected, joints, frames, parents)))


def test_eq_1_is_the_mean_squared_distance():
    answer, target, joints, frames, _ = rows()
    expected = []
    for row, (length, count) in enumerate(ROWS):
        total = 0.0
        for frame in range(length):
            for joint in range(count):
                total += float(((answer[row, frame, joint] - target[row, frame, joint]) ** 2).sum())
        expected.append(total / length / count)
    assert reconstruction(answer, target, joints, frames).item() == pytest.approx(np.mean(expected), 1e-12)


def test_eq_2_is_the_variance_of_relative_bone_lengths():
    answer, target, _, frames, parents = rows()
    expected = []
    for row, (length, _) in enumerate(ROWS):
        each = []
        for joint, parent in enumerate(PARENTS[row]):
            if parent >= 0:
                ratios = [
                    np.linalg.norm(answer[row, f, joint] - answer[row, f, parent])
                    / np.linalg.norm(target[row, f, joint] - target[row, f, parent])
                    for f in range(length)
                ]
                each.append(np.var(ratios))
        expected.append(np.mean(each))
    assert bones(answer, target, parents, frames).item() == pytest.approx(np.mean(expected), 1e-12)


def test_bones_that_scale_all_alike_cost_nothing_and_have_gradients():
    _, expected, joints, frames, parents = rows()
    answer = (1.3 * expected).requires_grad_()
    loss = bones(answer, expected, parents, frames)
    assert loss.item() < 1e-20
    reconstruction(answer, expected, joints, frames).backward()
    assert torch.isfinite(answer.grad).all()


def test_a_bone_of_no_length_is_left_out():
    answer, expected, _, frames, parents = rows()
    expected[0, :, 1] = expected[0, :, 0]
    answer = answer.clone().requires_grad_()
    loss = bones(answer, expected, parents, frames)
    loss.backward()
    assert torch.isfinite(answer.grad).all()
    without = parents.clone()
    without[0, 1] = -1
    assert loss.item() == pytest.approx(bones(answer, expected, without, frames).item(), rel=1e-12)


def test_the_weight_of_eq_2():
    answer, expected, joints, frames, parents = rows()
    target = {"places": expected, "joints": joints, "parents": parents}
    assert set(losses(answer, target, frames, 0.0)) == {"reconstruction"}
    assert losses(answer, target, frames, 0.5)["bones"].item() == pytest.approx(
        0.5 * bones(answer, expected, parents, frames).item()
    )


# --------------------------------------------------------------------------------------------------- splits
HOP = 6
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
