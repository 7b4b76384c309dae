"""A part of a performance, for clips too short for all of it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..score import Foot, Hand, Score, Touch, Trunk


def cut(score: Score, first: int, frames: int) -> Score:
    """``frames`` frames from ``first`` on; of performances without flights, stairs or several acts."""
    part = slice(first, first + frames)
    return replace(
        score,
        heading=score.heading[part],
        path=score.path[part],
        sway=score.sway[part],
        height=score.height[part],
        balance=score.balance[part],
        support=score.support[part],
        sit_back=None if score.sit_back is None else score.sit_back[part],
        prone=None if score.prone is None else score.prone[part],
        trunk=_trunk(score.trunk, part),
        feet={side: _foot(foot, part) for side, foot in score.feet.items()},
        hands={side: _hand(hand, part) for side, hand in score.hands.items()},
        phase=score.phases()[part],
    )


def _trunk(trunk: Trunk, part: slice) -> Trunk:
    follow = trunk.follow[part] if isinstance(trunk.follow, np.ndarray) else trunk.follow
    return Trunk(trunk.pelvis[part], trunk.chest[part], trunk.gaze[part], follow)


def _foot(foot: Foot, part: slice) -> Foot:
    later = part.start
    plants = tuple(
        replace(
            plant,
            strike=plant.strike - later,
            flat=plant.flat - later,
            lift=plant.lift - later,
            off=plant.off - later,
        )
        for plant in foot.plants
    )
    return Foot(
        plants,
        foot.heel[part],
        None,
        None if foot.kneel is None else foot.kneel[part],
        None if foot.bears is None else foot.bears[part],
    )


def _hand(hand: Hand, part: slice) -> Hand:
    later = part.start
    return Hand(
        reach=hand.reach[part],
        upright=hand.upright[part],
        middle=hand.middle[part],
        swivel=hand.swivel[part],
        wrist=hand.wrist[part],
        touches=tuple(Touch(touch.place, touch.weight[part]) for touch in hand.touches),
        aim=None if hand.aim is None else hand.aim[part],
        aimed=hand.aimed[part] if isinstance(hand.aimed, np.ndarray) else hand.aimed,
        plants=tuple(
            replace(plant, strike=plant.strike - later, off=plant.off - later) for plant in hand.plants
        ),
    )
