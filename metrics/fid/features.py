"""Features of windows of motion, by which sets of answers are compared with sets of real motion.

They are kinetic and geometric features, as in FID_k and FID_g of Li et al. (2021, *AI Choreographer*) after
Onuma et al. (2008) and Mueller et al. (2005), and no network's. Each is a mean over the frames of a window,
of positions smoothed over a frame, in heights of the body and seconds, over a unit that is the same for all
data: about what a viewer calls another pose, another pace, a slide or a lift. Any body with hips, a head,
arms and legs has them. Not seen: place, heading and size of a body.

    pose      (15)  head, hands and feet from the hips, to the left, up and forward: 0.4
    bends      (4)  how far knees lie before the line from hip to ankle, and elbows behind theirs: 0.1
    twist      (1)  of the line of the shoulders against that of the hips: 0.3 rad
    stance     (1)  hips over the lower foot: 0.3
    floor      (1)  the lower foot over the floor: 0.02, up to about 0.1
    speeds     (6)  of hips, head, hands and feet: 0.5 a second, beyond 1 as its logarithm
    jolts      (5)  accelerations of head, hands and feet: 2 a second squared, beyond 10 likewise
    way        (3)  speed of the hips to the left and forward: 0.6 a second; of turning: 2 rad a second
    swing      (1)  whether the higher foot goes forward past the lower one: 0.133 a second
    standing   (1)  speed of the foot that moves least: 0.033 a second, up to about 0.1
    life       (1)  speed of what moves most: 0.02 a second, beyond as its logarithm
    limbs      (4)  lengths of arms and legs: 0.06

Smoothing by a Gaussian of one frame leaves a tenth of an amplitude at 10 Hz, so that noise of a millimetre
does not count as movement. A four-legged body stands on its hands, too.
"""

from collections.abc import Iterator

import numpy as np

from retarget_bench.api import Source, Stretches
from retarget_bench.motion import facing
from retarget_bench.motion.character import Character
from retarget_bench.motion.roles import ESSENTIAL, HANDS, SIDES

FRAMES, HOP = 16, 4
"""Of a window at ``RATE`` frames per second, and from one to the next."""
RATE = 30.0
STRETCHES = Stretches(overlap=FRAMES // HOP, length=60 // HOP)
"""Of two seconds, about."""
HEADING = 10.0
"""Frames: standard deviation of the Gaussian over which the facing direction is averaged."""
BLUR = np.exp(-0.5 * np.arange(-3, 4) ** 2)
"""Weights of seven frames: a Gaussian with a standard deviation of one."""
FEET = ("left_foot", "right_foot")
LIMBS = {"arm": ("arm", "forearm", "hand"), "leg": ("up_leg", "leg", "foot")}
ENDS = ("head", *HANDS, *FEET)
UPRIGHT = {"head": 0.4, "foot": -0.45, "hips": 0.5, "ankle": 0.05, "arm": 0.33, "leg": 0.45}
"""Heights and lengths of a person who stands, in heights, where features are 0: KID sees from there."""
LIVELY = 0.4
"""Heights a second: the speed of a hand, say, at which *life* is 0."""


def unfit(character: Character) -> str:
    """Reason why a body has no features; "" where it has."""
    if missing := [role for role in ESSENTIAL if role not in character.joint_of]:
        return f"no joint of {character.name} is known as {', '.join(missing)}"
    return "" if character.height > 0 else f"{character.name} has no height"


def features(motion: Source, floor: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """``(windows, 43)`` float32 of a motion on a body that is not ``unfit``; none where it is too short.
    Also their ``speeds``.

    floor: metres, its height.
    """
    motion = _at_rate(motion)
    body, places = motion.character, motion.positions
    turn = facing.facing(places, body, HEADING)
    sharp = {role: places[:, body.joint_of[role]] / body.height for role in ESSENTIAL}
    at = {role: _smooth(path - (0.0, floor / body.height, 0.0)) for role, path in sharp.items()}
    velocity = {role: _rate(at[role]) for role in ("hips", *ENDS)}
    parts = (*_shape(at, turn), *_movement(at, velocity, turn, body.four_legged), *_limbs(sharp))
    return _means(np.stack(parts, axis=1)).astype(np.float32), speeds(motion)


def speeds(motion: Source) -> np.ndarray:
    """``(windows,)`` float32 mean level speed of a body's hips in every window, heights per second."""
    motion = _at_rate(motion)
    body = motion.character
    velocity = _rate(_smooth(motion.positions[:, body.joint_of.get("hips", 0)] / body.height))
    return _means(np.hypot(velocity[:, 0], velocity[:, 2])[:, None])[:, 0].astype(np.float32)


def _at_rate(motion: Source) -> Source:
    """A motion at 30 frames per second."""
    if abs(motion.fps - RATE) <= 1e-3 * RATE:
        return motion
    return motion.character.positions(motion.positions, motion.fps).resample(RATE)


def _shape(at: dict[str, np.ndarray], turn: np.ndarray) -> Iterator[np.ndarray]:
    """From pose to floor: ``(frames,)`` each."""
    for role in ENDS:
        away = facing.seen(at[role] - at["hips"], turn) - (0.0, UPRIGHT.get(role.split("_")[-1], 0.0), 0.0)
        yield from away.T / 0.4
    for (start, middle, end), ahead in zip(LIMBS.values(), (-1.0, 1.0), strict=True):
        for side in SIDES:
            line = (at[f"{side}_{start}"] + at[f"{side}_{end}"]) / 2
            yield ahead * facing.seen(at[f"{side}_{middle}"] - line, turn)[:, 2] / 0.1
    yield np.angle(_across(at, "arm") * _across(at, "up_leg").conj()) / 0.3
    lower = np.minimum(*(at[foot][:, 1] for foot in FEET))
    yield (at["hips"][:, 1] - lower - UPRIGHT["hips"]) / 0.3
    yield 5.0 * (np.tanh(lower / 0.1) - np.tanh(UPRIGHT["ankle"] / 0.1))


def _across(at: dict[str, np.ndarray], joint: str) -> np.ndarray:
    """``(frames,)`` the line from a right joint to the left one on the floor, as complex numbers."""
    line = at[f"left_{joint}"] - at[f"right_{joint}"]
    return np.asarray(line[:, 2] + 1j * line[:, 0])


def _movement(
    at: dict[str, np.ndarray], velocity: dict[str, np.ndarray], turn: np.ndarray, four_legged: bool
) -> Iterator[np.ndarray]:
    """From speeds to life: ``(frames,)`` each."""
    speed = {role: _length(each) for role, each in velocity.items()}
    yield from (2.0 * np.arcsinh(each) for each in speed.values())
    yield from (5.0 * np.arcsinh(_length(_rate(velocity[role])) / 10.0) for role in ENDS)
    way = facing.seen(velocity["hips"], turn)
    yield from (0.5 * np.arcsinh(way[:, axis] / 0.3) for axis in (0, 2))
    yield 0.5 * np.arcsinh(_same(np.angle(turn[1:] * turn[:-1].conj()) * RATE))
    left, right = FEET
    past = facing.seen(velocity[left] - velocity[right], turn)[:, 2]
    yield 1.5 * np.arcsinh(past / 0.2) * np.tanh((at[left] - at[right])[:, 1] / 0.03)
    standing = (*FEET, *HANDS) if four_legged else FEET
    yield 3.0 * np.tanh(np.min([speed[role] for role in standing], axis=0) / 0.1)
    yield np.arcsinh(np.max(list(speed.values()), axis=0) / 0.02) - np.arcsinh(LIVELY / 0.02)


def _limbs(at: dict[str, np.ndarray]) -> Iterator[np.ndarray]:
    """Lengths of limbs: ``(frames,)`` each."""
    for limb, joints in LIMBS.items():
        for side in SIDES:
            start, middle, end = (at[f"{side}_{joint}"] for joint in joints)
            yield (_length(middle - start) + _length(end - middle) - UPRIGHT[limb]) / 0.06


def _means(channels: np.ndarray) -> np.ndarray:
    """``(windows, channels)`` of channels ``(all frames, channels)``."""
    if len(channels) < FRAMES:
        return np.zeros((0, channels.shape[1]))
    return np.lib.stride_tricks.sliding_window_view(channels, FRAMES, axis=0)[::HOP].mean(axis=-1)


def _smooth(path: np.ndarray) -> np.ndarray:
    """A path ``(frames, 3)`` without what is faster than people, the ends repeated."""
    reach, frames = len(BLUR) // 2, len(path)
    padded = np.pad(path, ((reach, reach), (0, 0)), mode="edge")
    return sum(weight * padded[shift : shift + frames] for shift, weight in enumerate(BLUR / BLUR.sum()))


def _rate(path: np.ndarray) -> np.ndarray:
    """Change per second of a path ``(frames, 3)``."""
    return _same(np.diff(path, axis=0) * RATE)


def _same(steps: np.ndarray) -> np.ndarray:
    """What lies between frames, one for each: the first has the second's. Zero for a single frame."""
    return np.concatenate([steps[:1] if len(steps) else np.zeros((1, *steps.shape[1:])), steps])


def _length(vectors: np.ndarray) -> np.ndarray:
    return np.sqrt(np.einsum("fc,fc->f", vectors, vectors))
