"""Batches of cases for methods that take several at once."""

from collections.abc import Mapping, Sequence
from itertools import groupby

from retarget_bench.api import CaseInfo
from retarget_bench.motion.character import Character

CASES = 16
"""The most cases of a batch."""
FRAMES = 28_800
"""The most frames of a batch with all clips as long as its longest: 16 of a minute at 30 per second."""
RULE = {"cases": CASES, "frames": FRAMES}
"""Part of what such a method's predictions are known by: in other batches they round otherwise."""


def batches(infos: Sequence[CaseInfo], cast: Mapping[str, Character]) -> list[tuple[str, ...]]:
    """The ids of all cases of a split, in batches of one pair of structures and of similar lengths.

    They depend on the full list alone, never on what is missing, so that a run that was interrupted asks
    the same questions again. A clip of more than ``FRAMES`` frames is a batch of its own.
    """
    structure = {name: body.structure for name, body in cast.items()}

    def structures(info: CaseInfo) -> tuple[str, str]:
        return structure.get(info.source, ""), structure.get(info.target, "")

    ordered = sorted(infos, key=lambda info: (structures(info), info.frames))
    found: list[list[str]] = []
    for _, alike in groupby(ordered, key=structures):
        found.append([])
        for info in alike:
            last = len(found[-1])
            if last and (last == CASES or (last + 1) * info.frames > FRAMES):
                found.append([])
            found[-1].append(info.id)
    return [tuple(batch) for batch in found]
