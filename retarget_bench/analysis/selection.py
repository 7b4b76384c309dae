"""Selections of the methods and bodies that tables of results are made of."""

import difflib
from collections.abc import Callable, Collection, Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import compress

import numpy as np

from retarget_bench.errors import BenchError
from retarget_bench.plugins import registry
from retarget_bench.plugins.spec import Spec, folded
from retarget_bench.results import case_metadata, dataset_names
from retarget_bench.results.header import MethodInfo
from retarget_bench.results.paths import ResultPaths
from retarget_bench.results.result_matrix import MethodRow, ResultMatrix

PEOPLE, FOUR_LEGGED, MIXED = "people", "four-legged", "mixed"
BODIES = (PEOPLE, FOUR_LEGGED, MIXED)
"""Groups of cases by their source and target: on two legs, on four, and one of each."""


@dataclass(frozen=True)
class Selection:
    """A choice among the methods of results.

    methods:  specs or labels, in any case; () for all.
    variants: whether the variants that methods' cards name are kept beside the methods themselves.
    controls: whether controls are kept; where ``methods`` name any, only those.
    apart:    whether bodies on two and on four legs are told apart.
    """

    methods: tuple[str, ...] = ()
    variants: bool = False
    controls: bool = True
    apart: bool = True

    def parts(self, matrices: Sequence[ResultMatrix]) -> list[ResultMatrix]:
        """The matrices of chosen methods, of the cases that are there and of bodies of one group.

        Raises BenchError for a method without results, and where there is no case yet.
        """
        labels = {row.label for matrix in matrices for row in matrix.rows}
        labels_of = {name: label_of(name, labels) for name in self.methods}
        if strangers := [name for name, label in labels_of.items() if label is None]:
            raise unknown(labels, strangers[0])
        chosen = [self._chosen(matrix, set(labels_of.values())) for matrix in matrices]
        some = [matrix for matrix in chosen if matrix.rows]
        parts = [part for matrix in some for part in by_bodies(matrix)] if self.apart else some
        shown = [part for part in map(so_far, parts) if part.cases or not part.so_far]
        if some and not shown:
            raise BenchError("no case is done by all of these methods yet; ask again later, or for fewer")
        return shown

    def _chosen(self, matrix: ResultMatrix, chosen_labels: set[str | None]) -> ResultMatrix:
        names_control = any(row.label in chosen_labels for row in matrix.rows if row.header.method.control)
        controls = self.controls and not names_control
        rows = [
            row
            for row in matrix.rows
            if row.label in chosen_labels or (controls if row.header.method.control else not chosen_labels)
        ]
        chosen = replace(matrix, rows=tuple(rows), variants=())
        return chosen if chosen_labels or self.variants else without_variants(chosen)


def find(matrix: ResultMatrix, name: str) -> MethodRow | None:
    """The row of a method by its label, or by an equivalent spec; None where it has no results here."""
    rows = {row.label: row for row in matrix.rows}
    return rows.get(label_of(name, rows) or "")


def label_of(name: str, labels: Collection[str]) -> str | None:
    """The label among these that a spec stands for, however it is written (``HuMoT``, ``copy rotations``);
    None where there is none. A name alone also stands for its only row with weights from a path."""
    if name in labels:
        return name
    alike = [label for label in labels if folded(label) == folded(name)]
    if len(alike) == 1:
        return alike[0]
    try:
        label = str(registry.canonical("methods", registry.spelled(name, ("methods",))))
    except BenchError:
        label = name  # of a file that is not known here
    weighted = [each for each in labels if each.startswith(f"{label}[weights=")]
    return label if label in labels else weighted[0] if len(weighted) == 1 else None


def unknown(having: Iterable[str], name: str) -> BenchError:
    """The error for a method that has no results at all: it lists those that have, close names first."""
    labels = sorted(set(having))
    if close := difflib.get_close_matches(name, labels, 3, 0.5):
        return BenchError(f"no results of {name!r} here; did you mean {' or '.join(close)}?")
    return BenchError(f"no results of {name!r} here; there are those of {', '.join(labels)}")


def without_variants(matrix: ResultMatrix) -> ResultMatrix:
    """The matrix without the variants that methods' cards name, beside the methods themselves."""
    labels = {row.header.method.label for row in matrix.rows}
    left = tuple(row.label for row in matrix.rows if is_variant(row.header.method, labels))
    return replace(matrix, rows=tuple(row for row in matrix.rows if row.label not in left), variants=left)


def is_variant(method: MethodInfo, labels: Collection[str]) -> bool:
    """True for a variant that its method's card names, where the method itself is among the labels, too."""
    if not method.parameters or method.posts or method.name not in labels:
        return False
    try:
        card = registry.create("methods", method.name).card
    except BenchError:
        return False
    return method.label in {str(Spec(method.name, changes)) for changes in card.variants}


def so_far(matrix: ResultMatrix) -> ResultMatrix:
    """The cases that all methods have done, so that all numbers are over the same cases and none counts as
    not answered that is only not done yet; without methods that have done none."""
    waiting = [row.header.waiting for row in matrix.rows]
    if not any(waiting):
        return matrix
    done = np.array([[info.id not in each for info in matrix.cases] for each in waiting]) & matrix.own
    begun = done.any(axis=1)
    common = done[begun].all(axis=0) & begun.any()
    (clips, cases), (all_clips, all_cases) = (
        (len(np.unique(matrix.clips[some])), int(some.sum())) for some in (common, matrix.own)
    )
    progress = f"{clips} of {all_clips} clips" if clips < all_clips else f"{cases} of {all_cases} cases"
    shown = tuple(compress(matrix.rows, begun))
    behind = [row.label for row in shown if row.header.waiting]
    whose = f" of {', '.join(behind)}" if len(behind) < len(shown) else ""
    return replace(matrix, rows=shown, so_far=f"{progress} so far{whose}").restricted(common, matrix.part)


def of_dataset(places: Sequence[ResultPaths], name: str) -> list[ResultPaths]:
    """The results on the data set that a name means: the folder of its results, what tables call it, its
    spec (``folder[root=DIR]``), its label or its plug-in, of which the first that fits counts.

    Raises BenchError that lists the data sets where none does.
    """
    if matches := [place for place in places if place.dataset == name]:
        return matches
    headers = dataset_names.headers(places)
    names, slug = dataset_names.shown(headers), _slug(name)
    ways: tuple[Callable[[ResultPaths], str], ...] = (
        names.__getitem__,
        lambda place: "" if place.dataset != slug else name,
        lambda place: headers[place].dataset.label,
        lambda place: headers[place].dataset.name,
    )
    for called in ways:
        if matches := [place for place in places if called(place) == name]:
            return matches
    datasets = ", ".join(dataset_names.listed(headers))
    roots = ", ".join(dict.fromkeys(str(place.root) for place in places))
    raise BenchError(f"no results of {name} in {roots}; there are those of {datasets}")


def of_splits(places: Sequence[ResultPaths], names: Sequence[str]) -> list[ResultPaths]:
    """The results on these splits; () for all. Raises BenchError that lists those that there are."""
    there = dict.fromkeys(place.split for place in places)
    if unknown := [split for split in names if split not in there]:
        raise BenchError(f"no results of split {unknown[0]!r} here; there are {', '.join(there)}")
    return [place for place in places if place.split in names or not names]


def _slug(spec: str) -> str:
    """The folder of results on the data set of a spec; "" where it is none, or its files are not there."""
    from retarget_bench.plugins import bound

    try:
        return bound.dataset(spec).slug
    except BenchError:
        return ""


def of_bodies(matrices: Sequence[ResultMatrix], bodies: str = "") -> list[ResultMatrix]:
    """The cases of one group of bodies, which the data set's name then says; see ``group_of_bodies``."""
    parts = [part for matrix in matrices for part in by_bodies(matrix)]
    group = group_of_bodies([part.bodies for part in parts], bodies)
    if group == "all":
        return list(matrices)
    return [replace(part, dataset=f"{part.dataset}: {group}") for part in parts if part.bodies == group]


def group_of_bodies(there: Sequence[str], bodies: str) -> str:
    """The group of bodies to show out of those that there are: of ``BODIES``, or ``all``.

    bodies: what is asked for; "": people, or all where there are none. Raises BenchError where there are
    none of these bodies.
    """
    if bodies not in ("", "all", *there):
        groups = ", ".join(dict.fromkeys(filter(None, there)))
        groups = groups or "no groups of bodies: these results are older than those"
        raise BenchError(f"no case is between bodies of the group {bodies!r}; there are {groups}")
    return bodies or (PEOPLE if PEOPLE in there else "all")


def by_bodies(matrix: ResultMatrix) -> list[ResultMatrix]:
    """A matrix for each group of bodies; the matrix itself where results do not say how bodies stand."""
    groups = bodies_of_cases(matrix)
    if "" in groups:
        return [matrix]
    return [
        replace(matrix.restricted(groups == group, matrix.part), bodies=group)
        for group in BODIES
        if group in groups
    ]


def bodies_of_cases(matrix: ResultMatrix) -> np.ndarray:
    """``(cases,)`` the group of bodies of every case; "" where results do not say how bodies stand."""
    legs: dict[str, str] = {}
    for row in matrix.rows:
        own = case_metadata.read(row.paths).legs
        if not own:
            return np.full(len(matrix.cases), "", dtype=object)
        legs |= own
    kinds = {"2": PEOPLE, "4": FOUR_LEGGED}
    pairs: dict[tuple[str, str], str] = {}
    for pair in {(info.source, info.target) for info in matrix.cases}:
        both = {legs[name] for name in pair if name in legs}
        pairs[pair] = kinds[both.pop()] if len(both) == 1 else MIXED
    return np.array([pairs[info.source, info.target] for info in matrix.cases], dtype=object)
