"""nkn and nkn_cross: what they learn from, motions as they see them and back, and their answers."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import torch
from method_bodies import apart, body, carried, dance, elsewhere, without
from nkn_toys import CAST, STRUCTURES, structured, training_data, training_module
from scipy.spatial.transform import Rotation
from training_material import batch

from retarget_bench.api import Context
from retarget_bench.errors import BenchError, NotSupported
from retarget_bench.methods.nkn import plugin
from retarget_bench.methods.nkn_cross import plugin as NknCross
from retarget_bench.motion import facing, rotation
from retarget_bench.motion.character import Character
from retarget_bench.motion.motion import Motion
from retarget_bench.motion.skeleton import Skeleton
from retarget_bench.training.config import TrainingConfig
from retarget_bench.training.layers.kinematic.features import Path, Sight, answer, begin, cleaned
from retarget_bench.training.layers.kinematic.retargeter import Cases
from retarget_bench.training.phases import to_device

SMALL = {"hidden": 16, "facing": 3.0, "drift": 0.0, "lengths": "world"}


@pytest.fixture(scope="module")
def method():
    """One with weights that make it move."""
    module = training_module(plugin(**SMALL))
    for each in module.modules["generator"].parameters():
        each.data += 0.1 * torch.randn_like(each)
    return module.method()


# ------------------------------------------------------------------------------------------- learning
def test_terms_of_the_ablations():
    every = {"same_places", "same_moves", "twist", "smooth"}
    cycle = every | {"cycle_places", "cycle_moves"}
    for losses, expected, phases in (
        ("autoencoder", every, 1),
        ("cycle", cycle, 1),
        ("adversarial", cycle | {"adversarial"}, 2),
    ):
        module = training_module(plugin(losses=losses, **SMALL))
        now = batch(module)
        assert set(module.losses("generator", now, {})) == expected
        assert len(module.phases) == phases
        assert ("real" in now["groups"][0]) == (phases == 2)
        assert bool(now["groups"][0]["same"].all()) == (losses == "autoencoder")
    assert "drift" in training_module(plugin(**{**SMALL, "drift": 0.1})).losses("generator", now, {})


def test_only_rows_of_the_same_body_are_compared_with_their_source():
    other_bodies = training_module(plugin(same=0.0, **SMALL))
    terms = other_bodies.losses("generator", batch(other_bodies), {})
    assert terms["same_places"].item() == terms["same_moves"].item() == 0.0
    same_bodies = training_module(plugin(same=1.0, **SMALL))
    memory: dict = {}
    assert same_bodies.losses("generator", batch(same_bodies), memory)["same_places"].item() > 0.0
    assert not memory["fakes"]
    assert same_bodies.losses("discriminator", batch(same_bodies), memory) == {}


def test_presets_are_the_papers_and_smaller_ones():
    paper = plugin.presets["paper"]
    assert (paper.steps, paper.batch, paper.window, paper.rate) == (50_000, 16, 60, 1e-4)
    assert set(plugin.presets) == {"paper", "default"}


# ---------------------------------------------------------------------------------------- retargeting


def test_a_stream_keeps_no_more_of_a_long_clip_than_of_a_frame(method):
    sight, sizes = method.see(dance(CAST["one"], 60)), []
    for frames in (1, 60):
        stream = method.stream(Cases([CAST["one"]], [CAST["long"]]))
        stream.advance(*(each[:frames, None] for each in (sight.poses, sight.turn, sight.hips)))
        sizes.append(sum(each.untyped_storage().nbytes() for each in stream.held()))
    assert sizes[0] == sizes[1] == 4 * (4 * SMALL["hidden"] + 70 + 1)


def test_yaw_of_the_source_is_kept_if_asked(method):
    source = dance(CAST["one"])
    tensors = method.tensors
    own = plugin(**SMALL, yaw="source").using(tensors)
    sight = own.see(source)
    stream = own.stream(Cases([source.character], [CAST["long"]]))
    _, turn, _ = stream.advance(*(each[:, None] for each in (sight.poses, sight.turn, sight.hips)))
    np.testing.assert_array_equal(turn[:, 0], sight.turn)
    assert apart(carried(own, source, CAST["long"]), carried(method, source, CAST["long"])) > 1e-3


def test_clean_up_takes_signs_from_the_source(method):
    source = dance(CAST["one"])
    cleaned = plugin(**SMALL, clean=True, yaw="source", path="integrated")
    clean = carried(cleaned.using(method.tensors), source, CAST["long"])
    sight = method.see(source)
    rises = np.diff(clean.root[:, 1])
    expected = sight.poses[1:, 67]
    assert (np.sign(rises[np.abs(rises) > 1e-9]) == np.sign(expected[np.abs(rises) > 1e-9])).all()
    assert not rises[np.abs(expected) <= 0.01].any()


# -------------------------------------------------------------------------------------------- refusals
def test_bodies_that_are_not_like_the_22_joints_are_refused_with_a_reason(method):
    armless = without(CAST["one"], "LeftHand")
    assert "left_hand" in method.supports(armless, CAST["one"])
    with pytest.raises(NotSupported, match="left_hand"):
        carried(method, dance(armless), CAST["one"])
    assert method.supports(CAST["one"], CAST["small"]) is None


def test_a_learned_method_of_bodies_of_any_structure():
    """Structures do not matter to nkn, the 22 joints do."""
    mixed = {"one": CAST["one"], "other": structured(body(spines=4), "other", "more spine")}
    module = training_module(plugin(**SMALL), cast=mixed)
    assert list(module.modules["generator"]) == ["body22"]


# ------------------------------------------------------------------------------------------------- features
NKN = plugin(facing=5.0, lengths="world")


def at_thirty(motion: Motion, frames: int) -> Motion:
    """So many frames at 30 per second, the last of which may be beyond the end."""
    at = np.minimum(np.arange(frames) * motion.fps / 30.0, motion.frames - 1)
    low = np.minimum(at.astype(int), max(motion.frames - 2, 0))
    high = np.minimum(low + 1, motion.frames - 1)
    turns = rotation.slerp(motion.rotations[low], motion.rotations[high], (at - low)[:, None])
    return motion.character.motion(turns, motion.root[low], 30.0)


def back(motion: Motion, sight: Sight, unit: float = 0.01) -> Motion:
    """The motion from its movements and its own local rotations."""
    nkn_body = NKN.body(motion.character)
    turns, _ = nkn_body.see(at_thirty(motion, len(sight.poses)))
    path = Path(np.array([unit]))
    turn, hips = path.follow(sight.poses[:, None, -4:], sight.turn[:, None], sight.hips[:, None])
    turns[:, 0] = rotation.multiply(rotation.conjugate(facing.rotation(sight.turn)), turns[:, 0])
    return answer(nkn_body, turns, turn[:, 0], hips[:, 0], motion.frames, motion.fps)


@pytest.mark.parametrize("lengths", ["world", "body"])
@pytest.mark.parametrize("name", CAST)
def test_movements_and_rotations_give_the_motion_back(name, lengths):
    method = plugin(facing=5.0, lengths=lengths)
    motion = elsewhere(dance(CAST[name]), 40.0, (2.0, 0.3, -1.0))
    unit = 0.01 if lengths == "world" else CAST[name].measures.hip_height / 90.0
    assert apart(back(motion, method.see(motion), unit), motion) < 1e-5


def test_places_are_those_of_the_joints_seen_from_where_the_body_faces():
    motion = dance(CAST["one"])
    sight, nkn_body = NKN.see(motion), NKN.body(CAST["one"])
    places = motion.positions[:, list(nkn_body.joints)]
    yaw = np.angle(sight.turn)
    for frame in (0, 7, 39):
        local = Rotation.from_euler("Y", -yaw[frame]).apply(places[frame] - places[frame, 0]) * 100.0
        local[0, 1] = 100.0 * (places[frame, 0, 1] - places[0, 0, 1])
        np.testing.assert_allclose(sight.poses[frame, :66].reshape(22, 3), local, atol=1e-3)
        if frame:
            step = Rotation.from_euler("Y", -yaw[frame]).apply(places[frame, 0] - places[frame - 1, 0])
            np.testing.assert_allclose(sight.poses[frame, 66:69], 100.0 * step, atol=1e-3)
            turn = (yaw[frame] - yaw[frame - 1] + np.pi) % (2 * np.pi) - np.pi
            assert sight.poses[frame, 69] == pytest.approx(turn, abs=1e-5)
    np.testing.assert_array_equal(sight.poses[0, 66:], sight.poses[1, 66:])


def test_own_lengths_make_scaled_bodies_the_same():
    method = plugin(lengths="body")
    motions = [dance(body(scale=scale)) for scale in (1.0, 1.7)]
    motions[1] = replace(motions[1], root=1.7 * motions[0].root)
    a, b = (method.see(motion).poses for motion in motions)
    np.testing.assert_allclose(a, b, atol=1e-3)
    np.testing.assert_allclose(*(method.bones(motion.character) for motion in motions), atol=1e-3)
    assert np.abs(NKN.see(motions[0]).poses - NKN.see(motions[1]).poses).max() > 1.0


@pytest.mark.parametrize("fps", [24.0, 25.0, 30.0, 60.0, 1 / 0.016667, 59.94, 120.0])
@pytest.mark.parametrize("frames", [1, 2, 61, 100])
def test_rates_keep_the_number_of_frames_and_the_motion(fps, frames):
    slow = dance(CAST["one"], 400)
    motion = replace(slow.at(slice(0, frames)), fps=fps)
    result = back(motion, NKN.see(motion))
    # in between, joints are taken to move straight on and the last moment may lie beyond the clip
    assert (result.frames, result.fps) == (frames, fps)
    assert apart(result.at(slice(0, max(frames - 4, 1))), motion.at(slice(0, max(frames - 4, 1)))) < 0.005


def test_a_window_begins_at_its_own_height():
    poses = np.random.default_rng(0).normal(size=(2, 5, 70)).astype(np.float32)
    window = begin(poses)
    assert window[:, 0, 1].tolist() == [0.0, 0.0]
    np.testing.assert_allclose(np.diff(window[..., 1]), np.diff(poses[..., 1]), atol=1e-6)
    np.testing.assert_array_equal(np.delete(window, 1, -1), np.delete(poses, 1, -1))


def source_path(frames: int, rows: int = 2) -> tuple[np.ndarray, np.ndarray]:
    """Directions ``(frames, rows)`` that turn several times about, and hips ``(frames, rows, 3)``."""
    numbers = np.random.default_rng(2)
    turn = np.exp(1j * np.cumsum(numbers.normal(0.2, 0.3, (frames, rows)), axis=0))
    return turn, np.cumsum(numbers.normal(0.01, 0.01, (frames, rows, 3)), axis=0)


@pytest.mark.parametrize("yaw", ["predicted", "source"])
@pytest.mark.parametrize("kind", ["integrated", "relative"])
def test_a_path_goes_on_where_its_last_chunk_ended(kind, yaw):
    moves, (turn, hips) = np.random.default_rng(1).normal(size=(11, 2, 4)), source_path(11)
    complete, path = (Path(np.array([0.01, 0.02]), kind, yaw) for _ in range(2))
    at_once = complete.follow(moves, turn, hips)
    parts = [
        path.follow(moves[part], turn[part], hips[part])
        for part in (slice(0, 1), slice(1, 7), slice(7, 11))
    ]
    for k in (0, 1):
        joined = np.concatenate([part[k] for part in parts])
        if kind == "relative":
            np.testing.assert_array_equal(joined, at_once[k])
        else:
            np.testing.assert_allclose(joined, at_once[k], atol=1e-12)
    np.testing.assert_allclose(at_once[1][0], hips[0], atol=1e-12)  # the first frame moves nothing


@pytest.mark.parametrize("kind", ["integrated", "relative"])
def test_the_movements_of_the_source_give_its_path(kind):
    turn, hips = source_path(400)
    steps = facing.seen(np.diff(hips, axis=0, prepend=hips[:1]), turn)
    turns = np.angle(turn * np.concatenate([turn[:1], turn[:-1]]).conj())
    path = Path(np.ones(2), kind).follow(np.concatenate([steps, turns[..., None]], -1), turn, hips)
    np.testing.assert_allclose(path[0], turn, atol=1e-9)
    np.testing.assert_allclose(path[1], hips, atol=1e-9)


def test_the_published_path_is_the_plain_sum_of_movements():
    moves, (turn, hips) = np.random.default_rng(3).normal(size=(50, 2, 4)), source_path(50)
    path = Path(np.array([0.01, 0.02])).follow(moves, turn, hips)
    moves[0] = 0.0
    faced = turn[0] * np.exp(1j * np.cumsum(moves[..., 3], axis=0))
    steps = facing.placed(moves[..., :3] * np.array([[0.01], [0.02]]), faced)
    np.testing.assert_array_equal(path[0], faced)
    np.testing.assert_array_equal(path[1], hips[0] + np.cumsum(steps, axis=0))


def test_cleaned_movements_have_the_sources_sign_and_do_not_rise_alone():
    moves = np.array([[1.0, -2.0, 3.0, -0.5], [-1.0, 2.0, 3.0, 0.5]])
    source = np.array([[-4.0, 0.5, 0.0, -0.1], [1.0, 0.005, -2.0, 0.1]])
    assert cleaned(moves, source).tolist() == [[-1.0, 2.0, 0.0, -0.5], [1.0, 0.0, -3.0, 0.5]]


# --------------------------------------------------------------------------------------- between structures
NARROW = {"hidden": 12, "facing": 3.0}


@pytest.fixture(scope="module")
def module():
    return training_module(NknCross(**NARROW), cast=STRUCTURES)


def test_groups_mix_all_pairs_of_structures_and_keep_the_share_of_own_bodies(module):
    pairs, own, rows = set(), 0, 0
    for step in range(60):
        groups = batch(module, rows=5, seed=step)["groups"]
        assert [len(group["same"]) for group in groups] == [3, 2]
        for group in groups:
            pairs.add(tuple(group["structures"]))
            assert group["poses"].shape[-1] == (76, 70)[group["structures"][0]]
            assert group["target_bones"].shape[1] == (24, 22)[group["structures"][1]]
            own, rows = own + int(group["same"].sum()), rows + len(group["same"])
    assert pairs == {(0, 0), (0, 1), (1, 0), (1, 1)}
    assert own / rows == pytest.approx(0.2, abs=0.09)  # 2.2 standard errors and more: the seeds are fixed


def test_rows_of_two_structures_are_not_compared(module):
    crossing = next(
        group
        for step in range(20)
        for group in batch(module, seed=step)["groups"]
        if group["structures"][0] != group["structures"][1]
    )
    terms = module.losses("generator", {"groups": [crossing]}, {})
    assert terms["same_places"].item() == terms["same_moves"].item() == 0.0
    assert terms["cycle_places"].item() > 0.0
    assert terms["adversarial"].item() > 0.0


def test_terms_have_the_same_names_whatever_was_drawn(module):
    """Several processes put them together."""
    names = {tuple(sorted(module.losses("generator", batch(module, seed=step), {}))) for step in range(8)}
    assert len(names) == 1


def test_other_structures_and_other_joints_are_refused_with_a_reason(module):
    method = module.method()
    stranger = structured(body(spines=5, shin=0.6), "stranger", "five.spine")
    assert method.supports(STRUCTURES["one"], stranger) is None
    four = structured(body(spines=4), "four", "four")
    assert "these weights know five_spine, three" in method.supports(STRUCTURES["one"], four)
    fake = structured(body(spines=4), "fake", "three")
    assert "other joints" in method.supports(fake, STRUCTURES["one"])
    with pytest.raises(NotSupported, match="know five_spine"):
        method.retarget(dance(four), STRUCTURES["one"], context=Context())


def test_one_structure_with_two_sets_of_joints_cannot_be_trained():
    cast = {"one": STRUCTURES["one"], "odd": structured(body(spines=4), "odd", "three")}
    with pytest.raises(NotSupported, match="one of them another structure"):
        NknCross(**NARROW).training_module(
            training_data(NknCross(**NARROW), cast), TrainingConfig(1, 4, 16, 1e-3)
        )


def test_weights_of_other_structures_are_not_taken_over(module):
    with pytest.raises(BenchError, match="other structures"):
        module.load(
            training_module(NknCross(**NARROW), cast={k: STRUCTURES[k] for k in ("one", "long")}).export()
        )


def test_structures_say_who_is_trained_on():
    method = NknCross(structures="three+four")
    assert not method.unfit(STRUCTURES["one"])
    assert "five.spine" in method.unfit(STRUCTURES["bendy"])
    assert not NknCross(structures="all").unfit(STRUCTURES["bendy"])


def test_the_hips_come_first_and_joints_above_them_are_left_out():
    full = body().skeleton
    above = Skeleton(
        ("World", *full.names),
        np.array([-1, 0, *(full.parents[1:] + 1)]),
        np.concatenate([np.zeros((1, 3)), full.offsets]),
    )
    nkn_body = NknCross().body(Character.of("above", above))
    assert nkn_body.joints == tuple(range(1, len(full) + 1))


@pytest.mark.parametrize("name", ["one", "bendy"])
def test_ends_are_seen_in_lengths_of_their_chains(module, name):
    """As far from the hips as in the motion, over the bones in between at rest."""
    character, other = STRUCTURES[name], STRUCTURES["bendy" if name == "one" else "one"]
    motion = dance(character)
    poses = torch.from_numpy(NknCross(**NARROW).see(motion).poses)[:, None]
    joints, lengths = module.ends.shares([name], [other.name])[0]
    scaled = module.ends.scaled(poses, [(torch.from_numpy(joints), torch.from_numpy(lengths))], 0)
    body = NknCross(**NARROW).body(character)
    for number, joint in enumerate(body.joints[index] for index in joints):
        chain, at = 0.0, joint
        while at != body.joints[0]:
            chain, at = (
                chain + np.linalg.norm(character.skeleton.offsets[at]),
                character.skeleton.parents[at],
            )
        away = np.linalg.norm(motion.positions[:, joint] - motion.positions[:, body.joints[0]], axis=-1)
        assert torch.linalg.norm(scaled[:, 0, number], dim=-1).numpy() == pytest.approx(
            away / chain, rel=1e-4
        )
    assert len(joints) == 9


def test_ends_count_between_structures_alone(module):
    terms = {own: _ends_term(module, own) for own in (True, False)}
    assert terms[True] == (0.0, 0.0)
    assert min(terms[False]) > 0.0
    assert training_module(NknCross(**NARROW, ends=0.0), cast=STRUCTURES).ends is None


def _ends_term(module, own: bool) -> tuple[float, float]:
    for seed in range(50):
        drawn = module.draw(np.random.default_rng(seed), 2)
        if all((group["structures"][0] == group["structures"][1]) == own for group in drawn["groups"]):
            losses = module.losses("generator", to_device(drawn, torch.device("cpu")), {})
            return float(losses["ends"]), float(losses["ends_moves"])
    raise LookupError("no such batch was drawn")


@pytest.mark.parametrize("same", [0.7, 1.0])
def test_more_own_bodies_than_own_structures_would_be(same):
    module = training_module(NknCross(**NARROW, same=same), cast=STRUCTURES)
    groups = [group["same"] for step in range(150) for group in batch(module, rows=5, seed=step)["groups"]]
    # a group is of one kind here: 2.2 standard errors of 300 of them
    assert np.concatenate(groups).mean() == pytest.approx(same, abs=0.06 if same < 1 else 0)
