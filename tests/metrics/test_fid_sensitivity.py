"""The shipped feature networks notice what such networks are known to miss.

Numbers of all structures, and of more motion: ``tests/benchmarks/fid_sensitivity.py``.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from corruptions import HARMS, Study, mirror, reverse

from retarget_bench import registry
from retarget_bench.metrics.fid import SHIPPED
from retarget_bench.motion.motion import Positions

STRUCTURES = sorted(path.stem for path in SHIPPED.glob("*.json"))
PERFORMANCES = 40


@pytest.fixture(scope="module")
def puppets():
    return registry.create("datasets", "puppets[size=default]")


@pytest.fixture(
    scope="module",
    params=[
        each if each in ("body22", "h36m17") else pytest.param(each, marks=pytest.mark.slow)
        for each in STRUCTURES
    ],
)
def study(request, puppets):
    return Study(puppets, request.param, PERFORMANCES)


@pytest.mark.parametrize("name", HARMS)
def test_harm_raises_fid_and_kid_the_more_the_worse_it_is(study, name):
    harm, amounts = HARMS[name]
    found = [study.notice(), *(study.notice(harm, amount) for amount in amounts)]
    for distance in ("fid", "kid"):
        values = [getattr(each, distance) for each in found]
        assert all(less < more for less, more in pairwise(values)), (distance, values)


def test_the_worst_of_every_harm_is_far_beyond_the_floor(study):
    floor = study.notice()
    for harm, amounts in HARMS.values():
        worst = study.notice(harm, amounts[-1])
        assert worst.fid > 2 * floor.fid
        assert worst.coverage < floor.coverage


# ------------------------------------------------------------------------------------ a one-sided set
def lopsided(motion: Positions) -> Positions:
    """The body or its mirror image, whichever holds its left hand higher."""
    left, right = (motion.character.joint_of[f"{side}_hand"] for side in ("left", "right"))
    higher = (motion.positions[:, left, 1] - motion.positions[:, right, 1]).mean()
    return motion if higher > 0 else mirror(motion)


def raised(motion: Positions) -> bool:
    """Whether one hand is held clearly higher than the other."""
    left, right = (motion.character.joint_of[f"{side}_hand"] for side in ("left", "right"))
    apart = (motion.positions[:, left, 1] - motion.positions[:, right, 1]).mean()
    return bool(abs(apart) > 0.05 * motion.character.height)


def ahead(motion: Positions) -> bool:
    """Whether the body travels, forward."""
    root = motion.positions[:, motion.character.joint_of["hips"]]
    return bool(np.hypot(*(root[-1] - root[0])[[0, 2]]) > 0.5 * motion.character.height)


def test_mirroring_a_set_that_is_all_left_handed_is_noticed(puppets):
    study = Study(puppets, "body22", 24, raised)
    study.motions = {key: lopsided(motion) for key, motion in study.motions.items()}
    study.begin()
    floor, mirrored = study.notice(), study.notice(mirror, 1.0)
    assert mirrored.fid > 1.15 * floor.fid
    assert mirrored.kid > floor.kid


def test_running_a_set_that_travels_forward_backwards_is_noticed(puppets):
    study = Study(puppets, "body22", 24, ahead)
    floor, backwards = study.notice(), study.notice(reverse, 1.0)
    assert backwards.fid > 1.15 * floor.fid
    assert backwards.kid > floor.kid
