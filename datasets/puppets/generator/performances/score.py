"""Scores: performances in terms that fit every body, on two legs and on four.

Lengths on the floor and the pelvis' height are in leg lengths, stance width in half hip widths, hands in
arm lengths from the shoulder or attached to a point of the performer's own body, angles in radians, time
in frames. ``solver/scaling.py`` says what they become on a given body.

Sides are written outward: a positive ``out`` is to the left for the left hand and to the right for the
right one, so that one sentence describes both.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Self

import numpy as np

from ..conventions import SIDES

EVER = 10_000
"""A frame after every clip's end."""


@dataclass(frozen=True)
class FootContact:
    """One stay of a foot on the floor.

    place:   (x, z) of the body's line of travel beside the foot, leg lengths.
    width:   how far outward of that line the foot stands, half hip widths.
    heading: of the body at this step; ``toe_out`` turns the foot outward of it.
    strike, flat, lift, off: frames of first touch, of the sole coming flat, of the last flat frame, of
             the last frame on the toe. Whole numbers, so that labels are exact; may lie outside the clip.
    strike_pitch: of the sole at first touch: below 0 the heel lands, from 0 on the toe.
    off_pitch: how far the heel has risen when the toe leaves.
    lift_height: clearance of the swing that follows, leg lengths.
    level: height of the floor there over the floor's zero, leg lengths.
    riser: on stairs, how far before ``place`` the next riser stands, or (below 0) behind it the last one;
           0: none is near. The foot stands as near to ``place`` as it fits.
    hurry: of the swing that follows: 0 gains speed up to its middle, 1 within its first fifth.
    """

    place: tuple[float, float]
    width: float
    heading: float
    toe_out: float
    strike: int
    flat: int
    lift: int
    off: int
    strike_pitch: float = -0.3
    off_pitch: float = 0.9
    lift_height: float = 0.05
    level: float = 0.0
    hurry: float = 0.0
    riser: float = 0.0

    def later(self, frames: int) -> Self:
        """The same stay so many frames later."""
        times = {name: getattr(self, name) + frames for name in ("strike", "flat", "lift", "off")}
        return replace(self, **times)


@dataclass(frozen=True, eq=False)
class Air:
    """A foot on a way of its own between two contacts, as in a kick.

    reach:  ``(frames, 3)`` (out, up, forward) from the hip joint to the ankle, leg lengths; the axes stay
            upright and turn with the pelvis.
    weight: ``(frames,)`` 1 where the foot goes there; exactly 0 from a touch of the floor to the last one.
    swivel: ``(frames,)`` turns the knee outward about the line from hip to ankle.
    point:  ``(frames,)`` how far the toes point away from the shin's square, radians.
    """

    reach: np.ndarray
    weight: np.ndarray
    swivel: np.ndarray
    point: np.ndarray


@dataclass(frozen=True, eq=False)
class Foot:
    """contacts: in time order, the first striking before frame 0. heel: ``(frames,)`` how far the heel is
    raised about the toe while the foot stays planted; exactly 0 elsewhere. air: a way through the air.
    kneel: ``(frames,)`` 1: the knee rests on the floor before the toes, which stay where the contacts are.
    bears: ``(frames,)`` below 1 where a kneeling knee is on its way and bears nothing.
    drift: ``(frames, 2)`` (x, z) by which the foot is beside its contacts, leg lengths: slow and small."""

    contacts: tuple[FootContact, ...]
    heel: np.ndarray
    air: Air | None = None
    kneel: np.ndarray | None = None
    bears: np.ndarray | None = None
    drift: np.ndarray | None = None


@dataclass(frozen=True, eq=False)
class Touch:
    """A hand on a point of the performer's body (``touch_points.py``): in full where ``weight`` is 1."""

    place: str
    weight: np.ndarray


@dataclass(frozen=True)
class HandContact:
    """One stay of a hand on the floor, or on something that rests there.

    place:   (x, z) of the body's line of travel beside the hand, leg lengths; ``ahead`` of it along the
             heading, arm lengths; ``under``: 1 adds how far the shoulders are before the toes on all fours.
    width:   how far outward of that line, half shoulder widths; ``apart``: arm lengths more.
    heading: of the body; ``turned`` turns the fingers outward of it.
    strike, off: frames of the first and of the last touch. coming, leaving: frames in which the hand comes
             from where it was before, and in which it is let go; leaving 0: straight to its next contact.
    tilt:    how far the wrist is raised over the finger tips, radians.
    lift:    height of the hand's way here over the straight one, leg lengths.
    level:   over the floor, leg lengths; above 0 the hand holds something between both palms there.
    crouch:  whether the hips go lower for a hand that does not reach.
    """

    place: tuple[float, float]
    heading: float
    strike: int
    off: int
    coming: int
    leaving: int
    ahead: float = 0.0
    under: float = 0.0
    width: float = 1.0
    apart: float = 0.0
    turned: float = 0.0
    tilt: float = 0.35
    lift: float = 0.0
    level: float = 0.0
    crouch: bool = False

    def later(self, frames: int) -> Self:
        """The same stay so many frames later."""
        return replace(self, strike=self.strike + frames, off=self.off + frames)


@dataclass(frozen=True, eq=False)
class Hand:
    """The course of a hand.

    reach:   ``(frames, 3)`` (out, up, forward) from the shoulder to the wrist, arm lengths.
    upright: ``(frames,)`` 0: the axes lean with the chest; 1: they stay upright and only turn with it.
    middle:  ``(frames,)`` 0: measured from the own shoulder; 1: from the point between both shoulders.
    swivel:  ``(frames,)`` turns the elbow outward and up about the line from shoulder to wrist.
    wrist:   ``(frames, 3)`` bend towards the palm, bend towards the thumb, palm turned up (supination).
    aim:     ``(frames, 6)`` where palm and fingers point (out, up, forward), in axes that stay upright and
             turn with the chest; followed in so far as ``aimed`` ``(frames,)`` is 1.
    contacts:  stays on the floor, in time order.
    """

    reach: np.ndarray
    upright: np.ndarray
    middle: np.ndarray
    swivel: np.ndarray
    wrist: np.ndarray
    touches: tuple[Touch, ...] = ()
    aim: np.ndarray | None = None
    aimed: np.ndarray | float = 0.0
    contacts: tuple[HandContact, ...] = ()


@dataclass(frozen=True, eq=False)
class Trunk:
    """Angles ``(frames, 3)`` as (turn to the left, lean forward, lean to the left), radians.

    pelvis: against the heading. chest: against the pelvis, shared by the spine.
    gaze:   of the head against the heading; ``follow`` is the share of the chest's own turning that the
            head takes along (0: the gaze is held still).
    """

    pelvis: np.ndarray
    chest: np.ndarray
    gaze: np.ndarray
    follow: float | np.ndarray = 0.2


@dataclass(frozen=True)
class Act:
    """A stretch of a performance: what is done from frame ``first`` to before ``end``."""

    kind: str
    first: int
    end: int


@dataclass(frozen=True)
class Stairs:
    """Equal steps in a flat floor, which is ``level`` high before the first of them; in leg lengths.

    edge:   (x, z) of a point on the first riser. heading: of travel over it, a multiple of a right angle.
    tread, rise: length and height of a step; a negative rise goes down. count: how many risers.
    """

    edge: tuple[float, float]
    heading: float
    tread: float
    rise: float
    count: int
    level: float = 0.0


@dataclass(frozen=True, eq=False)
class Score:
    """A performance, with channels ``(frames, ...)`` at 30 frames per second.

    heading: of the body, 0 faces +Z, growing to the left.
    path:    ``(frames, 2)`` (x, z) of the line of travel, leg lengths; ``sway`` (left, forward) moves
             the pelvis off it, leg lengths.
    height:  of the hip joints over the floor, leg lengths (1: as in the T-pose). Lowered for bodies
             whose feet would not reach the floor.
    balance: 1: the centre of mass is brought over the feet, wherever ``path`` and ``sway`` put it;
             ``support`` says over which: share of the left foot.
    flights: (last frame with a foot down, first frame with one down again). Between the two the centre
             of mass is thrown: ``height`` is a parabola there.
    impacts: frames at which velocities may jump: landings, and feet that leave at speed.
    stairs:  in the floor, or None where it is flat.
    acts:    what is done when, in order and without gaps; empty where it is one kind throughout.
    phase:   ``(frames,)`` how far along: 0 to 1 within an act, or turns of a cycle; nothing: even progress.
    sit_back: ``(frames,)`` how far the thighs of kneeling legs lean back from upright, radians.
    prone:   ``(frames,)`` 1: the trunk is laid forward until straight arms reach the floor, on all fours.
    slack:   share of their usual least bend that legs and arms keep at full stretch.
    """

    kind: str
    heading: np.ndarray
    path: np.ndarray
    sway: np.ndarray
    height: np.ndarray
    balance: np.ndarray
    support: np.ndarray
    trunk: Trunk
    feet: Mapping[str, Foot]
    hands: Mapping[str, Hand]
    flights: tuple[tuple[int, int], ...] = ()
    impacts: tuple[int, ...] = ()
    stairs: Stairs | None = None
    acts: tuple[Act, ...] = ()
    phase: np.ndarray | None = None
    sit_back: np.ndarray | None = None
    prone: np.ndarray | None = None
    slack: float = 1.0

    @property
    def frames(self) -> int:
        return len(self.heading)

    def stretches(self) -> tuple[Act, ...]:
        """The acts in order, or the whole as one."""
        return self.acts or (Act(self.kind, 0, self.frames),)

    def phases(self) -> np.ndarray:
        """``(frames,)`` how far along its act each frame is."""
        if self.phase is not None:
            return self.phase
        parts = [np.arange(act.end - act.first) / max(act.end - act.first, 1) for act in self.stretches()]
        return np.concatenate(parts)


LIMBS = tuple(f"{side}_{end}" for end in ("hind", "fore") for side in SIDES)
"""In the order of ``dogs.PAWS``."""


@dataclass(frozen=True)
class PawContact:
    """One stay of a paw on the floor.

    moment: the frame whose place and heading of rump or shoulders it is measured from; may lie between
            frames and outside the clip.
    out, ahead: from where the paw of a standing body is: in half widths outward, in hind leg lengths.
    lain: 1 where the paw of a body that lies or sits is, 0 where that of a standing one is.
    strike, flat, lift, off: first frame down, first and last frame at rest, last frame down.
    strike_pitch, rest, off_pitch: how far it is rolled forward about its tip at first touch, at rest and at
            last touch, radians.
    lift_height: clearance of the swing that follows, hind leg lengths. curl: how far the paw hangs back
            in it, radians.
    """

    moment: float
    out: float
    ahead: float
    strike: int
    flat: int
    lift: int
    off: int
    strike_pitch: float = -0.2
    rest: float = 0.0
    off_pitch: float = 0.6
    lift_height: float = 0.12
    curl: float = 0.6
    lain: float = 0.0


@dataclass(frozen=True, eq=False)
class PawAir:
    """A fore paw held up. reach: ``(frames, 3)`` (out, up, forward) from the shoulder joint to the carpus,
    lengths of the fore leg. weight: ``(frames,)`` 1 where it goes there; 0 while it is down."""

    reach: np.ndarray
    weight: np.ndarray


@dataclass(frozen=True, eq=False)
class Paw:
    """contacts: in time order.

    flat: ``(frames,)`` 1 where the joint over the paw rests on the floor, too.
    drift: as of ``Foot``."""

    contacts: tuple[PawContact, ...]
    flat: np.ndarray
    air: PawAir | None = None
    drift: np.ndarray | None = None


@dataclass(frozen=True, eq=False)
class DogScore(Score):
    """A performance on four legs, at 30 frames per second.

    ``path`` is of the middle of the trunk in lengths of the hind leg (hip joint to floor, standing);
    ``height`` of the hip joints: 1 standing, 0 lying; ``trunk.pelvis`` rotates the rump alone,
    ``trunk.chest`` is the bend of the back (to the left, arched up, rolled to the left), ``trunk.gaze`` of
    the head against the heading of the fore body. There are no ``feet`` and no ``hands``.

    fore:   ``(frames,)`` height of the shoulder joints: 1 standing, 0 lying.
    anchor: ``(frames,)`` where the trunk is held while its length is shared: 0 the rump, 1 the shoulders.
    neck:   ``(frames,)`` how far the neck is lowered from where a standing dog carries it, radians.
    tail:   ``(frames, 4)`` raised and turned to the left, first and second bone, radians.
    spread: ``(frames, 2)`` how far knees and elbows are turned outward, radians.
    """

    fore: np.ndarray = field(default_factory=lambda: np.zeros(0))
    anchor: np.ndarray = field(default_factory=lambda: np.zeros(0))
    neck: np.ndarray = field(default_factory=lambda: np.zeros(0))
    tail: np.ndarray = field(default_factory=lambda: np.zeros((0, 4)))
    spread: np.ndarray = field(default_factory=lambda: np.zeros((0, 2)))
    paws: Mapping[str, Paw] = field(default_factory=dict)
