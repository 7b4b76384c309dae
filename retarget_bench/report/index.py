"""The data of cases for the page's script: names, numbers and failures."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from retarget_bench.analysis import ranking, statistics, summary
from retarget_bench.errors import printable
from retarget_bench.figures.palette import MethodStyle
from retarget_bench.report.chapters import Chapter, Split
from retarget_bench.report.motions import PackedScenes
from retarget_bench.results.store import case_file
from retarget_bench.tables.model import Column
from retarget_bench.viewer import player

PAGE = 12_000_000
"""Bytes that a page is to stay below."""
REST, LEAST = 1_000_000, 800_000
"""Of those, what tables, charts and scripts are given; and what the list of cases has at least."""


@dataclass(frozen=True)
class Thinning:
    """Numbers and cases left out. few: of values other than a split's main one, all numbers but those of so
    many worst cases of every method; worst: cases that are not among so many worst ones of any method by
    the main value. None: nothing is."""

    few: int | None = None
    worst: int | None = None


STEPS = (
    Thinning(),
    Thinning(50),
    Thinning(15),
    *(Thinning(5, worst) for worst in (500, 150, 50, 15, 5)),
    Thinning(1, 5),
)
"""From nothing to the most that is left out."""
OF_EACH = frozenset(["kind", "level", "structure"])
"""Of what groups of cases a case is listed in any event."""
MOST_SEEN = 8
"""Methods that are seen at once without being asked for."""
NOT_STORED = "its prediction is not stored any more"


def index(
    chapters: Sequence[Chapter], styles: Mapping[str, MethodStyle], shown: PackedScenes
) -> tuple[dict[str, Any], str]:
    """The cases with their names and numbers, as many as leave the page smaller than ``PAGE``; and a
    sentence about what was left out ("" for nothing).

    Names are as they are printed, and cases and methods known by number.
    """
    room = max(LEAST, PAGE - REST - sum(len(text.encode()) for text in shown.scenes))
    for step in STEPS:
        listed = _data(chapters, styles, shown, step)
        if len(player.data(listed).encode()) <= room:
            break
    return listed, _thinned(chapters, step)


def _thinned(chapters: Sequence[Chapter], step: Thinning) -> str:
    if step.few is None:
        return ""
    mains = ", ".join(dict.fromkeys(split.main.label for each in chapters for split in each.splits))
    text = (
        f"There are so many cases that all their numbers are here of one value alone ({mains}), and of "
        f"others those of {_worst(step.few)} of every method."
    )
    if step.worst is None:
        return text
    return f"{text} Only {_worst(step.worst)} of every method are listed, those, and those in motion."


def _worst(few: int) -> str:
    return "the worst case" if few == 1 else f"the {few} worst cases"


def _data(
    chapters: Sequence[Chapter], styles: Mapping[str, MethodStyle], shown: PackedScenes, step: Thinning
) -> dict[str, Any]:
    return {
        "chapters": [
            {
                "title": printable(chapter.title),
                "splits": [_split(split, (c, s), shown, step) for s, split in enumerate(chapter.splits)],
            }
            for c, chapter in enumerate(chapters)
        ],
        "colours": {label: style.colour for label, style in styles.items()},
        "first": _first(shown),
    }


def _first(shown: PackedScenes) -> list[int] | None:
    """The liveliest case of the first split that can be seen."""
    if not shown.places:
        return None
    chapter, split, _ = next(iter(shown.places))
    return [
        *max(
            (place for place in shown.places if place[:2] == (chapter, split)), key=shown.lively.__getitem__
        )
    ]


def _seen_first(split: Split) -> list[int]:
    """Numbers of the methods that are seen without being asked for: no controls."""
    methods = (row.header.method for row in split.matrix.rows)
    return [number for number, each in enumerate(methods) if not ranking.never_ranked(each)][:MOST_SEEN]


def _split(split: Split, at: tuple[int, int], shown: PackedScenes, step: Thinning) -> dict[str, Any]:
    values = split.values if step.few is None else split.values[:1]
    few = {value.id: _few(split, value, step.few) for value in split.values if value not in values}
    cases = _shown_cases(split, at, shown, few, step.worst)
    entry = {
        "name": split.name,
        "labels": split.labels,
        "methods": [printable(label) for label in split.labels],
        "values": [_value(split, value, cases) for value in split.values],
        "cases": [_case(split, case, (*at, case), shown) for case in cases],
        "numbers": {
            value.id: [
                [None if np.isnan(each) else _four(each) for each in row[cases]]
                for row in split.matrix.numbers((value.id, ""))
            ]
            for value in values
        },
        "lost": _lost(split, at, shown, cases),
        "seen": _seen_first(split),
        "paired": all(row.header.four_legged is None for row in split.matrix.rows),
    }
    entry |= {"few": few} if few else {}
    return entry if step.worst is None else entry | {"kept": cases}


def _value(split: Split, value: Column, cases: Sequence[int]) -> dict[str, Any]:
    """``among``: methods whose means are over common cases alone; ``alone``: cases that are not common."""
    _, common, among, _ = summary.common_numbers(split.matrix, value.id)
    return {
        "id": value.id,
        "label": value.label,
        "unit": "" if value.unit == "1" else value.unit,
        "better": value.better,
        "goal": value.goal,
        "decimals": split.decimals.get(value.id, 2),
        "among": np.flatnonzero(among).tolist(),
        "alone": [case for case in cases if not common[case]] if among.any() else [],
    }


def _few(split: Split, value: Column, most: int | None) -> list[dict[int, float]]:
    """By method: the worst cases and their numbers."""
    numbers = split.matrix.numbers((value.id, ""))
    losses = statistics.losses(numbers, value.better, value.goal)
    return [
        {case: _four(row[case]) for case in _worst_of(loss, most)}
        for row, loss in zip(numbers, losses, strict=True)
    ]


def _worst_of(loss: np.ndarray, most: int | None) -> list[int]:
    """The numbers of the worst cases, those that have one, worst first."""
    present = np.flatnonzero(~np.isnan(loss))
    return [int(case) for case in present[np.argsort(-loss[present], kind="stable")[:most]]]


def _shown_cases(
    split: Split,
    at: tuple[int, int],
    shown: PackedScenes,
    few: Mapping[str, Sequence[Mapping[int, float]]],
    worst: int | None,
) -> list[int]:
    """Numbers of the cases that are listed: all, or the worst of every method, those in motion, those
    that other values are worst on, and one of every kind, level and structure."""
    if worst is None:
        return list(range(len(split.matrix.cases)))
    cases = {case for c, s, case in (*shown.places, *shown.reasons) if (c, s) == at}
    cases.update(case for rows in few.values() for row in rows for case in row)
    for loss in split.losses:
        cases.update(_worst_of(loss, worst))
    for by in OF_EACH & split.groups.keys():
        first = {name: case for case, name in reversed([*enumerate(split.groups[by])])}
        cases.update(first.values())
    return sorted(cases)


def _case(split: Split, case: int, key: tuple[int, int, int], shown: PackedScenes) -> dict[str, Any]:
    info = split.matrix.cases[case]
    entry: dict[str, Any] = {
        "id": printable(info.id),
        "source": printable(info.source),
        "target": printable(info.target),
        "scene": shown.places.get(key, -1),
    }
    entry |= {by: printable(names[case]) for by, names in split.groups.items()}
    if key in shown.reasons:
        entry["reason"] = printable(shown.reasons[key])
    return entry


def _four(number: float) -> float:
    return float(f"{number:.4g}")


def _lost(
    split: Split, at: tuple[int, int], shown: PackedScenes, cases: Sequence[int]
) -> list[dict[str, str]]:
    """By method: number of a case -> why its answer has no number, or cannot be seen."""
    position = {split.matrix.cases[number].id: number for number in cases}
    reasons: list[dict[str, str]] = []
    for row in split.matrix.rows:
        reasons_of_method: dict[str, str] = {}
        for problem in row.header.problems:
            why = printable(f"{problem.status}: {problem.message}")
            reasons_of_method |= {str(position[case]): why for case in problem.cases if case in position}
        folder = row.paths.folder / row.paths.method
        stored = {path.name for path in folder.iterdir()} if folder.is_dir() else set()
        for case, number in position.items():
            if f"{case_file(case)}.npz" not in stored:
                reasons_of_method.setdefault(str(number), NOT_STORED)
        reasons.append(reasons_of_method)
    for (c, s, number), answers in shown.failures.items():
        if (c, s) == at:
            for label, status, message in answers:
                reasons[split.labels.index(label)][str(number)] = printable(f"{status}: {message}")
    return reasons
