"""Checks of a submission's numbers: possible, alone and together, and none left out."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from retarget_bench.api import Case, CaseInfo, Dataset, Metric, OwnSets, SetMetric, optional
from retarget_bench.errors import FileError
from retarget_bench.evaluation import set_metrics
from retarget_bench.evaluation.predict import as_scored
from retarget_bench.evaluation.score import score
from retarget_bench.plugins import bound, registry
from retarget_bench.plugins.bound import BoundMetrics
from retarget_bench.results import columns, store
from retarget_bench.results.columns import Columns
from retarget_bench.results.compatibility import metric_versions, newest
from retarget_bench.results.header import DeclaredValue, ResultHeader
from retarget_bench.results.store import ResultPaths

LARGEST = 1e12
"""Size from which a number is none that any motion gives."""
CLOSE = 1e-6
"""Relative difference up to which numbers of nine digits agree."""
LOOKED_AT = 20
"""Cases of which the values are compared with those that any answer has."""
FACTS = ("unit", "better", "goal", "index", "with_self")
"""Of a value's declaration, what decides how its numbers are read."""
WORLD, ROOT, JOINT = "mpjpe_h.world", "mpjpe_h.root", "mpjpe_h.joint"
ENDS_WORLD, ENDS_ROOT = "ee_h.world", "ee_h.root"
ALONG, UP = "root_path.horizontal", "root_path.vertical"


@dataclass(frozen=True)
class Rows:
    """The rows of one split, with what they are checked against.

    table:    a row per case, a column per value, without curves; nan where a case lacks a value.
    answered: the cases that have rows.
    metrics:  those of single cases that scored the rows, as they are installed here.
    """

    found: Columns
    data: Dataset
    table: pd.DataFrame
    answered: tuple[CaseInfo, ...]
    metrics: tuple[Metric, ...]


def read(place: ResultPaths, header: ResultHeader, data: Dataset) -> Rows:
    """The rows of a result. Raises FileError where they are damaged."""
    found = columns.read(place, header, newest([header]))
    plain = {name: column for (name, point), column in found.numbers.items() if not point}
    table = pd.DataFrame(plain, index=[info.id for info in found.cases])
    answered = tuple(info for info in found.cases if info.id not in header.unanswered)
    return Rows(found, data, table, answered, installed(header).of_cases)


def installed(header: ResultHeader) -> BoundMetrics:
    """The metrics of a result that are installed here."""
    working = registry.working("metrics")[0]
    return bound.metrics(tuple(name for name in header.metrics if name in working))


def other_versions(header: ResultHeader) -> set[str]:
    """The metrics of a result that are installed here in another version."""
    return {name for name, ours in installed(header).versions.items() if header.metrics[name] != ours}


def newer_versions(header: ResultHeader) -> set[str]:
    """The metrics of a result that are installed here in an earlier version."""
    said = metric_versions(header)
    here = {metric.card.name: str(metric.card.version) for metric in installed(header).built}
    return {name for name, ours in here.items() if (len(said[name]), said[name]) > (len(ours), ours)}


def same(one: float, other: Any) -> bool:
    """True for numbers that are equal to nine digits."""
    return abs(one - other) <= CLOSE * max(abs(one), abs(other), CLOSE)


def wrong(rows: Rows) -> Iterator[str]:
    """Everything that is wrong with the numbers of one split, as sentences."""
    yield from _declarations(rows.found.header, rows.found.paths.task)
    yield from _impossible(rows)
    yield from _contradictions(rows)
    yield from _sets(rows)
    yield from _left_out(rows)


def _declarations(header: ResultHeader, task: str) -> Iterator[str]:
    """Metrics that take part in every run, and values of one, that a header lacks or declares otherwise."""
    others = other_versions(header)
    for name, metric in registry.working("metrics")[0].items():
        if name not in header.metrics:
            usual = registry.find("metrics", name).origin == registry.BUILT_IN
            if usual and task in optional.metric_tasks(metric):
                yield f"there are no values of {name}; score all metrics"
            continue
        for value in metric.card.computed:
            said, ours = header.declared.get(value.id), DeclaredValue.of(value, name)
            if said is None and name not in others:
                yield f"the header lacks {value.id} of {name}"
            elif said and (other := [f for f in FACTS if getattr(said, f) != getattr(ours, f)]):
                yield f"the header declares another {other[0]} of {value.id} than its metric"


# ------------------------------------------------------------------------------------------- possible
def _allowed(metric: Metric | SetMetric, name: str, number: float) -> bool:
    """Whether a metric can give such a number of a value."""
    return abs(number) < LARGEST and all(v.allows(number) for v in metric.card.computed if v.id == name)


def _impossible(rows: Rows) -> Iterator[str]:
    """Of every value the first number that no motion gives."""
    working = registry.working("metrics")[0]
    declared = rows.found.header.values
    broken: dict[str, str] = {}
    for (name, point), column in rows.found.numbers.items():
        if name not in declared:
            broken[name] = f"the header does not say what {name} is"
        elif bool(point) != bool(declared[name].index):
            broken[name] = f"{name} is {'a' if point else 'no'} curve"
        elif metric := working.get(declared[name].metric):
            for at in np.flatnonzero(~np.isnan(column)):
                if not _allowed(metric, name, column[at]):
                    told = f"{name} of {rows.found.cases[at].id} is {column[at]:g}, which is not possible"
                    broken.setdefault(name, told)
    yield from broken.values()


def _contradictions(rows: Rows) -> Iterator[str]:
    """Values of which no motion has all: of every rule the first case that breaks it.

    Those of ``position``, by which methods are ranked, are means over frames of distances e of joints, of
    which that of the hips is r: a mean goes with its parts, none of them exceeds the whole, and
    |e - r| differs from |e| by at most |r|.
    """
    named = [WORLD, ROOT, ALONG, UP, ENDS_WORLD, ENDS_ROOT]
    table = rows.table.reindex(columns=named)
    world, root, along, up, ends, ends_root = (table[name] for name in named)
    joints = _of_joints(rows)
    count, near = joints["size"], CLOSE * table.max(axis=1).clip(lower=CLOSE)
    rules = {
        f"{JOINT} and {ROOT}": ~((joints["mean"] - root).abs() <= near),
        f"{WORLD} and {ALONG}": along > world * count + near,
        f"{WORLD} and {UP}": up > world * count + near,
        f"{WORLD} and {ROOT}": (world - root).abs() > along + up + near,
        f"{ENDS_WORLD} and {ENDS_ROOT}": (ends - ends_root).abs() > along + up + near,
        f"{ENDS_WORLD} and {WORLD}": ends > world * count + near,
        f"{ENDS_ROOT} and {ROOT}": ends_root > root * count + near,
    }
    there = table[named[:4]].notna().all(axis=1)
    for rule, broken in rules.items():
        for case in table.index[there & broken][:1]:
            yield f"{rule} of {case} cannot be true together"


def _of_joints(rows: Rows) -> pd.DataFrame:
    """Of every case the ``mean`` of the errors of its joints, nan where there is none, and their ``size``.

    Raises FileError where the file beside the rows does not hold them.
    """
    paths = rows.found.paths
    try:
        arrays = store.read_arrays(paths)
        errors = pd.Series(arrays[f"{JOINT}:values"], arrays[f"{JOINT}:cases"], dtype=float)
    except (KeyError, ValueError, TypeError) as error:
        raise FileError(paths.arrays, f"does not hold {JOINT} ({error})") from error
    return errors.groupby(level=0).agg(["mean", "size"]).reindex(rows.table.index)


# ------------------------------------------------------------------------------------------- left out
def _sets(rows: Rows) -> Iterator[str]:
    """Values of sets that are not possible, or left out: every structure that was answered has some."""
    bodies, working = rows.data.characters(), registry.working("metrics")[0]
    one_of = {bodies[info.target].structure: info for info in rows.answered if info.target in bodies}
    cases = [rows.data.load(info) for info in one_of.values()]
    values = set_metrics.read(rows.found.paths)
    for name, said in rows.found.header.set_values.items():
        if (metric := working.get(said.metric)) is None:
            continue
        wanted = {metric.set_of(c) if isinstance(metric, OwnSets) else c.target.structure for c in cases}
        mine = [each for each in values if each.value_id == name]
        if gone := {each for each in wanted if each} - {each.structure for each in mine}:
            yield f"values of {name} are left out: of {', '.join(sorted(gone)[:3])}"
        for each in mine:
            shown = [number for number in (each.value, each.floor) if number is not None]
            if not all(_allowed(metric, name, number) for number in shown):
                yield f"{name} of {each.structure} is {each.value}, floor {each.floor}: not possible"


def _left_out(rows: Rows) -> Iterator[str]:
    """Values that cases lack though any answer has them; of cases that lack the same two are tried."""
    has = rows.table.loc[[info.id for info in rows.answered]].notna()
    alike = [has.drop_duplicates(keep=which).index for which in ("first", "last")]
    infos = {info.id: info for info in rows.answered}
    for case in list(dict.fromkeys([*alike[0], *alike[1]]))[:LOOKED_AT]:
        always = _always(rows.metrics, rows.data.load(infos[case]))
        if gone := sorted(always & rows.found.header.values.keys() - set(has.columns[has.loc[case]])):
            yield f"{case} has no {', '.join(gone[:3])}, though every answer to it has"


def _always(metrics: tuple[Metric, ...], case: Case) -> set[str]:
    """The numbers that the reference has, and also positions that are elsewhere in every frame."""
    right = case.reference
    if right is None:
        return set()
    away = np.random.default_rng(0).normal(scale=case.target.height, size=(right.frames, 1, 3))
    jumping = case.target.positions(right.positions + away, right.fps)
    each = (score(metrics, case, as_scored(answer)).values for answer in (right, jumping))
    return set.intersection(
        *({name for name, v in values.items() if isinstance(v, float)} for values in each)
    )
