"""A personal way of moving, and the small movements that nobody suppresses."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..curves import wander
from ..randomness import Stream
from ..score import FPS, Hand, Touch, Trunk


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
