"""The best fit: against numerical search, and what it must and must not forgive."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from metric_cases import SCORED, Sides, compute, index, sides
from scipy.spatial.transform import Rotation

VARIANTS = ("rigid", "similarity", "rigid_clip", "similarity_clip")


@pytest.mark.parametrize("seed", range(3))
def test_against_a_loop_of_scipy_fits(seed: int) -> None:
    """scipy finds the proper rotation; the rest is the formula, to 1e-9."""
    case = sides(6, seed)
    body = case.predicted.character
    p, g = (side.positions[:, index(body, SCORED)] for side in (case.predicted, case.expected))
    values = compute("procrustes", case)

    def left(a: np.ndarray, b: np.ndarray) -> tuple[float, float]:
        a, b = a - a.mean(axis=0), b - b.mean(axis=0)
        turned = Rotation.align_vectors(b, a)[0].apply(a)
        scale = (turned * b).sum() / (a * a).sum()
        return tuple(np.linalg.norm(s * turned - b, axis=1).mean() for s in (1.0, scale))

    frames = np.mean([left(a, b) for a, b in zip(p, g, strict=True)], axis=0)
    clip = left(p.reshape(-1, 3), g.reshape(-1, 3))
    for name, value in zip(VARIANTS, (*frames, *clip), strict=True):
        assert values[f"pa_mpjpe.{name}"] == pytest.approx(100 * value / body.height, rel=1e-9)


@pytest.mark.parametrize("fps", [30.0, 60.0])
def test_acceleration_after_one_scipy_fit_of_the_clip(fps: float) -> None:
    case = sides(6, 5, fps=fps)
    body = case.predicted.character
    p, g = (side.positions[:, index(body, SCORED)] for side in (case.predicted, case.expected))
    a, b = (x.reshape(-1, 3) - x.reshape(-1, 3).mean(axis=0) for x in (p, g))
    turned = Rotation.align_vectors(b, a)[0].apply(p.reshape(-1, 3)).reshape(p.shape)
    off = turned - g
    second = [off[t + 1] - 2 * off[t] + off[t - 1] for t in range(1, 5)]
    expected = np.linalg.norm(second, axis=-1).mean() * (fps / 30.0) ** 2
    assert compute("procrustes", case)["pa_acc"] == pytest.approx(expected, rel=1e-9)
    assert not {"pa_acc", "pa_acc.rigid"} & set(compute("procrustes", sides(2, 5)))


def kabsch(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Points a ``(n, 3)`` turned and moved onto b, by the textbook (Kabsch 1976)."""
    u, _, vt = np.linalg.svd((a - a.mean(0)).T @ (b - b.mean(0)))
    turn = (u @ np.diag([1.0, 1.0, np.sign(np.linalg.det(u @ vt))]) @ vt).T
    return (turn @ (a - a.mean(0)).T).T + b.mean(0)


@pytest.mark.parametrize("fps", [30.0, 60.0])
def test_acceleration_after_a_fit_of_every_frame(fps: float) -> None:
    case = sides(6, 5, fps=fps)
    body = case.predicted.character
    p, g = (side.positions[:, index(body, SCORED)] for side in (case.predicted, case.expected))
    fitted = [kabsch(a, b) for a, b in zip(p, g, strict=True)]
    total = 0.0
    for t in range(1, 5):
        own = fitted[t + 1] - 2 * fitted[t] + fitted[t - 1]
        reference = g[t + 1] - 2 * g[t] + g[t - 1]
        total += sum(np.sqrt(((a - b) ** 2).sum()) for a, b in zip(own, reference, strict=True))
    expected = total / (4 * p.shape[1]) * (fps / 30.0) ** 2
    assert compute("procrustes", case)["pa_acc.rigid"] == pytest.approx(expected, rel=1e-9)


def of(case: Sides, positions: np.ndarray) -> dict[str, float]:
    """The values when the prediction is at these positions."""
    predicted = case.predicted.character.positions(positions, case.predicted.fps)
    return dict(compute("procrustes", replace(case, predicted=predicted)))


@pytest.mark.parametrize("axis", range(3))
def test_a_mirrored_body_does_not_fit(axis: int) -> None:
    case = sides(8, 2)
    mirrored = case.expected.positions.copy()
    mirrored[..., axis] *= -1
    values = of(case, mirrored)
    assert all(values[f"pa_mpjpe.{variant}"] > 1.0 for variant in VARIANTS)


def test_joints_all_in_one_place_give_the_size_of_the_reference() -> None:
    case = sides(3, 3)
    body = case.predicted.character
    g = case.expected.positions[:, index(body, SCORED)]
    spread = np.linalg.norm(g - g.mean(axis=1, keepdims=True), axis=-1).mean()
    values = of(case, np.ones_like(case.expected.positions))
    assert values["pa_mpjpe.similarity"] == pytest.approx(100 * spread / body.height, rel=1e-9)
