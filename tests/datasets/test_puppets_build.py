"""How unlike bodies are built, and that pairs of unlike build are preferred."""

from __future__ import annotations

from itertools import permutations

import numpy as np
import pytest
from scipy.stats import chi2

from retarget_bench.datasets.puppets import plugin as Puppets
from retarget_bench.datasets.puppets.bodies.characters import BODIES, PEOPLE
from retarget_bench.datasets.puppets.bodies.proportions import correlation, drawn
from retarget_bench.datasets.puppets.corpus.families import RATIOS, bodies_of, build, families, unlikeness
from retarget_bench.datasets.puppets.randomness import Stream


def test_build_is_of_proportions_and_not_of_size() -> None:
    ada, boris = (BODIES[name].proportions for name in ("ada", "boris"))
    np.testing.assert_allclose(build(ada.scaled(1.7)), build(ada), atol=1e-12)
    assert len(build(ada)) == len(RATIOS)
    # boris has thighs 1.04 and shanks 0.95 times the mean man's
    mean_man = boris.scaled(thigh=1 / 1.04, shank=1 / 0.95)
    moved = build(boris) - build(mean_man)
    assert moved[list(RATIOS).index("thigh to shank")] == pytest.approx(np.log(1.04 / 0.95))
    assert moved[list(RATIOS).index("arm to trunk")] == pytest.approx(0.0)


@pytest.mark.parametrize("family", families(), ids=lambda family: family.name)
def test_unlikeness_is_a_distance_that_no_last_digit_moves(family) -> None:
    unlike, names = unlikeness(family), list(family.bodies)
    builds = np.array([build(body.proportions) for body in family.bodies.values()])
    builds /= builds.std(axis=0)
    exact = 100.0 * np.sqrt(((builds[:, None] - builds) ** 2).mean(axis=-1))
    for i, a in enumerate(names):
        for j, b in enumerate(names):
            assert unlike[a, b] == unlike[b, a] == round(exact[i, j])
            assert (a == b) == (unlike[a, b] == 0)
            # far from where rounding turns
            assert a == b or abs(exact[i, j] % 1.0 - 0.5) > 1e-6, (a, b)


@pytest.mark.parametrize("size", ["tiny", "default"])
@pytest.mark.parametrize("split", ["intra", "cross"])
def test_cases_prefer_pairs_of_unlike_build(size: str, split: str) -> None:
    """They are more unlike than if every body met all its partners equally often."""
    people = families()[0]
    unlike, names = unlikeness(people), bodies_of(people, "test")

    def partners(a: str) -> list[str]:
        same = people.bodies[a].structure
        return [b for b in names if b != a and (people.bodies[b].structure is same) == (split == "intra")]

    evenly = np.mean([np.mean([unlike[a, b] for b in partners(a)]) for a in names])
    infos = [i for i in Puppets(size=size).cases("retarget", split) if i.kind in people.kinds]
    dealt = np.mean([unlike[info.source, info.target] for info in infos])
    # where there are few cases, there is more choice
    assert dealt > (1.2 if size == "tiny" else 1.05) * evenly


def test_people_are_unlike_and_yet_such_as_there_are() -> None:
    """Each within the ellipsoid of 95 % of people; 1.5 times as unlike as those who are drawn first."""

    def spread(builds: list[np.ndarray]) -> float:
        units = np.std([build(body.proportions) for body in BODIES.values()], axis=0)
        return float(
            np.mean([np.sqrt((((a - b) / units) ** 2).mean()) for a, b in permutations(builds, 2)])
        )

    for name, (_, _, number) in PEOPLE.items():
        stream = Stream("puppets", "person", f"{name} {number}")
        stature, own = stream.normal(), np.array([stream.normal() for _ in correlation()])
        assert abs(stature) <= 2.0, name
        assert own @ own <= chi2(9).ppf(0.95), name
    chosen = [build(BODIES[name].proportions) for name in PEOPLE]
    first = [build(drawn(f"{name} 1", sex, age)) for name, (sex, age, _) in PEOPLE.items()]
    assert spread(chosen) > 1.5 * spread(first)
