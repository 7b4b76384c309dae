"""What is known of every frame of a performance beside where the joints are."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from retarget_bench.api import Contacts, Touch

from .bodies import Body
from .handplants import rests
from .places import place, touching
from .score import SIDES, Score


@dataclass(frozen=True, eq=False)
class Labels:
    """Of one clip by one body.

    kind:     ``(frames,)`` text: what is done in each frame; sequences change.
    phase:    ``(frames,)`` 0 to 1 within what is done, or turns of its cycle.
    contacts: of the feet: planted, pivoting, or neither.
    touches:  "left hand on right_knee" -> ``(frames,)`` bool: the hand rests there.
    """

    kind: np.ndarray
    phase: np.ndarray
    contacts: Contacts
    touches: Mapping[str, np.ndarray]


def labels(score: Score, contacts: Contacts) -> Labels:
    kind = np.concatenate([np.full(act.end - act.first, act.kind) for act in score.stretches()])
    return Labels(kind, np.asarray(score.phases(), dtype=np.float64), contacts, touches(score))


def touches(score: Score) -> dict[str, np.ndarray]:
    """Hand and place -> the frames in which the hand rests there in full."""
    found: dict[str, np.ndarray] = {}
    for side in SIDES:
        for touch in score.hands[side].touches:
            name, full = f"{side} hand on {touch.place}", touch.weight == 1.0
            if full.any():
                found[name] = found.get(name, np.zeros(len(full), dtype=bool)) | full
        for plant in score.hands[side].plants:
            name = f"{side} hand on {'held thing' if plant.level > 0.0 else 'floor'}"
            found[name] = found.get(name, np.zeros(score.frames, dtype=bool)) | rests(plant, score.frames)
    return found


def self_touches(score: Score, body: Body) -> tuple[Touch, ...]:
    """The same hands on places of the own body, as cases tell them: those whose joints the rig has."""
    roles = dict(zip(body.structure.parts, body.structure.roles, strict=False))
    found: dict[tuple[str, str], np.ndarray] = {}
    for side in SIDES:
        for touch in score.hands[side].touches:
            key, full = (side, touch.place), touch.weight == 1.0
            if full.any():
                found[key] = found[key] | full if key in found else full
    told = []
    for (side, name), full in found.items():
        spot, end = place(name, body), roles.get(f"{side}_hand")
        bearing = roles.get(spot.part)
        if end and bearing:
            told.append(Touch(end, touching(spot, side, body.proportions), bearing, spot.at, full))
    return tuple(told)
