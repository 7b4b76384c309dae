"""Ways of going and jumping: what tells a run from a walk, physics of flights, stairs that fit."""

from __future__ import annotations

from functools import cache
from itertools import pairwise

import numpy as np
import pytest

from retarget_bench.datasets.puppets.bodies.characters import BODIES
from retarget_bench.datasets.puppets.bodies.structures import Body
from retarget_bench.datasets.puppets.conventions import SIDES
from retarget_bench.datasets.puppets.performances.people import KINDS
from retarget_bench.datasets.puppets.performances.people.walking import walk
from retarget_bench.datasets.puppets.performances.score import Score
from retarget_bench.datasets.puppets.randomness import Stream
from retarget_bench.datasets.puppets.solver.limbs import centre_of_mass
from retarget_bench.datasets.puppets.solver.reach import ground, stairs_misfit
from retarget_bench.datasets.puppets.solver.solve import Solution, solve
from retarget_bench.motion.ground import ground_height

FLYING = ("jog", "run", "jump", "leap", "hop")
BUILDS = ("ada", "pip", "gibbon", "titan")


@cache
def score(kind: str, number: int = 0, frames: int = 120) -> Score:
    return KINDS[kind](Stream("puppets", "going", kind, number), frames)


@cache
def solved(kind: str, number: int, name: str) -> tuple[Body, Solution, np.ndarray]:
    body = BODIES[name]
    solution = solve(score(kind, number), body)
    return body, solution, body.positions(solution.orientations, solution.root)


def knee(body: Body, places: np.ndarray, side: str) -> np.ndarray:
    """``(frames,)`` degrees; 0 is straight."""
    hip, middle, ankle = (places[:, body.part[f"{side}_{part}"]] for part in ("up_leg", "leg", "foot"))
    upper, lower = middle - hip, ankle - middle
    cosine = (upper * lower).sum(-1) / np.linalg.norm(upper, axis=-1) / np.linalg.norm(lower, axis=-1)
    return np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0)))


def ahead(heading: np.ndarray) -> np.ndarray:
    return np.stack([np.sin(heading), np.cos(heading)], axis=-1)


# ------------------------------------------------------------------------------------------ flights
@pytest.mark.parametrize("kind", FLYING)
@pytest.mark.parametrize("name", BUILDS)
def test_bodies_in_flight_fall_freely(kind: str, name: str) -> None:
    """The centre of mass has one acceleration, 9.81 m/s^2 on a leg of 0.92 m and in proportion on others,
    up to what is left of it after a few passes; no foot is labelled planted."""
    seen = 0
    for number in range(2):
        body, solution, places = solved(kind, number, name)
        height = centre_of_mass(body, places)[:, 1] / body.proportions.leg
        for off, strike in score(kind, number).flights:
            assert not solution.planted[max(off + 1, 0) : strike].any()
            if off < 0 or strike >= len(height):
                continue
            fall = np.diff(height[off : strike + 1], 2) * 30.0**2
            np.testing.assert_allclose(fall, -9.81 / 0.92, rtol=0.05)
            seen += len(fall)
    assert seen > 5


@pytest.mark.parametrize("kind", ["jump", "leap"])
def test_landings_are_absorbed(kind: str) -> None:
    """Knees are bent little at the first touch, and much more within a third of a second."""
    for name in BUILDS:
        body, _, places = solved(kind, 0, name)
        off, strike = score(kind).flights[0]
        for side in SIDES:
            bend = knee(body, places, side)
            assert bend[strike + 1 : strike + 10].max() > bend[strike] + 20.0
        feet = [body.part[f"{side}_toe"] for side in SIDES]
        apex = places[(off + strike) // 2, feet, 1]
        assert (apex > body.proportions.ball_height + 0.08 * body.proportions.leg).all()


def test_only_one_leg_hops() -> None:
    for number in range(3):
        this = score("hop", number)
        hops = len(this.flights)
        strikes = {side: sum(0 < plant.strike < 1000 for plant in this.feet[side].plants) for side in SIDES}
        assert strikes[str(this.parameters["side"])] == hops >= 1
        assert min(strikes.values()) <= 1


# --------------------------------------------------------------------------------------------- gaits
def test_runners_fly_and_walkers_do_not() -> None:
    """A foot is down for less than half of a runner's stride, and for more of a walker's."""
    for kind, flies in (("jog", True), ("run", True), ("walk", False), ("march", False), ("sneak", False)):
        for number in range(3):
            this = score(kind, number)
            plants = this.feet["left"].plants
            shares = [
                (a.off - a.strike) / (b.strike - a.strike)
                for a, b in pairwise(plants)
                if a.strike > -1000 and b.strike < 1000
            ]
            assert bool(this.flights) == flies
            assert (max(shares) < 0.5) if flies else (min(shares) > 0.5)


@pytest.mark.parametrize(
    ("kind", "knees", "speeds", "oscillation"),
    [
        ("walk", (50.0, 78.0), (0.7, 2.2), (0.02, 0.08)),
        ("jog", (60.0, 105.0), (1.8, 3.2), (0.04, 0.13)),
        ("run", (80.0, 130.0), (2.9, 4.6), (0.04, 0.15)),
    ],
)
def test_gaits_are_within_what_people_do(
    kind: str, knees: tuple[float, float], speeds: tuple[float, float], oscillation: tuple[float, float]
) -> None:
    """Largest bend of the knee, degrees, speed and rise of the hips in leg lengths, of a usual build.
    Recorded motion: knees 64 to 73 walking, 78 to 88 in slow and 103 to 120 in fast running; hips rising by
    0.05 to 0.12 at 1.8 to 4.8 leg lengths a second."""
    for number in range(4):
        this = score(kind, number)
        if this.parameters["mode"] != "steady":
            continue
        body, _, places = solved(kind, number, "boris")
        leg = body.proportions.leg
        hips = 0.5 * sum(places[:, body.part[f"{side}_up_leg"]] for side in SIDES) / leg
        speed = np.linalg.norm(np.diff(hips[:, [0, 2]], axis=0), axis=-1).mean() * 30.0
        assert speeds[0] < speed < speeds[1]
        assert oscillation[0] < np.ptp(hips[:, 1]) < oscillation[1]
        assert all(knees[0] < knee(body, places, side).max() < knees[1] for side in SIDES)


def bend(places: np.ndarray, body: Body, *parts: str) -> np.ndarray:
    """``(frames,)`` degrees between two bones given by their three joints."""
    top, middle, end = (places[:, body.part[part]] for part in parts)
    upper, lower = middle - top, end - middle
    across = np.linalg.norm(np.cross(upper, lower), axis=-1)
    return np.degrees(np.arctan2(across, (upper * lower).sum(axis=-1)))


def test_most_walk_ordinarily_and_some_do_not() -> None:
    """Medians of each walker, degrees. Recorded walkers lean from -5 (proud) to 28 (old, pushing a barrow)
    with a median of 5 to 13, bend their elbows from 17 to 105, and swing their elbows by 10 and more."""
    leans, elbows, swings = [], [], []
    for number in range(30):
        body, this = BODIES["boris"], walk(Stream("puppets", "walkers", number), 70, mode="steady")
        solution = solve(this, body)
        places = body.positions(solution.orientations, solution.root)
        trunk = places[:, body.part["neck"]] - places[:, body.part["hips"]]
        forward = (trunk[:, [0, 2]] * ahead(this.heading)).sum(axis=-1)
        leans.append(np.degrees(np.median(np.arctan2(forward, trunk[:, 1]))))
        for side in SIDES:
            elbow = bend(places, body, *(f"{side}_{part}" for part in ("arm", "forearm", "hand")))
            elbows.append(np.median(elbow))
            swings.append(np.ptp(elbow))
    assert 3.0 < np.median(leans) < 13.0
    assert np.min(leans) < 0.0
    assert np.max(leans) > 15.0
    assert 25.0 < np.median(elbows) < 60.0
    assert np.max(elbows) > 90.0
    assert np.median(swings) > 10.0


def test_running_feet_are_carried_smoothly() -> None:
    """Jerk of ankles, leg lengths a cubic second: of recorded runners 400 to 620 in the median."""
    jerks = []
    for kind in ("jog", "run"):
        for number in range(4):
            body, _, places = solved(kind, number, "boris")
            for side in SIDES:
                third = np.diff(places[:, body.part[f"{side}_foot"]], 3, axis=0)
                jerks.append(np.linalg.norm(third, axis=-1) * 30.0**3 / body.proportions.leg)
    assert 200.0 < np.median(np.concatenate(jerks)) < 900.0


def test_ways_go_where_they_should() -> None:
    """Backwards, sideways, round a bend, or nowhere."""
    for number in range(4):
        for kind, along, across in (("walk", 1, 0), ("walk_backwards", -1, 0), ("walk_sideways", 0, 1)):
            this = score(kind, number)
            steps, forward = np.diff(this.path, axis=0), ahead(this.heading)[1:]
            left = forward[:, ::-1] * np.array([1.0, -1.0])
            gone = np.array([(steps * forward).sum(), (steps * left).sum()])
            assert abs(gone[0] - along * np.linalg.norm(gone)) < 0.15
            assert abs(abs(gone[1]) - across * np.linalg.norm(gone)) < 0.15
            assert np.linalg.norm(gone) > 0.3
        spot = score("turn", number)
        assert np.ptp(spot.path, axis=0).max() < 1e-9
        assert np.ptp(spot.heading) > 0.6
        assert np.ptp(score("arc", number).heading) > 1.2


# -------------------------------------------------------------------------------------------- stairs
@pytest.mark.parametrize("kind", ["stairs_up", "stairs_down"])
@pytest.mark.parametrize("name", ["ada", "boris", "clara", "titan", "stork"])
def test_nobody_is_in_the_stairs(kind: str, name: str) -> None:
    for number in range(2):
        this = score(kind, number)
        body, solution, places = solved(kind, number, name)
        floor, sizes = ground(this, body), body.proportions
        assert stairs_misfit(this, body, solution) < 0.005
        points = [places[:, joint] for joint in range(places.shape[1])]
        for side in SIDES:
            foot, toe = body.part[f"{side}_foot"], body.part[f"{side}_toe"]
            heel = places[:, foot] + solution.orientations[:, foot] @ np.array(
                [0, -sizes.ankle, -sizes.heel]
            )
            points += [heel, places[:, toe] + solution.orientations[:, toe] @ np.array([0, 0, sizes.toes])]
        depth = [ground_height(floor, point[:, 0], point[:, 2]) - point[:, 1] for point in points]
        assert np.max(depth) < 0.005
        for column, part in ((0, "left_foot"), (2, "right_foot")):
            ankle = places[solution.planted[:, column], body.part[part]]
            over = ankle[:, 1] - ground_height(floor, ankle[:, 0], ankle[:, 2])
            np.testing.assert_allclose(over, sizes.ankle, atol=1e-9)


def test_stairs_grow_with_the_performer() -> None:
    """All levels that planted ankles reach are whole rises, of one share of the leg for every body."""
    for kind, way in (("stairs_up", 1.0), ("stairs_down", -1.0)):
        this = score(kind)
        assert this.stairs is not None
        assert this.stairs.rise * way > 0.1
        for name in ("ada", "titan"):
            body, solution, places = solved(kind, 0, name)
            down = solution.planted[:, 0]
            level = places[down, body.part["left_foot"], 1] - body.proportions.ankle
            rises = level / (this.stairs.rise * body.proportions.leg)
            np.testing.assert_allclose(rises, np.round(rises), atol=1e-9)
            assert rises[-1] - rises[0] > 1.5
