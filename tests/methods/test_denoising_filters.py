"""Filters over time: what they leave alone, what they remove, and what they refuse."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

from retarget_bench.api import Context
from retarget_bench.errors import BenchError
from retarget_bench.methods.gaussian_filter import GaussianFilter, noise
from retarget_bench.methods.identity import Identity
from retarget_bench.methods.savitzky_golay import SavitzkyGolay
from retarget_bench.motion.motion import Positions

sys.path.insert(0, str(Path(__file__).parents[1] / "tasks" / "toys"))
from toy_people import body, swing

ANN, BOB = body("ann", 1.0), body("bob", 1.1)
JOINTS = len(ANN.skeleton)
RNG = np.random.default_rng(3)


def positions(places: np.ndarray, fps: float = 30.0) -> Positions:
    return Positions(ANN, places, fps)


def answer(method, source) -> np.ndarray:
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
    assert np.allclose(answer(SavitzkyGolay(window, order), positions(places)), places, atol=1e-9)


def test_savitzky_golay_is_the_least_squares_fit_at_the_middle_of_its_window():
    places = RNG.normal(size=(30, JOINTS, 3))
    filtered = answer(SavitzkyGolay(9, 2), positions(places))
    window = np.arange(-4, 5)
    for frame in (4, 11, 25):
        fit = np.polynomial.polynomial.polyfit(window, places[frame - 4 : frame + 5].reshape(9, -1), 2)
        assert np.allclose(filtered[frame].ravel(), fit[0], atol=1e-9)


def test_savitzky_golay_takes_as_many_seconds_at_any_rate():
    places = RNG.normal(size=(60, JOINTS, 3))
    at_sixty = answer(SavitzkyGolay(9, 2), positions(places, 60.0))
    assert np.allclose(at_sixty, answer(SavitzkyGolay(19, 2), positions(places)), atol=1e-12)


@pytest.mark.parametrize("sigma", [0.02, 0.1, 0.5])
def test_a_gaussian_leaves_steady_motion_alone(sigma):
    places = polynomial(1)
    assert np.allclose(answer(GaussianFilter(sigma), positions(places)), places, atol=1e-9)


def test_a_gaussian_damps_a_wave_by_its_known_share():
    frames, period, sigma = 400, 20, 0.1
    wave = np.sin(2 * np.pi * np.arange(frames) / period)
    places = np.broadcast_to(wave[:, None, None], (frames, JOINTS, 3))
    filtered = answer(GaussianFilter(sigma), positions(places))
    share = np.exp(-0.5 * (2 * np.pi / period * sigma * 30) ** 2)
    assert np.allclose(filtered[50:-50], share * places[50:-50], atol=2e-3)


def test_the_width_follows_the_noise():
    clean = swing(ANN, 0, 200).positions
    for deviation in (0.005, 0.02, 0.08):
        noisy = clean + deviation * np.random.default_rng(1).normal(size=clean.shape)
        assert noise(noisy) == pytest.approx(deviation, rel=0.05)
        errors = {
            width: np.linalg.norm(answer(GaussianFilter(width), positions(noisy)) - clean, axis=-1).mean()
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
    assert np.allclose(answer(method, positions(places)), places, atol=1e-9)


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
