"""A performance from its end to its beginning: getting up is sitting down backwards."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..score import Trunk
from .score import DogScore, Paw, PawPlant


def backwards(score: DogScore) -> DogScore:
    """The same performance run backwards; paws that have nothing in the air only."""
    trunk, last = score.trunk, score.frames - 1
    return replace(
        score,
        heading=_turned(score.heading),
        path=_turned(score.path),
        sway=_turned(score.sway),
        height=_turned(score.height),
        trunk=Trunk(_turned(trunk.pelvis), _turned(trunk.chest), _turned(trunk.gaze)),
        fore=_turned(score.fore),
        anchor=_turned(score.anchor),
        neck=_turned(score.neck),
        tail=_turned(score.tail),
        spread=_turned(score.spread),
        paws={limb: _backwards(paw, last) for limb, paw in score.paws.items()},
    )


def _turned(channel: np.ndarray) -> np.ndarray:
    return np.ascontiguousarray(channel[::-1])


def _backwards(paw: Paw, last: int) -> Paw:
    """Every swing keeps its height, but paws still land flat and leave over their tips."""
    plants: list[PawPlant] = []
    for number, plant in enumerate(reversed(paw.plants)):
        before = paw.plants[len(paw.plants) - 2 - number] if number + 1 < len(paw.plants) else plant
        plants.append(
            replace(
                plant,
                moment=last - plant.moment,
                strike=last - plant.off,
                flat=last - plant.off,
                lift=last - plant.flat,
                off=last - plant.strike,
                strike_pitch=0.0,
                off_pitch=0.3,
                lift_height=before.lift_height,
                curl=before.curl,
            )
        )
    return Paw(tuple(plants), _turned(paw.flat))
