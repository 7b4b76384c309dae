"""Walk, trot and gallop: periods of four paws, along any path, by a dog with its own habits.

The order of footfalls is that of the textbooks (Hildebrand 1989); periods, strides, speeds, and how long
and how far paws roll were tuned to recorded dogs.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...conventions import FPS, along, seconds
from ...curves import plateau, wander
from ...randomness import Stream
from ..score import EVER, LIMBS, DogScore, Paw, PawContact, Trunk


@dataclass(frozen=True)
class Habit:
    """bounce, lift, roll: of trunk, paws and soles, 1 is usual. loose: size of involuntary movement.
    stance: half widths. neck: carried lower by, radians. tail: carried higher by. wag: radians, and how
    often a second. fore: how much higher the shoulders are carried, shares of standing."""

    bounce: float
    lift: float
    roll: float
    loose: float
    stance: float
    neck: float
    tail: float
    wag: float
    wags: float
    fore: float

    @classmethod
    def draw(cls, stream: Stream) -> Habit:
        """A dog's habits: each time the same for one dog's stream."""
        if stream.person:
            stream = Stream(stream.person)
        return cls(
            bounce=stream.uniform(0.7, 1.3),
            lift=stream.uniform(0.8, 1.25),
            roll=stream.uniform(0.85, 1.15),
            loose=stream.uniform(0.6, 1.4),
            stance=stream.uniform(0.70, 0.95),
            neck=stream.uniform(-0.15, 0.15),
            tail=stream.uniform(-0.2, 0.9),
            wag=stream.uniform(0.05, 0.45),
            wags=stream.uniform(1.2, 2.8),
            fore=stream.uniform(-0.05, 0.02),
        )


def head_and_tail(
    stream: Stream, frames: int, habit: Habit, phase: np.ndarray | None = None
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """neck ``(frames,)``, gaze ``(frames, 3)`` and tail ``(frames, 4)``; the tail wags with the gait."""
    t = seconds(frames)
    turns = habit.wags * t + stream.uniform(0.0, 1.0) if phase is None else phase
    wag = habit.wag * np.sin(2.0 * np.pi * turns)
    lagged = habit.wag * np.sin(2.0 * np.pi * (turns - 0.15))
    raised = habit.tail + wander(stream, t, 0.06 * habit.loose)
    neck = habit.neck + wander(stream, t, 0.05 * habit.loose)
    glances = [wander(stream, t, size * habit.loose, 0.1, 0.6) for size in (0.16, 0.06, 0.05)]
    gaze = np.stack(glances, axis=-1)
    gaze[:, 1] += 0.3 * neck
    tail = np.stack([raised, wag, 1.15 * raised, wag + 0.6 * lagged], axis=-1)
    return neck, gaze, tail


STANDING = 0.15
"""Leg lengths a second below which a dog stands rather than walks."""


@dataclass(frozen=True, eq=False)
class Way:
    """heading, speed: ``(frames,)``, leg lengths a second. path: ``(frames, 2)``, leg lengths. over: the
    frames between which it goes; beyond the clip at an end where it does not stand."""

    heading: np.ndarray
    path: np.ndarray
    speed: np.ndarray
    over: tuple[int, int]

    @property
    def turning(self) -> np.ndarray:
        """``(frames,)`` radians a second."""
        return np.gradient(self.heading) * FPS


def way(stream: Stream, frames: int, speed: float, most: float, there: bool = False) -> Way:
    """A way with at most ``most`` radians a second of turning. there: from standing to standing."""
    t = seconds(frames)
    facing, turning = stream.uniform(-np.pi, np.pi), stream.uniform(-most, most)
    rate, start = stream.uniform(0.12, 0.30), stream.uniform(0.0, 1.0)
    shape = stream.choice(("straight", "arc", "bends"))
    turn = {
        "straight": np.zeros(frames),
        "arc": np.full(frames, turning),
        "bends": turning * np.sin(2.0 * np.pi * (rate * t + start)),
    }[shape]
    moving, over = np.ones(frames), (-frames, 2 * frames)
    if there:
        begin = round(stream.uniform(0.03, 0.08) * frames)
        end = frames - round(stream.uniform(0.03, 0.08) * frames)
        soft = min(stream.uniform(20.0, 28.0), 0.4 * (end - begin))
        moving = plateau(FPS * t, begin, begin + soft, end - soft, end)
        over = (begin, end)
    pace = speed * moving * (1.0 + wander(stream, t, 0.03, 0.1, 0.4))
    heading = facing + summed(turn * moving)
    return Way(heading, summed(pace[:, None] * along(heading)), pace, over)


def summed(rate: np.ndarray) -> np.ndarray:
    """The integral of a rate a second, ``(frames, ...)``: 0 in the first frame."""
    steps = np.cumsum(0.5 * (rate[1:] + rate[:-1]), axis=0) / FPS
    return np.concatenate([np.zeros_like(rate[:1]), steps])


_BEYOND = 120
"""Frames before and after the clip that paws depend on."""
Span = tuple[float, float]


@dataclass(frozen=True)
class Gait:
    """kind: of its performances. phases: of the first touch of each paw (``LIMBS``), shares of the period.
    Of the slowest and the fastest: speed, leg lengths a second; stride, leg lengths; duty, share of the
    period that a paw is down; lift of the paws, leg lengths; bounce of the trunk, shares of the standing
    height. beats: how often in a period it bounces. skew: above 1 most go slowly. rest, off: radians that
    hind and fore paws are rolled forward over their tips where they rest and when they leave. low: how much
    lower rump and shoulders are carried. neck: how much lower it is carried, radians. turning: at most,
    radians a second. there: out of these is drawn whether it is from standing to standing."""

    kind: str
    phases: tuple[float, float, float, float]
    speed: Span
    stride: Span
    duty: Span
    lift: Span
    bounce: Span
    beats: int
    skew: float
    rest: Span
    off: Span
    low: Span
    neck: float
    turning: float
    there: tuple[bool, ...]

    def at(self, pair: Span, speed: np.ndarray) -> np.ndarray:
        """A pair of values interpolated at a speed; slower than the slowest counts as the slowest."""
        share = np.maximum(speed - self.speed[0], 0.0) / (self.speed[1] - self.speed[0])
        return np.asarray(pair[0] + share * (pair[1] - pair[0]))

    def draw(self, stream: Stream) -> float:
        """A speed."""
        return self.speed[0] + (self.speed[1] - self.speed[0]) * stream.uniform(0.0, 1.0) ** self.skew


# four beats, each hind paw followed by the fore paw of its side
WALK = Gait(
    kind="dog_walk",
    phases=(0.0, 0.5, 0.22, 0.72),
    speed=(0.55, 2.0),
    stride=(0.64, 1.40),
    duty=(0.66, 0.56),
    lift=(0.18, 0.20),
    bounce=(0.022, 0.034),
    beats=2,
    skew=1.5,
    rest=(-0.27, -0.15),
    off=(0.38, 0.50),
    low=(0.035, 0.05),
    neck=0.25,
    turning=0.45,
    there=(True, False, False),
)
# two beats of diagonal pairs
TROT = Gait(
    kind="trot",
    phases=(0.0, 0.5, 0.52, 0.02),
    speed=(2.35, 4.7),
    stride=(1.70, 2.35),
    duty=(0.50, 0.38),
    lift=(0.13, 0.20),
    bounce=(0.022, 0.055),
    beats=2,
    skew=2.0,
    rest=(-0.27, -0.18),
    off=(0.40, 0.60),
    low=(0.03, 0.055),
    neck=0.10,
    turning=0.25,
    there=(True, False, False, False),
)
# hind paws, fore paws, flight; the back folds and stretches
GALLOP = Gait(
    kind="gallop",
    phases=(0.0, 0.13, 0.46, 0.60),
    speed=(3.8, 6.8),
    stride=(1.98, 2.92),
    duty=(0.36, 0.28),
    lift=(0.22, 0.36),
    bounce=(0.055, 0.080),
    beats=1,
    skew=2.0,
    rest=(-0.27, -0.18),
    off=(0.40, 0.75),
    low=(0.03, 0.06),
    neck=0.45,
    turning=0.15,
    there=(False,),
)


@dataclass(frozen=True, eq=False)
class Rhythm:
    """phase: ``(frames,)`` periods passed. times, turns: frames from well before the clip to well after it,
    and the periods passed in them."""

    phase: np.ndarray
    times: np.ndarray
    turns: np.ndarray

    def frame(self, phase: float) -> float:
        return float(np.interp(phase, self.turns, self.times))


def rhythm(gait: Gait, route: Way, start: float) -> Rhythm:
    """As many periods a second as the speed needs, and no fewer than of the slowest. start: phase of the
    first frame, 0 to 1. Who stands there starts with a hind paw, the right one if it is above a half."""
    speed = route.speed
    rate = np.maximum(speed, gait.speed[0]) / gait.at(gait.stride, speed)
    travelled = summed(rate)
    if route.over[0] > 0:
        start = 0.5 * round(start) + gait.duty[0] - 0.03 - float(travelled[route.over[0]])
    phase = start + travelled
    steps = np.arange(1, _BEYOND + 1)
    before, after = phase[0] - rate[0] / FPS * steps[::-1], phase[-1] + rate[-1] / FPS * steps
    times = np.arange(-_BEYOND, len(phase) + _BEYOND, dtype=float)
    return Rhythm(phase, times, np.concatenate([before, phase, after]))


def paced(stream: Stream, gait: Gait, route: Way, habit: Habit) -> DogScore:
    """A gait along a way."""
    frames, speed = len(route.heading), route.speed
    t, still = seconds(frames), np.zeros(frames)
    rate = rhythm(gait, route, stream.uniform(0.0, 1.0))
    paws = _paws(stream.part("paws"), gait, rate, route, habit)
    # what goes with the gait fades where it comes to a stand
    alive = np.clip(speed / (0.6 * gait.speed[0]), 0.0, 1.0)
    alive = alive * alive * (3.0 - 2.0 * alive)
    height, fore, arch = _heaving(gait, rate.phase, alive * habit.bounce * gait.at(gait.bounce, speed))
    shock = 0.007 * habit.loose * alive * (1.0 + 0.3 * speed)
    shaken = [shock * wander(stream, t, 1.0, 2.2, 6.0) for _ in range(4)]
    bowed = wander(stream, t, 0.03 * habit.loose, 0.1, 0.5)
    turn = 2.0 * np.pi * (rate.phase - 0.25 * float(np.mean(gait.duty)))
    sway = 0.02 * habit.loose * alive * np.sin(turn)
    bend = np.clip(0.16 * route.turning, -0.45, 0.45)
    walking = alive * (gait.beats == 2)
    pelvis = np.stack(
        [0.06 * habit.loose * walking * np.sin(turn), still, 0.05 * habit.loose * walking * np.cos(turn)],
        axis=-1,
    )
    weave = 0.05 * walking * np.sin(2.0 * np.pi * (rate.phase - 0.1))
    small = [wander(stream, t, 0.02, 0.3, 1.6) for _ in range(2)]
    chest = np.stack([bend + weave, alive * arch + small[0], small[1]], axis=-1)
    neck, gaze, tail = head_and_tail(stream, frames, habit, rate.phase)
    neck = neck + gait.neck + 0.05 * habit.bounce * alive * np.sin(turn * gait.beats)
    gaze[:, 0] += 0.6 * bend
    return DogScore(
        kind=gait.kind,
        heading=route.heading,
        path=route.path,
        sway=np.stack([sway + shaken[0], shaken[1]], axis=-1),
        height=height + shaken[2],
        balance=still,
        support=still + 0.5,
        trunk=Trunk(pelvis, chest, gaze),
        feet={},
        hands={},
        phase=rate.phase,
        fore=fore + shaken[3] + habit.fore + bowed,
        anchor=still + 0.5,
        neck=neck,
        tail=tail,
        spread=np.zeros((frames, 2)),
        paws=paws,
    )


def go(stream: Stream, frames: int, gait: Gait, there: Sequence[bool] = ()) -> DogScore:
    """A gait along a way of its own. there: in place of the gait's."""
    habit = Habit.draw(stream)
    route = way(stream, frames, gait.draw(stream), gait.turning, stream.choice(there or gait.there))
    return paced(stream, gait, route, habit)


def _heaving(
    gait: Gait, phase: np.ndarray, bounce: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Heights of rump and shoulders and the arch of the back, over the period."""
    turn, duty = 2.0 * np.pi, float(np.mean(gait.duty))
    if gait.beats == 2:
        # highest over the standing leg
        rump, shoulders = (
            1.0 - low + bounce * np.cos(2.0 * turn * (phase - first - 0.5 * duty))
            for first, low in zip((gait.phases[0], gait.phases[2]), gait.low, strict=True)
        )
        return rump, shoulders, 0.02 * np.sin(turn * phase)
    # galloping: hind paws push, the body flies with paws gathered, the shoulders land; the back folds and
    # stretches once a period
    hind = phase - gait.phases[0] - 0.5 * (duty + 0.13)
    front = phase - gait.phases[2] - 0.5 * (duty + 0.14)
    arch = 0.15 + 0.26 * np.cos(turn * (phase - 0.96))
    rump, shoulders = (
        1.0 - low - bounce * np.cos(turn * each) for each, low in zip((hind, front), gait.low, strict=True)
    )
    return rump, shoulders, arch


# ---------------------------------------------------------------------------------------------- paws
def _paws(stream: Stream, gait: Gait, rate: Rhythm, route: Way, habit: Habit) -> Mapping[str, Paw]:
    """Contacts from well before the clip to well after it, no two quite alike."""
    frames, paws = len(route.heading), {}
    first, last = int(np.ceil(rate.turns[0])), int(np.floor(rate.turns[-1])) - 1
    duties, lifts = gait.at(gait.duty, route.speed), gait.at(gait.lift, route.speed)
    for limb, phase in zip(LIMBS, gait.phases, strict=True):
        contacts, hind = [], "hind" in limb
        for number in range(first, last):
            strike = rate.frame(number + phase)
            now = min(max(round(strike), 0), frames - 1)
            off = round(rate.frame(number + phase + float(duties[now])))
            lift = float(lifts[now]) * habit.lift * (0.85 if hind else 1.0) * stream.uniform(0.85, 1.15)
            contacts.append(_stay(stream, gait, habit, hind, (round(strike), off), lift))
        paws[limb] = Paw(tuple(_standing(contacts, route.over, frames)), np.zeros(frames))
    return paws


def _stay(
    stream: Stream, gait: Gait, habit: Habit, hind: bool, over: tuple[int, int], lift: float
) -> PawContact:
    """One stay: it comes to rest soon and then rolls for half of its time."""
    strike, off = over
    rest, rolled = (pair[0 if hind else 1] for pair in (gait.rest, gait.off))
    return PawContact(
        moment=0.5 * (strike + off),
        out=habit.stance + stream.normal(0.06 * habit.loose),
        ahead=stream.normal(0.022 * habit.loose),
        strike=strike,
        flat=strike + max(1, round(0.14 * (off - strike))),
        lift=off - max(2, round(0.52 * (off - strike))),
        off=off,
        strike_pitch=rest - 0.10,
        rest=rest,
        off_pitch=rolled * habit.roll,
        lift_height=lift,
        curl=0.10 if hind else 0.60,
    )


def _standing(contacts: list[PawContact], over: tuple[int, int], frames: int) -> list[PawContact]:
    """Where the way begins or ends inside the clip, the paw stands before its first and after its last
    swing."""
    if over[0] > 0:
        contacts = [contact for contact in contacts if contact.off >= over[0]]
        stood = replace(contacts[0], moment=0.0, ahead=0.0, strike=-EVER, flat=-EVER, rest=0.0)
        contacts[0] = replace(stood, lift=stood.off - 5)
    if over[1] < frames:
        swings = sum(contact.off < over[1] - 5 for contact in contacts)
        last = replace(contacts[swings], moment=frames - 1.0, ahead=0.0, lift=EVER, off=EVER)
        contacts = [*contacts[:swings], replace(last, strike_pitch=-0.1, rest=0.0)]
    return contacts
