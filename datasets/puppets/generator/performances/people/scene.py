"""Performances on the spot: a stance, its steps and shifts of weight, and a builder of Scores."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from ...conventions import FPS, SIDES
from ...curves import plateau, ramp, through
from ...randomness import Stream
from ..score import EVER, Air, Foot, FootContact, Hand, HandContact, Score, Trunk
from .arms import Move, Shape, Triple, moving
from .style import Performer, Style, along


@dataclass(frozen=True, eq=False)
class Stance:
    """Feet on the spot. heading: ``(frames,)``. support: ``(frames,)`` share of the weight on the left."""

    heading: np.ndarray
    feet: Mapping[str, Foot]
    support: np.ndarray

    @property
    def tip(self) -> np.ndarray:
        """``(frames,)`` -1 to 1: how far the weight is on the left rather than on the right."""
        return 2.0 * self.support - 1.0

    def score(
        self,
        kind: str,
        height: np.ndarray,
        trunk: Trunk,
        hands: Mapping[str, Hand],
    ) -> Score:
        """A performance on these feet, in balance."""
        nowhere = np.zeros((len(height), 2))
        return Score(
            kind=kind,
            heading=self.heading,
            path=nowhere,
            sway=nowhere,
            height=height,
            balance=np.ones(len(height)),
            support=self.support,
            trunk=trunk,
            feet=self.feet,
            hands=hands,
        )

    def moved(self, side: str, foot: Foot) -> Stance:
        """A stance with another course of one foot."""
        return replace(self, feet={**self.feet, side: foot})

    def stepped(
        self, side: str, landing: FootContact, lift: int, off: int, off_pitch: float, lift_height: float
    ) -> Stance:
        """A stance in which one foot leaves its last place for another one."""
        foot = self.feet[side]
        leaving = replace(
            foot.contacts[-1], lift=lift, off=off, off_pitch=off_pitch, lift_height=lift_height
        )
        return self.moved(side, replace(foot, contacts=(*foot.contacts[:-1], leaving, landing)))

    def relieved(self, side: str, start: int, end: int, share: float) -> Stance:
        """A stance with so much of the weight taken off a foot while it is not flat."""
        t = np.arange(len(self.support), dtype=float)
        away = share * plateau(t, start - 16.0, start + 1.0, end - 3.0, end + 14.0)
        other = 0.0 if side == "left" else 1.0
        return replace(self, support=self.support + away * (other - self.support))


def stance(heading: float, style: Style, frames: int, support: np.ndarray, width: float) -> Stance:
    """Both feet side by side for the whole clip. width: half hip widths."""
    contact = FootContact(
        (0.0, 0.0), width, heading, style.toe_out, strike=-EVER, flat=-EVER, lift=EVER, off=EVER
    )
    feet = {side: Foot((contact,), np.zeros(frames)) for side in SIDES}
    return Stance(np.full(frames, heading), feet, support)


def shifting(stream: Stream, frames: int, size: float) -> np.ndarray:
    """Weight that goes from one foot to the other every second or two; ``size`` up to 0.5."""
    times, values = [-40.0], [0.5]
    direction = stream.sign()
    while times[-1] < frames + 60:
        times.append(times[-1] + stream.uniform(24.0, 60.0))
        values.append(0.5 + direction * size * stream.uniform(0.4, 1.0))
        direction = -direction
    return through(np.arange(frames, dtype=float), times, values)


def lift_heel(feet: Stance, side: str, start: int, end: int, angle: float) -> Stance:
    """The heel of the foot that bears little weight rises and comes down; its toe stays planted."""
    t = np.arange(len(feet.support), dtype=float)
    rise = min(12.0, 0.4 * (end - start))
    foot = feet.feet[side]
    heel = foot.heel + angle * plateau(t, start, start + rise, end - rise, end)
    return feet.moved(side, replace(foot, heel=heel)).relieved(side, start, end, 0.6)


STEP = 18
"""Frames from lifting a heel to the sole's being flat again, in a small step."""


def small_step(
    feet: Stance,
    side: str,
    start: int,
    ahead: float = 0.0,
    wider: float = 0.0,
    turned: float = 0.0,
    lasting: int = STEP,
) -> Stance:
    """One foot is lifted, toe last, and set down elsewhere, toe first, while the other bears the weight.

    ahead: leg lengths. wider: half hip widths outward. turned: radians, of the foot and of its place
    around the body. lasting: frames from lifting the heel to the sole's being flat again.
    """
    last = feet.feet[side].contacts[-1]
    flat = start + lasting
    # a foot that goes back is not pushed off
    pitch = (0.45 if ahead >= 0.0 else 0.15) * STEP / lasting
    heading = last.heading + turned
    x, z = along(heading, ahead)
    landing = replace(
        last,
        place=(last.place[0] + x, last.place[1] + z),
        width=last.width + wider,
        heading=heading,
        strike=flat - 4,
        flat=flat,
        strike_pitch=0.20,
    )
    return feet.stepped(side, landing, start, start + 5, pitch, 0.06).relieved(side, start, flat, 0.95)


def step_to(
    feet: Stance, side: str, start: int, place: tuple[float, float], heading: float, lasting: int
) -> Stance:
    """One foot goes within so many frames to its place beside a middle (leg lengths), toe first, as in a
    dance. The weight is left to the caller."""
    flat = start + lasting - 1
    landing = replace(
        feet.feet[side].contacts[-1],
        place=place,
        heading=heading,
        strike=flat - 3,
        flat=flat,
        strike_pitch=0.16,
    )
    return feet.stepped(side, landing, start, start + max(round(0.28 * lasting), 3), 0.40, 0.05)


def turn(feet: Stance, start: int, angle: float) -> Stance:
    """Two small steps turn the body on the spot; the foot on the inside goes first."""
    first, second = SIDES if angle > 0.0 else SIDES[::-1]
    feet = small_step(feet, first, start, turned=angle)
    feet = small_step(feet, second, start + STEP + 3, turned=angle)
    t = np.arange(len(feet.support), dtype=float)
    return replace(feet, heading=feet.heading + angle * ramp(t, start - 2.0, start + 2.0 * STEP))


_NONE = (0.0, 0.0, 0.0)


class Scene(Performer):
    """A performance on the spot in the making; all times are in frames.

    Begins and ends standing on both soles with the arms at ease, so that it may follow anything. How soft
    the knees are, how far off the body the arms hang and how upright the trunk is belongs to the moment,
    not to the person.
    """

    def __init__(
        self, stream: Stream, frames: int, width: float = 1.2, shift: float = 0.3, loose: float = 1.0
    ) -> None:
        """width: of the stance, half hip widths, times the style's. shift: how far weight wanders.
        loose: how far knees and trunk are what they happen to be at the moment."""
        super().__init__(stream, frames)
        self.k = np.arange(frames, dtype=float)
        self.heading = stream.uniform(-np.pi, np.pi)
        support = shifting(stream, frames, shift)
        self.feet = stance(self.heading, self.style, frames, support, width * self.style.stance)
        # most knees are nearly straight, some quite soft
        self.soft = loose * (0.065 * stream.uniform(0.0, 1.0) ** 2.2 - 0.008)
        self.upright = loose * stream.normal(0.075)
        aside = self.style.aside + 0.42 * stream.uniform(0.0, 1.0) ** 1.5
        self.style = replace(self.style, aside=aside)
        self.moves: dict[str, list[Move]] = {side: [] for side in SIDES}
        self.contacts: dict[str, list[HandContact]] = {side: [] for side in SIDES}
        self.pelvis, self.chest, self.gaze = (np.zeros((frames, 3)) for _ in range(3))
        self.low, self.ahead = np.zeros(frames), np.zeros(frames)

    # ------------------------------------------------------------------------------------- telling
    def bend(
        self, share: np.ndarray, pelvis: Triple = _NONE, chest: Triple = _NONE, gaze: Triple = _NONE
    ) -> None:
        """Add angles (turn left, lean forward, lean left) in proportion to ``share``."""
        for angles, added in ((self.pelvis, pelvis), (self.chest, chest), (self.gaze, gaze)):
            angles += share[:, None] * np.array(added)

    def lean(self, share: np.ndarray, pelvis: float = 0.0, chest: float = 0.0, gaze: float = 0.0) -> None:
        """Add angles forward in proportion to ``share``."""
        self.bend(share, (0.0, pelvis, 0.0), (0.0, chest, 0.0), (0.0, gaze, 0.0))

    def held(self, start: float, top: float, fall: float, end: float) -> np.ndarray:
        """``(frames,)`` up between the first two frames, down between the last two."""
        return plateau(self.k, start, top, fall, end)

    def weight(self, share: np.ndarray, on_left: float | np.ndarray) -> None:
        """Shift the weight to a share of the left foot, as far as ``share``."""
        self.feet = replace(self.feet, support=self.feet.support + share * (on_left - self.feet.support))

    def arm(
        self, side: str, start: float, end: float, to: Shape | None = None, arc: Triple = _NONE
    ) -> None:
        self.moves[side].append(Move(start, end, to, arc))

    def hold(
        self,
        side: str,
        to: Shape,
        start: float,
        end: float,
        up: float,
        arc: Triple = _NONE,
        back: Triple = _NONE,
    ) -> None:
        """An arm goes to a shape and at last back to hanging at ease, ``up`` frames each."""
        self.arm(side, start, start + up, to, arc)
        self.arm(side, end - up, end, None, back)

    def touch(self, side: str, to: Shape, start: float, end: float, up: float) -> None:
        """A hand goes before a place, then onto it, and leaves the same way; ``up`` frames each."""
        before = replace(to, touch="")
        self.arm(side, start, start + 0.7 * up, before, (0.10, 0.0, 0.10))
        self.arm(side, start + 0.3 * up, start + up, to)
        self.arm(side, end - up, end - 0.3 * up, before)
        self.arm(side, end - 0.7 * up, end, None, (0.10, 0.0, 0.10))

    def step(
        self, side: str, start: float, ahead: float = 0.0, wider: float = 0.0, lasting: int = STEP
    ) -> None:
        self.feet = small_step(self.feet, side, round(start), ahead, wider, lasting=lasting)

    def air(self, side: str, air: Air) -> None:
        """A foot's way through the air, after those it already has."""
        foot = self.feet.feet[side]
        if foot.air is not None:
            active = air.weight > 0.0
            names = ("weight", "swivel", "point")
            channels = (np.where(active, getattr(air, name), getattr(foot.air, name)) for name in names)
            air = Air(np.where(active[:, None], air.reach, foot.air.reach), *channels)
        self.feet = self.feet.moved(side, replace(foot, air=air))

    def fidget(self) -> None:
        """Now and then a heel lifts, or a foot is set elsewhere, or the body turns a little."""
        stream, latest = self.stream, self.frames - 62
        what = stream.choice(("turn", "step", "heel", "nothing"))
        start, side = round(stream.uniform(14.0, max(latest, 15.0))), stream.choice(SIDES)
        if latest < 15:
            return
        if what == "turn":
            self.feet = turn(self.feet, start, stream.sign() * stream.uniform(0.2, 0.5))
        elif what == "step":
            self.step(side, start, stream.uniform(-0.12, 0.15), stream.uniform(-0.2, 0.4))
        elif what == "heel":
            length = round(stream.uniform(24.0, 45.0))
            self.feet = lift_heel(self.feet, side, start, start + length, stream.uniform(0.2, 0.45))

    # ------------------------------------------------------------------------------------- telling all
    def score(self, kind: str) -> Score:
        """The performance. The hip drops over the idle leg, the chest evens that out, as anyone's does."""
        feet = self.feet
        self.bend(feet.tip, pelvis=(0.05, 0.0, -0.07), chest=(-0.03, 0.0, 0.09))
        leans, sinks = self.pelvis[:, 1] + self.chest[:, 1], self.low / 0.1
        soft = self.soft / (1.0 + sinks * sinks)
        self.lean(1.0 / (1.0 + (leans / 0.3) ** 2), 0.3 * self.upright, 0.7 * self.upright)
        hands = {
            side: replace(moving(self, self.moves[side]), contacts=tuple(self.contacts[side]))
            for side in SIDES
        }
        height = 0.990 - soft - 0.012 * np.abs(feet.tip) - self.low
        trunk = self.trunk(self.pelvis.T, self.chest.T, self.gaze.T, follow=0.1)
        return feet.score(kind, height, trunk, hands)


def slots(
    stream: Stream, frames: int, shortest: float, longest: float, calm: float = 0.0
) -> list[tuple[float, float]]:
    """Stretches (start, end), whole frames, in which things happen one after the other: as many as fit when
    each takes between so many seconds, at least one; the clip's first and last five frames stay free.

    calm: up to how many times as long as something takes nothing happens besides, where there is time."""
    length = FPS * stream.uniform(shortest, longest)
    rest = length * stream.uniform(0.4 * calm, calm)
    room = frames - 11.0
    count = max(1, int(room / (length + rest)))
    share = room / count
    # of each share so much is filled: all of it where there is no time to spare
    filled = 1.0 if calm == 0.0 else min(1.0, 1.1 * length / share)
    stretches = []
    for number in range(count):
        first = stream.uniform(0.0, 1.0) * (1.0 - filled)
        start = 5.0 + share * (number + first + stream.uniform(0.0, 0.08) * filled)
        end = 5.0 + share * (number + first + stream.uniform(0.92, 1.0) * filled)
        stretches.append((float(round(start)), float(round(end))))
    return stretches
