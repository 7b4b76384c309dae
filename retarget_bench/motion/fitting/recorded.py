"""Recordings of joint positions, with the rotations that come nearest to them."""

from dataclasses import replace

import numpy as np

from retarget_bench.motion.character import Character
from retarget_bench.motion.fitting import fit
from retarget_bench.motion.recording import Recording, reach
from retarget_bench.motion.skeleton import Skeleton

_METRES = (0.5, 3.0)
"""Reach of bodies that are taken as they are; others are scaled first, since thresholds of the fit are
metres."""

_FAR = 3.0
"""Percent of the body's height, on average, from which a fit is doubtful."""


def with_rotations(recording: Recording) -> Recording:
    """A recording with the rotations that bring its skeleton nearest to its positions, and a note on how
    near; without positions as it is. Roles of joints are found by their names."""
    if recording.positions is None:
        return recording
    skeleton, size = recording.skeleton, reach(recording.skeleton)
    scale = 1.0 if _METRES[0] <= size <= _METRES[1] else 1.0 / max(size, 1e-12)
    body = Character.of("body", Skeleton(skeleton.names, skeleton.parents, skeleton.offsets * scale))
    fitted = fit.fit(body.positions(recording.positions * scale, recording.fps))
    off, most = (100 * each / max(body.height, 1e-9) for each in (fitted.mean, fitted.worst))
    joint = skeleton.names[int(fitted.distances.max(axis=0).argmax())]
    deviation = f"{_percent(off)} of the body's height off on average, {_percent(most)} at most ({joint})"
    notes, doubts = [*recording.notes], [*recording.doubts]
    if off > _FAR:
        doubts.append(
            f"joint positions are of no body with bones of one length: fitted rotations are {deviation}"
        )
    else:
        notes.append(f"rotations were fitted to joint positions: {deviation}")
    return replace(
        recording,
        rotations=np.asarray(fitted.motion.rotations),
        notes=tuple(notes),
        doubts=tuple(doubts),
        positions=None,
    )


def _percent(share: float) -> str:
    return f"{share:.2g} %" if share >= 0.01 else "less than 0.01 %"
