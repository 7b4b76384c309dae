"""The order of methods, by rank in the tables; it decides their colours everywhere."""

import math
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from retarget_bench.analysis import selection, statistics
from retarget_bench.analysis.summary import Mean, SplitSummary, split_summary
from retarget_bench.api import TASKS
from retarget_bench.figures import palette
from retarget_bench.results import dataset_names, result_matrix, store
from retarget_bench.results.header import DeclaredValue, ResultHeader
from retarget_bench.results.result_matrix import ResultMatrix
from retarget_bench.results.store import ResultPaths
from retarget_bench.tables import builder, requested
from retarget_bench.tables.cells import FPS


def ranked(places: Iterable[ResultPaths]) -> dict[str, ResultHeader]:
    """Label -> a header of its results: by rank in the first table (of retargeting, where there is one),
    then those that only later tables have."""
    headers_of: dict[str, ResultHeader] = {}
    for group in apart(places):
        panels = selection.of_bodies(result_matrix.result_matrices(group))
        mains = {
            each.split: main for each in panels if (main := main_value(each, group[0].task)) is not None
        }
        sections = [
            split_summary(each.narrowed(mains[each.split])) for each in panels if each.split in mains
        ]
        headers = {row.label: row.header for each in reversed(panels) for row in reversed(each.rows)}
        for label in dict.fromkeys([*order(sections, mains), *sorted(headers)]):
            headers_of.setdefault(label, headers[label])
    return headers_of


def everything(roots: Iterable[Path]) -> list[ResultPaths]:
    """All results under some folders, of every task, from which ranks, and so colours, are made."""
    return [place for root in roots for task in TASKS for place in store.find_results(root, task)]


def styles(
    ranked: Mapping[str, ResultHeader], named: Collection[str] = (), *, variants: bool = False
) -> dict[str, palette.MethodStyle]:
    """Label -> its style, the same in reports and files. Methods have colours of their own; controls, and
    variants of methods, are grey, come last, and charts show them only where they are asked for.

    ranked: label -> a header of its results, in the order of ``ranked``. named, variants: labels that are
    asked for, and whether variants are.
    """
    group = {
        label: 2 if selection.is_variant(header.method, ranked) else int(header.method.control)
        for label, header in ranked.items()
    }
    styles_of: dict[str, palette.MethodStyle] = {}
    counts = {False: 0, True: 0}
    for label in sorted(ranked, key=group.__getitem__):
        grey, privileged = group[label] > 0, bool(ranked[label].method.privileged)
        style = palette.method_style(counts[grey], quiet=grey, privileged=privileged)
        asked = label in named or (variants and group[label] == 2)
        styles_of[label] = replace(style, quiet=grey and not asked)
        counts[grey] += 1
    return styles_of


def colours(ranked: Mapping[str, ResultHeader]) -> dict[str, str]:
    """Label -> ``#rrggbb``, the same in reports, plots, clips and live."""
    return {label: style.colour for label, style in styles(ranked).items()}


def apart(places: Iterable[ResultPaths]) -> list[list[ResultPaths]]:
    """Places by task, retargeting first, and by what tables call the data set."""
    groups: dict[tuple[int, str, str], list[ResultPaths]] = {}
    for place, name in dataset_names.shown(dataset_names.headers(places)).items():
        rank = TASKS.index(place.kind)
        groups.setdefault((rank, place.task, name), []).append(place)
    return [groups[key] for key in sorted(groups)]


def of_methods(places: Sequence[ResultPaths], names: Sequence[str]) -> list[ResultPaths]:
    """The results of these methods, in the order of the names. Raises BenchError for an unknown one."""
    label_of = labels(places)
    chosen: list[ResultPaths] = []
    for name in names:
        label = selection.label_of(name, set(label_of.values()))
        if label is None:
            raise selection.unknown(label_of.values(), name)
        chosen += [place for place in places if label_of[place] == label and place not in chosen]
    return chosen


def labels(places: Iterable[ResultPaths]) -> dict[ResultPaths, str]:
    """Results -> the label of their method."""
    return {place: store.read_header(place.any_header).method.shown for place in places}


def order(sections: Sequence[SplitSummary], main: Mapping[str, str]) -> list[str]:
    """Labels as a table of all splits has them: as its first split ranks them, then the next; those that no
    split ranks by their means.

    main: split -> the value that they are ranked by.
    """
    labels = sorted({score.label for each in sections for score in each.scores})
    places: dict[str, list[float]] = {label: [] for label in labels}
    means: dict[str, list[float]] = {label: [] for label in labels}
    for each in builder.in_order(sections):
        key = main.get(each.split, "")
        ranked = each.rankings[key].order if key in each.rankings else ()
        losses = {s.label: _loss(s.means[key], each.values[key]) for s in each.scores if key in s.means}
        for label in labels:
            places[label].append(ranked.index(label) if label in ranked else math.inf)
            means[label].append(losses.get(label, math.inf))
    return sorted(labels, key=lambda label: (*places[label], *means[label]))


def _loss(mean: Mean, declared: DeclaredValue) -> float:
    return float(statistics.losses(np.array(mean.value), declared.better, declared.goal))


def main_value(matrix: ResultMatrix, task: str) -> str | None:
    """The first column of the tables of a split; None where no case has any of the usual ones."""
    first = requested.TASK_COLUMNS.get(task.split("-")[0], ())
    present = {value for value, _ in matrix.keys}
    columns = (builder.stand_in(key, present) for key in (*first, *builder.DEFAULT_COLUMNS) if key != FPS)
    return next((key for key in columns if key is not None), None)
