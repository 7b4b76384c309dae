"""Moving averages of rotations and path: against the formula, and what they leave alone."""

from __future__ import annotations

import numpy as np
import pytest

from retarget_bench.api import Context
from retarget_bench.errors import BenchError
from retarget_bench.motion import rotation
from retarget_bench.motion.motion import Motion
from retarget_bench.plugins import registry
from tests.methods.method_bodies import body, dance

FPS = 30.0


def smoothed(answer: Motion, sigma: float, source: Motion | None = None) -> Motion:
    post = registry.load("posts", "smooth")(sigma=sigma)
    return post.process(answer, answer if source is None else source, context=Context())


def turning(speed: float, frames: int = 40) -> Motion:
    """All joints turn about axes of their own at so many radians per second; the root goes straight on."""
    character = body()
    axes = np.random.default_rng(0).normal(size=(len(character.skeleton), 3))
    axes /= np.linalg.norm(axes, axis=-1, keepdims=True)
    time = np.arange(frames) / FPS
    turns = rotation.from_rotation_vector(speed * time[:, None, None] * axes)
    return character.motion(turns, np.outer(time, [1.0, 0.2, -0.5]), FPS)


def averaged_by_hand(values: np.ndarray, width: float) -> np.ndarray:
    """Frame by frame from the formula: Gaussian weights up to four standard deviations, mirror images
    through the end points beyond the ends."""
    last, reach = len(values) - 1, int(4 * width + 0.5)

    def at(frame: int) -> np.ndarray:
        if frame < 0:
            return 2 * values[0] - values[-frame]
        return values[frame] if frame <= last else 2 * values[last] - values[2 * last - frame]

    around = range(-reach, reach + 1)
    weights = np.exp([-0.5 * (k / width) ** 2 for k in around])
    rows = [
        sum(w * at(n + k) for w, k in zip(weights, around, strict=True)) / weights.sum()
        for n in range(last + 1)
    ]
    return np.array(rows)


def test_the_path_is_averaged_as_the_formula_says():
    answer = dance(body())
    averaged = smoothed(answer, 0.05)
    np.testing.assert_allclose(averaged.root, averaged_by_hand(answer.root, 0.05 * answer.fps), atol=1e-12)


def test_steady_motion_stays_as_it_is():
    answer = turning(speed=1.0)
    averaged = smoothed(answer, 0.04)
    np.testing.assert_allclose(averaged.root, answer.root, atol=1e-12)
    inner = slice(6, -6)  # at the ends mirror images of quaternions are not quite unit
    assert rotation.angle(averaged.rotations[inner], answer.rotations[inner]).max() < 1e-6
    assert rotation.angle(averaged.rotations, answer.rotations).max() < 2e-3


def test_trembling_is_removed_and_signs_of_quaternions_do_not_matter():
    answer, rng = turning(speed=1.0), np.random.default_rng(1)
    noise = rotation.from_rotation_vector(0.05 * rng.normal(size=(*answer.rotations.shape[:2], 3)))
    signs = rng.choice([-1.0, 1.0], size=(*answer.rotations.shape[:2], 1))
    rough = answer.character.motion(
        rotation.multiply(noise, answer.rotations),
        answer.root + 0.01 * rng.normal(size=answer.root.shape),
        FPS,
    )
    flipped = Motion(rough.character, signs * rough.rotations, rough.root, FPS)
    averaged, other = smoothed(rough, 0.06), smoothed(flipped, 0.06)
    assert rotation.angle(averaged.rotations, other.rotations).max() < 1e-7
    for before, after in ((rough, averaged), (rough, other)):
        off = [rotation.angle(each.rotations, answer.rotations).mean() for each in (before, after)]
        assert off[1] < 0.5 * off[0]
        off = [np.abs(each.root - answer.root).mean() for each in (before, after)]
        assert off[1] < 0.5 * off[0]
    np.testing.assert_allclose(np.linalg.norm(averaged.rotations, axis=-1), 1.0, atol=1e-12)


def test_nothing_is_averaged_over_a_cut_of_the_source():
    still = turning(speed=0.0)
    jump = np.where(np.arange(still.frames) < 20, 0.0, 5.0)[:, None] * [1.0, 0.0, 0.0]
    source = still.character.motion(still.rotations, still.root + jump, FPS)
    np.testing.assert_allclose(smoothed(source, 0.1).root, source.root, atol=1e-12)


@pytest.mark.parametrize("frames", [1, 2, 3])
def test_clips_of_a_frame_or_two(frames):
    answer = dance(body()).at(slice(0, frames))
    averaged = smoothed(answer, 0.04)
    assert averaged.frames == frames
    assert np.isfinite(averaged.positions).all()


def test_no_width_changes_nothing_and_a_negative_one_is_refused():
    answer = dance(body())
    assert (smoothed(answer, 0.0).root == answer.root).all()
    with pytest.raises(BenchError, match="sigma is in seconds"):
        smoothed(answer, -1.0)
