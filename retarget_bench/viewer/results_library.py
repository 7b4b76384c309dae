"""Finding results, cases and files by name, for everything that shows motion."""

import difflib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

from retarget_bench.api import Case, CaseInfo, Prediction
from retarget_bench.errors import BenchError, FileError
from retarget_bench.evaluation.predict import Outcome
from retarget_bench.figures import method_order
from retarget_bench.motion import files
from retarget_bench.plugins.prediction_check import verified
from retarget_bench.plugins.spec import Spec
from retarget_bench.results import predictions, store
from retarget_bench.results.store import CaseResult, ResultPaths


@dataclass(frozen=True, eq=False)
class StoredResults:
    """The results of one method on one split.

    label:   what people call the method. dataset: the data set, without where its files lie.
    task:    with its parameters (``denoise[levels=5]``). content: of the data, "" where it was not written.
    key:     what predictions are known by, "" likewise.
    entries: case -> what came of it. cases: what is known of every case without loading it. Cases that a
    run has not come to are in neither.
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
        values = entry.values if entry is not None else {}
        return {name: value for name, value in values.items() if not isinstance(value, dict)}

    def outcome(self, case: Case) -> Outcome:
        """The stored prediction, or a status with a message: it is never asked for anew."""
        entry = self.entries.get(case.info.id)
        if entry is None:
            return Outcome("missing", "this case was not run")
        if entry.status != "ok":
            return Outcome(entry.status, entry.message)
        path = self.place.prediction(case.info.id)
        if not path.exists():
            return Outcome("missing", "its prediction is not there any more; bench run makes it again")
        if self.key and predictions.stored_key(path) != store.case_key(
            {"prediction_key": self.key}, case.info.id
        ):
            return Outcome("missing", "the prediction that is there is not the one that was scored")
        try:
            prediction: Prediction = predictions.read_prediction(path, case.target, case.source.fps)
            return Outcome("ok", prediction=verified(prediction, case))
        except BenchError as error:
            return Outcome("invalid", str(error))


def read_stored(place: ResultPaths) -> StoredResults:
    """The results at a place; read once while they stay the same. Raises FileError."""
    try:
        changed = (place.header if place.complete else place.journal).stat().st_mtime_ns
    except OSError as error:
        raise FileError(place.header, f"cannot be read ({error.strerror})") from error
    return _read(place, changed)


@lru_cache(maxsize=256)
def _read(place: ResultPaths, changed: int) -> StoredResults:
    del changed
    results = store.read_results(place)
    header, waiting = results.header, results.header.waiting
    label = header.method.shown
    _, dot, seed = place.method.rpartition(".seed-")
    if dot and seed.isdecimal():  # not the first seed
        label = f"{label}, seed {int(seed)}"
    return StoredResults(
        place=place,
        label=label,
        dataset=Spec(header.dataset.name, header.dataset.parameters),
        task=header.task or place.task,
        content=header.dataset.content,
        key=header.keys.get("prediction_key", ""),
        entries={entry.case: entry for entry in results.entries if entry.case not in waiting},
        cases={case: info for case, info in results.cases.items() if case not in waiting},
    )


def listed(places: Sequence[ResultPaths]) -> list[str]:
    """The ids of all cases of these results, in their order."""
    return list(dict.fromkeys(case for place in places for case in read_stored(place).cases))


MOTION_FILES = files.suffixes()
"""Endings of motion files; ``.npz`` is also that of predictions."""


def case(places: Sequence[ResultPaths], name: str) -> tuple[list[ResultPaths], str]:
    """The results that list the case which a name means, and its id.

    A name is an id, the name of a prediction file, or a part of an id that no other has.
    Raises BenchError where it means none, several, or the case is in the results of several data sets.
    """
    match = matching(listed(places), name)
    having = [place for place in places if match in read_stored(place).cases]
    if len(folders := sorted({f"{place.dataset}/{place.task}" for place in having})) > 1:
        raise BenchError(f"{match} is in the results of {', '.join(folders)}; choose one by -d or --task")
    return having, match


def matching(ids: Sequence[str], name: str) -> str:
    """The one id among those known that a name means. Raises BenchError."""
    if name in ids:
        return name
    stem = name.removesuffix(".npz")
    for fits in (
        [each for each in ids if store.case_file(each) == stem],
        [each for each in ids if name in each],
    ):
        if len(fits) == 1:
            return fits[0]
        if fits:
            raise BenchError(
                f"{name!r} may be {len(fits)} cases, such as {', '.join(map(repr, fits[:3]))}; "
                "give more of the name, in quotes, since > means something to a shell"
            )
    near = ", ".join(map(repr, difflib.get_close_matches(name, ids, 3, 0.4) or ids[:3]))
    raise BenchError(f"no case is called {name!r}" + (f"; near it: {near}" if near else ": there is none"))


def colours(roots: Iterable[Path]) -> dict[str, str]:
    """Label -> ``#rrggbb`` of every method with results under some folders, as in their reports and plots;
    {} where they cannot be ranked."""
    places = method_order.everything(roots)
    try:
        return _colours(tuple((place, place.any_header.stat().st_mtime_ns) for place in places))
    except (BenchError, OSError):
        return {}


@lru_cache(maxsize=8)
def _colours(places: tuple[tuple[ResultPaths, int], ...]) -> dict[str, str]:
    """The colours, cached while headers are the same: a page that watches a run asks often."""
    return method_order.colours(method_order.ranked(place for place, _ in places))


def are_files(names: Sequence[str]) -> bool:
    """True for names of motion files, false for a case. Raises BenchError for a mixture."""
    paths = {name: files.split_take(name)[0] for name in names}
    motions = [name for name in names if paths[name].suffix.lower() in MOTION_FILES]
    motions += [name for name in names if name not in motions and paths[name].is_file()]
    if motions and len(motions) < len(names):
        other = next(name for name in names if name not in motions)
        raise BenchError(f"{other!r} is no motion file, and {motions[0]} is; show either files or a case")
    return bool(motions)


def place_of(path: Path) -> tuple[ResultPaths, str] | None:
    """The results that a prediction file lies in, and the id of its case; None where it lies elsewhere."""
    parents = path.resolve().parents
    if path.suffix.lower() != ".npz" or len(parents) < 5:
        return None
    place = ResultPaths(parents[4], parents[3].name, parents[2].name, parents[1].name, parents[0].name)
    if not place.any_header.exists():
        return None
    fits = [each for each in read_stored(place).cases if store.case_file(each) == path.stem]
    return (place, fits[0]) if fits else None
