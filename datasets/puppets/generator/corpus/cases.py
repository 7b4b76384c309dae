"""Lists of cases: which bodies perform which clip, and who is retargeted to whom, evenly mixed.

Every choice takes what was taken least so far, counted in whole numbers: the lists are the same
everywhere, every body comes as often as the others of its family, in either role, and so does every kind.
Among those taken equally often pairs of unlike build come first, since for bodies that are built alike
copying is an answer; a hash decides among the rest.

Cases between legs, from people to dogs and back, have no right answer. Every clip of either family but
those on stairs is given to bodies of the other one. Kinds are PAN's (section 7.2.2): ``sit`` for what is
done sitting or lying, else ``move`` or ``idle`` by the speed along the path.
"""

import hashlib
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from functools import cache
from itertools import product

from retarget_bench.api import CaseInfo
from retarget_bench.motion.actions import MOVING, Action, path_speed

from ...frozen import PREFIX
from ..conventions import FPS
from .clips import SIZES, Clip, clips, unable
from .families import VALIDATION_BODIES, Family, Part, bodies_of, everybody, families, unlikeness

Chosen = tuple[Clip, str, str]
"""Clip, source and target."""


@cache
def cases(size: str, part: Part, seed: int, split: str) -> tuple[Chosen, ...]:
    """The cases of a split, clip by clip."""
    listed = clips(size, seed, part)
    offers = _offers(size, part, seed, split)
    if SIZES[size].group:
        return tuple(_grouped(offers, split))
    numbers = _numbers(list(offers), _most(size, part, seed)[split], offers)
    deal = _Deal(split)
    dealt: dict[Clip, list[tuple[str, str]]] = {clip: [] for clip in listed}
    for turn in range(max(numbers.values(), default=0)):
        for clip, number in numbers.items():
            if turn < number:
                dealt[clip].append(deal.best(clip, [p for p in offers[clip] if p not in dealt[clip]]))
    return tuple((clip, *pair) for clip in listed for pair in dealt[clip])


@cache
def case_infos(size: str, part: Part, seed: int, split: str) -> tuple[CaseInfo, ...]:
    """The same, as the data set offers them."""
    return tuple(_info(*chosen, chosen[0].kind) for chosen in cases(size, part, seed, split))


def _grouped(offers: Mapping[Clip, Sequence[tuple[str, str]]], split: str) -> Iterator[Chosen]:
    """All clips of a kind by one pair of bodies that can do them all; kinds that no pair can do are left
    out."""
    deal = _Deal(split)
    by_kind: dict[str, list[Clip]] = {}
    for clip in offers:
        by_kind.setdefault(clip.kind, []).append(clip)
    for group in by_kind.values():
        first, *others = group
        able = [pair for pair in offers[first] if all(pair in offers[clip] for clip in others)]
        if able:
            pair = deal.best(first, able)
            yield from ((clip, *pair) for clip in group)


_AGAIN = 30
"""How much less unlike, in hundredths, a pair counts for each time that it was dealt."""


class _Deal:
    """Pairs given out so far."""

    def __init__(self, split: str) -> None:
        self.split = split
        self.sources: Counter[str] = Counter()
        self.targets: Counter[str] = Counter()
        self.pairs: Counter[tuple[str, str]] = Counter()

    def best(self, clip: Clip, offered: Sequence[tuple[str, str]]) -> tuple[str, str]:
        unlike = unlikeness(clip.family)

        def rank(pair: tuple[str, str]) -> tuple[int, int, int]:
            return (
                self.sources[pair[0]] + self.targets[pair[1]],
                _AGAIN * self.pairs[pair] - unlike[pair],
                _hash(self.split, clip.name, *pair),
            )

        chosen = min(offered, key=rank)
        self.sources[chosen[0]] += 1
        self.targets[chosen[1]] += 1
        self.pairs[chosen] += 1
        return chosen


@cache
def _offers(size: str, part: Part, seed: int, split: str) -> Mapping[Clip, tuple[tuple[str, str], ...]]:
    """Clip -> its possible pairs, of clips that have some."""
    troupes = _troupes(size, part, seed)
    offers = {clip: _pairs(names, split) for clip, names in troupes.items()}
    if part == "validation":
        offers = {
            clip: tuple(p for p in pairs if not set(p).isdisjoint(VALIDATION_BODIES))
            for clip, pairs in offers.items()
        }
    return {clip: offered for clip, offered in offers.items() if offered}


@cache
def _most(size: str, part: Part, seed: int) -> Mapping[str, int]:
    """Number of cases of each split: the size's, or more for every clip to have one, while the sum
    over the splits stays the size's."""
    counts = SIZES[size].cases if part == "test" else SIZES[size].validation
    least = {split: len(_offers(size, part, seed, split)) for split in counts}
    most = {split: max(number, least[split]) for split, number in counts.items()}
    while sum(most.values()) > sum(counts.values()):
        richest = max(
            most, key=lambda split: (most[split] > least[split], most[split] - least[split], split)
        )
        most[richest] -= 1
    return most


def _numbers(listed: Sequence[Clip], most: int, offers: Mapping[Clip, Sequence[object]]) -> dict[Clip, int]:
    """Number of cases of each clip: as many as the others, a third of that where it is long."""
    if most < len(listed):
        return {listed[k * len(listed) // most]: 1 for k in range(most)}
    weights = {clip: 1 if clip.long else 3 for clip in listed}
    total = sum(weights.values())
    numbers = {clip: max(most * weights[clip] // total, 1) for clip in listed}
    for clip in listed:
        numbers[clip] += sum(numbers.values()) < most and not clip.long
    return {clip: min(number, len(offers[clip])) for clip, number in numbers.items()}


@cache
def _troupes(size: str, part: Part, seed: int) -> Mapping[Clip, tuple[str, ...]]:
    """The bodies that perform each clip; those that cannot are left out."""
    used: Counter[str] = Counter()
    troupes = {}
    for clip in clips(size, seed, part):
        bodies = bodies_of(clip.family, part)
        names = [name for name in bodies if name not in unable(clip, bodies)]
        sure = VALIDATION_BODIES if part == "validation" else ()
        chosen = _troupe(clip, names, SIZES[size].troupe, used, sure)
        used.update(chosen)
        troupes[clip] = chosen
    return troupes


def _troupe(
    clip: Clip, names: Sequence[str], most: int, used: Counter[str], sure: Sequence[str]
) -> tuple[str, ...]:
    """Out of every structure its share, and at least two: those who are targets for sure, then those who
    performed least so far."""
    if not most or len(names) <= most:
        return tuple(names)
    by_structure: dict[str, list[str]] = {}
    for name in names:
        by_structure.setdefault(_structure(name), []).append(name)
    chosen = []
    for group in by_structure.values():
        share = max(most * len(group) // len(names), 2)
        chosen += sorted(group, key=lambda name: (name not in sure, used[name], _hash(clip.name, name)))[
            :share
        ]
    return tuple(name for name in names if name in chosen)


@cache
def _pairs(troupe: tuple[str, ...], split: str) -> tuple[tuple[str, str], ...]:
    return tuple((a, b) for a, b in product(troupe, troupe) if _split_of(a, b) == split)


def _split_of(source: str, target: str) -> str:
    if source == target:
        return "self"
    return "intra" if _structure(source) == _structure(target) else "cross"


def _structure(name: str) -> str:
    return everybody()[name].structure.name


@cache
def _hash(*names: str) -> int:
    return int.from_bytes(hashlib.sha256("/".join(names).encode()).digest()[:6], "big")


def performers(size: str, part: Part, seed: int) -> Mapping[Clip, Mapping[str, bool]]:
    """Clip -> the bodies that perform it in any case, and whether they are targets."""
    performed: dict[Clip, dict[str, bool]] = {}
    for split in SIZES[size].cases:
        for clip, source, target in cases(size, part, seed, split):
            bodies = performed.setdefault(clip, {})
            bodies.setdefault(source, False)
            bodies[target] = True
    return performed


_NUMBERS = {"tiny": 26, "default": 390, "large": 390, "kinds": 26}
"""Cases in each direction, at most."""
_SITTING = ("sit", "get_up", "dog_sit", "dog_lie", "shake_paw")
"""Kinds whose performer sits or lies for most of the clip, on the floor or on a seat."""
_STAIRS = ("stairs_up", "stairs_down")
"""Kinds with a floor that is no other family's."""


@cache
def between_legs(size: str, part: Part, seed: int) -> tuple[CaseInfo, ...]:
    """Cases from people to dogs, then from dogs to people, clip by clip."""
    people, dogs = families()
    return (*_one_way(people, dogs, size, part, seed), *_one_way(dogs, people, size, part, seed))


def real_motions(size: str, part: Part, seed: int, structure: str) -> list[CaseInfo]:
    """Every clip by every body of a structure that performs it in a case of the corpus, as a self case."""
    return [
        _info(clip, name, name, clip_action(clip))
        for clip, names in performers(size, part, seed).items()
        if clip.kind not in _STAIRS
        for name in names
        if _structure(name) == structure
    ]


@cache
def clip_action(clip: Clip) -> Action:
    """The main action of a clip, known without solving it."""
    if clip.kind in _SITTING:
        return "sit"
    return "move" if path_speed(clip.score().path, FPS) >= MOVING else "idle"


def _one_way(source: Family, target: Family, size: str, part: Part, seed: int) -> list[CaseInfo]:
    offered = {
        clip: names
        for clip, names in performers(size, part, seed).items()
        if clip.family is source and clip.kind not in _STAIRS
    }
    aims = bodies_of(target, part)
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
    return [_info(clip, *pair, clip_action(clip)) for clip in listed for pair in dealt[clip]]


def _place(turn: int, clips: int, number: int) -> int:
    """Clip whose turn it is: all in order again and again, or some, evenly, where not all have one."""
    return turn % clips if number >= clips else turn * clips // number


def _rank(used: Counter[tuple[str, str]], clip: Clip, pair: tuple[str, str]) -> tuple[int, int]:
    uses = used["source", pair[0]] + used["target", pair[1]]
    return uses, _hash("legs", clip.name, *pair)


def _info(clip: Clip, source: str, target: str, kind: str) -> CaseInfo:
    return CaseInfo(
        id=f"{PREFIX}{source}>{target}/{clip.name}",
        task="retarget",
        split=_split_of(source, target),
        source=source,
        target=target,
        clip=clip.name,
        kind=kind,
        frames=clip.frames,
    )
