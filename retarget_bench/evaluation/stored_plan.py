"""A plan and its missing cases in files, of which any machine can carry out a share.

Under a results root lies, until the run is complete,

    .shards/<id>/plan.json          the plan, its units, and what all machines must have in common
    .shards/<id>/jobs/7.json        the jobs of shard 7
    .shards/<id>/parts/7-<id>.json  answers of shard 7, as they are finished

All is plain data, renamed into place, and no process changes what another one wrote. The results root is
the one that the folder lies in, wherever a machine has it.
"""

import json
import secrets
import shutil
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import Any, Self, TypeVar

from retarget_bench.errors import BenchError, FileError
from retarget_bench.evaluation.answers import Answer, size
from retarget_bench.evaluation.code_hash import folder_hash
from retarget_bench.evaluation.header_builder import versions
from retarget_bench.evaluation.plan import (
    Plan,
    code_of,
    dataset,
    located_data,
    metric_versions,
)
from retarget_bench.evaluation.predict import Inputs
from retarget_bench.evaluation.worker import CaseJob, JobPart
from retarget_bench.files import write_text
from retarget_bench.plugins.spec import Spec
from retarget_bench.results.store import CaseResult, ResultPaths

T = TypeVar("T")
FOLDER = ".shards"
Keys = Mapping[ResultPaths, Mapping[str, str]]
"""Results -> the keys that they are known by."""


class StoredPlan:
    """A stored plan; its files are read when they are asked for. Raises FileError for damaged ones."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder.resolve()
        self.root = self.folder.parents[1]

    @classmethod
    def write(
        cls, plan: Plan, jobs: Sequence[CaseJob], shards: Sequence[Sequence[int]], keys: Keys
    ) -> Self:
        """Store the shards of a plan, given as numbers of its jobs, which are read one shard at a time."""
        stored = cls(plan.root / FOLDER / secrets.token_hex(6))
        parts: dict[ResultPaths, JobPart] = {}
        data: dict[Spec, Spec] = {}
        sizes = []
        for number, shard in enumerate(shards):
            mine = [jobs[each] for each in shard]
            parts |= {part.paths: part for job in mine for part in job.parts}
            data |= {each: located_data(each) for each in {job.dataset for job in mine} - data.keys()}
            places = {paths: place for place, paths in enumerate(parts)}
            facts = [_job_facts(job, data[job.dataset], places) for job in mine]
            _write(stored.folder / "jobs" / f"{number}.json", facts)
            sizes.append(sum(map(size, mine)))
        methods = {part.method for part in parts.values()}
        facts_of_all = {
            "plan": _plan_facts(plan, data.values()),
            "units": [_unit_facts(part, keys[part.paths]) for part in parts.values()],
            "common": machine_facts(plan, methods, data.values()),
            "preload": list(jobs[0].preload),
            "sizes": sizes,
        }
        _write(stored.folder / "plan.json", facts_of_all)
        return stored

    @cached_property
    def facts(self) -> dict[str, Any]:
        return dict(_read(self.folder / "plan.json"))

    @cached_property
    def plan(self) -> Plan:
        return self._parsed(self._plan)

    @cached_property
    def units(self) -> list[JobPart]:
        """Every method on every split that lacks something; keys of cases are with the jobs."""
        return self._parsed(self._units)

    @cached_property
    def keys(self) -> Keys:
        found = zip(self.units, self.facts["units"], strict=True)
        return {unit.paths: facts["keys"] for unit, facts in found}

    def jobs(self, number: int) -> list[CaseJob]:
        """The jobs of a shard. Raises BenchError where there is none of this number."""
        path = self.folder / "jobs" / f"{number}.json"
        if not path.exists() and self.facts:
            raise BenchError(f"{self.folder} has no shard {number}")
        return [self._job(facts) for facts in _read(path)]

    def lacking(self, number: int) -> list[CaseJob]:
        """The jobs of a shard without what is answered."""
        done = {(paths, entry.case) for paths, entry in self.answers(number)}
        found = []
        for job in self.jobs(number):
            parts = []
            for part in job.parts:
                if keys := {case: key for case, key in part.keys.items() if (part.paths, case) not in done}:
                    parts.append(replace(part, keys=keys))
            if parts:
                found.append(replace(job, parts=tuple(parts)))
        return found

    def write_part(self, number: int, found: Sequence[Answer]) -> None:
        """Raises BenchError where the plan was removed, since its run is complete or was made anew."""
        if not (self.folder / "plan.json").exists():
            raise BenchError(f"{self.folder} is gone: its run has ended, or another one continued it")
        numbers = {unit.paths: place for place, unit in enumerate(self.units)}
        facts = [[numbers[paths], vars(entry)] for paths, entry in found]
        _write(self.folder / "parts" / f"{number}-{secrets.token_hex(6)}.json", facts)

    def new_parts(self, seen: set[str]) -> Iterator[tuple[int, list[Answer]]]:
        """Shard and answers of every part but those seen, which become seen."""
        folder = self.folder / "parts"
        for path in sorted(folder.glob("[0-9]*.json")) if folder.is_dir() else ():
            if path.name not in seen:
                seen.add(path.name)
                found = [(self.units[unit].paths, CaseResult(**entry)) for unit, entry in _read(path)]
                yield int(path.name.split("-")[0]), found

    def answers(self, number: int | None = None) -> Iterator[Answer]:
        """What is finished, of one shard or of all."""
        for shard, found in self.new_parts(set()):
            if number in (None, shard):
                yield from found

    def remove(self) -> None:
        shutil.rmtree(self.folder, ignore_errors=True)
        with suppress(OSError):  # it holds others
            self.folder.parent.rmdir()

    def _parsed(self, parse: Callable[[], T]) -> T:
        try:
            return parse()
        except (KeyError, TypeError, ValueError, AttributeError) as error:
            problem = f"was stored by another version of retarget-bench ({error!r}); all machines need one"
            raise FileError(self.folder / "plan.json", problem) from error

    def _plan(self) -> Plan:
        facts = self.facts["plan"]
        typed: dict[str, Any] = {
            each: tuple(map(Spec.parse, facts[each])) for each in ("methods", "datasets")
        }
        typed |= {each: tuple(facts[each]) for each in ("splits", "metrics", "clips")}
        typed["plugin_files"] = tuple(map(tuple, facts["plugin_files"]))
        typed["external"] = Path(facts["external"]) if facts["external"] else None
        return Plan(**{**facts, **typed, "root": self.root})

    def _units(self) -> list[JobPart]:
        return [
            JobPart(
                Spec.parse(unit["method"]),
                ResultPaths(self.root, *unit["place"]),
                {},
                unit["seeded_as"],
                Inputs(**{name: _tuple(value) for name, value in unit["inputs"].items()}),
                unit["lock"],
            )
            for unit in self.facts["units"]
        ]

    def _job(self, facts: Mapping[str, Any]) -> CaseJob:
        return CaseJob(
            replace(self.plan, seed=facts["seed"]),
            Spec.parse(facts["dataset"]),
            facts["split"],
            tuple(facts["cases"]),
            tuple(replace(self.units[unit], keys=keys) for unit, keys in facts["parts"]),
            preload=tuple(self.facts["preload"]),
        )


def machine_facts(plan: Plan, methods: Iterable[Spec], data: Iterable[Spec]) -> dict[str, str]:
    """Versions, code and data that results depend on: what all machines of a run must have in common."""
    found = versions() | {f"metric {name}": code for name, code in metric_versions(plan.metrics).items()}
    if plan.external:
        found["the folder of predictions"] = folder_hash(plan.external)
    else:
        found |= {f"method {spec.names}": code_of(spec) for spec in methods}
    return found | {f"data set {spec.name}": dataset(spec, plan.task).content for spec in data}


def left_over(root: Path, keys: Keys) -> list[StoredPlan]:
    """Plans of runs that ended before they were complete, of any of these results."""
    found = []
    for path in sorted((root / FOLDER).glob("*/plan.json")):
        stored = StoredPlan(path.parent)
        try:
            theirs = {replace(paths, root=root) for paths in stored.keys}
        except FileError:
            continue
        if theirs & keys.keys():
            found.append(stored)
    return found


def taken_over(plans: Iterable[StoredPlan], keys: Keys, root: Path) -> Iterator[Answer]:
    """Answers that such runs finished and that are answers of these results; none of damaged files."""
    for stored in plans:
        with suppress(FileError):
            for paths, entry in stored.answers() if stored.plan.stage != "predict" else ():
                here = replace(paths, root=root)
                if keys.get(here) == stored.keys[paths]:
                    yield here, entry


def _tuple(value: Any) -> Any:
    return tuple(value) if isinstance(value, list) else value


def _plan_facts(plan: Plan, data: Iterable[Spec]) -> dict[str, Any]:
    left_out = ("root", "executor")
    facts = {name: value for name, value in vars(plan).items() if name not in left_out}
    facts |= {"methods": list(map(str, plan.methods)), "datasets": list(map(str, data))}
    return facts | {"external": str(plan.external.resolve()) if plan.external else None}


def _unit_facts(part: JobPart, keys: Mapping[str, str]) -> dict[str, Any]:
    paths = part.paths
    return {
        "method": str(part.method),
        "place": [paths.dataset, paths.task, paths.split, paths.method],
        "seeded_as": part.seeded_as,
        "inputs": vars(part.inputs),
        "lock": part.lock,
        "keys": dict(keys),
    }


def _job_facts(job: CaseJob, data: Spec, numbers: Mapping[ResultPaths, int]) -> dict[str, Any]:
    return {
        "dataset": str(data),
        "split": job.split,
        "seed": job.plan.seed,
        "cases": job.cases,
        "parts": [[numbers[part.paths], dict(part.keys)] for part in job.parts],
    }


def _write(path: Path, facts: Any) -> None:
    write_text(path, json.dumps(facts, allow_nan=False) + "\n")


def _read(path: Path) -> Any:
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise FileError(path, f"is not part of a stored plan ({error}); run bench run again") from error
