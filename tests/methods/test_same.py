"""SAME's features beside the authors' arrays and closed forms, and its answers."""

from __future__ import annotations

import numpy as np
import pytest
import same_material
import torch
from method_bodies import dance

from retarget_bench.api import Context
from retarget_bench.errors import BenchError, FileError
from retarget_bench.methods.same import Same, features
from retarget_bench.methods.same.bodies import body, unfit
from retarget_bench.methods.same.features import BEFORE, CHANGE, CONTACT, ROOT, VELOCITY, see
from retarget_bench.methods.same.inference import integrated, retargeted
from retarget_bench.methods.same.released import MODEL, STATISTICS
from retarget_bench.motion import facing, kinematics, rotation, transfer
from retarget_bench.motion.character import Character, Motion
from retarget_bench.motion.skeleton import EndSite, Skeleton
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


def test_bodies_without_hips_are_refused() -> None:
    names, parents = ("Thing", "Other"), np.array([-1, 0])
    offsets = np.array([[0.0, 1.0, 0.0], [0.0, 0.5, 0.0]])
    thing = Character.of(
        "thing", Skeleton(names, parents, offsets, (EndSite(1, (0.0, 0.1, 0.0)),)), roles=(None, None)
    )
    assert "no joint of thing is known as hips" in unfit(thing)
    assert unfit(same_material.BODIES["plain"]) == ""


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
    assert Same.card_of(str(folder))["hash"] == method.weights_hash
    assert Same(weights=str(folder / MODEL)).weights_hash == method.weights_hash  # a file for its folder
    answer = method.retarget(dance(BODIES["plain"]), BODIES["small"], context=Context())
    assert np.isfinite(answer.positions).all()
    stored = torch.load(folder / STATISTICS, weights_only=True)
    torch.save(stored | {"q_m": stored["q_m"] + 1}, folder / STATISTICS)
    assert Same(weights=str(folder)).weights_hash != method.weights_hash


def test_files_that_are_not_the_authors_are_refused_in_a_sentence(tmp_path) -> None:
    statistics = {f"{part}_{kind}": torch.ones(6) for part in ("lo", "go") for kind in "ms"}
    torch.save(statistics, tmp_path / STATISTICS)
    with pytest.raises(FileError, match=f"lacks {MODEL}; SAME needs both"):
        Same(weights=str(tmp_path)).supports(BODIES["plain"], BODIES["small"])
    for wrong, message in (
        ([1, 2], "holds something else than named tensors"),
        ({3: torch.ones(2)}, "holds something else than named tensors"),
        ({"weights": 1}, "holds no network of SAME's"),
        ({"model": {}}, "lacks SAME's statistics q_m, p_m"),
    ):
        torch.save(wrong, tmp_path / MODEL)
        with pytest.raises(FileError, match=message):
            _ = Same(weights=str(tmp_path)).tensors
    torch.save({"model": {"encoder.0.convs.3.bias": torch.full((16,), torch.inf)}}, tmp_path / MODEL)
    with pytest.raises(FileError, match=rf"{MODEL}: encoder\.0\.convs\.3\.bias .*not finite"):
        _ = Same(weights=str(tmp_path)).tensors
    torch.save({"model": {}}, tmp_path / MODEL)
    parts = ("lo", "go", "q", "p", "r", "pv", "qv", "pprev")
    statistics |= {f"{part}_{kind}": torch.ones(6) for part in parts for kind in "ms"}
    torch.save({**statistics, "r_s": torch.full((4,), torch.nan)}, tmp_path / STATISTICS)
    with pytest.raises(FileError, match=f"{STATISTICS}: r_s .*not finite"):
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
