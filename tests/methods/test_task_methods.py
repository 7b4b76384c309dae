"""Methods of other tasks: joints that are made up where they follow from those given, and filters."""

from __future__ import annotations

import numpy as np
import pytest

from retarget_bench.api import Context
from retarget_bench.errors import BenchError, NotSupported
from retarget_bench.evaluation.tasks.definitions import reduced
from retarget_bench.methods.gaussian_filter import GaussianFilter, noise
from retarget_bench.methods.identity import Identity
from retarget_bench.methods.linear_joints import LinearJoints, regression
from retarget_bench.methods.nearest_pose import NearestPose
from retarget_bench.methods.savitzky_golay import SavitzkyGolay
from retarget_bench.motion import completion, rotation
from retarget_bench.motion.completion import poses
from retarget_bench.motion.motion import Positions
from tests.tasks.toys.toy_people import Clips, body, swing

ANN, BOB = body("ann", 1.0), body("bob", 1.1)
GIVEN = [1, 4, 9, 12, 16]
METHODS = (LinearJoints, NearestPose)


class Rigid(Clips):
    """A statue that is carried about and turned."""

    def __getitem__(self, index):
        motion = swing(self.character, self.numbers[index])
        still = np.broadcast_to(motion.rotations[:1], motion.rotations.shape).copy()
        still[:, 0] = rotation.about(np.array([0.0, 1.0, 0.0]), np.linspace(0, 3, motion.frames))
        return self.character.motion(still, motion.root, motion.fps)


def part(motion, joints) -> Positions:
    return Positions(reduced(motion.character, joints), motion.positions[:, joints], motion.fps)


def cast(kind=Clips, bodies=(ANN, BOB), numbers=(7, 8)):
    return {"toy17": {each.name: kind(each, numbers) for each in bodies}}


def answer(method, source, target, training) -> np.ndarray:
    assert method.supports(source.character, target) is None
    return method.retarget(source, target, context=Context(training=training)).positions


@pytest.mark.parametrize("make", METHODS)
def test_a_statue_is_made_up_exactly_wherever_it_goes(make):
    moving = Rigid(ANN, (7,))[0]
    completed = answer(make(), part(moving, GIVEN), ANN, cast(Rigid, (ANN,), (7,)))
    assert np.abs(completed - moving.positions).max() < 1e-5


@pytest.mark.parametrize("make", METHODS)
def test_given_joints_stay_and_all_of_them_need_no_training(make):
    source = swing(BOB, 0)
    completed = answer(make(), part(source, GIVEN), BOB, cast())
    assert np.array_equal(completed[:, GIVEN], source.positions[:, GIVEN])
    complete = Positions(BOB, source.positions, 30.0)
    assert np.array_equal(answer(make(), complete, BOB, None), source.positions)


@pytest.mark.parametrize("make", METHODS)
def test_an_answer_moves_and_turns_with_its_source(make):
    source, training = part(swing(ANN, 0), GIVEN), cast()
    completed = answer(make(), source, ANN, training)
    turn = rotation.about(np.array([0.0, 1.0, 0.0]), 2.0)
    moved = rotation.rotate(turn, source.positions) + np.array([3.0, 1.0, -2.0])
    again = answer(make(), Positions(source.character, moved, 30.0), ANN, training)
    assert np.allclose(again, rotation.rotate(turn, completed) + np.array([3.0, 1.0, -2.0]), atol=1e-6)


def test_regression_is_exact_on_linear_data_and_agrees_with_least_squares():
    rng = np.random.default_rng(5)
    inputs = rng.normal(size=(200, 4, 3))
    mixing, shift = rng.normal(size=(12, 6)), rng.normal(size=6)
    linear = (inputs.reshape(200, 12) @ mixing + shift).reshape(200, 2, 3)
    fresh = rng.normal(size=(9, 4, 3))

    def fitted(targets):
        examples = completion.Examples(np.arange(4, 6), inputs.mean(axis=0), inputs, targets)
        return regression(examples, 1e-12)(fresh)

    expected = (fresh.reshape(9, 12) @ mixing + shift).reshape(9, 2, 3)
    assert np.allclose(fitted(linear), expected, atol=1e-8)
    noisy = linear + rng.normal(size=linear.shape)
    columns = np.c_[inputs.reshape(200, 12), np.ones(200)]
    weights = np.linalg.lstsq(columns, noisy.reshape(200, 6), rcond=None)[0]
    expected = (np.c_[fresh.reshape(9, 12), np.ones(9)] @ weights).reshape(9, 2, 3)
    assert np.allclose(fitted(noisy), expected, atol=1e-8)


def test_a_large_penalty_gives_the_mean_pose():
    rng = np.random.default_rng(6)
    inputs, expected = rng.normal(size=(50, 3, 3)), rng.normal(size=(50, 2, 3))
    examples = completion.Examples(np.arange(3, 5), inputs.mean(axis=0), inputs, expected)
    assert np.allclose(regression(examples, 1e6)(inputs), expected.mean(axis=0), atol=1e-4)


def test_one_neighbour_finds_a_pose_that_was_trained_on():
    trained = swing(ANN, 7)
    completed = answer(
        NearestPose(neighbours=1), part(trained, GIVEN), ANN, cast(bodies=(ANN,), numbers=(7,))
    )
    assert np.abs(completed - trained.positions).max() < 1e-6


def test_poses_are_the_targets_own_whoever_performed_them():
    drawn = poses(cast(bodies=(ANN,)), BOB, 30)
    lengths = np.linalg.norm(drawn[:, 1:] - drawn[:, BOB.skeleton.parents[1:]], axis=-1)
    assert np.allclose(lengths, BOB.skeleton.bone_lengths[1:], atol=1e-9)
    assert np.allclose(drawn[:, 0], 0)
    assert len(drawn) == 30
    across = drawn[:, BOB.joint_of["left_up_leg"]] - drawn[:, BOB.joint_of["right_up_leg"]]
    across += drawn[:, BOB.joint_of["left_arm"]] - drawn[:, BOB.joint_of["right_arm"]]
    assert np.allclose(across[:, 2], 0, atol=1e-9)
    assert (across[:, 0] > 0).all()


def test_two_data_sets_in_one_process_do_not_mix():
    method, source = LinearJoints(), part(swing(ANN, 0), GIVEN)
    first, second = cast(), cast(numbers=(3,))
    alone = answer(LinearJoints(), source, ANN, second)
    answer(method, source, ANN, first)
    assert np.array_equal(answer(method, source, ANN, second), alone)


@pytest.mark.parametrize("make", METHODS)
@pytest.mark.parametrize("training", [None, {}, {"toy17": {}}])
def test_without_training_motion_there_is_no_answer(make, training):
    with pytest.raises(NotSupported, match=r"no motion to train on that ann \(toy17\) could copy"):
        make().retarget(part(swing(ANN, 0), GIVEN), ANN, context=Context(training=training))


@pytest.mark.parametrize("make", METHODS)
def test_other_bodies_are_refused(make):
    assert "has other proportions" in make().supports(ANN, BOB)
    assert "has no joint 'Hips'" in make().supports(ANN, reduced(ANN, GIVEN))


# ---------------------------------------------------------------------------------------- filters over time
JOINTS = len(ANN.skeleton)
RNG = np.random.default_rng(3)


def positions(places: np.ndarray, fps: float = 30.0) -> Positions:
    return Positions(ANN, places, fps)


def smoothed(method, source) -> np.ndarray:
    answer = method.retarget(source, ANN, context=Context())
    assert (answer.frames, answer.fps) == (source.frames, source.fps)
    return answer.positions


def polynomial(order: int, frames: int = 50) -> np.ndarray:
    time = np.linspace(-1, 1, frames)
    weights = RNG.normal(size=(order + 1, JOINTS, 3))
    return np.einsum("tk,kjc->tjc", time[:, None] ** np.arange(order + 1), weights)


@pytest.mark.parametrize(("window", "order"), [(21, 2), (7, 3), (9, 4), (5, 1), (1, 0)])
def test_savitzky_golay_leaves_polynomials_of_its_order_alone(window, order):
    places = polynomial(order)
    assert np.allclose(smoothed(SavitzkyGolay(window, order), positions(places)), places, atol=1e-9)


def test_savitzky_golay_is_the_least_squares_fit_at_the_middle_of_its_window():
    places = RNG.normal(size=(30, JOINTS, 3))
    filtered = smoothed(SavitzkyGolay(9, 2), positions(places))
    window = np.arange(-4, 5)
    for frame in (4, 11, 25):
        fit = np.polynomial.polynomial.polyfit(window, places[frame - 4 : frame + 5].reshape(9, -1), 2)
        assert np.allclose(filtered[frame].ravel(), fit[0], atol=1e-9)


def test_savitzky_golay_takes_as_many_seconds_at_any_rate():
    places = RNG.normal(size=(60, JOINTS, 3))
    at_sixty = smoothed(SavitzkyGolay(9, 2), positions(places, 60.0))
    assert np.allclose(at_sixty, smoothed(SavitzkyGolay(19, 2), positions(places)), atol=1e-12)


@pytest.mark.parametrize("sigma", [0.02, 0.1, 0.5])
def test_a_gaussian_leaves_steady_motion_alone(sigma):
    places = polynomial(1)
    assert np.allclose(smoothed(GaussianFilter(sigma), positions(places)), places, atol=1e-9)


def test_a_gaussian_damps_a_wave_by_its_known_share():
    frames, period, sigma = 400, 20, 0.1
    wave = np.sin(2 * np.pi * np.arange(frames) / period)
    places = np.broadcast_to(wave[:, None, None], (frames, JOINTS, 3))
    filtered = smoothed(GaussianFilter(sigma), positions(places))
    share = np.exp(-0.5 * (2 * np.pi / period * sigma * 30) ** 2)
    assert np.allclose(filtered[50:-50], share * places[50:-50], atol=2e-3)


def test_the_width_follows_the_noise():
    clean = swing(ANN, 0, 200).positions
    for deviation in (0.005, 0.02, 0.08):
        noisy = clean + deviation * np.random.default_rng(1).normal(size=clean.shape)
        assert noise(noisy) == pytest.approx(deviation, rel=0.05)
        errors = {
            width: np.linalg.norm(smoothed(GaussianFilter(width), positions(noisy)) - clean, axis=-1).mean()
            for width in (0.01, 0.03, 0.06, 0.12, 0.25, "auto")
        }
        best = min(error for width, error in errors.items() if width != "auto")
        assert errors["auto"] < 1.2 * best


@pytest.mark.parametrize(
    "method", [SavitzkyGolay(), SavitzkyGolay(9, 4), GaussianFilter(), GaussianFilter(0.1)]
)
@pytest.mark.parametrize("frames", [1, 2, 3, 4, 5, 6])
def test_short_clips_are_answered(method, frames):
    places = polynomial(1)[:frames]
    assert np.allclose(smoothed(method, positions(places)), places, atol=1e-9)


@pytest.mark.parametrize("method", [Identity(), GaussianFilter(), SavitzkyGolay()])
def test_another_body_is_refused(method):
    assert "another skeleton" in method.supports(ANN, BOB)
    assert method.supports(ANN, body("twin", 1.0)) is None


def test_doing_nothing_gives_the_source_back():
    for source in (swing(ANN, 1), positions(RNG.normal(size=(5, JOINTS, 3)))):
        assert Identity().retarget(source, ANN, context=Context()) is source


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: LinearJoints(ridge=0), "above 0"),
        (lambda: LinearJoints(ridge=float("nan")), "got nan"),
        (lambda: LinearJoints(poses=0), "poses is one or more"),
        (lambda: NearestPose(neighbours=0), "neighbours is one or more"),
        (lambda: GaussianFilter(-0.1), "from 0 to 10; got -0.1"),
        (lambda: GaussianFilter(float("nan")), "got nan"),
        (lambda: GaussianFilter("wide"), "or auto; got 'wide'"),  # type: ignore[arg-type]
        (lambda: SavitzkyGolay(8), "odd number of frames"),
        (lambda: SavitzkyGolay(0), "odd number of frames"),
        (lambda: SavitzkyGolay(5, 5), "less than window"),
        (lambda: SavitzkyGolay(5, -1), "zero or more"),
    ],
)
def test_parameters_that_make_no_sense_are_told(make, words):
    with pytest.raises(BenchError, match=words):
        make()
