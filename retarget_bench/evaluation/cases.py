"""Case lists and cases of data sets, within time limits and with their types checked."""

from collections.abc import Callable, Sequence
from dataclasses import fields
from typing import TypeVar

import numpy as np

from retarget_bench.api import Case, CaseInfo, Dataset, Prediction, Source
from retarget_bench.errors import BenchError
from retarget_bench.evaluation.attempt import Fault, attempt, kind
from retarget_bench.motion.character import Character

T = TypeVar("T")
LISTING = 600.0
"""Seconds in which a data set lists the cases of a split: it may have to look at all its files."""
LOADING, PER_FRAME = 300.0, 1.0
"""Seconds in which it loads a case, and for each of its frames."""
CONTROL = frozenset(map(chr, [*range(32), 127, *range(128, 160)]))
"""Control characters: lines of files and of the terminal are made of them."""


def listed(data: Dataset, task: str, split: str) -> tuple[CaseInfo, ...]:
    """The cases of a split. Raises BenchError where the data set gives no such list."""

    def ask() -> tuple[CaseInfo, ...]:
        answer = data.cases(task, split)
        if not isinstance(answer, Sequence) or isinstance(answer, str):
            raise Fault(f"it gave {kind(answer)} instead of a list")
        infos, ids = tuple(answer), set()
        for info in infos:
            if fault := _info_fault(info):
                raise Fault(fault)
            if info.id in ids:
                raise Fault(f"it lists {info.id!r} twice")
            ids.add(info.id)
        return infos

    return _attempted(data, f"cases({task!r}, {split!r})", ask, LISTING)


def loaded(data: Dataset, info: CaseInfo) -> Case:
    """A case. Raises BenchError where the data set gives none."""

    def ask() -> Case:
        case = data.load(info)
        if fault := _case_fault(case, info):
            raise Fault(fault)
        return case

    return _attempted(data, f"load({info.id!r})", ask, LOADING + PER_FRAME * info.frames)


def _attempted(data: Dataset, call: str, ask: Callable[[], T], seconds: float) -> T:
    name = f"data set {data.card.name}"
    try:
        return attempt(ask, seconds, f"{name}, {call.partition('(')[0]}")
    except Fault as fault:
        raise BenchError(f"{name}: {call} failed: {fault}") from fault


def _info_fault(info: CaseInfo) -> str:
    """The fault of an item of a case list, or ""."""
    if lacking := [each.name for each in fields(CaseInfo) if not hasattr(info, each.name)]:
        return f"it lists {kind(info)} that has no {lacking[0]}"
    texts = (info.id, info.source, info.target, info.clip, info.kind)
    if not info.id or not all(isinstance(each, str) and CONTROL.isdisjoint(each) for each in texts):
        return f"it lists a case whose names are no texts without control characters, {texts!a}"
    if not isinstance(info.frames, int) or info.frames < 0:
        return f"it lists {info.id} with {info.frames!r} frames"
    return ""


def _case_fault(case: Case, info: CaseInfo) -> str:
    """The fault of a case, or ""."""
    if lacking := [each.name for each in fields(Case) if not hasattr(case, each.name)]:
        return f"it gave {kind(case)} that has no {lacking[0]}"
    if case.info.id != info.id:
        return f"it gave the case {case.info.id}"
    if not isinstance(case.target, Character):
        return f"its target is {kind(case.target)}"
    if not isinstance(case.source, Source):
        return f"its source is {kind(case.source)}"
    for name in ("source", "reference", "alternative", "source_motion"):
        motion = getattr(case, name)
        if isinstance(motion, Prediction):
            if not all(np.isfinite(getattr(motion, each)).all() for each in motion.arrays):
                return f"its {name} has numbers that are not finite"
        elif motion is not None and name != "source":
            return f"its {name} is {kind(motion)}"
    return ""
