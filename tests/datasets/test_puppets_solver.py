"""The parts of the puppets' solver against closed forms, scipy and symmetry."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from retarget_bench.datasets.puppets import matrices
from retarget_bench.datasets.puppets.bodies import rigs
from retarget_bench.datasets.puppets.bodies.characters import BODIES
from retarget_bench.datasets.puppets.bodies.structures import Body
from retarget_bench.datasets.puppets.conventions import FPS, SIDES
from retarget_bench.datasets.puppets.corpus.clips import clips
from retarget_bench.datasets.puppets.performances.score import Score
from retarget_bench.datasets.puppets.solver import limbs
from retarget_bench.datasets.puppets.solver.limbs import Limb, arm_limb
from retarget_bench.datasets.puppets.solver.solve import solve
from tests.examples import examples

number = st.floats(-1.0, 1.0)
vector = st.tuples(number, number, number).map(np.array)


def scores() -> list[Score]:
    people = [clip for clip in clips("tiny", "test", 0) if clip.family.name == "people"]
    return [clip.score() for clip in people[::2]]


def bent(limb: Limb, start: np.ndarray, goal: np.ndarray, swivel: float) -> tuple[np.ndarray, np.ndarray]:
    """Orientations of the two bones of one limb in one frame."""
    upper, lower = limbs.bend((limb,), start[None], goal[None], np.eye(3)[None], np.array([[swivel]]))
    return upper[0], lower[0]


@examples(80)
@given(
    direction=vector, share=st.floats(0.35, 0.98), swivel=st.floats(-1.5, 1.5), side=st.sampled_from(SIDES)
)
def test_a_limb_ends_where_it_should(direction: np.ndarray, share: float, swivel: float, side: str) -> None:
    if np.linalg.norm(direction) < 0.1:
        return
    arm = arm_limb(side, BODIES["gibbon"])
    start = np.array([[0.3, 1.2, -0.4]])
    goal = start + matrices.unit(direction) * share * arm.longest
    upper, lower = bent(arm, start, goal, swivel)
    for turn in (upper, lower):
        np.testing.assert_allclose(turn[0] @ turn[0].T, np.eye(3), atol=1e-9)
        assert np.linalg.det(turn[0]) > 0
    along, beyond = upper[0] @ arm.bones[0], lower[0] @ arm.bones[1]
    wrist = start[0] + arm.upper * along + arm.lower * beyond
    np.testing.assert_allclose(wrist, goal[0], atol=1e-9)
    # law of cosines: the angle at the elbow follows from the distance alone
    inner = (arm.upper**2 + arm.lower**2 - (share * arm.longest) ** 2) / (2 * arm.upper * arm.lower)
    assert abs(along @ beyond + inner) < 1e-9


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
