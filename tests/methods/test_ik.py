"""ik: planted feet stay where they are, touching hands keep touching, nothing else is spoilt."""

from __future__ import annotations

import tracemalloc
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from method_bodies import about, body, dance, elsewhere, first, pose, squat
from scipy.spatial.transform import Rotation

from retarget_bench.api import Context
from retarget_bench.methods.copy_rotations import plugin as CopyRotations
from retarget_bench.methods.ik import plugin as InverseKinematics
from retarget_bench.motion import contact, importer
from retarget_bench.motion.character import Character
from retarget_bench.motion.motion import Motion
from retarget_bench.motion.planting.cuts import takes
from retarget_bench.motion.planting.ease import limited, smooth, spread
from retarget_bench.motion.skeleton import Skeleton

FEET = ("left_foot", "left_toe", "right_foot", "right_toe")


def run(method, source: Motion, target: Character, **parameters) -> Motion:
    return method(**parameters).retarget(source, target, context=Context())


def wander(motion: Motion) -> float:
    """Metres: the furthest that a contact joint gets from where it was at first."""
    feet = motion.positions[:, motion.character.joints(FEET)]
    return float(np.linalg.norm(feet - feet[0], axis=-1).max())


OTHERS = {
    "long thighs": body("long thighs", thigh=0.62, shin=0.40, hip=0.16),
    "short": body("short", thigh=0.2, shin=0.26),
    "small": body("small", scale=0.4, spines=4),
}


@pytest.mark.parametrize("name", OTHERS)
def test_planted_feet_stay_in_place_on_the_floor(name):
    source, target = squat(body()), OTHERS[name]
    result = run(InverseKinematics, source, target)
    assert wander(run(CopyRotations, source, target)) > 0.01 or name == "small"
    assert wander(result) < 1e-4
    heights = result.positions[:, target.joints(FEET), 1]
    assert heights[:, 0] == pytest.approx(heights[0, 0], abs=1e-4)
    np.testing.assert_allclose(heights[:, 1], 0.0, atol=1e-4)
    # the stance is the target's own
    across = result.positions[0, target.joint_of["left_foot"], 0]
    assert across == pytest.approx(
        abs(target.skeleton.offsets[target.joint_of["left_up_leg"], 0]), abs=1e-6
    )


def test_a_still_source_on_the_same_body_comes_back():
    source = squat(body())
    result = run(InverseKinematics, source, source.character)
    np.testing.assert_allclose(result.positions, source.positions, atol=2e-3)
    feet = source.character.joints(FEET)
    np.testing.assert_allclose(result.positions[:, feet], source.positions[:, feet], atol=1e-6)


def test_out_of_reach_the_hips_come_down():
    """Feet planted wide apart on a body with short legs: copied feet would float or slide."""
    source = squat(body(thigh=0.5, shin=0.5))
    stride = np.zeros_like(source.root)
    stride[:, 0] = 0.35 * np.sin(
        np.linspace(0.0, 2.0 * np.pi, source.frames)
    )  # the body sways over its feet
    swaying = _over_fixed_feet(source, stride)
    target = body("short", thigh=0.25, shin=0.3, hip=0.2)
    result = run(InverseKinematics, swaying, target)
    assert wander(result) < 5e-3
    assert wander(run(CopyRotations, swaying, target)) > 0.03
    assert (result.root[:, 1] <= run(CopyRotations, swaying, target).root[:, 1] + 0.05).all()


def _over_fixed_feet(motion: Motion, stride: np.ndarray) -> Motion:
    """The motion with its hips moved sideways and its straightened legs leaning after the feet."""
    character = motion.character
    height = motion.root[:, 1] - 0.1
    lean = np.arctan2(stride[:, 0], height)
    longer = np.hypot(stride[:, 0], height)
    thigh = character.skeleton.bone_lengths[character.skeleton.index("LeftLeg")]
    bend = np.arccos(np.clip(longer / 2.0 / thigh, -1.0, 1.0))
    tilt = Rotation.from_rotvec(-lean[:, None] * [0.0, 0.0, 1.0])
    fold = Rotation.from_rotvec(bend[:, None] * [1.0, 0.0, 0.0])
    turns = {}
    for side in ("Left", "Right"):
        turns[f"{side}UpLeg"] = first(tilt * fold.inv())
        turns[f"{side}Leg"] = first(fold * fold)
        turns[f"{side}Foot"] = first((tilt * fold).inv())
    return pose(character, motion.frames, turns, motion.root + stride)


def test_palms_that_meet_keep_meeting():
    source_body = body()
    frames = 60
    # fore-arms folded in front of the chest: the palms meet in the middle of the clip
    fold = 40.0 + 30.0 * np.minimum(1.0, 0.8 - 0.8 * np.cos(np.linspace(0.0, 2.0 * np.pi, frames)))
    turns = {
        "LeftArm": about("Y", -fold),
        "RightArm": about("Y", fold),
        "LeftForeArm": about("Y", -np.full(frames, 74.0)),
        "RightForeArm": about("Y", np.full(frames, 74.0)),
    }
    root = np.tile([0.0, source_body.measures.hip_height, 0.0], (frames, 1))
    source = pose(source_body, frames, turns, root)
    target = body("broad", shoulder=0.34)

    def apart(motion: Motion) -> np.ndarray:
        left, right = motion.character.joints(("left_hand", "right_hand"))
        return motion.positions[:, left] - motion.positions[:, right]

    middle = frames // 2
    expected, copied, solved = (
        np.linalg.norm(apart(each)[middle])
        for each in (source, run(CopyRotations, source, target), run(InverseKinematics, source, target))
    )
    assert abs(copied - expected) > 0.1
    assert solved == pytest.approx(expected, abs=2e-3)
    loose = run(InverseKinematics, source, target, hands=False)
    np.testing.assert_allclose(np.linalg.norm(apart(loose)[middle]), copied, atol=1e-9)


def test_turning_the_source_turns_the_result():
    source, target = squat(body()), OTHERS["long thighs"]
    straight, turned = (
        run(InverseKinematics, each, target).positions for each in (source, elsewhere(source, 130.0))
    )
    expected = Rotation.from_euler("Y", 130, degrees=True).apply(straight.reshape(-1, 3))
    np.testing.assert_allclose(turned.reshape(-1, 3), expected, atol=1e-8)


def test_a_body_without_legs_is_refused_with_a_reason():
    names = ("Hips", "Spine", "Neck", "Head")
    offsets = np.array([[0, 1, 0], [0, 0.3, 0], [0, 0.3, 0], [0, 0.1, 0]])
    bust = Character.of("bust", Skeleton(names, np.array([-1, 0, 1, 2]), offsets))
    why = InverseKinematics(root_rule="height").supports(body(), bust)
    assert why is not None
    assert "bust has no two legs" in why


def test_spread_keeps_what_is_known_and_eases_the_rest():
    known = np.zeros(60, dtype=bool)
    known[10:20] = known[25:30] = True
    values = np.where(np.arange(60) < 22, 1.0, 3.0)[:, None]
    out = spread(values, known, 30.0)[:, 0]
    np.testing.assert_array_equal(out[known], values[known, 0])
    assert (np.diff(out[19:26]) >= 0).all()  # from one correction straight to the next
    assert out[0] == pytest.approx(0.0)
    assert out[45:] == pytest.approx(0.0)
    assert np.abs(np.diff(out)).max() < 0.5


def test_smooth_keeps_constants_and_the_mean_of_what_lies_inside():
    np.testing.assert_allclose(smooth(np.full((50, 2), 2.5), 30.0), 2.5)
    spike = np.zeros((50, 2))
    spike[25, 1] = 1.0
    assert smooth(spike, 30.0).sum(axis=0) == pytest.approx([0.0, 1.0])
    assert smooth(spike, 30.0)[:, 1].argmax() == 25


def test_limited_is_the_nearest_curve_of_that_slope_where_it_must_change():
    step = np.where(np.arange(40) < 20, 0.0, 10.0)[:, None]
    out = limited(step, np.full((39, 1), 0.5))
    assert np.abs(np.diff(out, axis=0)).max() <= 0.5 + 1e-12
    assert np.abs(out - step).max() == pytest.approx(4.75)  # half of a step that may take 0.5 as it is
    ramp = np.cumsum(np.random.default_rng(0).uniform(-0.5, 0.5, (40, 2)), axis=0)
    np.testing.assert_allclose(limited(ramp, np.full((39, 2), 0.5)), ramp, atol=1e-12)


def test_a_first_frame_in_the_rest_pose_at_the_origin_spoils_nothing():
    source, target = dance(body(), frames=60, seed=2), OTHERS["short"]
    source = replace(source, root=source.root + np.array([3.0, 0.0, 5.0]))
    still = source.character.motion(
        np.broadcast_to([1.0, 0.0, 0.0, 0.0], source.rotations[:1].shape), np.zeros((1, 3)), source.fps
    )
    joined = (
        np.concatenate([getattr(each, key) for each in (still, source)]) for key in ("rotations", "root")
    )
    begun = source.character.motion(*joined, source.fps)
    assert takes(source) == [slice(0, 60)]
    assert takes(begun) == [slice(0, 1), slice(1, 61)]
    after = run(InverseKinematics, begun, target).positions[1:]
    np.testing.assert_allclose(after, run(InverseKinematics, source, target).positions, atol=1e-9)


@pytest.mark.parametrize(("lift", "applied"), [(0.08, True), (-0.05, True), (0.5, False)])
def test_feet_stand_on_the_floor_when_asked_to(lift: float, applied: bool):
    """A small constant float is taken out; standing on a table is not."""
    source, target = squat(body()), OTHERS["small"]
    raised = replace(source, root=source.root + np.array([0.0, lift, 0.0]))
    flat, lifted, stands = (
        run(InverseKinematics, each, target, floor=floor).positions
        for each, floor in ((source, False), (raised, False), (raised, True))
    )
    assert np.abs(lifted - flat).max() > 0.01
    np.testing.assert_allclose(stands, flat if applied else lifted, atol=1e-9)


def test_a_bow_does_not_bury_a_head():
    """A body with a long back over short legs bows by 150 degrees; the source's head stays above ground."""
    frames = 40
    bow = 75.0 - 75.0 * np.cos(np.linspace(0.0, 2.0 * np.pi, frames))
    source = pose(
        body(),
        frames,
        {"Spine": about("X", bow)},
        np.tile([0.0, body().measures.hip_height, 0.0], (frames, 1)),
    )
    target = body("long", thigh=0.05, shin=0.05)
    head = target.joint_of["head"]
    assert run(CopyRotations, source, target).positions[:, head, 1].min() < -0.1
    assert run(InverseKinematics, source, target).positions[:, head, 1].min() > -0.01


def test_long_motions_are_not_held_many_times_over():
    """Ten minutes of 52 joints, 30 MB of rotations, have to fit into 300 MB with everything else."""
    still = squat(body())
    source = still.at(np.arange(6_000) % still.frames)
    source.positions  # noqa: B018  known before, as a source's often are
    tracemalloc.start()
    try:
        run(InverseKinematics, source, OTHERS["short"])
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert peak < 6.5 * source.rotations.nbytes


def test_a_wild_motion_stays_finite_unit_and_continuous():
    source = dance(body(), frames=80, seed=2)
    for target in OTHERS.values():
        result = run(InverseKinematics, source, target)
        assert np.isfinite(result.root).all()
        np.testing.assert_allclose(np.linalg.norm(result.rotations, axis=-1), 1.0, atol=1e-12)
        assert np.einsum("fjc,fjc->fj", result.rotations[1:], result.rotations[:-1]).min() > 0.0


# ------------------------------------------------------------------------------------------ recorded motion
PAWS = ("left_foot", "right_foot", "left_hand", "right_hand")


def load(path: Path, frames: int) -> Motion:
    motion = importer.load(path).motion
    return motion.resample(30.0).at(slice(0, frames))


def slide(result: Motion, source: Motion, roles: tuple[str, ...]) -> float:
    """Body heights per second that contact joints glide over the floor while the source's are planted."""
    source_feet, result_feet = (
        each.positions[:, each.character.joints(roles)] for each in (source, result)
    )
    planted = contact.planted(source_feet, source.character.height, source.fps)[1:]
    steps = np.linalg.norm(np.diff(result_feet[..., [0, 2]], axis=0), axis=-1)
    return float((steps * planted).sum() / planted.sum() * source.fps / result.character.height)


def both(source: Motion, target: Character) -> tuple[Motion, Motion]:
    methods = (CopyRotations(), InverseKinematics())
    copied, held = (each.retarget(source, target, context=Context()) for each in methods)
    return copied, held


@pytest.mark.parametrize("clip", ["dance1_subject1", "push1_subject2", "obstacles3_subject4"])
def test_a_person_on_another_rig(real_data: Path, clip: str):
    source = load(real_data / "lafan1" / f"{clip}.bvh", 600)
    target = load(real_data / "mixamo_r2et" / "Ortiz" / "Salsa Dancing.bvh", 2).character
    copied, held = both(source, target)
    assert slide(held, source, FEET) < 0.35 * slide(copied, source, FEET)
    low = held.positions[:, target.joints(FEET), 1].min(axis=1)
    assert np.quantile(low, 0.05) > -0.02 * target.height


def test_a_dog_with_shorter_legs(real_data: Path):
    source = load(real_data / "dog" / "D1_047_KAN01_001.bvh", 400)
    target = shorter(source.character)
    copied, held = both(source, target)
    assert slide(held, source, PAWS) < 0.5 * slide(copied, source, PAWS)


def shorter(body: Character) -> Character:
    """The same body with legs of 70 and fore legs of 75 per cent, and a longer back."""
    offsets = np.array(body.skeleton.offsets)
    for joint, role in enumerate(body.roles):
        for part, share in (("leg", 0.7), ("foot", 0.7), ("forearm", 0.75), ("hand", 0.75), ("spine", 1.2)):
            if role is not None and role.split("_", 1)[-1].startswith(part):
                offsets[joint] *= share
    skeleton = Skeleton(body.skeleton.names, body.skeleton.parents, offsets, body.skeleton.end_sites)
    return Character.of("short", skeleton, roles=body.roles)
