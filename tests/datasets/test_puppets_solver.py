"""The parts of the puppets' solver against closed forms, scipy and symmetry."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from retarget_bench.datasets.puppets import matrices
from retarget_bench.datasets.puppets.bodies import rigs
from retarget_bench.datasets.puppets.bodies.characters import BODIES
from retarget_bench.datasets.puppets.bodies.structures import Body
from retarget_bench.datasets.puppets.conventions import FPS, SIDES
from retarget_bench.datasets.puppets.corpus.clips import clips
from retarget_bench.datasets.puppets.curves import (
    hermite,
    lower_envelope,
    plateau,
    smooth,
    soft_min,
    through,
)
from retarget_bench.datasets.puppets.performances.score import Score
from retarget_bench.datasets.puppets.solver import limbs
from retarget_bench.datasets.puppets.solver.limbs import Limb, arm_limb
from retarget_bench.datasets.puppets.solver.people import Manner
from retarget_bench.datasets.puppets.solver.solve import solve
from tests.examples import examples

number = st.floats(-1.0, 1.0)
vector = st.tuples(number, number, number).map(np.array)


def scores() -> list[Score]:
    people = [clip for clip in clips("tiny", "test", 0) if clip.family.name == "people"]
    return [clip.score() for clip in people[::2]]


# --------------------------------------------------------------------------------------------- limbs
@given(vector)
def test_rotation_vectors_agree_with_scipy(v: np.ndarray) -> None:
    turn = matrices.from_vector(3.0 * v)
    np.testing.assert_allclose(turn, Rotation.from_rotvec(3.0 * v).as_matrix(), atol=1e-12)
    if np.linalg.norm(3.0 * v) < 3.0:
        np.testing.assert_allclose(matrices.to_vector(turn), 3.0 * v, atol=1e-7)


@given(vector, vector, vector)
def test_carry_is_the_shortest_turn(a: np.ndarray, b: np.ndarray, v: np.ndarray) -> None:
    if min(np.linalg.norm(a), np.linalg.norm(b)) < 0.1:
        return
    a, b = matrices.unit(a), matrices.unit(b)
    if a @ b < -0.99:
        return
    np.testing.assert_allclose(matrices.carry(a, b, a), b, atol=1e-9)
    axis = np.cross(a, b)
    np.testing.assert_allclose(matrices.carry(a, b, axis), axis, atol=1e-9)
    np.testing.assert_allclose(np.linalg.norm(matrices.carry(a, b, v)), np.linalg.norm(v), atol=1e-9)


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


def test_goals_out_of_reach_are_neared_smoothly() -> None:
    arm = arm_limb("left", BODIES["ada"])
    away = np.linspace(0.02, 2.0, 4000)
    neared = limbs._within(away * arm.longest, arm) / arm.longest
    assert neared.max() < 1.0
    assert neared.min() > arm.shortest / arm.longest - 1e-12
    assert (np.diff(neared) >= 0).all()
    assert np.abs(np.diff(neared, 2)).max() < 0.2 * np.diff(away)[0]
    inside = (away < arm.exact) & (away * arm.longest > 1.06 * arm.shortest)
    np.testing.assert_allclose(neared[inside], away[inside], atol=1e-12)


def test_natural_elbows_point_down_and_back() -> None:
    for side, out in (("left", 1.0), ("right", -1.0)):
        arm = arm_limb(side, BODIES["ada"])
        start, bone = np.zeros((1, 3)), arm.bones[0]
        for goal in ([0.1 * out, -0.9, 0.1], [0.1 * out, 0.0, 0.8], [0.5 * out, 0.3, 0.5]):
            upper, _ = bent(arm, start, np.array([goal]) * arm.longest, 0.0)
            elbow, line = upper[0] @ bone, matrices.unit(np.array(goal))
            off = elbow - line * (elbow @ line)
            assert off[1] < 0.05
            assert off[2] < 0.05 or off[1] < -0.2
            assert off[0] * out > -0.05


# ------------------------------------------------------------------------------------------ symmetry
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


def test_another_manner_is_another_answer_with_the_same_contacts() -> None:
    other = Manner(knees=0.4, elbows=0.35, lower_back=0.15, collar=0.6)
    for score in scores():
        for body in (BODIES["boris"], BODIES["gibbon"]):
            one, two = solve(score, body), solve(score, body, other)
            first, second = (body.positions(each.orientations, each.root) for each in (one, two))
            assert np.array_equal(one.planted, two.planted)
            feet = [body.part[part] for part in ("left_foot", "left_toe", "right_foot", "right_toe")]
            rests = one.planted[..., None]
            np.testing.assert_allclose((second - first)[:, feet] * rests, 0.0, atol=1e-9)
            assert 0.001 < np.linalg.norm(second - first, axis=-1).mean() < 0.15


def test_travel_is_in_leg_lengths() -> None:
    walks = [score for score in scores() if score.kind == "walk"]
    for score in walks:
        ways = []
        for body in BODIES.values():
            feet = body.positions(*_solution(score, body))[:, body.part["left_foot"]]
            ways.append(np.linalg.norm((feet[-1] - feet[0])[[0, 2]]) / body.proportions.leg)
        assert np.ptp(ways) < 0.12


def _solution(score: Score, body: Body) -> tuple[np.ndarray, np.ndarray]:
    solution = solve(score, body)
    return solution.orientations, solution.root


# -------------------------------------------------------------------------------------------- curves
def test_curves_start_and_end_at_rest() -> None:
    t = np.linspace(-1.0, 5.0, 6001)
    for curve in (
        smooth(t),
        plateau(t, 0.0, 1.0, 2.0, 3.5),
        through(t, [0, 1, 2, 3], [0.0, 2.0, 1.0, 4.0]),
    ):
        speed = np.diff(curve) / np.diff(t)
        assert np.abs(np.diff(speed)).max() < 0.05
        assert abs(speed[0]) < 1e-9
        assert abs(speed[-1]) < 1e-9
    flat = plateau(t, 0.0, 1.0, 2.0, 3.5)
    assert (flat[(t >= 1.0) & (t <= 2.0)] == 1.0).all()
    assert (flat[(t <= 0.0) | (t >= 3.5)] == 0.0).all()
    line = hermite(t, (1.0, 3.0), (2.0, 8.0), (3.0, 3.0))
    np.testing.assert_allclose(line[(t > 1) & (t < 3)], 3.0 * t[(t > 1) & (t < 3)] - 1.0, atol=1e-9)


@given(st.lists(st.floats(-5, 5), min_size=12, max_size=60), st.integers(0, 4))
def test_a_lower_envelope_is_never_above(values: list[float], reach: int) -> None:
    heights = np.array(values)
    low = lower_envelope(heights, reach)
    assert low.shape == heights.shape
    assert (low <= heights + 1e-9).all()
    assert (low >= heights.min() - 1e-9).all()
    assert (soft_min(heights, low, 0.1) <= low + 1e-12).all()
