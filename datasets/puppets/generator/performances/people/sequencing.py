"""Sequences of performances: what begins and ends standing can be strung together, and a long one be cut.

Which ends can be joined is read off a Score (``stands``): in its first or last frame both soles are flat,
no heel is raised, the hips are up (over 0.7 of a leg), and the body is neither in the air nor on stairs.
Arms may be anywhere. A kind of which only some performances stand at an end is drawn again until one
does. Kinds that need time (``takes``) are drawn only where a part is long enough for them, and get a
larger share of the whole.

Parts are rotated and moved so that one foot stays where it is; the other makes a step if it has to. While
that happens all channels run on with fading speed and are cross-faded, so nothing jumps.
"""

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any, TypeVar

import numpy as np

from ...conventions import SIDES, sign
from ...curves import plateau
from ...randomness import Stream
from ..fading import bridged, either, in_a_row, joined_air, joined_hand
from ..score import Foot, FootContact, Hand, HandContact, Score, Touch, Trunk


def cut(score: Score, first: int, frames: int) -> Score:
    """``frames`` frames from ``first`` on; of performances without flights, stairs or several acts."""
    cut_short = _part(score, first, first + frames)
    return replace(cut_short, phase=score.phases()[first : first + frames])


def _part(item: Any, first: int, end: int) -> Any:
    """A score, or a part of one, with its channels cut and its stays so much earlier."""
    if isinstance(item, np.ndarray):
        return item[first:end]
    if isinstance(item, FootContact | HandContact):
        return item.later(-first)
    if isinstance(item, tuple):
        return tuple(_part(each, first, end) for each in item)
    if isinstance(item, Mapping):
        return {name: _part(each, first, end) for name, each in item.items()}
    if isinstance(item, Score | Trunk | Foot | Hand | Touch):
        return replace(item, **_part(vars(item), first, end))
    return item


Stay = TypeVar("Stay", FootContact, HandContact)
Kind = Callable[[Stream, int], Score]

BRIDGE = 34
"""Frames between two parts."""
_SHORTEST, _USUAL = 75, 135
"""Frames of a part."""
_TRIES = 24
_HIP_HALF = 0.105
"""Half the distance of the hip joints of a usual body, leg lengths: to judge whether a step is needed."""


def stands(score: Score, frame: int) -> bool:
    """True where a performance may be joined to another at its first (0) or last (-1) frame."""
    at = frame % score.frames
    feet = [_contact(foot, at) is not None and foot.heel[at] == 0.0 for foot in score.feet.values()]
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
    takes: Mapping[str, int],
) -> Score:
    """As many kinds as the time is right for, drawn from ``among`` without repeating one until all have had
    their turn. takes: kind -> frames that it takes from standing to standing.

    Raises ValueError where no performance stands where it is joined."""
    count = max(1, round((frames + BRIDGE) / (_USUAL + BRIDGE)))
    order = _drawn_order(stream, list(among), count)
    shares = [stream.uniform(0.75, 1.3) * max(takes.get(name, 0) / 0.8 / _USUAL, 1.0) for name in order]
    room = frames - BRIDGE * (len(order) - 1)
    ends = np.round(np.cumsum([0.0, *shares]) / sum(shares) * room).astype(int).tolist()
    sequence: Score | None = None
    before = ""
    for number, name in enumerate(order):
        long, middle = ends[number + 1] - ends[number], (number > 0, number < len(order) - 1)
        # a kind that happens not to stand, or has too little time, is replaced
        offered = [each for each in (name, *among) if takes.get(each, 0) <= long]
        names = [each for each in offered if each != before] or offered
        tries = ((each, drawn(stream.part(number, each), among[each], long, *middle)) for each in names)
        chosen = next(((each, score) for each, score in tries if score is not None), None)
        if chosen is None:
            raise ValueError(f"no performance of {name} stands where it is joined to another one")
        before, part = chosen
        sequence = part if sequence is None else joined(sequence, part, stream.choice(SIDES))
    assert sequence is not None
    return replace(sequence, kind="sequence", acts=sequence.stretches())


def _drawn_order(stream: Stream, names: list[str], count: int) -> list[str]:
    order: list[str] = []
    while len(order) < count:
        left = [name for name in names if name not in order[len(order) - len(order) % len(names) :]]
        order.append(stream.choice([name for name in left if name not in order[-1:]] or left))
    return order


_CHANNELS = ("heading", "path", "sway", "height")


def joined(a: Score, b: Score, anchor: str) -> Score:
    """``a``, a bridge, and ``b`` brought to where ``a`` ends. anchor: the foot that surely stays."""
    b = _brought(a, b, anchor)
    start = a.frames + BRIDGE
    apart = {side: _apart(_standing(a, side, -1), _standing(b, side, 0), side) for side in SIDES}
    steps = {side: side != anchor and apart[side] > 0.05 for side in SIDES}
    support = bridged(a.support, b.support, BRIDGE, 0.0, 1.0)
    for side in SIDES:
        if steps[side]:
            t, first = np.arange(len(support), dtype=float), a.frames + 8.0
            away = 0.95 * plateau(t, first - 15.0, first + 1.0, first + 15.0, first + 31.0)
            support = support + away * ((0.0 if side == "left" else 1.0) - support)
    return replace(
        a,
        **in_a_row(a, b, _CHANNELS, BRIDGE),
        balance=bridged(a.balance, b.balance, BRIDGE, 0.0, 1.0),
        support=support,
        feet={side: _joined_foot(a, b, side, steps[side]) for side in SIDES},
        hands={side: joined_hand(a.hands[side], b.hands[side], BRIDGE) for side in SIDES},
        flights=(*a.flights, *((first + start, last + start) for first, last in b.flights)),
        impacts=(*a.impacts, *(frame + start for frame in b.impacts)),
        sit_back=either(a.sit_back, b.sit_back, a.frames, b.frames, BRIDGE),
        prone=either(a.prone, b.prone, a.frames, b.frames, BRIDGE),
    )


# ------------------------------------------------------------------------------------------ feet
def _contact(foot: Foot, frame: int) -> FootContact | None:
    """The contact whose sole is flat in a frame."""
    return next((contact for contact in foot.contacts if contact.flat <= frame <= contact.lift), None)


def _standing(score: Score, side: str, frame: int) -> FootContact:
    """The contact on which a foot stands in the first (0) or last (-1) frame."""
    contact = _contact(score.feet[side], frame % score.frames)
    assert contact is not None
    return contact


def _place(contact: FootContact, side: str) -> np.ndarray:
    """(x, z) of a planted foot, leg lengths, on a usual body."""
    out = sign(side) * contact.width * _HIP_HALF
    return np.array(contact.place) + out * np.array([np.cos(contact.heading), -np.sin(contact.heading)])


def _apart(one: FootContact, other: FootContact, side: str) -> float:
    """Difference of two stays of a foot: leg lengths, and a third of the radians it is turned."""
    away = float(np.sqrt(((_place(one, side) - _place(other, side)) ** 2).sum()))
    turned = (one.heading - other.heading) + sign(side) * (one.toe_out - other.toe_out)
    return away + abs(turned) / 3.0


def _brought(a: Score, b: Score, anchor: str) -> Score:
    """``b`` turned and moved so that it faces where ``a`` ended, on the same place of one foot."""
    turned = float(a.heading[-1] - b.heading[0])
    c, s = np.cos(turned), np.sin(turned)
    turn = np.array([[c, -s], [s, c]])

    def moved(stay: Stay, by: np.ndarray | float = 0.0) -> Stay:
        x, z = (np.array(stay.place) @ turn + by).tolist()
        return replace(stay, place=(x, z), heading=stay.heading + turned)

    shift = _place(_standing(a, anchor, -1), anchor) - _place(moved(_standing(b, anchor, 0)), anchor)
    feet = {
        side: replace(foot, contacts=tuple(moved(contact, shift) for contact in foot.contacts))
        for side, foot in b.feet.items()
    }
    hands = {
        side: replace(hand, contacts=tuple(moved(contact, shift) for contact in hand.contacts))
        for side, hand in b.hands.items()
    }
    return replace(b, heading=b.heading + turned, path=b.path @ turn + shift, feet=feet, hands=hands)


def _joined_foot(a: Score, b: Score, side: str, steps: bool) -> Foot:
    """Contacts that go on: the last of ``a`` bears until the first of ``b`` lifts, or a step is between."""
    one, two = a.feet[side], b.feet[side]
    start, last, first = a.frames + BRIDGE, _standing(a, side, -1), _standing(b, side, 0)
    before = one.contacts[: one.contacts.index(last)]
    after = tuple(contact.later(start) for contact in two.contacts[two.contacts.index(first) + 1 :])
    first = first.later(start)
    stays: tuple[FootContact, ...]
    if steps:
        lift = a.frames + 8
        leaving = replace(last, lift=lift, off=lift + 5, off_pitch=0.45, lift_height=0.06)
        stays = (leaving, replace(first, strike=lift + 14, flat=lift + 18, strike_pitch=0.20))
    else:
        leaves = {name: getattr(first, name) for name in ("lift", "off", "off_pitch", "lift_height")}
        stays = (replace(last, **leaves),)
    frames = a.frames, b.frames, BRIDGE
    return Foot(
        contacts=(*before, *stays, *after),
        heel=np.concatenate([one.heel, np.zeros(BRIDGE), two.heel]),
        air=joined_air(one.air, two.air, *frames),
        kneel=either(one.kneel, two.kneel, *frames),
    )
