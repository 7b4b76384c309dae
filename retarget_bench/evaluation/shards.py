"""Shards: the only unit of work. A run is cut into them, and whoever carries them out, the results are
the same.

A shard is a few tasks in files, of which any machine can carry out a share. Under a results root lies,
until the run is complete,

    .shards/<id>/plan.json           the plan, its units, and what all machines must have in common
    .shards/<id>/tasks/7.json        the tasks of shard 7
    .shards/<id>/parts/7-<id>.jsonl  answers of shard 7, a line each as they are finished

All is plain data, and no process changes what another one wrote. The results root is the one that the
folder lies in, wherever a machine has it.
"""

import json
import secrets
import shutil
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cache, cached_property, partial
from pathlib import Path
from typing import Any, ClassVar, Self

from retarget_bench.errors import BenchError, FileError, mistakes
from retarget_bench.evaluation.header_builder import versions
from retarget_bench.evaluation.plan import EvaluationUnit, Plan, data_of
from retarget_bench.evaluation.predict import Inputs
from retarget_bench.files import write_text
from retarget_bench.plugins import bound
from retarget_bench.plugins.code_hash import folder_hash
from retarget_bench.plugins.spec import Spec
from retarget_bench.results.store import CaseResult, ResultPaths

FOLDER = ".shards"
SHARDS = 64
"""So many, where that makes them no larger than ``LARGEST``."""
LARGEST = 200_000
"""Frames of the answers of a shard: minutes of one core for most methods."""
PARTS = 2
"""A batch is in one task, for metrics know its references then, where that is so many shards at most."""

Answer = tuple[int, CaseResult]
"""The number of a unit, and how one of its cases went."""
Cases = Mapping[int, Sequence[str]]
"""The number of a unit -> those of a task's cases that it lacks."""


@dataclass(frozen=True)
class Task:
    """Cases of one split that are loaded once, and what of them is lacking.

    cases: all of a batch. lacking: the units that lack some of them, all of one data set, split and seed.
    """

    cases: tuple[str, ...]
    lacking: Cases


@dataclass(frozen=True)
class Unit:
    """The facts of an ``EvaluationUnit`` for the process that carries out a shard, which imports no method.

    method: with the paths of its files in full. seed: the base seed. seed_label: the label of the method
    without post-processors, which seeds are made from; "" for predictions made elsewhere. inputs: what it
    is given beside source and target. in_batches: whether it is given all cases of a batch at once, because
    how it is composed decides how results round. learned: it has weights. lock: of the environment that it
    answers in, if that is another one. keys: what its results are known by.
    """

    dataset: Spec
    split: str
    method: Spec
    paths: ResultPaths
    seed: int
    seed_label: str
    inputs: Inputs
    in_batches: bool
    learned: bool
    lock: str
    keys: Mapping[str, str]

    @classmethod
    def of(cls, unit: EvaluationUnit) -> Self:
        method, external = unit.method, bool(unit.plan.external)
        return cls(
            unit.dataset.located,
            unit.split,
            method.spec if external else method.located,
            unit.paths,
            unit.plan.seed,
            # post-processors follow the very answers of the method alone
            "" if external else str(unit.known_as.alone),
            Inputs() if external else Inputs.of(method.built),
            unit.in_batches,
            bool(unit.prediction_facts["weights"]),
            unit.lock,
            unit.keys,
        )


# --------------------------------------------------------------------------------------------- cutting
def cut(done: Mapping[EvaluationUnit, Collection[str]]) -> Iterator[list[Task]]:
    """Cut what units lack into shards of nearly equal sizes; a unit's number is its place.

    done: the cases of each that are left out. There may be a million cases, so shards are made one
    at a time.
    """
    frames = [sum(info.frames for info in unit.infos if info.id not in left) for unit, left in done.items()]
    most = min(max(sum(frames) / SHARDS, 1.0), LARGEST)
    shard: list[Task] = []
    held = 0
    for size, task in _tasks(list(done), [frozenset(left) for left in done.values()], PARTS * most):
        if shard and held + size > most:
            yield shard
            shard, held = [], 0
        shard.append(task)
        held += size
    if shard:
        yield shard


def _tasks(
    units: Sequence[EvaluationUnit], done: Sequence[frozenset[str]], most: float
) -> Iterator[tuple[int, Task]]:
    """Tasks and the frames of their answers, the longest batches first: every batch with all units that
    lack any of it, in several tasks where that is more than ``most``."""
    splits: dict[tuple[object, ...], list[int]] = {}
    for number, unit in enumerate(units):
        splits.setdefault((unit.dataset, unit.split, unit.plan.seed), []).append(number)
    ordered: list[tuple[int, tuple[str, ...], list[int]]] = []
    lengths: dict[int, Mapping[str, int]] = {}
    for numbers in splits.values():
        lengths[numbers[0]] = frames = {info.id: info.frames for info in units[numbers[0]].infos}
        for batch in units[numbers[0]].batches:
            ordered.append((sum(frames[case] for case in batch), batch, numbers))
    ordered.sort(key=lambda each: each[0], reverse=True)
    for _, batch, numbers in ordered:
        held, lacking = 0, dict[int, list[str]]()
        for number in numbers:
            if not (cases := [case for case in batch if case not in done[number]]):
                continue
            size = sum(lengths[numbers[0]][case] for case in cases)
            if lacking and held + size > most:
                yield held, Task(batch, lacking)
                held, lacking = 0, {}
            lacking[number] = cases
            held += size
        if lacking:
            yield held, Task(batch, lacking)


# -------------------------------------------------------------------------------------------- in files
@dataclass(frozen=True)
class Content:
    """The content of a stored plan's file.

    common: what all machines must have in common. sizes: the number of answers of each shard. answered: of
    each unit whose sets are to be evaluated, the cases that were answered.
    """

    __pydantic_config__: ClassVar = {"extra": "forbid"}

    plan: Plan
    units: Sequence[Unit]
    common: Mapping[str, str]
    sizes: Sequence[int]
    answered: Sequence[Sequence[str]] = ()


class StoredPlan:
    """A stored plan; its files are read when they are asked for. Raises FileError for damaged ones."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder.resolve()
        self.root = self.folder.parents[1]

    @classmethod
    def write(
        cls,
        plan: Plan,
        units: Sequence[Unit],
        shards: Iterable[Sequence[Task]] = (),
        answered: Sequence[Sequence[str]] = (),
    ) -> Self:
        """Store a plan."""
        stored = cls(plan.out / FOLDER / secrets.token_hex(6))
        sizes = []
        for number, shard in enumerate(shards):
            _write(stored.folder / "tasks" / f"{number}.json", list[Task], shard)
            sizes.append(sum(len(cases) for task in shard for cases in task.lacking.values()))
        data = tuple({unit.dataset for unit in units})
        external = plan.external and plan.external.resolve()
        content = Content(
            replace(plan, datasets=data, external=external),
            units,
            machine_facts(plan, {unit.method for unit in units}, data),
            sizes,
            answered,
        )
        _write(stored.folder / "plan.json", Content, content)
        return stored

    @cached_property
    def content(self) -> Content:
        """The content of ``plan.json``, with results where this machine has them."""
        content: Content = _read(self.folder / "plan.json", Content)
        units = [replace(unit, paths=replace(unit.paths, root=self.root)) for unit in content.units]
        return replace(content, plan=replace(content.plan, out=self.root), units=units)

    @property
    def plan(self) -> Plan:
        return self.content.plan

    @property
    def units(self) -> Sequence[Unit]:
        return self.content.units

    @property
    def shards(self) -> range:
        return range(len(self.content.sizes))

    def tasks(self, number: int) -> list[Task]:
        """The tasks of a shard. Raises BenchError where there is none of this number."""
        path = self.folder / "tasks" / f"{number}.json"
        if not path.exists() and self.content:
            raise BenchError(f"{self.folder} has no shard {number}")
        tasks: list[Task] = _read(path, list[Task])
        return tasks

    def lacking(self, number: int) -> list[Task]:
        """The tasks of a shard without cases that are answered."""
        done = {(unit, entry.case) for unit, entry in self._entries(f"{number}-*.jsonl")}
        tasks = []
        for task in self.tasks(number):
            left = {
                u: [case for case in cases if (u, case) not in done] for u, cases in task.lacking.items()
            }
            if left := {unit: cases for unit, cases in left.items() if cases}:
                tasks.append(replace(task, lacking=left))
        return tasks

    def writer(self, number: int) -> Callable[[int, CaseResult], None]:
        """A function that takes answers of a shard, and writes a line each, at once, to a file of its own.
        It raises FileError. Raises BenchError where the plan was removed."""
        if not (self.folder / "plan.json").exists():
            raise BenchError(f"{self.folder} is gone: its run has ended, or another one continued it")
        return partial(_append, self.folder / "parts" / f"{number}-{secrets.token_hex(6)}.jsonl")

    def answers(self, number: int | None = None) -> Iterator[Answer]:
        """Finished answers, each once, of one shard or of all."""
        seen = set()
        for unit, entry in self._entries("*.jsonl" if number is None else f"{number}-*.jsonl"):
            if (unit, entry.case) not in seen:
                seen.add((unit, entry.case))
                yield unit, entry

    def _entries(self, pattern: str) -> Iterator[tuple[int, CaseResult]]:
        for path in sorted((self.folder / "parts").glob(pattern)):
            with path.open("rb") as file:
                for line in file:
                    with suppress(ValueError, TypeError):  # torn: its process was killed
                        unit, entry = json.loads(line)
                        yield unit, CaseResult(**entry)

    def remove(self) -> None:
        shutil.rmtree(self.folder, ignore_errors=True)
        with suppress(OSError):  # it holds others
            self.folder.parent.rmdir()


def _append(path: Path, unit: int, entry: CaseResult) -> None:
    """Raises FileError."""
    line = json.dumps([unit, vars(entry)], allow_nan=False) + "\n"
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with path.open("ab", buffering=0) as file:
            file.write(line.encode())
    except OSError as error:
        raise FileError(path, f"cannot be written ({error.strerror})") from error


def machine_facts(plan: Plan, methods: Iterable[Spec], data: Iterable[Spec]) -> dict[str, str]:
    """Versions, code and data that results depend on: what all machines of a run must have in common."""
    codes = bound.metrics(plan.metrics).versions
    facts = versions() | {f"metric {name}": code for name, code in codes.items()}
    if plan.external:
        facts["the folder of predictions"] = folder_hash(plan.external)
    else:
        facts |= {f"method {spec.names}": bound.method(spec).code for spec in methods}
    return facts | {
        f"data set {spec.name}": data_of(bound.dataset(spec), plan.task).content for spec in data
    }


def left_over(root: Path, results: Collection[ResultPaths]) -> list[StoredPlan]:
    """Stored plans of runs that ended before they were complete, of any of these results; none of damaged
    files."""
    plans = []
    for path in sorted((root / FOLDER).glob("*/plan.json")):
        stored = StoredPlan(path.parent)
        with suppress(FileError):
            if any(replace(unit.paths, root=root) in results for unit in stored.units):
                plans.append(stored)
    return plans


@cache
def _schema(kind: Any) -> Any:
    from pydantic import TypeAdapter

    return TypeAdapter(kind)


def _write(path: Path, kind: Any, content: object) -> None:
    write_text(path, _schema(kind).dump_json(content).decode() + "\n")


def _read(path: Path, kind: Any) -> Any:
    from pydantic import ValidationError

    try:
        return _schema(kind).validate_python(json.loads(path.read_text(encoding="utf-8")))
    except ValidationError as error:
        problem = (
            f"was stored by another version of retarget-bench ({mistakes(error)}); all machines need one"
        )
        raise FileError(path, problem) from error
    except (OSError, ValueError) as error:
        raise FileError(path, f"is not part of a stored plan ({error}); run bench run again") from error
