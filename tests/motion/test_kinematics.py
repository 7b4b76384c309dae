"""Forward kinematics against plain loops over matrices, in NumPy and torch, single and mixed batches."""

from __future__ import annotations

import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from retarget_bench.errors import SkeletonError
from retarget_bench.motion import kinematics, kinematics_torch, rotation
from retarget_bench.motion.kinematics_torch import Tree, pad
from retarget_bench.motion.skeleton import Skeleton
from tests.examples import examples

patient = examples(50)
seeds = st.integers(0, 2**32 - 1)


def skeleton(joints: int, seed: int = 0, reach: int = 5) -> Skeleton:
    """A random tree; reach 1 makes a chain."""
    generator = np.random.default_rng([seed, joints])
    parents = [-1, *(int(generator.integers(max(0, j - reach), j)) for j in range(1, joints))]
    return Skeleton(tuple(map(str, range(joints))), np.array(parents), generator.normal(size=(joints, 3)))


def pose(*shape: int, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Random local rotations ``(*shape, 4)`` and root ``(*shape[:-1], 3)``."""
    generator = np.random.default_rng([seed, *shape])
    q = generator.normal(size=(*shape, 4))
    return q / np.linalg.norm(q, axis=-1, keepdims=True), generator.normal(size=(*shape[:-1], 3))


def plain(body: Skeleton, q: np.ndarray, root: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """By the book: positions and 3x3 orientations, joint by joint of frame by frame, by scipy."""
    places, turned = np.zeros((*q.shape[:-1], 3)), np.zeros((*q.shape[:-1], 3, 3))
    for frame in range(len(q)):
        for joint, parent in enumerate(body.parents):
            own = Rotation.from_quat(q[frame, joint], scalar_first=True).as_matrix()
            if parent < 0:
                places[frame, joint], turned[frame, joint] = root[frame], own
            else:
                reach = turned[frame, parent] @ body.offsets[joint]
                places[frame, joint] = places[frame, parent] + reach
                turned[frame, joint] = turned[frame, parent] @ own
    return places, turned


@patient
@given(joints=st.integers(1, 30), frames=st.integers(0, 4), reach=st.integers(1, 8), seed=seeds)
def test_agrees_with_the_book(joints: int, frames: int, reach: int, seed: int) -> None:
    body = skeleton(joints, seed, reach)
    q, root = pose(frames, joints, seed=seed)
    places, turned = kinematics.forward(body, q, root)
    expected, matrices = plain(body, q, root)
    np.testing.assert_allclose(places, expected, atol=1e-12)
    np.testing.assert_allclose(rotation.to_matrix(turned), matrices, atol=1e-12)
    np.testing.assert_allclose(kinematics.local_from_global(body, turned), q, atol=1e-12)


def test_long_clips_are_frame_by_frame_the_same() -> None:
    body = skeleton(25)
    q, root = pose(700, 25)
    places, turned = kinematics.forward(body, q, root)
    for frame in (0, 255, 256, 511, 512, 699):
        single = kinematics.forward(body, q[frame], root[frame])
        np.testing.assert_allclose(places[frame], single[0], atol=1e-13)
        np.testing.assert_allclose(turned[frame], single[1], atol=1e-14)
    folded = kinematics.forward(body, q.reshape(2, 350, 25, 4), root.reshape(2, 350, 3))
    np.testing.assert_array_equal(folded[0].reshape(places.shape), places)


def test_a_broken_joint_harms_only_what_hangs_on_it() -> None:
    body = Skeleton(("hips", "left", "right", "tip"), np.array([-1, 0, 0, 1]), np.eye(4, 3))
    q, root = rotation.identity(1, 4), np.zeros((1, 3))
    q[0, 1] = np.nan
    assert np.isnan(kinematics.forward(body, q, root)[0][0]).any(-1).tolist() == [False, False, False, True]


@pytest.mark.parametrize("shapes", [((3, 7, 4), (3, 3)), ((3, 8, 3), (3, 3)), ((3, 8, 4), (4, 3))])
def test_shapes_that_do_not_fit_are_refused(shapes: tuple[tuple[int, ...], tuple[int, ...]]) -> None:
    body = skeleton(8)
    with pytest.raises(SkeletonError, match="8 joints"):
        kinematics.forward(body, np.ones(shapes[0]), np.ones(shapes[1]))
    with pytest.raises(SkeletonError, match="8 joints"):
        kinematics_torch.forward(
            Tree.of(body), torch.ones(8, 3), torch.ones(shapes[0]), torch.ones(shapes[1])
        )


def tensors(*arrays: np.ndarray) -> list[torch.Tensor]:
    return [torch.tensor(each) for each in arrays]


def recorded(
    body: Skeleton, offsets: torch.Tensor, q: torch.Tensor, root: torch.Tensor
) -> tuple[torch.Tensor, torch.Tensor]:
    """The same by plain autograd: a loop over joints with 3x3 matrices of normalised quaternions."""
    w, x, y, z = (q / q.norm(dim=-1, keepdim=True)).unbind(-1)
    rows = [
        torch.stack((1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)), -1),
        torch.stack((2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)), -1),
        torch.stack((2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)), -1),
    ]
    local = torch.stack(rows, -2)
    places, turned = [root], [local[..., 0, :, :]]
    for joint in range(1, len(body)):
        above = int(body.parents[joint])
        places.append(places[above] + (turned[above] @ offsets[..., joint, :, None])[..., 0])
        turned.append(turned[above] @ local[..., joint, :, :])
    return torch.stack(places, -2), torch.stack(turned, -3)


# frames: few take the way of few calls, many that of few products
@pytest.mark.parametrize("frames", [0, 1, 7, 2000])
@pytest.mark.parametrize("joints", [1, 2, 24])
def test_torch_agrees_with_numpy(joints: int, frames: int) -> None:
    body = skeleton(joints)
    q, root = pose(3, frames, joints)
    places, turned = kinematics_torch.forward(Tree.of(body), *tensors(body.offsets, q, root))
    expected = kinematics.forward(body, q, root)
    np.testing.assert_allclose(places.numpy(), expected[0], atol=1e-12)
    np.testing.assert_allclose(turned.numpy(), expected[1], atol=1e-12)
    alone, _ = kinematics_torch.forward(Tree.of(body), *tensors(body.offsets, q[0], root[0]))
    np.testing.assert_allclose(alone.numpy(), expected[0][0], atol=1e-12)


@pytest.mark.parametrize("frames", [2, 1000])
@pytest.mark.parametrize("outputs", ["places", "orientations", "both"])
def test_gradients_agree_with_recorded_ones(frames: int, outputs: str) -> None:
    body = skeleton(24)
    q, root = pose(2, frames, 24)
    weights = tensors(
        *(np.random.default_rng(k).normal(size=(2, frames, 24, 3, n)) for k, n in ((1, 1), (2, 3)))
    )

    def loss(places: torch.Tensor, matrices: torch.Tensor) -> torch.Tensor:
        first, second = (places * weights[0][..., 0]).sum(), (matrices * weights[1]).sum()
        return {"places": first, "orientations": second, "both": first + second}[outputs]

    leaves = [each.requires_grad_() for each in tensors(q, root, body.offsets)]
    places, turned = kinematics_torch.forward(Tree.of(body), leaves[2], leaves[0], leaves[1])
    own = torch.autograd.grad(loss(places, rotation.to_matrix(turned)), leaves, allow_unused=True)
    expected = torch.autograd.grad(
        loss(*recorded(body, leaves[2], leaves[0], leaves[1])), leaves, allow_unused=True
    )
    for a, b in zip(own, expected, strict=True):
        if b is None or not b.any():
            assert a is None or not a.any()
        else:
            torch.testing.assert_close(a, b, atol=1e-9, rtol=1e-9)


@pytest.mark.parametrize("mixed", [False, True])
def test_first_and_second_derivatives_by_differences(mixed: bool) -> None:
    bodies = [skeleton(4, 1), skeleton(2)] if mixed else [skeleton(4, 1)]
    tree = Tree.batch(bodies) if mixed else Tree.of(bodies[0])
    offsets = pad([each.offsets for each in bodies], torch.float64)
    q, root = tensors(*pose(len(bodies), 2, 4))
    leaves = [each.requires_grad_() for each in (offsets if mixed else offsets[0], q, root)]

    def run(
        offsets: torch.Tensor, q: torch.Tensor, root: torch.Tensor
    ) -> tuple[torch.Tensor, torch.Tensor]:
        return kinematics_torch.forward(tree, offsets, rotation.normalise(q), root)

    assert torch.autograd.gradcheck(run, leaves)
    assert torch.autograd.gradgradcheck(run, leaves)


@pytest.mark.parametrize("output", [0, 1])
def test_second_derivatives_of_one_output_with_fixed_offsets(output: int) -> None:
    body = skeleton(4, 1)
    offsets, q, root = tensors(body.offsets, *pose(1, 2, 4))
    leaves = [each.requires_grad_() for each in (q, root)]

    def run(q: torch.Tensor, root: torch.Tensor = root) -> torch.Tensor:
        return kinematics_torch.forward(Tree.of(body), offsets, rotation.normalise(q), root)[output]

    assert torch.autograd.gradgradcheck(run, leaves[: 2 - output])


def test_rounding_with_gradients_is_that_of_each_frame_alone() -> None:
    body = skeleton(24)
    q, root = (torch.from_numpy(each).float() for each in pose(1000, 24))
    offsets = torch.tensor(body.offsets)

    def turned(frames: int) -> torch.Tensor:
        rotations = q[:frames].clone().requires_grad_()
        return kinematics_torch.forward(Tree.of(body), offsets, rotations, root[:frames])[1]

    assert torch.equal(turned(1000)[:7], turned(7))


@pytest.mark.parametrize("dtype", [torch.float32, torch.float64])
@pytest.mark.parametrize(
    "start", [(1, 0, 0, 0), (-1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 0, -1), (0, 0.6, 0.8, 0)]
)
def test_gradients_are_finite_at_the_identity_and_half_turns(
    start: tuple[float, ...], dtype: torch.dtype
) -> None:
    body = skeleton(24)
    q = torch.tensor(start, dtype=dtype).expand(2, 5, 24, 4).clone().requires_grad_()
    offsets = torch.tensor(body.offsets, dtype=dtype, requires_grad=True)
    root = torch.zeros(2, 5, 3, dtype=dtype, requires_grad=True)
    places, turned = kinematics_torch.forward(Tree.of(body), offsets, q, root)
    (places.square().sum() + rotation.to_rotation_vector(turned).sum()).backward()
    for leaf in (q, offsets, root):
        assert torch.isfinite(leaf.grad).all()
        assert leaf.grad.any()


def test_one_body_per_sequence_on_a_shared_tree() -> None:
    body = skeleton(24)
    scales = np.array([0.5, 1.0, 2.0])
    offsets = body.offsets * scales[:, None, None]
    q, root = pose(3, 6, 24)
    leaves = [each.requires_grad_() for each in tensors(offsets, q, root)]
    places, _ = kinematics_torch.forward(Tree.of(body), *leaves)
    for k in range(3):
        own = Skeleton(body.names, body.parents, offsets[k])
        np.testing.assert_allclose(
            places[k].detach(), kinematics.forward(own, q[k], root[k])[0], atol=1e-12
        )
    wide, narrow = (
        torch.autograd.grad(run.square().sum(), leaves)
        for run in (places, recorded(body, leaves[0][:, None], leaves[1], leaves[2])[0])
    )
    for a, b in zip(wide, narrow, strict=True):
        torch.testing.assert_close(a, b, atol=1e-9, rtol=1e-9)


@patient
@given(sizes=st.lists(st.integers(1, 14), min_size=1, max_size=5), frames=st.integers(0, 3), seed=seeds)
def test_a_mixed_batch_is_each_sequence_alone(sizes: list[int], frames: int, seed: int) -> None:
    _compare_mixed([skeleton(joints, seed + k) for k, joints in enumerate(sizes)], frames, seed)


def test_a_large_mixed_batch_is_each_sequence_alone() -> None:
    _compare_mixed([skeleton(joints, joints) for joints in (24, 1, 31, 8, 24)], 400, 1)


def _compare_mixed(bodies: list[Skeleton], frames: int, seed: int) -> None:
    """Values and gradients, with NaN wherever a sequence has no joint."""
    size = max(map(len, bodies))
    q, root = pose(len(bodies), frames, size, seed=seed)
    tree, offsets = Tree.batch(bodies), pad([body.offsets for body in bodies], torch.float64)
    assert tree.mask.sum(1).tolist() == [len(body) for body in bodies]
    gap = ~tree.mask.numpy()
    weight = np.random.default_rng(seed).normal(size=(len(bodies), frames, size, 7))
    offsets[torch.from_numpy(gap)] = torch.nan
    for array in (q, weight):
        array.swapaxes(1, 2)[gap] = np.nan
    leaves = [each.requires_grad_() for each in (offsets, *tensors(q, root))]
    places, turned = kinematics_torch.forward(tree, *leaves)
    outputs, upstream = torch.cat((places, turned), -1), torch.tensor(weight)
    grads = torch.autograd.grad(outputs, leaves, upstream)
    for k, body in enumerate(bodies):
        n = len(body)
        expected = kinematics.forward(body, q[k, :, :n], root[k])
        np.testing.assert_allclose(places[k, :, :n].detach(), expected[0], atol=1e-11)
        np.testing.assert_allclose(turned[k, :, :n].detach(), expected[1], atol=1e-12)
        own = [each.requires_grad_() for each in tensors(body.offsets, q[k, :, :n], root[k])]
        alone = torch.cat(kinematics_torch.forward(Tree.of(body), *own), -1)
        single = torch.autograd.grad(alone, own, upstream[k, :, :n])
        torch.testing.assert_close(grads[0][k, :n], single[0], atol=1e-9, rtol=1e-9)
        torch.testing.assert_close(grads[1][k, :, :n], single[1], atol=1e-9, rtol=1e-9)
        torch.testing.assert_close(grads[2][k], single[2], atol=1e-9, rtol=1e-9)
    empty = torch.from_numpy(gap)
    assert not places.transpose(1, 2)[empty].any()
    assert (turned.transpose(1, 2)[empty] == torch.tensor([1.0, 0, 0, 0], dtype=turned.dtype)).all()
    assert not grads[0][empty].any()
    assert not grads[1].transpose(1, 2)[empty].any()


def test_mixed_precision_does_not_reach_the_kinematics() -> None:
    body = skeleton(24)
    q, root = pose(2, 6, 24)
    expected, _ = kinematics.forward(body, q, root)
    offsets, turns, start = (torch.tensor(each, dtype=torch.float32) for each in (body.offsets, q, root))
    turns.requires_grad_()

    def run() -> tuple[torch.Tensor, torch.Tensor]:
        places, _ = kinematics_torch.forward(Tree.of(body), offsets, turns, start)
        return places, torch.autograd.grad(places.square().sum(), turns)[0]

    plain_places, plain_gradient = run()
    with torch.autocast("cpu", dtype=torch.bfloat16):
        places, gradient = run()
    np.testing.assert_allclose(places.detach(), expected, atol=2e-5)
    torch.testing.assert_close(places, plain_places, atol=1e-5, rtol=0)
    torch.testing.assert_close(gradient, plain_gradient, atol=1e-3, rtol=1e-5)


def test_half_precision_is_raised() -> None:
    body = skeleton(5)
    q, root = (torch.tensor(each).bfloat16() for each in pose(2, 3, 5))
    places, turned = kinematics_torch.forward(Tree.of(body), torch.tensor(body.offsets), q, root)
    assert places.dtype == turned.dtype == torch.float32


def test_a_tree_moves_to_a_device_and_an_empty_batch_is_refused() -> None:
    body = skeleton(5)
    moved = Tree.of(body).to("meta")
    assert moved.mask.device.type == moved.levels[0][0].device.type == "meta"
    with pytest.raises(SkeletonError, match="at least one"):
        Tree.batch([])
