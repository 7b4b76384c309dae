"""Which bodies cannot do which clip: they are left out of it and listed, never shown failing.

A body is too short in the arm, or too thick, to put a hand where a performance wants it. That is found by
solving, which takes too long for merely listing cases; so what was found for the published corpus is kept
in ``exclusions.json``. Whoever changes the generator runs ``tests/datasets/freeze_puppets.py``.
"""

from __future__ import annotations

import json
import multiprocessing
from collections.abc import Iterator, Mapping
from functools import cache
from pathlib import Path

from .clips import SIZES, Clip, clips, training_clips
from .families import families
from .parts import bodies

FILE = Path(__file__).with_name("exclusions.json")


def unable(clip: Clip, names: tuple[str, ...]) -> Mapping[str, float]:
    """Body -> metres by which it falls short, of those among ``names`` that cannot do the clip."""
    if clip.seed == 0:
        return {name: gap for name, gap in _published().get(clip.name, {}).items() if name in names}
    return found(clip, names)


@cache
def found(clip: Clip, names: tuple[str, ...]) -> Mapping[str, float]:
    """What solving the clip for these bodies shows."""
    score, family = clip.score(), clip.family
    if score.stairs is None and not any(hand.touches or hand.plants for hand in score.hands.values()):
        return {}
    short = {}
    for name in names:
        body = family.bodies[name]
        gaps = family.short_of(score, body, family.solve(score, body))
        if gaps:
            short[name] = max(gaps.values())
    return short


@cache
def _published() -> Mapping[str, Mapping[str, float]]:
    table: Mapping[str, Mapping[str, float]] = json.loads(FILE.read_text(encoding="utf-8"))
    return table


def asked() -> Iterator[tuple[Clip, tuple[str, ...]]]:
    """Every clip of the published corpus, with the bodies that might perform it."""
    for size in ("tiny", "default"):
        for part in ("test", "validation"):
            for clip in clips(size, 0, part):
                yield clip, bodies(clip.family, part)
    for size in SIZES:
        for family in families():
            for body in bodies(family, "train"):
                for clip in training_clips(size, body, 0):
                    yield clip, (body,)


def write(processes: int = 2) -> None:
    """Find out anew who cannot do what in the published corpus."""
    jobs = list(asked())
    with multiprocessing.get_context("spawn").Pool(processes) as pool:
        outcomes = pool.starmap(found, jobs, chunksize=50)
    table = {clip.name: short for (clip, _), short in zip(jobs, outcomes, strict=True) if short}
    rounded = {
        clip: {name: round(gap, 3) for name, gap in sorted(short.items())}
        for clip, short in sorted(table.items())
    }
    rows = ",\n".join(f"  {json.dumps(clip)}: {json.dumps(short)}" for clip, short in rounded.items())
    FILE.write_text(f"{{\n{rows}\n}}\n" if rows else "{}\n", encoding="utf-8")
