"""Division of clips into test, validation and training."""

from collections.abc import Callable, Sequence
from typing import Literal

import numpy as np

from retarget_bench.errors import BenchError, Unusable
from retarget_bench.files import digest
from retarget_bench.motion import kinematics
from retarget_bench.motion.motion import Motion
from retarget_bench.training.clips import LazyClips

Protocol = Literal["all", "split", "train"]
Part = Literal["test", "validation"]

TENTHS = ("test", "test", "validation", *["train"] * 7)
"""What protocol=split does with each tenth of the names of clips."""
STILL = 1e-4
"""Share of a body's height within which something counts as not moving at all."""


def part_of(clip: str, protocol: Protocol) -> str:
    """``test``, ``validation`` or ``train``: by the clip's name alone, so that clips of one name stay
    together and others stay where they are when files are added."""
    if protocol == "split":
        return TENTHS[int(digest(clip), 16) % len(TENTHS)]
    return "test" if protocol == "all" else "train"


class Clips(LazyClips[str]):
    """Clips of one body, each read when it is asked for."""

    def __init__(self, read: Callable[[str, str], Motion], body: str, listed: Sequence[str]) -> None:
        super().__init__(listed)
        self._read, self._body = read, body

    @property
    def names(self) -> tuple[str, ...]:
        return self.listed

    def made(self, each: str) -> Motion:
        """Raises Unusable where the file cannot be read, or holds no motion of a whole body."""
        try:
            motion = self._read(self._body, each)
        except BenchError as error:
            raise Unusable(each, str(error)) from error
        if why := unusable(motion):
            raise Unusable(each, why)
        return motion


def unusable(motion: Motion) -> str:
    """The sign that a file lost its motion, or a part of it; "" where there is none.

    Hips that keep their height to a ten-thousandth of the body's while limbs move are no motion of
    anybody: some converters drop the vertical path of the root.
    """
    positions, _ = kinematics.forward(motion.skeleton, motion.rotations, motion.root)
    within = STILL * motion.character.height
    if np.ptp(positions, axis=0).max(initial=0.0) <= within:
        return "nothing moves in it"
    hips = positions[:, motion.character.joint_of.get("hips", 0)]
    if np.ptp(hips[:, 1]) <= within:
        return "its hips never change their height"
    return ""
