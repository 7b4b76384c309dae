"""The data of cases for the page's script: names, numbers and failures."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from retarget_bench.analysis import ranking, statistics, summary
from retarget_bench.errors import printable
from retarget_bench.figures.palette import MethodStyle
from retarget_bench.report.chapters import Chapter, Split
from retarget_bench.report.motions import PackedScenes
from retarget_bench.results.store import case_file
from retarget_bench.tables.finding import RECALL
from retarget_bench.tables.model import Column

LISTED = 300
"""Cases of a split that a page lists, at most."""
OF_EACH = frozenset(["kind", "level", "structure"])
"""Of what groups of cases a case is listed in any event."""
MOST_SEEN = 8
"""Methods that are seen at once without being asked for."""
CALM = 0.5
"""Weight of liveliness beside each difference of two answers, in the choice of the first case."""
NOT_STORED = "its prediction is not stored any more"


def index(
    chapters: Sequence[Chapter], styles: Mapping[str, MethodStyle], shown: PackedScenes
) -> dict[str, Any]:
    """The cases with their names and numbers, of a split at most about ``LISTED``.

    Names are as they are printed, and cases and methods known by number.
    """
    return {
        "chapters": [
            {
                "title": printable(chapter.title),
                "splits": [_split(split, (c, s), shown) for s, split in enumerate(chapter.splits)],
            }
            for c, chapter in enumerate(chapters)
        ],
        "colours": {label: style.colour for label, style in styles.items()},
        "first": _first(chapters, shown),
    }


def left_out(chapters: Sequence[Chapter]) -> str:
    """A sentence about cases that are not listed; "" for none."""
    long = [split for chapter in chapters for split in chapter.splits if len(split.matrix.cases) > LISTED]
    if not long:
        return ""
    mains = ", ".join(dict.fromkeys(split.main.label for split in long))
    return f"Of splits with more than {LISTED} cases the worst of every method by {mains} are listed."


def _first(chapters: Sequence[Chapter], shown: PackedScenes) -> dict[str, list[int]] | None:
    """A case of the first split that can be seen, and two methods whose answers to it look most different:
    the best one, and one whose feet lose their contacts and whose joints are farther off; in a lively
    case rather than in one that rests."""
    if not shown.places:
        return None
    chapter, at, _ = next(iter(shown.places))
    split = chapters[chapter].splits[at]
    cases = [case for c, s, case in shown.places if (c, s) == (chapter, at)]
    methods = _seen_first(split)
    order = getattr(split.section.rankings.get(split.main.id), "order", ())
    best = split.labels.index(order[0]) if order else next(iter(methods), 0)
    lively = np.array([shown.lively[chapter, at, case] for case in cases])
    score = np.zeros((len(split.labels), len(cases)))
    for value in split.values:
        if value in (split.main, _contacts(split)):
            losses = statistics.losses(split.matrix.numbers((value.id, "")), value.better, value.goal)[
                :, cases
            ]
            worse = np.nan_to_num(losses - losses[best], nan=0.0, posinf=0.0, neginf=0.0)
            score += worse / max(worse[methods].max(initial=0.0), 1e-9)
    score += CALM * lively / max(lively.max(), 1e-9)
    others = [method for method in methods if method != best] or [best]
    method, case = np.unravel_index(score[others].argmax(), (len(others), len(cases)))
    return {"case": [chapter, at, cases[case]], "methods": [*dict.fromkeys((best, others[method]))]}


def _contacts(split: Split) -> Column | None:
    """The share of contacts that is kept, where the tables of a split have it."""
    return next((value for value in split.values if value.id == RECALL), None)


def _seen_first(split: Split) -> list[int]:
    """Numbers of the methods that are seen without being asked for: no controls."""
    methods = (row.header.method for row in split.matrix.rows)
    return [number for number, each in enumerate(methods) if not ranking.never_ranked(each)][:MOST_SEEN]


def _split(split: Split, at: tuple[int, int], shown: PackedScenes) -> dict[str, Any]:
    cases = _listed(split, at, shown)
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
            for value in split.values
        },
        "lost": _lost(split, at, shown, cases),
        "seen": _seen_first(split),
        "paired": all(row.header.four_legged is None for row in split.matrix.rows),
    }
    return entry if len(cases) == len(split.matrix.cases) else entry | {"kept": cases}


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


def _listed(split: Split, at: tuple[int, int], shown: PackedScenes) -> list[int]:
    """Numbers of the cases that are listed: all, or those in motion, one of every kind, level and
    structure, and the worst of every method by the main value, in turn."""
    if len(split.matrix.cases) <= LISTED:
        return list(range(len(split.matrix.cases)))
    cases = {case for c, s, case in (*shown.places, *shown.reasons) if (c, s) == at}
    for by in OF_EACH & split.groups.keys():
        first = {name: case for case, name in reversed([*enumerate(split.groups[by])])}
        cases.update(first.values())
    for place in np.argsort(-np.nan_to_num(split.losses, nan=-np.inf), axis=1, kind="stable").T.tolist():
        if len(cases) >= LISTED:
            break
        cases.update(place)
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
