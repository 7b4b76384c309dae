"""Self-contact: distance of hands from the places on their own body where they should rest."""

from collections.abc import Mapping

import numpy as np

from retarget_bench.api import Metric, MetricCard, Touch, Value
from retarget_bench.api.comparison import Comparison
from retarget_bench.motion import rotation
from retarget_bench.motion.motion import Motion
from retarget_bench.motion.transfer import relative

NEAR = 0.01
"""Heights: a touch that is no farther off is kept. The exact references of generated motion, for which such
labels exist, touch to one centimetre, which is no more than this on any body that is a metre tall."""

GAP = (
    "distance of the touching point, carried by its joint, from its place, carried by the joint that bears "
    "it; joints turned by their orientation relative to the common reference pose; pooled over all touches "
    "of the case and the frames in which they should rest in full; left out where there is none"
)


class SelfTouch(Metric):
    """Distances between two points of the body; a hand inside the body counts like one off it."""

    card = MetricCard(
        name="touch",
        summary="self-contact: distance of hands from the body parts they should touch",
        version="1",
        values=(
            Value(
                id="touch_gap",
                label="self-contact error",
                meaning="mean distance of a hand from the place on its own body where it should rest",
                unit="% of height",
                better="lower",
                formula=f"100 * mean of gap / h; gap: {GAP}",
                source="the project's definition; touches are labels of the data set, never guessed",
                tolerance=1e-4,
                needs=("touches", "rotations"),
            ),
            Value(
                id="touch_recall",
                label="self-contact recall",
                meaning="share of self-contact frames in which the hand is at its place",
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
    turned, joint_of, gaps = relative(motion), motion.character.joint_of, []
    for touch in touches:
        ends = []
        for role, at in ((touch.end, touch.point), (touch.bearing, touch.place)):
            joint = joint_of[role]
            turn = turned[touch.rests, joint]
            ends.append(motion.positions[touch.rests, joint] + rotation.rotate(turn, np.asarray(at, float)))
        gaps.append(np.linalg.norm(ends[0] - ends[1], axis=-1))
    return np.concatenate(gaps)


plugin = SelfTouch
