"""Source-instance fidelity (SIF) of methods, with floor and ceiling, beside their MPJPE.

    bench run ik pan reference other_clip -d 'puppets[size=kinds]' --metrics position,sif -o runs/sif
    python benchmarks/sif.py runs/sif

Prints a table of every split, and the pairs of methods that SIF tells apart. On Mixamo, whose cases
name no kind, words of the clips' names say it (``WORDS``); --root is where its files lie. Distances,
and the draws of intervals and shuffle tests, are those of ``metrics/sif.py``; blocks are source bodies.
Pairs of methods: the project's paired test over source bodies, for both numbers, adjusted for all
pairs.
"""

from __future__ import annotations

import argparse
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import combinations
from pathlib import Path

import numpy as np

from retarget_bench.analysis import statistics
from retarget_bench.api import Case, CaseInfo, Context, Prediction
from retarget_bench.api.comparison import Comparison
from retarget_bench.errors import BenchError
from retarget_bench.metrics.sif import (
    LEAST,
    LENGTH,
    compared,
    correlation,
    distances,
    order,
    summary,
    to_length,
)
from retarget_bench.plugins import bound, registry
from retarget_bench.plugins.spec import Spec
from retarget_bench.results.store import case_seed, find_results
from retarget_bench.viewer.results_library import StoredResults, read_stored

WORDS = {
    "dancing": "dance",
    "sitting": "sit",
    "walk": "walk",
    "jump": "jump",
    "jumping": "jump",
    "run": "run",
    "running": "run",
    "turn": "turn",
    "to": "",
    "laying": "",
    "idle": "idle",
    "punch": "strike",
    "attack": "strike",
    "reaction": "react",
    "react": "react",
}
"""Word of a Mixamo clip's name -> its kind; the first in this order counts. No kind: from one pose to
another, and idling that lies."""
MPJPE = "mpjpe_h.world"
OTHER, CEILING = "other_clip", "reference"
FLOOR = "other_clip, within the group"
MODES = {"raw": "SIF", "fixed": "SIF, length-matched"}


@dataclass
class Answers:
    """What a method did in the groups of a split, in their order.

    distances: of the answers, by mode. errors: MPJPE, mean over the clips of a group; none of ``FLOOR``.
    """

    distances: dict[str, list[np.ndarray]] = field(default_factory=lambda: {mode: [] for mode in MODES})
    errors: list[float] = field(default_factory=list)


@dataclass(frozen=True)
class Split:
    """blocks: the source body of every group. sources: their distances, by mode. methods: by label."""

    blocks: Sequence[str]
    sources: Mapping[str, Sequence[np.ndarray]]
    methods: Mapping[str, Answers]


def kind_of(info: CaseInfo) -> str:
    """The kind of a case; of Mixamo by the words of the clip's name. "" where it is not known."""
    words = re.findall("[a-z]+", info.clip.lower())
    named = next((kind for word, kind in WORDS.items() if word in words), "")
    return info.kind or (named if info.id.startswith("mixamo/") else "")


def groups_of(infos: Iterable[CaseInfo]) -> list[list[CaseInfo]]:
    """The cases of one kind by one source and one target, where there are enough."""
    groups: dict[tuple[str, str, str], list[CaseInfo]] = {}
    for info in sorted(infos, key=lambda info: info.id):
        if kind := kind_of(info):
            groups.setdefault((kind, info.source, info.target), []).append(info)
    return [group for group in groups.values() if len(group) >= LEAST]


def measured(stored: Sequence[StoredResults], root: str | None) -> Split:
    """The groups of a split that all methods answered. Raises BenchError where there are none."""
    common = set.intersection(
        *({k for k, e in each.entries.items() if e.status == "ok"} for each in stored)
    )
    groups = groups_of(info for case, info in stored[0].cases.items() if case in common)
    if not groups:
        raise BenchError(f"{stored[0].place.root} has no {LEAST} clips of a kind that all methods answered")
    spec = stored[0].dataset if root is None else stored[0].dataset.with_parameters(root=root)
    data = bound.dataset(spec).built
    sources = Answers()
    methods = {label: Answers() for label in (*(each.label for each in stored), FLOOR)}
    for group in groups:
        loaded = [data.load(info) for info in group]
        clips = [compared(Comparison(case, _given(case)))[0] for case in loaded]
        places = order(clips)
        cases = [loaded[place] for place in places]
        _add(sources, [clips[place] for place in places])
        for each in stored:
            answers = [_answer(each, case) for case in cases]
            _add(
                methods[each.label],
                [compared(Comparison(*both))[1] for both in zip(cases, answers, strict=True)],
            )
            methods[each.label].errors.append(float(np.mean([each.values(i.id)[MPJPE] for i in group])))
        floor = _shuffled(cases)
        _add(methods[FLOOR], [compared(Comparison(*both))[1] for both in zip(cases, floor, strict=True)])
    return Split([group[0].source for group in groups], sources.distances, methods)


def _add(answers: Answers, clips: Sequence[np.ndarray]) -> None:
    answers.distances["raw"].append(distances(clips))
    answers.distances["fixed"].append(distances([to_length(clip, LENGTH) for clip in clips]))


def _given(case: Case) -> Prediction:
    if case.reference is None:
        raise BenchError(f"{case.info.id} has no reference")
    return case.reference


def _answer(stored: StoredResults, case: Case) -> Prediction:
    outcome = stored.outcome(case)
    if outcome.prediction is None:
        raise BenchError(f"{stored.label}, {case.info.id}: {outcome.message}")
    return outcome.prediction


def _shuffled(cases: Sequence[Case]) -> list[Prediction]:
    """The control ``other_clip``, which draws from the references of the group."""
    method = registry.create("methods", OTHER)
    answers = []
    for case in cases:
        others = [_given(other) for other in cases if other is not case]
        context = Context(seed=case_seed(0, OTHER, case.info.id), other_clips=others)
        answers.append(method.retarget(case.source, case.target, context=context))
    return answers


# --------------------------------------------------------------------------------------------- printing
def table(split: Split) -> Iterator[str]:
    """Lines of Markdown: the methods, lowest MPJPE first."""
    heads = " | ".join(f"{head} | p" for head in MODES.values())
    yield f"| method | {heads} | variation | MPJPE, % of height |"
    yield "|---|" + "---:|" * (2 * len(MODES) + 2)
    errors = {label: np.mean(each.errors or [np.inf]) for label, each in split.methods.items()}
    for label in sorted(split.methods, key=errors.__getitem__):
        answers, cells = split.methods[label], []
        for mode, sources in split.sources.items():
            of = summary(list(zip(sources, answers.distances[mode], strict=True)), split.blocks)
            cells += [f"{of.mean:.3f} [{of.low:.3f}, {of.high:.3f}]", f"{of.p:.2g}"]
        pairs = zip(split.sources["raw"], answers.distances["raw"], strict=True)
        cells.append(f"{np.median([own.mean() / source.mean() for source, own in pairs]):.2f}")
        yield f"| {label} | {' | '.join([*cells, _error(split, answers)])} |"


def _error(split: Split, answers: Answers) -> str:
    if not answers.errors:
        return ""
    means = over_blocks(answers.errors, split.blocks)
    (interval,) = statistics.mean_intervals(means[None])
    shown = f" [{interval.low:.2f}, {interval.high:.2f}]" if interval else ""
    return f"{means.mean():.2f}{shown}"


def over_blocks(numbers: Sequence[float], blocks: Sequence[str]) -> np.ndarray:
    """``(blocks,)`` means over the groups of each block."""
    places = np.unique(blocks, return_inverse=True)[1]
    return np.asarray(np.bincount(places, numbers) / np.bincount(places))


def apart(split: Split) -> Iterator[str]:
    """Lines on the pairs of methods that SIF tells apart: of them MPJPE's difference, too."""
    if (number := len(set(split.blocks))) < statistics.ENOUGH_CLIPS:
        yield f"{number} source bodies are too few to compare methods.\n"
        return
    labels = [label for label in split.methods if label not in (OTHER, CEILING, FLOOR)]
    pairs = list(combinations(labels, 2))
    numbers: dict[str, dict[str, np.ndarray]] = {"SIF": {}, "MPJPE": {}}
    for label in labels:
        answers = split.methods[label]
        both = list(zip(split.sources["raw"], answers.distances["raw"], strict=True))
        numbers["SIF"][label] = over_blocks([_value(*each) for each in both], split.blocks)
        numbers["MPJPE"][label] = over_blocks(answers.errors, split.blocks)
    differences = {name: np.array([of[a] - of[b] for a, b in pairs]) for name, of in numbers.items()}
    p = {name: statistics.step_down(rows) for name, rows in differences.items()}
    told = {name: rows < statistics.ALPHA for name, rows in p.items()}
    only = told["SIF"] & ~told["MPJPE"]
    counts = f"SIF tells {told['SIF'].sum()} apart and MPJPE {told['MPJPE'].sum()}"
    yield f"Of {len(pairs)} pairs of methods, {counts}; SIF alone: {only.sum()}."
    for k in np.flatnonzero(told["SIF"]):
        shown = (f"{name} {of[k].mean():+.3f} ({_p(p[name][k])})" for name, of in differences.items())
        yield f"- {pairs[k][0]} minus {pairs[k][1]}: {', '.join(shown)}"
    yield ""


def _p(p: float) -> str:
    return "p < 0.0001" if p < 1e-4 else f"p {p:.2g}"


def _value(sources: np.ndarray, answers: np.ndarray) -> float:
    return float(correlation(sources, answers))


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("results", type=Path, help="folder of results, with predictions")
    parser.add_argument("--root", metavar="DIR", help="where the files of the data set lie")
    options = parser.parse_args()
    splits: dict[tuple[Spec, str], list[StoredResults]] = {}
    for place in find_results(options.results):
        stored = read_stored(place)
        splits.setdefault((stored.dataset, place.split), []).append(stored)
    if not splits:
        parser.error(f"{options.results} holds no results; bench run makes them")
    for (dataset, name), each in splits.items():
        try:
            split = measured(each, options.root)
        except BenchError as error:
            parser.error(str(error))
        print(f"## {dataset}, {name}\n")
        print(f"{len(split.blocks)} groups, {len(set(split.blocks))} source bodies.\n")
        print("\n".join([*table(split), "", *apart(split)]))


if __name__ == "__main__":
    main()
