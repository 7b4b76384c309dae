"""The puppets' solver: symmetries of its answers."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from retarget_bench.datasets.puppets.generator.bodies import rigs
from retarget_bench.datasets.puppets.generator.bodies.characters import BODIES
from retarget_bench.datasets.puppets.generator.bodies.structures import Body
from retarget_bench.datasets.puppets.generator.conventions import FPS
from retarget_bench.datasets.puppets.generator.corpus.clips import clips
from retarget_bench.datasets.puppets.generator.performances.score import Score
from retarget_bench.datasets.puppets.generator.solver.solve import solve


def scores() -> list[Score]:
    people = [clip for clip in clips("tiny", "test", 0) if clip.family.name == "people"]
    return [clip.score() for clip in people[::2]]


def scaled(body: Body, factor: float) -> Body:
    return Body(body.name, body.structure, body.proportions.scaled(factor), body.rest)


@pytest.mark.parametrize("name", ["ada", "gibbon"])
def test_a_body_twice_as_large_moves_twice_as_far(name: str) -> None:
    """Of a uniformly larger body nothing but size differs: all rules of scaling are in its own lengths."""
    body = BODIES[name]
    for score in scores()[:5]:
        small, large = solve(score, body), solve(score, scaled(body, 2.0))
        np.testing.assert_allclose(large.root, 2.0 * small.root, atol=1e-9)
        np.testing.assert_allclose(large.orientations, small.orientations, atol=1e-9)
        assert np.array_equal(large.planted, small.planted)


def test_how_a_rest_pose_is_drawn_changes_nothing() -> None:
    """Other rotations, the same places."""
    drawn = [replace(BODIES["clara"], rest=rest) for rest in rigs.RESTS]
    solution = solve(scores()[0], drawn[0])
    characters = [rigs.character(body) for body in drawn]
    motions = [
        who.motion(rigs.rotations(solution.orientations, body, who), solution.root, FPS)
        for body, who in zip(drawn, characters, strict=True)
    ]
    for other in motions[1:]:
        np.testing.assert_allclose(other.positions, motions[0].positions, atol=1e-9)
        assert np.abs(other.rotations - motions[0].rotations).max() > 0.3
    np.testing.assert_allclose(
        motions[0].positions, drawn[0].positions(solution.orientations, solution.root), atol=1e-9
    )
