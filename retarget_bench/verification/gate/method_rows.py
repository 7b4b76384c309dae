"""Methods on a few cases: which cases, and everything from the question to the mean that a table shows."""

import tempfile
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from retarget_bench.analysis import summary
from retarget_bench.api import CaseInfo, Dataset, optional
from retarget_bench.errors import BenchError
from retarget_bench.evaluation import predict as stage_one
from retarget_bench.evaluation.header_builder import header_of
from retarget_bench.evaluation.plan import EvaluationUnit, Plan
from retarget_bench.evaluation.score import score
from retarget_bench.files import digest
from retarget_bench.plugins import bound, registry
from retarget_bench.plugins.spec import Spec
from retarget_bench.results import store
from retarget_bench.results.store import CaseResult, ResultPaths
from retarget_bench.verification.gate.golden import Snapshot, flat

TASK = "retarget"
CASES = 5
"""Cases of each split. Their structures, bodies and kinds of performance differ as far as they can."""
STRUCTURES, OTHERS = 10, 1
"""Weights in the choice of cases: of a new structure, and of a new body or kind."""
MEAN = "mean"


# ---------------------------------------------------------------------------------------------- cases
def prepare(
    found: Snapshot, spec: Spec, wanted: Mapping[str, Sequence[str]] | None
) -> dict[str, Sequence[CaseInfo]]:
    """Split -> the wanted cases, or those chosen by rule; wanted ones that the data set lacks are missing.

    Also adds them, and the facts of the data set, to what was found.
    """
    data = bound.dataset(spec).built
    listed = {split: data.cases(TASK, split) for split in data.card.splits}
    found.dataset = {
        "spec": str(Spec(spec.name, bound.dataset(spec).parameters)),
        "name": spec.name,
        "parameters": bound.dataset(spec).parameters,
        "content": data.content,
        "lists": {
            split: {"cases": len(infos), "hash": digest("\n".join(info.id for info in infos))}
            for split, infos in listed.items()
        },
    }
    asked: dict[str, Sequence[CaseInfo]] = {}
    for split, ids in (dict.fromkeys(listed) if wanted is None else wanted).items():
        known = {info.id: info for info in listed.get(split, ())}
        if ids is None:
            asked[split] = choose(data, listed[split])
            continue
        if lost := [case for case in ids if case not in known]:
            found.missing.append(
                f"{spec} has no longer {len(lost)} of the cases of {split}, {lost[0]} first"
            )
        asked[split] = [known[case] for case in ids if case in known]
    found.smoke = {split: [info.id for info in infos] for split, infos in asked.items()}
    if not any(asked.values()):
        found.missing.append(f"{spec} has no case to ask methods")
    return asked


def choose(data: Dataset, infos: Sequence[CaseInfo]) -> list[CaseInfo]:
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
    while waiting and len(chosen) < CASES:
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


def _built(found: Snapshot, labels: Sequence[str]) -> dict[str, Spec]:
    """Label -> spec of the methods that can be built, with their facts; the others are missing."""
    specs = {}
    for label in labels:
        try:
            spec = registry.canonical("methods", label)
            method = bound.method(spec).built
            version = str(optional.method_card(method).version)
            found.methods[str(spec)] = {"version": version, "weights": optional.weights_hash(method)}
            specs[str(spec)] = spec
        except BenchError as error:
            found.missing.append(str(error))
    return specs


def measure(
    found: Snapshot,
    data: Spec,
    wanted: Mapping[str, Sequence[str]] | None,
    labels: Sequence[str],
    metrics: tuple[str, ...],
    progress: Callable[[int, int], None],
) -> None:
    """Add the rows of methods: predicted, scored, written, read back and averaged as in any run.

    wanted: split -> case ids; None: those that ``choose`` takes. metrics: names, none of sets.
    """
    asked = prepare(found, data, wanted)
    if not any(asked.values()):
        return
    specs = _built(found, labels)
    answers: dict[tuple[str, str], list[tuple[CaseInfo, CaseResult]]] = {}
    questions = [(split, info) for split, infos in asked.items() for info in infos]
    for done, (split, info) in enumerate(questions, 1):
        for label, entry in _ask(data, info, specs, metrics, found.missing).items():
            answers.setdefault((label, split), []).append((info, entry))
        progress(done, len(questions))
    with tempfile.TemporaryDirectory(prefix="bench-check-") as folder:
        plan = Plan(tuple(specs.values()), (data,), metrics=metrics, root=Path(folder))
        for label, spec in specs.items():
            written = []
            for split in asked:
                if pairs := answers.get((label, split)):
                    infos, entries = zip(*pairs, strict=True)
                    unit = EvaluationUnit(plan, bound.dataset(data), split, bound.method(spec))
                    store.write_results(unit.paths, header_of(unit, entries), entries, infos)
                    written.append(unit.paths)
            _add_rows(found, label, written)


def _ask(
    data_spec: Spec,
    info: CaseInfo,
    specs: Mapping[str, Spec],
    metrics: tuple[str, ...],
    missing: list[str],
) -> dict[str, CaseResult]:
    """Label -> what the method gave for one case; nothing where the case itself cannot be loaded."""
    data = bound.dataset(data_spec).built
    try:
        case = data.load(info)
    except Exception as error:  # whatever a data set does wrong, the gate could not do its work
        missing.append(f"case {info.id} cannot be loaded: {type(error).__name__}: {error}")
        return {}
    found = {}
    for label, spec in specs.items():
        method = bound.method(spec).built
        seed = store.case_seed(0, str(spec), info.id)
        outcome = stage_one.predict(method, case, stage_one.context_for(method, data, case, seed))
        entry = CaseResult(info.id, outcome.status, outcome.message)
        if outcome.prediction is not None:
            try:
                scored = stage_one.as_scored(outcome.prediction)
                entry.values = score(bound.metrics(metrics).of_cases, case, scored).sound()
            except Exception as error:  # a metric's fault costs the row here, so that it is seen
                entry = CaseResult(info.id, "failed", f"{type(error).__name__}: {error}")
        found[label] = entry
    return found


def _add_rows(found: Snapshot, label: str, written: Sequence[ResultPaths]) -> None:
    """The rows of a method as their files give them back, and the means as a table would show them."""
    table, problems = found.rows.setdefault(label, {}), {}
    for paths in written:
        for entry in store.read_results(paths).entries:
            name = f"{paths.split} {entry.case}"
            if entry.status == "ok":
                table[name] = flat(entry.values)
            else:
                problems[name] = f"{entry.status}: {entry.message}"
    if problems:
        found.problems[label] = problems
    for section in summary.split_summaries(written):
        (means,) = section.scores
        values: store.Values = {key: mean.value for key, mean in means.means.items()}
        for key, curve in means.curves.items():
            values[key] = {index: mean.value for index, mean in curve.items()}
        if values:
            table[f"{section.split} {MEAN}"] = flat(values)
