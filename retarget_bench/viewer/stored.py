"""What results say of single cases: a method's entries and stored predictions, and the data set of both."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache

from retarget_bench.api import Case, CaseInfo, Prediction
from retarget_bench.errors import BenchError, FileError
from retarget_bench.evaluation import predict
from retarget_bench.evaluation.predict import Outcome
from retarget_bench.files import digest
from retarget_bench.plugins.spec import Spec
from retarget_bench.results import store
from retarget_bench.results.store import CaseResult, ResultPaths


@dataclass(frozen=True, eq=False)
class Told:
    """The results of one method on one split.

    label:   what people call the method. dataset: the data set, without where its files lie.
    task:    with its parameters (``denoise[levels=5]``). content: of the data, "" where it was not written.
    key:     what predictions are known by, "" likewise.
    entries: case -> what came of it. cases: what is known of every case without loading it.
    """

    place: ResultPaths
    label: str
    dataset: Spec
    task: str
    content: str
    key: str
    entries: Mapping[str, CaseResult]
    cases: Mapping[str, CaseInfo]

    def values(self, case: str) -> dict[str, float]:
        """The case's numbers; curves are left out."""
        entry = self.entries.get(case)
        found = entry.values if entry is not None else {}
        return {name: value for name, value in found.items() if not isinstance(value, dict)}

    def outcome(self, case: Case) -> Outcome:
        """The stored prediction, or a status with a message: it is never asked for anew."""
        entry = self.entries.get(case.info.id)
        if entry is None:
            return Outcome("missing", "this case was not run")
        if entry.status != "ok":
            return Outcome(entry.status, entry.message)
        path = self.place.prediction(case.info.id)
        if not path.exists():
            return Outcome("missing", "its prediction is not there any more; bench predict makes it again")
        if self.key and predict.stored_key(path) != digest(f"{self.key}\n{case.info.id}", 16):
            return Outcome("missing", "the prediction that is there is not the one that was scored")
        try:
            found: Prediction = predict.read_prediction(path, case.target, case.source.fps)
            return Outcome("ok", prediction=predict.verified(found, case))
        except BenchError as error:
            return Outcome("invalid", str(error))


def told(place: ResultPaths) -> Told:
    """The results at a place, read once as long as they stay the same. Raises FileError."""
    try:
        changed = place.header.stat().st_mtime_ns
    except OSError as error:
        raise FileError(place.header, f"cannot be read ({error.strerror})") from error
    return _told(place, changed)


@lru_cache(maxsize=256)
def _told(place: ResultPaths, changed: int) -> Told:
    del changed
    results = store.read_results(place)
    header = results.header
    about = header.dataset
    return Told(
        place=place,
        label=_label(place, header.method.label),
        dataset=Spec(about.name, about.parameters),
        task=header.task or place.task,
        content=about.content,
        key=header.keys.get("prediction_key", ""),
        entries={entry.case: entry for entry in results.entries},
        cases=results.cases,
    )


def _label(place: ResultPaths, method: str) -> str:
    """The method, with the seed where this is not the first one."""
    _, dot, seed = place.method.rpartition(".seed-")
    return f"{method}, seed {int(seed)}" if dot and seed.isdecimal() else method


def listed(places: Sequence[ResultPaths]) -> dict[str, CaseInfo]:
    """Every case that any of these results lists, by id, in their order."""
    found: dict[str, CaseInfo] = {}
    for place in places:
        for each in told(place).cases.values():
            found.setdefault(each.id, each)
    return found
