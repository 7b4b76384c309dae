"""nkn in the form of the authors' code: input, drawing, and every loss by its formula in NumPy."""

from __future__ import annotations

import numpy as np
import pytest
import torch
from method_bodies import apart, dance
from nkn_toys import CAST, training_module
from scipy.spatial.transform import Rotation
from training_material import batch

from retarget_bench.api import Context
from retarget_bench.methods.nkn import plugin
from retarget_bench.methods.nkn.network.bodies import Bodies
from retarget_bench.motion import facing, rotation
from retarget_bench.training.layers.kinematic.features import Path, answer, floor
from retarget_bench.training.layers.kinematic.retargeter import Cases

SMALL = {"hidden": 16, "facing": 3.0, **plugin.card.published[0]}
FEET = ("left_foot", "left_toe", "right_foot", "right_toe")


def test_both_sides_learn_with_the_published_momentum():
    """Adam's first beta is 0.5, and gradients are cut to a norm of 25."""
    module = training_module(plugin(**SMALL), window=30)
    assert {(phase.name, phase.betas, phase.clip) for phase in module.phases} == {
        (name, (0.5, 0.999), 25.0) for name in ("generator", "discriminator")
    }


def moving(variant: str, **parameters):
    """A training module whose answers move, without dropout, and a batch of rows of unequal length."""
    module = training_module(plugin(**{**SMALL, "variant": variant, **parameters}), window=30)
    module.modules.eval()
    for each in module.modules["generator"].parameters():
        each.data += 0.1 * torch.randn_like(each)
    module.modules["discriminator"]["body22"].dropout = 0.0
    now = next(
        now
        for step in range(50)
        if 0 < int((now := batch(module, rows=6, seed=step))["groups"][0]["same"].sum()) < 6
    )
    return module, now


# -------------------------------------------------------------------------------------------- the input
def test_places_are_as_high_as_the_hips_were_at_first_and_movements_lead_to_the_next_frame():
    character = CAST["long"]
    motion = dance(character, 50, seed=3)
    method = plugin(**SMALL)
    sight, joints = method.see(motion), list(method.body(character).joints)
    places, yaw = 100.0 * motion.positions[:, joints], np.angle(sight.turn)
    lowest = 100.0 * motion.positions[:, [character.joint_of[role] for role in FEET], 1].min(axis=1)
    ground = lowest.min() - np.log(0.5 + np.exp(lowest.min() - lowest.max()))
    first = places[0, 0, 1] - ground
    assert sight.height == pytest.approx(0.01 * first)
    for frame in range(50):
        local = Rotation.from_euler("Y", -yaw[frame]).apply(places[frame] - places[frame, 0])
        local[:, 1] += first
        np.testing.assert_allclose(sight.poses[frame, :66].reshape(22, 3), local, atol=1e-3)
        move = np.zeros(4)
        if frame < 49:
            away = Rotation.from_euler("Y", -yaw[frame + 1])
            move[:3] = away.apply(places[frame + 1, 0] - places[frame, 0])
            move[3] = (yaw[frame + 1] - yaw[frame] + np.pi) % (2 * np.pi) - np.pi
        np.testing.assert_allclose(sight.poses[frame, 66:], move, atol=1e-3)


def test_the_floor_is_a_soft_minimum_in_units():
    places = np.zeros((2, len(CAST["one"].skeleton), 3))
    feet = [CAST["one"].joint_of[role] for role in FEET]
    places[:, feet, 1] = np.array([[0.3], [0.2]])
    assert floor(places[:1], CAST["one"], 0.01) == pytest.approx(0.3 - 0.01 * np.log(1.5))
    assert floor(places, CAST["one"], 0.01) == pytest.approx(0.2 - 0.01 * np.log(0.5 + np.exp(-10.0)))


@pytest.mark.parametrize("path", ["integrated", "relative"])
def test_movements_and_rotations_give_the_motion_back_in_chunks_of_any_length(path):
    character = CAST["one"]
    motion = dance(character, 40, seed=1)
    method = plugin(**{**SMALL, "path": path})
    sight, body = method.see(motion), method.body(character)
    turns, _ = body.see(motion)
    turns[:, 0] = rotation.multiply(rotation.conjugate(facing.rotation(sight.turn)), turns[:, 0])
    walked = Path(np.array([0.01]), path, "predicted", "released")
    parts = [
        walked.follow(*(each[part, None] for each in (sight.poses[:, -4:], sight.turn, sight.hips)))
        for part in (slice(0, 1), slice(1, 9), slice(9, 40))
    ]
    turn, hips = (np.concatenate(each)[:, 0] for each in zip(*parts, strict=True))
    assert apart(answer(body, turns, turn, hips, 40, 30.0), motion) < 1e-5


def test_the_scale_knows_one_rest_pose_of_every_clip_at_the_height_of_its_hips():
    module = training_module(plugin(**SMALL))
    poses, rest = module._material.stacked("poses")[:, :66], []
    for name in sorted(CAST):
        bones = plugin(**SMALL).bones(CAST[name]).reshape(-1).copy()
        bones[1] = module._material.clips[name][0].arrays["poses"][0, 1]
        rest.append(bones)
    scale = module.modules["generator"]["body22"].scale
    np.testing.assert_allclose(
        scale.places_mean.numpy(), np.concatenate([poses, np.stack(rest)]).mean(0), atol=1e-3
    )
    assert float(scale.places_deviation[1]) > 1.0  # bodies are of different height
    assert scale.places_deviation[[0, 2]].tolist() == [1.0, 1.0]


# ---------------------------------------------------------------------------------------- whom it draws
def test_any_body_may_be_drawn_and_a_fifth_of_the_rows_is_marked():
    module, own, marked, rows = training_module(plugin(**SMALL)), 0, 0, 0
    for step in range(100):
        (group,) = batch(module, rows=8, seed=step)["groups"]
        itself = (group["bones"] == group["target_bones"]).all(-1).all(-1)
        assert itself[group["same"]].all()
        assert group["other"].tolist() == torch.nonzero(~group["same"])[:, 0].tolist()
        heights, targets = group["heights"], group["target_heights"]
        assert torch.equal(heights[group["same"]], targets[group["same"]])
        np.testing.assert_array_equal(heights[:, 0], group["poses"][:, 0, 1])
        own += int((itself & ~group["same"]).sum())
        marked, rows = marked + int(group["same"].sum()), rows + 8
    assert marked / rows == pytest.approx(0.2, abs=0.04)  # 2.8 standard errors: the seeds are fixed
    assert own / rows == pytest.approx(0.8 / 3, abs=0.045)


def test_clips_beside_targets_are_of_bodies_that_the_discriminator_is_told():
    module = training_module(plugin(**SMALL))
    bones = {name: plugin(**SMALL).bones(body) for name, body in CAST.items()}
    strangers = 0
    for step in range(30):
        (group,) = batch(module, rows=8, seed=step)["groups"]
        for row in range(8):
            (whose,) = (n for n in CAST if np.array_equal(bones[n], group["real_bones"][row].numpy()))
            heights = [clip.arrays["poses"][0, 1] for clip in module._material.clips[whose]]
            assert float(group["real"]["poses"][row, 0, 1]) in heights
            alike = torch.equal(group["real_bones"][row], group["target_bones"][row])
            assert alike or group["same"][row]
            strangers += not alike
    assert strangers > 10


# ------------------------------------------------------------------------------------------- the losses
class Seen:
    """Answers there and back of a batch, and what was asked for, as arrays: rows first, normalised."""

    def __init__(self, module, group) -> None:
        generator = module.modules["generator"]["body22"]
        scale, tree = generator.scale, module._tree("body22", group["bones"])
        self.asked = scale.poses(group["poses"].transpose(0, 1))
        there = Bodies(tree, group["target_bones"], scale, heights=group.get("target_heights"))
        back = Bodies(tree, group["bones"], scale, heights=group.get("heights"))
        with torch.no_grad():
            self.there, turned, _ = generator.decoder(generator.encoder(self.asked)[1], there)
            self.back, again, _ = generator.decoder(generator.encoder(self.there)[1], back)
            self.turns = [each[..., :88].unflatten(-1, (22, 4)).double() for each in (turned, again)]
            self.plain = [scale.plain(each).double().numpy() for each in (self.there, self.back)]
        self.mean, self.deviation = (
            torch.cat([getattr(scale, f"{kind}_{what}") for kind in ("places", "moves")]).double().numpy()
            for what in ("mean", "deviation")
        )
        self.lengths = group["lengths"].tolist()
        self.same = group["same"].numpy()
        self.frames = sum(self.lengths)

    def squares(self, a, b, part, rows) -> float:
        apart = (a.double() - b.double()).numpy()[..., part] ** 2
        return sum(float(apart[: self.lengths[row], row].sum()) for row in rows)

    def drifts(self, a, rows) -> float:
        apart = (a.double() - self.asked.double()).numpy()[..., 66:]
        return sum(float((apart[: self.lengths[row], row].cumsum(0) ** 2).sum()) for row in rows)


def twisted(turns: np.ndarray, skipped: int) -> float:
    """Squared radians that the first angle of YZX lies beyond 100 degrees, the mean over joints."""
    penalty = 0.0
    for each in turns[skipped:]:
        angle = Rotation.from_quat(each[[1, 2, 3, 0]]).as_euler("YZX")[0]
        penalty += max(0.0, abs(angle) - np.radians(100.0)) ** 2
    return penalty / (len(turns) - skipped)


@pytest.mark.parametrize("variant", ["released", "own"])
def test_every_term_of_the_generator_is_its_formula(variant):
    module, now = moving(variant, drift=0.05)
    (group,) = now["groups"]
    assert len(set(group["lengths"].tolist())) > 1
    reference, memory = Seen(module, group), {}
    terms = {name: each.item() for name, each in module.losses("generator", now, memory).items()}
    rows = range(len(reference.lengths))
    own_rows = [row for row in rows if reference.same[row]]
    over = sum(reference.lengths[row] for row in own_rows) if variant == "released" else reference.frames
    expected = {}
    for name, part in (("places", slice(66)), ("moves", slice(66, 70))):
        expected[f"cycle_{name}"] = (
            reference.squares(reference.back, reference.asked, part, rows) / reference.frames
        )
        expected[f"same_{name}"] = (
            reference.squares(reference.there, reference.asked, part, own_rows) / over
        )
    skipped = 1 if variant == "released" else 0
    twists = [
        sum(
            twisted(way[frame, row].numpy(), skipped)
            for row in rows
            for frame in range(reference.lengths[row])
        )
        for way in reference.turns
    ]
    expected["twist"] = 10.0 * 0.5 * sum(twists) / reference.frames
    changes = [
        sum(float((np.diff(way[: reference.lengths[row], row, 66:], axis=0) ** 2).sum()) for row in rows)
        for way in reference.plain
    ]
    expected["smooth"] = 0.01 * 0.5 * sum(changes) / reference.frames
    expected["drift"] = (
        0.05
        * (reference.drifts(reference.there, own_rows) + reference.drifts(reference.back, rows))
        / reference.frames
    )
    logits = discriminated(module, group, reference, variant)
    others = [row for row in rows if not reference.same[row]]
    fooled = logits[others] if variant == "released" else logits
    expected["adversarial"] = 0.001 * float(np.log1p(np.exp(-fooled)).mean())
    assert expected["twist"] > 0.0
    assert terms == pytest.approx(expected, rel=1e-4)
    assert len(memory["fakes"][0].logits) == (len(rows) if variant == "released" else len(others))


def discriminated(module, group, reference, variant) -> np.ndarray:
    """Logits of the answers: of all rows, or ours of those that go to another body."""
    plain = reference.plain[0]
    moves = plain[:-1, :, 66:] if variant == "released" else plain[1:, :, 66:]
    shown = np.concatenate([np.diff(plain[..., :66], axis=0), moves], -1).transpose(1, 0, 2)
    bones = (group["target_bones"].numpy().reshape(-1, 66) - reference.mean[:66]) / reference.deviation[:66]
    rows = np.arange(len(shown)) if variant == "released" else np.flatnonzero(~reference.same)
    lengths = torch.tensor(reference.lengths)[rows] - 1
    network = module.modules["discriminator"]["body22"]
    with torch.no_grad():
        logits = network(
            torch.from_numpy(shown[rows]).float(), torch.from_numpy(bones[rows, 3:]).float(), lengths
        )
    return logits.double().numpy()


def test_the_discriminators_loss_is_that_of_real_clips_plus_that_of_all_answers():
    module, now = moving("released")
    (group,), memory = now["groups"], {}
    module.losses("generator", now, memory)
    loss = module.losses("discriminator", now, memory)["cross_entropy"].item()
    reference = Seen(module, group)
    fake = discriminated(module, group, reference, "released")
    plain = group["real"]["poses"].double().numpy()
    shown = np.concatenate([np.diff(plain[..., :66], axis=1), plain[:, :-1, 66:]], -1)
    bones = (group["real_bones"].numpy().reshape(-1, 66) - reference.mean[:66]) / reference.deviation[:66]
    with torch.no_grad():
        real = module.modules["discriminator"]["body22"](
            torch.from_numpy(shown).float(),
            torch.from_numpy(bones[:, 3:]).float(),
            group["real"]["lengths"] - 1,
        )
    expected = np.log1p(np.exp(-real.double().numpy())).mean() + np.log1p(np.exp(fake)).mean()
    assert loss == pytest.approx(expected, rel=1e-4)


def test_the_answer_is_that_of_the_height_of_the_scaled_hips():
    """In chunks as in one go; at another height above the floor it is another one."""
    module, _ = moving("released")
    method, source, target = module.method(), dance(CAST["one"], 40), CAST["long"]
    at_once = method.retarget(source, target, context=Context())
    sight = method.see(source)
    ratio = target.measures.hip_height / source.character.measures.hip_height
    lead = sight.hips * ratio

    def again(height: float):
        stream = method.stream(Cases([source.character], [target], heights=[height]))
        parts = [
            stream.advance(*(each[part, None] for each in (sight.poses, sight.turn, lead)))
            for part in (slice(0, 1), slice(1, 17), slice(17, 40))
        ]
        turns, turn, hips = (np.concatenate(each)[:, 0] for each in zip(*parts, strict=True))
        return answer(method.body(target), turns, turn, hips, 40, 30.0)

    assert apart(again(sight.height * ratio), at_once) < 1e-6
    assert apart(again(sight.height * ratio + 0.3), at_once) > 1e-4
