"""What a verdict cannot be sure of: bodies whose limbs are a guess, and motions that were read wrongly.

Both are carried over smoothly, and no frame stands out.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from retarget_bench.motion import plausibility, role_checks
from retarget_bench.motion.character import Motion, Prediction
from retarget_bench.motion.editing import legs
from retarget_bench.motion.transfer import FOLLOW, correspondence


def doubts(source: Prediction, result: Prediction) -> Iterator[str]:
    """Sentences on what is guessed or contradicts itself, for which there is no all-clear."""
    bodies = source.character, result.character
    if guess := legs.guess(*bodies):
        yield guess
    for body in bodies:
        if body.guessed:
            count = len(body.guessed)
            yield f"{count} roles of {body.name} are a guess, by the tree and the places of joints"
    for motion in (source, result):
        if limbs := role_checks.exchanged(motion):
            name = motion.character.name
            yield f"left and right {limbs} of {name} are exchanged, by how knees and feet bend"
    if isinstance(source, Motion):
        yield from plausibility.doubts(source)
        drive = correspondence(*bodies)
        if len(np.unique(drive[drive != FOLLOW])) < len(source.skeleton):
            yield from role_checks.left_out(source)
