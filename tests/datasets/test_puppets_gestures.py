"""Hands on the own body, blows and kicks, and sequences: what the scores say is what bodies do."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from retarget_bench.datasets.puppets.bodies.characters import BODIES
from retarget_bench.datasets.puppets.matrices import to_vector
from retarget_bench.datasets.puppets.performances.people import (
    STRUNG,
    sequence,
)
from retarget_bench.datasets.puppets.randomness import Stream
from retarget_bench.datasets.puppets.solver.solve import solve

# ----------------------------------------------------------------------------------------- sequences


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
