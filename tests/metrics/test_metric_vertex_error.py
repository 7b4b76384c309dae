"""Vertex errors against their formulas written out, and what they must and must not feel."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from mesh_cases import BALLS, as_surface, body_of, sides, skin
from metric_cases import Sides, compute, motion
from scipy.spatial.transform import Rotation


def kabsch(p: np.ndarray, g: np.ndarray) -> tuple[np.ndarray, float]:
    """Turn (3, 3) and scale of the best fit of points p onto g, by the textbook (Umeyama 1991)."""
    p, g = p - p.mean(axis=0), g - g.mean(axis=0)
    u, spread, vt = np.linalg.svd(g.T @ p)
    sign = np.array([1.0, 1.0, np.sign(np.linalg.det(u @ vt))])
    return u @ np.diag(sign) @ vt, (spread * sign).sum() / (p**2).sum()


def plain(case: Sides) -> dict[str, float]:
    """All values from their formulas, frame by frame."""
    body = case.predicted.character
    p, g = (skin(side, body) for side in (case.predicted, case.expected))
    rigid, similar, edges, fitted = [], [], [], []
    for a, b in zip(p, g, strict=True):
        turn, scale = kabsch(a, b)
        centred = a - a.mean(axis=0)
        fitted.append(centred @ turn.T + b.mean(axis=0))
        rigid.append(np.linalg.norm(fitted[-1] - b, axis=1).mean())
        similar.append(np.linalg.norm(scale * centred @ turn.T - (b - b.mean(axis=0)), axis=1).mean())
        apart = np.linalg.norm(b[:, None] - b[None], axis=2)
        np.fill_diagonal(apart, np.inf)
        near = np.argsort(apart, axis=1)[:, :6]
        now = np.linalg.norm(a[:, None] - a[None], axis=2)
        edges.append(np.abs(np.take_along_axis(now - apart, near, axis=1)).mean())

    def acceleration(x: np.ndarray) -> float:
        off = [(x - g)[t + 1] - 2 * (x - g)[t] + (x - g)[t - 1] for t in range(1, len(x) - 1)]
        return float(np.linalg.norm(off, axis=2).mean()) * (case.predicted.fps / 30.0) ** 2

    metres = {
        "mpvd_h": np.linalg.norm(p - g, axis=2).mean(),
        "pa_mpvd.rigid": np.mean(rigid),
        "pa_mpvd.similarity": np.mean(similar),
        "medl_h": np.mean(edges),
    }
    values = {"vertex_acc": acceleration(p), "pa_vertex_acc.rigid": acceleration(np.array(fitted))}
    return values | {id_: 100.0 * value / body.height for id_, value in metres.items()}


@pytest.mark.parametrize(("seed", "fps"), [(0, 30.0), (1, 60.0)])
def test_every_value_is_its_formula(seed: int, fps: float) -> None:
    case = sides(8, seed, fps=fps)
    # vertices of a ball have neighbours at equal distances: which six these are must not matter
    rng = np.random.default_rng(seed)
    body = case.predicted.character
    rough = body.surface(skin(case.expected, body) + rng.normal(scale=1e-3, size=(8, 396, 3)), fps)
    case = replace(case, expected=rough)
    assert compute("vertex_error", case) == pytest.approx(plain(case), rel=1e-11)


def test_vertices_say_the_same_as_the_rotations_that_move_them() -> None:
    case = sides(6)
    assert compute("vertex_error", as_surface(case, skin(case.predicted, case.predicted.character))) == (
        compute("vertex_error", case)
    )


def test_what_an_alignment_forgives() -> None:
    case = sides(6, 3)
    body = case.predicted.character
    truth = skin(case.expected, body)
    turns = Rotation.from_rotvec(np.outer(np.arange(6.0), [0.1, 0.3, -0.2]))
    elsewhere = np.array([turn.apply(frame) for turn, frame in zip(turns, truth, strict=True)]) + 0.5
    values = compute("vertex_error", as_surface(case, elsewhere))
    for id_ in ("pa_mpvd.rigid", "pa_mpvd.similarity", "medl_h", "pa_vertex_acc.rigid"):
        assert values[id_] == pytest.approx(0.0, abs=1e-9)
    assert values["mpvd_h"] > 10.0
    bigger = compute("vertex_error", as_surface(case, 1.2 * elsewhere))
    assert bigger["pa_mpvd.similarity"] == pytest.approx(0.0, abs=1e-9)
    assert min(bigger["pa_mpvd.rigid"], bigger["medl_h"]) > 0.1
    mirrored = compute("vertex_error", as_surface(case, truth * [-1.0, 1.0, 1.0]))
    assert mirrored["pa_mpvd.similarity"] > 1.0


def test_left_out_without_a_mesh_vertices_or_enough_of_them() -> None:
    case = sides(4)
    assert compute("vertex_error", case.by_positions()) == {}
    assert compute("vertex_error", replace(case, expected=None)) == {}
    body = body_of({"Head": (0.1, (0.0, 0.0, 0.0))}, rounds=0)
    two = replace(
        case, predicted=motion(body, 2, 1), expected=motion(body, 2, 2), source=motion(body, 2, 0)
    )
    values = compute("vertex_error", two)
    # an octahedron has six vertices, and two frames have no acceleration
    assert set(values) == {"mpvd_h", "pa_mpvd.rigid", "pa_mpvd.similarity"}


def test_points_that_coincide_are_neighbours_of_each_other() -> None:
    """Eight vertices at one place, and seven elsewhere: nobody is a neighbour of itself."""
    case = sides(3, balls=dict(list(BALLS.items())[:1]))
    together = skin(case.expected, case.predicted.character).copy()
    together[:, :8] = together[:, :1]
    still = replace(case, expected=case.predicted.character.surface(together, 30.0))
    shifted = together.copy()
    shifted[:, 0] += [0.5, 0.0, 0.0]
    count = together.shape[1]
    height = case.predicted.character.height
    values = compute("vertex_error", as_surface(still, shifted))["medl_h"] * height / 100.0
    # six edges from the vertex that moved, each half a metre longer, and some to it
    assert 6 * 0.5 / (6 * count) <= values <= (6 + 7 + 12) * 0.5 / (6 * count)
