"""The cases offered by the live view: of finished or running results, or of motion files."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from retarget_bench.errors import BenchError
from retarget_bench.evaluation import plan
from retarget_bench.figures import method_order
from retarget_bench.plugins import registry
from retarget_bench.plugins.spec import Spec
from retarget_bench.results import store
from retarget_bench.results.store import ResultPaths
from retarget_bench.viewer import results_library, scene_builder
from retarget_bench.viewer.results_library import StoredResults, read_stored, read_unfinished, unfinished
from retarget_bench.viewer.scene import Scene


@dataclass
class CaseList:
    """Cases to choose from.

    roots: of results. dataset: a folder name under them. data: the data set itself, where results do not
    tell it. root: where its files lie, if not as usual. files: shown in place of results.
    """

    roots: Sequence[Path] = ()
    task: str = "retarget"
    dataset: str | None = None
    methods: Sequence[str] = ()
    data: Spec | None = None
    root: str | None = None
    files: Sequence[Path] = ()
    _told: list[StoredResults] = field(default_factory=list)
    problem: str = ""

    def refresh(self) -> list[str]:
        """The ids of all cases that there are now, in the order of the results; one, "", of files.

        ``problem`` says why results that are being made cannot be shown; "" where all can.
        """
        if self.files:
            return [""]
        self.problem = ""
        found = [self._read(place) for place in self._places()]
        self._told = [each for each in found if each is not None]
        return list(dict.fromkeys(case for each in self._told for case in each.cases))

    def scene(self, case: str) -> Scene:
        """What there is of a case now. Raises BenchError."""
        if self.files:
            return scene_builder.of_files(self.files)
        having = [each for each in self._told if case in each.cases]
        if not having:
            raise BenchError(f"there are no results of case {case!r} any more")
        first = having[0].place
        same = [
            each for each in having if (each.place.dataset, each.place.task) == (first.dataset, first.task)
        ]
        spec = self.data or having[0].dataset
        data = spec if self.root is None else spec.with_parameters(root=self.root)
        return scene_builder.of_stored(same, case, data, results_library.colours(self.roots))

    def _places(self) -> list[ResultPaths]:
        """Finished results, then those that are being made."""
        done = [place for root in self.roots for place in store.find_results(root, self.task)]
        begun = [place for root in self.roots for place in unfinished(root, self.task)]
        if self.methods:
            named = {_slug(name) for name in self.methods}
            begun = [place for place in begun if place.method in named]
            running = {place.method for place in begun}
            finished = [name for name in self.methods if _slug(name) not in running]
            done = method_order.of_methods(done, finished) if finished else []
        return [place for place in (*done, *begun) if self.dataset in (None, place.dataset)]

    def _read(self, place: ResultPaths) -> StoredResults | None:
        try:
            return (
                read_stored(place)
                if place.header.exists()
                else read_unfinished(place, self.data, self.root)
            )
        except BenchError as error:
            self.problem = str(error)
            return None


def _slug(name: str) -> str:
    """What the results of a method are called, however its name is written."""
    try:
        return plan.known_as(registry.canonical("methods", Spec.parse(name))).slug
    except BenchError:
        return name
