"""Arms that are kept out of the body, on people made of tubes and on files of others."""

from __future__ import annotations

import warnings
from dataclasses import replace

import numpy as np
from tubes import fleshed, lathe

import retarget_bench as rb
from retarget_bench.motion import rotation
from retarget_bench.motion.character import Character, Motion
from retarget_bench.motion.editing import arms, legs
from retarget_bench.motion.editing.edits import Edits, edited
from retarget_bench.motion.editing.girths import Part, parts
from retarget_bench.motion.mesh import Mesh
from retarget_bench.motion.penetration import inside, limbs
from tests.viewing.viewing_toys.toy_moves import DOG, body


def stout(limb: float = 0.035, thigh: float = 0.13) -> Character:
    """``fleshed`` with thin arms and thick thighs."""
    thin, thick = fleshed(limb), fleshed(thigh)
    slim, fat = thin.mesh, thick.mesh
    assert slim is not None
    assert fat is not None
    legs_of = thin.joints(["left_up_leg", "right_up_leg"])
    vertices = np.where(slim.weights[:, legs_of].any(axis=1)[:, None], fat.vertices, slim.vertices)
    mesh = Mesh(vertices, slim.faces, slim.weights)
    return replace(thin, skin=lambda: mesh)


def swing(character: Character, frames: int = 61, down: float = 1.65, size: float = 0.6) -> Motion:
    """Arms that hang and swing, beside the thighs at 0.5 s and 1.5 s; nothing else moves."""
    turns = np.zeros((frames, len(character.skeleton), 3))
    angle = size * np.cos(2 * np.pi * np.arange(frames) / 60.0)
    for side, sign in (("left", 1.0), ("right", -1.0)):
        hang = rotation.about(np.array([0.0, 0.0, 1.0]), -sign * down)
        forth = rotation.about(np.array([[1.0, 0.0, 0.0]]), sign * angle)
        turns[:, character.joint_of[f"{side}_arm"]] = rotation.to_rotation_vector(
            rotation.multiply(forth, hang[None])
        )
    root = np.repeat(character.skeleton.offsets[:1], frames, axis=0)
    return character.motion(rotation.from_rotation_vector(turns), root, 30.0)


def share(motion: Motion) -> np.ndarray:
    """``(frames,)`` of both hands and forearms inside the body, by winding numbers of the whole skin."""
    mesh = motion.character.mesh
    assert mesh is not None
    found = zip(limbs(motion.character), inside(motion.character, mesh.skinned(motion)), strict=True)
    return np.max([now.mean(axis=1) for limb, now in found if "arm" in limb.name], axis=0)


def acceleration(motion: Motion) -> float:
    hands = motion.positions[:, motion.character.joints(["left_hand", "right_hand"])]
    return float(np.linalg.norm(np.diff(hands, 2, axis=0), axis=-1).max() * motion.fps**2)


def apart(one: Motion, other: Motion, role: str) -> float:
    """Radians, at most, by which a joint is turned differently."""
    joint = other.character.joint_of[role]
    return float(rotation.angle(one.rotations[:, joint], other.rotations[:, joint]).max())


def test_depth_in_a_tube_is_that_of_a_cylinder():
    vertices, faces = lathe(np.zeros(3), np.array([0.0, 1.0, 0.0]), 0.2, rings=40, around=64)
    part = Part.of(0, np.array([0.0, 1.0, 0.0]), vertices)
    assert len(faces)
    draw = np.random.default_rng(0)
    angle, far, height = (
        draw.uniform(0, 2 * np.pi, 50),
        draw.uniform(0.02, 0.4, 50),
        draw.uniform(0.3, 0.7, 50),
    )
    points = np.stack([far * np.cos(angle), height, far * np.sin(angle)], axis=1)
    depth, out = part.depth((points - part.middle) @ part.axes.T)
    shallow = np.minimum(0.2 - far, np.minimum(height, 1.0 - height))
    np.testing.assert_allclose(depth, shallow, atol=0.002)
    across = points * [1.0, 0.0, 1.0] / far[:, None]
    np.testing.assert_allclose(out @ part.axes[1:], across, atol=1e-6)


def test_a_swing_stays_outside_of_thick_thighs():
    target = stout()
    answer = swing(target)
    cleared, note = arms.cleared(answer, swing(body("bare")))
    assert share(answer).max() > 0.2
    assert share(cleared).max() < 0.01
    turned = np.abs(cleared.rotations - answer.rotations).max(axis=2) > 0
    assert set(np.flatnonzero(turned.any(axis=0))) == set(target.joints(["left_arm", "right_arm"]))
    assert f"in {turned.any(axis=1).sum()} frames" in note
    angles = rotation.angle(cleared.rotations, answer.rotations)
    assert f"up to {np.degrees(angles.max()):.0f} degrees" in note
    assert 0.02 < angles.max() < np.radians(30)
    np.testing.assert_array_equal(cleared.root, answer.root)
    assert acceleration(cleared) < acceleration(answer) + 2.0  # a snap of 2 degrees adds 20


def test_frames_away_from_the_body_keep_their_bits():
    target = stout()
    answer = swing(target)
    raised = answer.rotations.copy()
    arm = target.joint_of["left_arm"]
    raised[:30, arm] = rotation.identity(1)  # in T-pose, then beside the thigh
    answer = target.motion(raised, answer.root, 30.0)
    source = body("bare").motion(raised, answer.root, 30.0)
    cleared, _ = arms.cleared(answer, source)
    same = (cleared.rotations == answer.rotations).all(axis=(1, 2))
    left = (cleared.rotations[:, arm] == answer.rotations[:, arm]).all(axis=1)
    assert left[:15].all()
    assert not left[45]
    assert not same[15]  # the other arm swings all the time


def test_a_hand_that_rests_on_its_thigh_is_left():
    target, bare = stout(), body("bare")
    answer = swing(target, size=0.0, down=1.7)
    assert share(answer).max() > 0.2
    assert arms.cleared(answer, swing(bare, size=0.0, down=1.7)) == (answer, "")
    # the same pose in one frame, and beside a source that moves
    one = answer.at(slice(0, 1))
    assert arms.cleared(one, swing(bare, 1, size=0.0, down=1.7)) == (one, "")
    assert arms.cleared(answer, swing(bare, down=1.4))[1]


def test_hands_in_each_other_are_left_though_they_are_in_the_belly():
    target, bare = fleshed(0.09), body("bare")
    turns = np.zeros((20, len(target.skeleton), 3))
    for side, sign in (("left", 1.0), ("right", -1.0)):
        turns[:, target.joint_of[f"{side}_arm"], 2] = -sign * 1.2
        turns[:, target.joint_of[f"{side}_forearm"], 2] = -sign * 1.3
    root = np.repeat(target.skeleton.offsets[:1], 20, axis=0)
    pose = rotation.from_rotation_vector(turns)
    answer, source = target.motion(pose, root, 30.0), bare.motion(pose, root, 30.0)
    gap = np.ptp(source.positions[:, bare.joints(["left_hand", "right_hand"])], axis=1)
    assert share(answer).max() > 0.2
    assert np.linalg.norm(gap, axis=1).max() < 0.3
    assert arms.cleared(answer, source) == (answer, "")


def test_arms_are_as_deep_as_those_of_a_source_with_the_same_skin():
    target = stout()
    answer = swing(target)
    assert arms.cleared(answer, answer) == (answer, "")


def test_an_arm_that_cannot_come_out_is_turned_by_forty_degrees_at_most():
    target = stout(thigh=0.6)
    answer = swing(target, size=0.2)
    cleared, _ = arms.cleared(answer, swing(body("bare"), size=0.2))
    angles = rotation.angle(cleared.rotations, answer.rotations)
    assert angles.max() <= np.radians(40.0) + 1e-9
    assert np.isfinite(cleared.rotations).all()
    assert acceleration(cleared) < acceleration(answer) + 20.0


def test_loops_stay_loops():
    target = stout()
    answer = swing(target).at(np.r_[15:60, 0:16])  # begins in the thigh
    source = swing(body("bare")).at(np.r_[15:60, 0:16])
    cleared, note = arms.cleared(answer, source, loop=True)
    assert note
    np.testing.assert_allclose(cleared.rotations[0], cleared.rotations[-1], atol=1e-9)
    assert share(cleared).max() < 0.01


def test_without_skin_arms_or_two_legs_nothing_is_done():
    bare = body("bare")
    assert parts(bare) == ()
    assert arms.cleared(swing(bare), swing(bare))[1] == ""
    answer = swing(stout())
    roles = tuple(None if role == "left_hand" else role for role in stout().roles)
    one_hand = replace(stout(), roles=roles).motion(answer.rotations, answer.root, 30.0)
    cleared = arms.cleared(one_hand, swing(bare))[0]
    left, right = (apart(cleared, answer, f"{side}_arm") for side in ("left", "right"))
    assert left < 1e-12
    assert right > 0.02
    dog = body("dog", DOG)
    assert legs.stance(dog) == "four legs"
    rest = dog.motion(rotation.identity(5, len(dog.skeleton)), np.zeros((5, 3)), 30.0)
    answer = edited(rest, stout(), Edits(), lambda one, target: swing(target, one.frames, size=0.0))[0]
    np.testing.assert_array_equal(answer.rotations, swing(stout(), 5, size=0.0).rotations)


def test_keep_keeps():
    source, target = swing(body("bare")), stout()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        kept = rb.retarget(source, target, "copy_rotations", arms="keep")
        cleared = rb.retarget(source, target, "copy_rotations")
    assert not any("arms=keep" in note for note in kept.notes)
    assert any("arms=keep leaves them" in note for note in cleared.notes)
    np.testing.assert_allclose(kept.rotations, source.rotations, atol=1e-9)
    assert share(kept).max() > 0.2
    assert share(cleared).max() < 0.01
