"""Methods for points: nearest frame, the copy of the motion under them, and NPT."""

from __future__ import annotations

from typing import Any

import method_bodies
import numpy as np
import pytest
import torch
from method_bodies import body, dance
from npt_material import BODIES
from npt_material import training_module as module
from skinned_toys import scan, skinned_body
from torch import Tensor, nn
from torch.nn import functional
from training_material import batch

from retarget_bench.api import Context
from retarget_bench.errors import BenchError, NotSupported
from retarget_bench.methods.nearest_frame import _RADII, _TURNS, NearestFrame, _Album, _described, _middle
from retarget_bench.methods.npt import NPT
from retarget_bench.methods.npt.network import PoseTransfer
from retarget_bench.methods.npt.surfaces import Identity, Skin, drawn
from retarget_bench.methods.npt.training import stretch
from retarget_bench.methods.skinned_copy import SkinnedCopy
from retarget_bench.motion import facing, scan_path, transfer
from retarget_bench.motion.character import Character
from retarget_bench.motion.motion import Motion, PointSets
from retarget_bench.training.layers.skinned_body import moves

ONE, TALL = skinned_body("one"), skinned_body("tall", scale=1.5)


def turned(points: np.ndarray, angle: float) -> np.ndarray:
    return facing.placed(points, np.exp(1j * angle))


class Clips(list[Motion]):
    """Training clips of one body."""

    @property
    def names(self) -> list[str]:
        return [str(number) for number in range(len(self))]


def cast(body: Character, *seeds: int) -> dict[str, dict[str, Clips]]:
    clips = Clips([method_bodies.dance(body, 20, seed) for seed in seeds])
    return {body.structure: {body.name: clips}}


# -------------------------------------------------------------------------------------- nearest frame


def test_descriptions_are_distances_to_the_nearest_point() -> None:
    points = np.random.default_rng(1).normal(size=(50, 3))
    description = _described(points, 2.0)
    assert description.shape == (7 * len(_RADII), _TURNS)
    place = np.array([0.0, -1.0, 2.0 * _RADII[0]])  # the lowest inner ring, ahead
    assert description[0, 0] == pytest.approx(np.linalg.norm(points - place, axis=-1).min())


def test_descriptions_are_compared_as_if_every_turn_were_described() -> None:
    album = _Album.of(cast(ONE, 1), ONE, 20)
    noisy = album.vertices[4] + np.random.default_rng(2).normal(size=album.vertices[4].shape) * 0.02
    even = np.full(len(noisy), 1.0 / len(noisy))
    each = [
        ((_described(noisy - _middle(noisy, even), album.stature) - np.roll(one, k, axis=1)) ** 2).sum()
        for one in album.described
        for k in range(_TURNS)
    ]
    pose, step = divmod(int(np.argmin(each)), _TURNS)
    best = turned(album.vertices[pose], 2.0 * np.pi * step / _TURNS)
    np.testing.assert_allclose(album.nearest(noisy, 1), best, atol=1e-6)


def test_training_motion_of_that_body_is_found_again_from_its_points() -> None:
    material = cast(ONE, 1, 2)
    motion = method_bodies.dance(ONE, 20, 2)
    answer = NearestFrame(poses=40).retarget(
        scan(motion, 600),
        ONE,
        context=Context(training=material),  # type: ignore[arg-type]
    )
    assert ONE.mesh is not None
    expected = ONE.mesh.skinned(motion)
    apart = [each - scan_path.centre(each)[:, None] for each in (answer.vertices, expected)]
    near = np.linalg.norm(apart[0] - apart[1], axis=-1).mean()
    other = np.linalg.norm(apart[0] - apart[1][::-1], axis=-1).mean()
    assert near < 0.05 * ONE.height
    assert near < 0.5 * other


def test_without_training_motion_or_a_mesh_it_refuses() -> None:
    source = scan(method_bodies.dance(ONE, 3))
    with pytest.raises(NotSupported, match="no motion to train on"):
        NearestFrame().retarget(source, TALL, context=Context())
    assert "no mesh" in (NearestFrame().supports(source.character, method_bodies.body()) or "")
    for wrong in ({"poses": 0}, {"best": 0}):
        with pytest.raises(BenchError, match="one or more"):
            NearestFrame(**wrong)


# --------------------------------------------------------------------------------------- skinned copy
def test_the_copy_is_that_of_the_motion_under_the_points() -> None:
    motion = method_bodies.dance(ONE, 9)
    answer = SkinnedCopy().retarget(scan(motion), TALL, context=Context(source_motion=motion))
    expected = transfer.carry(motion, TALL, "hip_height")
    np.testing.assert_array_equal(answer.rotations, expected.rotations)
    np.testing.assert_array_equal(answer.root, expected.root)


def test_the_copy_needs_that_motion_and_a_mesh() -> None:
    assert SkinnedCopy().card.needs == ("source_motion",)
    with pytest.raises(NotSupported, match="needs the motion"):
        SkinnedCopy().retarget(scan(method_bodies.dance(ONE, 2)), TALL, context=Context())
    assert "no mesh" in (SkinnedCopy().supports(ONE, method_bodies.body()) or "")
    with pytest.raises(NotSupported, match="no root rule"):
        SkinnedCopy(root_rule="reference")  # type: ignore[arg-type]


# ------------------------------------------------------------------------------------------------------ NPT
def trained(method: NPT, network: PoseTransfer) -> NPT:
    return method.using({name: each.detach() for name, each in network.state_dict().items()})


# ---------------------------------------------------------------------------------------- the network
def count(width: int) -> int:
    """Layers as the paper lists them: 3-64-128-width; the decoder from width + 3 down to 3, with three
    residual blocks of three layers and three pairs of scales and shifts."""
    total = sum((a + 1) * b for a, b in ((3, 64), (64, 128), (128, width)))
    channels = (width + 3, (width + 3) // 2, (width + 3) // 4)
    for before, now in zip((width + 3, *channels), channels, strict=False):
        total += (before + 1) * now + 3 * ((now + 1) * now + 2 * 4 * now)
    return total + (channels[-1] + 1) * 3


@pytest.mark.parametrize("pooling", ["none", "max"])
def test_it_has_as_many_parameters_as_its_layers(pooling: Any) -> None:
    for width in (1024, 128):
        network = PoseTransfer(width, pooling)
        assert sum(each.numel() for each in network.parameters()) == count(width)
    assert count(1024) == 6_054_941


def plain(network: PoseTransfer, points: Tensor, identity: Tensor) -> Tensor:
    """The network written out with torch's convolutions and instance norms."""

    def conv(layer: nn.Linear, x: Tensor) -> Tensor:
        return functional.conv1d(x, layer.weight[..., None], layer.bias)

    pose, identity_points = points.mT, identity.mT
    for layer in network.encoder.layers:
        pose = functional.relu(functional.instance_norm(conv(layer, pose)))
    if network.pooling == "max":
        pose = pose.max(dim=2).values[..., None].repeat(1, 1, identity.shape[1])
    x = torch.cat([pose, identity_points], 1)
    for rank, (layer, block) in enumerate(zip(network.layers, network.blocks, strict=True)):
        x = conv(layer, x)
        untouched = network.pooling == "max" and rank == 0

        def step(which: int, y: Tensor, block: Any = block, as_is: bool = untouched) -> Tensor:
            style, after = block.styles[which], block.layers[which]
            y = y if as_is else functional.instance_norm(y)
            return conv(
                after,
                functional.relu(
                    conv(style.scale, identity_points) * y + conv(style.shift, identity_points)
                ),
            )

        x = step(1, step(0, x)) + step(2, x)
    return 2.0 * torch.tanh(conv(network.answer, x)).mT


@pytest.mark.parametrize("pooling", ["none", "max"])
def test_the_network_is_the_one_written_out(pooling: Any) -> None:
    torch.manual_seed(1)
    network = PoseTransfer(20, pooling).double()
    points, identity = torch.randn(2, 3, 40, 3, dtype=torch.float64)
    answer = network(points, identity)
    torch.testing.assert_close(answer, plain(network, points, identity), rtol=1e-9, atol=1e-9)
    assert answer.abs().max() < 2.0


# ------------------------------------------------------------------------------------------- surfaces
@pytest.mark.parametrize("name", BODIES)
def test_a_skin_under_transforms_is_the_skinned_mesh(name: str) -> None:
    motion, skin = dance(BODIES[name], 12), Skin(BODIES[name])
    mesh = BODIES[name].mesh
    assert mesh is not None
    arrays = moves(motion, motion.root)
    vertices = np.stack([skin.posed(arrays, frame) for frame in range(motion.frames)])
    np.testing.assert_allclose(vertices + motion.root[:, None], mesh.skinned(motion), atol=1e-5)


def test_targets_are_brought_to_one_stature() -> None:
    for character in BODIES.values():
        identity = Identity.of(character)
        assert np.ptp(identity.scale * identity.vertices[:, 1]) == pytest.approx(1.7)
        assert identity.vertices.min(axis=0) + identity.vertices.max(axis=0) == pytest.approx(
            0.0, abs=1e-12
        )


def test_points_are_drawn_all_before_any_is_drawn_again() -> None:
    numbers = np.random.default_rng(0)
    frames = [np.arange(3.0 * n).reshape(n, 3) for n in (5, 8)]
    few, many = drawn(numbers, frames, 4), drawn(numbers, frames, 20)
    assert few.shape == (2, 4, 3)
    for frame, points_drawn in zip(frames, many, strict=True):
        _, times = np.unique(points_drawn, axis=0, return_counts=True)
        assert len(times) == len(frame)
        assert np.ptp(times) <= 1
    assert all(len(np.unique(each, axis=0)) == 4 for each in few)


# ------------------------------------------------------------------------------------------- training
def test_a_row_is_one_pose_by_two_bodies() -> None:
    of = module()
    row = batch(of, rows=8)
    for name in ("points", "identity", "truth"):
        assert row[name].shape == (8, 60, 3)
    # edges of rigid parts are as long in the pose as at rest
    rows = torch.arange(8)[:, None]
    lengths = [
        (row[name][rows, row["edges"][..., 0]] - row[name][rows, row["edges"][..., 1]]).norm(dim=-1)
        for name in ("identity", "truth")
    ]
    assert row["real"].sum() > 8 * 20
    torch.testing.assert_close(lengths[0], lengths[1], atol=1e-4, rtol=1e-3)
    assert (lengths[0][row["real"]] > 0.01).all()


def test_stretch_is_the_mean_over_edges_written_out() -> None:
    numbers = np.random.default_rng(4)
    answer, identity = (torch.from_numpy(numbers.normal(size=(2, 6, 3))) for _ in range(2))
    edges = torch.tensor([[[0, 1], [2, 5], [0, 0]], [[3, 4], [1, 2], [5, 0]]])
    real = torch.tensor([[True, True, False], [True, True, True]])
    each = [
        abs(float((answer[r, a] - answer[r, b]).norm() / (identity[r, a] - identity[r, b]).norm()) - 1.0)
        for r, row in enumerate(edges.tolist())
        for k, (a, b) in enumerate(row)
        if real[r, k]
    ]
    assert float(stretch(answer, identity, edges, real)) == pytest.approx(np.mean(each), rel=1e-6)
    same = torch.zeros(1, 4, 3, requires_grad=True)  # all in one place: a slope all the same
    stretch(same, torch.rand(1, 4, 3), edges[:1, :1], real[:1, :1]).backward()
    assert same.grad is not None
    assert torch.isfinite(same.grad).all()


# -------------------------------------------------------------------------------------------- answers


def test_soles_are_on_the_sources_floor_and_the_path_is_scaled() -> None:
    torch.manual_seed(0)
    method = trained(NPT(width=16), PoseTransfer(16, "max"))
    source = scan(dance(BODIES["one"], 6))
    answer = method.retarget(source, BODIES["tall"], context=Context())
    lowest = np.array([frame[:, 1].min() for frame in source.points])
    below = answer.vertices[..., 1].min(axis=1)
    assert below / lowest == pytest.approx(np.full(6, below[0] / lowest[0]), rel=1e-6)
    far = PointSets(
        source.character, tuple(f + np.array([4.0, 0.0, 0.0]) for f in source.points), source.fps
    )
    moved = method.retarget(far, BODIES["tall"], context=Context())
    step = moved.vertices - answer.vertices
    np.testing.assert_allclose(step, np.broadcast_to(step[0, 0], step.shape), atol=1e-4)
    assert step[0, 0, 0] == pytest.approx(4.0 * below[0] / lowest[0], rel=1e-4)


def test_what_it_cannot_do_is_said() -> None:
    bare = body("bare")
    method = trained(NPT(width=16), PoseTransfer(16, "max"))
    assert "has none" in (method.supports(BODIES["one"], bare) or "")
    with pytest.raises(NotSupported, match="no mesh"):
        method.retarget(dance(bare, 3), BODIES["one"], context=Context())


def test_every_edge_is_there_once() -> None:
    skin = Skin(BODIES["one"])
    assert len(skin.edges) == 12 * len(BODIES["one"].skeleton)  # an octahedron has twelve
    assert (skin.edges[:, 0] < skin.edges[:, 1]).all()
    assert len(np.unique(skin.edges, axis=0)) == len(skin.edges)
