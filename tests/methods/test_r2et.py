"""R2ET: what it sees, its networks and losses, training, and answers."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import r2et_material
import torch
import training_material
from learned_methods import LEARNED
from method_bodies import apart, body, carried, dance
from r2et_material import BODIES, SHORT
from scipy.spatial.transform import Rotation

from retarget_bench.methods.r2et import R2ET, features, losses
from retarget_bench.methods.r2et.discriminator import TrajectoryDiscriminator
from retarget_bench.methods.r2et.inference import retargeted
from retarget_bench.methods.r2et.network import JointEncoder, SkeletonAwareNetwork
from retarget_bench.motion import kinematics, rotation
from retarget_bench.motion.body22 import Body22
from retarget_bench.motion.structures import BODY22


@pytest.fixture(scope="module")
def module():
    return r2et_material.training_module()


@pytest.fixture(scope="module")
def method():
    return LEARNED["r2et"].method()


# ------------------------------------------------------------------------------------------- features
def test_offsets_are_bones_in_centimetres_below_the_height_of_the_hips():
    offsets = features.offsets(body(thigh=0.45, shin=0.42))
    np.testing.assert_allclose(offsets[0], [0, 97, 0], atol=1e-4)
    np.testing.assert_allclose(offsets[BODY22.index("left_leg")], [0, -45, 0], atol=1e-4)
    missing = Body22(SHORT).lacks
    assert missing.sum() == 6
    assert not features.offsets(SHORT)[missing].any()


def test_the_direction_is_scipys_average():
    from scipy.ndimage import gaussian_filter1d

    motion = dance(BODIES["one"], 90)
    places = motion.positions[:, [motion.character.joint_of[role] for role in BODY22]]
    at = BODY22.index
    across = places[:, at("left_up_leg")] - places[:, at("right_up_leg")]
    across = across + places[:, at("left_shoulder")] - places[:, at("right_shoulder")]
    across /= np.linalg.norm(across, axis=-1, keepdims=True)
    forward = gaussian_filter1d(np.cross(across, [0, 1, 0]), 6.0, axis=0, mode="nearest")
    direction = features.direction(motion, 6.0)
    np.testing.assert_allclose(np.tan(np.angle(direction)), forward[:, 0] / forward[:, 2], atol=1e-9)


def test_seen_positions_are_where_seen_rotations_lead():
    motion = dance(BODIES["tall"])
    prepared = R2ET().prepare(motion)
    facing = features.direction(motion, 20.0)[:, None]
    hips = motion.positions[:, motion.character.joint_of["hips"]]
    places = motion.positions[:, list(Body22(motion.character).joints)] - hips[:, None]
    level = (places[..., 2] + 1j * places[..., 0]) * facing.conj()
    expected = np.stack([level.imag, places[..., 1] + motion.character.measures.hip_height, level.real], -1)
    np.testing.assert_allclose(prepared["positions"], 100 * expected, atol=2e-4)
    assert prepared["rotations"][..., 0].min() >= 0


def test_sizes_of_a_body():
    character = body(thigh=0.45, shin=0.42, hip=0.1, spines=3)
    trunk = 0.5 + 0.12 + np.hypot(0.1, 0.02)
    assert features.size(character, "hip_height") == pytest.approx(0.97)
    assert features.size(character, "chain") == pytest.approx(trunk + 0.45 + 0.42 + np.hypot(0.1, 0.15))
    rows = 0.01 * features.offsets(character)
    pairs = [(1, 0), (2, 1), (3, 2), (4, 3), (5, 4), (7, 6), (8, 7), (9, 8)]
    expected = sum(np.linalg.norm(rows[a] - rows[b]) for a, b in pairs)
    assert features.size(character, "published") == pytest.approx(expected)


@pytest.mark.parametrize("kind", ["hip_height", "chain", "published"])
def test_the_path_begins_on_the_floor_and_is_scaled(kind):
    source, target = BODIES["one"], BODIES["legs"]
    hips = np.array([[0.2, 0.9, -0.4], [0.3, 1.0, 0.1]])
    moved = features.path(hips, source, target, kind)
    assert moved[0, 1] == pytest.approx(0.9 * target.measures.hip_height / source.measures.hip_height)
    ratio = features.size(target, kind) / features.size(source, kind)
    np.testing.assert_allclose(np.diff(moved, axis=0), ratio * np.diff(hips, axis=0))


# ------------------------------------------------------------------------------------------- networks


def test_an_encoder_is_attention_as_written_down():
    torch.manual_seed(1)
    encoder = JointEncoder(4, 96, 2, 0.0)
    joints = torch.randn(3, 22, 4)
    tokens = encoder.enter(joints)
    queries, keys, values = (each.view(3, 22, 2, 32) for each in encoder.qkv(tokens).split(64, -1))
    scores = torch.einsum("bihd,bjhd->bhij", queries, keys) / 8.0
    attended = torch.einsum("bhij,bjhd->bihd", scores.softmax(-1), values).reshape(3, 22, 64)
    code = encoder.out(attended)
    fed = encoder.feed[1](encoder.feed[0](encoder.norm(code)).relu())
    torch.testing.assert_close(encoder(joints), code + fed, atol=1e-5, rtol=1e-5)


def test_changes_are_as_written_down():
    """Codes of motion and bodies, times the square root of their width, plus the order of the joints."""
    torch.manual_seed(2)
    network, rotations = SkeletonAwareNetwork(), torch.randn(5, 22, 4)
    codes = torch.randn(2, 22, 128)
    network.scale.rotations_mean.normal_()
    network.scale.rotations_deviation.uniform_(0.5, 2.0)
    mean, deviation = (network.scale.get_buffer(f"rotations_{name}") for name in ("mean", "deviation"))
    motion = network.motion((rotations - mean.view(22, 4)) / deviation.view(22, 4))
    joined = torch.cat([motion, *(each.expand(5, -1, -1) for each in codes)], -1)
    number, channel = np.arange(22)[:, None], np.arange(512)
    angle = number / 10_000.0 ** (2 * (channel // 2) / 512)
    order = torch.from_numpy(np.where(channel % 2, np.cos(angle), np.sin(angle))).float()
    raw = network.change(network.join(joined * 512**0.5 + order).relu())
    restored = raw * deviation.view(22, 4) + mean.view(22, 4)
    expected = restored / restored.norm(dim=-1, keepdim=True)
    torch.testing.assert_close(network(rotations, *codes), expected, atol=1e-5, rtol=1e-5)
    assert (network.change(network.join(joined * 512**0.5).relu()) - raw).abs().max() > 1e-2


def test_joints_in_one_place_have_gradients():
    places = torch.randn(1, 1, 22, 3)
    places[0, 0, 9] = places[0, 0, 8]
    places.requires_grad_()
    losses.semantics(places, torch.randn(1, 1, 22, 3), torch.ones(1, 1, dtype=torch.bool)).backward()
    assert torch.isfinite(places.grad).all()


def test_every_term_is_its_formula(module):
    """In NumPy, from the answers; twists of all joints but the hips."""
    module.modules.eval()
    batch, memory = training_material.batch(module, 8), {}
    turned = rotation.normalise(np.random.default_rng(3).normal(size=batch["rotations"].shape))
    batch["rotations"] = torch.from_numpy(turned).float()
    terms = {name: float(term.detach()) for name, term in module.losses("network", batch, memory).items()}
    with torch.no_grad():
        answered, places = (each.double().numpy() for each in module._answered(batch))
    module.modules.train()
    real = np.arange(30) < batch["lengths"].numpy()[:, None]
    own = real & batch["same"].numpy()[:, None]
    deviation = module.network.scale.get_buffer("positions_deviation").numpy()
    truth = batch["positions"].double().numpy()
    apart = ((places - truth) / deviation.reshape(22, 3)) ** 2
    twice = [f"{side}_{part}" for side in ("left", "right") for part in ("leg", "foot", "arm", "forearm")]
    weights = np.array([1.0 + (role in twice) for role in BODY22])
    signed = np.where((answered * turned).sum(-1, keepdims=True) < 0, -turned, turned)
    angles = Rotation.from_quat(np.roll(answered, -1, -1).reshape(-1, 4)).as_euler("YZX")[:, 0]
    beyond = np.maximum(np.abs(angles.reshape(answered.shape[:-1])) - np.radians(100.0), 0.0)[..., 1:]

    def matrix(points):
        points = np.where(real[..., None, None], points, np.arange(66.0).reshape(22, 3))
        lengths = np.linalg.norm(points[..., None, :] - points[..., None, :, :], axis=-1)
        return lengths / lengths.sum(-1, keepdims=True)

    def of_frames(values, which):
        return (values.reshape(*real.shape, -1).sum(-1) * which).sum() / which.sum()

    expected = {
        "positions": of_frames(apart * weights[:, None], own),
        "rotations": of_frames((answered - signed) ** 2, own),
        "twist": 10.0 * ((beyond**2).mean(-1) * real).sum() / real.sum(),
        "semantics": 100.0 * of_frames((matrix(places) - matrix(truth)) ** 2, real),
        "adversarial": 2.0 * float(np.log1p(np.exp(-memory["shown"][3].detach().numpy())).mean()),
    }
    assert min(expected.values()) > 1e-3
    assert terms == pytest.approx(expected, rel=1e-4)


def test_a_batch_is_windows_and_bodies(module):
    batch = training_material.batch(module, 40)
    for row in range(0, 40, 7):
        skeleton = replace(
            Body22(BODIES["one"]).skeleton, offsets=batch["source"]["offsets"][row].double().numpy()
        )
        hips = np.repeat(skeleton.offsets[:1], 30, axis=0)
        places, _ = kinematics.forward(skeleton, batch["rotations"][row].double().numpy(), hips)
        real = int(batch["lengths"][row])
        np.testing.assert_allclose(batch["positions"][row][:real], places[:real], atol=1e-3)
        assert not batch["path"][row, 0].any()
    same = batch["source"]["offsets"].eq(batch["target"]["offsets"]).all(-1).all(-1)
    assert torch.equal(same, batch["same"])
    assert 8 < int(same.sum()) < 32


def test_the_discriminator_ignores_padding():
    torch.manual_seed(2)
    network = TrajectoryDiscriminator()
    paths, lengths = torch.randn(4, 60, 3), torch.tensor([60, 31, 8, 1])
    expected = network(paths, lengths)
    other = paths.clone()
    for row, length in enumerate(lengths.tolist()):
        other[row, length:] = torch.nan
    torch.testing.assert_close(network(other, lengths), expected)
    longer = torch.cat([other, torch.full((4, 21, 3), torch.nan)], 1)
    torch.testing.assert_close(network(longer, lengths)[1:], expected[1:])
    assert torch.isfinite(network(paths[:, :1], torch.ones(4, dtype=torch.long))).all()


# -------------------------------------------------------------------------------------------- answers
@pytest.mark.parametrize("chunk", [1, 7, 1000])
def test_chunks_change_nothing(method, chunk):
    source, target = dance(BODIES["one"], 40), BODIES["legs"]
    answer = retargeted(method._network, source, target, 20.0, "hip_height", chunk)
    assert apart(answer, carried(method, source, target)) < 1e-6


def test_no_change_is_a_copy(method):
    """A network whose changes are the identity copies rotations, and scales the path by hip heights."""
    source, target = dance(BODIES["one"], 20), BODIES["tall"]
    network = SkeletonAwareNetwork().eval()
    with torch.no_grad():
        network.change.weight.zero_()
        network.change.bias.copy_(torch.tensor([1.0, 0.0, 0.0, 0.0]))
    answer = retargeted(network, source, target, 20.0, "hip_height")
    assert rotation.angle(answer.rotations, source.rotations).max() < 1e-5
    np.testing.assert_allclose(answer.root, 1.4 * source.root, atol=1e-9)


def test_head_toes_and_hands_turn_as_the_sources(method):
    source, target = dance(BODIES["one"], 20), BODIES["tall"]
    answer = carried(method, source, target)
    joints = [BODIES["one"].joint_of[BODY22[leaf]] for leaf in features.LEAVES]
    turned = rotation.angle(answer.rotations, source.rotations)
    assert turned[:, joints].max() < 1e-6
    others = [joint for joint in range(22) if joint not in joints]
    assert turned[:, others].max(0).min() > 1e-3
