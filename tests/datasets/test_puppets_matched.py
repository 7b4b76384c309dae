"""People and dogs that go the same ways: matched in kind, speed and heading, and balanced."""

from __future__ import annotations

from collections import Counter
from itertools import pairwise

import numpy as np
import pytest

from retarget_bench.datasets.puppets import plugin as Puppets
from retarget_bench.datasets.puppets.generator.bodies.characters import DOGS
from retarget_bench.datasets.puppets.generator.bodies.dogs import PAWS
from retarget_bench.datasets.puppets.generator.corpus.clips import shortfalls
from retarget_bench.datasets.puppets.generator.corpus.families import HELD_OUT_KINDS, bodies_of, families
from retarget_bench.datasets.puppets.generator.corpus.matched import (
    LOCOMOTION,
    Match,
    Performance,
    locomotion_labels,
)
from retarget_bench.datasets.puppets.generator.performances.dogs.following import PARTNERS, follow
from retarget_bench.datasets.puppets.generator.performances.people import KINDS as PEOPLE
from retarget_bench.datasets.puppets.generator.randomness import Stream
from retarget_bench.datasets.puppets.generator.solver.solve import solve
from retarget_bench.motion.motion import Motion

pytestmark = pytest.mark.slow

SPEED = 0.2
"""Leg lengths a second, over half a second, that a dog may be faster or slower than its score says."""
HEADING = 2.0
"""Degrees that the line of its trunk may turn off the heading."""
HALF = 15
"""Frames in half a second."""


def off_the_way(motion: Motion, leg: float, heading: np.ndarray, speed: np.ndarray) -> tuple[float, float]:
    """By how much the middle between hip and shoulder joints, and the line between them, go otherwise:
    leg lengths a second and degrees."""
    at = motion.character.joint_of
    rear, front = (
        0.5 * (motion.positions[:, at[f"left_{part}"]] + motion.positions[:, at[f"right_{part}"]])
        for part in ("up_leg", "arm")
    )
    line, middle = front - rear, 0.5 * (rear + front)[:, [0, 2]] / leg
    turned = np.exp(1j * (np.arctan2(line[:, 0], line[:, 2]) - heading))
    ahead = np.stack([np.sin(heading), np.cos(heading)], axis=-1)
    # what is covered in half a second along the way, and what the labels add up to in it
    went = ((middle[1:] - middle[:-1]) * 0.5 * (ahead[1:] + ahead[:-1])).sum(axis=-1)
    expected = 0.5 * (speed[1:] + speed[:-1]) / 30.0
    gaps = np.convolve(went - expected, np.ones(HALF), mode="valid") * 30.0 / HALF
    return float(np.abs(gaps).max()), float(np.degrees(np.abs(np.angle(turned))).max())


@pytest.mark.parametrize("kind", PARTNERS)
def test_dogs_follow_people(kind: str) -> None:
    """At their speed in leg lengths, with their heading, paws at rest on the floor."""
    for number in range(6):
        leader = PEOPLE[kind](Stream("dogs", "leader", kind, number), 130)
        score = follow(Stream("dogs", "follower", kind, number), leader)
        assert score.kind == PARTNERS[kind]
        body = list(DOGS.values())[number % len(DOGS)]
        solution = solve(score, body)
        places = body.positions(solution.orientations, solution.root)
        steps = np.linalg.norm(np.diff(places[:, [body.part[role] for role in PAWS]], axis=0), axis=-1)
        assert steps[solution.planted[1:]].max() < 1e-3


@pytest.mark.parametrize("size", ["tiny", "default", "large"])
def test_lists_are_fixed_and_balanced(size: str) -> None:
    """All structures on two legs that a part has, against dogs; standing, walking, jogging and running
    equally often and equally long; every body and every dog that the part has, nobody far more often."""
    data, again = Puppets(size=size), Puppets(size=size)
    people, dogs = families()
    for part in ("train", "test"):
        listed = data.matched(part)
        structures = {people.bodies[name].structure.name for name in bodies_of(people, part)}
        assert set(listed) == {(name, "dog21") for name in structures}
        for pair, matches in listed.items():
            assert list(matches) == list(again.matched(part)[pair])
            for family, side in ((people, "biped"), (dogs, "dog")):
                names = Counter(getattr(match, side)[1] for match in matches)
                expected = {
                    name for name in bodies_of(family, part) if family.bodies[name].structure.name in pair
                }
                assert set(names) == expected
                assert max(names.values()) <= min(names.values()) + 4
            frames: Counter[str] = Counter()
            for match in matches:
                assert match.biped[0].kind in LOCOMOTION[match.locomotion]
                assert match.dog[0].kind == PARTNERS[match.biped[0].kind]
                assert match.dog[0].frames == match.biped[0].frames
                frames[match.locomotion] += match.biped[0].frames
            assert set(frames) == set(LOCOMOTION)
            assert len(set(frames.values())) == 1


def test_train_and_test_share_nothing() -> None:
    """No clip, of either side; and what is held out of training is not in it."""
    names: list[str] = []
    for size in ("tiny", "default", "large"):
        data = Puppets(size=size)
        manifest = data.training_manifest()
        for part in ("train", "test") if size != "large" else ("train",):
            for matches in data.matched(part).values():
                for match in matches:
                    for clip, body in (match.biped, match.dog):
                        names.append(clip.name)
                        assert part == "test" or body in manifest["characters"]
                        assert clip.kind not in HELD_OUT_KINDS
        names += [name for cast in data.training().values() for c in cast.values() for name in c.names]
    assert len(set(names)) == len(names)


def sampled() -> list[Match]:
    """Of every pair and every locomotion some."""
    data = Puppets()
    return [
        match
        for part in ("train", "test")
        for matches in data.matched(part).values()
        for match in matches[::5]
    ]


def test_matched_performances_agree_in_speed_and_heading() -> None:
    """The labels of both are the same, and each dog moves as its labels say."""
    data, counts = Puppets(), Counter()
    for match in sampled():
        one, other = locomotion_labels(match.biped[0]), locomotion_labels(match.dog[0])
        frames = match.biped[0].frames
        assert one.kind.shape == one.speed.shape == one.heading.shape == (frames,)
        np.testing.assert_array_equal(other.heading, one.heading)
        np.testing.assert_allclose(other.speed, one.speed, atol=1e-9)
        assert set(other.kind) == {match.dog[0].kind}
        motion = data.motion(*match.dog)
        assert data.motion(*match.biped).frames == motion.frames == frames
        leg = match.dog[0].family.bodies[match.dog[1]].proportions.leg
        slip, turned = off_the_way(motion, leg, other.heading, other.speed)
        assert slip < SPEED, match
        assert turned < HEADING, match
        counts[match.locomotion] += 1
    assert set(counts) == set(LOCOMOTION)


def test_kinds_differ_in_speed() -> None:
    """Standing, walking, jogging and running do not overlap, on either side."""
    fastest: dict[str, float] = {}
    slowest: dict[str, float] = {}
    for match in sampled():
        speed = float(np.median(locomotion_labels(match.dog[0]).speed))
        kind = match.locomotion
        fastest[kind] = max(fastest.get(kind, speed), speed)
        slowest[kind] = min(slowest.get(kind, speed), speed)
    order = list(LOCOMOTION)
    assert all(fastest[a] < slowest[b] for a, b in pairwise(order))


def test_everybody_is_able_to_do_what_is_listed() -> None:
    def able(performance: Performance) -> bool:
        clip, body = performance
        return not shortfalls(clip, (body,))

    for match in sampled():
        assert able(match.biped), match
        assert able(match.dog), match


def test_they_can_be_trained_on_without_their_pairs() -> None:
    matches = Puppets().matched("train")["body22", "dog21"]
    training = matches.clips()
    assert set(training) == {"body22", "dog21"}
    assert sum(len(own) for cast in training.values() for own in cast.values()) == 2 * len(matches)
    name, own = next(iter(training["dog21"].items()))
    assert own[0].character.name == name
    assert own[0].frames == own.listed[0].frames
