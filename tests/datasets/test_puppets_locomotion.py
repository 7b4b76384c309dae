"""Ways of going and jumping: what tells a run from a walk, physics of flights, stairs that fit."""

from __future__ import annotations

from functools import cache
from itertools import pairwise

import numpy as np
import pytest

from retarget_bench.datasets.puppets.generator.bodies.characters import BODIES
from retarget_bench.datasets.puppets.generator.bodies.structures import Body
from retarget_bench.datasets.puppets.generator.conventions import SIDES
from retarget_bench.datasets.puppets.generator.performances.people import KINDS
from retarget_bench.datasets.puppets.generator.performances.score import Score
from retarget_bench.datasets.puppets.generator.randomness import Stream
from retarget_bench.datasets.puppets.generator.solver.limbs import centre_of_mass
from retarget_bench.datasets.puppets.generator.solver.reach import ground, stairs_misfit
from retarget_bench.datasets.puppets.generator.solver.solve import Solution, solve
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


@pytest.mark.parametrize("kind", FLYING)
@pytest.mark.parametrize("name", BUILDS)
def test_bodies_in_flight_fall_freely(kind: str, name: str) -> None:
    """The centre of mass has one acceleration, 9.81 m/s^2 on a leg of 0.92 m and in proportion on others,
    up to what is left of it after a few passes; no foot is labelled planted."""
    count = 0
    for number in range(2):
        body, solution, places = solved(kind, number, name)
        height = centre_of_mass(body, places)[:, 1] / body.proportions.leg
        for off, strike in score(kind, number).flights:
            assert not solution.planted[max(off + 1, 0) : strike].any()
            if off < 0 or strike >= len(height):
                continue
            fall = np.diff(height[off : strike + 1], 2) * 30.0**2
            np.testing.assert_allclose(fall, -9.81 / 0.92, rtol=0.05)
            count += len(fall)
    assert count > 5


def test_runners_fly_and_walkers_do_not() -> None:
    """A foot is down for less than half of a runner's stride, and for more of a walker's."""
    for kind, flies in (("jog", True), ("run", True), ("walk", False), ("march", False), ("sneak", False)):
        for number in range(3):
            this = score(kind, number)
            plants = this.feet["left"].contacts
            shares = [
                (a.off - a.strike) / (b.strike - a.strike)
                for a, b in pairwise(plants)
                if a.strike > -1000 and b.strike < 1000
            ]
            assert bool(this.flights) == flies
            assert (max(shares) < 0.5) if flies else (min(shares) > 0.5)


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
