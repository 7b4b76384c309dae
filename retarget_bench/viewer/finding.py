"""What people mean when they name a case, methods, or files that are to be shown."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Sequence
from functools import lru_cache
from pathlib import Path

from retarget_bench.analysis import pairwise
from retarget_bench.errors import BenchError
from retarget_bench.figures import method_order
from retarget_bench.results import store
from retarget_bench.results.store import ResultPaths
from retarget_bench.viewer.stored import listed, told

MOTION_FILES = (".bvh", ".npz")


def results(
    roots: Sequence[Path], task: str = "retarget", dataset: str | None = None, methods: Sequence[str] = ()
) -> list[ResultPaths]:
    """The results under some folders, of a data set and of methods where these are named, in their order.

    dataset: a folder name under a root. Raises BenchError where there are none.
    """
    found = [place for root in roots for place in store.find_results(root, task)]
    places = [place for place in found if dataset in (None, place.dataset)]
    if not places:
        where = ", ".join(map(str, roots))
        known = ", ".join(sorted({place.dataset for place in found}))
        hint = f"there are results of {known}" if known else "bench run makes some"
        raise BenchError(f"no results{f' of {dataset}' if dataset else ''} in {where}; {hint}")
    return of_methods(places, methods) if methods else places


def of_methods(places: Sequence[ResultPaths], names: Sequence[str]) -> list[ResultPaths]:
    """Those of these methods, in the order of the names. Raises BenchError for one without results."""
    label_of = {place: told(place).label for place in places}
    labels = {label.rpartition(", seed ")[0] or label for label in label_of.values()}
    chosen: list[ResultPaths] = []
    for name in names:
        label = pairwise.label_of(name, labels)
        if label is None:
            near = difflib.get_close_matches(name, labels, 3, 0.5) or sorted(labels)
            raise BenchError(f"no results of {name!r} here; there are those of {', '.join(near)}")
        chosen += [
            place
            for place, known in label_of.items()
            if known == label or known.startswith(f"{label}, seed ")
            if place not in chosen
        ]
    return chosen


def case(places: Sequence[ResultPaths], name: str) -> tuple[list[ResultPaths], str]:
    """The results that list the case which a name means, and its id.

    A name is an id, the name of a prediction file, or a part of an id that no other has.
    Raises BenchError where it means none, several, or the case is in the results of several data sets.
    """
    found = matching(listed(places), name)
    having = [place for place in places if found in told(place).cases]
    if len(folders := sorted({f"{place.dataset}/{place.task}" for place in having})) > 1:
        raise BenchError(f"{found} is in the results of {', '.join(folders)}; choose one by -d or --task")
    return having, found


def matching(ids: Iterable[str], name: str) -> str:
    """The one id that a name means. Raises BenchError."""
    known = list(ids)
    if name in known:
        return name
    stem = name.removesuffix(".npz")
    for fits in (
        [each for each in known if store.case_file(each) == stem],
        [each for each in known if name in each],
    ):
        if len(fits) == 1:
            return fits[0]
        if fits:
            raise BenchError(
                f"{name!r} may be {len(fits)} cases, such as {', '.join(map(repr, fits[:3]))}; "
                "give more of the name, in quotes, since > means something to a shell"
            )
    near = difflib.get_close_matches(name, known, 3, 0.4) or known[:3]
    raise BenchError(f"no case is called {name!r}; near it: {', '.join(map(repr, near))}")


def colours(roots: Iterable[Path]) -> dict[str, str]:
    """Label -> ``#rrggbb`` of every method with results under some folders, as in their reports and plots;
    {} where they cannot be ranked."""
    places = method_order.everything(roots)
    try:
        return _colours(tuple((place, place.header.stat().st_mtime_ns) for place in places))
    except (BenchError, OSError):
        return {}


@lru_cache(maxsize=8)
def _colours(places: tuple[tuple[ResultPaths, int], ...]) -> dict[str, str]:
    """Of results that have not changed since they were asked for: who watches a run asks often."""
    return method_order.colours(method_order.ranked(place for place, _ in places))


def are_files(names: Sequence[str]) -> bool:
    """Whether names are those of motion files, not of a case. Raises BenchError for a mixture."""
    files = [name for name in names if Path(name).suffix.lower() in MOTION_FILES]
    files += [name for name in names if name not in files and Path(name).is_file()]
    if files and len(files) < len(names):
        other = next(name for name in names if name not in files)
        raise BenchError(f"{other!r} is no motion file, and {files[0]} is; show either files or a case")
    return bool(files)


def place_of(path: Path) -> tuple[ResultPaths, str] | None:
    """The results that a prediction file lies in, and the id of its case; None where it lies elsewhere."""
    parents = path.resolve().parents
    if path.suffix.lower() != ".npz" or len(parents) < 5:
        return None
    place = ResultPaths(parents[4], parents[3].name, parents[2].name, parents[1].name, parents[0].name)
    if not place.header.exists():
        return None
    fits = [each for each in told(place).cases if store.case_file(each) == path.stem]
    return (place, fits[0]) if fits else None
