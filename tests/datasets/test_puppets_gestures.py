"""Hands on the own body, blows and kicks, and sequences: what the scores say is what bodies do."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from retarget_bench.datasets.puppets.bodies.characters import BODIES
from retarget_bench.datasets.puppets.bodies.structures import Body
from retarget_bench.datasets.puppets.conventions import SIDES, sign
from retarget_bench.datasets.puppets.matrices import to_vector
from retarget_bench.datasets.puppets.performances.fading import bridged
from retarget_bench.datasets.puppets.performances.people import (
    FROM_STAND_TO_STAND,
    KINDS,
    LEAST,
    STRUNG,
    sequence,
)
from retarget_bench.datasets.puppets.performances.people.arms import Move, Shape, moving
from retarget_bench.datasets.puppets.performances.people.sequencing import BRIDGE, joined, stands
from retarget_bench.datasets.puppets.performances.people.style import Performer, Style
from retarget_bench.datasets.puppets.performances.score import Score
from retarget_bench.datasets.puppets.randomness import Stream
from retarget_bench.datasets.puppets.solver.reach import out_of_reach
from retarget_bench.datasets.puppets.solver.solve import Solution, solve
from retarget_bench.datasets.puppets.solver.touch_points import KINDS as PLACES
from retarget_bench.datasets.puppets.solver.touch_points import resting, touch_point, touching

ADA = BODIES["ada"]


def drawn(kind: str, frames: int = 120, number: int = 0) -> Score:
    return KINDS[kind](Stream("gestures", kind, number), frames)


def point(body: Body, solution: Solution, part: str, at: np.ndarray) -> np.ndarray:
    """``(frames, 3)`` metres: a point of a joint's bone, given in the T-pose's axes."""
    joint = body.part[part]
    return (
        body.positions(solution.orientations, solution.root)[:, joint]
        + solution.orientations[:, joint] @ at
    )


# ------------------------------------------------------------------------------------------- places
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


def test_most_bodies_reach_what_gestures_ask() -> None:
    """What falls short is told in metres, by the same measure as the touches that count."""
    for kind in ("clap", "hands_on_hips", "arms_crossed", "bow"):
        score = drawn(kind)
        assert not any(out_of_reach(score, body, solve(score, body)) for body in BODIES.values()), kind
    score = drawn("touch_head")
    short = {name for name, body in BODIES.items() if out_of_reach(score, body, solve(score, body))}
    assert len(short) < len(BODIES) / 4


# ------------------------------------------------------------------------------------------ gestures
def test_palms_meet_at_every_clap_and_only_then() -> None:
    score = drawn("clap", 150)
    for body in (ADA, BODIES["pip"]):
        solution = solve(score, body)
        palms = [
            point(
                body,
                solution,
                f"{side}_hand",
                touching(touch_point("left_palm", body), side, body.proportions),
            )
            for side in SIDES
        ]
        gap = np.linalg.norm(palms[0] - palms[1], axis=-1)
        met = score.hands["right"].touches[0].weight == 1.0
        assert met.sum() == 2 * score.parameters["claps"]
        assert gap[met].max() < 1e-6
        # between two claps the hands are apart by more than a hand's breadth
        between = np.flatnonzero(met)
        for a, b in pairwise(between):
            if b - a > 1:
                assert gap[a:b].max() > 0.08


def test_a_touching_hand_stays_while_the_shape_holds() -> None:
    moves = [Move(5, 20, Shape((0.3, -0.7, 0.0), touch="left_hip")), Move(40, 60)]
    hand = moving(Performer(Stream("hand"), 80, Style.draw(Stream("style"))), moves)
    (touch,) = hand.touches
    assert touch.place == "left_hip"
    assert (touch.weight[20:41] == 1.0).all()
    assert (touch.weight[:5] == 0.0).all()
    assert (touch.weight[61:] == 0.0).all()
    assert np.abs(np.diff(touch.weight, 2)).max() < 0.1


@pytest.mark.parametrize("kind", ["kick_front", "kick_side"])
def test_kicks_leave_the_floor_and_come_back_to_it(kind: str) -> None:
    score = drawn(kind)
    side = str(score.parameters["first"])
    for body in (ADA, BODIES["pip"], BODIES["titan"]):
        solution = solve(score, body)
        height = point(body, solution, f"{side}_foot", np.zeros(3))[:, 1]
        assert height.max() > 0.35 * body.proportions.leg
        assert solution.planted[-1, 0 if side == "left" else 2]


# ----------------------------------------------------------------------------------------- sequences
def test_sequences_are_as_long_as_asked_and_say_what_they_are() -> None:
    kinds = ("wave", "kick_front", "bow")
    score = sequence(Stream("a sequence"), 500, kinds)
    assert score.frames == 500
    acts = score.stretches()
    assert [act.kind for act in acts] == ["wave", "transition", "kick_front", "transition", "bow"]
    assert acts[0].first == 0
    assert acts[-1].end == 500
    assert all(a.end == b.first for a, b in pairwise(acts))
    assert all(act.end - act.first == BRIDGE for act in acts[1::2])
    phases = score.phases()
    assert phases.shape == (500,)
    assert all(phases[act.first] == 0.0 for act in acts)
    assert ((phases >= 0.0) & (phases < 1.0)).all()


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


@pytest.mark.parametrize("kind", STRUNG)
def test_what_is_strung_together_often_begins_and_ends_standing(kind: str) -> None:
    both, make = 0, FROM_STAND_TO_STAND.get(kind, KINDS[kind])
    for number in range(16):
        score = make(Stream("gestures", kind, number), max(110, LEAST.get(kind, 0)))
        both += stands(score, 0) and stands(score, -1)
    assert both >= 1


def test_the_second_part_goes_on_from_where_the_first_ended() -> None:
    """One foot stays to the last digit, the heading is the same, and the part is otherwise unchanged."""
    first, second = drawn("wave"), drawn("kick_side")
    for anchor in SIDES:
        whole = joined(first, second, anchor)
        assert (
            len(whole.feet[anchor].plants)
            == len(first.feet[anchor].plants) + len(second.feet[anchor].plants) - 1
        )
        assert whole.heading[first.frames] == pytest.approx(first.heading[-1], abs=1e-9)
        np.testing.assert_array_equal(whole.height[-second.frames :], second.height)
        np.testing.assert_allclose(
            np.diff(whole.heading[-second.frames :]), np.diff(second.heading), atol=1e-12
        )


def test_bridges_keep_value_and_speed() -> None:
    t = np.arange(40.0)
    a, b = 0.02 * t, 3.0 - 0.05 * t
    whole = bridged(a, b, 30)
    assert whole.shape == (110,)
    np.testing.assert_array_equal(whole[:40], a)
    np.testing.assert_array_equal(whole[-40:], b)
    assert np.abs(np.diff(whole, 2)).max() < 0.03
    still = bridged(np.ones(5), np.ones(7), 20, 0.0, 1.0)
    assert (still == 1.0).all()
