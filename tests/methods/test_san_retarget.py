"""SAN as a method: answers on the target's own skeleton, any length, structures that it knows."""

from __future__ import annotations

import numpy as np
import pytest
import san_material
from method_bodies import apart, dance
from san_material import BODIES, trained

from retarget_bench.api import Context
from retarget_bench.errors import NotSupported
from retarget_bench.methods.san import San
from retarget_bench.motion.character import Character


def answer(source: str, target: str, frames: int = 40, **parameters):
    motion = dance(BODIES[source], frames)
    return trained(**parameters).retarget(motion, BODIES[target], context=Context())


def test_a_body_of_a_known_structure_need_not_have_been_trained_on():
    stranger = Character.of("stranger", BODIES["tall"].skeleton, structure="plain")
    motion = dance(BODIES["legs"], 32)
    assert trained().supports(motion.character, stranger) is None
    assert trained().retarget(motion, stranger, context=Context()).character is stranger


def test_other_structures_are_refused_in_a_sentence():
    method = trained()
    dog = BODIES["rex"]
    assert method.supports(BODIES["one"], dog) == (
        "rex is of structure dog, and these weights know plain, short_spine"
    )
    odd = Character.of("odd", BODIES["legs"].skeleton, structure="plain")
    assert "other joints than the plain" in method.supports(odd, BODIES["one"])
    with pytest.raises(NotSupported, match="these weights know"):
        method.retarget(dance(BODIES["one"], 20), dog, context=Context())


def test_people_and_dogs_exchange_motions():
    names = san_material.LEGS
    method = trained(names, structures="all")
    for source, target in (("one", "rex"), ("pup", "tall")):
        answer = method.retarget(dance(BODIES[source], 24), BODIES[target], context=Context())
        assert np.isfinite(answer.positions).all()


def shown(name):
    """The motions of a body that methods of ``san_material`` are trained on."""
    return tuple(dance(BODIES[name], frames, seed) for seed, frames in enumerate((30, 40)))


def test_statistics_of_a_target_come_from_training_or_from_its_references():
    own = San(variant="released", target_stats="own").using(trained(variant="released").tensors)
    assert own.card.needs == ("target_motions",)
    motion = dance(BODIES["one"], 40)
    with pytest.raises(NotSupported, match="no motion of legs"):
        own.retarget(motion, BODIES["legs"], context=Context())
    leaked = own.retarget(motion, BODIES["legs"], context=Context(target_motions=shown("legs")))
    honest = answer("one", "legs", variant="released")
    assert apart(leaked, honest) < 1e-3  # trained on these very motions
    other = own.retarget(motion, BODIES["legs"], context=Context(target_motions=shown("stout")))
    assert apart(other, honest) > 1e-3


def test_ends_of_chains_are_copied_or_rest():
    still = answer("one", "tall", tips="rest")
    hand = BODIES["tall"].skeleton.index("LeftHand")
    assert np.ptp(answer("one", "tall").rotations[:, hand], axis=0).max() > 1e-2
    assert np.ptp(still.rotations[:, hand], axis=0).max() < 1e-6
