"""Sitting down, on an imagined seat or on the floor, and getting up.

Most people do not sit still: a foot is set elsewhere, the trunk leans back or forward for a while, the gaze
goes about. Before getting up the feet are back where they stood.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ...conventions import SIDES, other, sign
from ...curves import smooth
from ...randomness import Stream
from ..score import FootContact, HandContact, Score
from . import arms
from .arms import Shape
from .kneeling import kneel
from .scene import Scene, Stance
from .sequencing import cut
from .style import along, rows


@dataclass(frozen=True)
class _Seat:
    """on: the seat or the floor. first, down, up, last: frames: going down begins, lasts, getting up lasts,
    ends. low: how far the hips go down, far: back, leg lengths. tilt: of the trunk, radians forward.
    turned: of the pelvis to the left, radians. hands, legs: what they do."""

    on: str
    first: float
    down: float
    up: float
    last: float
    low: float
    far: float
    tilt: float
    turned: float
    hands: str
    legs: str

    @classmethod
    def draw(cls, stream: Stream, frames: int, on: str) -> _Seat:
        down, up = stream.uniform(36.0, 52.0), stream.uniform(34.0, 46.0)
        if on == "seat":
            low, far = stream.uniform(0.38, 0.54), stream.uniform(0.42, 0.50)
            hands = stream.choice(("knees", "lap", "beside", "crossed", "one knee", "knees"))
            legs = stream.choice(("side by side", "apart", "one ahead", "one back", "crossed"))
            tilt = stream.uniform(0.0, 0.30) if hands == "knees" else stream.uniform(-0.24, 0.14)
        else:
            down, up = 1.5 * down, 1.5 * up
            low, far = 0.90, stream.uniform(0.65, 0.71)
            hands = stream.choice(("behind", "one behind", "knees"))
            legs = stream.choice(("up", "one ahead", "aside", "crossed"))
            tilt = stream.uniform(-0.80, -0.70) if "behind" in hands else stream.uniform(-0.36, -0.22)
        turned = stream.uniform(-0.14, 0.14) + (0.16 * stream.sign() if legs == "aside" else 0.0)
        last = round(frames + down + up + 60.0) - 6.0
        return cls(on, 5.0, down, up, last, low, far, tilt, turned, hands, legs)

    @property
    def sat(self) -> tuple[float, float]:
        """Frames between which the performer sits."""
        return self.first + self.down, self.last - self.up


def sit(stream: Stream, frames: int, kind: str = "sit") -> Score:
    """Sitting down on a seat or on the floor, and a while there, legs and hands now so, now so; ``get_up``:
    up to standing from a seat, from the floor or from both knees."""
    rises = kind == "get_up"
    on = stream.choice(("seat", "floor", "knees") if rises else ("seat", "seat", "floor"))
    if on == "knees":
        return kneel(stream, frames, rises=True)
    # the whole of sitting down and getting up, of which the clip shows one part
    seat = _Seat.draw(stream, frames, on)
    length = round(seat.last) + 6
    scene = Scene(stream, length, width=stream.uniform(1.0, 1.6), shift=0.1, loose=0.3)
    first, down, up, last = seat.first, seat.down, seat.up, seat.last
    delay, soon = (0.10, 0.96) if on == "seat" else (0.30, 0.82)
    lowered = scene.held(first + delay * down, first + down, last - up, last - delay * up)
    behind = scene.held(first, first + soon * down, last - (soon + 0.02) * up, last - 0.05 * up)
    scene.low = seat.low * lowered
    _lean(scene, seat)
    _look_about(scene, seat)
    _legs(scene, seat)
    if on == "seat":
        _hands_on_a_seat(scene, seat)
    else:
        _hands_on_the_floor(scene, seat)
    score = scene.score(kind)
    back = -rows(length, np.sin(scene.feet.heading), np.cos(scene.feet.heading))
    path = seat.far * behind[:, None] * back
    score = replace(score, path=path, balance=1.0 - smooth((lowered - 0.35) / 0.6))
    return cut(score, length - frames if rises else 0, frames)


# ------------------------------------------------------------------------------------------- trunk
def _lean(scene: Scene, seat: _Seat) -> None:
    """Forward while the hips go back or come forward, upright or leaning when seated."""
    first, down, up, last = seat.first, seat.down, seat.up, seat.last
    deep = 0.50 if seat.on == "seat" else 0.02
    for share in (
        scene.held(first, first + 0.55 * down, first + 0.60 * down, first + 1.15 * down),
        scene.held(last - 1.2 * up, last - 0.72 * up, last - 0.66 * up, last),
    ):
        scene.lean(share, 0.55 * deep, 0.45 * deep, 0.15)
    begin_share, end_share = (0.6, 1.1) if seat.on == "seat" else (0.45, 0.95)
    calm = 0.7 if seat.on == "seat" else 0.58
    seated = scene.held(
        first + begin_share * down, first + end_share * down, last - 1.1 * up, last - calm * up
    )
    tilt = seat.tilt if seat.on == "floor" else 0.6 * seat.tilt - 0.08
    chest = -0.17 * seat.tilt if seat.on == "floor" else 0.4 * seat.tilt + 0.02
    scene.bend(
        seated,
        pelvis=(seat.turned, tilt, 0.0),
        chest=(-0.5 * seat.turned, chest, 0.0),
        gaze=(0.0, 0.05 + 0.3 * max(seat.tilt, 0.0), 0.0),
    )


def _look_about(scene: Scene, seat: _Seat) -> None:
    """The gaze goes about, the chest a little with it; the trunk leans elsewhere for a while."""
    stream, (start, end) = scene.stream, seat.sat
    at = start + stream.uniform(-20.0, 20.0)
    free = 0.12 if seat.hands in ("lap", "crossed", "beside") else 0.05
    while at < end - 50.0:
        long, rise = stream.uniform(44.0, 90.0), stream.uniform(15.0, 22.0)
        share = scene.held(at, at + rise, at + long - rise, at + long)
        aside, up = stream.uniform(-0.7, 0.7), stream.uniform(-0.15, 0.30)
        lean, tip = stream.uniform(-free, free), stream.uniform(-free, free)
        scene.bend(share, chest=(0.22 * aside, lean, 0.6 * tip), gaze=(aside, up, 0.3 * tip))
        at += long + stream.uniform(4.0, 50.0)


# ------------------------------------------------------------------------------------------- legs
def _legs(scene: Scene, seat: _Seat) -> None:
    """Feet are set elsewhere one after the other once the hips are down, and back before they rise."""
    stream, (start, end) = scene.stream, seat.sat
    places, feet = _feet(stream, seat), scene.feet
    at = round(start + stream.uniform(2.0, 14.0))
    stands = {side: feet.feet[side].contacts[-1] for side in SIDES}
    for number, (side, (ahead, width, toe_out)) in enumerate(places.items()):
        lasting, heading = round(stream.uniform(19.0, 26.0)), scene.heading
        goes, comes = at + number * (lasting + 2), round(end) - 30 * (number + 1)
        # in little time the feet stay
        if comes < goes + lasting + 4:
            continue
        there = replace(stands[side], place=along(heading, ahead), width=width, toe_out=toe_out)
        # legs that lie ahead have their toes down already
        pitch = 0.25 if seat.on == "seat" else 0.0
        feet = _set(feet, side, goes, lasting, there, pitch)
        feet = _set(feet, side, comes, 24, stands[side], pitch)
    scene.feet = feet


def _set(feet: Stance, side: str, start: int, lasting: int, there: FootContact, pitch: float) -> Stance:
    """One foot goes to another place while nothing bears on it, its toe last and first."""
    # a foot that is kept level neither peels off nor rolls down
    roll = 5 if pitch else 0
    flat = start + lasting
    landing = replace(there, strike=flat - roll, flat=flat, strike_pitch=0.5 * pitch)
    return feet.stepped(side, landing, start, start + roll, pitch, 0.05)


def _feet(stream: Stream, seat: _Seat) -> dict[str, tuple[float, float, float]]:
    """Side -> how far ahead of where it stood, leg lengths, width, half hip widths, toes out, radians."""
    side = stream.choice(SIDES)
    two = (side, other(side))
    near, far = stream.uniform(-0.12, -0.04), stream.uniform(0.06, 0.16)
    out = stream.uniform(0.05, 0.3)
    if seat.on == "floor":
        near, far = stream.uniform(-0.18, -0.10), stream.uniform(0.01, 0.04)
    if seat.legs == "crossed":
        # ankles before one another, knees fall apart
        back, turned = stream.uniform(-0.14, -0.06), stream.uniform(0.25, 0.45)
        return {two[0]: (back - 0.06, -0.2, turned), two[1]: (back + 0.06, -0.2, turned)}
    if seat.legs == "apart":
        wide = stream.uniform(1.6, 2.0)
        return {two[0]: (near, wide, out + 0.2), two[1]: (near + 0.03, wide, out + 0.2)}
    if seat.legs == "one ahead":
        return {two[0]: (far, stream.uniform(0.9, 1.6), out)}
    if seat.legs == "one back":
        return {two[0]: (near, stream.uniform(0.8, 1.3), out), two[1]: (0.5 * far, 1.1, out)}
    if seat.legs == "aside":
        # both to the side away from which the pelvis is turned
        aside = 0.7 * float(np.sign(-seat.turned))
        return {one: (near + 0.08, 1.0 + sign(one) * aside, out) for one in SIDES}
    return {two[0]: (0.5 * near, stream.uniform(0.8, 1.3), out)}


# ------------------------------------------------------------------------------------------- hands
_LAP = Shape((0.05, -0.70, 0.46), (-0.25, 0.0, -0.1), swivel=0.3, upright=1.0)
_THIGH = Shape((0.12, -0.46, 0.60), (-0.2, 0.0, -0.1), swivel=0.3, upright=1.0)
_BESIDE = Shape(
    (0.26, -0.84, -0.06), swivel=0.2, upright=1.0, palm=(0.0, -1.0, 0.0), fingers=(0.25, -0.15, 1.0)
)


def _hands_on_a_seat(scene: Scene, seat: _Seat) -> None:
    """On the knees, in the lap, beside the thighs or crossed; at ease before and after."""
    stream = scene.stream
    chosen = stream.choice(SIDES)
    shapes = {
        "knees": dict.fromkeys(SIDES, "knee"),
        "one knee": {chosen: "knee", other(chosen): stream.choice(("lap", "beside"))},
        "lap": dict.fromkeys(SIDES, "lap"),
        "beside": dict.fromkeys(SIDES, "beside"),
        "crossed": {chosen: "ribs", other(chosen): "upper_arm"},
    }[seat.hands]
    for side, what in shapes.items():
        delay = stream.uniform(0.0, 8.0)
        start, end = seat.first + 0.45 * seat.down + delay, seat.last - 0.55 * seat.up - delay
        if what == "knee":
            scene.touch(side, arms.on("knee", side), start, end, 28.0)
        elif what in ("ribs", "upper_arm"):
            start, end = start + 0.4 * seat.down, end - 0.4 * seat.up
            scene.hold(side, arms.on(what, side), start, end, 26.0, (0.05, 0.03, 0.18), (0.05, 0.0, 0.16))
        else:
            scene.hold(side, _LAP if what == "lap" else _BESIDE, start, end, 28.0, (0.08, 0.0, 0.04))


def _hands_on_the_floor(scene: Scene, seat: _Seat) -> None:
    """Both on the floor behind the hips, fingers outward; ahead as a counterweight on the way. A
    hand that is not leaned on lies on the thigh, or both on the knees."""
    chosen = scene.stream.choice(SIDES)
    leaning = {"behind": SIDES, "one behind": (chosen,), "knees": ()}[seat.hands]
    first, down, up, last = seat.first, seat.down, seat.up, seat.last
    ahead = Shape((0.10, -0.25, 0.80), swivel=0.2, upright=1.0)
    stay = HandContact(
        along(scene.heading, -seat.far),
        scene.heading,
        strike=round(seat.sat[0]),
        off=round(seat.sat[1]),
        coming=round(0.42 * down),
        leaving=round(0.40 * up),
        width=scene.stream.uniform(1.1, 1.5),
        ahead=scene.stream.uniform(-0.64, -0.56),
        turned=0.9,
    )
    for side in SIDES:
        start, end = first + 0.6 * down, last - 0.6 * up
        scene.arm(side, first + 0.05 * down, first + 0.5 * down, ahead, (0.05, 0.0, 0.0))
        if side in leaning:
            scene.arm(side, last - 0.5 * up, last - 0.05 * up)
            scene.contacts[side].append(stay)
        elif leaning:
            scene.hold(side, _THIGH, start, end, 32.0, (0.05, 0.0, 0.05))
        else:
            scene.touch(side, arms.on("knee", side), start, end, 32.0)
