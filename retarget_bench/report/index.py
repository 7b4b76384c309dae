"""What the page's script knows of the cases: who they are, their numbers, and what went wrong."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from retarget_bench.records import case_file
from retarget_bench.rendering.words import printable
from retarget_bench.report.chapters import Chapter, Split
from retarget_bench.report.charts import Look
from retarget_bench.report.looks import colours
from retarget_bench.report.motions import Motions
from retarget_bench.viewing import player

PAGE = 12_000_000
"""Bytes that a page is to stay below."""
REST, LEAST = 1_000_000, 800_000
"""Of those, what tables, charts and scripts are given; and what the list of cases has at least."""
STEPS: tuple[tuple[bool, int | None], ...] = (
    (True, None), (False, None), (False, 500), (False, 150), (False, 50), (False, 15), (False, 5),
)  # fmt: skip
"""What is left out first: all values but every split's main one, then all but the worst cases by it."""
NOT_STORED = "its prediction is not stored any more"


@dataclass(frozen=True)
class Listed:
    """What the page knows of cases, plain, and what was left out of it, in a sentence ("" for nothing)."""

    data: dict[str, Any]
    thinned: str = ""


def index(chapters: Sequence[Chapter], looks: Mapping[str, Look], shown: Motions) -> Listed:
    """The cases with their names and numbers, as many as leave the page smaller than ``PAGE``.

    Names are as they are printed, and cases and methods known by number.
    """
    room = max(LEAST, PAGE - REST - sum(len(text.encode()) for text in shown.scenes))
    made = Listed({})
    for whole, worst in STEPS:
        made = Listed(_data(chapters, looks, shown, whole, worst), _thinned(chapters, whole, worst))
        if len(player.data(made.data).encode()) <= room:
            break
    return made


def _thinned(chapters: Sequence[Chapter], whole: bool, worst: int | None) -> str:
    if whole:
        return ""
    mains = ", ".join(dict.fromkeys(split.main.label for each in chapters for split in each.splits))
    said = f"There are so many cases that their numbers are here of one value alone ({mains})."
    only = f" Only the {worst} worst cases of every method are listed, and those in motion."
    return said + only if worst else said


def _data(
    chapters: Sequence[Chapter], looks: Mapping[str, Look], shown: Motions, whole: bool, worst: int | None
) -> dict[str, Any]:
    return {
        "chapters": [
            {
                "title": printable(chapter.title),
                "splits": [
                    _split(split, (c, s), shown, whole, worst) for s, split in enumerate(chapter.splits)
                ],
            }
            for c, chapter in enumerate(chapters)
        ],
        "colours": colours(looks),
        "first": next(([*place] for place in shown.places), None),
    }


def _split(
    split: Split, at: tuple[int, int], shown: Motions, whole: bool, worst: int | None
) -> dict[str, Any]:
    values = split.values if whole else split.values[:1]
    kept = _kept(split, at, shown, worst)
    told = {
        "name": split.name,
        "labels": split.labels,
        "methods": [printable(label) for label in split.labels],
        "values": [
            {
                "id": value.id,
                "label": value.label,
                "unit": "" if value.unit == "1" else value.unit,
                "better": value.better,
                "goal": value.goal,
                "decimals": split.decimals.get(value.id, 2),
            }
            for value in values
        ],
        "cases": [_case(split, case, (*at, case), shown) for case in kept],
        "numbers": {value.id: _numbers(split.panel.numbers((value.id, ""))[:, kept]) for value in values},
        "lost": _lost(split, at, shown, kept),
    }
    return told if worst is None else told | {"kept": kept}


def _kept(split: Split, at: tuple[int, int], shown: Motions, worst: int | None) -> list[int]:
    """Numbers of the cases that are listed: all, or the worst of every method and those in motion."""
    if worst is None:
        return list(range(len(split.panel.cases)))
    found = {case for c, s, case in (*shown.places, *shown.reasons) if (c, s) == at}
    for loss in split.losses:
        known = np.flatnonzero(~np.isnan(loss))
        found |= set(known[np.argsort(-loss[known], kind="stable")[:worst]].tolist())
    return sorted(found)


def _case(split: Split, case: int, key: tuple[int, int, int], shown: Motions) -> dict[str, Any]:
    info = split.panel.cases[case]
    told: dict[str, Any] = {
        "id": printable(info.id),
        "source": printable(info.source),
        "target": printable(info.target),
        "scene": shown.places.get(key, -1),
    }
    told |= {by: printable(names[case]) for by, names in split.groups.items()}
    if key in shown.reasons:
        told["reason"] = printable(shown.reasons[key])
    return told


def _numbers(numbers: np.ndarray) -> list[list[float | None]]:
    return [[None if np.isnan(each) else float(f"{each:.4g}") for each in row] for row in numbers]


def _lost(split: Split, at: tuple[int, int], shown: Motions, kept: Sequence[int]) -> list[dict[str, str]]:
    """By method: number of a case -> why its answer has no number, or cannot be seen."""
    position = {split.panel.cases[number].id: number for number in kept}
    found: list[dict[str, str]] = []
    for row in split.panel.rows:
        mine: dict[str, str] = {}
        for problem in row.header["problems"]:
            why = printable(f"{problem['status']}: {problem['message']}")
            mine |= {str(position[case]): why for case in problem["cases"] if case in position}
        folder = row.place.folder / row.place.method
        stored = {path.name for path in folder.iterdir()} if folder.is_dir() else set()
        for case, number in position.items():
            if f"{case_file(case)}.npz" not in stored:
                mine.setdefault(str(number), NOT_STORED)
        found.append(mine)
    for (c, s, number), answers in shown.gone.items():
        if (c, s) == at:
            for label, status, message in answers:
                found[split.labels.index(label)][str(number)] = printable(f"{status}: {message}")
    return found
