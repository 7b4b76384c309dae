"""Methods on a few cases: which cases, and everything from the question to the mean that a table shows."""

import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

from retarget_bench.analysis import summary
from retarget_bench.api import CaseInfo, Dataset, Method, optional
from retarget_bench.errors import BenchError
from retarget_bench.evaluation import plan as plans
from retarget_bench.evaluation import predict as stage_one
from retarget_bench.evaluation.header_builder import header_of
from retarget_bench.evaluation.plan import EvaluationUnit, Plan
from retarget_bench.evaluation.score import declared_values, score
from retarget_bench.files import digest
from retarget_bench.plugins import registry
from retarget_bench.plugins.spec import Spec
from retarget_bench.results import store
from retarget_bench.results.store import CaseResult
from retarget_bench.verification.gate.table import Table, flat, without_arrays

TASK = "retarget"
CASES = 5
"""Cases of each split. Their structures, bodies and kinds of performance differ as far as they can."""
STRUCTURES, OTHERS = 10, 1
"""What a structure, and what a body or a kind that no chosen case has yet, is worth in the choice."""
MEAN = "mean"


@dataclass(frozen=True)
class SmokeCases:
    """The cases of a check: split -> cases, and what is known of the data set."""

    spec: Spec
    infos: Mapping[str, Sequence[CaseInfo]]
    facts: dict[str, Any]

    def __iter__(self) -> Iterator[tuple[str, Sequence[CaseInfo]]]:
        return iter(self.infos.items())


@dataclass
class Answers:
    """One method: rows, and why rows are missing."""

    table: Table = field(default_factory=dict)
    problems: dict[str, str] = field(default_factory=dict)


# ---------------------------------------------------------------------------------------------- cases
def prepare(spec: Spec, wanted: Mapping[str, Sequence[str]] | None, missing: list[str]) -> SmokeCases:
    """The wanted cases, or those chosen by rule; wanted ones that the data set lacks are missing."""
    data = plans.dataset(spec)
    listed = {split: data.cases(TASK, split) for split in data.card.splits}
    facts = {
        "spec": str(Spec(spec.name, plans.without_location(spec))),
        "name": spec.name,
        "parameters": plans.without_location(registry.canonical("datasets", spec)),
        "content": data.content,
        "lists": {split: _list_facts(infos) for split, infos in listed.items()},
    }
    if wanted is None:
        return SmokeCases(spec, {split: choose(data, infos) for split, infos in listed.items()}, facts)
    found = {}
    for split, ids in wanted.items():
        known = {info.id: info for info in listed.get(split, ())}
        if lost := [case for case in ids if case not in known]:
            missing.append(f"{spec} has no longer {len(lost)} of the cases of {split}, {lost[0]} first")
        found[split] = [known[case] for case in ids if case in known]
    return SmokeCases(spec, found, facts)


def _list_facts(infos: Sequence[CaseInfo]) -> dict[str, Any]:
    return {"cases": len(infos), "hash": digest("\n".join(info.id for info in infos))}


def choose(data: Dataset, infos: Sequence[CaseInfo], most: int = CASES) -> list[CaseInfo]:
    """A few cases, each the one that shows most of what the others do not; short ones where it is equal."""
    bodies = data.characters()

    def marks(info: CaseInfo) -> set[tuple[str, str]]:
        sides = {"from": info.source, "to": info.target}
        structures = {(side, bodies[name].structure) for side, name in sides.items() if name in bodies}
        return structures | {("body", info.source), ("body", info.target), ("kind", info.kind)}

    chosen: list[CaseInfo] = []
    seen: set[tuple[str, str]] = set()

    def rank(info: CaseInfo) -> tuple[int, int, str]:
        new = [mark for mark, _ in marks(info) - seen]
        return -sum(STRUCTURES if mark in ("from", "to") else OTHERS for mark in new), info.frames, info.id

    waiting = list(infos)
    while waiting and len(chosen) < most:
        best = min(waiting, key=rank)
        waiting.remove(best)
        chosen.append(best)
        seen |= marks(best)
    return sorted(chosen, key=lambda info: info.id)


# -------------------------------------------------------------------------------------------- methods
def default_methods() -> list[str]:
    """Labels of the built-in methods that take part in a plain run and are deterministic, variants too."""
    found = []
    for name, method in registry.working("methods")[0].items():
        card = optional.method_card(method)
        if registry.find("methods", name).origin != registry.BUILT_IN:
            continue
        if card.default and "retarget" in card.tasks and not card.stochastic:
            variants = [Spec(name, changes) for changes in card.variants]
            found += [str(registry.canonical("methods", spec)) for spec in (Spec(name), *variants)]
    return found


def methods(labels: Sequence[str], missing: list[str]) -> dict[str, Spec]:
    """Label -> spec of the methods that can be built; the others are missing."""
    found = {}
    for label in labels:
        try:
            spec = registry.canonical("methods", label)
            plans.method(spec)
        except BenchError as error:
            missing.append(str(error))
        else:
            found[str(spec)] = spec
    return found


def method_facts(spec: Spec) -> dict[str, str]:
    """Version, and the hash of the weights of a learned method ("" for others)."""
    method = plans.method(spec)
    return {
        "version": str(optional.method_card(method).version),
        "weights": optional.weights_hash(method),
    }


@dataclass(frozen=True)
class _Part(EvaluationUnit):
    """A unit of a few chosen cases."""

    chosen: tuple[CaseInfo, ...] = ()

    @cached_property
    def infos(self) -> Sequence[CaseInfo]:
        return self.chosen


def measure(
    asked: SmokeCases,
    specs: Mapping[str, Spec],
    metrics: tuple[str, ...],
    missing: list[str],
    progress: Callable[[int, int], None],
) -> dict[str, Answers]:
    """Label -> its rows: predicted, scored, written, read back and averaged as in any run."""
    entries: dict[tuple[str, str], list[CaseResult]] = {}
    total = sum(len(infos) for _, infos in asked)
    for done, (split, info) in enumerate([(s, info) for s, infos in asked for info in infos], 1):
        for label, entry in _ask(asked.spec, info, specs, metrics, missing).items():
            entries.setdefault((label, split), []).append(entry)
        progress(done, total)
    with tempfile.TemporaryDirectory(prefix="bench-check-") as folder:
        plan = Plan(tuple(specs.values()), (asked.spec,), metrics=metrics, root=Path(folder))
        return {label: _rows(plan, asked, label, spec, entries) for label, spec in specs.items()}


def _ask(
    data_spec: Spec,
    info: CaseInfo,
    specs: Mapping[str, Spec],
    metrics: tuple[str, ...],
    missing: list[str],
) -> dict[str, CaseResult]:
    """Label -> what the method gave for one case; nothing where the case itself cannot be loaded."""
    data = plans.dataset(data_spec)
    try:
        case = data.load(info)
    except Exception as error:  # whatever a data set does wrong, the gate could not do its work
        missing.append(f"case {info.id} cannot be loaded: {type(error).__name__}: {error}")
        return {}
    found = {}
    for label, spec in specs.items():
        method: Method = plans.method(spec)
        seed = store.case_seed(0, str(spec), info.id)
        outcome = stage_one.predict(method, case, stage_one.context_for(method, data, case, seed))
        entry = CaseResult(info.id, outcome.status, outcome.message)
        if outcome.prediction is not None:
            try:
                scored = stage_one.as_scored(outcome.prediction)
                entry.values = score(plans.metrics(metrics), case, scored)
            except Exception as error:  # as in a run: a metric's fault costs the row
                entry = CaseResult(info.id, "failed", f"{type(error).__name__}: {error}")
        found[label] = entry
    return found


def _rows(
    plan: Plan,
    asked: SmokeCases,
    label: str,
    spec: Spec,
    entries: Mapping[tuple[str, str], Sequence[CaseResult]],
) -> Answers:
    """The rows as their files give them back, and the means as a table would show them."""
    written = []
    for split, infos in asked:
        listed = entries.get((label, split), [])
        answered = {entry.case for entry in listed}
        chosen = tuple(info for info in infos if info.id in answered)
        part = _Part(plan=plan, dataset=asked.spec, split=split, method=spec, chosen=chosen)
        if part.infos:
            store.write_results(part.paths, header_of(part, listed), listed, part.infos)
            written.append(part.paths)
    index = {key: value.index for key, value in declared_values(plans.metrics(plan.metrics)).items()}
    answers = Answers()
    for paths in written:
        for entry in store.read_results(paths).entries:
            name = f"{paths.split} {entry.case}"
            if entry.status == "ok":
                answers.table[name] = flat(without_arrays(entry.values, index))
            else:
                answers.problems[name] = f"{entry.status}: {entry.message}"
    for section in summary.split_summaries(written):
        (means,) = section.scores
        curves = {
            key: {index: mean.value for index, mean in curve.items()} for key, curve in means.curves.items()
        }
        values = {key: mean.value for key, mean in means.means.items()} | curves
        if values:
            answers.table[f"{section.split} {MEAN}"] = flat(values)
    return answers
