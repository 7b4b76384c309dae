"""Skin on skin and soles on the ground: balls at known distances, and the puppets' exact references."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from mesh_cases import as_surface, body_of, sides, skin
from metric_cases import Sides, compute, motion

from retarget_bench.api import Contacts
from retarget_bench.motion.ground import Ground, ground_height

FRAMES = 6
RADIUS = 0.1
LONG = {"LeftHand": (RADIUS, (0.0, 0.0, 0.0)), "Head": (RADIUS, (0.0, 0.0, 0.0))}


def hand_off_head(gap: np.ndarray, expected: np.ndarray, turned: bool = False) -> Sides:
    """Two balls, one of a hand and one a head, in frames of 10 per second: between their surfaces ``gap``
    ``(frames,)`` metres in the prediction and ``expected`` in the reference, along a line through a vertex
    of both; in the prediction to the other side of the head where ``turned``."""
    body = body_of(LONG, rounds=2)
    size = len(body.mesh.vertices) // 2
    unit = (body.mesh.vertices[:size] - body.mesh.vertices[:size].mean(axis=0)) / RADIUS

    def placed(apart: np.ndarray, side: float) -> np.ndarray:
        middle = side * (apart + 2.0 * RADIUS)[:, None] * np.array([1.0, 0.0, 0.0])
        hand = middle[:, None] + RADIUS * unit
        head = np.broadcast_to(RADIUS * unit, hand.shape)
        return np.concatenate([hand, head], axis=1) + np.array([0.0, 1.0, 0.0])

    reference = body.surface(placed(expected, 1.0), 10.0)
    source = motion(body, len(gap), 0, fps=10.0)
    case = Sides(source, reference, reference)
    return as_surface(case, placed(gap, -1.0 if turned else 1.0))


def test_gap_recall_and_precision_of_balls() -> None:
    height = hand_off_head(np.zeros(1), np.zeros(1)).predicted.character.height
    assert 0.015 < height * 0.01 < 0.02
    expected = np.array([0.0, 0.005, 0.01, 0.0, 0.3, 0.3])
    gap = np.array([0.0, 0.02, 0.3, 0.005, 0.0, 0.3])
    values = compute("mesh_contact", hand_off_head(gap, expected))
    # the reference touches in the first four frames, the prediction in 0, 3 and 4; in 1 it is still near
    assert values["mesh_contact_gap_h"] == pytest.approx(100.0 * gap[:4].mean() / height, abs=1e-6)
    assert values["mesh_contact_recall"] == pytest.approx(3 / 4)
    assert values["mesh_contact_precision"] == pytest.approx(2 / 3)


def test_a_touch_at_another_place_is_not_the_one_that_was_asked_for() -> None:
    still = np.zeros(3)
    case = hand_off_head(still, still, turned=True)
    values = compute("mesh_contact", case)
    assert values["mesh_contact_recall"] == 0.0
    # from the far side of the head to the patch, at least past its middle
    gap = values["mesh_contact_gap_h"] * case.predicted.character.height / 100.0
    assert RADIUS < gap < 2.0 * RADIUS
    assert values["mesh_contact_precision"] == 1.0


def test_no_contact_no_value() -> None:
    far = np.full(3, 0.3)
    values = compute("mesh_contact", hand_off_head(far, far))
    assert not [id_ for id_ in values if id_.startswith("mesh_contact")]
    case = hand_off_head(far, far)
    assert compute("mesh_contact", case.by_positions()) == {}
    alone = compute("mesh_contact", replace(case, expected=None))
    assert set(alone) == {f"mesh_ground_penetration.{x}" for x in ("rate", "mean_h")}


def feet(case: Sides, planted: np.ndarray, ground: Ground) -> dict[str, float]:
    """Values with these labels ``(frames, 2)`` of left foot and right toe on a ground."""
    labels = Contacts(("left_foot", "right_toe"), planted)
    return dict(compute("mesh_contact", replace(case, contacts=labels, ground=ground)))


@pytest.mark.parametrize("seed", [0, 1])
def test_soles_and_depths_on_rough_ground_by_loops(seed: int) -> None:
    case, rng = sides(FRAMES, seed), np.random.default_rng(seed)
    body = case.predicted.character
    places = skin(case.predicted, body)
    heights = places[..., 1].min(axis=1).mean() + rng.uniform(-0.1, 0.6, size=(5, 6))
    ground = Ground(heights=heights, origin=(-2.0, -2.0), spacing=0.8)
    planted = rng.random((FRAMES, 2)) < 0.6
    values = feet(case, planted, ground)
    weights, names = body.mesh.weights, body.skeleton.names
    own = {
        side: [v for v in range(len(weights)) if weights[v, names.index(f"{side}Foot")] > 0.5]
        for side in ("Left", "Right")
    }
    depths, gaps = [], []
    for frame, vertices in enumerate(places):
        above = [y - float(ground_height(ground, np.array(x), np.array(z))) for x, y, z in vertices]
        depths.append(max(0.0, -min(above)))
        for k, side in enumerate(("Left", "Right")):
            if planted[frame, k]:
                gaps.append(max(0.0, min(above[v] for v in own[side])))
    assert np.mean(np.array(depths) > 0.01) > 0.0
    assert values["mesh_ground_penetration.rate"] == pytest.approx(100.0 * np.mean(np.array(depths) > 0.01))
    assert values["mesh_ground_penetration.mean_h"] == pytest.approx(
        100 * np.mean(depths) / body.height, rel=1e-9
    )
    assert values["mesh_floating.mean_h"] == pytest.approx(100 * np.mean(gaps) / body.height, abs=1e-9)
