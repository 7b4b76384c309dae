"""Kinds of performance on two legs: each function draws a Score of so many frames from random numbers."""

from collections.abc import Callable, Mapping, Sequence
from functools import partial

from ...randomness import Stream
from ..score import Score
from . import (
    crawling,
    dancing,
    gestures,
    jumping,
    kneeling,
    running,
    sitting,
    squatting,
    striking,
    walking,
)
from .sequencing import strung


def sequence(stream: Stream, frames: int, among: Sequence[str] = ()) -> Score:
    """Several kinds one after the other by one person, with transitions, drawn ``among`` names (all that
    begin and end standing). ``Score.acts`` says what is done when."""
    names = among or STRUNG
    return strung(
        stream, frames, {name: FROM_STAND_TO_STAND.get(name, KINDS[name]) for name in names}, LEAST
    )


LEAST: Mapping[str, int] = {"lunge": 112, "kneel": 112, "lift": 220, "touch_floor": 80}
"""Frames that a kind takes from standing to standing: of fewer a clip shows a part."""

_ON_THE_SPOT: Mapping[str, Callable[..., Score]] = {
    "wave": gestures.wave,
    "squat": squatting.squat,
    "stand": gestures.stand,
    "point": gestures.point,
    "clap": gestures.clap,
    "hands_on_hips": gestures.hands_on_hips,
    "arms_crossed": gestures.arms_crossed,
    "touch_head": gestures.touch_head,
    "touch_toe": gestures.touch_toe,
    "salute": gestures.salute,
    "bow": gestures.bow,
    "kick_front": partial(striking.kick, kind="kick_front"),
    "kick_side": partial(striking.kick, kind="kick_side"),
    "punch": striking.punch,
    "throw": striking.throw,
    "catch": striking.catch,
    "push": partial(striking.shove, kind="push"),
    "pull": partial(striking.shove, kind="pull"),
}

KINDS: Mapping[str, Callable[..., Score]] = {
    "walk": walking.walk,
    **_ON_THE_SPOT,
    "arc": partial(walking.walk, mode="steady", kind="arc"),
    "walk_backwards": walking.walk_backwards,
    "walk_sideways": walking.walk_sideways,
    "turn": walking.turn,
    "sneak": walking.sneak,
    "march": walking.march,
    "limp": walking.limp,
    "jog": partial(running.run, kind="jog"),
    "run": running.run,
    "stairs_up": partial(walking.stairs, kind="stairs_up"),
    "stairs_down": partial(walking.stairs, kind="stairs_down"),
    "jump": jumping.jump,
    "leap": partial(jumping.jump, kind="leap"),
    "hop": jumping.hop,
    "dance_steps": dancing.dance_steps,
    "dance_line": dancing.dance_line,
    "lunge": kneeling.lunge,
    "kneel": kneeling.kneel,
    "sit": sitting.sit,
    "get_up": partial(sitting.sit, kind="get_up"),
    "crawl": crawling.crawl,
    "lift": squatting.lift,
    "touch_floor": squatting.touch_floor,
    "sequence": sequence,
}
"""Kind -> the function that draws one performance of so many frames."""

_FIRST = ("walk", "walk_backwards", "walk_sideways", "turn", "jump", "leap", "hop")
_LAST = ("dance_steps", "dance_line", "lunge", "kneel", "lift", "touch_floor", "arc", "sneak", "limp")
STRUNG = (*_FIRST, *_ON_THE_SPOT, *_LAST)
"""Kinds that sequences draw on their own: their performances begin and end standing, or often enough do."""

FROM_STAND_TO_STAND: Mapping[str, Callable[[Stream, int], Score]] = {
    kind: partial(KINDS[kind], mode="there") for kind in (*_FIRST[:4], "arc", "sneak", "limp", *_FIRST[4:6])
}
"""Kinds that need not stand at either end, as they are drawn for sequences."""
