"""Batches of cases, in which methods are asked."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import groupby

from retarget_bench.api import CaseInfo
from retarget_bench.motion.character import Character

CASES = 16
"""The most cases of a batch."""
FRAMES = 28_800
"""The most frames of a batch with all clips as long as its longest: 16 of a minute at 30 per second."""
RULE = {"cases": CASES, "frames": FRAMES, "apart": True}
"""Part of what such a method's predictions are known by: in other batches they round otherwise."""


def batches(infos: Sequence[CaseInfo], cast: Mapping[str, Character]) -> list[tuple[str, ...]]:
    """The ids of all cases of a split, in batches of one pair of structures and of similar lengths.

    They depend on the full list alone, never on what is missing, so that a run that was interrupted asks
    the same questions again. A clip of more than ``FRAMES`` frames is a batch of its own. No batch shows
    as a source what another of its cases asks for, the target performing the clip: that may be the right
    answer.
    """
    structure = {name: body.structure for name, body in cast.items()}

    def structures(info: CaseInfo) -> tuple[str, str]:
        return structure.get(info.source, ""), structure.get(info.target, "")

    ordered = sorted(infos, key=lambda info: (structures(info), info.frames))
    made: list[_Batch] = []
    for _, alike in groupby(ordered, key=structures):
        open_ones: list[_Batch] = []
        for info in alike:
            open_ones = [each for each in open_ones if each.has_room(info)]
            batch = next((each for each in open_ones if each.takes(info)), None)
            if batch is None:
                batch = _Batch()
                open_ones.append(batch)
                made.append(batch)
            batch.add(info)
    return [tuple(batch.cases) for batch in made]


@dataclass
class _Batch:
    """Cases in order of their lengths; sources, targets: bodies and clips that are shown, and
    that are asked for."""

    cases: list[str] = field(default_factory=list)
    sources: set[tuple[str, str]] = field(default_factory=set)
    targets: set[tuple[str, str]] = field(default_factory=set)

    def has_room(self, info: CaseInfo) -> bool:
        count = len(self.cases)
        return not count or (count < CASES and (count + 1) * info.frames <= FRAMES)

    def takes(self, info: CaseInfo) -> bool:
        return (info.source, info.clip) not in self.targets and (info.target, info.clip) not in self.sources

    def add(self, info: CaseInfo) -> None:
        self.cases.append(info.id)
        if info.source != info.target:
            self.sources.add((info.source, info.clip))
            self.targets.add((info.target, info.clip))
