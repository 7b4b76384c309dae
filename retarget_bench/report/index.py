"""What the page's script knows of the cases: who they are, their numbers, and what went wrong."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from retarget_bench.records import case_file
from retarget_bench.rendering.words import printable
from retarget_bench.report.chapters import Chapter, Split
from retarget_bench.report.charts import Look
from retarget_bench.report.looks import colours
from retarget_bench.report.motions import Motions

MOST = 600_000
"""Numbers in a page; where there would be more, only those of every split's main value are there."""
NOT_STORED = "its prediction is not stored any more"


def index(chapters: Sequence[Chapter], looks: Mapping[str, Look], shown: Motions) -> dict[str, Any]:
    """Plain data for the page: names are as they are printed, and cases and methods known by number."""
    splits = [split for chapter in chapters for split in chapter.splits]
    whole = sum(split.panel.own.size * len(split.labels) * len(split.values) for split in splits) <= MOST
    return {
        "chapters": [
            {
                "title": printable(chapter.title),
                "splits": [_split(split, (c, s), shown, whole) for s, split in enumerate(chapter.splits)],
            }
            for c, chapter in enumerate(chapters)
        ],
        "colours": colours(looks),
        "first": next(([*place] for place in shown.places), None),
    }


def _split(split: Split, at: tuple[int, int], shown: Motions, whole: bool) -> dict[str, Any]:
    values = split.values if whole else split.values[:1]
    return {
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
        "cases": [_case(split, case, (*at, case), shown) for case in range(len(split.panel.cases))],
        "numbers": {value.id: _numbers(split.panel.numbers((value.id, ""))) for value in values},
        "lost": _lost(split, at, shown),
    }


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


def _lost(split: Split, at: tuple[int, int], shown: Motions) -> list[dict[str, str]]:
    """By method: number of a case -> why its answer has no number, or cannot be seen."""
    position = {info.id: number for number, info in enumerate(split.panel.cases)}
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
