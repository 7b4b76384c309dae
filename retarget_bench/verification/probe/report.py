"""Results of probing a method: rows in the format of every other result, and sentences."""

import shutil
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from retarget_bench.api import Value
from retarget_bench.evaluation.header_builder import header_of
from retarget_bench.evaluation.plan import EvaluationUnit, Plan
from retarget_bench.files import digest
from retarget_bench.plugins import bound
from retarget_bench.plugins.code_hash import code_hash, package_code
from retarget_bench.plugins.spec import Spec
from retarget_bench.results import store as records
from retarget_bench.results.header import DeclaredValue
from retarget_bench.results.store import CaseResult, ResultPaths
from retarget_bench.verification.probe.asking import NOT_ASKED, Reply
from retarget_bench.verification.probe.probes import PROBES

TASK = "probe"
"""Under which results of probes lie, beside ``retarget``."""
BLIND = 0.2
"""A correlation or share below this: the answer hardly depends on its source."""

DEPENDENCE = (
    Value(
        id="probe.correlation",
        label="follows source",
        meaning="whether answers differ as their sources differ: 1 as they do, 0 not at all",
        unit="1",
        better="higher",
        formula="Pearson's correlation, over all pairs of clips given to one target, of the distance of "
        "the sources' poses and that of the answers' (directions of bones, facing one way)",
        source="in the manner of SIF, on poses; this project",
        needs=("source",),
    ),
    Value(
        id="probe.shuffled",
        label="shuffled sources",
        meaning="how far answers move when sources are shuffled, over how far the sources are apart",
        unit="1",
        better="target",
        formula="mean distance of the answers to a clip and the next one, over that of the two sources",
        source="this project",
        needs=("source",),
    ),
)
VALUES: tuple[Value, ...] = (
    *(
        Value(
            id=f"probe.{probe.id}",
            label=probe.heading or probe.id.replace("_", " "),
            meaning=probe.meaning + ("" if probe.demanded else "; otherwise no fault"),
            unit="% of height",
            better="none",
            formula="100 * mean over frames and joints of |p - p'| / h, p' the answer that must come: "
            + probe.meaning,
            source="this project",
            tolerance=probe.tolerance,
            needs=("source",),
        )
        for probe in PROBES
    ),
    *DEPENDENCE,
)


def entries(replies: Sequence[Reply]) -> list[CaseResult]:
    """One per case; a probe that the method failed makes the case a failed one."""
    by_case: dict[str, list[Reply]] = {}
    for reply in replies:
        by_case.setdefault(reply.info.id, []).append(reply)
    results = []
    for case, of_case in by_case.items():
        if fault := next((each for each in of_case if each.status != "ok" and not each.probe), None):
            results.append(CaseResult(case, fault.status, fault.message))
        elif fault := next(filter(_failed, of_case), None):
            results.append(CaseResult(case, "failed", f"{fault.probe}: {fault.status}: {fault.message}"))
        else:
            numbers = {f"probe.{each.probe}": each.number for each in of_case if each.number is not None}
            results.append(CaseResult(case, "ok", values=dict(numbers)))
    return results


def store(method: Spec, dataset: Spec, replies: Sequence[Reply], root: Path) -> list[ResultPaths]:
    """Write the rows of one method, a result per split; gives their paths. Rows of methods that were probed
    on other cases go."""
    plan = Plan(methods=(method,), datasets=(dataset,), task=TASK, out=root)
    written = []
    parts = ("verification.probe", "verification.rewriting")
    code = code_hash(file for part in parts for file in package_code(part))
    for split in dict.fromkeys(reply.info.split for reply in replies):
        of_split = [reply for reply in replies if reply.info.split == split]
        unit = EvaluationUnit(plan, bound.dataset(dataset), split, bound.method(method))
        listed = entries(of_split)
        plain = header_of(unit, listed)
        header = replace(
            plain,
            not_applicable={f"probe.{name}": each for name, each in _refused(of_split).items()},
            keys={**plain.keys, "score_key": digest(f"probes {code}", 16)},
            values={value.id: replace(DeclaredValue.of(value, TASK), needs=()) for value in VALUES},
            metrics={TASK: f"1+{code}"},
            dataset=replace(plain.dataset, label=f"probes on {plain.dataset.label}"),
        )
        infos = list({reply.info.id: reply.info for reply in of_split}.values())
        if not records.lists(unit.paths, infos):
            shutil.rmtree(unit.paths.cases.parent, ignore_errors=True)
        records.write_results(unit.paths, header, listed, infos)
        written.append(unit.paths)
    return written


# ------------------------------------------------------------------------------------- in words
def findings(label: str, replies: Sequence[Reply]) -> list[str]:
    """Faults of a method as sentences; empty where there are none."""
    sentences = [
        f"{label}: {reply.status} on {reply.info.id}: {reply.message}"
        for reply in replies
        if not reply.probe and _failed(reply)
    ]
    if replies and all(reply.number is None for reply in replies):
        sentences.append(f"{label}: no question was answered, so nothing is known")
    for probe in PROBES:
        of_probe = [reply for reply in replies if reply.probe == probe.id]
        if failed := list(filter(_failed, of_probe)):
            first = failed[0]
            sentences.append(
                f"{label}: {probe.id} could not be answered in {len(failed)} of {_asked(replies)} cases "
                f"(first {first.info.id}: {first.status}: {first.message})"
            )
        numbers = {reply.info.id: reply.number for reply in of_probe if reply.number is not None}
        worst = max(numbers, key=lambda case: numbers[case], default=None)
        if worst is not None and probe.demanded and numbers[worst] > probe.tolerance:
            mean = sum(numbers.values()) / len(numbers)
            sentences.append(
                f"{label}: {probe.id}: off by {mean:.3g} % of height on average, {numbers[worst]:.3g} at "
                f"worst ({worst}). {probe.meaning[0].upper()}{probe.meaning[1:]}"
            )
    return sentences + _blindness(label, replies)


def _blindness(label: str, replies: Sequence[Reply]) -> list[str]:
    """A sentence where answers hardly depend on their sources."""
    means: dict[str, float] = {}
    for name in (value.id.removeprefix("probe.") for value in DEPENDENCE):
        numbers = [reply.number for reply in replies if reply.probe == name and reply.number is not None]
        means |= {name: sum(numbers) / len(numbers)} if numbers else {}
    if min(means.values(), default=BLIND) >= BLIND:
        return []
    each = ", ".join(f"{name} {mean:.2f}" for name, mean in means.items())
    return [f"{label}: the answer hardly depends on its source ({each}; a faithful method has about 1)"]


def refusals(label: str, replies: Sequence[Reply]) -> list[str]:
    """Questions that the method declares it cannot answer, which is no fault, in sentences."""
    sentences = []
    if refused := [reply for reply in replies if not reply.probe and reply.status == "unsupported"]:
        asked = len(refused) + len({reply.info.id for reply in replies if _is_rewritten(reply)})
        sentences = [f"{label}: does not answer {len(refused)} of {asked} cases: {refused[0].message}"]
    return sentences + [
        f"{label}: {name} is not applicable to {each['cases']} of {_asked(replies)} cases: {each['reason']}"
        for name, each in _refused(replies).items()
    ]


def _refused(replies: Sequence[Reply]) -> dict[str, dict[str, Any]]:
    """Probe id -> of how many cases the method does not take the rewritten question, and its reason."""
    reasons = {
        probe.id: [r.message for r in replies if r.probe == probe.id and r.status == "unsupported"]
        for probe in PROBES
    }
    return {name: {"cases": len(each), "reason": each[0]} for name, each in reasons.items() if each}


def _failed(reply: Reply) -> bool:
    return reply.status not in ("ok", "unsupported", NOT_ASKED)


def _is_rewritten(reply: Reply) -> bool:
    return any(reply.probe == probe.id for probe in PROBES)


def _asked(replies: Sequence[Reply]) -> int:
    """The number of cases of which any rewritten question was put."""
    return len({each.info.id for each in replies if _is_rewritten(each) and each.status != NOT_ASKED})
