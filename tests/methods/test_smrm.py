"""SMRM: what it sees, its answers and its losses against plain geometry and NumPy."""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import method_bodies
import numpy as np
import pytest
import smrm_material
import torch
import training_material
from hypothesis import given
from hypothesis import strategies as st
from method_bodies import apart, carried, dance

from retarget_bench.methods.smrm import SMRM, losses
from retarget_bench.methods.smrm.features import Features
from retarget_bench.methods.smrm.inference import retargeted
from retarget_bench.methods.smrm.network import Generator
from retarget_bench.motion import facing
from retarget_bench.motion.body22 import JOINTS
from retarget_bench.motion.structures import reduce
from retarget_bench.training.layers.masks import frame_mask

FORMS = [
    Features(*each)
    for each in product(("body", "none"), ("height", "displacement", "position"), ("removed", "kept"))
]


def danced(name: str = "one", frames: int = 25):
    return method_bodies.dance(smrm_material.BODIES[name], frames)


@pytest.mark.parametrize("features", FORMS, ids=str)
def test_what_is_seen_gives_the_motion_back(features):
    motion = danced()
    encoded, body = features.see(motion), features.body(motion.character)
    moves = features.moves(encoded["hips"], encoded["before"], encoded["turn"])
    for kind in ("integrated", "relative"):
        again = features.motion(body, encoded["rotations"], moves, encoded, motion.root, kind)
        np.testing.assert_allclose(again.positions, motion.positions, atol=1e-6)


@pytest.mark.parametrize("features", FORMS, ids=str)
def test_positions_are_those_of_the_22_joints_from_where_it_faces(features):
    motion = danced()
    encoded, joints = features.see(motion), list(reduce(motion.character, "body22").joints)
    unit = motion.character.measures.hip_height if features.normalisation == "body" else 1.0
    turn = facing.facing(motion.positions, motion.character) if features.yaw == "removed" else np.ones(25)
    expected = facing.seen(motion.positions[:, joints] - motion.positions[:, :1], turn[:, None]) / unit
    assert expected.shape == (25, JOINTS, 3)
    np.testing.assert_allclose(encoded["positions"], expected, atol=1e-9)


@pytest.mark.parametrize("root", ["height", "displacement", "position"])
def test_velocity_is_the_change_of_place(root):
    """Seen from one direction all along, the three ways to say where the hips are move alike."""
    features, random = Features("none", root, "kept"), np.random.default_rng(0)
    hips = random.normal(size=(20, 3))
    turn = np.tile([1.0, 0.0], (20, 1))
    before = np.concatenate([hips[:1], hips[:-1]])
    moves = torch.from_numpy(features.moves(hips, before, turn))
    np.testing.assert_allclose(features.velocity(moves).numpy(), np.diff(hips, axis=0), atol=1e-12)
    path = features.path(moves, torch.from_numpy(turn)).numpy()
    np.testing.assert_allclose(np.diff(path, axis=0), np.diff(hips, axis=0), atol=1e-12)


# -------------------------------------------------------------------------------------------------- answers
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


def test_training_goes_on_as_it_was(training_module):
    training_module.generator.train()
    carried(training_module.method(), dance(smrm_material.BODIES["one"], 10), BODIES["tall"])
    assert training_module.generator.training
    assert training_module.generator.encoder.training


# ------------------------------------------------------------------------------------------------- training
def run(module, rows=6, seed=0):
    """The terms of both phases in training mode, without updating anything."""
    torch.manual_seed(seed)
    batch, memory = training_material.batch(module, rows, seed), {}
    return {phase.name: module.losses(phase.name, batch, memory) for phase in module.phases}


def still(module):
    """Without dropout."""
    module.generator.eval()
    module.discriminator.dropout = 0.0
    return module


# ---------------------------------------------------------------------------------------------- sizes
def test_has_the_parameters_of_the_record():
    generator = Generator()
    assert sum(each.numel() for each in generator.parameters()) == 5_771_355
    counts = {name: sum(p.numel() for p in part.parameters()) for name, part in generator.named_children()}
    assert counts["encoder"] == 2_471_424
    assert counts["decoder"] == 3_253_248
    assert counts["turns"] + counts["moves"] == 46_683


# --------------------------------------------------------------------------------------------- losses
@given(st.integers(0, 1000))
def test_terms_against_numpy(seed):
    random = np.random.default_rng(seed)
    lengths = random.integers(1, 9, 4)
    real = frame_mask(torch.from_numpy(lengths), 8)
    a, b = random.normal(size=(2, 4, 8, 5, 4))
    a, b = (x / np.linalg.norm(x, axis=-1, keepdims=True) for x in (a, b))
    rows = [(a[k, :n], b[k, :n]) for k, n in enumerate(lengths)]
    total = sum(lengths)
    squares = sum(((x - y) ** 2).mean((1, 2)).sum() for x, y in rows) / total
    assert losses.squares(torch.from_numpy(a), torch.from_numpy(b), real).item() == pytest.approx(squares)
    # whichever sign of the wanted rotation is nearer
    nearer = [np.minimum(((x - y) ** 2).sum(-1), ((x + y) ** 2).sum(-1)) / 4 for x, y in rows]
    turned = sum(each.mean(1).sum() for each in nearer) / total
    assert losses.rotations(torch.from_numpy(a), torch.from_numpy(b), real).item() == pytest.approx(turned)
    path = random.normal(size=(4, 8, 3))
    bends = np.concatenate(
        [np.linalg.norm(np.diff(path[k, :n], 2, axis=0), axis=-1) for k, n in enumerate(lengths)]
    )
    expected = bends.mean() if len(bends) else 0.0
    assert losses.acceleration(torch.from_numpy(path), real).item() == pytest.approx(expected)


def test_terms_of_a_step_are_those_of_its_answers():
    """Carried there and back by hand, frame by frame in NumPy."""
    module = still(smrm_material.training_module(same=0.5, adversarial=0.0, rotation_cycle=1.0))
    batch = training_material.batch(module)
    assert [phase.name for phase in module.phases] == ["generator"]
    losses = {name: term.item() for name, term in module.losses("generator", batch, {}).items()}
    source, features = batch["source"], module.features
    with torch.no_grad():
        there = _carried(module, source["positions"], source["moves"], batch["target"])
        back = _carried(module, there.positions, there.moves, batch["body"])
    assert "adversarial" not in losses
    assert losses["joints"] == pytest.approx(_square(back.positions, source["positions"]), rel=1e-5)
    path = [features.path(moves, source["turn"]) for moves in (back.moves, source["moves"])]
    assert losses["hips"] == pytest.approx(_square(*path), rel=1e-5)
    same = batch["same"]
    assert 0 < same.sum() < len(same)
    assert losses["self_joints"] == pytest.approx(
        _square(there.positions[same], source["positions"][same]), rel=1e-5
    )
    dots = (back.rotations * source["rotations"]).sum(-1).abs()
    assert losses["rotations"] == pytest.approx(((2 - 2 * dots) / 4).mean().item(), rel=1e-4)


def test_the_variant_paper_is_eq_2_as_printed():
    """Cycle of joints and hips + adversarial + 0.01 rotations + 0.001 smooth, and nothing else."""
    module = still(smrm_material.training_module(variant="paper"))
    batch, memory = training_material.batch(module), {}
    losses = {name: term.item() for name, term in module.losses("generator", batch, memory).items()}
    assert not batch["same"].any()
    assert losses["self_joints"] == losses["self_hips"] == 0.0
    source, features = batch["source"], module.features
    with torch.no_grad():
        there = _carried(module, source["positions"], source["moves"], batch["target"])
        back = _carried(module, there.positions, there.moves, batch["body"])
        path = features.path(there.moves, source["turn"]).numpy()
    logits = memory["shown"][3].detach().numpy()
    assert losses["adversarial"] == pytest.approx(np.log1p(np.exp(-logits)).mean(), rel=1e-5)
    dots = (back.rotations * source["rotations"]).sum(-1).abs()
    assert losses["rotations"] == pytest.approx(0.01 * ((2 - 2 * dots) / 4).mean().item(), rel=1e-4)
    bends = np.linalg.norm(np.diff(path, 2, axis=1), axis=-1).mean()
    assert losses["smooth"] == pytest.approx(0.001 * bends, rel=1e-4)


def test_weights_that_are_given_override_those_of_the_variant():
    assert SMRM().facts() == SMRM(adversarial=0.0001, same=0.2).facts()
    assert SMRM(variant="paper").facts() == SMRM(adversarial=1.0, same=0.0).facts()
    mixed = SMRM(variant="paper", adversarial=0.5).facts()
    assert (mixed["adversarial"], mixed["same"]) == (0.5, 0.0)


def _carried(module, positions, moves, body):
    codes, _ = module.generator.encode(positions, moves)
    return module.generator.decode(codes, body["offsets"], body["resting"])[0]


def _square(a, b):
    return float(np.mean((a.numpy() - b.numpy()) ** 2))


def test_rotations_may_be_compared_with_those_of_the_own_body():
    module = still(smrm_material.training_module(reference_rotation="self", same=1.0, rotation_cycle=1.0))
    batch = training_material.batch(module)
    source = batch["source"]
    with torch.no_grad():
        itself = _carried(module, source["positions"], source["moves"], batch["body"])
        back = _carried(module, itself.positions, itself.moves, batch["body"])
    dots = (back.rotations * itself.rotations).sum(-1).abs()
    loss = module.losses("generator", batch, {})["rotations"]
    assert loss.item() == pytest.approx(((2 - 2 * dots) / 4).mean().item(), rel=1e-3)


# ------------------------------------------------------------------------------------- rows and masks
def test_padding_is_no_part_of_any_loss():
    """Clips shorter than a window: what stands behind them may be anything."""
    module = still(smrm_material.training_module(lengths=(12, 23), window=30))
    batch = training_material.batch(module)
    memory: dict = {}
    plain = module.losses("generator", batch, memory) | module.losses("discriminator", batch, memory)
    for part in ("source", "real"):
        behind = ~frame_mask(batch[part]["lengths"], 30)
        assert behind.any()
        for key in ("positions", "rotations", "moves", "turn"):
            batch[part][key][behind] = 7.0
    memory = {}
    changed = module.losses("generator", batch, memory) | module.losses("discriminator", batch, memory)
    for name, term in plain.items():
        assert changed[name].item() == pytest.approx(term.item(), rel=1e-5), name


def test_there_is_always_a_row_to_judge():
    module = smrm_material.training_module(same=0.99)
    for seed in range(5):
        terms = run(module, rows=2, seed=seed)
        assert all(term.isfinite() for phase in terms.values() for term in phase.values())


def test_kept_directions_are_turned_at_random_and_nothing_else():
    module = smrm_material.training_module(yaw="kept", same=1.0)
    one, other = (training_material.batch(module, seed=seed)["source"] for seed in (0, 1))
    assert not torch.allclose(one["positions"], other["positions"])
    path = module.features.path(one["moves"], one["turn"])
    assert torch.equal(one["turn"], torch.tensor([1.0, 0.0]).expand(6, 30, 2))
    offsets = module.draw(np.random.default_rng(0), 6)["body"]["offsets"]
    from retarget_bench.motion.kinematics_torch import forward

    places, _ = forward(
        module.generator.tree, torch.from_numpy(offsets), one["rotations"], torch.zeros_like(path)
    )
    torch.testing.assert_close(places, one["positions"], atol=1e-5, rtol=0)


# ------------------------------------------------------------------------------------------- learning
def test_statistics_are_of_the_clips():
    module = smrm_material.training_module()
    flat = module.training_data.stacked("positions").reshape(-1, 66)
    np.testing.assert_allclose(module.generator.scale.positions_mean, flat.mean(0), atol=1e-5)
    normalised = module.generator.scale.normalise("positions", torch.from_numpy(flat)).numpy()
    moving = flat.std(0) > 0.01
    np.testing.assert_allclose(normalised.std(0)[moving], 1.0, atol=1e-3)
    plain = smrm_material.training_module(normalisation="none").generator.scale
    assert torch.equal(plain.positions_deviation, torch.ones(66))
    assert not plain.positions_mean.any()


def test_windows_are_of_the_context_that_is_asked_for():
    for name, config in SMRM(context=10).presets.items():
        assert config.window == 10, name


def test_the_discriminator_sees_velocities_per_second():
    module = smrm_material.training_module(same=0.0)
    source = training_material.batch(module)["source"]
    shown = module._shown(source["positions"], source["moves"]).numpy()
    joints = np.diff(source["positions"].numpy().reshape(6, 30, 66), axis=1) * 30
    np.testing.assert_allclose(shown[..., :66], joints, atol=1e-4)
    rising = np.diff(source["moves"].numpy()[..., 1], axis=1) * 30
    np.testing.assert_allclose(shown[..., 67], rising, atol=1e-4)
    assert sum(each.numel() for each in module.discriminator.parameters()) == 280_285


@pytest.mark.parametrize("root", ["height", "displacement", "position"])
def test_noise_is_shown_and_not_asked_for(root):
    plain, noisy = (
        training_material.batch(smrm_material.training_module(root=root, noise=n)) for n in (0.0, 0.05)
    )
    for key in ("positions", "moves"):
        assert torch.equal(plain["source"][key], plain["shown"][key])
        torch.testing.assert_close(noisy["source"][key], plain["source"][key])
    off = noisy["shown"]["positions"] - noisy["source"]["positions"]
    assert not off[:, :, 0].any()  # relative to the hips, whose own noise is in all others
    assert off[:, :, 1:].std().item() == pytest.approx(0.05 * 2**0.5, rel=0.05)
    moved = (noisy["shown"]["moves"] - noisy["source"]["moves"])[:, 1:]
    deviation = {"height": 2**0.5, "displacement": 2**0.5, "position": 1.0}[root]
    assert moved[..., 0].std().item() == pytest.approx(0.05 * deviation, rel=0.2)
    path = SMRM(root=root).features.path(noisy["shown"]["moves"], noisy["source"]["turn"])
    clean = SMRM(root=root).features.path(noisy["source"]["moves"], noisy["source"]["turn"])
    assert (path - clean)[..., 0].std() < 0.2  # shifts do not add up


def test_the_answer_begins_near_the_t_pose():
    bias = Generator(16).turns.bias.detach().view(22, 4)
    assert torch.equal(bias, torch.tensor([1.0, 0.0, 0.0, 0.0]).expand(22, 4))


@pytest.mark.parametrize("same", [0.0, 1.0])
def test_who_is_carried_to_whom(same):
    module = smrm_material.training_module(same=same)
    batch = training_material.batch(module, rows=40)
    equal = (batch["body"]["offsets"] == batch["target"]["offsets"]).flatten(1).all(1)
    assert torch.equal(equal, batch["same"])
    assert bool(equal.all()) == bool(same)
