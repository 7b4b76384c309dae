"""SAME: features and network beside the authors' arrays and closed forms, and answers."""

from __future__ import annotations

import numpy as np
import pytest
import same_material
import torch
from method_bodies import dance

from retarget_bench.api import Context
from retarget_bench.errors import BenchError, FileError
from retarget_bench.methods.same import Same, features
from retarget_bench.methods.same.bodies import body
from retarget_bench.methods.same.features import BEFORE, CHANGE, CONTACT, POSITION, ROOT, VELOCITY, see
from retarget_bench.methods.same.graph import Graphs, Nodes, matrices
from retarget_bench.methods.same.inference import integrated, retargeted
from retarget_bench.methods.same.network import Autoencoder, GraphAttention
from retarget_bench.methods.same.released import MODEL, STATISTICS
from retarget_bench.motion import facing, kinematics, rotation, transfer
from retarget_bench.motion.character import Character, Motion
from retarget_bench.motion.skeleton import Skeleton
from retarget_bench.plugins import bound
from retarget_bench.plugins.spec import Spec


@pytest.fixture
def motion() -> Motion:
    return dance(same_material.BODIES["small"])


def moved(motion: Motion, angle: float, by: tuple[float, float, float]) -> Motion:
    turn = rotation.about(np.array([0.0, 1.0, 0.0]), angle)
    rotations = motion.rotations.copy()
    rotations[:, 0] = rotation.multiply(turn, rotations[:, 0])
    return motion.character.motion(rotations, rotation.rotate(turn, motion.root) + by, motion.fps)


# ------------------------------------------------------------------------------------------ the authors'
@pytest.mark.parametrize("pair", same_material.PAIRS)
def test_features_are_the_authors(real_data, pair) -> None:
    arrays = same_material.oracle(real_data)
    source, target = (
        same_material.standing(real_data / "same_pairs" / name) for name in arrays[f"{pair}/files"]
    )
    same_body = body(source.character)
    nodes = same_material.order(list(same_body.skeleton.names), arrays[f"{pair}/source/names"].tolist())
    features = see(same_body, source)[1:41, nodes]
    scale = [
        np.concatenate([arrays[f"stats/{part}_{kind}"] for part in ("q", "p", "r", "pv", "qv", "pprev")])
        for kind in "ms"
    ]
    expected = arrays[f"{pair}/source/features"][..., 6:].copy()
    expected[..., :25] = expected[..., :25] * scale[1] + scale[0]
    for columns in (slice(0, 9), VELOCITY, CHANGE, BEFORE, CONTACT):
        np.testing.assert_allclose(features[..., columns], expected[..., columns], atol=2e-4)
    np.testing.assert_allclose(features[:, 0, ROOT], expected[:, 0, ROOT], atol=1e-4)
    for side, character in (("source", source.character), ("target", target.character)):
        same_body = body(character)
        nodes = same_material.order(list(same_body.skeleton.names), arrays[f"{pair}/{side}/names"].tolist())
        np.testing.assert_allclose(
            same_body.shape[nodes, :3], arrays[f"{pair}/{side}/local_offsets"], atol=1e-4
        )
        np.testing.assert_allclose(
            same_body.shape[nodes, 3:], arrays[f"{pair}/{side}/global_offsets"], atol=1e-4
        )


# -------------------------------------------------------------------------------------------- properties


def test_moves_add_up_to_the_path(motion) -> None:
    turning = rotation.about(np.array([0.0, 1.0, 0.0]), np.linspace(0.3, 9.0, motion.frames))
    rotations = motion.rotations.copy()
    rotations[:, 0] = rotation.multiply(turning, rotations[:, 0])
    spun = motion.character.motion(rotations, motion.root, motion.fps)
    facing = features.twist(transfer.relative(spun)[:, 0])
    moves = see(body(spun.character), spun)[:, 0, ROOT].astype(float)
    angles, hips = integrated(moves, float(features.angle(facing[:1])[0]), transfer.hips(spun)[0])
    np.testing.assert_allclose(hips, transfer.hips(spun), atol=1e-5)
    turned = rotation.about(np.array([0.0, 1.0, 0.0]), angles)
    assert np.degrees(rotation.angle(turned, facing)).max() < 1e-3


def test_low_and_slow_nodes_are_in_contact() -> None:
    motion = moved(dance(same_material.BODIES["small"], 300), 0.0, (0.0, -0.05, 0.0))
    same_body = body(motion.character)
    rotations, hips = same_body.aligned.see(motion)
    places = kinematics.forward(same_body.aligned.skeleton, rotations, hips)[0]
    speed = np.linalg.norm(np.diff(places, axis=0), axis=-1) * 30
    expected = (places[1:, :, 1] < 0.05) & (speed < 0.4)
    features = see(same_body, motion)[1:, : len(same_body.aligned.joints), CONTACT.start]
    assert 0.01 < expected.mean() < 0.5
    np.testing.assert_array_equal(features.astype(bool), expected)


def test_the_first_frame_moves_as_the_second_does(motion) -> None:
    features = see(body(motion.character), motion)
    for columns in (VELOCITY, CHANGE):
        np.testing.assert_array_equal(features[0, :, columns], features[1, :, columns])
    np.testing.assert_array_equal(features[0, 0, 9:12], features[1, 0, 9:12])
    np.testing.assert_allclose(
        features[..., POSITION] - features[..., VELOCITY] / 30.0, features[..., BEFORE], atol=1e-4
    )


def test_twist_leaves_no_turn_about_the_vertical_axis() -> None:
    any_ = rotation.from_rotation_vector(np.random.default_rng(0).normal(size=(50, 3)))
    rest = rotation.multiply(rotation.conjugate(features.twist(any_)), any_)
    assert np.abs(rest[:, 2]).max() < 1e-12
    upside_down = np.array([[0.0, 1.0, 0.0, 0.0]])
    np.testing.assert_array_equal(features.twist(upside_down), [[1, 0, 0, 0]])


# ------------------------------------------------------------------------------------------------ bodies
def test_last_joints_have_tips_and_fingers_are_their_ends() -> None:
    plain = same_material.BODIES["plain"]
    old = plain.skeleton
    hand = old.index("LeftHand")
    names = (*old.names, "LeftHandIndex1", "LeftHandThumb1")
    offsets = np.concatenate([old.offsets, [[0.1, 0.0, 0.0], [0.06, 0.0, 0.04]]])
    fingered = Character.of(
        "fingered", Skeleton(names, np.append(old.parents, [hand, hand]), offsets, old.end_sites)
    )
    same_body = body(fingered)
    assert not any("Index" in name or "Thumb" in name for name in same_body.skeleton.names)
    tip = same_body.skeleton.index("LeftHand tip")
    np.testing.assert_allclose(same_body.skeleton.offsets[tip], [0.08, 0.0, 0.02], atol=1e-6)
    assert not same_body.skeleton.offsets[same_body.skeleton.index("Head tip")].any()
    toe = same_body.skeleton.offsets[same_body.skeleton.index("LeftToeBase tip")]
    np.testing.assert_allclose(toe, [0.0, 0.0, 0.05], atol=1e-6)
    assert same_body.turning.tolist() == [" tip" not in name for name in same_body.skeleton.names]


def test_joints_that_are_tips_have_no_other_behind_them() -> None:
    plain = same_material.BODIES["plain"].skeleton
    head = plain.index("Head")
    names = (*plain.names, "HeadTop_End")
    offsets = np.concatenate([plain.offsets, [[0.0, 0.2, 0.0]]])
    topped = Character.of(
        "topped", Skeleton(names, np.append(plain.parents, head), offsets, plain.end_sites)
    )
    same_body = body(topped)
    assert "HeadTop_End tip" not in same_body.skeleton.names
    assert "Head tip" not in same_body.skeleton.names
    assert same_body.turning[same_body.skeleton.index("Head")]
    assert not same_body.turning[same_body.skeleton.index("HeadTop_End")]


# -------------------------------------------------------------------------------------------------- answers
BODIES = same_material.BODIES


# ------------------------------------------------------------------------------------------ the authors'
@pytest.mark.parametrize("pair", same_material.PAIRS)
def test_the_whole_way_is_the_authors(real_data, tmp_path, pair) -> None:
    """From two files to where all joints are, up to where the path begins; centimetres."""
    arrays = same_material.oracle(real_data)
    source, target = (
        same_material.standing(real_data / "same_pairs" / name) for name in arrays[f"{pair}/files"]
    )
    source = source.at(slice(41))  # the authors leave out the first frame, which has no frame before it
    answer = retargeted(same_material.released(arrays, tmp_path), source, target.character)
    target_names = arrays[f"{pair}/target/names"].tolist()
    names = [name for name in target_names if not name.endswith("_End")]
    expected = arrays[f"{pair}/output/world_positions"][:, [target_names.index(name) for name in names]]
    actual = 100 * answer.positions[1:, [target.skeleton.index(name) for name in names]]
    level = [each - each[:1, :1] * [1, 0, 1] for each in (actual, expected)]
    paths = [(each[..., 2] + 1j * each[..., 0]).ravel() for each in level]
    turn = np.vdot(*paths)
    placed = facing.placed(level[0], turn / abs(turn))
    assert np.linalg.norm(placed - level[1], axis=-1).max() < 0.01


def test_released_files_are_read_and_known_by_what_they_hold(real_data, tmp_path) -> None:
    arrays = same_material.oracle(real_data)
    folder = same_material.write_released(arrays, tmp_path)
    method = Same(weights=str(folder))
    assert method.supports(BODIES["plain"], BODIES["small"]) is None
    assert method.weights_label == f"authors-{method.weights_hash[:8]}"
    assert Same.card_of(str(folder)).hash == method.weights_hash
    assert Same(weights=str(folder / MODEL)).weights_hash == method.weights_hash  # a file for its folder
    answer = method.retarget(dance(BODIES["plain"]), BODIES["small"], context=Context())
    assert np.isfinite(answer.positions).all()
    stored = torch.load(folder / STATISTICS, weights_only=True)
    torch.save(stored | {"q_m": stored["q_m"] + 1}, folder / STATISTICS)
    assert Same(weights=str(folder)).weights_hash != method.weights_hash


def test_files_without_what_same_needs_are_refused_in_a_sentence(tmp_path) -> None:
    parts = ("lo", "go", "q", "p", "r", "pv", "qv", "pprev")
    statistics = {f"{part}_{kind}": torch.ones(6) for part in parts for kind in "ms"}
    few = {name: each for name, each in statistics.items() if name[:2] in ("lo", "go")}
    spoilt = {**statistics, "r_s": torch.full((4,), torch.nan)}
    for model, beside, message in (
        ({"weights": 1}, few, "holds no network of SAME's"),
        ({"model": {}}, few, "lacks SAME's statistics q_m, p_m"),
        ({"model": {}}, spoilt, f"{STATISTICS}: r_s .*not finite"),
    ):
        torch.save(model, tmp_path / MODEL)
        torch.save(beside, tmp_path / STATISTICS)
        with pytest.raises(FileError, match=message):
            _ = Same(weights=str(tmp_path)).tensors


def test_another_network_under_the_authors_names_is_refused(real_data, tmp_path) -> None:
    arrays = dict(same_material.oracle(real_data))
    del arrays["state/encoder.0.convs.3.bias"]
    folder = same_material.write_released(arrays, tmp_path)
    with pytest.raises(BenchError, match=r"encoder\.3\.bias is missing"):
        Same(weights=str(folder)).retarget(dance(BODIES["plain"]), BODIES["small"], context=Context())


# ------------------------------------------------------------------------------------ bodies and lengths
def test_dogs_and_rigs_of_puppets() -> None:
    cast = bound.dataset(Spec.parse("puppets")).built.characters()
    method = same_material.trained()
    for name in ("fox", "hugo", "dora"):
        assert method.supports(cast[name], cast["fox"]) is None
        answer = method.retarget(dance(cast[name], 12), cast["fox"], context=Context())
        assert np.isfinite(answer.positions).all()


# -------------------------------------------------------------------------------------------------- network
NAMES = tuple(same_material.BODIES)


def graphs(*names: str) -> Graphs:
    return Graphs.of([Nodes.of(body(same_material.BODIES[name])) for name in names])


def network() -> Autoencoder:
    return same_material.training_module().network.eval()


def seen(count: int, frames: int = 3, seed: int = 0) -> torch.Tensor:
    return torch.randn(count, frames, 26, generator=torch.Generator().manual_seed(seed))


def relative(answer: torch.Tensor, expected: np.ndarray) -> float:
    return float(np.abs(answer.numpy() - expected).max() / np.abs(expected).max())


# ------------------------------------------------------------------------------------------ the authors'


@pytest.mark.parametrize("pair", same_material.PAIRS)
def test_forward_is_the_authors(real_data, tmp_path, pair) -> None:
    arrays = same_material.oracle(real_data)
    model = same_material.released(arrays, tmp_path)
    inside: dict[str, torch.Tensor] = {}
    for kind, layers in (("encoder", model.encoder), ("decoder", model.decoder)):
        for number, layer in enumerate(layers):
            layer.register_forward_hook(
                lambda _, __, out, name=f"{kind}_conv{number}": inside.update({name: out})
            )
    features = torch.from_numpy(arrays[f"{pair}/source/features"][..., 6:]).transpose(0, 1)
    sides = [Graphs.of([same_material.nodes(arrays, f"{pair}/{side}")]) for side in ("source", "target")]
    with torch.no_grad():
        codes = model.encode(model.scale.restore("pose", features), sides[0])
        answer = model.decode(codes, sides[1])
    assert relative(codes[0], arrays[f"{pair}/output/z"]) < 1e-5
    assert relative(answer.root[0], arrays[f"{pair}/output/r"]) < 1e-5
    assert relative(answer.columns.transpose(0, 1), arrays[f"{pair}/output/q6"]) < 1e-5
    assert relative(answer.contact.T[..., None], arrays[f"{pair}/output/c"]) < 1e-5
    assert len(inside) == 8
    for name, inner_values in inside.items():
        assert relative(inner_values[:, 0], arrays[f"{pair}/between/{name}"]) < 1e-5, name


# ----------------------------------------------------------------------------------------- plain loops
@pytest.mark.parametrize("heads", [1, 3])
def test_attention_is_a_softmax_over_neighbours(heads) -> None:
    torch.manual_seed(0)
    layer = GraphAttention(5, 4, heads)
    torch.nn.init.normal_(layer.bias)
    side = graphs("small")
    inputs = torch.randn(len(side.row), 2, 5)
    with torch.no_grad():
        actual = layer(inputs, side)
        values = layer.linear(inputs).unflatten(-1, (heads, 4)).double()
    near: dict[int, list[int]] = {node: [node] for node in range(len(side.row))}
    for node, other in zip(side.receivers.tolist(), side.senders.tolist(), strict=True):
        near[node].append(other)
    for node, others in near.items():
        for frame in range(2):
            for head in range(heads):
                own = values[node, frame, head] @ layer.asking[head].double()
                logits = torch.stack(
                    [own + values[k, frame, head] @ layer.asked[head].double() for k in others]
                )
                share = torch.softmax(torch.where(logits > 0, logits, 0.2 * logits), 0)
                expected = sum(s * values[k, frame, head] for s, k in zip(share, others, strict=True))
                expected = expected + layer.bias[4 * head : 4 * head + 4]
                torch.testing.assert_close(
                    actual[node, frame, 4 * head : 4 * head + 4].double(),
                    expected.detach(),
                    atol=1e-5,
                    rtol=1e-5,
                )


def test_two_columns_are_a_rotation() -> None:
    rotations = matrices(torch.randn(50, 6, dtype=torch.float64))
    eye = torch.eye(3, dtype=torch.float64).expand(50, -1, -1)
    torch.testing.assert_close(rotations.mT @ rotations, eye)
    torch.testing.assert_close(torch.linalg.det(rotations), torch.ones(50, dtype=torch.float64))
    torch.testing.assert_close(matrices(torch.cat([rotations[..., 0], rotations[..., 1]], -1)), rotations)


# ------------------------------------------------------------------------------------ rows and frames
def test_rows_do_not_see_each_other() -> None:
    model, together = network(), graphs(*NAMES)
    features = seen(len(together.row))
    with torch.no_grad():
        codes = model.encode(features, together)
        answer = model.decode(codes, together)
        for row, name in enumerate(NAMES):
            alone, own = graphs(name), together.row == row
            code = model.encode(features[own], alone)
            torch.testing.assert_close(code[0], codes[row], atol=1e-5, rtol=1e-5)
            one = model.decode(code, alone)
            torch.testing.assert_close(one.columns, answer.columns[own], atol=1e-5, rtol=1e-5)
            torch.testing.assert_close(one.root[0], answer.root[row], atol=1e-3, rtol=1e-5)


def test_what_nodes_say_of_the_hips_moves_is_not_read() -> None:
    model, side = network(), graphs("plain")
    features = seen(len(side.row))
    other = features.clone()
    other[1:, :, 9:13] = 7.0
    with torch.no_grad():
        assert torch.equal(model.encode(features, side), model.encode(other, side))
        other[0, :, 9:13] = 7.0
        assert not torch.equal(model.encode(features, side), model.encode(other, side))
