"""Poses that a body is known to take, from motion to train on, seen from the body itself."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from typing import Protocol

import numpy as np

from retarget_bench.errors import NotSupported, Unusable
from retarget_bench.motion import facing, transfer
from retarget_bench.motion.character import Character
from retarget_bench.motion.motion import Motion

CLIPS = 240
"""The most clips that poses are taken from."""
RULE = "hip_height"


class MotionClips(Protocol):
    """Motions of one character, each made when it is asked for."""

    def __len__(self) -> int: ...
    def __getitem__(self, index: int, /) -> Motion: ...


Cast = Mapping[str, Mapping[str, MotionClips]]
"""Structure -> character -> its clips."""


def poses(cast: Cast | None, target: Character, most: int) -> np.ndarray:
    """``(poses, joints, 3)`` metres: what the target does when it copies the training motion, evenly over
    clips and time, at most so many; hips (or root) at the origin, facing +Z.

    Rotations are copied from bodies of the target's structure, or where there is none from all that stand
    on as many legs, so that bones are the target's own. Raises NotSupported where there is no such motion.
    """
    chosen = _spread(_usable(cast or {}, target), CLIPS)
    if not chosen:
        raise NotSupported(
            f"there is no motion to train on that {target.name} ({target.structure}) could copy"
        )
    share = max(1, most // len(chosen))
    found = []
    for clips, number in chosen:
        try:
            motion = clips[number]
        except Unusable:
            continue
        frames = np.unique(np.linspace(0, motion.frames - 1, min(share, motion.frames)).round().astype(int))
        carried = transfer.carry(motion.at(frames), target, RULE).positions
        found.append(_seen(carried, target))
    if not found:
        raise NotSupported(f"no clip that {target.name} could copy can be used")
    return np.concatenate(found)


def _seen(places: np.ndarray, body: Character) -> np.ndarray:
    hips = body.joint_of.get("hips", 0)
    return facing.seen(places - places[:, [hips]], facing.facing(places, body)[:, None])


def _usable(cast: Cast, target: Character) -> list[tuple[MotionClips, int]]:
    """Clips by their number: of the target's structure, else of bodies on as many legs."""
    own = {target.structure: cast[target.structure]} if cast.get(target.structure) else cast
    found = []
    for mine in own.values():
        for clips in mine.values():
            if (body := _body(clips)) is not None and _fits(body, target):
                found += [(clips, number) for number in range(len(clips))]
    return found


def _body(clips: MotionClips) -> Character | None:
    """Of the first clip that can be used."""
    for number in range(len(clips)):
        with suppress(Unusable):
            return clips[number].character
    return None


def _fits(source: Character, target: Character) -> bool:
    return source.four_legged == target.four_legged and transfer.reason(source, target) is None


def _spread(found: Sequence[tuple[MotionClips, int]], most: int) -> list[tuple[MotionClips, int]]:
    at = np.unique(np.linspace(0, len(found) - 1, min(most, len(found))).round().astype(int))
    return [found[index] for index in at.tolist()]
