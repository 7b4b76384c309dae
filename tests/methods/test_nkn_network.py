"""NKN's networks: the quick way through time is the plain one; bodies that lack joints (SMRM's too)."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest
import smrm_material
import torch
import training_material
from learned_methods import LEARNED
from method_bodies import SHORT, body, dance, without
from scipy.spatial.transform import Rotation
from torch import Tensor

from retarget_bench.api import Context
from retarget_bench.methods.nkn import plugin
from retarget_bench.methods.nkn import plugin as Nkn
from retarget_bench.methods.nkn.network import Decoder, Generator
from retarget_bench.methods.nkn.network.bodies import Bodies
from retarget_bench.methods.nkn.network.cells import KINDS, Kind, Layer
from retarget_bench.motion import kinematics
from retarget_bench.motion.body22 import PARENTS
from retarget_bench.motion.character import Character, Motion
from retarget_bench.motion.kinematics_torch import Tree
from retarget_bench.motion.skeleton import Skeleton
from retarget_bench.training.config import TrainingConfig
from retarget_bench.training.data import ClipArrays, TrainingData
from retarget_bench.training.layers.kinematic.pose import Scale, quaternions
from retarget_bench.training.layers.masks import time_first_mask
from retarget_bench.training.layers.twist import twist

NKN = plugin()


# ----------------------------------------------------------------------------------------------- cells


def plain_cell(layer: Layer, inputs: Tensor, state: Tensor, kind: Kind) -> Tensor:
    """One step by the equations, every product on its own."""
    size = layer.hidden
    r, z, n = (slice(k * size, (k + 1) * size) for k in range(3))
    own = [layer.weights[:, gate] for gate in (r, z, n)]
    from_inputs = [inputs @ layer.kernel[:, gate] + layer.bias[gate] for gate in (r, z, n)]
    if kind == "tf":
        reset, keep = (
            torch.sigmoid(from_inputs[0] + state @ own[0]),
            torch.sigmoid(from_inputs[1] + state @ own[1]),
        )
        fresh = torch.tanh(from_inputs[2] + (reset * state) @ own[2])
    else:
        held = [
            state @ weights + layer.state_bias[gate] for weights, gate in zip(own, (r, z, n), strict=True)
        ]
        reset, keep = torch.sigmoid(from_inputs[0] + held[0]), torch.sigmoid(from_inputs[1] + held[1])
        fresh = torch.tanh(from_inputs[2] + reset * held[2])
    return keep * state + (1.0 - keep) * fresh


@pytest.mark.parametrize("kind", KINDS)
def test_cells_follow_their_equations(kind):
    torch.manual_seed(1)
    layer = Layer(5, 7, kind).double()
    inputs = torch.randn(6, 3, 5).double()
    state, expected = torch.randn(3, 7).double(), []
    start = state
    for frame in inputs:
        state = plain_cell(layer, frame, state, kind)
        expected.append(state)
    states = layer(inputs, start)
    torch.testing.assert_close(states, torch.stack(expected))
    weight = torch.randn_like(states)
    own = torch.autograd.grad((states * weight).sum(), list(layer.parameters()))
    reference = torch.autograd.grad((torch.stack(expected) * weight).sum(), list(layer.parameters()))
    torch.testing.assert_close(own, reference)


# --------------------------------------------------------------------------------------------- decoder
def bodies(rows: int, scale: Scale | None = None) -> Bodies:
    numbers = np.random.default_rng(2)
    offsets = numbers.normal(size=(rows, len(PARENTS), 3)) * 20.0
    skeleton = Skeleton(tuple(f"{k}" for k in range(22)), np.array(PARENTS), offsets[0])
    scale = (scale or Scale(len(PARENTS))).double()
    scale.places_mean.uniform_(-3.0, 3.0)
    scale.places_deviation.uniform_(5.0, 20.0)
    scale.moves_mean.uniform_(-1.0, 1.0)
    scale.moves_deviation.uniform_(0.5, 2.0)
    return Bodies(Tree.of(skeleton), torch.from_numpy(offsets), scale)


def plain_decoder(decoder: Decoder, codes: Tensor, who: Bodies, kind: Kind) -> tuple[Tensor, Tensor]:
    """The decoder as a loop that autograd records."""
    rows = codes.shape[1]
    lower = upper = codes.new_zeros(rows, decoder.lower.hidden)
    pose, rise, poses, raws = codes.new_zeros(rows, decoder.channels), codes.new_zeros(rows, 1), [], []
    for number, code in enumerate(codes):
        lower = plain_cell(decoder.lower, torch.cat([who.bones, pose, code], 1), lower, kind)
        upper = plain_cell(decoder.upper, lower, upper, kind)
        raw = upper @ decoder.out + decoder.out_bias
        pose, rise = who.express(raw, rise, number == 0)
        poses.append(pose)
        raws.append(raw)
    return torch.stack(poses), torch.stack(raws)


@pytest.mark.parametrize("kind", KINDS)
def test_the_decoder_is_a_plain_loop_and_so_is_its_gradient(kind):
    torch.manual_seed(3)
    decoder, who = Decoder(22, 9, kind).double().eval(), bodies(3)
    decoder.out.data.normal_(0.0, 0.3)
    codes = torch.randn(5, 3, 9).double().requires_grad_()
    results, (weight, other) = [], (torch.randn(5, 3, 70).double(), torch.randn(5, 3, 92).double())
    for poses, raw in (decoder(codes, who)[:2], plain_decoder(decoder, codes, who, kind)):
        loss = (poses * weight).sum() + (raw * other).sum()
        results.append((poses, raw, *torch.autograd.grad(loss, [codes, *decoder.parameters()])))
    torch.testing.assert_close(results[0], results[1])


def test_dropouts_gradient_is_that_of_the_masks_it_drew():
    """Central differences, with the same masks each time."""
    decoder, who, codes = Decoder(22, 6, "tf").double(), bodies(2), torch.randn(4, 2, 6).double()
    decoder.out.data.normal_(0.0, 0.3)
    weight = torch.randn(4, 2, 70).double()

    def loss() -> Tensor:
        torch.manual_seed(5)
        return (decoder(codes, who)[0] * weight).sum()

    for each in decoder.parameters():
        (gradient,) = torch.autograd.grad(loss(), [each])
        way = torch.randn_like(each)
        step = 1e-6 * way
        with torch.no_grad():
            each += step
            above = loss()
            each -= 2 * step
            below = loss()
            each += step
        torch.testing.assert_close((gradient * way).sum(), (above - below) / 2e-6, rtol=1e-5, atol=1e-6)


def test_a_pose_is_the_engines_forward_kinematics():
    who, raw = bodies(4), torch.randn(4, 92).double()
    pose, rise = who.express(raw, torch.full((4, 1), 7.0).double(), False)
    plain = who.scale.plain(pose)
    turns = quaternions(raw[:, :88]).numpy()
    for row in range(4):
        skeleton = Skeleton(tuple(f"{k}" for k in range(22)), np.array(PARENTS), who.offsets[row].numpy())
        places, _ = kinematics.forward(skeleton, turns[row : row + 1], np.zeros((1, 3)))
        expected = places[0].reshape(-1)
        expected[1] = 7.0 + plain[row, 66 + 1]
        np.testing.assert_allclose(plain[row, :66], expected, atol=1e-10)
        np.testing.assert_allclose(rise[row, 0], expected[1], atol=1e-10)


def test_without_gradients_the_decoder_answers_the_same():
    torch.manual_seed(3)
    decoder, who, codes = Decoder(22, 9, "tf").double().eval(), bodies(3), torch.randn(5, 3, 9).double()
    recorded = decoder(codes, who)[0].detach()
    with torch.no_grad():
        poses = decoder(codes, who)[0]
    # Not to the last bit: kinematics normalises rotations once more where gradients are recorded.
    torch.testing.assert_close(poses, recorded, rtol=0, atol=1e-12)


def test_dropout_reaches_every_input_and_only_while_training():
    torch.manual_seed(4)
    generator, who, poses = Generator(22, 9, "tf").double(), bodies(2), torch.randn(4, 2, 70).double()

    def answer() -> Tensor:
        return generator.decoder(generator.encoder(poses)[1], who)[0]

    assert not torch.equal(answer(), answer())
    generator.eval()
    assert torch.equal(answer(), answer())


# ---------------------------------------------------------------------------------------------- losses
def test_twist_is_scipys_first_angle_of_yzx_beyond_a_hundred_degrees():
    turns = Rotation.random(4 * 3 * 22, random_state=0)
    w_first = torch.from_numpy(turns.as_quat()[:, [3, 0, 1, 2]].reshape(4, 3, 22, 4))
    real = time_first_mask(torch.tensor([4, 2, 1]), 4).double()
    angle = np.abs(turns.as_euler("YZX")[:, 0]).reshape(4, 3, 22)
    excess = np.maximum(angle - np.radians(100.0), 0.0) ** 2
    assert (excess > 0).mean() > 0.2
    assert twist(w_first, real).item() == pytest.approx((excess.mean(-1) * real.numpy()).sum())


def test_twist_has_a_finite_gradient_where_its_angle_is_lost():
    half = 2**-0.5
    locked = torch.tensor([[[[half, 0.0, 0.0, half], [1.0, 0.0, 0.0, 0.0]]]], requires_grad=True)
    twist(locked, torch.ones(1, 1)).backward()
    assert torch.isfinite(locked.grad).all()


# ---------------------------------------------------------------------------------- bodies that lack joints
TOES = ("LeftToeBase", "RightToeBase")
FULL, TOELESS = body(), without(body(), *TOES)
METHODS = ("nkn", "smrm")


@cache
def method(name: str) -> Any:
    return LEARNED[name].method()


def answer(name: str, source: Any, target: Character) -> Motion:
    return method(name).retarget(source, target, context=Context())


def with_toes_of_no_length() -> Character:
    """``TOELESS`` with toes again, where the feet are."""
    full = FULL.skeleton
    offsets = full.offsets.copy()
    offsets[[full.names.index(name) for name in TOES]] = 0.0
    tips = ()
    return Character.of("twin", Skeleton(full.names, full.parents, offsets, tips))


@pytest.mark.parametrize("name", METHODS)
def test_toes_of_no_length_change_nothing(name):
    """As source and as target: a body without toes is answered as one whose toes have no length."""
    twin, motion = with_toes_of_no_length(), dance(TOELESS)
    kept = [twin.skeleton.names.index(joint) for joint in TOELESS.skeleton.names]
    rotations = np.zeros((motion.frames, len(twin.skeleton), 4))
    rotations[..., 0] = 1.0
    rotations[:, kept] = motion.rotations
    twin_motion = twin.motion(rotations, motion.root, motion.fps)
    np.testing.assert_allclose(
        answer(name, twin_motion, FULL).positions, answer(name, motion, FULL).positions, atol=1e-6
    )
    toeless, other = (answer(name, dance(FULL), target).positions for target in (TOELESS, twin))
    np.testing.assert_allclose(other[:, kept], toeless, atol=1e-6)


@pytest.mark.parametrize("name", METHODS)
def test_both_train_on_bodies_that_lack_joints(name):
    method = Nkn(hidden=16, facing=3.0) if name == "nkn" else smrm_material.SMRM(hidden=16)
    cast = {"full": FULL, "short": SHORT}
    clips = {
        who: [ClipArrays(who, "dance", {k: np.float32(a) for k, a in method.prepare(dance(each)).items()})]
        for who, each in cast.items()
    }
    module = method.training_module(
        TrainingData(cast, clips), TrainingConfig(steps=1, batch=4, window=12, rate=1e-3)
    )
    memory: dict[str, Any] = {}
    for phase in module.phases:
        terms = module.losses(phase.name, training_material.batch(module), memory)
        assert all(bool(torch.isfinite(term)) for term in terms.values())


def test_smrm_places_what_it_answers_where_the_body_has_it():
    module = smrm_material.training_module()
    shape = module.features.body(SHORT)
    lacks = torch.from_numpy(shape.aligned.lacks[None])
    body_of = [torch.from_numpy(each[None]) for each in (shape.offsets, shape.resting)]
    codes = torch.randn(1, 5, 16, generator=torch.Generator().manual_seed(0))
    poses, _ = module.generator.decode(codes, *body_of, lacks=lacks)
    rotations = poses.rotations.detach().double().numpy()
    places = shape.aligned.motion(rotations[0], np.zeros((5, 3)), 30.0).positions
    places = (places - places[:, [shape.aligned.joints[0]]])[:, list(shape.aligned.joints)]
    np.testing.assert_allclose(poses.positions[0].detach() * shape.unit, places, atol=1e-5)
