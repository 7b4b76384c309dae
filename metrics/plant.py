"""Foot contacts by position: whether a foot in contact stays at its place and height.

``contact`` tests the speed alone, so a foot that slides slowly counts as in contact there.
"""

from collections.abc import Iterator, Mapping

import numpy as np

from retarget_bench.api import Direction, MetricCard, Value
from retarget_bench.api.comparison import Comparison, ContactLabels
from retarget_bench.motion.contact import runs
from retarget_bench.motion.ground import ground_height

RADIUS = 0.005
"""Heights: a foot within this of one place stays there; ``SOURCE`` says why. Exact references keep feet to
a millimetre."""

LEVEL = RADIUS
"""Heights: how far above or below its right height a foot may stand."""

STAY = 1.0 / 15.0
"""Seconds before and after: a foot that keeps to one place that long stays. Long enough that a foot which
turns round in the air does not; a shorter stance is not found, which costs neither recall nor precision."""

PLANT = (
    "plant: an unbroken run of frames in which the case's own labels say that a contact joint is planted; "
    "distances horizontal"
)
OVER = "height over the ground under the joint, the case's ground"
FOUND = (
    f"stays: it is at most {STAY:.3g} s, in whole frames, from a frame around which for as long, before "
    f"and after, all places are within {RADIUS:g} h of its own, and the joint's {OVER}, is at most "
    f"{LEVEL:g} h more than the reference has the same joint, of either side, anywhere planted"
)
JOINTS = "pooled over frames and the contact joints that are labelled"
SOURCE = (
    f"the project's plant protocol; why {RADIUS:g} h: the circle measures one per cent of the height, 17 "
    "mm on an adult, and viewers noticed feet that slid by less than 21 mm (Pražák, Hoyet and O'Sullivan "
    "2011); up and down it is about the centimetre that the ground values let pass"
)


def _value(
    id_: str, label: str, meaning: str, formula: str, unit: str = "1", tolerance: float = 1e-3
) -> Value:
    needs = ("reference", "contacts", "ground")
    better: Direction = "higher" if unit == "1" else "lower"
    return Value(id_, label, meaning, unit, better, formula, SOURCE, tolerance, needs=needs)


class Plant:
    """Contacts by position, for data with exact contact labels only: labels by speed allow creeping.

    Recall alone misleads: a body that never moves its feet may score 1.
    """

    card = MetricCard(
        name="plant",
        summary="foot contacts by position: recall, precision, F1 and drift",
        version="1",
        values=(
            _value(
                "plant_recall",
                "contact recall",
                "share of the reference's contact frames in which the foot stays in contact",
                f"frames kept / frames of all plants; {PLANT}; kept of a plant: the most frames that lie "
                f"within {RADIUS:g} h of the place in one of them and have their {OVER}, within "
                f"{LEVEL:g} h of the reference's in that frame; {JOINTS}",
            ),
            _value(
                "plant_precision",
                "contact precision",
                "share of the frames with a foot in contact in which the reference's foot is too",
                "right stays / stays (0 where nothing stays, left out where nothing of the reference does "
                "either); right: the label says planted or pivoting, or the reference itself stays; "
                f"{FOUND}; {JOINTS}",
            ),
            _value(
                "plant_f1",
                "contact F1",
                "harmonic mean of contact recall and precision",
                "2 * recall * precision / (recall + precision), 0 where both are 0; left out where "
                "plant_precision is",
            ),
            _value(
                "plant_drift",
                "contact drift",
                "horizontal distance that a foot travels while it should stay in contact",
                f"100 / h * mean over plants of the largest distance between two places; {PLANT}",
                unit="% of height",
                tolerance=1e-4,
            ),
        ),
    )

    def compute(self, comparison: Comparison) -> Mapping[str, float]:
        """Left out without a reference, without true labels, and where nothing is planted."""
        schedule, expected = comparison.contact_labels, comparison.expected
        if comparison.case.contacts is None or schedule is None or expected is None:
            return {}
        if not schedule.planted.any():
            return {}
        h, feet = comparison.height, schedule.joints
        mine, theirs = comparison.predicted[:, feet] / h, expected[:, feet] / h
        over_mine, over_theirs = (_over(comparison, side * h) / h for side in (mine, theirs))
        level = np.abs(over_mine - over_theirs) <= LEVEL
        kept, extents = 0, []
        for column, first, end in _plants(schedule):
            most, extent = _kept(mine[first:end, column], level[first:end, column])
            kept += most
            extents.append(extent)
        recall = kept / int(schedule.planted.sum())
        drift = {"plant_drift": 100.0 * float(np.mean(extents))}
        highest = _highest(comparison, schedule, over_theirs) + LEVEL
        found = _stays(mine, comparison.fps) & (over_mine <= highest)
        theirs_found = _stays(theirs, comparison.fps) & (over_theirs <= highest)
        if not (found.any() or theirs_found.any()):
            return {"plant_recall": recall, **drift}
        right = schedule.planted | schedule.pivoting | theirs_found
        precision = int((found & right).sum()) / max(int(found.sum()), 1)
        both = recall + precision
        f1 = 2.0 * recall * precision / both if both else 0.0
        return {"plant_recall": recall, "plant_precision": precision, "plant_f1": f1, **drift}


def _over(comparison: Comparison, places: np.ndarray) -> np.ndarray:
    """``(frames, joints)`` metres above the ground of ``(frames, joints, 3)``."""
    floor = ground_height(comparison.case.ground, places[..., 0], places[..., 2])
    return np.asarray(places[..., 1] - floor)


def _plants(schedule: ContactLabels) -> Iterator[tuple[int, int, int]]:
    """Column, first frame and past-the-last of every plant."""
    for column, labels in enumerate(schedule.planted.T):
        for first, end in runs(labels).tolist():
            yield column, first, end


def _kept(places: np.ndarray, level: np.ndarray) -> tuple[int, float]:
    """Of one plant at places ``(frames, 3)``: the most frames near one of them and at their ``level``
    ``(frames,)``, and the largest horizontal distance between two places; a block of frames at a time."""
    (x, _, z), most, extent = places.T, 0, 0.0
    for first in range(0, len(places), _BLOCK):
        block = slice(first, first + _BLOCK)
        apart = np.hypot(x[block, None] - x, z[block, None] - z)
        most = max(most, int(((apart <= RADIUS) & level).sum(axis=1).max()))
        extent = max(extent, float(apart.max()))
    return most, extent


_BLOCK = 512


def _stays(places: np.ndarray, fps: float) -> np.ndarray:
    """``(frames, joints)`` bool: at one place with the frames before and after, of ``(frames, joints, 3)``.

    The clip's ends count as still: what is beyond them is not known."""
    reach, flat = max(round(STAY * fps), 1), places[..., [0, 2]]
    centre = np.ones(flat.shape[:2], dtype=bool)
    for lag in range(1, min(reach, len(flat) - 1) + 1):
        near = np.linalg.norm(flat[lag:] - flat[:-lag], axis=-1) <= RADIUS
        centre[:-lag] &= near
        centre[lag:] &= near
    found = centre.copy()
    for lag in range(1, min(reach, len(flat) - 1) + 1):
        found[lag:] |= centre[:-lag]
        found[:-lag] |= centre[lag:]
    return found


def _highest(comparison: Comparison, schedule: ContactLabels, over: np.ndarray) -> np.ndarray:
    """``(joints,)`` how high the reference has each joint at most while it, or its like of the other side,
    is planted; minus infinity where it never is."""
    parts = [(comparison.target.roles[joint] or "").partition("_")[2] for joint in schedule.joints]
    tops = np.where(schedule.planted, over, -np.inf).max(axis=0)
    return np.array([max(tops[k] for k, other in enumerate(parts) if other == part) for part in parts])


plugin = Plant
