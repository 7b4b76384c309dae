"""Sequences of performances: what begins and ends standing can be strung together, and a long one be cut.

Which ends can be joined is read off a Score (``stands``): in its first or last frame both soles are flat,
no heel is raised, the hips are up (over 0.7 of a leg), and the body is neither in the air nor on stairs.
Arms may be anywhere. A kind of which only some performances stand at an end is drawn again until one
does. Kinds that need time (``least``) are drawn only where a part is long enough for them, and get a
larger share of the whole.

Parts are rotated and moved so that one foot stays where it is; the other makes a step if it has to. While
that happens all channels run on with fading speed and are cross-faded, so nothing jumps.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from ...conventions import SIDES, sign
from ...curves import plateau
from ...randomness import Stream
from ..fading import bridged, either, joined_air, joined_hand, joined_trunk
from ..score import Act, Foot, Hand, Plant, Score, Touch, Trunk


def cut(score: Score, first: int, frames: int) -> Score:
    """``frames`` frames from ``first`` on; of performances without flights, stairs or several acts."""
    part = slice(first, first + frames)
    return replace(
        score,
        heading=score.heading[part],
        path=score.path[part],
        sway=score.sway[part],
        height=score.height[part],
        balance=score.balance[part],
        support=score.support[part],
        sit_back=None if score.sit_back is None else score.sit_back[part],
        prone=None if score.prone is None else score.prone[part],
        trunk=_trunk(score.trunk, part),
        feet={side: _foot(foot, part) for side, foot in score.feet.items()},
        hands={side: _hand(hand, part) for side, hand in score.hands.items()},
        phase=score.phases()[part],
    )


def _trunk(trunk: Trunk, part: slice) -> Trunk:
    follow = trunk.follow[part] if isinstance(trunk.follow, np.ndarray) else trunk.follow
    return Trunk(trunk.pelvis[part], trunk.chest[part], trunk.gaze[part], follow)


def _foot(foot: Foot, part: slice) -> Foot:
    later = part.start
    plants = tuple(
        replace(
            plant,
            strike=plant.strike - later,
            flat=plant.flat - later,
            lift=plant.lift - later,
            off=plant.off - later,
        )
        for plant in foot.plants
    )
    return Foot(
        plants,
        foot.heel[part],
        None,
        None if foot.kneel is None else foot.kneel[part],
        None if foot.bears is None else foot.bears[part],
    )


def _hand(hand: Hand, part: slice) -> Hand:
    later = part.start
    return Hand(
        reach=hand.reach[part],
        upright=hand.upright[part],
        middle=hand.middle[part],
        swivel=hand.swivel[part],
        wrist=hand.wrist[part],
        touches=tuple(Touch(touch.place, touch.weight[part]) for touch in hand.touches),
        aim=None if hand.aim is None else hand.aim[part],
        aimed=hand.aimed[part] if isinstance(hand.aimed, np.ndarray) else hand.aimed,
        plants=tuple(
            replace(plant, strike=plant.strike - later, off=plant.off - later) for plant in hand.plants
        ),
    )


Kind = Callable[[Stream, int], Score]

TRANSITION = "transition"
BRIDGE = 34
"""Frames between two parts."""
_SHORTEST, _USUAL = 75, 135
"""Frames of a part."""
_TRIES = 24
_HIP_HALF = 0.105
"""Half the distance of the hip joints of a usual body, leg lengths: to judge whether a step is needed."""


def stands(score: Score, frame: int) -> bool:
    """Whether a performance may be joined to another at its first (0) or last (-1) frame."""
    at = frame % score.frames
    feet = [_plant(foot, at) is not None and foot.heel[at] == 0.0 for foot in score.feet.values()]
    calm = all(foot.air is None or foot.air.weight[at] == 0.0 for foot in score.feet.values())
    channels = [foot.kneel for foot in score.feet.values()] + [score.prone]
    up = all(channel is None or channel[at] == 0.0 for channel in channels)
    grounded = up and all(not first <= at <= last for first, last in score.flights)
    return all(feet) and calm and grounded and score.stairs is None and bool(score.height[at] > 0.7)


def drawn(stream: Stream, kind: Kind, frames: int, starts: bool, ends: bool) -> Score | None:
    """A performance of a kind that stands where it has to; nothing where none of two dozen does."""
    for number in range(_TRIES):
        score = kind(stream.part(number), frames)
        if (stands(score, 0) or not starts) and (stands(score, -1) or not ends):
            return score
    return None


def strung(
    stream: Stream,
    frames: int,
    among: Mapping[str, Kind],
    kinds: Sequence[str] = (),
    least: Mapping[str, int] | None = None,
) -> Score:
    """``kinds`` in order, or as many as the time is right for, drawn from ``among`` without repeating one
    until all have had their turn. least: kind -> frames that it takes from standing to standing."""
    takes = least or {}
    count = len(kinds) or max(1, round((frames + BRIDGE) / (_USUAL + BRIDGE)))
    order = list(kinds) or _drawn_order(stream, list(among), count)
    shares = [stream.uniform(0.75, 1.3) * max(takes.get(name, 0) / 0.8 / _USUAL, 1.0) for name in order]
    room = frames - BRIDGE * (len(order) - 1)
    ends = np.round(np.cumsum([0.0, *shares]) / sum(shares) * room).astype(int).tolist()
    whole: Score | None = None
    before = ""
    for number, name in enumerate(order):
        long, middle = ends[number + 1] - ends[number], (number > 0, number < len(order) - 1)
        # a kind that happens not to stand, or has too little time, is replaced, unless it was asked for
        names = [name]
        if not kinds:
            offered = [each for each in (name, *among) if takes.get(each, 0) <= long]
            names = [each for each in offered if each != before] or offered
        tries = ((each, drawn(stream.part(number, each), among[each], long, *middle)) for each in names)
        found = next(((each, score) for each, score in tries if score is not None), None)
        if found is None:
            raise ValueError(f"no performance of {name} stands where it is joined to another one")
        before, part = found
        whole = part if whole is None else joined(whole, part, stream.choice(SIDES))
    assert whole is not None
    acts = whole.stretches()
    names = [act.kind for act in acts if act.kind != TRANSITION]
    return replace(whole, kind="sequence", parameters={"kinds": "+".join(names)}, acts=acts)


def _drawn_order(stream: Stream, names: list[str], count: int) -> list[str]:
    order: list[str] = []
    while len(order) < count:
        left = [name for name in names if name not in order[len(order) - len(order) % len(names) :]]
        order.append(stream.choice([name for name in left if name not in order[-1:]] or left))
    return order


def joined(a: Score, b: Score, anchor: str) -> Score:
    """``a``, a bridge, and ``b`` brought to where ``a`` ends. anchor: the foot that surely stays."""
    b = _brought(a, b, anchor)
    start = a.frames + BRIDGE
    steps = {side: _apart(_last(a, side), _first(b, side), side) > 0.05 for side in SIDES}
    feet = {side: _joined_foot(a, b, side, steps[side] and side != anchor) for side in SIDES}
    support = bridged(a.support, b.support, BRIDGE, 0.0, 1.0)
    for side in SIDES:
        if steps[side] and side != anchor:
            t, first = np.arange(len(support), dtype=float), a.frames + 8.0
            away = 0.95 * plateau(t, first - 15.0, first + 1.0, first + 15.0, first + 31.0)
            support = support + away * ((0.0 if sign(side) > 0 else 1.0) - support)
    acts = tuple(replace(act, first=act.first + start, end=act.end + start) for act in b.stretches())
    return replace(
        a,
        heading=bridged(a.heading, b.heading, BRIDGE),
        path=bridged(a.path, b.path, BRIDGE),
        sway=bridged(a.sway, b.sway, BRIDGE),
        height=bridged(a.height, b.height, BRIDGE),
        balance=bridged(a.balance, b.balance, BRIDGE, 0.0, 1.0),
        support=support,
        trunk=joined_trunk(a.trunk, b.trunk, a.frames, b.frames, BRIDGE),
        feet=feet,
        hands={side: joined_hand(a.hands[side], b.hands[side], BRIDGE) for side in SIDES},
        flights=(*a.flights, *((first + start, last + start) for first, last in b.flights)),
        impacts=(*a.impacts, *(frame + start for frame in b.impacts)),
        acts=(*a.stretches(), Act(TRANSITION, a.frames, start), *acts),
        sit_back=either(a.sit_back, b.sit_back, a.frames, b.frames, BRIDGE),
        prone=either(a.prone, b.prone, a.frames, b.frames, BRIDGE),
        phase=np.concatenate([a.phases(), np.arange(BRIDGE) / BRIDGE, b.phases()]),
    )


# ------------------------------------------------------------------------------------------ feet
def _plant(foot: Foot, frame: int) -> Plant | None:
    """The plant whose sole is flat in a frame."""
    return next((plant for plant in foot.plants if plant.flat <= frame <= plant.lift), None)


def _last(score: Score, side: str) -> Plant:
    plant = _plant(score.feet[side], score.frames - 1)
    assert plant is not None
    return plant


def _first(score: Score, side: str) -> Plant:
    plant = _plant(score.feet[side], 0)
    assert plant is not None
    return plant


def _place(plant: Plant, side: str) -> np.ndarray:
    """(x, z) of a planted foot, leg lengths, on a usual body."""
    out = sign(side) * plant.width * _HIP_HALF
    return np.array(plant.place) + out * np.array([np.cos(plant.heading), -np.sin(plant.heading)])


def _apart(one: Plant, other: Plant, side: str) -> float:
    """How far two stays of a foot differ: leg lengths, and a third of the radians it is turned."""
    away = float(np.sqrt(((_place(one, side) - _place(other, side)) ** 2).sum()))
    turned = (one.heading - other.heading) + sign(side) * (one.toe_out - other.toe_out)
    return away + abs(turned) / 3.0


def _brought(a: Score, b: Score, anchor: str) -> Score:
    """``b`` turned and moved so that it faces where ``a`` ended, on the same place of one foot."""
    turned = float(a.heading[-1] - b.heading[0])
    c, s = np.cos(turned), np.sin(turned)
    turn = np.array([[c, -s], [s, c]])
    moved = _place(_last(a, anchor), anchor)
    first = _first(b, anchor)
    moved = moved - _place(
        replace(first, place=_tuple(np.array(first.place) @ turn), heading=first.heading + turned), anchor
    )
    feet = {}
    for side, foot in b.feet.items():
        plants = tuple(
            replace(
                plant, place=_tuple(np.array(plant.place) @ turn + moved), heading=plant.heading + turned
            )
            for plant in foot.plants
        )
        feet[side] = replace(foot, plants=plants)
    hands = {}
    for side, hand in b.hands.items():
        rests = tuple(
            replace(
                plant, place=_tuple(np.array(plant.place) @ turn + moved), heading=plant.heading + turned
            )
            for plant in hand.plants
        )
        hands[side] = replace(hand, plants=rests)
    path = b.path @ turn + moved
    return replace(b, heading=b.heading + turned, path=path, feet=feet, hands=hands)


def _tuple(place: np.ndarray) -> tuple[float, float]:
    return float(place[0]), float(place[1])


def _joined_foot(a: Score, b: Score, side: str, steps: bool) -> Foot:
    """Plants that go on: the last of ``a`` bears until the first of ``b`` lifts, or a step is between."""
    one, two = a.feet[side], b.feet[side]
    start, last, first = a.frames + BRIDGE, _last(a, side), _first(b, side)
    before = one.plants[: one.plants.index(last)]
    after = tuple(_later(plant, start) for plant in two.plants[two.plants.index(first) + 1 :])
    first = _later(first, start)
    stays: tuple[Plant, ...]
    if steps:
        lift = a.frames + 8
        leaving = replace(last, lift=lift, off=lift + 5, off_pitch=0.45, lift_height=0.06)
        stays = (leaving, replace(first, strike=lift + 14, flat=lift + 18, strike_pitch=0.20))
    else:
        leaves = {name: getattr(first, name) for name in ("lift", "off", "off_pitch", "lift_height")}
        stays = (replace(last, **leaves),)
    frames = a.frames, b.frames, BRIDGE
    return Foot(
        plants=(*before, *stays, *after),
        heel=np.concatenate([one.heel, np.zeros(BRIDGE), two.heel]),
        air=joined_air(one.air, two.air, *frames),
        kneel=either(one.kneel, two.kneel, *frames),
    )


def _later(plant: Plant, frames: int) -> Plant:
    return replace(
        plant,
        strike=plant.strike + frames,
        flat=plant.flat + frames,
        lift=plant.lift + frames,
        off=plant.off + frames,
    )
