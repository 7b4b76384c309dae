"""Reachability of what a score asks of hands and floor, for a body."""

from collections.abc import Mapping

import numpy as np

from retarget_bench.api import Ground
from retarget_bench.motion.ground import ground_height

from ..bodies.structures import Body
from ..conventions import SIDES, sign
from ..performances.score import Score
from . import hands
from .solve import Solution
from .touch_points import touch_point, touching


def stairs_misfit(score: Score, body: Body, solution: Solution) -> float:
    """Metres by which stairs do not suit a body: its ankle hangs over the edge of a tread, its hands reach
    into the steps, its toes would have to point farther than an ankle turns. 0 on a flat floor."""
    if score.stairs is None:
        return 0.0
    floor, positions = ground(score, body), body.positions(solution.orientations, solution.root)
    worst = 0.0
    for side, flat in zip(SIDES, solution.planted.T[[0, 2]], strict=True):
        ankle = positions[flat, body.part[f"{side}_foot"]]
        if len(ankle):
            over = ankle[:, 1] - ground_height(floor, ankle[:, 0], ankle[:, 2]) - body.proportions.ankle
            worst = max(worst, float(over.max()))
        hand = body.part[f"{side}_hand"]
        out = np.array([sign(side) * body.proportions.hand, 0.0, 0.0])
        tip = positions[:, hand] + solution.orientations[:, hand] @ out
        worst = max(worst, float((ground_height(floor, tip[:, 0], tip[:, 2]) - tip[:, 1]).max()))
        worst = max(worst, _ankle_excess(body, solution, side))
    return worst


def _ankle_excess(body: Body, solution: Solution, side: str) -> float:
    """Metres by which the tip of the foot is where the ankle cannot bring it."""
    shank, foot = (solution.orientations[:, body.part[f"{side}_{part}"]] for part in ("leg", "foot"))
    cosine = (np.einsum("fij,fij->f", shank, foot) - 1.0) / 2.0
    angle = float(np.arccos(np.clip(cosine, -1.0, 1.0)).max())
    return max(angle - _ANKLE, 0.0) * (body.proportions.ball + body.proportions.toes)


_ANKLE = np.radians(60.0)
"""How far an ankle turns on stairs."""
_SPACING = 0.01
"""Between samples of a height field, leg lengths: how thick a riser is."""


def ground(score: Score, body: Body) -> Ground:
    """The floor under a body that performs the score (``scaling.py``): flat, or a height field across the
    stairs; beyond its edge the nearest sample goes on, so it is two wide.

    Between two samples a riser slopes over one spacing, just before its edge going up, just after it going
    down, so that no tread is cut.
    """
    if score.stairs is None:
        return Ground(0.0)
    stairs, leg = score.stairs, body.proportions.leg
    direction = np.round([np.sin(stairs.heading), np.cos(stairs.heading)]).astype(int)
    axis, way = (0, direction[0]) if direction[0] else (1, direction[1])
    samples = np.arange(-2, int(np.ceil(stairs.count * stairs.tread / _SPACING)) + 3) * _SPACING
    # counted from the first edge along the way; a riser's upper sample lies on the edge
    over = np.floor(samples / stairs.tread + 1e-6) + 1.0
    if stairs.rise < 0.0:
        over = np.ceil(samples / stairs.tread - 1e-6)
    heights = leg * (stairs.level + stairs.rise * np.clip(over, 0.0, stairs.count))
    start = stairs.edge[axis] + way * samples[0]
    if way < 0:
        heights, start = heights[::-1], stairs.edge[axis] - samples[-1]
    field = heights[None, :] if axis == 0 else heights[:, None]
    origin = (start * leg, 0.0) if axis == 0 else (0.0, start * leg)
    return Ground(heights=np.ascontiguousarray(field), origin=origin, spacing=_SPACING * leg)


TOUCHES = 0.01
"""Metres: a hand that comes this near to its place, in every frame of its touch, touches."""

FITS = 0.005
"""Metres by which feet may hang over the edge of a step, or hands be in it."""


def gaps(score: Score, body: Body, solution: Solution) -> Mapping[tuple[str, str], float]:
    """(hand's side, place) -> metres between hand and place, at worst while it should rest there."""
    positions = body.positions(solution.orientations, solution.root)
    gaps: dict[tuple[str, str], float] = {}

    def point(part: str, at: np.ndarray) -> np.ndarray:
        joint = body.part[part]
        return positions[:, joint] + solution.orientations[:, joint] @ at

    for side, hand in score.hands.items():
        for touch in hand.touches:
            spot, full = touch_point(touch.place, body), touch.weight == 1.0
            apart = point(f"{side}_hand", touching(spot, side, body.proportions)) - point(
                spot.part, spot.at
            )
            gap = np.sqrt((apart[full] ** 2).sum(axis=-1)).max(initial=0.0)
            gaps[side, touch.place] = max(gaps.get((side, touch.place), 0.0), float(gap))
        for contact in hand.contacts:
            apart = positions[:, body.part[f"{side}_hand"]] - hands.contact_wrist(contact, side, body)
            gap = np.sqrt((apart**2).sum(axis=-1))[hands.contact_rests(contact, score.frames)].max(
                initial=0.0
            )
            gaps[side, "floor"] = max(gaps.get((side, "floor"), 0.0), float(gap))
    return gaps


def out_of_reach(score: Score, body: Body, solution: Solution) -> Mapping[str, float]:
    """Place -> metres by which a hand falls short of it, or stairs do not suit the body; empty where all
    touches of the score touch and the stairs suit."""
    shortfalls: dict[str, float] = {}
    for (_, name), gap in gaps(score, body, solution).items():
        if gap > TOUCHES:
            shortfalls[name] = max(shortfalls.get(name, 0.0), gap)
    misfit = stairs_misfit(score, body, solution)
    return {**shortfalls, "stairs": misfit} if misfit > FITS else shortfalls
