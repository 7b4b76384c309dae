"""Several performances of a dog one after the other: all begin and end standing.

Whoever sits or lies down gets up again. Paws stay where the part before left them until the next one lifts
them; all other channels run on with fading speed and are cross-faded on a bridge.
"""

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np

from ...randomness import Stream
from ..fading import TRANSITION, bridged, in_a_row
from ..score import DogScore, Paw, PawContact
from .gaits import TROT, WALK, go
from .resting import CHANNELS, backwards, settling, stand, turn

BRIDGE = 16
"""Frames between two parts."""
_STRETCHED = 1.4
"""How much longer parts are in performances of more than ten seconds."""


def sequence(stream: Stream, frames: int) -> DogScore:
    """Walking, trotting, standing, turning, sitting and lying in some order, by one dog: as many as there
    is time for, none again until all others have had their turn. ``Score.acts`` says what is done when."""
    order = _drawn_order(stream, frames)
    shares = np.cumsum([0.0, *(PARTS[kind][1] * stream.uniform(0.9, 1.1) for kind in order)])
    room = frames - BRIDGE * (len(order) - 1)
    ends = np.round(shares / shares[-1] * room).astype(int).tolist()
    score: DogScore | None = None
    for number, kind in enumerate(order):
        part = PARTS[kind][0](stream.part(number, kind), ends[number + 1] - ends[number])
        score = part if score is None else joined(score, part)
    assert score is not None
    return replace(score, kind="dog_sequence", acts=score.stretches())


def _drawn_order(stream: Stream, frames: int) -> list[str]:
    """Kinds that there is time for, beginning with something else than standing."""
    usual = {kind: long * (_STRETCHED if frames > 300 else 1.0) for kind, (_, long) in PARTS.items()}
    order: list[str] = []
    left = 1.1 * frames
    while True:
        had = order[len(order) - len(order) % len(usual) :]
        room = left - (BRIDGE if order else 0)
        not_now = (*had, *order[-1:]) if order else ("dog_stand",)
        fits = [kind for kind in usual if kind not in not_now and usual[kind] <= room]
        if not fits:
            return order or ["dog_turn"]
        order.append(stream.choice(fits))
        left = room - usual[order[-1]]


def _down_and_up(stream: Stream, frames: int, kind: str) -> DogScore:
    """To the floor, a while there, and up again."""
    down = (frames - BRIDGE) // 2
    first = settling(stream.part("down"), down, kind)
    return joined(first, backwards(settling(stream.part("up"), frames - BRIDGE - down, kind)), kind)


PARTS: dict[str, tuple[Callable[[Stream, int], DogScore], int]] = {
    "dog_walk": (partial(go, gait=WALK, there=(True,)), 75),
    "trot": (partial(go, gait=TROT, there=(True,)), 65),
    "dog_stand": (stand, 45),
    "dog_turn": (turn, 58),
    "dog_sit": (partial(_down_and_up, kind="dog_sit"), 136),
    "dog_lie": (partial(_down_and_up, kind="dog_lie"), 140),
}
"""Kinds that begin and end standing, and how many frames they ask for."""


# --------------------------------------------------------------------------------------- two as one
def joined(a: DogScore, b: DogScore, between: str = TRANSITION) -> DogScore:
    """``a``, a bridge, and ``b`` brought to where ``a`` ends and facing as it does there.

    between: the kind of the bridge.
    """
    b = _brought(a, b)
    paws = {limb: _joined_paw(paw, b.paws[limb], a.frames + BRIDGE) for limb, paw in a.paws.items()}
    return replace(a, **in_a_row(a, b, CHANNELS, BRIDGE, between), paws=paws)


def _brought(a: DogScore, b: DogScore) -> DogScore:
    turned = float(a.heading[-1] - b.heading[0])
    c, s = np.cos(turned), np.sin(turned)
    path = (b.path - b.path[0]) @ np.array([[c, -s], [s, c]]) + a.path[-1]
    return replace(b, heading=b.heading + turned, path=path)


def _joined_paw(a: Paw, b: Paw, start: int) -> Paw:
    """The last stay of ``a`` goes on until the first of ``b`` ends."""
    stays, leaves = a.contacts[-1], _later(b.contacts[0], start)
    names = ("lift", "off", "off_pitch", "lift_height", "curl")
    stays = replace(stays, **{name: getattr(leaves, name) for name in names})
    later = (_later(contact, start) for contact in b.contacts[1:])
    return Paw((*a.contacts[:-1], stays, *later), bridged(a.flat, b.flat, BRIDGE))


def _later(contact: PawContact, frames: int) -> PawContact:
    moved = {name: getattr(contact, name) + frames for name in ("moment", "strike", "flat", "lift", "off")}
    return replace(contact, **moved)
