"""The header of a result file: method, data, versions, counts and failures.

A header is written with its fields in this order, and checked against their types as it is read.
"""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, fields, replace
from functools import lru_cache
from typing import Any, TypeVar

from retarget_bench.api import SPLITS, Direction, Parameters, TrainingShare, Unreadable, Value
from retarget_bench.errors import mistakes
from retarget_bench.plugins.spec import Spec

SCHEMA = 5
STATUSES = ("ok", "unsupported", "invalid", "failed", "missing")
"""``missing``: scoring was asked for and no prediction was there."""
AUTHORS = "authors-"
"""The beginning of the label of weights by a paper's authors; the head of their hash follows."""
WAITING = "not done yet"
"""The message of cases that a run has not come to."""
ELSEWHERE = "predictions made elsewhere"
"""The origin of a method whose predictions were given as files."""


@dataclass(frozen=True, kw_only=True)
class MethodInfo:
    """A method as its results name it.

    posts:      its post-processors, in order, each with ``name`` and ``parameters``.
    code:       the hash of the code that made the predictions.
    environment: of a method of another environment its ``name``, ``lock`` (hash of all that is installed),
                interpreter, platform, and the versions of a few ``packages``.
    root_rule:  what the root's path is scaled by, as the method or the last post-processor that moves it
                says; "": unknown.
    trained_on: what the weights were trained on (characters, structures, kinds, clips); None: untrained;
                empty: not known.
    folders:    parameter -> the folder, its name alone, that its local weights were read from.
    training_share: see ``Method``; None: not known.
    authors_weights: see ``MethodCard``.
    """

    name: str = ""
    label: str
    summary: str = ""
    parameters: Parameters = field(default_factory=dict)
    posts: tuple[Mapping[str, Any], ...] = ()
    origin: str = ""
    version: str | None = ""
    code: str | None = ""
    privileged: tuple[str, ...]
    control: bool
    stochastic: bool = False
    root_rule: str = ""
    environment: Mapping[str, Any] = field(default_factory=dict)
    trained_on: Mapping[str, tuple[str, ...]] | None = None
    training_share: TrainingShare | None = None
    authors_weights: str = ""
    folders: Mapping[str, str] = field(default_factory=dict)

    @property
    def is_by_authors(self) -> bool:
        """Whether its weights are those of its paper's authors."""
        return str(self.parameters.get("weights", "")).startswith(AUTHORS)

    @property
    def shown(self) -> str:
        """The label with local weights by their folder and their hash: ``pan[weights=mine-1d1eaf33]``."""
        changed = {
            name: str(self.parameters[name]).replace("local", folder, 1)
            for name, folder in self.folders.items()
            if name in self.parameters
        }
        return str(Spec.parse(self.label).with_parameters(**changed)) if changed else self.label

    @property
    def external(self) -> bool:
        return self.origin == ELSEWHERE


@dataclass(frozen=True, kw_only=True)
class DatasetInfo:
    """A data set as results name it; ``content`` identifies the data. splits: see ``DatasetCard``.
    unreadable: its files that cannot be read, which have no case."""

    name: str = ""
    parameters: Parameters = field(default_factory=dict)
    label: str
    version: str = ""
    content: str
    splits: Mapping[str, str] = field(default_factory=lambda: SPLITS)
    notes: tuple[str, ...]
    unreadable: Unreadable | None = None


@dataclass(frozen=True, kw_only=True)
class DeclaredValue:
    """A value as its metric declared it when the results were scored: see ``api.Value``.

    metric: the metric's name.
    """

    label: str
    meaning: str
    unit: str
    better: Direction
    goal: float
    tolerance: float
    index: str
    with_self: bool
    formula: str = ""
    protocol: Mapping[str, str] = field(default_factory=dict)
    needs: tuple[str, ...] = ()
    metric: str = ""
    doubt: str = ""

    @classmethod
    def of(cls, value: Value, metric: str) -> DeclaredValue:
        shared = {each.name for each in fields(cls)} & {each.name for each in fields(value)}
        return cls(**{name: getattr(value, name) for name in shared}, metric=metric)


@dataclass(frozen=True, kw_only=True)
class Counts:
    """Numbers of cases: asked for, and by outcome."""

    asked: int
    ok: int
    unsupported: int = 0
    invalid: int = 0
    failed: int = 0
    missing: int = 0

    @classmethod
    def of(cls, statuses: Iterable[str]) -> Counts:
        """The counts of cases that ended like this."""
        counts = Counter(statuses)
        ended: dict[str, Any] = {name: counts[name] for name in STATUSES}
        return cls(asked=counts.total(), **ended)


@dataclass(frozen=True, kw_only=True)
class Problem:
    """Cases without values, for one reason, or (``doubted``) with values that are doubted."""

    status: str
    message: str
    cases: tuple[str, ...]


@dataclass(frozen=True, kw_only=True)
class MetricFault:
    """Answered cases that lack the values of a metric, because it failed."""

    metric: str
    message: str
    cases: tuple[str, ...]


@dataclass(frozen=True, kw_only=True)
class ResultHeader:
    """The header of the results of one method on one split.

    set_values:     value id -> declaration, of values of whole sets.
    four_legged:    four-legged structures among the characters, where cases have no references.
    keys:           ``prediction_key`` and ``score_key``: what results are recognised by.
    metrics:        metric -> ``version+code``.
    values:         value id -> declaration.
    problems, faults: cases without values, and those that lack the values of a metric alone.
    doubts:         answered cases whose answers look as if they were written under another convention.
    date:           when the results were made, in a form that sorts.
    not_applicable: value id -> ``cases`` and ``reason``, where a method refused rewritten questions.
    files:          end of a file's name (``csv``, ``cases.csv``) -> its SHA-256 (``store.checksum``).
    """

    set_values: Mapping[str, DeclaredValue] = field(default_factory=dict)
    four_legged: tuple[str, ...] | None = None
    schema: int = SCHEMA
    keys: Mapping[str, str]
    task: str = ""
    split: str = ""
    method: MethodInfo
    dataset: DatasetInfo
    metrics: Mapping[str, str]
    values: Mapping[str, DeclaredValue]
    counts: Counts
    problems: tuple[Problem, ...]
    faults: tuple[MetricFault, ...] = ()
    doubts: tuple[Problem, ...] = ()
    seeds: tuple[int, ...] = ()
    versions: Mapping[str, str] = field(default_factory=dict)
    revision: str = ""
    date: str = ""
    not_applicable: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    files: Mapping[str, str] = field(default_factory=dict)

    @property
    def declared(self) -> dict[str, DeclaredValue]:
        """Every value id -> declaration."""
        return {**self.values, **self.set_values}

    @property
    def unanswered(self) -> frozenset[str]:
        """The cases without values, for any reason."""
        return frozenset(case for each in self.problems for case in each.cases)

    @property
    def waiting(self) -> frozenset[str]:
        """The cases that a run has not come to."""
        return frozenset(case for each in self.problems if each.message == WAITING for case in each.cases)

    def counted(self, ids: set[str]) -> ResultHeader:
        """The header with the counts, problems and faults of these cases only."""
        problems, faults = _of_cases(self.problems, ids), _of_cases(self.faults, ids)
        doubts = _of_cases(self.doubts, ids)
        status = {case: each.status for each in problems for case in each.cases}
        counts = replace(Counts.of(status.values()), asked=len(ids), ok=len(ids) - len(status))
        return replace(self, counts=counts, problems=problems, faults=faults, doubts=doubts)


L = TypeVar("L", Problem, MetricFault)


def _of_cases(listed: Iterable[L], ids: set[str]) -> tuple[L, ...]:
    kept = (replace(each, cases=tuple(sorted(ids & set(each.cases)))) for each in listed)
    return tuple(each for each in kept if each.cases)


def parsed(facts: object) -> ResultHeader:
    """A header from its JSON object. Raises ValueError naming what it lacks, or what is of another type."""
    from pydantic import ValidationError  # only those who read results pay for it

    try:
        header: ResultHeader = _reader().validate_json(json.dumps(facts), strict=True)
    except ValidationError as error:
        raise ValueError(mistakes(error)) from error
    return header


@lru_cache(maxsize=1)
def _reader() -> Any:
    from pydantic import TypeAdapter

    return TypeAdapter(ResultHeader)
