"""Who the puppets are: proportions, joint sets and rest poses, against publications and the engine."""

from __future__ import annotations

from collections import Counter
from dataclasses import fields

import numpy as np
import pytest

from retarget_bench.datasets.puppets.generator.bodies import rigs
from retarget_bench.datasets.puppets.generator.bodies.characters import BODIES
from retarget_bench.datasets.puppets.generator.bodies.proportions import (
    ADULT,
    STATURE,
    Proportions,
    correlation,
    drawn,
    human,
)
from retarget_bench.datasets.puppets.generator.bodies.structures import (
    BODY22,
    H36M17,
    STRUCTURES,
    Body,
    Structure,
)
from retarget_bench.datasets.puppets.generator.solver.limbs import centre_of_mass
from retarget_bench.motion.role_finding import find
from retarget_bench.motion.roles import ESSENTIAL, in_order, is_quadruped
from retarget_bench.motion.structures import S23, S28, reduce

everybody = pytest.mark.parametrize("body", BODIES.values(), ids=lambda body: body.name)


def test_mean_people_are_the_published_ones() -> None:
    """Arms: de Leva (1996), table 4, millimetres at statures of 1.735 m (women) and 1.741 m (men). Legs:
    heights of trochanterion and lateral femoral epicondyle in ANSUR II, shares of stature."""
    woman, man = human("woman", 1.735), human("man", 1.741)
    arms = [round(1000 * x, 1) for p in (woman, man) for x in (p.upper_arm, p.forearm)]
    assert arms == [275.1, 264.3, 281.7, 268.9]
    for sizes, stature, hip, knee in ((woman, 1.735, 0.519, 0.286), (man, 1.741, 0.5128, 0.2799)):
        assert abs(sizes.leg / stature - hip) < 1e-9
        assert abs((sizes.shank + sizes.ankle) / stature - knee) < 1e-9


def crown(sizes: Proportions) -> float:
    return float(BODY22.positions(sizes)["head"][1] + sizes.head)


@pytest.mark.parametrize("structure", STRUCTURES.values(), ids=lambda each: each.name)
def test_people_are_as_tall_as_they_say(structure: Structure) -> None:
    """From sole to crown, for any stature and age, in every structure; every length is positive."""
    for sex, stature, age in (("woman", 1.5, ADULT), ("man", 2.0, ADULT), ("man", 1.2, 6)):
        sizes = human(sex, stature, age)
        assert all(getattr(sizes, each.name) > 0 for each in fields(sizes) if each.name != "hunch")
        top = structure.positions(sizes)["head"][1] + sizes.head
        assert abs(top - stature) < 1e-9


def test_children_are_no_small_adults() -> None:
    """Larger heads, shorter legs and arms for their stature (Snyder et al. 1977, Fredriks et al. 2005)."""
    for sex in ("woman", "man"):
        child, grown = human(sex, 1.0, 6), human(sex, 1.0)
        assert 1.2 < child.head / grown.head < 1.3
        assert 0.95 < child.leg / grown.leg < 0.98
        assert 0.92 < child.arm / grown.arm < 0.97
        assert human(sex, 1.0, 12).leg > human(sex, 1.0, 8).leg


def test_drawn_people_have_the_spreads_and_correlations_of_the_tables() -> None:
    people = [drawn(f"somebody {k}", "woman") for k in range(1500)]
    stature = np.array([crown(sizes) for sizes in people])
    assert abs(stature.mean() - STATURE["woman"][0]) < 0.006
    assert abs(stature.std() - STATURE["woman"][1]) < 0.006
    parts = ("thigh", "shank", "upper_arm", "forearm", "hand", "ball", "shoulder_half", "hip_half")
    shares = np.array([[getattr(sizes, part) for part in parts] for sizes in people]) / stature[:, None]
    spread = shares.std(axis=0) / shares.mean(axis=0)
    assert np.abs(spread - [0.032, 0.034, 0.035, 0.036, 0.040, 0.033, 0.041, 0.055]).max() < 0.003
    assert np.abs(np.corrcoef(shares.T) - correlation()[:8, :8]).max() < 0.08
    # who has long legs sits low: ANSUR II, sitting height and stature correlate by 0.78
    sitting = stature - np.array([sizes.leg for sizes in people])
    assert 0.6 < np.corrcoef(stature, sitting)[0, 1] < 0.9
    assert drawn("ada", "woman") == drawn("ada", "woman") != drawn("eva", "woman")


def test_masses_add_up_and_balance_on_the_middle() -> None:
    body = BODIES["ada"]
    still = np.tile(np.eye(3), (1, len(body.structure.parts), 1, 1))
    places = body.positions(still, body.offsets[:1])
    centre = centre_of_mass(body, places)[0]
    # a standing woman's centre of mass lies at 53 to 60 % of her stature (de Leva 1996: 57 %)
    assert 0.53 < centre[1] / 1.629 < 0.60
    assert abs(centre[0]) < 1e-9
    moved = centre_of_mass(body, places + np.array([1.0, 2.0, 3.0]))[0]
    np.testing.assert_allclose(moved - centre, [1.0, 2.0, 3.0])


def test_the_cast_is_large_enough_and_part_of_it_held_out() -> None:
    count = Counter(body.structure.name for body in BODIES.values())
    for structure, least in {"body22": 12, "body28": 12, "body23": 6, "h36m17": 6}.items():
        assert count[structure] >= least
        bodies = [body for body in BODIES.values() if body.structure.name == structure]
        held = sum(body.held_out for body in bodies)
        assert held == len(bodies) if structure == "h36m17" else 0.25 <= held / len(bodies) <= 0.5
        assert {body.rest for body in bodies} == set(rigs.RESTS)


@everybody
def test_roles_are_whole_and_as_the_names_say(body: Body) -> None:
    who = rigs.character(body)
    assert set(ESSENTIAL) <= set(who.joint_of)
    assert in_order(who.skeleton, who.roles)
    assert not is_quadruped(who.skeleton, who.roles)
    assert who.structure == body.structure.name
    assert len(who.skeleton) == int(body.structure.name[-2:])
    if body.structure is not H36M17:  # whose shoulders are arms to us and collar bones to a reader of names
        assert who.roles == find(who.skeleton)


@everybody
def test_the_reference_pose_is_the_t_pose(body: Body) -> None:
    """Every joint where the T-pose has it, however the rest pose is drawn."""
    who = rigs.character(body)
    still = who.motion(who.reference_pose[None], body.offsets[:1], 30.0)
    places = body.structure.positions(body.proportions)
    for joint, part in enumerate(body.structure.parts[: body.structure.joints]):
        np.testing.assert_allclose(still.positions[0, joint], places[part], atol=1e-9)


def test_structures_are_those_of_the_papers() -> None:
    """Names and parents that the engine's own reductions ask for; nothing is left out by them."""
    for name, structure, expected in (("quinn", "S23", S23), ("clara", "S28", S28)):
        who = rigs.character(BODIES[name])
        assert set(who.skeleton.names) == set(expected)
        assert len(reduce(who, structure).joints) == len(who.skeleton)
        assert reduce(who, "body22").character.joint_of.keys() >= set(ESSENTIAL)
    pelvis = rigs.character(BODIES["quinn"]).skeleton
    assert pelvis.parents[pelvis.index("LeftUpLeg")] == pelvis.index("Pelvis")
    assert pelvis.names[0] == "Hips"
