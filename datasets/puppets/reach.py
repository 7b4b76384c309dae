"""Whether a body can do what a score asks of its hands: what it cannot is left out, not faked."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from . import grounds, handplants
from .bodies import Body
from .places import place, touching
from .score import SIDES, Score
from .solver import Solution

TOUCHES = 0.01
"""Metres: a hand that comes this near to its place, in every frame of its touch, touches."""

FITS = 0.005
"""Metres by which feet may hang over the edge of a step, or hands be in it."""


def gaps(score: Score, body: Body, solution: Solution) -> Mapping[tuple[str, str], float]:
    """(hand's side, place) -> metres between hand and place, at worst while it should rest there."""
    places = body.place(solution.turned, solution.root)
    found: dict[tuple[str, str], float] = {}

    def point(part: str, at: np.ndarray) -> np.ndarray:
        joint = body.part[part]
        return places[:, joint] + solution.turned[:, joint] @ at

    for side in SIDES:
        for touch in score.hands[side].touches:
            spot, full = place(touch.place, body), touch.weight == 1.0
            apart = point(f"{side}_hand", touching(spot, side, body.proportions)) - point(
                spot.part, spot.at
            )
            gap = np.sqrt((apart[full] ** 2).sum(axis=-1)).max(initial=0.0)
            found[side, touch.place] = max(found.get((side, touch.place), 0.0), float(gap))
        for plant in score.hands[side].plants:
            apart = places[:, body.part[f"{side}_hand"]] - handplants.wrist(plant, side, body)
            gap = np.sqrt((apart**2).sum(axis=-1))[handplants.rests(plant, score.frames)].max(initial=0.0)
            found[side, "floor"] = max(found.get((side, "floor"), 0.0), float(gap))
    return found


def out_of_reach(score: Score, body: Body, solution: Solution) -> Mapping[str, float]:
    """Place -> metres by which a hand falls short of it, or stairs do not suit the body; empty where all
    touches of the score touch and the stairs suit."""
    found: dict[str, float] = {}
    for (_, name), gap in gaps(score, body, solution).items():
        if gap > TOUCHES:
            found[name] = max(found.get(name, 0.0), gap)
    misfit = grounds.misfit(score, body, solution)
    return {**found, "stairs": misfit} if misfit > FITS else found
