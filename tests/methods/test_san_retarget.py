"""SAN as a method: answers on the target's own skeleton, any length, structures that it knows."""

from __future__ import annotations

import numpy as np
import pytest
import san_material
from nkn_toys import apart
from san_material import BODIES, dances, trained

from retarget_bench.api import Context
from retarget_bench.errors import NotSupported
from retarget_bench.methods.san import San
from retarget_bench.motion import rates
from retarget_bench.motion.character import Character
from retarget_bench.training.layers.skeletal import inference


def answer(source: str, target: str, frames: int = 40, **parameters):
    (motion,) = dances(source, (frames,))
    return trained(**parameters).retarget(motion, BODIES[target], context=Context())


@pytest.mark.parametrize("variant", ["own", "released"])
@pytest.mark.parametrize("frames", [1, 2, 15, 16, 33, 64])
def test_any_length_is_answered_on_the_targets_skeleton(variant, frames):
    for source, target in (("one", "tall"), ("one", "legs"), ("stout", "one")):
        found = answer(source, target, frames, variant=variant)
        assert found.character is BODIES[target]
        assert (found.frames, found.fps) == (frames, 30.0)
        assert np.isfinite(found.positions).all()
        np.testing.assert_allclose(np.linalg.norm(found.rotations, axis=-1), 1.0, atol=1e-9)
        if frames > 2:  # two frames of a dance are alike
            assert np.ptp(found.rotations, axis=0).max() > 1e-3


@pytest.mark.parametrize("frames", [5, 30, 47])
def test_what_follows_a_clip_changes_nothing_of_it(frames):
    """A batch with other lengths and bodies gives what each case gives alone."""
    method = trained()
    cases = [
        ("one", "legs", frames),
        ("one", "legs", 61),
        ("legs", "tall", frames),
        ("tall", "legs", frames),
    ]
    sources = [dances(source, (length,))[0] for source, _, length in cases]
    targets = [BODIES[target] for _, target, _ in cases]
    together = method.retarget_batch(sources, targets, contexts=[Context()] * 4)
    for source, target, found in zip(sources, targets, together, strict=True):
        assert apart(found, method.retarget(source, target, context=Context())) < 1e-5


def test_long_clips_go_through_in_pieces(monkeypatch):
    (motion,) = dances("one", (300,))
    method = trained()
    whole = method.retarget(motion, BODIES["legs"], context=Context())
    monkeypatch.setattr(inference, "PIECE", 80)
    assert apart(method.retarget(motion, BODIES["legs"], context=Context()), whole) < 1e-5


def test_other_rates_come_back():
    (motion,) = dances("one", (45,))
    fast = motion.character.motion(motion.rotations, motion.root, 60.0)
    found = trained().retarget(fast, BODIES["legs"], context=Context())
    assert (found.frames, found.fps) == (45, 60.0)
    assert rates.at_thirty(found).frames == rates.at_thirty(fast).frames


def test_a_body_of_a_known_structure_need_not_have_been_trained_on():
    stranger = Character.of("stranger", BODIES["tall"].skeleton, structure="plain")
    (motion,) = dances("legs", (32,))
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
        method.retarget(dances("one", (20,))[0], dog, context=Context())


def test_positions_are_refused_in_a_sentence():
    (motion,) = dances("one", (20,))
    seen = motion.character.positions(motion.positions, motion.fps)
    with pytest.raises(NotSupported, match="reads rotations"):
        trained().retarget(seen, BODIES["one"], context=Context())


def test_people_and_dogs_exchange_motions():
    names = san_material.LEGS
    method = trained(names, structures="all")
    for source, target in (("one", "rex"), ("pup", "tall")):
        found = method.retarget(dances(source, (24,))[0], BODIES[target], context=Context())
        assert np.isfinite(found.positions).all()


def test_statistics_of_a_target_come_from_training_or_from_its_references():
    own = San("released", target_stats="own").using(trained(variant="released").tensors)
    assert own.card.needs == ("target_motions",)
    (motion,) = dances("one", (40,))
    with pytest.raises(NotSupported, match="no motion of legs"):
        own.retarget(motion, BODIES["legs"], context=Context())
    leaked = own.retarget(motion, BODIES["legs"], context=Context(target_motions=tuple(dances("legs"))))
    honest = answer("one", "legs", variant="released")
    assert apart(leaked, honest) < 1e-3  # trained on these very motions
    other = own.retarget(motion, BODIES["legs"], context=Context(target_motions=tuple(dances("stout"))))
    assert apart(other, honest) > 1e-3


def test_ends_of_chains_are_copied_or_rest():
    still = answer("one", "tall", tips="rest")
    hand = BODIES["tall"].skeleton.index("LeftHand")
    assert np.ptp(answer("one", "tall").rotations[:, hand], axis=0).max() > 1e-2
    assert np.ptp(still.rotations[:, hand], axis=0).max() < 1e-6


def test_without_weights_it_says_what_makes_some(tmp_path):
    method = San(weights="none_such")
    with pytest.raises(Exception, match="no shipped weights"):
        method.supports(BODIES["one"], BODIES["tall"])
