"""The kinds of performance: each turns a stream of random numbers and a length into a Score."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from ..randomness import Stream
from ..score import Score
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
)
from .squatting import squat
from .striking import catch, kick_front, kick_side, pull, punch, push, throw
from .walking import walk
from .waving import wave

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
}
"""Kind -> the function that draws one performance of so many frames."""
