"""What dogs' motions promise, measured on every dog in every kind, as the engine plays them."""

from __future__ import annotations

import numpy as np
import pytest
from puppet_takes import Take, played

from retarget_bench.datasets.puppets.contract import SECOND
from retarget_bench.datasets.puppets.generator.bodies import rigs
from retarget_bench.datasets.puppets.generator.bodies.characters import DOGS
from retarget_bench.datasets.puppets.generator.bodies.dogs import DOG21, PAWS
from retarget_bench.datasets.puppets.generator.corpus.families import HELD_OUT_KINDS
from retarget_bench.datasets.puppets.generator.performances.dogs import KINDS
from retarget_bench.datasets.puppets.generator.performances.dogs.following import speeds
from retarget_bench.datasets.puppets.generator.performances.dogs.sequencing import BRIDGE, PARTS, sequence
from retarget_bench.datasets.puppets.generator.randomness import Stream
from retarget_bench.datasets.puppets.generator.solver.paws import sizes_of
from retarget_bench.datasets.puppets.generator.solver.solve import solve
from retarget_bench.motion import rotation
from retarget_bench.motion.character import Character
from retarget_bench.motion.role_finding import find
from retarget_bench.motion.roles import is_quadruped

FRAMES = {"dog_sequence": 450}
USUAL_FRAMES = 110
GAITS = ("dog_walk", "trot", "gallop")


def tip(take: Take, part: str) -> np.ndarray:
    """``(frames, 3)`` the end of a joint's bone."""
    return take.point(part, take.body.tips[part])


def tips(take: Take) -> np.ndarray:
    """``(frames, 4, 3)`` the tips of the paws."""
    return np.stack([tip(take, role) for role in PAWS], axis=1)


@pytest.fixture(scope="module")
def pack() -> dict[str, Character]:
    return {body.name: rigs.character(body) for body in DOGS.values()}


@pytest.fixture(scope="module", params=KINDS)
def takes(request: pytest.FixtureRequest, pack: dict[str, Character]) -> list[Take]:
    kind, performances = request.param, []
    for number, body in enumerate(DOGS.values()):
        name = f"{kind}-{number % 3}"
        score = KINDS[kind](Stream("dogs", "quality", name), FRAMES.get(kind, USUAL_FRAMES))
        solution, who = solve(score, body), pack[body.name]
        performances.append(played(f"{body.name}/{name}", body, who, score, solution))
    return performances


def test_planted_paws_rest(takes: list[Take]) -> None:
    for take in takes:
        steps = np.linalg.norm(np.diff(take.joints(PAWS), axis=0), axis=-1)
        assert steps[take.solution.planted[1:]].max(initial=0.0) < 1e-3, take.name


def test_pivoting_paws_turn_about_their_tip(takes: list[Take]) -> None:
    for take in takes:
        assert take.solution.pivoting is not None
        assert not (take.solution.planted & take.solution.pivoting).any()
        steps = np.linalg.norm(np.diff(tips(take), axis=0), axis=-1)
        down = take.solution.planted | take.solution.pivoting
        assert steps[down[1:]].max(initial=0.0) < 1e-3, take.name
        assert np.abs(tips(take)[..., 1][down]).max(initial=0.0) < 1e-3, take.name


def test_labels_miss_no_contact(takes: list[Take]) -> None:
    for take in takes:
        still = np.linalg.norm(np.diff(take.joints(PAWS), axis=0), axis=-1) < 1e-6
        assert (still & ~take.solution.planted[1:]).mean() < 0.01, take.name


def test_nothing_goes_through_the_floor(takes: list[Take]) -> None:
    for take in takes:
        tips = [tip(take, part)[:, 1].min() for part in take.body.tips]
        assert min(take.motion.positions[..., 1].min(), *tips) > -0.005, take.name


def test_somebody_stands_but_in_a_flight(takes: list[Take]) -> None:
    """And standing dogs stand on four legs."""
    for take in takes:
        assert take.solution.pivoting is not None
        down = (take.solution.planted | take.solution.pivoting).sum(axis=-1)[1:-1]
        least = {
            "gallop": 0,
            "trot": 0,
            "dog_sequence": 0,
            "dog_stand": 4,
            "dog_turn": 2,
            "dog_walk": 2,
            "dog_lie": 2,
            "dog_sit": 2,
        }.get(take.score.kind, 3)
        assert down.min() >= least, take.name
        assert (down > 0).mean() > (0.45 if take.score.kind == "gallop" else 0.8), take.name


@pytest.mark.parametrize("end", ["hind", "fore"])
def test_stifles_bend_forward_and_elbows_back(takes: list[Take], end: str) -> None:
    top, middle, last = ("up_leg", "leg", "foot") if end == "hind" else ("arm", "forearm", "hand")
    for take in takes:
        for side in ("left", "right"):
            parts = [f"{side}_{part}" for part in (top, middle, last)]
            angle = take.bend(*parts)
            assert angle.min() > 8, (take.name, side)
            assert angle.max() < 158, (take.name, side)
            upper, lower = np.diff(take.joints(parts), axis=1).swapaxes(0, 1)
            hinge = rotation.rotate(take.turned[:, take.body.part[parts[0]]], np.array([1.0, 0.0, 0.0]))
            turn = (np.cross(upper, lower) * hinge).sum(axis=-1)
            assert (turn > 0).all() if end == "hind" else (turn < 0).all(), (take.name, side)


def test_joints_stay_within_limits(takes: list[Take]) -> None:
    for take in takes:
        assert take.relative_angle("hips", "spine_2").max() < 60, take.name
        assert take.relative_angle("spine_2", "neck").max() < 75, take.name
        assert take.relative_angle("neck", "head").max() < 60, take.name
        for side in ("left", "right"):
            assert take.relative_angle("spine_2", f"{side}_shoulder").max() < 42, take.name
            assert take.relative_angle("hips", f"{side}_up_leg").max() < 130, take.name


def test_nothing_jumps(takes: list[Take]) -> None:
    """Accelerations stay under 12 g for a dog of 0.65 m, paws in a gallop under 30; and joints turn as
    fast as those of recorded dogs, whose fore legs turn 55 degrees a frame in a trot, 65 in a gallop."""
    for take in takes:
        places = take.motion.positions / sizes_of(take.body).leg * 0.5
        force = np.linalg.norm(np.diff(places, 2, axis=0), axis=-1) * 30.0**2 / 9.81
        trunk = [take.body.part[part] for part in ("hips", "spine_1", "spine_2", "neck", "head")]
        fast = take.score.kind in ("trot", "gallop", "dog_sequence")
        assert force[:, trunk].max() < (8.0 if fast else 3.0), take.name
        assert force.max() < (30.0 if fast else 12.0), (
            take.name,
            np.unravel_index(force.argmax(), force.shape),
        )
        local = take.motion.rotations
        most = {"dog_walk": 45.0, "trot": 60.0, "gallop": 85.0, "dog_sequence": 60.0}.get(
            take.score.kind, 40.0
        )
        assert np.degrees(rotation.angle(local[:-1], local[1:])).max() < most, take.name


def test_gaits_go_as_fast_as_they_say(takes: list[Take]) -> None:
    """The middle of the trunk covers the ground at the score's leg lengths a second."""
    for take in takes:
        if take.score.kind in GAITS:
            middle = 0.5 * (take.at("left_up_leg") + take.at("left_arm"))[:, [0, 2]]
            way = np.linalg.norm(np.diff(middle[::10], axis=0), axis=-1).sum() / sizes_of(take.body).leg
            seconds = (len(middle[::10]) - 1) * 10 / 30.0
            assert way / seconds == pytest.approx(speeds(take.score).mean(), rel=0.12), take.name


def test_second_answers_keep_every_paw(takes: list[Take]) -> None:
    for take in takes:
        other = solve(take.score, take.body, SECOND)
        places = take.body.positions(other.orientations, other.root)
        joints = [take.body.part[role] for role in PAWS]
        apart = np.linalg.norm(places[:, joints] - take.joints(PAWS), axis=-1)
        assert apart[take.solution.planted].max() < 1e-3, take.name
        moved = np.linalg.norm(places - take.motion.positions, axis=-1).mean()
        assert 0.002 * sizes_of(take.body).leg < moved < 0.2 * sizes_of(take.body).leg, take.name


def test_the_engine_knows_dogs_for_what_they_are(pack: dict[str, Character]) -> None:
    """Roles as the engine would find them from the names alone; every rig stands alike."""
    for body in DOGS.values():
        who = pack[body.name]
        assert find(who.skeleton) == who.roles == DOG21.roles
        assert is_quadruped(who.skeleton, who.roles)
        assert who.measures.leg_length == pytest.approx(body.proportions.thigh + body.proportions.shank)
    assert len({body.rest for body in DOGS.values()}) >= 3


@pytest.mark.parametrize("frames", [60, 101, 240, 1800])
def test_sequences_say_what_is_done_when(frames: int) -> None:
    """Acts without gaps, joined by bridges; whatever is held out stays out."""
    score = sequence(Stream("dogs", "sequence", frames), frames)
    assert score.frames == frames == len(score.phases())
    assert [act.first for act in score.acts[1:]] == [act.end for act in score.acts[:-1]]
    assert (score.acts[0].first, score.acts[-1].end) == (0, frames)
    kinds = [act.kind for act in score.acts if act.kind != "transition"]
    assert kinds[0] != "dog_stand"
    assert set(kinds) <= set(PARTS) <= set(KINDS) - set(HELD_OUT_KINDS)
    if frames == 1800:
        assert set(kinds) == set(PARTS)
    for first, second in zip(score.acts, score.acts[1:], strict=False):
        assert "transition" in (first.kind, second.kind) or first.kind == second.kind
    assert all(act.end - act.first == BRIDGE for act in score.acts if act.kind == "transition")
