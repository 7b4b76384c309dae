"""Hands on the own body, blows and kicks, and sequences: what the scores say is what bodies do."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from retarget_bench.datasets.puppets.generator.bodies.characters import BODIES
from retarget_bench.datasets.puppets.generator.conventions import SIDES, sign
from retarget_bench.datasets.puppets.generator.matrices import to_vector
from retarget_bench.datasets.puppets.generator.performances.people import (
    STRUNG,
    sequence,
)
from retarget_bench.datasets.puppets.generator.randomness import Stream
from retarget_bench.datasets.puppets.generator.solver.solve import solve
from retarget_bench.datasets.puppets.generator.solver.touch_points import KINDS as PLACES
from retarget_bench.datasets.puppets.generator.solver.touch_points import resting, touch_point, touching


@pytest.mark.parametrize("name", PLACES)
@pytest.mark.parametrize("body", ["ada", "pip", "titan"])
def test_places_are_mirrored_and_hands_rest_flat_on_them(name: str, body: str) -> None:
    who, mirror = BODIES[body], np.array([-1.0, 1.0, 1.0])
    left, right = (touch_point(f"{side}_{name}", who) for side in SIDES)
    assert left.part.replace("left", "right") == right.part
    for a, b in ((left.at, right.at), (left.normal, right.normal), (left.along, right.along)):
        np.testing.assert_allclose(a * mirror, b, atol=1e-12)
    for side in SIDES:
        turn, wrist = resting(left, side, who.proportions)
        np.testing.assert_allclose(turn @ turn.T, np.eye(3), atol=1e-12)
        assert np.linalg.det(turn) > 0
        np.testing.assert_allclose(
            wrist + turn @ touching(left, side, who.proportions), left.at, atol=1e-12
        )
        # the back of the hand looks out of the body, the fingers where they should
        np.testing.assert_allclose(turn[:, 1], left.normal, atol=1e-12)
        assert turn[:, 0] @ left.along * sign(side) > 0


def test_a_minute_of_many_kinds_is_one_motion() -> None:
    """Feet that are planted rest across every seam, nothing jumps, no kind comes twice in a row."""
    ground = [kind for kind in STRUNG if kind not in ("jump", "leap", "hop")]
    score = sequence(Stream("a minute"), 1800, among=ground)
    acts = score.stretches()[::2]
    assert len(acts) >= 8
    assert set(score.stretches()[1::2]) <= {a for a in score.stretches() if a.kind == "transition"}
    assert all(a.kind != b.kind for a, b in pairwise(acts))
    for name in ("ada", "pip", "clara"):
        body = BODIES[name]
        solution = solve(score, body)
        places = body.positions(solution.orientations, solution.root)
        parts = ("left_foot", "left_toe", "right_foot", "right_toe")
        steps = np.linalg.norm(np.diff(places[:, [body.part[part] for part in parts]], axis=0), axis=-1)
        assert steps[solution.planted[1:]].max() < 1e-6
        turns = to_vector(np.swapaxes(solution.orientations[:-1], -1, -2) @ solution.orientations[1:])
        assert np.degrees(np.linalg.norm(turns, axis=-1)).max() < 40.0
        force = (
            np.linalg.norm(np.diff(places, 2, axis=0), axis=-1) * 900.0 / 9.81 / body.proportions.leg * 0.9
        )
        assert force.max() < 9.0
