"""Personal ways of moving: a style, involuntary small movements, and how a walker carries the body."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...conventions import FPS, SIDES
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


def seconds(frames: int) -> np.ndarray:
    """``(frames,)`` the time of each frame."""
    return np.arange(frames) / FPS


def hanging(ahead: np.ndarray, aside: np.ndarray, bend: np.ndarray) -> np.ndarray:
    """``(frames, 3)`` reach of an arm that hangs: angles forward and outward, and the elbow's bend."""
    length = np.cos(0.5 * bend)
    # the forearm goes before the upper arm
    ahead = ahead + 0.5 * bend
    return np.stack(
        [
            length * np.sin(aside),
            -length * np.cos(aside) * np.cos(ahead),
            length * np.cos(aside) * np.sin(ahead),
        ],
        axis=-1,
    )


def idle_hand(stream: Stream, frames: int, style: Style, touches: tuple[Touch, ...] = ()) -> Hand:
    """An arm that hangs at ease."""
    t = seconds(frames)
    ahead = wander(stream, t, 0.035 * style.loose)
    aside = style.aside + wander(stream, t, 0.02 * style.loose)
    bend = style.elbow + wander(stream, t, 0.05 * style.loose)
    return hand(stream, t, hanging(ahead, aside, bend), style, touches=touches)


def hand(
    stream: Stream,
    t: np.ndarray,
    reach: np.ndarray,
    style: Style,
    *,
    upright: float = 0.7,
    middle: float | np.ndarray = 0.0,
    swivel: float | np.ndarray = 0.0,
    wrist: np.ndarray | None = None,
    touches: tuple[Touch, ...] = (),
) -> Hand:
    """A hand with the given reach and a relaxed wrist."""
    rest = np.zeros(len(t))
    relaxed = np.stack(
        [0.18 + wander(stream, t, 0.08 * style.loose), rest, wander(stream, t, 0.08 * style.loose)], axis=-1
    )
    return Hand(
        reach=reach,
        upright=rest + upright,
        middle=rest + middle,
        swivel=rest + swivel,
        wrist=relaxed if wrist is None else relaxed + wrist,
        touches=touches,
    )


def trunk(
    stream: Stream,
    t: np.ndarray,
    style: Style,
    *,
    pelvis: np.ndarray | None = None,
    chest: np.ndarray | None = None,
    gaze: np.ndarray | None = None,
    follow: float = 0.2,
) -> Trunk:
    """Angles ``(frames, 3)`` given and small movements added: breathing, swaying, looking about."""
    still = np.zeros((len(t), 3))
    breath = 0.012 * style.loose * np.sin(2.0 * np.pi * (0.27 * t + stream.uniform(0.0, 1.0)))
    small = [wander(stream, t, size * style.loose) for size in (0.012, 0.010, 0.008)]
    look = [wander(stream, t, size * style.loose, 0.1, 0.6) for size in (0.06, 0.03, 0.025)]
    lean = np.zeros_like(still)
    lean[:, 1] = style.posture
    added = np.stack([small[0], small[1] - breath, small[2]], axis=-1)
    return Trunk(
        pelvis=(still if pelvis is None else pelvis) + 0.35 * added + 0.3 * lean,
        chest=(still if chest is None else chest) + added + 0.7 * lean,
        gaze=(still if gaze is None else gaze) + np.stack(look, axis=-1) + 0.5 * lean,
        follow=follow,
    )


Range = tuple[float, float]


@dataclass(frozen=True)
class Carriage:
    """How the body is carried over its steps, in shares of a usual walk's or added to it.

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


@dataclass(frozen=True)
class _Arms:
    """Ranges of what ``Carriage`` says of arms."""

    swing: Range
    ahead: Range
    aside: Range
    bend: Range
    hinge: Range
    out: Range

    def draw(self, stream: Stream) -> dict[str, float]:
        return {name: stream.uniform(*pair) for name, pair in vars(self).items()}


_HANGING = _Arms((0.26, 0.50), (-0.26, -0.06), (-0.04, 0.06), (-0.05, 0.2), (0.4, 0.8), (-0.2, 0.3))
_BRISK = _Arms((0.45, 0.72), (-0.32, -0.14), (-0.02, 0.10), (0.0, 0.4), (0.5, 0.8), (-0.1, 0.4))
_HELD_OUT = _Arms((0.24, 0.45), (-0.22, 0.00), (0.10, 0.45), (0.0, 0.5), (0.3, 0.6), (0.0, 0.6))
_RAISED = _Arms((0.42, 0.70), (-0.55, -0.30), (0.00, 0.20), (0.9, 1.5), (0.3, 0.6), (0.1, 0.7))
_ARMS = (_HANGING,) * 4 + (_BRISK,) * 3 + (_HELD_OUT,) * 2 + (_RAISED,) * 2


def personal(stream: Stream, style: Style, step: float) -> Carriage:
    """The carriage of a person who walks with steps of so many leg lengths."""
    lean = 0.12 + stream.normal(0.13)
    low, bob = _hips(stream, style, step, lean + style.posture)
    return Carriage(
        low=low + 0.10 * max(lean - 0.2, 0.0),
        bob=bob,
        shock=stream.uniform(0.12, 0.40),
        sway=stream.uniform(0.018, 0.052),
        turn=stream.uniform(0.06, 0.15),
        drop=stream.uniform(0.04, 0.09),
        tilt=0.03 + 0.30 * lean,
        lean=lean,
        gaze=0.04 + 0.25 * lean,
        still=_still(stream),
        **stream.choice(_ARMS).draw(stream),
    )


def _hips(stream: Stream, style: Style, step: float, lean: float) -> tuple[float, float]:
    """How low they are carried and how much they bob, within what lets a knee be nearly straight when the
    heel strikes: the shorter the step, the less."""
    low, bob = stream.uniform(0.014, 0.050), stream.uniform(0.013, 0.030) * style.bounce
    # a long step moves the hips up and down by itself
    bob = min(bob, 0.034 - 0.07 * max(step - 0.6, 0.0))
    most = 0.026 + 0.20 * (step - 0.5) + 0.08 * (lean - 0.1)
    share = min(max(most, 0.022) / (low + bob), 1.0)
    return share * low, max(share * bob, 0.0105) / style.bounce


def _still(stream: Stream) -> tuple[float, float]:
    """Every fourth walker keeps one arm rather still, as if it carried something."""
    side, share = stream.choice(SIDES), stream.uniform(0.5, 0.95)
    if stream.choice((True, False, False, False)):
        return (share, 0.0) if side == "left" else (0.0, share)
    return (0.0, 0.0)
