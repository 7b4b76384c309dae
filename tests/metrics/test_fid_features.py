"""What feature networks see and do not see, how they run, are kept and trained."""

from __future__ import annotations

import json

import numpy as np
import pytest
import torch
from click.testing import CliRunner
from metric_cases import character, sides

from retarget_bench.api import Dataset
from retarget_bench.api.comparison import structure_joints
from retarget_bench.api.completing import complete
from retarget_bench.commands.train import command
from retarget_bench.errors import FileError, NotSupported
from retarget_bench.metrics.fid_structure import SHIPPED
from retarget_bench.motion.character import Character
from retarget_bench.motion.motion import Positions
from retarget_bench.motion.skeleton import Skeleton
from retarget_bench.plugins import registry
from retarget_bench.plugins.spec import Spec
from retarget_bench.training.features import data, network, train, windows

TINY = Spec.parse("puppets[size=tiny]")


@pytest.fixture(scope="module")
def puppets():
    return registry.create("datasets", TINY)


def motion(frames: int = 100, seed: int = 0, fps: float = 30.0) -> Positions:
    """A body that wanders about, smoothly."""
    predicted = sides(frames, seed).predicted
    return Positions(predicted.character, predicted.positions, fps)


def moved(motion: Positions, angle: float, shift: tuple[float, float, float]) -> Positions:
    """Turned about the vertical axis and put elsewhere."""
    c, s = np.cos(angle), np.sin(angle)
    turn = np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])
    return Positions(motion.character, motion.positions @ turn.T + shift, motion.fps)


# --------------------------------------------------------------------------------------------- what is seen
@pytest.mark.parametrize(("angle", "shift"), [(0.7, (3, 0, -8)), (np.pi, (0, 0, 0)), (-2.5, (100, 0, 1))])
def test_place_and_heading_are_not_seen(angle, shift):
    clip = motion()
    values = windows.channels(clip)
    np.testing.assert_allclose(windows.channels(moved(clip, angle, shift)), values, atol=1e-8)


def test_the_height_over_the_floor_is_seen_and_the_floor_may_lie_anywhere():
    clip = motion()
    lifted = windows.channels(moved(clip, 0.0, (0, 0.5, 0)))
    lowered = windows.channels(moved(clip, 0.0, (0, 0.5, 0)), floor=0.5)
    np.testing.assert_allclose(lowered, windows.channels(clip), atol=1e-9)
    assert np.abs(lifted - windows.channels(clip)).max() > 0.1


def test_the_size_of_a_body_is_not_seen():
    clip = motion()
    own = clip.character
    skeleton = Skeleton(own.skeleton.names, own.skeleton.parents, 2.0 * own.skeleton.offsets)
    twice = Character.of("Double", skeleton, roles=own.roles)
    grown = Positions(twice, clip.positions * 2.0, 30.0)
    np.testing.assert_allclose(windows.channels(grown), windows.channels(clip), atol=1e-9)


def straight(speed: float, turning: float = 0.0, frames: int = 90) -> Positions:
    """The rest pose carried along: ahead at a speed, turning."""
    body = character("Human")
    pose = np.zeros((1, len(body.skeleton), 4))
    pose[..., 0] = 1
    still = body.motion(pose, np.zeros((1, 3)), 30.0).positions[0]
    angle = turning * np.arange(frames) / 30
    ahead = np.stack([np.sin(angle), 0 * angle, np.cos(angle)], axis=1)
    path = np.cumsum(ahead, axis=0) * speed / 30
    c, s = np.cos(angle), np.sin(angle)
    x = c[:, None] * still[:, 0] + s[:, None] * still[:, 2]
    z = -s[:, None] * still[:, 0] + c[:, None] * still[:, 2]
    y = np.broadcast_to(still[:, 1], x.shape)
    return Positions(body, np.stack([x, y, z], axis=-1) + path[:, None], 30.0)


def test_the_root_channels_are_speed_ahead_and_yaw_rate():
    """Away from the ends, where smoothing the facing repeats the last frame."""
    clip = straight(1.2, turning=0.5)
    left, ahead, yaw = windows.channels(clip)[35:55, -3:].T
    np.testing.assert_allclose(ahead * clip.character.height, 1.2, rtol=0.01)
    np.testing.assert_allclose(left, 0.0, atol=0.02)
    np.testing.assert_allclose(yaw, 0.5, rtol=1e-6)


def test_gliding_moves_no_joint_in_the_body_but_is_seen():
    still, gliding = windows.channels(straight(0.0)), windows.channels(straight(0.3))
    joints = (still.shape[1] - 3) // 5
    np.testing.assert_allclose(gliding[:, : 3 * joints], still[:, : 3 * joints], atol=1e-9)
    speeds = slice(3 * joints, 4 * joints)
    height = straight(0.0).character.height
    np.testing.assert_allclose(still[:, speeds], np.log(windows.SPEED_OFFSET), atol=1e-6)
    np.testing.assert_allclose(gliding[:, speeds], np.log(windows.SPEED_OFFSET + 0.3 / height), atol=1e-6)


def test_windows_are_cut_every_hop_and_short_clips_have_none():
    values = np.arange(100.0)[:, None]
    cut = windows.windows(values)
    assert cut.shape == (5, 64, 1)
    assert cut[:, 0, 0].tolist() == [0, 8, 16, 24, 32]
    assert windows.windows(values[:63]).shape == (0, 64, 1)
    assert len(windows.speeds(windows.channels(motion(63)))) == 0


def test_other_rates_are_brought_to_thirty_frames_a_second():
    fast = motion(200, fps=60.0)
    np.testing.assert_allclose(
        windows.channels(fast), windows.channels(Positions(fast.character, fast.positions[::2], 30.0))
    )


def test_a_body_without_sides_cannot_be_seen():
    rig = (("a", "", (0.0, 0.0, 0.0)), ("b", "a", (0.0, 50.0, 0.0)), ("c", "b", (0.0, 50.0, 10.0)))
    snake = character("Snake", rig=rig)
    with pytest.raises(NotSupported, match="Snake has neither both upper legs nor both upper arms"):
        windows.channels(snake.positions(np.zeros((70, 3, 3)), 30.0))


# ------------------------------------------------------------------------------------------------ networks
def made_up(channels: int, seed: int = 0) -> tuple[network.Network, train.Autoencoder]:
    """A network with random weights, and the torch module that has the same."""
    torch.manual_seed(seed)
    model = train.Autoencoder(channels).eval()
    random = np.random.default_rng(seed)
    tensors = train._tensors(model, random.normal(size=channels), random.uniform(0.5, 2, channels))
    with torch.no_grad():
        for number, layer in enumerate(model.down):
            layer.weight.copy_(torch.from_numpy(tensors[f"weight_{number}"].astype(np.float32)))
            layer.bias.copy_(torch.from_numpy(tensors[f"bias_{number}"].astype(np.float32)))
    tensors |= {"feature_mean": random.normal(size=256), "feature_scale": random.uniform(1, 2, 256)}
    return network.Network(tensors, network.NetworkCard(structure="made up", roles=[])), model


def test_numpy_encodes_as_torch_does():
    encoder, model = made_up(13)
    cut = np.random.default_rng(1).normal(size=(9, 64, 13)).astype(np.float32)
    scaled = (cut - encoder.tensors["input_mean"]) * encoder.tensors["input_scale"]
    signal = torch.from_numpy(scaled.astype(np.float32))
    with torch.no_grad():
        deep = signal.transpose(1, 2)
        for layer in model.down:
            deep = torch.tanh(layer(deep))
        expected = (deep.mean(dim=2).numpy() - encoder.tensors["feature_mean"]) * encoder.tensors[
            "feature_scale"
        ]
    assert deep.shape == (9, 256, 8)
    np.testing.assert_allclose(encoder.encode(cut), expected, atol=2e-5)


def test_neither_batches_nor_order_matter():
    encoder, _ = made_up(13)
    cut = np.random.default_rng(2).normal(size=(network.BATCH * 2 + 5, 64, 13))
    encoded = encoder.encode(cut)
    order = np.random.default_rng(3).permutation(len(cut))
    np.testing.assert_allclose(encoder.encode(cut[order]), encoded[order], atol=1e-5)
    single = np.concatenate([encoder.encode(cut[at : at + 1]) for at in range(0, len(cut), 20)])
    np.testing.assert_allclose(single, encoded[::20], atol=1e-5)
    assert (encoder.encode(cut) == encoded).all()
    assert encoder.encode(cut[:0]).shape == (0, 256)


def test_a_network_is_read_as_it_was_written(tmp_path):
    encoder, _ = made_up(13)
    written = network.write(tmp_path, encoder.tensors, encoder.card)
    read = network.find(tmp_path, "made up")
    assert read.hash == written.hash
    assert network.find(tmp_path, "another") is None
    cut = np.random.default_rng(4).normal(size=(3, 64, 13))
    assert (read.encode(cut) == encoder.encode(cut)).all()


@pytest.mark.parametrize("damage", ["cut", "swapped", "newer", "no card", "gone"])
def test_a_damaged_network_is_refused_by_name(tmp_path, damage):
    encoder, _ = made_up(13)
    network.write(tmp_path, encoder.tensors, encoder.card)
    card = network.place(tmp_path, "made up")
    weights = card.with_suffix(".safetensors")
    if damage == "cut":
        weights.write_bytes(weights.read_bytes()[:1000])
    elif damage == "gone":
        weights.unlink()
    elif damage == "swapped":
        network.write(tmp_path / "other", made_up(13, seed=1)[0].tensors, encoder.card)
        weights.write_bytes((tmp_path / "other" / weights.name).read_bytes())
    elif damage == "newer":
        card.write_text(json.dumps({**json.loads(card.read_text()), "schema": 99}))
    else:
        card.write_text("{}")
    with pytest.raises(FileError, match="made-up"):
        network.find(tmp_path, "made up")


# ------------------------------------------------------------------------------------------------ training
def test_training_is_repeatable_learns_and_says_what_it_did(tmp_path, puppets):
    (source,) = data.sources(puppets, ["dog21"])
    clips = data.gather(TINY, source, 1, lambda done, total: None)
    steps: list[int] = []
    config = train.FeatureTrainingConfig(steps=12, batch=8)
    facts = {"dataset": str(TINY)}
    one, two = (
        train.train(source, clips, facts, tmp_path / name, config, lambda step, loss: steps.append(step))
        for name in ("one", "two")
    )
    assert steps == [*range(1, 13)] * 2
    assert one.hash == two.hash
    assert one.card.loss[-1]["train"] < 0.9 * one.card.loss[0]["train"]
    assert one.card.recipe["steps"] == 12
    assert one.card.windows > 0 < one.card.validation_windows
    other = train.train(
        source, clips, facts, tmp_path, train.FeatureTrainingConfig(12, 8, seed=1), lambda step, loss: None
    )
    assert other.hash != one.hash
    features = one.encode(np.concatenate([windows.windows(each, config.hop) for each in clips.values()]))
    live = features.std(axis=0) > 0
    assert live.all()
    assert np.abs(features.mean(axis=0)).max() < 0.5
    assert features.std(axis=0) == pytest.approx(1.0, abs=0.3)


def test_what_is_trained_on_is_training_motion_and_no_test_clip(puppets):
    tested = {
        info.clip for split in ("self", "intra", "cross") for info in puppets.cases("retarget", split)
    }
    (source,) = data.sources(puppets, ["dog21"])
    clips = data.gather(TINY, source, 1, lambda done, total: None)
    names = {name.split("/", 1)[1] for name in clips}
    assert names
    assert not names & tested


def test_a_structure_that_is_held_out_borrows_motion_at_the_same_places(puppets):
    held = {each.structure for each in puppets.characters().values()} - set(puppets.training())
    assert held
    for source in data.sources(puppets, sorted(held)):
        assert source.borrowed
        lender = next(c for c in puppets.characters().values() if c.structure == source.lender)
        own = next(c for c in puppets.characters().values() if c.structure == source.structure)
        assert len(set(source.joints)) == len(source.joints) == len(structure_joints(own))
        for joint, role in zip(source.joints, source.roles, strict=True):
            role_of_lender = lender.roles[joint]
            if role and role.startswith(("left", "right")):
                assert role_of_lender == role
            else:
                assert role_of_lender is None or not role_of_lender.startswith(("left", "right"))


def test_without_training_motion_there_is_no_network(puppets):
    class Bare:
        card, label = puppets.card, "bare"

        def characters(self):
            return puppets.characters()

    with pytest.raises(NotSupported, match="bare has no training motion"):
        data.sources(complete(Bare(), Dataset))
    with pytest.raises(NotSupported, match="has no structure 'body99'"):
        data.sources(puppets, ["body99"])


def test_the_command_writes_a_network_and_its_card(tmp_path):
    result = CliRunner().invoke(
        command,
        ["fid[structure=dog21]", "-d", str(TINY), "--budget", "2it", "-o", str(tmp_path), "-j", "1"],
    )
    assert result.exit_code == 0, result.output
    assert result.stdout.startswith("dog21: ")
    assert "3 of 3 bodies" in result.stderr
    written = network.find(tmp_path, "dog21")
    assert written.hash in result.output
    assert written.card.dataset == str(TINY)
    assert written.card.characters


# -------------------------------------------------------------------------------------------- as shipped
CARDS = sorted(SHIPPED.glob("*.json"))


def test_every_structure_of_the_puppets_has_a_network(puppets):
    assert {each.structure for each in puppets.characters().values()} == {path.stem for path in CARDS}


@pytest.mark.parametrize("card", CARDS, ids=lambda path: path.stem)
def test_a_shipped_network_is_small_whole_and_fits_its_structure(card, puppets):
    shipped = network.find(SHIPPED, card.stem)
    assert network.place(SHIPPED, card.stem).with_suffix(".safetensors").stat().st_size < 2_000_000
    facts = shipped.card
    bodies = [each for each in puppets.characters().values() if each.structure == card.stem]
    assert [shipped.unfit(body) for body in bodies] == [""] * len(bodies)
    assert facts.features == 256
    assert facts.loss[-1]["validation"] < 0.6  # of 1, what predicting the mean would leave
    assert set(facts.characters) <= set(puppets.training_manifest()["characters"])
    assert bool(facts.note) == (card.stem not in puppets.training())
