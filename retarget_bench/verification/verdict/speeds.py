"""Joints that move much faster than the source's would on this body."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from retarget_bench.motion.roles import is_finger, is_tip
from retarget_bench.verification.verdict.defects import Defect, local_maximum, stretches
from retarget_bench.verification.verdict.pair import Pair, joint_name

FASTER = 1.5
"""Times the source's fastest nearby, at the size of this body, that still passes."""
SLACK = 1.0
"""Leg lengths per second beyond that, which still pass."""


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
