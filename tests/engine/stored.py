"""Results as they are stored, made of numbers: what tests of tables stand on."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

from retarget_bench.api import CaseInfo
from retarget_bench.evaluation import set_metrics
from retarget_bench.evaluation.set_metrics import SetValue
from retarget_bench.results import case_metadata, journal
from retarget_bench.results import store as records
from retarget_bench.results.header import SCHEMA, STATUSES, ResultHeader, parsed
from retarget_bench.results.store import CaseResult, ResultPaths

VALUES = {
    "mpjpe_h.world": {
        "label": "world", "unit": "% of height", "better": "lower", "goal": 1.0, "index": "",
        "with_self": False, "meaning": "mean distance of joints", "tolerance": 1e-6, "formula": "",
    },
    "ratio": {
        "label": "ratio", "unit": "1", "better": "target", "goal": 1.0, "index": "",
        "with_self": False, "meaning": "a | ratio", "tolerance": 1e-6, "formula": "",
    },
    "ratio_src": {
        "label": "ratio, source", "unit": "1", "better": "target", "goal": 1.0, "index": "",
        "with_self": False, "meaning": "a ratio to the source", "tolerance": 1e-6, "formula": "",
    },
    "pooled": {
        "label": "pooled", "unit": "1", "better": "lower", "goal": 1.0, "index": "",
        "with_self": True, "meaning": "with self pairs", "tolerance": 1e-6, "formula": "",
    },
    "curve": {
        "label": "curve", "unit": "1", "better": "higher", "goal": 1.0, "index": "threshold",
        "with_self": False, "meaning": "a curve", "tolerance": 1e-6, "formula": "",
    },
}  # fmt: skip


FID = VALUES["pooled"] | {
    "label": "FID", "with_self": False, "meaning": "how unlike real motion", "tolerance": 1e-2, "needs": [],
    "metric": "fid_structure",
}  # fmt: skip


def header(method: str, entries: list[CaseResult], split: str, **changes) -> ResultHeader:
    counts = {"asked": len(entries)} | {s: sum(e.status == s for e in entries) for s in STATUSES}
    problems = [
        {"status": e.status, "message": e.message, "cases": [e.case]} for e in entries if e.status != "ok"
    ]
    about = {"name": method, "label": method, "control": False, "privileged": [], "stochastic": False}
    facts = {
        "schema": SCHEMA,
        "keys": {},
        "split": split,
        "method": about | changes,
        "dataset": {
            "name": "data",
            "parameters": {},
            "label": "data",
            "content": "c1",
            "notes": ["two clips were dropped"],
        },
        "metrics": {},
        "values": VALUES,
        "counts": counts,
        "problems": problems,
    }
    return parsed(facts)


def store(root: Path, split: str, method: str, numbers: list, **changes) -> ResultPaths:
    """``numbers``: list of (pair, clip, values dict or status)."""
    infos, entries = [], []
    for pair, clip, values in numbers:
        source, target = pair.split(">")
        case = f"data/{pair}/{clip}"
        infos.append(CaseInfo(case, "retarget", split, source, target, clip, "", 10))
        good = isinstance(values, dict)
        entries.append(
            CaseResult(case, "ok", values=values) if good else CaseResult(case, values, "because | of it")
        )
    place = ResultPaths(root, "data", "retarget", split, method)
    records.write_results(place, header(method, entries, split, **changes), entries, infos)
    return place


def metadata(place: ResultPaths, **facts: dict[str, str]) -> None:
    """Write metadata of cases, kind -> of whom -> fact, in place of those of these kinds that are there."""
    path = case_metadata.path_of(place)
    rows = records.read_csv(path, case_metadata.FIELDS)[:-1] if path.exists() else []
    kept = [row for row in rows if row[0] not in facts]
    added = [[kind, of, "", fact] for kind, each in facts.items() for of, fact in each.items()]
    case_metadata.write_facts(place, [*kept, *added])


def running(place: ResultPaths, answered: int) -> ResultPaths:
    """The same results as a run leaves them that has only done so many cases, by id."""
    results = records.read_results(place)
    place.header.unlink()
    place.rows.unlink()
    records.begin(place, replace(results.header, files={}), list(results.cases.values()))
    journal.open_journal(place, results.header.keys)
    for entry in results.entries[:answered]:
        journal.append_journal(place, entry)
    return place


def changed(place: ResultPaths, **changes) -> ResultPaths:
    """The same result with other words in its header."""
    fields = json.loads(place.header.read_text()) | changes
    place.header.write_text(json.dumps(fields))
    return place


def with_sets(place: ResultPaths, values: list[SetValue], *declared: str, **changes) -> ResultPaths:
    """The same results with values of sets, of ``fid.structure`` and others that are declared likewise."""
    set_metrics.write(place, values)
    of_sets = dict.fromkeys(("fid.structure", *declared), FID)
    about = {"metrics": {"fid_structure": "1+aa"}, "date": "2026-01-01", "set_values": of_sets}
    return changed(place, **about | changes)


def unchecked(root: Path) -> None:
    """Make headers say no checksums: whoever edits files is then not told so."""
    for path in root.rglob("*.json"):
        facts = json.loads(path.read_text(encoding="utf-8"))
        if facts.pop("files", None):
            path.write_text(json.dumps(facts), encoding="utf-8")
