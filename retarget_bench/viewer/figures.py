"""Figures of motions: their joints, and which of them rest on the ground."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from retarget_bench.api import Prediction
from retarget_bench.api.comparison import contact_roles
from retarget_bench.motion.contact import planted
from retarget_bench.motion.motion import Motion
from retarget_bench.viewer.scene import Figure, Part

Labels = tuple[tuple[int, ...] | None, np.ndarray | None]
"""Contact joints, and ``(frames, joints)`` bool whether they are planted; both None where not known."""


def figure_of(label: str, part: Part, motion: Prediction, labels: Labels | None = None) -> Figure:
    """A motion as a figure. labels: its contacts; None: they are found by speed."""
    joints, rests = contacts(motion) if labels is None else labels
    turned = motion if isinstance(motion, Motion) else None
    return Figure(label, part, motion.character, motion.positions, turned, joints, rests)


def contacts(motion: Prediction) -> Labels:
    """A body's contacts by speed; None and None where it has no such joint or no height."""
    body = motion.character
    joints = body.joints(contact_roles(body))
    if not joints or not body.height > 0:
        return None, None
    return tuple(joints), planted(motion.positions[:, joints], body.height, motion.fps)


def distinct(labels: Sequence[str], taken: Sequence[str] = ()) -> list[str]:
    """Labels of which no two are alike and none is taken: the second of a kind gets a number."""
    found: list[str] = []
    for label in labels:
        name, number = label, 1
        while name in (*taken, *found):
            number += 1
            name = f"{label} ({number})"
        found.append(name)
    return found
