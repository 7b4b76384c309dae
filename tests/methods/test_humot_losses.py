"""Eq. 1 and 2 of HuMoT, against the formulas in plain loops."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from retarget_bench.methods.humot.losses import bones, losses, reconstruction

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


def test_padding_counts_for_nothing():
    answer, expected, joints, frames, parents = rows()
    real = (frames[:, :, None] & joints[:, None, :])[..., None]
    other = torch.where(real, answer, 1e6)
    target = {"places": expected, "joints": joints, "parents": parents}
    for name, value in losses(answer, target, frames, 0.5).items():
        assert losses(other, target, frames, 0.5)[name].item() == pytest.approx(value.item(), rel=1e-12)


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
