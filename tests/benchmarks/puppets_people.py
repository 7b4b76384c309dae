"""Which draw of every person makes the puppets' people most unlike in build.

    python tests/benchmarks/puppets_people.py [--draws 200]

in an environment in which retarget-bench is installed. For every name, out of so many draws from the tables
of ``anthropometry.py``, those count whose nine segments lie within the ellipsoid that holds 95 % of people
and whose stature is within two standard deviations. Going round the names four times, each takes the draw
that is farthest from all others, by ``build.py``'s distance: the mean distance, and half of the
smallest. Prints the numbers for ``characters.py``, and how unlike people are, before and after.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from itertools import permutations

import numpy as np

from retarget_bench.datasets.puppets.bodies.characters import BODIES, PEOPLE
from retarget_bench.datasets.puppets.bodies.proportions import ADULT, correlation, drawn
from retarget_bench.datasets.puppets.corpus.families import build
from retarget_bench.datasets.puppets.randomness import Stream

INSIDE = 16.92
"""95th percentile of chi squared with nine degrees of freedom."""
ALWAYS = ("ada", "boris", "clara")
"""People who are not drawn."""

UNABLE = {"hugo": (141,)}
"""Draws whose wrists would have to bend farther than the quality tests allow, in a catch. At the end the
next best takes such a one's place, and all others stay."""


def candidates(name: str, sex: str, age: int, draws: int) -> dict[int, np.ndarray]:
    """Number -> build, of those within the bounds."""
    found = {}
    for number in range(1, draws + 1):
        stream = Stream("puppets", "person", f"{name} {number}")
        stature, own = stream.normal(), np.array([stream.normal() for _ in correlation()])
        if abs(stature) <= 2.0 and own @ own <= INSIDE:
            found[number] = build(drawn(f"{name} {number}", sex, age))
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--draws", type=int, default=200)
    draws = parser.parse_args().draws
    unnumbered = [build(body.proportions) for name, body in BODIES.items() if name not in PEOPLE]
    spread = np.array(unnumbered).std(axis=0)
    always = [build(BODIES[name].proportions) for name in ALWAYS]
    offered = {name: candidates(name, sex, age, draws) for name, (sex, age, _) in PEOPLE.items()}
    chosen = {name: next(iter(mine)) for name, mine in offered.items()}

    def apart(one: np.ndarray, other: np.ndarray) -> float:
        return float(np.sqrt((((one - other) / spread) ** 2).mean()))

    def others(name: str) -> list[np.ndarray]:
        return [*always, *(offered[each][k] for each, k in chosen.items() if each != name)]

    def report(when: str) -> None:
        builds = [*always, *(offered[name][k] for name, k in chosen.items())]
        gaps = [apart(*pair) for pair in permutations(builds, 2)]
        print(f"{when}: {np.mean(gaps):.2f} apart on average, {min(gaps):.2f} at least")

    def farthest(name: str, without: Sequence[int] = ()) -> int:
        gaps = {
            k: [apart(own, other) for other in others(name)]
            for k, own in offered[name].items()
            if k not in without
        }
        return max(gaps, key=lambda k: np.mean(gaps[k]) + 0.5 * min(gaps[k]))

    report("the first draws")
    for _ in range(4):
        for name in offered:
            chosen[name] = farthest(name)
    for name, numbers in UNABLE.items():
        chosen[name] = farthest(name, numbers)
    report("the chosen ones")
    for name, number in chosen.items():
        sex, age, now = PEOPLE[name]
        years = "" if age == ADULT else f", {age} years"
        print(f"{name}: {number} ({sex}{years}){'' if number == now else f'; characters.py has {now}'}")


if __name__ == "__main__":
    main()
