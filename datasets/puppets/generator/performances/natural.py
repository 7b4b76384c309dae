"""What recorded people have and a plain score lacks: limbs that straighten, feet that are never quite
still, and quick small movements of the hands. Part of the score, so every body does the same.

Sizes are set beside CMU's and LAFAN1's recordings (``benchmarks/puppets_realism.py``).
"""

from dataclasses import replace

import numpy as np

from ..conventions import FPS, seconds
from ..curves import wander
from ..randomness import Stream
from .score import DogScore, Hand, Score

_SLACK = 0.15
"""Of ``Score``: knees bend by 4 degrees at least and elbows by 3, instead of 10 and 8."""
_DRIFT, _MOST, _SLOWLY = 0.0025, 0.004, (0.2, 1.2)
"""Leg lengths and hertz of ``wander``, and what it is eased below in each direction: on a leg of 0.92 m
feet are 2 mm beside their places on average and 5 mm at most, on every body within half a per cent of its
height."""
_TREMOR = (6.5, 11.0)
"""Hertz, of quick movements of the hands."""
_STILL, _MOVING = 0.045, 0.15
"""Their speed: of a resting hand, arm lengths a second, and what its own speed adds, as a share: noise of
movements grows with them (Harris and Wolpert 1998)."""
_WINDOW = 9
"""Frames over which the hand's own speed is averaged."""


def natural(score: Score, stream: Stream) -> Score:
    """The same performance as people do it; dogs' paws drift, and no more.

    Feet on stairs, which may have no room to spare, keep their places.
    """
    t = seconds(score.frames)

    def drift(name: str) -> np.ndarray:
        part = stream.part("drift", name)
        wandering = np.stack([wander(part, t, _DRIFT, *_SLOWLY) for _ in "xz"], axis=-1)
        return _MOST * np.tanh(wandering / _MOST)

    if isinstance(score, DogScore):
        return replace(
            score, paws={limb: replace(paw, drift=drift(limb)) for limb, paw in score.paws.items()}
        )
    feet = score.feet
    if score.stairs is None:
        feet = {side: replace(foot, drift=drift(side)) for side, foot in feet.items()}
    return replace(
        score,
        slack=_SLACK,
        feet=feet,
        hands={side: _trembling(hand, stream.part("hand", side)) for side, hand in score.hands.items()},
    )


def _trembling(hand: Hand, stream: Stream) -> Hand:
    """The hand with quick small movements, while it goes free."""
    frames = len(hand.reach)
    own = FPS * np.linalg.norm(np.gradient(hand.reach, axis=0), axis=-1)
    window = np.hanning(_WINDOW + 2)[1:-1]
    own = np.convolve(own, window, mode="same") / np.convolve(np.ones(frames), window, mode="same")
    # the root mean square of ``wander`` is 0.7 of its size, in each direction
    size = (_STILL + _MOVING * own) / (2.0 * np.pi * np.mean(_TREMOR) * np.sqrt(1.5))
    quick = np.stack([wander(stream, seconds(frames), 1.0, *_TREMOR) for _ in range(3)], axis=-1)
    return replace(hand, reach=hand.reach + size[:, None] * quick)
