"""The header of a result file: what ran, on what, with which versions, and what went wrong.

A header is read once, here, and written with its fields in this order. Fields that this version does not
know are kept as ``extra``.

Headers of schema 1 do not say what the files beside them hold (``files``), which is then not checked.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import MISSING, dataclass, field, fields, replace
from types import UnionType
from typing import Any, Literal, TypeVar, Union, get_args, get_origin, get_type_hints

from retarget_bench.api import SPLITS, Direction, Parameters, Value

SCHEMA = 2
STATUSES = ("ok", "unsupported", "invalid", "failed", "missing")
"""``missing``: scoring was asked for and no prediction was there."""
WAITING = "not done yet"
"""The message of cases that a run has not come to."""
ELSEWHERE = "predictions made elsewhere"
"""The origin of a method whose predictions were given as files."""


@dataclass(frozen=True, kw_only=True)
class _Part:
    extra: Mapping[str, Any] = field(default_factory=dict)

    def plain(self) -> dict[str, Any]:
        """The part as it is written; optional fields that say nothing are left out."""
        names = [each.name for each in fields(self) if each.name != "extra"]
        found = {name: _plain(getattr(self, name)) for name in names}
        kept = {key: value for key, value in found.items() if key not in OPTIONAL or value != OPTIONAL[key]}
        return kept | dict(self.extra)


@dataclass(frozen=True, kw_only=True)
class MethodInfo(_Part):
    """A method as its results name it.

    posts:      its post-processors, in order, each with ``name`` and ``parameters``.
    code:       the hash of the code that made the predictions.
    environment: of a method of another environment its ``name``, ``lock`` (hash of all that is installed),
                interpreter, platform, and the versions of a few ``packages``.
    trained_on: what the weights were trained on (characters, structures, kinds, clips); None: untrained.
    training_share: frames that training has seen, over those of the paper's training; None: not known.
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
    environment: Mapping[str, Any] = field(default_factory=dict)
    trained_on: Mapping[str, tuple[str, ...]] | None = None
    training_share: float | None = None

    @property
    def external(self) -> bool:
        return self.origin == ELSEWHERE

    def plain(self) -> dict[str, Any]:
        found = super().plain()
        if self.external:
            del found["trained_on"]
        return found


@dataclass(frozen=True, kw_only=True)
class DatasetInfo(_Part):
    """A data set as results name it; ``content`` identifies the data. splits: see ``DatasetCard``."""

    name: str = ""
    parameters: Parameters = field(default_factory=dict)
    label: str
    version: str = ""
    content: str
    splits: Mapping[str, str] = field(default_factory=lambda: SPLITS)
    notes: tuple[str, ...]


@dataclass(frozen=True, kw_only=True)
class DeclaredValue(_Part):
    """A value as its metric declared it when the results were scored: see ``api.Value``.

    metric: the metric's name; "" in headers of earlier versions, which did not say it.
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
class Counts(_Part):
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
        found = Counter(statuses)
        ended: dict[str, Any] = {name: found[name] for name in STATUSES}
        return cls(asked=found.total(), **ended)


@dataclass(frozen=True, kw_only=True)
class Problem(_Part):
    """Cases without values, for one reason."""

    status: str
    message: str
    cases: tuple[str, ...]


@dataclass(frozen=True, kw_only=True)
class MetricFault(_Part):
    """Answered cases that lack the values of a metric, because it failed."""

    metric: str
    message: str
    cases: tuple[str, ...]


@dataclass(frozen=True, kw_only=True)
class StoredFile(_Part):
    """A file beside the header as it was written: see ``checksums``.

    rows: of a table, else None. footer: the hash of the size and of the end of a Parquet file.
    """

    sha256: str
    rows: int | None = None
    footer: str = ""


@dataclass(frozen=True, kw_only=True)
class ResultHeader(_Part):
    """The header of the results of one method on one split.

    set_values:     value id -> declaration, of values of whole sets.
    networks:       set metric -> target structure -> hash of what makes its features.
    four_legged:    four-legged structures among the characters, where cases have no references.
    keys:           ``prediction_key`` and ``score_key``: what results are recognised by.
    metrics:        metric -> ``version+code``.
    values:         value id -> declaration.
    problems, faults: cases without values, and those that lack the values of a metric alone.
    date:           when the results were made, in a form that sorts.
    not_applicable: value id -> ``cases`` and ``reason``, where a method refused rewritten questions.
    files:          end of a file's name (``csv``, ``cases.csv``) -> what was written to it.
    """

    set_values: Mapping[str, DeclaredValue] = field(default_factory=dict)
    networks: Mapping[str, Mapping[str, str]] = field(default_factory=dict)
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
    seeds: tuple[int, ...] = ()
    device: str = ""
    threads: int = 1
    versions: Mapping[str, str] = field(default_factory=dict)
    revision: str = ""
    date: str = ""
    not_applicable: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    files: Mapping[str, StoredFile] = field(default_factory=dict)

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

    def parts(self) -> Iterable[_Part]:
        """The header and all its parts, each with ``extra`` fields of its own."""
        listed = (*self.problems, *self.faults, *self.declared.values())
        return (self, self.method, self.dataset, self.counts, *listed)

    def counted(self, ids: set[str]) -> ResultHeader:
        """The header with the counts, problems and faults of these cases only."""
        problems, faults = _of_cases(self.problems, ids), _of_cases(self.faults, ids)
        status = {case: each.status for each in problems for case in each.cases}
        counts = replace(Counts.of(status.values()), asked=len(ids), ok=len(ids) - len(status))
        return replace(self, counts=counts, problems=problems, faults=faults)


L = TypeVar("L", Problem, MetricFault)


def _of_cases(listed: Iterable[L], ids: set[str]) -> tuple[L, ...]:
    kept = (replace(each, cases=tuple(sorted(ids & set(each.cases)))) for each in listed)
    return tuple(each for each in kept if each.cases)


def _plain(value: Any) -> Any:
    if isinstance(value, _Part):
        return value.plain()
    if isinstance(value, Mapping):
        return {key: _plain(each) for key, each in value.items()}
    return tuple(map(_plain, value)) if isinstance(value, tuple) else value


OPTIONAL: dict[str, Any] = {
    "posts": (),
    "training_share": None,
    "environment": {},
    "protocol": {},
    "faults": (),
    "set_values": {},
    "networks": {},
    "four_legged": None,
    "not_applicable": {},
    "files": {},
    "splits": SPLITS,
    "rows": None,
    "footer": "",
}
"""Fields that are not written while they hold this."""

LISTED: dict[str, type[_Part]] = {"problems": Problem, "faults": MetricFault}
NESTED: dict[str, type[_Part]] = {"method": MethodInfo, "dataset": DatasetInfo, "counts": Counts}
MAPPED: dict[str, type[_Part]] = {
    "values": DeclaredValue,
    "set_values": DeclaredValue,
    "files": StoredFile,
}
"""Fields that hold several parts, those that hold one, and those that hold several by name."""
_TYPES = {kind.__name__: get_type_hints(kind) for kind in _Part.__subclasses__()}
_FIELDS = {
    kind.__name__: (
        {each.name: each for each in fields(kind) if each.name != "extra"},
        [each.name for each in fields(kind) if each.default is each.default_factory is MISSING],
    )
    for kind in _Part.__subclasses__()
}
"""Name of a part -> its fields by name, and the names of those that have to be there."""


def parsed(facts: object) -> ResultHeader:
    """A header from its JSON object. Raises ValueError naming what it lacks, or what is of another type."""
    header: ResultHeader = _part(ResultHeader, facts, "it")
    return header


def _part(kind: type[_Part], facts: object, where: str) -> Any:
    given = _object(facts, where)
    known, required = _FIELDS[kind.__name__]
    said = {name: _field(name, value) for name, value in given.items() if name in known}
    if lacking := [name for name in required if name not in given]:
        raise ValueError(f"{where} lacks {', '.join(lacking)}")
    types = _TYPES[kind.__name__]
    for name, value in said.items():
        if not _fits(value, types[name]):
            place = name if kind is ResultHeader else f"{where}.{name}"
            raise ValueError(f"{place} is {given[name]!r:.40}, which is no {known[name].type}")
    return kind(**said, extra={name: value for name, value in given.items() if name not in known})


def _fits(value: Any, kind: Any) -> bool:
    """Whether a value read from JSON, its lists as tuples, is of a type that fields are declared with."""
    inside = get_args(kind)
    if not inside:
        number = isinstance(value, int if kind is int else int | float) and not isinstance(value, bool)
        return number if kind in (int, float) else kind is Any or isinstance(value, kind)
    origin = get_origin(kind)
    if origin is Literal:
        return value in inside
    if origin is UnionType or origin is Union:
        return any(_fits(value, each) for each in inside)
    if origin is tuple:
        return isinstance(value, tuple) and all(_fits(each, inside[0]) for each in value)
    return isinstance(value, Mapping) and all(_fits(each, inside[1]) for each in value.values())


def _field(name: str, value: Any) -> Any:
    if name in NESTED:
        return _part(NESTED[name], value, name)
    if name in LISTED:
        if not isinstance(value, list | tuple):
            raise ValueError(f"{name} is no list")
        return tuple(_part(LISTED[name], each, name) for each in value)
    if name in MAPPED:
        parts = _object(value, name).items()
        return {key: _part(MAPPED[name], each, f"{name}.{key}") for key, each in parts}
    return _without_lists(value)


def _without_lists(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {key: _without_lists(each) for key, each in value.items()}
    return tuple(value) if isinstance(value, list) else value


def _object(facts: object, where: str) -> Mapping[str, Any]:
    if not isinstance(facts, Mapping):
        raise ValueError(f"{where} is no JSON object")
    return facts
