"""Two dance routines: steps in bars of four beats with figures of the arms, and a line dance of touches."""

from dataclasses import replace

import numpy as np

from ...conventions import SIDES, other, sign
from ...curves import ramp, through
from ...randomness import Stream
from ..score import Score
from . import arms
from .arms import Shape
from .scene import Scene, step_to

_QUICKEST = 14
"""Frames of a beat below which there is time for neither steps nor great figures."""
_SWAY = 0.30
"""Share of the weight that goes to a side on a beat without a step."""


class _Floor:
    """The dancer's place on the floor and the course of the weight. place: (x, z) leg lengths, of the
    middle."""

    def __init__(self, scene: Scene, beat: int, start: int) -> None:
        self.scene, self.beat, self.start = scene, beat, start
        self.heading, self.place = scene.heading, np.zeros(2)
        self.turned = np.zeros(scene.frames)
        self.weight = [(-40.0, 0.5), (start - 4.0, 0.5)]

    def at(self, number: float) -> float:
        """Frame of a beat."""
        return self.start + self.beat * number

    def beside(self, left: float, ahead: float) -> np.ndarray:
        """(x, z) of a place seen from where the bar began."""
        c, s = np.cos(self.heading), np.sin(self.heading)
        return np.asarray(self.place + left * np.array([c, -s]) + ahead * np.array([s, c]))

    def step(self, number: int, side: str, left: float, ahead: float, turn: float = 0.0) -> None:
        """On a beat a foot goes to a place beside the middle."""
        (x, z), start = self.beside(left, ahead).tolist(), round(self.at(number))
        heading = self.heading + turn
        self.scene.feet = step_to(self.scene.feet, side, start, (x, z), heading, self.beat)
        self.weight.append((start + 0.5 * self.beat, 0.5 - 0.36 * sign(side)))

    def sway(self, number: int, side: str) -> None:
        self.weight.append((self.at(number) + 0.5 * self.beat, 0.5 + _SWAY * sign(side)))

    def moved(self, number: int, left: float, ahead: float, turn: float = 0.0) -> None:
        """The bar from a beat on has brought the body there."""
        self.place = self.beside(left, ahead)
        self.heading += turn
        self.turned += turn * ramp(self.scene.k, self.at(number), self.at(number + 4))

    def close(self) -> None:
        """The weight and the heading as the steps have made them."""
        last = self.weight[-1][0] + self.beat
        times, values = zip(*self.weight, (last, 0.5), (last + 60.0, 0.5), strict=True)
        feet = self.scene.feet
        support = through(self.scene.k, list(times), list(values))
        self.scene.feet = replace(feet, heading=feet.heading + self.turned, support=support)


# ------------------------------------------------------------------------------------------ steps
_STEPS = {
    # shares of the way of a bar after each beat; the way: to the leading side, ahead, radians turned to it
    "vine": ((0.5, 0.5, 1.0, 1.0), (0.48, 0.0, 0.0)),
    "march": ((0.26, 0.52, 0.70, 0.70), (0.0, 1.0, 0.0)),
    "turn": ((0.5, 0.5, 1.0, 1.0), (0.0, 0.0, 1.6)),
}


def _steps(floor: _Floor, number: int, name: str, lead: str, way: float = 1.0) -> None:
    """A bar of steps, the feet in turn. vine: side, together, side, together. march: three steps ahead, or
    with ``way`` -1 back, and together. turn: round on the spot, the inner foot first. sway: no step."""
    feet = (lead, other(lead), lead, other(lead))
    if name == "sway":
        for beat, side in enumerate(feet):
            floor.sway(number + beat, side)
        return
    shares, (aside, ahead, turn) = _STEPS[name]
    aside, ahead, turn = aside * sign(lead), ahead * way, turn * sign(lead)
    for beat, (side, share) in enumerate(zip(feet, shares, strict=True)):
        floor.step(number + beat, side, aside * share, ahead * share, turn * share)
    floor.moved(number, aside * shares[-1], ahead * shares[-1], turn * shares[-1])


# ------------------------------------------------------------------------------------------ arms
def _figure(floor: _Floor, number: int, name: str, lead: str) -> None:
    """Move both arms in a bar; they stay where the next bar finds them."""
    scene, at, beat = floor.scene, floor.at, floor.beat
    if name in ("hips", "shoulders", "belly"):
        point = {"hips": "hip", "shoulders": "shoulder", "belly": "belly"}[name]
        for rank, side in enumerate((lead, other(lead))):
            end = at(number + 1) + 0.4 * beat * rank
            scene.arm(side, at(number) - 2, end, arms.on(point, side), (0.08, 0.0, 0.12))
            if beat >= _QUICKEST:
                scene.arm(side, at(number + 3) + 0.2 * beat * rank, at(number + 4), _READY)
    elif name == "raise":
        for side in SIDES:
            up = Shape((0.42, 0.80, 0.20), (-0.2, 0.0, -0.5), upright=0.8)
            scene.arm(side, at(number), at(number + 1.4), up)
            scene.arm(side, at(number + 2), at(number + 3.5), _READY, (0.25, 0.0, 0.0))
    elif name == "clap":
        for side in SIDES:
            for half in (0, 2):
                met = round(at(number + 1 + half))
                scene.arm(side, at(number + half), met, _together(side), (0.06, 0.0, 0.0))
                scene.arm(side, met + 1, met + 0.8 * beat, _READY)
    elif name == "diagonal":
        up, down = Shape((0.62, 0.68, 0.25), upright=0.8), Shape((-0.42, -0.60, 0.42), upright=0.6)
        for begin in (at(number), at(number + 2)):
            scene.arm(lead, begin, begin + 0.9 * beat, up, (0.0, 0.0, 0.22))
            scene.arm(lead, begin + beat, begin + 1.95 * beat, down, (0.05, 0.0, 0.28))
        side = other(lead)
        scene.arm(side, at(number) - 2, at(number + 1), arms.on("hip", side), (0.1, 0.0, 0.05))
        scene.arm(side, at(number + 3), at(number + 4), _READY)
    else:
        for half in range(4):
            for side in SIDES:
                ahead = (side == lead) == (half % 2 == 0)
                reach = (0.10, -0.45, 0.58) if ahead else (0.28, -0.68, -0.20)
                scene.arm(side, at(number + half), at(number + half + 1), Shape(reach, upright=0.8))


_READY = Shape((0.22, -0.52, 0.38), (0.0, 0.0, 0.2), swivel=0.1, upright=0.7)


def _together(side: str) -> Shape:
    """Palm to palm before the chest."""
    return Shape(
        (0.035, -0.22, 0.56),
        swivel=0.25,
        upright=0.5,
        middle=1.0,
        touch="left_palm" if side == "right" else "",
        palm=(-1.0, 0.0, 0.0),
        fingers=(0.0, 0.4, 0.92),
    )


def dance_steps(stream: Stream, frames: int) -> Score:
    """Bars of side steps, steps ahead and back, turns and sways, each with a figure of the arms."""
    scene, floor, bars = _begun(stream, frames, (15, 18))
    side, before = stream.choice(SIDES), ""
    for bar in range(bars):
        name = stream.choice(("vine", "march", "turn", "sway"))
        # what led away leads back
        name = before if before in ("vine", "march") and bar % 2 else name
        name = "sway" if floor.beat < _QUICKEST else name
        again = bar % 2 == 1 and name == before
        number = 4 * bar
        if name == "turn":
            side = other(side)
        lead = other(side) if again and name == "vine" else side
        _steps(floor, number, name, lead, way=-1.0 if again else 1.0)
        before = name
        quick = ("hips", "belly")
        slow = ("swing", "raise", "clap", "diagonal", "shoulders", *quick)
        _figure(floor, number, stream.choice(quick if floor.beat < _QUICKEST else slow), side)
    return _ended(scene, floor, bars, "dance_steps")


def dance_line(stream: Stream, frames: int) -> Score:
    """A line dance: one hand after the other ahead, turned up, to shoulders, to head, belly or knees, to
    the hips; then it begins anew, turned to another wall."""
    scene, floor, bars = _begun(stream, frames, (18, 22))
    first = stream.choice(SIDES)
    third = stream.choice(("head", "belly", "knees"))
    for bar in range(bars):
        number, phrase = 4 * bar, bar % 4
        if floor.beat < _QUICKEST:
            phrase = 3
        _line_bar(floor, number, ("ahead", "shoulders", third, "hips")[phrase], first)
        _steps(floor, number, "turn" if phrase == 3 and floor.beat >= _QUICKEST else "sway", first)
    return _ended(scene, floor, bars, "dance_line")


_LINE = {
    # place on the body, frames of rest there, arc of the way
    "shoulders": ("shoulder", 2, (0.0, 0.0, 0.0)),
    "head": ("head", 2, (0.05, 0.0, 0.10)),
    "belly": ("belly", 4, (0.05, 0.0, 0.08)),
    "hips": ("hip", 4, (0.10, 0.0, 0.12)),
}


def _line_bar(floor: _Floor, number: int, name: str, first: str) -> None:
    """Four beats: each hand has one of its own and rests in the next."""
    scene, at, beat = floor.scene, floor.at, floor.beat
    for rank, side in enumerate((first, other(first))):
        begin, rest = at(number + rank), at(number + 2 + rank)
        if name == "ahead":
            flat = Shape((0.10, -0.04, 0.86), (-0.1, 0.0, 0.0), 0.15, 0.9, palm=(0.0, -1.0, 0.0))
            scene.arm(side, begin, begin + 0.85 * beat, flat, (0.0, 0.0, 0.05))
            scene.arm(side, rest, rest + 0.8 * beat, replace(flat, palm=(-0.85, 0.5, 0.0)))
        elif name == "knees":
            scene.arm(side, at(number) + 2 * rank, at(number + 2), arms.on("knee", side), (0.05, 0.0, 0.10))
            scene.arm(side, at(number + 2.8), at(number + 4), _READY, (0.0, 0.0, 0.10))
        else:
            point, sooner, arc = _LINE[name]
            scene.arm(side, begin, rest - sooner, arms.on(point, side), arc)
    if name == "knees":
        down = scene.held(at(number), at(number + 1.9), at(number + 2.7), at(number + 4))
        scene.low += 0.26 * down
        scene.lean(down, 0.48, 0.36, 0.3)


# ------------------------------------------------------------------------------------------ both
def _begun(stream: Stream, frames: int, beats: tuple[int, int]) -> tuple[Scene, _Floor, int]:
    """A dancer who stands, the floor, and how many whole bars the time is right for."""
    scene = Scene(stream, frames, width=stream.uniform(1.1, 1.5), shift=0.1)
    beat = min(round(stream.uniform(*beats)), (frames - 20) // 4)
    floor = _Floor(scene, beat, 5)
    return scene, floor, max((frames - 20) // (4 * beat), 1)


def _ended(scene: Scene, floor: _Floor, bars: int, kind: str) -> Score:
    """Arms come to rest; knees and chest go with every beat."""
    end = floor.at(4 * bars)
    for side in SIDES:
        scene.arm(side, end - 6, min(end + 18, scene.frames - 1.0), None, (0.12, 0.0, 0.04))
    floor.close()
    beats = np.pi * (scene.k - floor.start) / floor.beat
    dancing = scene.held(floor.start, floor.start + 12.0, end - 8.0, end + 8.0)
    bounce = scene.stream.uniform(0.6, 1.3)
    scene.low += bounce * dancing * (0.016 + 0.012 * np.cos(2.0 * beats))
    aside = dancing * np.sin(beats)
    scene.bend(bounce * aside, pelvis=(0.05, 0.0, 0.0), chest=(-0.09, 0.0, 0.03), gaze=(0.0, 0.0, -0.05))
    scene.lean(bounce * dancing * np.cos(2.0 * beats), chest=0.03, gaze=0.04)
    return scene.score(kind)
