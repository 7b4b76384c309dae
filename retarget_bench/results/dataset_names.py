"""Names of the data sets of results: their labels, told apart where two data sets have the same one.

The folder of a data set's results is made of its parameters and of what its files hold (``dataset_slug``),
so that two roots of one data set have two, whatever the roots are called.
"""

from collections.abc import Iterable, Mapping

from retarget_bench.results import store
from retarget_bench.results.header import ResultHeader
from retarget_bench.results.paths import ResultPaths


def headers(places: Iterable[ResultPaths]) -> dict[ResultPaths, ResultHeader]:
    """Place -> its header. Raises FileError for a damaged one."""
    return {place: store.read_header(place.any_header) for place in places}


def shown(there: Mapping[ResultPaths, ResultHeader]) -> dict[ResultPaths, str]:
    """Place -> what tables call its data set: the label, with the folder where others are called alike."""
    folders: dict[str, set[str]] = {}
    for place, header in there.items():
        folders.setdefault(header.dataset.label, set()).add(place.dataset)
    return {
        place: label if len(folders[label := header.dataset.label]) == 1 else f"{label} ({place.dataset})"
        for place, header in there.items()
    }


def listed(there: Mapping[ResultPaths, ResultHeader]) -> list[str]:
    """The folder of every data set, with its label where that is another word: what ``-d`` takes."""
    labels = {place.dataset: header.dataset.label for place, header in there.items()}
    return [name if name == labels[name] else f"{name} ({labels[name]})" for name in sorted(labels)]
