"""Paired: poses by goals, augmentation, training on pairs, and answers."""

from collections.abc import Mapping, Sequence

import numpy as np
import pytest
import torch
from torch import Tensor

from retarget_bench.api import Case, Context
from retarget_bench.methods.paired import Paired, augmentation, pose
from retarget_bench.methods.paired.features import BODY22, RoleBody, near
from retarget_bench.methods.paired.inference import RootRule, retargeted
from retarget_bench.methods.paired.network import Corrector, copy_of, goals_of, inputs_of
from retarget_bench.methods.paired.training import PairedTraining
from retarget_bench.motion import rotation, transfer
from retarget_bench.motion.body22 import PARENTS
from retarget_bench.motion.character import Character
from retarget_bench.motion.motion import Motion
from retarget_bench.motion.roles import SIDES
from retarget_bench.plugins import bound, registry
from retarget_bench.plugins.spec import Spec
from retarget_bench.training import pair_data
from retarget_bench.training.data import ClipArrays, TrainingData
from retarget_bench.training.pair_data import gather_pairs
from tests.in_process import carried_out_here

PUPPETS = Spec.parse("puppets")
Row = dict[str, dict[str, Tensor]]


@pytest.fixture(scope="module")
def material() -> TrainingData:
    """Three performances, each by all bodies that are able to do it."""
    pairs = bound.dataset(PUPPETS).built.training_pairs()
    assert pairs is not None
    clips: dict[str, list[ClipArrays]] = {}
    characters: dict[str, Character] = {}
    for first in (0, pairs.together, 2 * pairs.together):
        for number in range(pairs.together):
            source = pairs[first + number].source.motion
            name = source.character.name
            if all(clip.name != pairs[first].clip for clip in clips.get(name, [])):
                characters[name] = source.character
                arrays = RoleBody(source.character).see(source)
                clips.setdefault(name, []).append(ClipArrays(name, pairs[first].clip, arrays))
    return TrainingData(characters, clips)


@pytest.fixture
def training(material: TrainingData) -> PairedTraining:
    torch.manual_seed(0)
    method = Paired()
    return method.training_module(material, method.presets["default"])


def batch(training: PairedTraining, rows: int = 4, seed: int = 1) -> Row:
    drawn = training.draw(np.random.default_rng(seed), rows)
    return {key: {name: torch.from_numpy(a) for name, a in each.items()} for key, each in drawn.items()}


def loosened(network: Corrector, size: float = 0.05) -> Corrector:
    """A network whose corrections are not zero."""
    with torch.no_grad():
        network.leave.weight.normal_(0, size, generator=torch.Generator().manual_seed(3))
        network.path.weight.normal_(0, size, generator=torch.Generator().manual_seed(4))
    return network


# ------------------------------------------------------------------------------------------------ poses


def test_limbs_meet_goals_in_reach_and_keep_their_bones(training: PairedTraining) -> None:
    row = {
        k: {n: a.double() if a.is_floating_point() else a for n, a in v.items()}
        for k, v in batch(training).items()
    }
    bodies, network = (row["source"], row["target"]), loosened(training.network).double()
    correction = network(*inputs_of(network, row["motion"], *bodies), row["real"]["frames"])
    correction = correction._replace(limbs=0.2 * correction.limbs)
    start = copy_of(network, correction.scale, row["motion"], *bodies)
    goals = goals_of(correction, start, row["motion"]["turn"], row["target"])
    answer = pose.posed(network.tree, row["motion"]["rotations"], row["target"]["offsets"], goals)
    upper = answer.positions[:, :, pose.UPPER]
    expected = torch.cat([goals.feet, upper[:, :, pose.ARMS] + goals.hands], 2)
    lengths = row["target"]["offsets"].norm(dim=-1)
    reach = (lengths[:, pose.LOWER] + lengths[:, pose.END])[:, None]
    far = (expected - upper).norm(dim=-1)
    reachable = (far < 0.99 * reach) & (far > 0.2 * reach)
    missed = (answer.positions[:, :, pose.END] - expected).norm(dim=-1)
    assert reachable.float().mean() > 0.5
    assert missed[reachable].max() < 1e-6
    bones = torch.stack(
        [
            answer.positions[:, :, j] - answer.positions[:, :, max(PARENTS[j], 0)]
            for j in range(len(BODY22))
        ],
        2,
    ).norm(dim=-1)
    assert torch.allclose(bones, lengths[:, None].expand_as(bones), atol=1e-6)


def test_a_goal_out_of_reach_is_pointed_at() -> None:
    upper, lower = torch.tensor([[0.0, -0.4, 0.0]]), torch.tensor([[0.0, -0.4, 0.05]])
    goal, axis = torch.tensor([[0.3, -2.0, 0.4]]), torch.tensor([[1.0, 0.0, 0.0]])
    swing, fold = pose.bend(upper, lower, goal, axis, torch.zeros(1))
    end = pose.rotate(swing, upper) + pose.rotate(fold, lower)
    assert torch.allclose(end / end.norm(), goal / goal.norm(), atol=1e-3)
    assert 0.99 < float(end.norm() / (upper.norm() + lower.norm())) <= 1.0 + 1e-6


# ------------------------------------------------------------------------------------------ augmentation
def positions(motion: Mapping[str, Tensor], offsets: Tensor) -> np.ndarray:
    tensors = [each[None] for each in (motion["rotations"], motion["hips"], offsets)]
    return pose.copied(Corrector().tree, *tensors).positions[0].numpy()


def performed(material: TrainingData, name: str) -> tuple[dict[str, Tensor], Tensor]:
    """A motion and the bones of a body."""
    arrays = material.clips[name][0].arrays
    motion = {key: torch.from_numpy(np.array(each)) for key, each in arrays.items()}
    return motion, torch.from_numpy(RoleBody(material.characters[name]).offsets)


def test_mirrored_motion_is_the_mirror_image(material: TrainingData) -> None:
    motion, offsets = performed(material, min(material.clips))
    image = positions(augmentation.mirrored(motion), augmentation.mirrored_bones(offsets))
    other = [BODY22.index(_other_side(role)) for role in BODY22]
    assert np.allclose(image, positions(motion, offsets)[:, other] * [-1, 1, 1], atol=1e-5)
    again = augmentation.mirrored(augmentation.mirrored(motion))
    assert all(torch.equal(again[key], motion[key]) for key in motion)


def _other_side(role: str) -> str:
    left, right = role.startswith("left"), role.startswith("right")
    return role.replace("left", "right") if left else role.replace("right", "left") if right else role


def test_another_reference_pose_moves_nothing(material: TrainingData) -> None:
    for seed, name in enumerate(sorted(material.clips)):
        motion, offsets = performed(material, name)
        vectors = 0.2 * np.random.default_rng(seed).normal(size=(22, 3))
        turned = torch.from_numpy(rotation.from_rotation_vector(vectors)).float()
        reposed, bones = augmentation.reposed(motion["rotations"], offsets, turned)
        moved = positions({**motion, "rotations": reposed}, bones)
        assert np.allclose(moved, positions(motion, offsets), atol=1e-5)
        assert (bones - offsets).abs().max() > 0.01
        lacking = [joint for joint in range(1, len(BODY22)) if not offsets[joint].any()]
        assert np.allclose(reposed[:, lacking], [1, 0, 0, 0], atol=1e-6)


def test_a_body_without_joints_keeps_the_others_where_those_did_not_turn(material: TrainingData) -> None:
    motion, offsets = performed(material, min(material.clips))
    lacks = torch.from_numpy(augmentation.missing(list(augmentation.SPARED)))
    motion["rotations"][:, lacks] = torch.tensor([1.0, 0.0, 0.0, 0.0])
    less, bones = augmentation.without(motion, offsets, lacks)
    there = ~lacks.numpy()
    assert np.allclose(positions(less, bones)[:, there], positions(motion, offsets)[:, there], atol=1e-5)
    assert not bones[lacks].any()
    assert not less["planted"][:, [1, 3]].any()


def test_rows_of_a_batch_are_drawn_as_each_alone(material: TrainingData) -> None:
    """Changes of many rows at once are those of each."""
    names = sorted(material.clips)[:3]
    rows = [performed(material, name) for name in names]
    rows = [({key: each[:30] for key, each in motion.items()}, bones) for motion, bones in rows]
    together = {key: torch.stack([motion[key] for motion, _ in rows]) for key in rows[0][0]}
    bones = torch.stack([each for _, each in rows])
    turned = augmentation.turns(np.random.default_rng(0), len(rows))
    spared = [[], ["toes", "neck"], ["spine"]]
    lacks = torch.from_numpy(np.stack([augmentation.missing(each) for each in spared]))
    turns, moved_bones = augmentation.reposed(together["rotations"], bones, turned)
    less, fewer = augmentation.without({**together, "rotations": turns}, moved_bones, lacks)
    for row, (motion, own) in enumerate(rows):
        alone, alone_bones = augmentation.reposed(motion["rotations"], own, turned[row])
        expected, without = augmentation.without({**motion, "rotations": alone}, alone_bones, lacks[row])
        assert torch.allclose(fewer[row], without, atol=1e-6)
        assert all(torch.allclose(less[key][row], expected[key], atol=1e-6) for key in expected)


def test_a_window_of_one_body_is_its_own_target(training: PairedTraining) -> None:
    drawn = training.draw(np.random.default_rng(3), 60)
    same = [
        all(np.array_equal(drawn["source"][key][row], drawn["target"][key][row]) for key in drawn["source"])
        for row in range(60)
    ]
    assert 0 < sum(same) < 20
    for row in np.flatnonzero(same):
        assert all(
            np.array_equal(drawn["motion"][key][row], drawn["truth"][key][row]) for key in drawn["motion"]
        )


def test_no_training_body_has_the_joints_of_the_held_out_structure() -> None:
    numbers = np.random.default_rng(0)
    drawn = [set(augmentation.spare(numbers)) for _ in range(2000)]
    assert {"toes", "collar bones"} in [each - {"neck"} for each in drawn]
    assert not any({"toes", "collar bones", "spine"} <= each for each in drawn)


def test_some_reference_poses_are_left_as_they_are() -> None:
    numbers = np.random.default_rng(0)
    drawn = augmentation.turns(numbers, 500).double().numpy()
    angles = rotation.angle(drawn, rotation.identity(1))
    assert 0.15 < (angles.max(-1) < 1e-6).mean() < 0.25
    assert 2.0 < np.degrees(angles).mean() < 6.0


# ------------------------------------------------------------------------------------------------ training


def test_pairs_are_gathered_by_performance(material: TrainingData, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(pair_data, "carried_out", carried_out_here)
    data = gather_pairs(PUPPETS, Spec.parse("paired"), 30.0, 1, lambda done, total: None)
    lengths: dict[str, set[int]] = {}
    bodies: dict[str, int] = {}
    for clips in data.clips.values():
        for clip in clips:
            lengths.setdefault(clip.name, set()).add(clip.frames)
            bodies[clip.name] = bodies.get(clip.name, 0) + 1
    assert all(len(each) == 1 for each in lengths.values())
    assert max(bodies.values()) > 3
    assert not any(character.four_legged for character in data.characters.values())
    for name, clips in material.clips.items():
        same = {clip.name: clip for clip in data.clips[name]}
        for clip in clips:
            assert all(np.array_equal(same[clip.name].arrays[k], clip.arrays[k]) for k in clip.arrays)


def test_training_bodies_are_told_as_they_are_and_others_as_the_nearest(training: PairedTraining) -> None:
    figures = training.network.figures
    offsets, lengths = (torch.from_numpy(each)[None] for each in next(iter(training._bodies.values())))
    assert torch.allclose(figures({"offsets": offsets, "lengths": lengths}).offsets, offsets, atol=1e-6)
    odd = offsets.clone()
    knee = BODY22.index("left_leg")
    odd[0, knee] = torch.tensor([0.3, -3.0, 0.0])
    described = figures({"offsets": odd, "lengths": lengths})
    longest = training.network.figures.lengths[0, 1, knee] * lengths[0, 0]
    assert torch.allclose(described.offsets[0, knee], torch.tensor([0.0, -1.0, 0.0]) * longest, atol=1e-6)
    assert (described.level(described.ankle + described.drop) * described.height).allclose(
        described.drop * described.stretch
    )


def test_padding_changes_nothing(training: PairedTraining) -> None:
    row, network = batch(training, rows=2), loosened(training.network)
    bodies = row["source"], row["target"]
    short = {name: each[:, :40] for name, each in row["motion"].items()}
    longer = {name: torch.cat([each, 3 * torch.ones_like(each[:, :24])], 1) for name, each in short.items()}
    alone = network(*inputs_of(network, short, *bodies), torch.ones(2, 40, dtype=torch.bool))
    real = torch.arange(64).expand(2, 64) < 40
    padded = network(*inputs_of(network, longer, *bodies), real)
    for one, other in zip(alone[:-1], padded[:-1], strict=True):
        assert torch.allclose(one, other[:, :40], atol=1e-6)


# ------------------------------------------------------------------------------------------------ answers
def test_without_correction_it_is_ik_that_does_not_mind_hands() -> None:
    """Cuts, the rule of the path and held feet are those of ik; only limbs are bent once more."""
    case = _case()
    again = _moved(case.source, [3.0, 0.0, 1.0])
    pairs = [(each.rotations, each.root) for each in (case.source, again)]
    twice = [np.concatenate(each) for each in zip(*pairs, strict=True)]
    source = case.source.character.motion(*twice, case.source.fps)
    for rule in ("hip_height", "mixamo"):
        plain = registry.create("methods", Spec("ik", {"hands": False, "root_rule": rule}))
        right = plain.retarget(source, case.target, context=Context(seed=0))
        answer = retargeted(Corrector().eval(), source, case.target, rule)
        off = np.linalg.norm(answer.positions - right.positions, axis=-1)
        assert off.max() < 0.002 * case.target.height
        assert np.median(off) < 1e-5 * case.target.height


@pytest.mark.parametrize("root_rule", ["hip_height", "learned"])
def test_the_answer_is_the_same_wherever_the_source_stands(root_rule: RootRule) -> None:
    """The path is scaled about the origin of the world; all else is seen from the body."""
    case = _case()
    network = loosened(Corrector()).eval()
    here, there = (
        retargeted(network, source, case.target, root_rule).positions
        for source in (case.source, _moved(case.source, [40.0, 0.0, -20.0]))
    )
    moved = there - here
    assert np.linalg.norm(moved, axis=-1).min() > 40.0
    assert np.ptp(moved, axis=(0, 1)).max() < 1e-3 * case.target.height


@pytest.mark.parametrize("root_rule", ["hip_height", "learned"])
def test_arms_that_touch_nothing_stay_as_they_were_copied(root_rule: RootRule) -> None:
    case = _case("clap")
    network = loosened(Corrector()).eval()
    answer = retargeted(network, case.source, case.target, root_rule)
    copied = transfer.carry(case.source, case.target, "hip_height")
    apart = near(case.source)
    above = [case.target.joint_of[each] for each in ("neck", "left_arm", "left_forearm", "left_hand")]
    from_hips = [each.positions[:, above] - each.positions[:, :1] for each in (answer, copied)]
    moved = np.linalg.norm(from_hips[0] - from_hips[1], axis=-1)
    clear, close = apart[:, 0] == 0, apart[:, 0] == 1
    assert clear.any()
    assert moved[clear].max() < 1e-5
    assert close.any()
    assert moved[close, -1].min() > 1e-3
    assert moved[:, :2].max() < 1e-5  # neck and shoulder


def test_palms_are_near_to_what_they_may_touch() -> None:
    """A clap: both at once when the wrists are closest, none when they are far apart; anywhere level."""
    motion = _case("clap").source
    found, hands = near(motion), [motion.character.joint_of[f"{side}_hand"] for side in SIDES]
    apart = np.linalg.norm(motion.positions[:, hands[0]] - motion.positions[:, hands[1]], axis=-1)
    assert found.shape == (motion.frames, 2)
    assert found[apart.argmin()].min() == 1.0
    assert found[apart.argmax()].max() == 0.0
    assert found.min() >= 0.0
    assert np.allclose(near(_moved(motion, [5.0, 0.0, -2.0])), found, atol=1e-9)
    sunk = _moved(motion, [0.0, -0.8 * motion.character.height, 0.0])
    assert near(sunk).min() == 1.0  # on the floor


def _moved(motion: Motion, offset: Sequence[float]) -> Motion:
    return motion.character.motion(motion.rotations, motion.root + offset, motion.fps)


def _case(kind: str = "walk") -> Case:
    puppets = bound.dataset(PUPPETS).built
    infos = puppets.cases("retarget", "intra")
    return puppets.load(next(info for info in infos if info.kind == kind))
