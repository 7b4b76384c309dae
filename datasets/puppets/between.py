"""Cases from people to dogs and back: what is performed is known, what would be right is not.

Every clip of either family but those on stairs is given to bodies of the other one, evenly: bodies that
were asked least so far come first, and a hash settles what is left. Kinds are PAN's (section 7.2.2):
``sit`` for what is done sitting or lying, else ``move`` or ``idle`` by the speed along the path.
"""

from __future__ import annotations

import hashlib
from collections import Counter
from collections.abc import Sequence
from functools import cache

from retarget_bench.api import CaseInfo
from retarget_bench.motion.actions import MOVING, Action, going

from . import casting
from .clips import Clip
from .families import Family, families
from .parts import Part, bodies
from .score import FPS

_NUMBERS = {"tiny": 26, "default": 390, "large": 390}
"""Cases in each direction, at most."""
_SITTING = ("sit", "get_up", "dog_sit", "dog_lie", "shake_paw")
"""Kinds whose performer sits or lies for most of the clip, on the floor or on a seat."""
_STAIRS = ("stairs_up", "stairs_down")
"""Kinds with a floor that is no other family's."""


@cache
def cases(size: str, part: Part, seed: int) -> tuple[CaseInfo, ...]:
    """From people to dogs, then from dogs to people, clip by clip."""
    people, dogs = families()
    return (*_one_way(people, dogs, size, part, seed), *_one_way(dogs, people, size, part, seed))


@cache
def real(size: str, part: Part, seed: int) -> tuple[CaseInfo, ...]:
    """Every clip by every body that performs it in a case of the corpus, as a self case."""
    performed = casting.performers(size, part, seed)
    return tuple(
        _info(clip, name, name)
        for clip, (names, _) in performed.items()
        if clip.kind not in _STAIRS
        for name in names
    )


@cache
def action(clip: Clip) -> Action:
    """What is mostly done in a clip, known without solving it."""
    if clip.kind in _SITTING:
        return "sit"
    return "move" if going(clip.score().path, FPS) >= MOVING else "idle"


def _one_way(source: Family, target: Family, size: str, part: Part, seed: int) -> list[CaseInfo]:
    performed = casting.performers(size, part, seed)
    offered = {
        clip: names
        for clip, (names, _) in performed.items()
        if clip.family is source and clip.kind not in _STAIRS
    }
    aims = bodies(target, part)
    used: Counter[tuple[str, str]] = Counter()
    dealt: dict[Clip, list[tuple[str, str]]] = {clip: [] for clip in offered}
    listed = list(offered)
    for turn in range(_NUMBERS[size]):
        clip = listed[_place(turn, len(listed), _NUMBERS[size])]
        free = [(a, b) for a in offered[clip] for b in aims if (a, b) not in dealt[clip]]
        if free:
            pair = min(free, key=lambda pair: _rank(used, clip, pair))
            used.update([("source", pair[0]), ("target", pair[1])])
            dealt[clip].append(pair)
    return [_info(clip, *pair) for clip in listed for pair in dealt[clip]]


def _place(turn: int, clips: int, number: int) -> int:
    """Which clip has its turn: all in order again and again, or some, evenly, where not all have one."""
    return turn % clips if number >= clips else turn * clips // number


def _rank(used: Counter[tuple[str, str]], clip: Clip, pair: tuple[str, str]) -> tuple[int, int]:
    asked = used["source", pair[0]] + used["target", pair[1]]
    return asked, _hash(clip.name, *pair)


def _hash(*names: str) -> int:
    return int.from_bytes(hashlib.sha256("/".join(("legs", *names)).encode()).digest()[:6], "big")


def _info(clip: Clip, source: str, target: str) -> CaseInfo:
    return CaseInfo(
        id=f"puppets/{source}>{target}/{clip.name}",
        task="retarget",
        split="self" if source == target else "cross",
        source=source,
        target=target,
        clip=clip.name,
        kind=action(clip),
        frames=clip.frames,
    )


def of_structure(infos: Sequence[CaseInfo], structure: str) -> list[CaseInfo]:
    """The cases whose target is of a structure."""
    everybody = casting.everybody()
    return [
        info for info in infos if everybody[info.target].bodies[info.target].structure.name == structure
    ]
