"""HuMoT: what it sees, and networks that are plain ones, blind to padding and neighbours."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import torch
from humot_reference import PlainDecoder, PlainEncoder, batch
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation
from torch import Tensor, nn
from torch.nn import functional

from retarget_bench.methods.humot.features import (
    HEIGHTS,
    MAJOR,
    body,
    headings,
    parents_among,
    rotated,
    size_factor,
    stature,
    upright,
)
from retarget_bench.methods.humot.network import Decoder, Encoder
from retarget_bench.methods.humot.network import block as blocks
from retarget_bench.methods.humot.network import layers as temporal
from retarget_bench.methods.humot.network.layers import STRETCH, TemporalConvolution
from retarget_bench.methods.humot.network.tokens import RaggedTokens
from retarget_bench.methods.humot.settings import DESIGNS as VARIANTS
from retarget_bench.methods.humot.settings import Design
from retarget_bench.methods.humot.training import DROP_MAJOR, DROP_OTHER, subsampled
from retarget_bench.plugins import bound
from retarget_bench.plugins.spec import Spec
from tests.examples import examples

TINY = {"width": 16, "latent": 8, "heads": 4, "blocks": (2, 2), "template": (4, 6), "motion": (3, 5, 8)}
DESIGNS = {
    "batch": replace(VARIANTS["text"], **TINY),
    "batch, free of parameters": replace(VARIANTS["paper_count"], **TINY),
    "layer": replace(VARIANTS["small"], **TINY),
    "layer, free of parameters": replace(VARIANTS["small"], **TINY, affine=False, biased=True),
}
every_design = pytest.mark.parametrize("design", DESIGNS.values(), ids=list(DESIGNS))
by_token = [design for design in DESIGNS.values() if design.norm == "layer"]
SIZES = {
    "alike": ([5, 5, 5], [12, 12, 12]),
    "joints differ": ([9, 3, 5], [12, 12, 12]),
    "both differ": ([9, 2, 15], [12, 7, 9]),
    "next to nothing": ([2, 1], [3, 1]),
    "long": ([7, 20], [110, 95]),
}
Batch = tuple[Tensor, Tensor, Tensor, Tensor]


def networks(design: Design, seed: int = 0) -> tuple[Encoder, Decoder]:
    """With all parameters off their starting values, and running statistics of something."""
    torch.manual_seed(seed)
    encoder, decoder = Encoder(design), Decoder(design)
    with torch.no_grad():
        for each in (*encoder.parameters(), *decoder.parameters()):
            each += 0.05 * torch.randn_like(each)
        through(encoder, decoder, batch([6, 4], [10, 10], seed=9))
    return encoder, decoder


def through(encoder: nn.Module, decoder: nn.Module, sequences: Batch) -> tuple[Tensor, Tensor]:
    """Code and positions."""
    positions, template, joints, frames = sequences
    if not isinstance(encoder, Encoder):  # plain ones see the masks
        code = encoder(positions, template, joints, frames)
        return code, decoder(code, template, joints, frames)
    source_tokens, target_tokens = RaggedTokens.between(joints.numpy(), joints.numpy(), frames.numpy())
    code = encoder(positions, template, source_tokens)
    return code, decoder(code, template, target_tokens)


def doubled(sequences: Batch) -> Batch:
    positions, template, joints, frames = sequences
    return positions.double(), template.double(), joints, frames


def gradients(encoder: nn.Module, decoder: nn.Module, sequences: Batch) -> list[Tensor]:
    """Code, positions, and gradients by all parameters of a sum that means nothing."""
    code, places = through(encoder, decoder, sequences)
    (places.square() + places).sum().backward()
    grads = [each.grad for module in (encoder, decoder) for each in module.parameters()]
    return [code, places, *grads]


# ---------------------------------------------------------------------------------------- what they are


@every_design
@pytest.mark.parametrize("training", [True, False])
@pytest.mark.parametrize("sizes", SIZES.values(), ids=list(SIZES))
def test_the_same_as_plain_networks(design, sizes, training):
    encoder, decoder = networks(design)
    lean = [net.double().train(training) for net in (encoder, decoder)]
    plain = [PlainEncoder(encoder).train(training), PlainDecoder(decoder).train(training)]
    sequences = doubled(batch(*sizes))
    actual, expected = gradients(*lean, sequences), gradients(*plain, sequences)
    for one, other in zip(actual, expected, strict=True):
        torch.testing.assert_close(one, other, atol=1e-9, rtol=1e-9)
    for own, other in zip(lean, plain, strict=True):
        for one, two in zip(own.buffers(), other.buffers(), strict=True):
            torch.testing.assert_close(one, two, atol=1e-12, rtol=1e-12)


# ------------------------------------------------------------------------- padding and neighbours
sequences = st.lists(st.tuples(st.integers(1, 9), st.integers(1, 12)), min_size=1, max_size=4)
more = st.tuples(st.integers(0, 4), st.integers(0, 5))


def alone(sequences: Batch, row: int) -> Batch:
    """One of them without padding."""
    positions, template, joints, frames = (each[row] for each in sequences)
    positions = positions[frames][:, joints]
    ones = torch.ones(1, len(template[joints]), dtype=torch.bool), torch.ones(1, len(positions)).bool()
    return positions[None], template[joints][None], *ones


def padded(sequences: Batch, joints: int, frames: int) -> Batch:
    """With so much more of both, and with junk where there is nothing."""
    positions, template, real, lasting = sequences
    positions = nn.functional.pad(positions, (0, 0, 0, joints, 0, frames))
    template = nn.functional.pad(template, (0, 0, 0, joints))
    real, lasting = nn.functional.pad(real, (0, joints)), nn.functional.pad(lasting, (0, frames))
    positions[~(real.unsqueeze(1) & lasting.unsqueeze(2))] = torch.nan
    template[~real] = torch.nan
    return positions, template, real, lasting


@torch.no_grad()
def check_alone(nets: tuple[Encoder, Decoder], inputs: Batch) -> None:
    code, places = through(*nets, inputs)
    for row in range(len(code)):
        joints, frames = inputs[2][row], inputs[3][row]
        own_code, own_places = through(*nets, alone(inputs, row))
        torch.testing.assert_close(code[row, frames], own_code[0], atol=1e-5, rtol=1e-5)
        torch.testing.assert_close(places[row, frames][:, joints], own_places[0], atol=1e-5, rtol=1e-5)
        assert not code[row, ~frames].any()
        assert not places[row, ~frames].any()
        assert not places[row, :, ~joints].any()


@every_design
@examples(12)
@given(sizes=sequences, more=more, seed=st.integers(0, 99))
def test_answers_are_those_of_a_sequence_alone(design, sizes, more, seed):
    inputs = padded(batch([one for one, _ in sizes], [two for _, two in sizes], seed), *more)
    check_alone(tuple(net.eval() for net in networks(design)), inputs)


@pytest.mark.parametrize("design", by_token, ids=["affine", "free of parameters"])
@examples(12)
@given(sizes=sequences, more=more, seed=st.integers(0, 99))
def test_by_tokens_so_are_those_in_training(design, sizes, more, seed):
    inputs = padded(batch([one for one, _ in sizes], [two for _, two in sizes], seed), *more)
    check_alone(tuple(net.train() for net in networks(design)), inputs)


@every_design
def test_a_joint_left_out_anywhere_is_not_there(design):
    positions, template, joints, frames = batch([8, 8], [9, 9])
    joints[0, [0, 4]] = False
    joints[1, [3, 7]] = False
    check_alone(tuple(net.eval() for net in networks(design)), (positions, template, joints, frames))


@every_design
def test_long_motions_are_read_in_parts_to_the_same_effect(design, monkeypatch):
    nets = tuple(net.eval() for net in networks(design))
    inputs = batch([23, 9], [100, 81])
    expected = through(*nets, inputs)
    monkeypatch.setattr(blocks, "LONG", 1)
    monkeypatch.setattr(blocks, "SIDE", (5, 7))
    with torch.no_grad():
        actual = through(*nets, inputs)
    for one, other in zip(actual, expected, strict=True):
        torch.testing.assert_close(one, other, atol=1e-5, rtol=1e-5)


# ------------------------------------------------------------------------------------- convolutions in time
@pytest.fixture(autouse=True)
def _by_frequency(monkeypatch: pytest.MonkeyPatch) -> None:
    torch.manual_seed(0)
    monkeypatch.setattr(temporal, "FEWEST", 1)
    monkeypatch.setattr(temporal, "NARROWEST", 1)


@pytest.mark.parametrize("kernel", [1, 3, 9, 15])
@pytest.mark.parametrize("frames", [1, 2, 7, 30, STRETCH, STRETCH + 1, 3 * STRETCH - 5])
def test_values_and_gradients_are_torchs(frames, kernel):
    layer = TemporalConvolution(3, 4, kernel).double()
    values = torch.randn(5, frames, 3, dtype=torch.float64, requires_grad=True)
    upstream = torch.randn(5, frames, 4, dtype=torch.float64)
    expected = functional.conv1d(values.transpose(1, 2), layer.weight, layer.bias, padding=kernel // 2)
    expected = expected.transpose(1, 2)
    actual = layer(values)
    torch.testing.assert_close(actual, expected, atol=1e-12, rtol=1e-12)
    variables = [values, layer.weight, layer.bias]
    own_gradients = torch.autograd.grad(actual, variables, upstream)
    reference_gradients = torch.autograd.grad(expected, variables, upstream)
    for one, other in zip(own_gradients, reference_gradients, strict=True):
        torch.testing.assert_close(one, other, atol=1e-11, rtol=1e-11)


def test_few_and_many_joints_are_treated_alike(monkeypatch):
    layer = TemporalConvolution(32, 32, 9)
    values = torch.randn(6, 30, 32)
    by_frequency = layer(values)
    monkeypatch.setattr(temporal, "FEWEST", 7)
    torch.testing.assert_close(by_frequency, layer(values), atol=1e-5, rtol=1e-5)


def test_an_even_number_of_taps_is_refused():
    with pytest.raises(ValueError, match="odd number of taps, not 8"):
        TemporalConvolution(3, 4, 8)


# ---------------------------------------------------------------------------------------- what networks see
PUPPETS = bound.dataset(Spec.parse("puppets[size=tiny]")).built.characters()
BODIES = {each.structure: each for each in PUPPETS.values() if not each.four_legged}


def test_axes_turn_and_turn_back():
    places = np.random.default_rng(0).normal(size=(5, 7, 3))
    np.testing.assert_array_equal(upright(upright(places)), places)
    np.testing.assert_array_equal(upright(np.array([0.0, 1.0, 0.0])), [0.0, 0.0, 1.0])  # up is Z
    np.testing.assert_array_equal(upright(np.array([0.0, 0.0, 1.0])), [0.0, 1.0, 0.0])  # ahead is Y
    turn = upright(np.eye(3))
    assert np.linalg.det(turn) == pytest.approx(1.0)  # and left stays left


@pytest.mark.parametrize("structure", sorted(BODIES))
def test_twelve_major_joints_and_hips_first(structure):
    humot_body = body(BODIES[structure])
    assert humot_body.character.roles[humot_body.joints[0]] == "hips"
    assert humot_body.parents[0] == -1
    assert all(0 <= parent < place for place, parent in enumerate(humot_body.parents) if place)
    assert humot_body.major.sum() == len(MAJOR) == 12
    assert np.abs(humot_body.template[0]).max() < 1e-12
    assert humot_body.template[:, 2].max() > 0.3 > -0.3 > humot_body.template[:, 2].min()


def test_puppets_are_as_tall_by_their_legs_or_arms_alone():
    every = [body(each) for each in PUPPETS.values() if not each.four_legged]
    for limb in (("foot", "leg", "up_leg"), ("arm", "forearm", "hand"), ("leg", "forearm")):
        ratios = []
        for humot_body in every:
            known = np.isin(humot_body.heights, [HEIGHTS[part] for part in limb])
            assert known.sum() == 2 * len(limb)
            ratios.append(
                stature(humot_body.template, np.where(known, humot_body.heights, np.nan))
                / humot_body.stature
            )
        assert np.mean(ratios) == pytest.approx(1.0, abs=0.03)
        assert np.mean(np.abs(np.log(ratios)) < 0.25) > 0.9  # one has arms to the floor
    for humot_body in every:
        ankles_to_shoulders = (
            humot_body.template[humot_body.heights == 1.0, 2].max()
            - humot_body.template[:, 2][humot_body.heights == 0.0].min()
        )
        assert humot_body.stature == pytest.approx(ankles_to_shoulders)


def test_one_height_tells_no_stature():
    humot_body = body(BODIES["h36m17"])
    for part in ("arm", "foot"):
        assert (
            stature(
                humot_body.template,
                np.where(humot_body.heights == HEIGHTS[part], humot_body.heights, np.nan),
            )
            == 0.0
        )
    assert size_factor(0.0) == 1.0


def test_joints_are_left_out_as_often_as_the_paper_says():
    numbers = np.random.default_rng(2)
    major = np.arange(40) < 12
    count = 3000
    stays = sum(np.bincount(subsampled(numbers, major), minlength=40) for _ in range(count)) / count
    for share, drop in ((stays[:12], DROP_MAJOR), (stays[12:], DROP_OTHER)):
        assert np.abs(share - (1.0 - drop)).max() < 5.0 * np.sqrt(drop * (1.0 - drop) / count)


@given(st.integers(0, 2**32 - 1), st.integers(1, 4))
def test_at_least_two_joints_stay(seed, joints):
    subset = subsampled(np.random.default_rng(seed), np.zeros(joints, bool))
    assert len(subset) >= min(2, joints)
    assert (np.diff(subset) > 0).all()


@given(st.data())
def test_parents_are_the_nearest_that_stay(data):
    count = data.draw(st.integers(2, 12))
    parents = [-1, *(data.draw(st.integers(0, joint - 1)) for joint in range(1, count))]
    joints = np.array(sorted(data.draw(st.sets(st.integers(0, count - 1), min_size=1))))
    nearest = parents_among(parents, joints)
    for place, joint in enumerate(joints):
        line, above = [], parents[joint]
        while above >= 0:
            line.append(above)
            above = parents[above]
        expected = [each for each in line if each in joints]
        assert (joints[nearest[place]] if nearest[place] >= 0 else None) == (
            expected[0] if expected else None
        )


# ----------------------------------------------------------------------------------------------- directions
def window(rng, rows=5, frames=7, joints=9):
    template = rng.normal(size=(rows, joints, 3))
    places = template[:, None] + 0.2 * rng.normal(size=(rows, frames, joints, 3))
    return places, template, np.ones((rows, joints), bool), np.ones((rows, frames), bool)


def about_z(places, angle):
    return Rotation.from_euler("z", angle).apply(places.reshape(-1, 3)).reshape(places.shape)


def test_turning_is_about_the_vertical_axis():
    rng = np.random.default_rng(0)
    places, angles = rng.normal(size=(4, 3, 5, 3)), rng.uniform(-4, 4, 4)
    expected = np.stack([about_z(row, angle) for row, angle in zip(places, angles, strict=True)])
    np.testing.assert_allclose(rotated(places, angles), expected, atol=1e-12)


def test_no_angle_brings_template_and_window_nearer():
    places, template, joints, frames = window(np.random.default_rng(2), rows=3)
    angles = headings(places, template, joints, frames)
    mean = places.mean(1)
    mean, still = (each - each.mean(1, keepdims=True) for each in (mean, template))
    for row in range(3):
        tried = np.linspace(-np.pi, np.pi, 7201)
        apart = [np.square(about_z(still[row], angle) - mean[row]).sum() for angle in tried]
        best = tried[int(np.argmin(apart))]
        assert abs(np.angle(np.exp(1j * (best - angles[row])))) < 1e-3


def test_padding_says_nothing():
    places, template, joints, frames = window(np.random.default_rng(3))
    wider = np.pad(places, ((0, 0), (0, 4), (0, 3), (0, 0)), constant_values=9.0)
    longer = np.pad(template, ((0, 0), (0, 3), (0, 0)), constant_values=-5.0)
    padded = headings(wider, longer, np.pad(joints, ((0, 0), (0, 3))), np.pad(frames, ((0, 0), (0, 4))))
    np.testing.assert_allclose(padded, headings(places, template, joints, frames), atol=1e-12)


def test_a_single_joint_has_no_heading():
    places, template, _, frames = window(np.random.default_rng(4), joints=1)
    assert (headings(places, template, np.ones((5, 1), bool), frames) == 0.0).all()
