"""Personal ways of moving: a style, involuntary small movements, and how a walker carries the body."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from ...conventions import SIDES, seconds
from ...curves import wander
from ...randomness import Stream
from ..score import Hand, Touch, Trunk


@dataclass(frozen=True)
class Style:
    """posture: forward lean, radians. bounce, swing: 1 is usual. asymmetry: difference between sides.
    loose: size of involuntary movement. toe_out: radians. stance: half hip widths. elbow: bend, radians.
    aside: how far the arms hang off the body, radians."""

    posture: float
    bounce: float
    swing: float
    asymmetry: float
    loose: float
    toe_out: float
    stance: float
    elbow: float
    aside: float

    @classmethod
    def draw(cls, stream: Stream) -> Style:
        """A person's style: each time the same one for a stream that belongs to a person."""
        if stream.person:
            stream = Stream(stream.person)
        return cls(
            posture=0.03 + stream.normal(0.05),
            bounce=stream.uniform(0.65, 1.5),
            swing=stream.uniform(0.65, 1.4),
            asymmetry=stream.normal(0.10),
            loose=stream.uniform(0.6, 1.7),
            toe_out=stream.uniform(0.05, 0.25),
            stance=stream.uniform(0.9, 1.25),
            elbow=stream.uniform(0.18, 0.6),
            aside=stream.uniform(0.06, 0.28),
        )


def hanging(ahead: np.ndarray, aside: np.ndarray, bend: np.ndarray) -> np.ndarray:
    """``(frames, 3)`` reach of an arm that hangs: angles forward and outward, and the elbow's bend."""
    length = np.cos(0.5 * bend)
    # the forearm goes before the upper arm
    ahead = ahead + 0.5 * bend
    return rows(
        len(ahead),
        length * np.sin(aside),
        -length * np.cos(aside) * np.cos(ahead),
        length * np.cos(aside) * np.sin(ahead),
    )


def rows(frames: int, *each: np.ndarray | float) -> np.ndarray:
    """``(frames, n)`` of channels over time or constants."""
    return np.stack([np.zeros(frames) + row for row in each], axis=-1)


def along(heading: float, far: float) -> tuple[float, float]:
    """(x, z) of a point so far along a heading."""
    return far * float(np.sin(heading)), far * float(np.cos(heading))


Rows = Iterable[np.ndarray | float]
"""Channels over time or constants: (turn to the left, lean forward, lean to the left), radians."""
_UPRIGHT = (0.0, 0.0, 0.0)


class Performer:
    """A person with a style in a performance of so many frames. t: ``(frames,)`` seconds."""

    def __init__(self, stream: Stream, frames: int, style: Style | None = None) -> None:
        self.stream, self.frames, self.style = stream, frames, style or Style.draw(stream)
        self.t = seconds(frames)

    def wander(self, size: float, slow: float = 0.15, fast: float = 0.9) -> np.ndarray:
        """``(frames,)`` a small involuntary movement between so many hertz."""
        return wander(self.stream, self.t, size * self.style.loose, slow, fast)

    def hang(self, ahead: float, aside: float, bend: float) -> np.ndarray:
        """``(frames, 3)`` reach of an arm at ease, with involuntary movements of so many radians."""
        return hanging(
            self.wander(ahead), self.style.aside + self.wander(aside), self.style.elbow + self.wander(bend)
        )

    def idle_hand(self, touches: tuple[Touch, ...] = ()) -> Hand:
        """An arm that hangs at ease."""
        return self.hand(self.hang(0.035, 0.02, 0.05), touches=touches)

    def hand(
        self,
        reach: np.ndarray,
        *,
        upright: float = 0.7,
        middle: float = 0.0,
        swivel: float | np.ndarray = 0.0,
        wrist: np.ndarray | float = 0.0,
        touches: tuple[Touch, ...] = (),
    ) -> Hand:
        """A hand with the given reach and a relaxed wrist."""
        rest = np.zeros(self.frames)
        relaxed = rows(self.frames, 0.18 + self.wander(0.08), 0.0, self.wander(0.08))
        return Hand(reach, rest + upright, rest + middle, rest + swivel, relaxed + wrist, touches)

    def trunk(
        self, pelvis: Rows = _UPRIGHT, chest: Rows = _UPRIGHT, gaze: Rows = _UPRIGHT, follow: float = 0.2
    ) -> Trunk:
        """Angles given and small movements added: breathing, swaying, looking about."""
        frames, posture = self.frames, np.array([0.0, self.style.posture, 0.0])
        breath = (
            0.012 * self.style.loose * np.sin(2.0 * np.pi * (0.27 * self.t + self.stream.uniform(0.0, 1.0)))
        )
        turn, lean, aside = (self.wander(size) for size in (0.012, 0.010, 0.008))
        glances = [self.wander(size, 0.1, 0.6) for size in (0.06, 0.03, 0.025)]
        small = rows(frames, turn, lean - breath, aside)
        return Trunk(
            pelvis=rows(frames, *pelvis) + 0.35 * small + 0.3 * posture,
            chest=rows(frames, *chest) + small + 0.7 * posture,
            gaze=rows(frames, *gaze) + rows(frames, *glances) + 0.5 * posture,
            follow=follow,
        )


@dataclass(frozen=True)
class Carriage:
    """Settings of how the body is carried over its steps, in shares of a usual walk's or added to it.

    low, bob: of the hips' mean height and its going up and down, leg lengths. shock: share of the bob by
    which landings shake the hips. sway: to the side.
    turn, drop: of the pelvis. lean: of the chest, tilt: of the pelvis, gaze: of the head, radians forward.
    back: of the hips for a radian that the trunk leans ahead, leg lengths.
    counter: of the chest against the pelvis.
    swing: of the arms; ahead, aside, bend: of the hanging arm, radians; hinge: share of the swing by which
    the elbow's bend swings. out: how far the elbows are turned outward, radians, and behind: how much more
    for a radian that the arm swings back. still: share of its swing that the left and the right arm lacks.
    """

    low: float = 0.018
    bob: float = 0.017
    shock: float = 0.1
    sway: float = 0.030
    turn: float = 0.10
    drop: float = 0.065
    tilt: float = 0.05
    lean: float = 0.03
    gaze: float = 0.06
    back: float = 0.15
    counter: float = 1.0
    swing: float = 0.36
    ahead: float = -0.14
    aside: float = 0.0
    bend: float = 0.0
    hinge: float = 0.5
    out: float = 0.1
    behind: float = 0.3
    still: tuple[float, float] = (0.0, 0.0)


_ARMS = ("swing", "ahead", "aside", "bend", "hinge", "out")
_HANGING = ((0.26, 0.50), (-0.26, -0.06), (-0.04, 0.06), (-0.05, 0.2), (0.4, 0.8), (-0.2, 0.3))
_BRISK = ((0.45, 0.72), (-0.32, -0.14), (-0.02, 0.10), (0.0, 0.4), (0.5, 0.8), (-0.1, 0.4))
_HELD_OUT = ((0.24, 0.45), (-0.22, 0.00), (0.10, 0.45), (0.0, 0.5), (0.3, 0.6), (0.0, 0.6))
_RAISED = ((0.42, 0.70), (-0.55, -0.30), (0.00, 0.20), (0.9, 1.5), (0.3, 0.6), (0.1, 0.7))
_WAYS = (_HANGING,) * 4 + (_BRISK,) * 3 + (_HELD_OUT,) * 2 + (_RAISED,) * 2
"""Ranges of the arms in ``Carriage``, in the order of ``_ARMS``."""


def personal(stream: Stream, style: Style, step: float) -> Carriage:
    """The carriage of a person who walks with steps of so many leg lengths."""
    lean = 0.12 + stream.normal(0.13)
    low, bob = stream.uniform(0.014, 0.050), stream.uniform(0.013, 0.030) * style.bounce
    # a long step moves the hips up and down by itself
    bob = min(bob, 0.034 - 0.07 * max(step - 0.6, 0.0))
    # the shorter the step, the less lets a knee be nearly straight when the heel strikes
    most = 0.026 + 0.20 * (step - 0.5) + 0.08 * (lean + style.posture - 0.1)
    share = min(max(most, 0.022) / (low + bob), 1.0)
    return Carriage(
        low=share * low + 0.10 * max(lean - 0.2, 0.0),
        bob=max(share * bob, 0.0105) / style.bounce,
        shock=stream.uniform(0.12, 0.40),
        sway=stream.uniform(0.018, 0.052),
        turn=stream.uniform(0.06, 0.15),
        drop=stream.uniform(0.04, 0.09),
        tilt=0.03 + 0.30 * lean,
        lean=lean,
        gaze=0.04 + 0.25 * lean,
        still=_still(stream),
        **{name: stream.uniform(*pair) for name, pair in zip(_ARMS, stream.choice(_WAYS), strict=True)},
    )


def _still(stream: Stream) -> tuple[float, float]:
    """Every fourth walker keeps one arm rather still, as if it carried something."""
    side, share = stream.choice(SIDES), stream.uniform(0.5, 0.95)
    if stream.choice((True, False, False, False)):
        return (share, 0.0) if side == "left" else (0.0, share)
    return (0.0, 0.0)
