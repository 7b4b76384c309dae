"""The kinds of performance: each turns a stream of random numbers and a length into a Score."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

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
from .sequencing import strung
from .squatting import squat
from .striking import catch, kick_front, kick_side, pull, punch, push, throw
from .walking import walk
from .waving import wave


def sequence(
    stream: Stream, frames: int, kinds: Sequence[str] = (), among: Sequence[str] | None = None
) -> Score:
    """Several kinds one after the other by one person, with transitions: ``kinds`` in order, or drawn
    ``among`` names (all kinds that begin and end standing). ``Score.acts`` says what is done when.

    Raises ValueError where a kind does not stand where it is joined (``sequencing.py`` tells how to).
    """
    offered = [name for name in KINDS if name not in NOT_STRUNG] if among is None else list(among)
    return strung(stream, frames, {name: KINDS[name] for name in (*offered, *kinds)}, kinds)


NOT_STRUNG = ("walk", "sequence")
"""Kinds that sequences do not draw on their own: not every performance of theirs begins and ends standing."""

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
    "sequence": sequence,
}
"""Kind -> the function that draws one performance of so many frames."""
