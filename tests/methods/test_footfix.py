"""Feet are held where the source's rest, the body follows, and nothing else moves."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from retarget_bench.api import Context
from retarget_bench.errors import BenchError
from retarget_bench.methods.posts.footfix import held
from retarget_bench.motion.motion import Motion
from retarget_bench.plugins import registry
from tests.examples import examples
from tests.methods.method_bodies import body, without

FRAMES = 40
CONTEXT = Context()


def standing(frames: int = FRAMES, fps: float = 30.0) -> Motion:
    """A body that stands where it is."""
    character = body()
    rotations = np.broadcast_to(character.reference_pose, (frames, len(character.skeleton), 4))
    root = np.broadcast_to(character.skeleton.offsets[0], (frames, 3))
    return Motion(character, np.array(rotations), np.array(root), fps)


def moved(motion: Motion, path: np.ndarray) -> Motion:
    return Motion(motion.character, motion.rotations, motion.root + path, motion.fps)


def along(axis: int, values: np.ndarray) -> np.ndarray:
    """``(frames, 3)``: a path along one axis."""
    path = np.zeros((len(values), 3))
    path[:, axis] = values
    return path


def feet(motion) -> np.ndarray:
    character = motion.character
    roles = ("left_foot", "left_toe", "right_foot", "right_toe")
    return motion.positions[:, character.joints(roles)]


def slide(motion) -> float:
    """Metres that feet move per frame, on average."""
    return float(np.linalg.norm(np.diff(feet(motion), axis=0), axis=-1).mean())


def footfix(**parameters):
    return registry.load("posts", "footfix")(**parameters)


# ---------------------------------------------------------------------------------------------- solving
def test_feet_that_slide_while_the_sources_rest_are_held():
    source = standing()
    sliding = moved(source, along(0, np.linspace(-0.02, 0.02, FRAMES)))
    middle = feet(sliding).mean(axis=0)
    for steps, share in ((50, 0.5), (400, 0.1)):
        fixed = footfix(steps=steps).process(sliding, source, context=CONTEXT)
        assert slide(fixed) < share * slide(sliding)
        assert np.abs(feet(fixed) - middle).max() < 0.003


def test_the_answer_keeps_frames_rate_body_and_unit_quaternions():
    source = standing()
    sliding = moved(source, along(0, np.linspace(0, 0.05, FRAMES)))
    fixed = footfix().process(sliding, source, context=CONTEXT)
    assert (fixed.frames, fixed.fps) == (FRAMES, 30.0)
    assert fixed.character is sliding.character
    assert np.linalg.norm(fixed.rotations, axis=-1) == pytest.approx(1.0, abs=1e-12)
    assert np.linalg.norm(np.diff(fixed.positions[:, [14, 15]], axis=1), axis=-1) == pytest.approx(
        np.linalg.norm(np.diff(sliding.positions[:, [14, 15]], axis=1), axis=-1), abs=1e-9
    )


def test_frames_out_of_reach_of_a_contact_stay_to_the_last_bit():
    there = np.concatenate([np.zeros(11), np.linspace(0, 3, 30)])
    source = moved(standing(41), along(2, there))
    drifting = moved(source, along(0, np.linspace(0, 0.04, 41)))
    fixed = footfix().process(drifting, source, context=CONTEXT)
    assert (fixed.rotations[18:] == drifting.rotations[18:]).all()
    assert (fixed.root[18:] == drifting.root[18:]).all()
    changed = (fixed.rotations != drifting.rotations).any(axis=(1, 2))
    assert changed[12:18].all()


def test_a_rate_of_sixty_gives_every_other_frame_the_same_weight():
    weights = {}
    for fps, frames in ((30.0, 41), (60.0, 81)):
        there = np.concatenate([np.zeros(frames // 4), np.linspace(0, 3, frames - frames // 4)])
        source = moved(standing(frames, fps), along(2, there))
        drifting = moved(source, along(0, np.full(frames, 0.1))).positions
        answer = source.character.positions(drifting, fps)
        answer.positions[: frames // 4 + 1, :, 0] += np.linspace(0, 0.02, frames // 4 + 1)[:, None]
        fixed = footfix().process(answer, source, context=CONTEXT)
        changed = np.flatnonzero(np.abs(fixed.positions - answer.positions).max(axis=(1, 2)) > 0)
        weights[fps] = int(changed.max() - frames // 4)
    assert weights[60.0] == 2 * weights[30.0] == 12


def test_no_frame_ends_farther_from_its_places_than_it_began():
    source = standing()
    for size in (1e-9, 1e-6, 1e-4, 1e-3, 1e-2, 0.1):
        path = along(0, size * np.random.default_rng(0).normal(size=FRAMES))
        shaken = moved(source, path)
        fixed = footfix().process(shaken, source, context=CONTEXT)
        expected = shaken.positions.copy()
        joints = source.character.joints(("left_foot", "left_toe", "right_foot", "right_toe"))
        expected[:, joints] = shaken.positions[:, joints].mean(axis=0)
        before, after = (np.square(each.positions - expected).sum(axis=(1, 2)) for each in (shaken, fixed))
        assert (after <= before * (1 + 1e-9) + 1e-28).all()


# ------------------------------------------------------------------------------------- kinds of answers
def test_an_answer_by_positions_gets_the_blended_places():
    source = standing()
    sliding = moved(source, along(0, np.linspace(-0.02, 0.02, FRAMES)))
    answer = source.character.positions(sliding.positions, 30.0)
    fixed = footfix().process(answer, source, context=CONTEXT)
    assert slide(fixed) < 1e-12
    others = [joint for joint, role in enumerate(source.character.roles)
              if role is None or not role.endswith(("_foot", "_toe"))]  # fmt: skip
    assert (fixed.positions[:, others] == answer.positions[:, others]).all()


def test_fore_paws_count_where_both_bodies_stand_on_four():
    cast = registry.create("datasets", "puppets[size=tiny]").characters()
    dog = next(each for each in cast.values() if each.four_legged)
    man = next(each for each in cast.values() if not each.four_legged)
    paws = dog.joints(("left_hand", "right_hand"))
    for source_body, held_still in ((dog, True), (man, False)):
        still = np.zeros((FRAMES, len(source_body.skeleton), 3))
        source = source_body.positions(still, 30.0)
        places = np.broadcast_to(np.linspace(0, 0.1, FRAMES)[:, None, None], (FRAMES, len(dog.skeleton), 3))
        fixed = footfix().process(dog.positions(places, 30.0), source, context=CONTEXT)
        assert bool(np.ptp(fixed.positions[:, paws], axis=0).max() < 1e-12) is held_still
        assert np.ptp(feet(fixed), axis=0).max() < 1e-12


def test_a_body_without_a_common_foot_is_refused():
    legs = (f"{side}{part}" for side in ("Left", "Right") for part in ("UpLeg", "Leg", "Foot", "ToeBase"))
    source, bust = body(), without(body(), *legs)
    assert "counterpart" in (footfix().supports(source, bust) or "")
    assert footfix().supports(source, source) is None


@pytest.mark.parametrize("wrong", [{"limit": 0.0}, {"rate": -1.0}, {"blend": -1}, {"steps": -1}])
def test_parameters_that_mean_nothing_are_refused(wrong):
    with pytest.raises(BenchError, match="footfix needs limit and rate above 0"):
        footfix(**wrong)


# --------------------------------------------------------------------------------------------- blending


def blended_by_hand(places: np.ndarray, rests: np.ndarray, reach: int) -> np.ndarray:
    """The same for one joint ``(frames, 3)``, frame by frame, from the description."""
    goal = places.copy()
    frame = 0
    while frame < len(rests):
        last = frame
        while last < len(rests) and rests[last]:
            last += 1
        if last > frame:
            goal[frame:last] = places[frame:last].mean(axis=0)
        frame = last + 1

    def cubic(u: float) -> float:
        return 2 * u**3 - 3 * u**2 + 1

    out = goal.copy()
    for t in np.flatnonzero(~rests):
        before = next((d for d in range(1, reach + 1) if t - d >= 0 and rests[t - d]), None)
        after = next((d for d in range(1, reach + 1) if t + d < len(rests) and rests[t + d]), None)
        pulled = {}
        for sign, d in ((-1, before), (1, after)):
            if d is not None:
                w = cubic(d / (reach + 1))
                pulled[sign] = (1 - w) * places[t] + w * goal[t + sign * d]
        if before is not None and after is not None:
            w = cubic(before / (before + after))
            out[t] = w * pulled[-1] + (1 - w) * pulled[1]
        elif pulled:
            (out[t],) = pulled.values()
    return out


@examples(60)
@given(st.lists(st.booleans(), min_size=1, max_size=40), st.integers(0, 8), st.integers(0, 2**32 - 1))
def test_blending_is_what_its_description_says(labels, reach, seed):
    rests = np.array(labels)
    places = np.random.default_rng(seed).normal(size=(len(rests), 2, 3))
    both = np.stack([rests, ~rests], axis=1)
    blended = held(places, both, reach)
    for joint in range(2):
        expected = blended_by_hand(places[:, joint], both[:, joint], reach)
        assert blended[:, joint] == pytest.approx(expected, abs=1e-12)
    far = [t for t in range(len(rests)) if not rests[max(0, t - reach) : t + reach + 1].any()]
    assert (blended[far, 0] == places[far, 0]).all()
