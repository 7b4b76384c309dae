"""Knees and elbows that snap, or are straight where the source bends them; joints that move too fast."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from retarget_bench.motion.hinges import FOLDED
from retarget_bench.motion.roles import is_finger, is_tip
from retarget_bench.verification.verdict.defects import Defect, local_maximum, stretches
from retarget_bench.verification.verdict.pair import Pair, joint_name

FASTER = 1.5
"""Times the source's fastest turn or speed nearby, at the size of this body, that still passes."""
JUMP = 12.0
"""Degrees in 1/30 s beyond ``FASTER`` times the source's, which still pass."""
STRAIGHT, BENT = 4.0, 25.0
"""Degrees: a limb bent less is straight; one bent more is clearly bent."""
LASTING = 0.1
"""Seconds that a limb has to be straight for."""
SLACK = 1.0
"""Leg lengths per second beyond ``FASTER`` times the source's, which still pass."""


def bends(pair: Pair) -> Iterator[Defect]:
    """Defects of the knees and elbows that both bodies have."""
    for top, (middle, end) in FOLDED.items():
        if not pair.has(top, middle, end):
            continue
        theirs, ours = (
            bend(*limb) for limb in zip(*(pair.paths(r) for r in (top, middle, end)), strict=True)
        )
        name = joint_name(middle)
        yield from _snaps(pair, name, theirs, ours)
        yield from _straight(pair, name, theirs, ours)


def bend(top: np.ndarray, middle: np.ndarray, end: np.ndarray) -> np.ndarray:
    """``(frames,)`` degrees between the two bones of a limb, 0 where it is straight, given the places
    ``(frames, 3)`` of its three joints."""
    upper, lower = middle - top, end - middle
    across = np.linalg.norm(np.cross(upper, lower), axis=1)
    return np.degrees(np.arctan2(across, np.einsum("fc,fc->f", upper, lower)))


def _snaps(pair: Pair, name: str, theirs: np.ndarray, ours: np.ndarray) -> Iterator[Defect]:
    seen, found = (np.abs(each[pair.step :] - each[: -pair.step]) for each in (theirs, ours))
    if not len(found):
        return
    usual = local_maximum(seen, pair.near)
    passing = FASTER * usual + JUMP
    for part in stretches(found > passing, pair.fps):
        worst = part.start + int(np.argmax((found / passing)[part]))
        amount, source = float(found[worst]), float(usual[worst])
        yield Defect(
            "snap",
            name,
            part.start,
            part.stop - 1 + pair.step,
            worst + pair.step,
            amount,
            source,
            "degrees",
            amount / float(passing[worst]),
            f"{name} snaps ({amount:.0f} degrees in {pair.brief}; source {source:.0f})",
        )


def _straight(pair: Pair, name: str, theirs: np.ndarray, ours: np.ndarray) -> Iterator[Defect]:
    wrong = (ours < STRAIGHT) & (theirs > BENT)
    for part in stretches(wrong, pair.fps):
        if part.stop - part.start < LASTING * pair.fps:
            continue
        worst = part.start + int(np.argmax((theirs - ours)[part]))
        amount, source = float(ours[worst]), float(theirs[worst])
        yield Defect(
            "straight",
            name,
            part.start,
            part.stop - 1,
            worst,
            amount,
            source,
            "degrees",
            (source - amount) / (BENT - STRAIGHT),
            f"{name} is straight (bent by {amount:.0f} degrees; source {source:.0f})",
        )


def speeds(pair: Pair) -> Iterator[Defect]:
    """Stretches in which any joint is too fast, each with the joint that is the worst."""
    roles = [
        role
        for role in pair.result.character.joint_of
        if pair.has(role) and not is_finger(role) and not is_tip(role)
    ]
    if not roles or pair.result.frames <= pair.step:
        return
    ours, usual = (np.stack(each, axis=1) for each in zip(*(_speeds(pair, r) for r in roles), strict=True))
    passing = FASTER * usual + SLACK * max(pair.result.character.measures.leg_length, 1e-3)
    share = ours / passing
    for part in stretches(np.any(share > 1.0, axis=1), pair.fps):
        frame, joint = np.unravel_index(int(np.argmax(share[part])), share[part].shape)
        worst, role = part.start + int(frame), roles[int(joint)]
        others = int((share[part] > 1.0).any(axis=0).sum()) - 1
        amount, source = float(ours[worst, joint]), float(usual[worst, joint])
        also = f", and {others} more joint{'s' * (others > 1)}" if others else ""
        name = joint_name(role)
        yield Defect(
            "speed",
            name,
            part.start,
            part.stop - 1 + pair.step,
            worst + pair.step,
            amount,
            source,
            "m/s",
            float(share[worst, joint]),
            f"{name} at {amount:.1f} m/s (source at this size {source:.1f}){also}",
        )


def _speeds(pair: Pair, role: str) -> tuple[np.ndarray, np.ndarray]:
    """``(frames - step,)`` metres per second: a joint's, and the most that the source has nearby, at the
    size of the result's body."""
    theirs, ours = (
        np.linalg.norm(path[pair.step :] - path[: -pair.step], axis=1) * pair.fps / pair.step
        for path in pair.paths(role)
    )
    return ours, pair.reach_ratio(role) * local_maximum(theirs, pair.near)
