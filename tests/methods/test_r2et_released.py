"""R2ET with the authors' weights: their own numbers, and files that are not theirs."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import torch

import retarget_bench as rb
from retarget_bench.api import Context
from retarget_bench.errors import BenchError, FileError
from retarget_bench.methods.r2et import R2ET, features
from retarget_bench.methods.r2et.inference import changed
from retarget_bench.methods.r2et.network import SkeletonAwareNetwork, joint_code
from retarget_bench.methods.r2et.released import STATISTICS
from retarget_bench.motion import body22, kinematics_torch, role_finding, rotation
from retarget_bench.motion.body22 import Body22
from retarget_bench.motion.skeleton import Skeleton

STATS = "datasets/mixamo/stats"


@pytest.fixture(scope="module")
def oracle(real_data):
    file = real_data / "oracles" / "r2et_skeleton.npz"
    if not file.exists():
        pytest.skip("no oracle of R2ET")
    return dict(np.load(file, allow_pickle=False))


def their_names() -> dict[str, torch.Tensor]:
    """Tensors of the sizes and names of the authors' file, drawn at random."""
    torch.manual_seed(0)
    state = {}
    for own_name, tensor in SkeletonAwareNetwork().state_dict().items():
        encoder, _, rest = own_name.partition(".")
        authors_name = {"motion": "q_encoder", "body": "skel_encoder"}.get(encoder)
        if authors_name:
            inside = {
                "enter": "token_linear",
                "qkv": "trans1.layers.0.0.to_qkv",
                "out": "trans1.layers.0.0.nn1",
                "norm": "trans1.layers.0.1.fn.norm",
                "feed.0": "trans1.layers.0.1.fn.fn.nn1",
                "feed.1": "trans1.layers.0.1.fn.fn.nn2",
            }
            module, _, kind = rest.rpartition(".")
            state[f"module.delta_dec.{authors_name}.{inside[module]}.{kind}"] = tensor.clone()
        elif encoder in ("join", "change"):
            name = {"join": "embed_linear", "change": "delta_linear"}[encoder]
            state[f"module.delta_dec.{name}.{rest}"] = tensor.clone()
    return {**state, "module.delta_dec.pos_encoder.pe": joint_code(512)[None]}


def repository(folder: Path, weights, statistics) -> Path:
    """The authors' files as their repository has them; the ``.pt``."""
    file = folder / "pretrain" / "skeleton_aware_pre.pt"
    for each in (file.parent, folder / STATS):
        each.mkdir(parents=True)
    torch.save(weights, file)
    for name, array in statistics.items():
        np.save(folder / STATS / name, array)
    return file


def random_statistics() -> dict[str, np.ndarray]:
    sizes = {"local": 3, "quat": 4}
    numbers = np.random.default_rng(0)
    return {
        name: numbers.uniform(0.5, 2.0, (1, 22, sizes[name.split("_")[1]])).astype(np.float32)
        for name in STATISTICS.values()
    }


@pytest.fixture
def file(tmp_path):
    return repository(tmp_path, their_names(), random_statistics())


@pytest.fixture(scope="module")
def released(oracle, tmp_path_factory):
    """The method with the authors' weights; its direction is averaged over 20 frames of 1/60 s, as theirs
    at the rate of the file."""
    weights = {
        f"module.{name.removeprefix('state/')}": torch.from_numpy(array)
        for name, array in oracle.items()
        if name.startswith("state/")
    }
    keys = ("local_mean", "local_std_as_stored", "quat_mean", "quat_std")
    statistics = {name: oracle[f"stats/{key}"] for name, key in zip(STATISTICS.values(), keys, strict=True)}
    file = repository(tmp_path_factory.mktemp("r2et"), weights, statistics)
    return R2ET(weights=str(file), facing=10.0)


# ------------------------------------------------------------------------------------ their own numbers
def close(answer, expected) -> float:
    """Largest difference, relative to the largest number."""
    return float(np.abs(np.asarray(answer) - expected).max() / np.abs(expected).max())


@torch.inference_mode()
def test_the_network_is_theirs(released, oracle):
    network = released._network
    bones = [torch.from_numpy(oracle[f"input/{body}_skeleton"]) for body in ("source", "target")]
    codes = network.bones(torch.stack(bones))
    for code, body in zip(codes, ("source", "target"), strict=True):
        assert close(code, oracle[f"between/{body}_skeleton_code"]) < 1e-5
    rotations = torch.from_numpy(oracle["input/quaternions"])
    normal = network.normal("rotations", rotations)
    assert close(normal, oracle["input/quaternions_normalised"]) < 1e-5
    frame = int(oracle["between/frame"])
    code = network.motion(normal[None, frame])[0]
    assert close(code, oracle["between/quaternion_code"]) < 1e-5
    changes = network(rotations, *codes)
    # the code of the joints' order changes theirs by no more than 7e-6
    assert close(changes, oracle["output/delta_quaternions"]) < 1e-6
    actual = rotation.multiply(rotations, changes).double().numpy()
    apart = rotation.angle(actual, oracle["output/quaternions"].astype(float))
    assert np.degrees(apart).max() < 1e-3


@torch.inference_mode()
def test_statistics_and_what_is_normalised_by_them_are_theirs(released, oracle):
    """Constants have deviation 1; their sequences are positions, then the root's movement as it is."""
    network = released._network
    deviation = network.scale.get_buffer("positions_deviation")
    assert close(deviation, oracle["stats/local_std_as_used"].reshape(-1)) < 1e-6
    for body in ("source", "target"):
        normalised = network.normal("positions", torch.from_numpy(oracle[f"input/{body}_skeleton"]))
        assert close(normalised, oracle[f"input/{body}_skeleton_normalised"]) < 1e-5
    np.testing.assert_array_equal(oracle["input/sequence_normalised"][:, 66:], oracle["input/global"])
    frame = int(oracle["between/frame"])
    change = torch.from_numpy(oracle["between/delta_before_denormalising"])
    restored = network.scale.restore("rotations", change.flatten()).view(22, 4)
    assert close(rotation.normalise(restored), oracle["output/delta_quaternions"][frame]) < 1e-5


@torch.inference_mode()
def test_positions_that_losses_and_files_have_are_theirs(released, oracle):
    """Forward kinematics of the 22 joints, the hips where the skeleton's first row says; normalised."""
    assert oracle["structure/parents"].tolist() == list(body22.PARENTS)
    names, offsets = oracle["structure/names"].tolist(), oracle["written/offsets"].astype(float)
    actual = role_finding.find(Skeleton(tuple(names), oracle["structure/parents"], offsets))
    assert tuple(actual) == body22.BODY22
    bones = torch.from_numpy(oracle["input/target_skeleton"])
    turned = torch.from_numpy(oracle["output/quaternions"])
    hips = bones[:1].expand(len(turned), -1)
    positions, _ = kinematics_torch.forward(kinematics_torch.Tree.of(body22.SKELETON), bones, turned, hips)
    actual = released._network.normal("positions", positions)
    assert close(actual, oracle["output/local_positions_normalised"]) < 1e-5


def test_their_files_are_seen_and_answered_as_they_see_and_answer_them(released, oracle, real_data):
    source, target = (
        rb.load_motion(real_data / "mixamo_r2et" / name / "Salsa Dancing.bvh")
        for name in ("Ortiz", "Mousey")
    )
    for motion, whose in ((source, "source"), (target, "target")):
        np.testing.assert_allclose(
            features.offsets(motion.character)[1:], oracle[f"input/{whose}_skeleton"][1:], atol=1e-4
        )
        assert features.size(motion.character, "chain") == pytest.approx(
            float(oracle[f"input/{whose}_chain_length"]), rel=1e-5
        )
    rotations = features.rotations(source, released.config.facing)[:120]
    assert np.degrees(rotation.angle(rotations, oracle["input/quaternions"])).max() < 1e-3
    changes = changed(released._network, rotations, source.character, target.character)
    apart = rotation.angle(changes.astype(float), oracle["output/delta_quaternions"].astype(float))
    assert np.degrees(apart).max() < 1e-3  # the height of the hips, told otherwise, changes that little

    answer = released.retarget(source, target.character, context=Context())
    own = answer.rotations[:120, list(Body22.of(target.character).joints)]
    written = np.degrees(rotation.angle(own, oracle["written/quaternions"].astype(float))).max(0)
    compared = [joint for joint in range(1, 22) if joint not in oracle["written/joint_left_alone"]]
    # they turn the hips by another heading, from the first frame alone
    assert written[compared].max() < 1e-3


def test_ratio_of_the_path(oracle, real_data):
    """With the hips as high as in the first frame, the length is that of the authors' inference."""
    character = rb.load_motion(real_data / "mixamo_r2et" / "Ortiz" / "Salsa Dancing.bvh").character
    rows = np.array(oracle["input/source_skeleton"])
    rows[0, 1] = features.offsets(character)[0, 1]
    steps = np.linalg.norm(np.diff(rows[:10], axis=0), axis=-1)
    assert features.size(character, "published") == pytest.approx((steps.sum() - steps[5]) / 100, rel=1e-5)
    ratio = oracle["input/target_height"] / oracle["input/source_height"]
    np.testing.assert_allclose(
        oracle["output/global"][:, :3], oracle["input/global"][:, :3] * ratio, atol=1e-6
    )


# ----------------------------------------------------------------------------------------------- files
def test_their_file_is_weights_like_others(file):
    method = R2ET(weights=str(file))
    assert method.untrained == ""
    assert set(method.tensors) == set(SkeletonAwareNetwork().state_dict())
    assert method.weights_label == f"authors-{method.weights_hash[:8]}"
    assert method.training_manifest == {}  # not known
    assert (
        method._network(torch.zeros(2, 22, 4), *method._network.bones(torch.ones(2, 22, 3)))
        .isfinite()
        .all()
    )


def test_statistics_may_lie_beside_it(file):
    first = R2ET(weights=str(file)).weights_hash
    for each in (file.parent.parent / STATS).iterdir():
        each.rename(file.parent / each.name)
    assert R2ET(weights=str(file)).weights_hash == first


def test_a_constant_of_their_positions_has_deviation_one(file):
    before = R2ET(weights=str(file)).weights_hash
    values = file.parent.parent / STATS / "mixamo_local_motion_std.npy"
    array = np.load(values)
    array[0, 0] = 0.0
    np.save(values, array)
    assert R2ET(weights=str(file)).tensors["scale.positions_deviation"][:3].tolist() == [1.0, 1.0, 1.0]
    assert R2ET(weights=str(file)).weights_hash != before, "results know the bytes of all files"


def test_weights_of_another_network_are_refused(file):
    torch.save({**their_names(), "module.delta_dec.delta_linear.bias": torch.ones(3)}, file)
    with pytest.raises(BenchError, match=r"change\.bias has shape"):
        _ = R2ET(weights=str(file))._network


@pytest.mark.parametrize("number", [np.nan, np.inf])
def test_statistics_that_are_not_finite_are_refused(file, number):
    values = file.parent.parent / STATS / "mixamo_quat_mean.npy"
    np.save(values, np.where(np.arange(88) == 3, number, np.load(values).reshape(-1)))
    with pytest.raises(FileError, match=r"mixamo_quat_mean\.npy: .* not finite"):
        _ = R2ET(weights=str(file)).tensors


def test_missing_files_are_named(file):
    (file.parent.parent / STATS / "mixamo_quat_mean.npy").unlink()
    with pytest.raises(FileError, match=r"lacks the statistics .*mixamo_quat_mean\.npy"):
        _ = R2ET(weights=str(file)).weights_hash
