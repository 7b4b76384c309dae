"""Every term of PAN's objective against plain NumPy, by the paper's numbers of equations."""

from __future__ import annotations

import numpy as np
import pan_material
import pytest
import torch
import training_material
from hypothesis import given
from hypothesis import strategies as st
from method_bodies import dance

from retarget_bench.methods.pan import Pan, losses
from retarget_bench.methods.pan.settings import VARIANTS
from retarget_bench.motion import facing
from retarget_bench.training.layers.skeletal.end_effectors import ends_of
from retarget_bench.training.layers.skeletal.features import Features
from retarget_bench.training.layers.skeletal.kinematics import Kinematics, world
from retarget_bench.training.layers.skeletal.windows import statistics_of

SEEDS = st.integers(0, 1000)
BODIES = pan_material.BODIES


# ----------------------------------------------------------------------------------------- kinematics
@pytest.mark.parametrize("given_turn", [True, False])
@pytest.mark.parametrize("root", ["velocity", "height", "position"])
@pytest.mark.parametrize("name", ["one", "legs", "one_one_armed", "rex"])
def test_places_are_those_of_the_motion(name, root, given_turn):
    """Eq. 13's FK: in the world, level from where the hips begin, turned as the first frame faces."""
    body, features = Pan(parts="three").body(BODIES[name]), Features(root, "world", 0.0)
    motion = dance(pan_material.BODIES[name], 20)
    encoded = features.see(motion, body)
    edges = torch.from_numpy(encoded["edges"][None]).float()
    bones = torch.from_numpy(features.bones(body)[None])
    local = Kinematics(body)(edges, bones)
    turn = encoded["turn"][:, 0] + 1j * encoded["turn"][:, 1]
    level = torch.from_numpy((turn * turn[0].conj())[None]).to(torch.complex64) if given_turn else None
    actual = world(local, edges[:, :, -1], root, level)[0].numpy()

    positions = motion.positions[:, list(body.joints)] / 0.01
    hips = positions[0, 0].copy()
    if root == "position":
        expected = positions
    else:
        start = np.array([hips[0], hips[1] if root == "velocity" else 0.0, hips[2]])
        expected = facing.seen(positions - start, np.broadcast_to(turn[0], positions.shape[:2]))
    height = BODIES[name].height / 0.01
    assert np.abs(actual - expected).max() / height < 1e-5
    relative = motion.positions[:, list(body.joints)] - motion.positions[:, [body.joints[0]]]
    if root != "position":
        relative = facing.seen(relative, np.broadcast_to(turn[:, None], relative.shape[:2]))
    assert np.abs(local[0].numpy() - relative / 0.01).max() / height < 1e-5


def test_quaternions_need_not_be_unit():
    body, features = Pan().body(BODIES["one"]), Features("velocity", "world", 0.0)
    motion = dance(pan_material.BODIES["one"], 8)
    edges = torch.from_numpy(features.see(motion, body)["edges"][None]).float()
    bones, fk = torch.from_numpy(features.bones(body)[None]), Kinematics(body)
    stretched = edges * torch.linspace(0.5, 3.0, edges.shape[2])[None, None, :, None]
    torch.testing.assert_close(fk(edges, bones), fk(stretched, bones), atol=1e-3, rtol=0)
    vectors = fk.vectors(fk(edges, bones))
    torch.testing.assert_close(
        vectors.norm(dim=-1), bones[:, None, :-1].norm(dim=-1).expand(vectors.shape[:-1]), atol=1e-3, rtol=0
    )


# ----------------------------------------------------------------------------------------- one by one
def arrays(seed: int, *shape: int, count: int = 2):
    random = np.random.default_rng(seed)
    return [random.normal(size=shape) for _ in range(count)]


def tensors(*values):
    return [torch.from_numpy(each) for each in values]


@given(SEEDS)
def test_eq_15_is_the_z_score_of_all_training_motion(seed):
    values = np.random.default_rng(seed).normal(2.0, 3.0, (50, 4, 4))
    values[:, 0] = 1.5  # what never changes is left alone
    mean, deviation = statistics_of(values, 0.0)
    expected = values.std(axis=0)
    expected[0] = 1.0
    np.testing.assert_allclose(mean.numpy(), values.mean(axis=0), rtol=1e-5)
    np.testing.assert_allclose(deviation.numpy(), expected, rtol=1e-5)
    _, at_least = statistics_of(values, 3.0)
    np.testing.assert_allclose(at_least.numpy(), np.maximum(expected, 3.0), rtol=1e-5)


def test_eq_20_of_a_body_that_never_moves_is_finite():
    still = torch.zeros(2, 3, 3, requires_grad=True)
    losses.rescaled(still, torch.zeros(2)).sum().backward()
    assert still.grad.isfinite().all()


@given(SEEDS)
def test_end_effectors_move_alike_and_rest_together(seed):
    """The released code's term: ten heights per frame, and a hundredfold where the *answer* rests, as a
    mean over those that rest; ours as one over all."""
    source, answer = arrays(seed, 2, 6, 3, 3)
    source, answer = 0.001 * source, 0.0003 * answer
    a, b = 10 * np.diff(source, axis=1), 10 * np.diff(answer, axis=1)
    rests = (np.linalg.norm(b, axis=-1, keepdims=True) < 0.008).astype(float)
    assert 0 < rests.sum() < rests.size
    wrong, moved = np.mean((a - b) ** 2), tensors(source, answer)
    own = wrong + 100 * np.mean(((a - b) * rests) ** 2)
    released = wrong + 100 * np.mean(((a - b)[rests[..., 0] > 0]) ** 2)
    assert losses.end_effectors(*moved, resting=False).item() == pytest.approx(own)
    assert losses.end_effectors(*moved, resting=True).item() == pytest.approx(released)


def test_ends_of_bodies_that_lack_some():
    ends = {name: ends_of(Pan(parts="three").body(BODIES[name]).layout) for name in ("one", "rex")}
    roles = {
        name: {Pan(parts="three").body(BODIES[name]).layout.roles[joint] for joint in joints.values()}
        for name, joints in ends.items()
    }
    assert roles["one"] == {"head", "left_toe", "right_toe"}, "hands belong to none of three parts"
    assert roles["rex"] == {"head", "left_foot", "right_foot", "left_hand", "right_hand"}
    one_armed = Pan().body(BODIES["one_one_armed"]).layout
    assert 2 not in ends_of(one_armed)
    assert one_armed.roles[ends_of(one_armed)[1]] == "left_hand"


# ---------------------------------------------------------------------------------------- in one step
def everything(module, seed=0):
    """Terms of a step, and by hand what they are of: real motion, answers, codes, as NumPy arrays."""
    batch, memory = training_material.batch(module, 4, seed), {}
    return batch, module.losses("generator", batch, memory), memory


def by_hand(module, batch):
    """Sources, what they become on every side, and what comes back, through the networks one by one."""
    names = [module._names[side["structure"]] for side in batch["sides"]]
    parts = [module._structures[name] for name in names]
    real = [module._real(name, side) for name, side in zip(names, batch["sides"], strict=True)]
    codes = [part.encoder(each.edges) for part, each in zip(parts, real, strict=True)]
    shown, again, back = {}, {}, {}
    for there, side in enumerate(batch["sides"]):
        for here in (0, 1):
            at = [side["targets"][key].chunk(3)[here] for key in ("which", "bones", "unit", "turn")]
            shown[here, there] = _answered(module, names[there], codes[here], *at)
            again[here, there] = parts[there].encoder(shown[here, there].edges)
    for here, side in enumerate(batch["sides"]):
        at = [side[key] for key in ("which", "bones", "unit", "turn")]
        shown[here, here, "own"] = _answered(module, names[here], codes[here], *at)
        for there in (0, 1):
            back[here, there] = _answered(module, names[here], again[here, there], *at)
    return names, real, codes, shown, again, back


def _answered(module, name, code, which, bones, unit, turn):
    edges = module._structures[name].answer(code, bones)
    return module._real(
        name,
        {
            "edges": module._structures[name].plain(edges, which),
            "which": which,
            "bones": bones,
            "unit": unit,
            "turn": turn,
        },
    )


def square(a, b):
    return float(np.mean((a.detach().numpy().astype(np.float64) - b.detach().numpy()) ** 2))


def test_terms_of_the_paper_are_those_of_eq_10_to_14():
    module = pan_material.training_module(variant="paper")
    batch, terms, _ = everything(module)
    with torch.no_grad():
        names, real, codes, shown, again, back = by_hand(module, batch)
    pairs = [(here, there) for here in (0, 1) for there in (0, 1)]
    expected = {  # eq. 14's coefficients
        "slots": np.mean([square(shown[k, k, "own"].edges, real[k].edges) for k in (0, 1)]),
        "places": 100 * np.mean([square(shown[k, k, "own"].positions, real[k].positions) for k in (0, 1)]),
        "latent": 2.5 * np.mean([square(codes[pair[0]], again[pair]) for pair in pairs]),
        "again": 2.5 * np.mean([square(back[pair].edges, real[pair[0]].edges) for pair in pairs]),
        "again_places": 100
        * np.mean([square(back[pair].positions, real[pair[0]].positions) for pair in pairs]),
        "adversarial": np.mean(
            [
                square(
                    module._discriminators.discriminators[names[there]](
                        shown[1 - there, there].edges.flatten(2)
                    ),
                    torch.ones(1),
                )
                for there in (0, 1)
            ]
        ),
    }
    assert set(terms) == set(expected)
    for name, value in expected.items():
        assert terms[name].item() == pytest.approx(value, rel=2e-4), name


def test_judges_learn_from_what_they_are_shown():
    module = pan_material.training_module(variant="paper")
    batch, _, memory = everything(module)
    with torch.no_grad():
        names, real, _, shown, _, _ = by_hand(module, batch)
        expected = [
            0.5
            * (
                square(discriminator(real[k].edges.flatten(2)), torch.ones(1))
                + square(discriminator(shown[1 - k, k].edges.flatten(2)), torch.zeros(1))
            )
            for k, discriminator in ((k, module._discriminators.discriminators[names[k]]) for k in (0, 1))
        ]
    loss = module.losses("discriminator", batch, memory)["told_apart"].item()
    assert loss == pytest.approx(np.mean(expected), rel=1e-4)
    assert not any(each.requires_grad for _, *shown_tensors in memory["shown"] for each in shown_tensors)


def test_a_replay_buffer_keeps_fifty_answers():
    """As the released code."""
    module = pan_material.training_module(variant="released")
    assert {len(pool.kept) for pool in module._discriminators.pools.values()} == {50}


def test_paper_variants_have_the_weights_of_the_record():
    paper, legs = (VARIANTS[name].weights for name in ("paper", "paper_three"))
    for weights in (paper, legs):
        assert (weights.edges, weights.cycle, weights.again, weights.kinematic) == (1.0, 2.5, 2.5, 100.0)
        assert weights.adversarial == 1.0
    assert (paper.again_positions, paper.ends) == (100.0, 0.0)
    assert (legs.velocity, legs.turns) == (1000.0, False)


def test_the_released_code_between_legs_has_the_settings_of_the_record():
    code = VARIANTS["released_three"]
    assert (code.design.layers, code.design.heads, code.design.squashed) == (1, 1, False)
    assert (code.features.root, code.yaw) == ("velocity", "source")
    assert code.weights.discriminator_input == "positions"
