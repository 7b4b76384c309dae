"""Results of probing a method: rows in the format of every other result, and sentences."""

import shutil
from collections.abc import Mapping, Sequence
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
from retarget_bench.verification.probe.asking import Reply
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
            label=probe.label,
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
    found: dict[str, CaseResult] = {}
    for reply in replies:
        status, message = reply.status, reply.message
        if reply.failed:
            probe, why = next(iter(reply.failed.items()))
            status, message = "failed", f"{probe}: {why}"
        values: records.Values = {f"probe.{name}": number for name, number in reply.deviations.items()}
        values |= {f"probe.{name}": number for name, number in reply.dependence.items()}
        entry = found.setdefault(reply.subject.info.id, CaseResult(reply.subject.info.id, status, message))
        if entry.status == "ok":
            entry.values |= values
    return list(found.values())


def store(method: Spec, dataset: Spec, replies: Sequence[Reply], root: Path) -> list[ResultPaths]:
    """Write the rows of one method, a result per split; gives their paths. Rows of methods that were probed
    on other cases go."""
    plan = Plan(methods=(method,), datasets=(dataset,), task=TASK, out=root)
    written = []
    parts = ("verification.probe", "verification.rewriting")
    code = code_hash(file for part in parts for file in package_code(part))
    for split in dict.fromkeys(reply.subject.info.split for reply in replies):
        mine = [reply for reply in replies if reply.subject.info.split == split]
        unit = EvaluationUnit(plan, bound.dataset(dataset), split, bound.method(method))
        listed = entries(mine)
        plain = header_of(unit, listed)
        header = replace(
            plain,
            not_applicable={f"probe.{name}": each for name, each in _refused(mine).items()},
            keys={**plain.keys, "score_key": digest(f"probes {code}", 16)},
            values={value.id: replace(DeclaredValue.of(value, TASK), needs=()) for value in VALUES},
            metrics={TASK: f"1+{code}"},
            dataset=replace(plain.dataset, label=f"probes on {plain.dataset.label}"),
        )
        infos = list({reply.subject.info.id: reply.subject.info for reply in mine}.values())
        if not records.lists(unit.paths, infos):
            shutil.rmtree(unit.paths.cases.parent, ignore_errors=True)
        records.write_results(unit.paths, header, listed, infos)
        written.append(unit.paths)
    return written


# ------------------------------------------------------------------------------------- in words
def findings(label: str, replies: Sequence[Reply]) -> list[str]:
    """Faults of a method as sentences; empty where there are none."""
    found = [
        f"{label}: {reply.status} on {reply.subject.info.id}: {reply.message}"
        for reply in replies
        if reply.status not in ("ok", "unsupported")
    ]
    if replies and not any(reply.deviations or reply.dependence for reply in replies):
        found.append(f"{label}: no question was answered, so nothing is known")
    for probe in PROBES:
        numbers = _numbers(replies, probe.id)
        if broken := [reply for reply in replies if probe.id in reply.failed]:
            first = broken[0]
            found.append(
                f"{label}: {probe.id} could not be answered in {len(broken)} of "
                f"{sum(map(_asked, replies))} cases "
                f"(first {first.subject.info.id}: {first.failed[probe.id]})"
            )
        worst = max(numbers, key=lambda case: numbers[case], default=None)
        if worst is not None and probe.demanded and numbers[worst] > probe.tolerance:
            mean = sum(numbers.values()) / len(numbers)
            found.append(
                f"{label}: {probe.id}: off by {mean:.3g} % of height on average, {numbers[worst]:.3g} at "
                f"worst ({worst}). {probe.meaning[0].upper()}{probe.meaning[1:]}"
            )
    known = [reply.dependence for reply in replies if reply.dependence]
    means = {name: sum(each[name] for each in known) / len(known) for name in (known[0] if known else ())}
    if min(means.values(), default=BLIND) < BLIND:
        said = ", ".join(f"{name} {value:.2f}" for name, value in means.items())
        found.append(
            f"{label}: the answer hardly depends on its source ({said}; a faithful method has about 1)"
        )
    return found


def refusals(label: str, replies: Sequence[Reply]) -> list[str]:
    """Questions that the method declares it cannot answer, which is no fault, in sentences."""
    said = []
    if refused := [reply for reply in replies if reply.status == "unsupported"]:
        asked = len(refused) + sum(bool(_asked(each) or each.skipped) for each in replies)
        said = [f"{label}: does not answer {len(refused)} of {asked} cases: {refused[0].message}"]
    return said + [
        f"{label}: {name} is not applicable to {each['cases']} of {sum(map(_asked, replies))} cases: "
        f"{each['reason']}"
        for name, each in _refused(replies).items()
    ]


def _refused(replies: Sequence[Reply]) -> dict[str, dict[str, Any]]:
    """Probe id -> of how many cases the method does not take the rewritten question, and its reason."""
    reasons = {p.id: [r.refused[p.id] for r in replies if p.id in r.refused] for p in PROBES}
    return {name: {"cases": len(each), "reason": each[0]} for name, each in reasons.items() if each}


def _asked(reply: Reply) -> bool:
    """True if any rewritten question was put."""
    return bool(reply.deviations or reply.failed or reply.refused)


def _numbers(replies: Sequence[Reply], probe: str) -> Mapping[str, float]:
    return {r.subject.info.id: r.deviations[probe] for r in replies if probe in r.deviations}
