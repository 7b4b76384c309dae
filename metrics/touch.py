"""Self-touches: do hands rest on the places of their own body that they should rest on."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from retarget_bench.api import MetricCard, Touch, Value
from retarget_bench.api.comparison import Comparison
from retarget_bench.motion import rotation
from retarget_bench.motion.alignment import relative
from retarget_bench.motion.motion import Motion

NEAR = 0.01
"""Heights: a touch that is no farther off is kept. The exact references of generated motion, for which such
labels exist, touch to one centimetre, which is no more than this on any body that is a metre tall."""

GAP = (
    "distance of the touching point, carried by its joint, from its place, carried by the joint that bears "
    "it; joints turned by their orientation relative to the common reference pose; pooled over all touches "
    "of the case and the frames in which they should rest in full; left out where there is none"
)


class SelfTouch:
    """Inside the flesh counts like off it: what is measured is the distance of two points."""

    card = MetricCard(
        name="touch",
        summary="whether hands rest on the places of the own body that they should",
        version="1",
        values=(
            Value(
                id="touch_gap",
                label="touch gap",
                meaning="how far a hand is from the place of the own body that it should rest on",
                unit="% of height",
                better="lower",
                formula=f"100 * mean of gap / h; gap: {GAP}",
                source="the project's definition; touches are labels of the data set, never guessed",
                tolerance=1e-4,
                needs=("touches", "rotations"),
            ),
            Value(
                id="touch_recall",
                label="touch recall",
                meaning="when a hand should rest on the own body, how often it does",
                unit="1",
                better="higher",
                formula=f"share of touches and frames with gap <= {NEAR:g} h; gap: {GAP}",
                source="the project's definition; threshold: the references touch to a centimetre",
                tolerance=1e-3,
                needs=("touches", "rotations"),
            ),
        ),
    )

    def compute(self, comparison: Comparison) -> Mapping[str, float]:
        """Left out where no touch is known, none rests, or only positions are."""
        if not isinstance(comparison.prediction, Motion) or not comparison.touches:
            return {}
        gaps = _gaps(comparison.prediction, comparison.touches) / comparison.height
        if not gaps.size:
            return {}
        return {"touch_gap": 100.0 * float(gaps.mean()), "touch_recall": float((gaps <= NEAR).mean())}


def _gaps(motion: Motion, touches: tuple[Touch, ...]) -> np.ndarray:
    """``(touches' frames,)`` metres, one touch after the other."""
    turned, joint_of, found = relative(motion), motion.character.joint_of, []
    for touch in touches:
        ends = []
        for role, at in ((touch.end, touch.point), (touch.bearing, touch.place)):
            joint = joint_of[role]
            turn = turned[touch.rests, joint]
            ends.append(motion.positions[touch.rests, joint] + rotation.rotate(turn, np.asarray(at, float)))
        found.append(np.linalg.norm(ends[0] - ends[1], axis=-1))
    return np.concatenate(found)


plugin = SelfTouch
