"""Rows of methods on a few cases: which cases, and everything from the question to the file of a run."""

from collections.abc import Callable, Sequence
from dataclasses import replace

from retarget_bench.api import Case, CaseInfo, Dataset
from retarget_bench.errors import BenchError
from retarget_bench.evaluation import predict as stage_one
from retarget_bench.evaluation.plan import EvaluationUnit, Plan
from retarget_bench.evaluation.score import score
from retarget_bench.files import digest
from retarget_bench.plugins import bound, registry
from retarget_bench.plugins.bound import BoundDataset, BoundMethod
from retarget_bench.plugins.spec import Spec
from retarget_bench.results import store
from retarget_bench.results.header import (
    Counts,
    DatasetInfo,
    DeclaredValue,
    MethodInfo,
    Problem,
    ResultHeader,
)
from retarget_bench.results.paths import ARRAY_INDICES
from retarget_bench.results.store import CaseResult
from retarget_bench.verification.gate.golden import FACTS, Measured

TASK = "retarget"
CASES = 4
"""Cases of each split. Their structures, bodies and kinds of performance differ as far as they can."""
STRUCTURES, OTHERS = 10, 1
"""Weights in the choice of cases: of a new structure, and of a new body or kind."""


# ---------------------------------------------------------------------------------------------- cases
def golden_cases(golden: Measured) -> dict[str, list[str]]:
    """Split -> the ids of the cases of golden rows."""
    places = {place.split: place for place in store.find_results(golden.rows)}
    return {
        split: [info.id for info in store.read_cases(place.cases, TASK, split)]
        for split, place in places.items()
    }


def choose(data: Dataset, infos: Sequence[CaseInfo]) -> list[CaseInfo]:
    """A few cases, each with the most new structures, bodies and kinds; of equal ones the shortest."""
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
    while waiting and len(chosen) < CASES:
        best = min(waiting, key=rank)
        waiting.remove(best)
        chosen.append(best)
        seen |= marks(best)
    return sorted(chosen, key=lambda info: info.id)


def _cases(now: Measured, data: BoundDataset, golden: Measured) -> dict[str, Sequence[CaseInfo]]:
    """Split -> the cases of the golden rows, unless the data set says itself that it holds something else
    now; then those chosen by rule. Adds the facts of the data set."""
    content = data.built.content
    now.facts |= {"dataset/spec": str(Spec(data.spec.name, data.parameters)), "dataset/content": content}
    listed = {split: data.built.cases(TASK, split) for split in data.built.card.splits}
    for split, infos in listed.items():
        hash_ = digest("\n".join(info.id for info in infos))
        now.facts[f"cases/{split}"] = f"{len(infos)} cases, {hash_}"
    if golden.facts.get("dataset/content") != content:
        return {split: choose(data.built, infos) for split, infos in listed.items()}
    chosen: dict[str, Sequence[CaseInfo]] = {}
    for split, ids in golden_cases(golden).items():
        available = {info.id: info for info in listed.get(split, ())}
        chosen[split] = [available[case] for case in ids if case in available]
        if lost := [case for case in ids if case not in available]:
            missing = f"{len(lost)} of the cases of {split}, {lost[0]} first"
            now.missing.append(f"{data.spec} has no longer {missing}")
    return chosen


# -------------------------------------------------------------------------------------------- methods
def default_methods() -> list[str]:
    """Labels of the built-in methods that take part in a plain run and are deterministic, variants too."""
    labels = []
    for name, method in registry.working("methods")[0].items():
        card = method.card
        if registry.find("methods", name).origin != registry.BUILT_IN:
            continue
        if card.default and TASK in card.tasks and not card.stochastic:
            variants = [Spec(name, changes) for changes in card.variants]
            labels += [str(registry.canonical("methods", spec)) for spec in (Spec(name), *variants)]
    return labels


def measure(
    now: Measured,
    golden: Measured,
    data: BoundDataset,
    labels: Sequence[str],
    metrics: tuple[str, ...],
    progress: Callable[[int, int], None],
) -> None:
    """Add the rows of methods: predicted, scored and written as in any run.

    metrics: names, none of sets.
    """
    cases_of = _cases(now, data, golden)
    if not any(cases_of.values()):
        now.missing.append(f"{data.spec} has no case to ask methods")
    methods: dict[str, BoundMethod] = {}
    known = golden.under("weights")
    for label in labels:
        try:
            method = bound.method(registry.canonical("methods", label))
            now.facts[f"weights/{method.spec}"] = method.built.weights_hash
            methods[str(method.spec)] = method
        except BenchError as error:
            hint = "; if it is gone for good, remove its line from " + FACTS
            now.missing.append(f"{error}{hint if label in known else ''}")
    loaded = {split: _loaded(now, data.built, infos) for split, infos in cases_of.items()}
    cases = [case for each in loaded.values() for case in each]
    for done, method in enumerate(methods.values(), 1):
        plan = Plan((method.spec,), (data.spec,), metrics=metrics, out=now.rows)
        units = [EvaluationUnit(plan, data, split, method) for split, each in loaded.items() if each]
        entries = _entries(units[0], cases) if units else {}
        for unit in units:
            infos = cases_of[unit.split]
            results = [entries[info.id] for info in infos]
            store.write_results(unit.paths, _header(unit, results), results, infos)
        progress(done, len(methods))


def _loaded(now: Measured, data: Dataset, infos: Sequence[CaseInfo]) -> list[Case]:
    """The cases; none where one of them cannot be loaded."""
    try:
        return [data.load(info) for info in infos]
    except Exception as error:  # whatever a data set does wrong, the gate could not do its work
        now.missing.append(f"a case cannot be loaded: {type(error).__name__}: {error}")
        return []


def _entries(unit: EvaluationUnit, cases: Sequence[Case]) -> dict[str, CaseResult]:
    """The results of a method on cases of any split, asked at once where possible, scored as in any run."""
    method, metrics = unit.method.built, unit.metrics.of_cases
    seeds = [store.case_seed(0, str(unit.known_as), case.info.id) for case in cases]
    contexts = [
        stage_one.context_for(method, unit.data, case, seed)
        for case, seed in zip(cases, seeds, strict=True)
    ]
    # values per joint are left to frozen motions
    stored = {k for k, each in bound.declared_values(metrics).items() if each.index not in ARRAY_INDICES}
    entries = {}
    for case, outcome in zip(cases, stage_one.predict_all(method, cases, contexts), strict=True):
        entry = entries[case.info.id] = CaseResult(case.info.id, outcome.status, outcome.message)
        if outcome.prediction is not None:
            try:
                values = score(metrics, case, stage_one.as_scored(outcome.prediction)).sound()
                entry.values = {key: each for key, each in values.items() if key in stored}
            except Exception as error:  # a metric's fault costs the row here, so that it is seen
                entry.status, entry.message = "failed", f"{type(error).__name__}: {error}"
    return entries


def _header(unit: EvaluationUnit, entries: Sequence[CaseResult]) -> ResultHeader:
    """The header of a unit: what tables need to know, and nothing that varies with time and place."""
    card, trained = unit.method.card, unit.method.built.training_manifest
    problems = (Problem(status=e.status, message=e.message, cases=(e.case,)) for e in entries)
    return ResultHeader(
        keys={},
        task=TASK,
        split=unit.split,
        method=MethodInfo(
            name=unit.known_as.name,
            label=str(unit.known_as),
            parameters=dict(unit.known_as.parameters),
            privileged=tuple(card.needs),
            control=bool(card.control),
            trained_on=None if trained is None else {},
        ),
        dataset=DatasetInfo(label=unit.data.label, content=unit.data.content, notes=()),
        metrics={metric.card.name: str(metric.card.version) for metric in unit.metrics.of_cases},
        values={
            # the prose of values is that of the installed metrics
            value.id: replace(
                DeclaredValue.of(value, metric.card.name), meaning="", formula="", protocol={}
            )
            for metric in unit.metrics.of_cases
            for value in metric.card.computed
        },
        counts=Counts.of(entry.status for entry in entries),
        problems=tuple(each for each in problems if each.status != "ok"),
    )
