"""Foot contacts by position: whether a foot in contact stays at its place and height.

Contacts by speed, by which a foot that slides slowly counts as in contact, are a metric of their own.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from retarget_bench.api import Direction, Metric, MetricCard, Value, against_source
from retarget_bench.api.comparison import Comparison
from retarget_bench.motion.character import Character
from retarget_bench.motion.contact import runs
from retarget_bench.motion.ground import ground_height

RADIUS = 0.005
"""Heights: a foot within this of one place stays there; ``SOURCE`` says why. Exact references keep feet to
a millimetre, or drift by a few (``puppets[version=1.1]``)."""

LEVEL = RADIUS
"""Heights: how far above or below its right height a foot may stand."""

STAY = 1.0 / 15.0
"""Seconds before and after: a foot that keeps to one place that long stays. Long enough that a foot which
turns round in the air does not; a shorter stance is not found, which costs neither recall nor precision."""

LOW = 0.02
"""Heights: how far above its lowest stay a foot that stays is in contact, where labels have to be found:
the strictest that finds 98 % of the puppets' exact contacts with slow noise of up to 0.004 heights on the
feet. Half of it finds 73 % of them (``benchmarks/metric_thresholds.py``)."""

OVER = "height over the ground under the joint, the case's ground"
STAYS = (
    f"stays: it is at most {STAY:.3g} s, in whole frames, from a frame around which for as long, before "
    f"and after, all places are within {RADIUS:g} h of its own"
)
LABEL_RULE = f"joint stays at most {LOW:g} h higher than where it, of either side, stays lowest"
CUT = f"a stance so found ends where it is more than {RADIUS:g} h from where it began"
STANCE = (
    "stance: an unbroken run of frames in which a contact joint is labelled planted; distances horizontal"
)
LABELS = {
    "reference": "labels: the case's own where the data set has exact ones, else found in the reference: "
    f"its {LABEL_RULE}, and {CUT}",
    "source": "labels: found in the source, with its own height and joints matched by role: its "
    f"{LABEL_RULE}, and {CUT}",
}
HEIGHTS = {
    "reference": "",
    "source": "; the source's heights, in its own h, are moved by what the two bodies' joints differ by "
    "when they stand in the reference pose; left out where the ground is not level",
}
JOINTS = (
    "pooled over frames and contact joints: those that are labelled, else foot and toe of both sides and "
    "the fore paws of four-legged targets"
)
SOURCE = (
    f"the project's contact protocol; why {RADIUS:g} h: the circle measures one per cent of the height, 17 "
    "mm on an adult, and viewers noticed feet that slid by less than 21 mm (Pražák, Hoyet and O'Sullivan "
    "2011); up and down it is about the centimetre that the ground values let pass"
)


def _value(
    id_: str,
    label: str,
    meaning: str,
    formula: str,
    unit: str = "1",
    better: Direction = "higher",
    tolerance: float = 1e-3,
) -> Value:
    """A value against the reference and against the source. In its formula ``{who}`` is the one that the
    answer is compared with, ``{rule}`` the words used, ``{_src}`` the end of ids against the source."""
    rules = {who: f"{STANCE}; {LABELS[who]}; {STAYS}{HEIGHTS[who]}" for who in LABELS}
    return Value(
        id_,
        label,
        meaning,
        unit,
        better,
        formula=formula.format(who="reference", rule=rules["reference"], _src=""),
        source_formula=formula.format(who="source", rule=rules["source"], _src=against_source("")),
        source=SOURCE,
        tolerance=tolerance,
        needs=("reference", "ground"),
    )


VALUES = (
    _value(
        "contact_recall",
        "contact recall",
        "share of the reference's contact frames in which the foot stays in place, too, and as high",
        "frames kept / frames of all stances; {rule}; kept of a stance: the most frames that "
        f"lie within {RADIUS:g} h of the place in one of them and have their {OVER}, within "
        f"{LEVEL:g} h of the {{who}}'s in that frame; {JOINTS}",
    ),
    _value(
        "contact_precision",
        "contact precision",
        "share of the frames with a foot at rest in which the reference's foot is, too",
        "right contacts / contacts (0 where there is none, left out where nothing of the "
        f"{{who}} is one either); contact: the joint stays, and its {OVER}, is at most {LEVEL:g} h more "
        "than the {who} has the same joint, of either side, anywhere planted; right: the label says "
        f"planted or pivoting, or it is a contact of the {{who}} itself; {{rule}}; {JOINTS}",
    ),
    _value(
        "contact_f1",
        "contact F1",
        "harmonic mean of contact recall and precision, against the reference",
        "2 * recall * precision / (recall + precision), 0 where both are 0; left out where "
        "contact_precision{_src} is",
    ),
    _value(
        "contact_drift",
        "contact drift",
        "horizontal distance that a foot travels while the reference's stays in contact",
        "100 / h * mean over stances of the largest distance between two places; {rule}",
        unit="% of height",
        better="lower",
        tolerance=1e-4,
    ),
)


@dataclass(frozen=True, eq=False)
class ReferenceContacts:
    """The contacts of the reference or the source, for some joints of the target.

    joints: ``(contacts,)`` their indices. over: ``(frames, contacts)`` heights above the ground, in h.
    stays: ``(frames, contacts)`` bool, whether the one that is compared with stays.
    planted, pivoting: likewise, the labels. stances: column, first frame and past-the-last of each.
    """

    joints: list[int]
    over: np.ndarray
    stays: np.ndarray
    planted: np.ndarray
    pivoting: np.ndarray
    stances: list[tuple[int, int, int]]


class Contact(Metric):
    """Contacts by position: labels of the data set where it has exact ones, else found in the reference.

    Recall alone misleads: a body that never moves its feet may score 1.
    """

    card = MetricCard(
        name="contact",
        summary="foot contacts by position: recall, precision, F1 and drift",
        version="2",
        values=VALUES,
    )

    def compute(self, comparison: Comparison) -> Mapping[str, float]:
        """Left out where the target has no feet and where nothing is planted."""
        values: dict[str, float] = {}
        if (labels := of_reference(comparison)) is not None and labels.stances:
            values |= _agreement(comparison, labels)
        if (labels := of_source(comparison)) is not None and labels.stances:
            agreement = _agreement(comparison, labels)
            values |= {against_source(id_): number for id_, number in agreement.items()}
        return values


def _agreement(comparison: Comparison, labels: ReferenceContacts) -> dict[str, float]:
    """Recall and drift, and precision and F1 where there are any contacts."""
    places = comparison.predicted[:, labels.joints]
    scaled, over = places / comparison.height, _over(comparison, places) / comparison.height
    level = np.abs(over - labels.over) <= LEVEL
    matched, extents = 0, []
    for column, first, end in labels.stances:
        most, extent = _stance_scores(scaled[first:end, column], level[first:end, column])
        matched += most
        extents.append(extent)
    recall = matched / int(labels.planted.sum())
    values = {"contact_recall": recall, "contact_drift": 100.0 * float(np.mean(extents))}
    planted = np.where(labels.planted, labels.over, -np.inf)
    highest = _of_like_joints(comparison.target, labels.joints, planted, np.max)
    predicted = _stays(scaled, comparison.fps) & (over <= highest + LEVEL)
    right = labels.stays & (labels.over <= highest + LEVEL)
    if predicted.any() or right.any():
        hits = int((predicted & (labels.planted | labels.pivoting | right)).sum())
        precision = hits / max(int(predicted.sum()), 1)
        both = recall + precision
        values |= {
            "contact_precision": precision,
            "contact_f1": 2.0 * recall * precision / both if both else 0.0,
        }
    return values


# --------------------------------------------------------------------------------------------- labels
def of_reference(comparison: Comparison) -> ReferenceContacts | None:
    """The case's own labels, else those found in the reference; None where there are neither."""
    if comparison.expected is None:
        return None
    if comparison.case.contacts is None:
        joints = comparison.target.joints(comparison.contact_roles)
        places = comparison.expected[:, joints]
        over = _over(comparison, places) / comparison.height
        return _labels_of(comparison, joints, places / comparison.height, over)
    if (labels := comparison.contact_labels) is None:
        return None
    places = comparison.expected[:, labels.joints]
    over = _over(comparison, places) / comparison.height
    stays = _stays(places / comparison.height, comparison.fps)
    stances = [(k, *run) for k, column in enumerate(labels.planted.T) for run in runs(column).tolist()]
    return ReferenceContacts(labels.joints.tolist(), over, stays, labels.planted, labels.pivoting, stances)


def of_source(comparison: Comparison) -> ReferenceContacts | None:
    """The labels found in the source; None where the bodies share no contact joint or the ground is uneven,
    since only the target's is known."""
    source, target, ground = comparison.case.source, comparison.target, comparison.case.ground
    at_source, joints = comparison.shared(comparison.contact_roles)
    height = float(source.character.height)
    if ground.heights is not None or not height > 0:
        return None
    places = source.positions[:, at_source] / height
    stand = target.standing_places[joints, 1] / comparison.height
    differ = stand - source.character.standing_places[at_source, 1] / height
    return _labels_of(comparison, joints, places, places[..., 1] - ground.height / height + differ)


def _labels_of(
    comparison: Comparison, joints: list[int], places: np.ndarray, over: np.ndarray
) -> ReferenceContacts | None:
    """The labels of joints at places ``(frames, contacts, 3)`` and ``over`` the ground, both in heights."""
    if not joints:
        return None
    stays = _stays(places, comparison.fps)
    lowest = _of_like_joints(comparison.target, joints, np.where(stays, over, np.inf), np.min)
    planted = stays & (over <= lowest + LOW)
    stances = [(k, *run) for k, labels in enumerate(planted.T) for run in _cut(labels, places[:, k])]
    return ReferenceContacts(joints, over, stays, planted, np.zeros_like(planted), stances)


def _cut(labels: np.ndarray, places: np.ndarray) -> Iterator[tuple[int, int]]:
    """First frame and past-the-last of stretches of labels ``(frames,)``, near where they begin."""
    for first, end in runs(labels).tolist():
        while first < end:
            x, _, z = (places[first:end] - places[first]).T
            beyond = np.flatnonzero(np.hypot(x, z) > RADIUS)
            last = first + int(beyond[0]) if len(beyond) else end
            yield first, last
            first = last


def _of_like_joints(
    target: Character, joints: list[int], heights: np.ndarray, extreme: Callable[..., np.ndarray]
) -> np.ndarray:
    """``(contacts,)`` the extreme height of each joint and its like of the other side, in all frames."""
    parts = [(target.roles[joint] or "").partition("_")[2] for joint in joints]
    ends = extreme(heights, axis=0)
    return np.array(
        [extreme([ends[k] for k, other in enumerate(parts) if other == part]) for part in parts]
    )


# ------------------------------------------------------------------------------------------- geometry
def _over(comparison: Comparison, places: np.ndarray) -> np.ndarray:
    """``(frames, joints)`` metres above the ground of ``(frames, joints, 3)``."""
    floor = ground_height(comparison.case.ground, places[..., 0], places[..., 2])
    return np.asarray(places[..., 1] - floor)


def _stance_scores(places: np.ndarray, level: np.ndarray) -> tuple[int, float]:
    """Scores of one stance at places ``(frames, 3)``: the most frames near one of them and at their
    ``level`` ``(frames,)``, and the largest horizontal distance between two places; a block of frames at
    a time."""
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
    stays = centre.copy()
    for lag in range(1, min(reach, len(flat) - 1) + 1):
        stays[lag:] |= centre[:-lag]
        stays[:-lag] |= centre[lag:]
    return stays


plugin = Contact
