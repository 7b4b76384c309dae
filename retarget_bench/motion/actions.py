"""Standing about, going somewhere or sitting: the action of a clip, by hips and tail.

After PAN, section 7.2.2, which tells *move* from *idle* by the speed of the root and *sit* by whether hips
or tail touch the ground. The thresholds are ours: none are published.
"""

from typing import Literal

import numpy as np

from retarget_bench.errors import NotSupported
from retarget_bench.motion.motion import Motion, Positions

Action = Literal["idle", "move", "sit"]

TOUCHING = 0.3
"""Hip heights over the floor below which a joint of hips or tail touches it: joints lie inside the body.
People who sit on the floor have their hips at 0.05 to 0.2, who kneel or crawl at 0.45 to 0.55; a sitting
dog's tail is below 0.15, its hanging tail when it walks above 0.5."""
OFTEN = 0.5
"""Share of the frames in which they touch, from which a clip is sitting."""
MOVING = 0.3
"""Hip heights per second from which a clip is moving."""
SECONDS = 1.0
"""Stretch over which velocities are averaged: swaying on the spot goes nowhere."""


def action(motion: Motion | Positions, floor: float = 0.0) -> Action:
    """The main action of a clip. floor: its height in metres.

    Raises NotSupported for a body without hips or of no height.
    """
    character = motion.character
    height = character.measures.hip_height
    if "hips" not in character.joint_of or not height > 0:
        raise NotSupported(
            f"{character.name} has no hips over the floor, so it cannot be seen whether it sits"
        )
    places = motion.positions
    lower = [at for role, at in character.joint_of.items() if role == "hips" or role.startswith("tail")]
    touching = places[:, lower, 1].min(axis=1) - floor < TOUCHING * height
    if touching.mean() >= OFTEN:
        return "sit"
    level = places[:, character.joint_of["hips"], ::2]
    return "move" if path_speed(level / height, motion.fps) >= MOVING else "idle"


def path_speed(level: np.ndarray, fps: float) -> float:
    """The speed along a path ``(frames, 2)`` on the floor: the mean size of its velocities, each an
    average over a second or over the whole of a shorter clip, in units of the path per second."""
    frames = len(level)
    if frames < 2:
        return 0.0
    reach = min(max(round(SECONDS * fps), 1), frames - 1)
    return float(np.linalg.norm(level[reach:] - level[:-reach], axis=1).mean() * fps / reach)
