"""How a body is carried over its steps: posture, bounce, arms. Ordinary walkers are the most; some stoop,
lean back, bounce, hold their arms out or up, or keep one of them still."""

from __future__ import annotations

from dataclasses import dataclass

from ..randomness import Stream
from ..score import SIDES
from .style import Style

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
    """Of somebody who walks by steps of so many leg lengths."""
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
