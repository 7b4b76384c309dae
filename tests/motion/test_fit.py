"""Rotations fitted to positions: exact where they can be, best where they cannot, and smooth."""

from __future__ import annotations

import numpy as np
import pytest
from fit_bodies import along_x, noisy, puppets, random_tree, wiggle
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from retarget_bench.errors import BenchError
from retarget_bench.motion import rotation, transfer
from retarget_bench.motion.character import Character
from retarget_bench.motion.fitting import bones
from retarget_bench.motion.fitting.bones import Tree
from retarget_bench.motion.fitting.fit import Fitted, fit
from retarget_bench.motion.motion import Motion
from retarget_bench.motion.skeleton import Skeleton
from tests.examples import examples
from tests.methods.method_bodies import about, body, dance, pose

EXACT = 1e-4
BODIES = {"t_pose": body(), "a_pose": body(droop=45.0), "along_x": along_x(), **puppets()}


def refitted(motion: Motion, places: np.ndarray | None = None) -> Fitted:
    observed = motion.positions if places is None else places
    return fit(motion.character.positions(observed, motion.fps))


def lengths(skeleton: Skeleton, places: np.ndarray) -> np.ndarray:
    return np.linalg.norm(places[:, 1:] - places[:, skeleton.parents[1:]], axis=-1)


def fixed_joints(skeleton: Skeleton) -> list[int]:
    """Joints that carry two bones in clearly different directions, so that positions fix them."""
    fixed = []
    for joint, below in enumerate(skeleton.children):
        sizes = np.linalg.svd(skeleton.offsets[list(below)], compute_uv=False) if below else np.zeros(1)
        if len(sizes) > 1 and sizes[1] > 0.01:
            fixed.append(joint)
    return fixed


def steps(motion: Motion, joint: str) -> np.ndarray:
    """Degrees that a joint turns in the world from frame to frame."""
    turned = motion.global_rotations[:, motion.skeleton.index(joint)]
    return np.degrees(rotation.angle(turned[1:], turned[:-1]))


def errors(fitted: Motion, expected: Motion, joint: str) -> np.ndarray:
    """Degrees between two motions at a joint, in the world."""
    index = expected.skeleton.index(joint)
    return np.degrees(
        rotation.angle(fitted.global_rotations[:, index], expected.global_rotations[:, index])
    )


@pytest.mark.parametrize("name", BODIES)
def test_joints_that_carry_several_bones_are_turned_as_they_were(name):
    motion = wiggle(BODIES[name], 30, seed=1)
    fitted = refitted(motion).motion
    fixed = fixed_joints(motion.skeleton)
    assert fixed
    for joint in fixed:
        assert errors(fitted, motion, motion.skeleton.names[joint]).max() < 0.01


def test_a_root_whose_bones_lie_in_line_faces_where_its_body_does():
    """Hips with the spine above and below them the pelvis, which carries the legs: only these show it."""
    stork = BODIES["body23"]
    assert fixed_joints(stork.skeleton)[0] != 0
    turn = about("Y", np.linspace(0.0, 300.0, 60))
    still = wiggle(stork, 60, size=0.05)
    rotations = still.rotations.copy()
    rotations[:, 0] = rotation.multiply(turn, rotations[:, 0])
    motion = stork.motion(rotations, still.root, 30.0)
    assert errors(refitted(motion).motion, motion, stork.skeleton.names[0]).max() < 10.0


@pytest.mark.parametrize("other", [body("other", thigh=0.6, arm=0.2, spines=2), along_x()])
def test_what_no_position_shows_is_turned_as_in_the_motion_that_it_comes_from(other):
    """Heads, necks, forearms, hands and feet of a body that performs another body's motion."""
    source = wiggle(other, 40)
    motion = transfer.carry(source, body(), "hip_height")
    observed = motion.character.positions(motion.positions, motion.fps)
    fitted, alone = fit(observed, source).motion, fit(observed).motion
    for joint in ("Neck", "Head", "LeftForeArm", "LeftHand", "RightHand", "RightFoot", "LeftToeBase"):
        assert errors(fitted, motion, joint).max() < 0.1
        assert errors(alone, motion, joint).max() > 5.0
    from_source = fit(observed, source.character.positions(source.positions, source.fps)).motion
    assert (from_source.rotations == alone.rotations).all()


def test_a_face_hung_on_a_bone_of_no_length_but_that_of_rounding_does_not_spin():
    plain = body().skeleton
    names, parents = (*plain.names, "Face", "LeftEye", "RightEye"), [*plain.parents, plain.index("Head")]
    parents += [len(plain)] * 2
    extras = np.array([[3e-7, -8e-7, 0.0], [0.03, 0.08, 0.08], [-0.03, 0.08, 0.08]])
    offsets = np.concatenate([plain.offsets, extras])
    motion = dance(Character.of("face", Skeleton(names, np.array(parents), offsets)))
    rotations = motion.rotations.copy()
    rotations[:, motion.skeleton.index("Face")] = rotation.identity()
    motion = motion.character.motion(rotations, motion.root, motion.fps)
    fitted = refitted(motion, motion.positions.astype(np.float32)).motion
    assert errors(fitted, motion, "Head").max() < 0.1


def test_bones_that_are_longer_than_the_body_s_keep_their_directions():
    motion = dance(body())
    away = motion.positions - motion.root[:, None]
    fitted = refitted(motion, motion.root[:, None] + 1.05 * away)
    assert np.abs(fitted.motion.positions - motion.positions).max() < EXACT
    expected = 0.05 * np.linalg.norm(away, axis=-1)
    assert fitted.distances == pytest.approx(expected, abs=EXACT)


def test_the_least_squares_are_those_of_scipy():
    """Noise in one frame of many, so that the lengths are known: one frame's optimum by SciPy's own way."""
    motion = dance(body(), frames=30)
    observed = motion.positions.copy()
    observed[7] = noisy(motion.at(np.array([7])), 0.01)[0]
    skeleton, offsets = motion.skeleton, np.array(motion.skeleton.offsets)

    def distances(vectors: np.ndarray) -> np.ndarray:
        """Plain kinematics of one frame, joint by joint, from world rotations."""
        turned = Rotation.from_rotvec(np.array(vectors).reshape(-1, 3)).as_matrix()
        places = [observed[7, 0]]
        for joint, parent in list(enumerate(skeleton.parents))[1:]:
            places.append(places[parent] + turned[parent] @ offsets[joint])
        return (np.array(places) - observed[7]).ravel()

    start = Rotation.from_quat(motion.global_rotations[7], scalar_first=True).as_rotvec()
    best = least_squares(distances, start.ravel(), xtol=1e-12, ftol=1e-12)
    residual = np.square(refitted(motion, observed).distances[7]).sum()
    assert residual == pytest.approx(2.0 * best.cost, rel=1e-3)


def test_under_much_noise_no_more_is_left_than_scipy_leaves():
    """Steps that are right for small residuals go too far here; SciPy has a trust region for that."""
    motion = dance(body(spines=1))
    tree, observed = Tree.of(motion.character), noisy(motion, 0.15)[[8, 24]]
    start, inner = bones.first(tree, observed), [j for j, below in enumerate(tree.children) if below]

    def distances(vectors: np.ndarray, frame: int) -> np.ndarray:
        turned = start[frame].copy()
        turned[inner] = rotation.from_rotation_vector(vectors.reshape(-1, 3))
        return (tree.places(turned[None], observed[frame : frame + 1, 0])[0] - observed[frame]).ravel()

    vectors = rotation.to_rotation_vector(start[:, inner]).reshape(2, -1)
    best = sum(least_squares(distances, vectors[k], args=(k,), ftol=1e-4).cost for k in range(2))
    left = np.square(tree.places(bones.refined(tree, start, observed), observed[:, 0]) - observed).sum()
    assert left < 1.05 * 2.0 * best


def test_a_step_is_that_of_the_whole_system():
    """The recursion over the tree against one dense system, with a Jacobian by differences."""
    motion = wiggle(random_tree(5, 12), 2)
    tree = Tree.of(motion.character)
    start, expected = bones.first(tree, motion.positions), noisy(motion, 0.05)
    now = rotation.multiply(rotation.from_rotation_vector(0.1 * noisy(motion, 1.0)), start)
    problem = bones._Problem(tree, start, expected, 0.03)
    inner_step = problem.step(now, np.full(2, 0.01))

    def residuals(turns: np.ndarray, frame: int) -> np.ndarray:
        """How far joints are off after small turns in the world."""
        turned = rotation.multiply(rotation.from_rotation_vector(turns.reshape(-1, 3)), now[frame])
        return (tree.places(turned[None], expected[frame : frame + 1, 0])[0] - expected[frame]).ravel()

    for frame in range(2):
        size = inner_step[frame].size
        columns = [
            (residuals(step, frame) - residuals(-step, frame)) / 2e-6 for step in 1e-6 * np.eye(size)
        ]
        jacobian, hold = np.stack(columns, axis=1), np.repeat(problem.hold, 3)
        back = (
            Rotation.from_quat(start[frame], scalar_first=True)
            * Rotation.from_quat(now[frame], scalar_first=True).inv()
        )
        left = jacobian.T @ jacobian + np.diag(hold + 0.01 * np.repeat(problem.scale, 3))
        right = hold * back.as_rotvec().ravel() - jacobian.T @ residuals(np.zeros(size), frame)
        inner = np.repeat([bool(below) for below in tree.children], 3)
        assert inner_step[frame].ravel()[inner] == pytest.approx(
            np.linalg.solve(left, right)[inner], abs=1e-5
        )


@pytest.mark.parametrize("tilt", [0.0, 4.0, 15.0])
@pytest.mark.parametrize("axis", ["Y", "Z"])
def test_a_straight_arm_that_swings_all_round_does_not_flip(axis, tilt):
    """Half way it points opposite to where it rests, or nearly, where the shortest turn there jumps."""
    frames = 120
    tilted = about("Z" if axis == "Y" else "Y", np.full(frames, tilt))
    turn = rotation.multiply(about(axis, np.linspace(0.0, 360.0, frames)), tilted)
    motion = pose(body(), frames, {"LeftArm": turn}, np.zeros((frames, 3)))
    fitted = refitted(motion).motion
    for joint in ("LeftArm", "LeftForeArm"):
        assert steps(fitted, joint).max() < 1.1 * steps(motion, joint).max()


def test_an_elbow_that_passes_through_straight_does_not_flip():
    frames = 120
    swing, bend = np.linspace(0.0, 80.0, frames), -40.0 + 45.0 * np.cos(np.linspace(0, 20, frames))
    turns = {"LeftArm": about("Z", swing), "LeftForeArm": about("Y", bend)}
    motion = pose(body(), frames, turns, np.zeros((frames, 3)))
    fitted = refitted(motion, noisy(motion, 0.0005)).motion
    assert bend.max() > 0 > bend.min()
    assert steps(fitted, "LeftArm").max() < 12.0


trees = st.tuples(st.integers(0, 2**32 - 1), st.integers(1, 40), st.integers(1, 20))


@examples(40)
@given(trees)
def test_any_tree_gets_its_positions_back(tree):
    seed, joints, frames = tree
    motion = wiggle(random_tree(seed, joints), frames, seed)
    fitted = refitted(motion)
    assert fitted.worst < EXACT
    assert np.linalg.norm(fitted.motion.rotations, axis=-1) == pytest.approx(1.0, abs=1e-9)


@examples(30)
@given(trees, st.floats(0.0, 10.0))
def test_any_finite_positions_get_an_answer_with_the_body_s_bones(tree, size):
    seed, joints, frames = tree
    character = random_tree(seed, joints)
    places = size * np.random.default_rng(seed).normal(size=(frames, joints, 3))
    fitted = fit(character.positions(places, 30.0)).motion
    assert np.isfinite(fitted.rotations).all()
    assert lengths(fitted.skeleton, fitted.positions) == pytest.approx(
        np.broadcast_to(fitted.skeleton.bone_lengths[1:], (frames, joints - 1)), abs=1e-9
    )


@examples(15)
@given(st.integers(0, 2**32 - 1), st.floats(-np.pi, np.pi), st.sampled_from(["t_pose", "h36m17", "dog21"]))
def test_a_body_that_is_moved_and_turned_about_is_fitted_alike(seed, angle, name):
    motion = wiggle(BODIES[name], 12, seed)
    observed = noisy(motion, 0.003, seed)
    turn = Rotation.from_rotvec([0.0, angle, 0.0])
    moved = turn.apply(observed.reshape(-1, 3)).reshape(observed.shape) + np.array([2.0, -1.0, 5.0])
    first, second = refitted(motion, observed).motion, refitted(motion, moved).motion
    assert rotation.angle(first.rotations[:, 1:], second.rotations[:, 1:]).max() < 1e-3


def test_frames_do_not_depend_on_how_many_are_worked_on_together(monkeypatch):
    motion = dance(body())
    observed = noisy(motion, 0.005)
    together = refitted(motion, observed).motion
    monkeypatch.setattr("retarget_bench.motion.fitting.bones._AT_ONCE", 150)
    assert np.abs(refitted(motion, observed).motion.positions - together.positions).max() < 1e-9


def test_one_frame_and_none():
    motion = dance(body())
    single = refitted(motion.at(slice(3, 4)))
    assert single.worst < EXACT
    empty = refitted(motion.at(slice(0, 0)))
    assert empty.motion.rotations.shape == (0, len(motion.skeleton), 4)
    assert empty.mean == empty.worst == 0.0


@pytest.mark.parametrize("wrong", [np.nan, np.inf])
def test_positions_that_are_not_finite_are_a_sentence(wrong):
    motion = dance(body())
    places = motion.positions.copy()
    places[[4, 9], 3, 1] = wrong
    with pytest.raises(BenchError, match=r"puppet: in 2 of 40 frames .* 'Spine2' in frame 4") as error:
        refitted(motion, places)
    assert "\n" not in str(error.value)


def test_the_residual_is_what_it_says():
    motion = dance(body())
    observed = noisy(motion, 0.01)
    fitted = refitted(motion, observed)
    worst, total, where = 0.0, 0.0, ""
    joints = len(motion.skeleton)
    for frame in range(motion.frames):
        for joint in range(joints):
            off = float(np.sqrt(sum((fitted.motion.positions[frame, joint] - observed[frame, joint]) ** 2)))
            total += off
            if off > worst:
                worst, where = off, motion.skeleton.names[joint]
    residual = fitted
    assert residual.worst == pytest.approx(worst, abs=1e-12)
    assert residual.mean == pytest.approx(total / motion.frames / (joints - 1), abs=1e-12)
    assert residual.distances.shape == (motion.frames, joints)
    assert not residual.distances[:, 0].any()
    assert str(residual) == f"{100 * residual.mean:.1f} cm mean, {100 * worst:.1f} cm worst ({where})"
