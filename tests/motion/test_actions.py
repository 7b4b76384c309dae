"""What a clip shows, on motions that are made to show it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from retarget_bench.datasets.puppets import plugin as Puppets
from retarget_bench.errors import NotSupported
from retarget_bench.motion.actions import MOVING, action, path_speed
from retarget_bench.motion.character import Character
from retarget_bench.motion.motion import Motion

FPS = 30.0


@pytest.fixture(scope="module")
def cast() -> dict[str, Character]:
    everybody = Puppets().characters()
    return {"person": everybody["ada"], "dog": everybody["rex"]}


def performed(body: Character, level: np.ndarray, height: float | np.ndarray = 1.0) -> Motion:
    """The reference pose with its hips along a path, in hip heights, ``height`` hip heights up."""
    hip = body.measures.hip_height
    places = np.zeros((len(level), 3))
    places[:, ::2], places[:, 1] = level * hip, np.asarray(height) * hip
    pose = np.repeat(body.reference_pose[None], len(level), axis=0)
    return body.motion(pose, places, FPS)


def straight(speed: float, frames: int = 90, heading: float = 0.3) -> np.ndarray:
    return np.arange(frames)[:, None] / FPS * speed * np.array([[np.sin(heading), np.cos(heading)]])


@pytest.mark.parametrize("who", ["person", "dog"])
def test_speed_tells_moving_from_standing(cast: dict[str, Character], who: str) -> None:
    assert action(performed(cast[who], straight(1.1 * MOVING))) == "move"
    assert action(performed(cast[who], straight(0.9 * MOVING))) == "idle"


def test_swaying_on_the_spot_is_not_moving(cast: dict[str, Character]) -> None:
    """To and fro by a tenth of the hip height twice a second: fast, and nowhere."""
    sway = 0.1 * np.sin(4 * np.pi * np.arange(120) / FPS)[:, None] * np.array([[1.0, 0.0]])
    assert np.linalg.norm(np.diff(sway, axis=0), axis=1).mean() * FPS > 2 * MOVING
    assert action(performed(cast["person"], sway)) == "idle"


@pytest.mark.parametrize("share", [0.4, 0.6])
def test_hips_on_the_floor_for_half_of_the_time_are_sitting(
    cast: dict[str, Character], share: float
) -> None:
    low = np.where(np.arange(100) < 100 * share, 0.15, 1.0)
    assert action(performed(cast["person"], np.zeros((100, 2)), low)) == ("sit" if share > 0.5 else "idle")


def test_kneeling_is_not_sitting_and_the_floor_counts(cast: dict[str, Character]) -> None:
    still = np.zeros((60, 2))
    assert action(performed(cast["person"], still, 0.5)) == "idle"
    raised = performed(cast["person"], still, 0.5)
    assert action(raised, floor=0.35 * cast["person"].measures.hip_height) == "sit"


def test_a_tail_on_the_floor_is_enough(cast: dict[str, Character]) -> None:
    """The hips are above the height that counts, the tail that hangs from them is not."""
    dog = cast["dog"]
    low = performed(dog, np.zeros((40, 2)), 0.4)
    tails = [at for role, at in dog.joint_of.items() if role.startswith("tail")]
    assert (low.positions[:, tails, 1].min(axis=1) < 0.3 * dog.measures.hip_height).all()
    assert action(low) == "sit"
    tailless = tuple(None if role and role.startswith("tail") else role for role in dog.roles)
    assert action(performed(replace(dog, roles=tailless), np.zeros((40, 2)), 0.4)) == "idle"


@given(speed=st.floats(0.0, 10.0), fps=st.sampled_from([24.0, 30.0, 60.0]), frames=st.integers(2, 200))
def test_a_straight_way_has_its_own_speed(speed: float, fps: float, frames: int) -> None:
    way = np.arange(frames)[:, None] / fps * speed * np.array([[0.6, 0.8]])
    assert path_speed(way, fps) == pytest.approx(speed, abs=1e-9)


def test_one_frame_goes_nowhere() -> None:
    assert path_speed(np.zeros((1, 2)), FPS) == 0.0


def test_a_body_without_hips_is_refused(cast: dict[str, Character]) -> None:
    body = cast["person"]
    nameless = replace(body, roles=(None,) * len(body.roles))
    with pytest.raises(NotSupported, match="ada has no hips"):
        action(performed(nameless, np.zeros((5, 2))))
