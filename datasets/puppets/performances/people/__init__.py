"""Kinds of performance on two legs: each function draws a Score of so many frames from random numbers."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial

from ...randomness import Stream
from ..score import Score
from .crawling import crawl
from .dancing import dance_line, dance_steps
from .gestures import (
    arms_crossed,
    bow,
    clap,
    hands_on_hips,
    point,
    salute,
    stand,
    touch_head,
    touch_toe,
    wave,
)
from .jumping import hop, jump, leap
from .kneeling import kneel, lunge
from .running import jog, run
from .sequencing import strung
from .sitting import get_up, sit
from .squatting import lift, squat, touch_floor
from .stairs import stairs_down, stairs_up
from .striking import catch, kick_front, kick_side, pull, punch, push, throw
from .walking import arc, limp, march, sneak, turn, walk, walk_backwards, walk_sideways


def sequence(
    stream: Stream, frames: int, kinds: Sequence[str] = (), among: Sequence[str] | None = None
) -> Score:
    """Several kinds one after the other by one person, with transitions: ``kinds`` in order, or drawn
    ``among`` names (all kinds that begin and end standing). ``Score.acts`` says what is done when.

    Raises ValueError where a kind does not stand where it is joined (``sequencing.py`` tells how to).
    """
    offered = STRUNG if among is None else among
    whole = {name: FROM_STAND_TO_STAND.get(name, KINDS[name]) for name in (*offered, *kinds)}
    return strung(stream, frames, whole, kinds, LEAST)


STRUNG = (
    "walk",
    "walk_backwards",
    "walk_sideways",
    "turn",
    "jump",
    "leap",
    "hop",
    "wave",
    "squat",
    "stand",
    "point",
    "clap",
    "hands_on_hips",
    "arms_crossed",
    "touch_head",
    "touch_toe",
    "salute",
    "bow",
    "kick_front",
    "kick_side",
    "punch",
    "throw",
    "catch",
    "push",
    "pull",
    "dance_steps",
    "dance_line",
    "lunge",
    "kneel",
    "lift",
    "touch_floor",
    "arc",
    "sneak",
    "limp",
)
"""Kinds that sequences draw on their own: their performances begin and end standing, or often enough do."""

LEAST: Mapping[str, int] = {"lunge": 112, "kneel": 112, "lift": 220, "touch_floor": 80}
"""Frames that a kind takes from standing to standing: of fewer a clip shows a part."""

FROM_STAND_TO_STAND: Mapping[str, Callable[[Stream, int], Score]] = {
    "walk": partial(walk, mode="there"),
    "walk_backwards": partial(walk_backwards, mode="there"),
    "walk_sideways": partial(walk_sideways, mode="there"),
    "turn": partial(turn, mode="there"),
    "arc": partial(arc, mode="there"),
    "sneak": partial(sneak, mode="there"),
    "limp": partial(limp, mode="there"),
    "jump": partial(jump, mode="there"),
    "leap": partial(leap, mode="there"),
}
"""How kinds that need not stand at either end are drawn for sequences."""

KINDS: Mapping[str, Callable[[Stream, int], Score]] = {
    "walk": walk,
    "wave": wave,
    "squat": squat,
    "stand": stand,
    "point": point,
    "clap": clap,
    "hands_on_hips": hands_on_hips,
    "arms_crossed": arms_crossed,
    "touch_head": touch_head,
    "touch_toe": touch_toe,
    "salute": salute,
    "bow": bow,
    "kick_front": kick_front,
    "kick_side": kick_side,
    "punch": punch,
    "throw": throw,
    "catch": catch,
    "push": push,
    "pull": pull,
    "arc": arc,
    "walk_backwards": walk_backwards,
    "walk_sideways": walk_sideways,
    "turn": turn,
    "sneak": sneak,
    "march": march,
    "limp": limp,
    "jog": jog,
    "run": run,
    "stairs_up": stairs_up,
    "stairs_down": stairs_down,
    "jump": jump,
    "leap": leap,
    "hop": hop,
    "dance_steps": dance_steps,
    "dance_line": dance_line,
    "lunge": lunge,
    "kneel": kneel,
    "sit": sit,
    "get_up": get_up,
    "crawl": crawl,
    "lift": lift,
    "touch_floor": touch_floor,
    "sequence": sequence,
}
"""Kind -> the function that draws one performance of so many frames."""
