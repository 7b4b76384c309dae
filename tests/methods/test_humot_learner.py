"""HuMoT while it is trained: batches, gradients, that it learns, its weights."""

from __future__ import annotations

import humot_material
import numpy as np
import pytest
import torch
import training_material

from retarget_bench.methods.humot import HuMoT
from retarget_bench.methods.humot.features import body

BODIES, WINDOW = humot_material.BODIES, humot_material.WINDOW


def losses(module, batch):
    with torch.no_grad():
        return module.losses("autoencoder", batch, {})


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


def test_two_draws_of_joints_are_independent_and_fit_their_templates():
    module = humot_material.training_module(**humot_material.PLAIN)
    rows = training_material.batch(module, 40)
    differ = 0
    for side in ("source", "target"):
        part = rows[side]
        assert (part["places"][~part["joints"].unsqueeze(1).expand(-1, WINDOW, -1)] == 0.0).all()
        assert (part["places"][~rows["frames"]] == 0.0).all()
        assert (part["parents"][~part["joints"]] == -1).all()
        assert part["joints"].sum(1).min() >= 2
    for row in range(40):
        counts = [int(rows[side]["joints"][row].sum()) for side in ("source", "target")]
        templates = [
            rows[side]["template"][row, :count]
            for side, count in zip(("source", "target"), counts, strict=True)
        ]
        differ += counts[0] != counts[1] or not torch.equal(*templates)
    assert differ > 35


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


# ------------------------------------------------------------------------------------------ that it learns
def test_without_consistency_there_is_one_term():
    module = humot_material.training_module(consistency=0.0)
    assert set(losses(module, training_material.batch(module))) == {"reconstruction"}


# ---------------------------------------------------------------------------------------------- weights
