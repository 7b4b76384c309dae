"""``rb.Results``: results in a folder, as data frames, tables, comparisons, motion and reports."""

from __future__ import annotations

import re
import secrets
import shutil
from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property
from os import PathLike
from pathlib import Path

import numpy as np
import pandas as pd

from retarget_bench import defaults
from retarget_bench.analysis import statistics
from retarget_bench.analysis.selection import bodies_of_cases, of_bodies, of_splits
from retarget_bench.api import TASKS
from retarget_bench.errors import BenchError, FileError
from retarget_bench.figures import method_order
from retarget_bench.options import listed
from retarget_bench.python.arguments import checked, takes
from retarget_bench.python.motions import Motion, with_rotations
from retarget_bench.python.progress import stepped
from retarget_bench.python.views import Comparison, ListFrame, Player, TableView
from retarget_bench.report import writing
from retarget_bench.report.writing import ReportOptions
from retarget_bench.results import result_matrix, store
from retarget_bench.results.result_matrix import ResultMatrix
from retarget_bench.results.store import ResultPaths
from retarget_bench.tables import builder, comparing, names, requested
from retarget_bench.tables.comparing import PairOptions
from retarget_bench.tables.model import count
from retarget_bench.tables.requested import Request
from retarget_bench.viewer import results_library, scene_builder

CASE = ("case", "source", "target", "bodies", "clip", "kind", "frames")
ROW = ("dataset", "split", "method", "seed", *CASE, "value_id", "index", "value")


class Results:
    """Results of some methods on some splits, as they lie in a folder.

    Nothing is computed here, and nothing is kept in memory that is not in the folder. Make them by
    ``rb.run``, or from a folder by ``rb.load_results``.

    places: paths of the results. variants: tables show variants of methods, such as copied rotations with
    other root rules, as after a run that names its methods. Raises BenchError where there are no results,
    or of several tasks.
    """

    def __init__(self, places: Sequence[ResultPaths], variants: bool = False) -> None:
        self.places, self.variants = tuple(places), variants
        if not self.places:
            raise BenchError("there are no such results")
        if len(tasks := sorted({place.task for place in places})) > 1:
            raise BenchError(f"these are results of several tasks, {', '.join(tasks)}; load one of them")

    def __repr__(self) -> str:
        names = ", ".join(self.methods)
        splits = "; ".join(
            f"{each.split} of {each.dataset}: {count(int(each.own.sum()), 'case')}"
            for each in self._matrices
        )
        where = ", ".join(dict.fromkeys(str(place.root) for place in self.places))
        return f"<Results of {names} ({splits}) in {where}>"

    @property
    def methods(self) -> list[str]:
        """The methods, as tables call them."""
        return list(dict.fromkeys(row.label for each in self._matrices for row in each.rows))

    @property
    def splits(self) -> list[str]:
        return list(dict.fromkeys(each.split for each in self._matrices))

    @cached_property
    def _matrices(self) -> list[ResultMatrix]:
        return result_matrix.result_matrices(self.places)

    @checked
    def only(self, methods: str | Sequence[str] = (), splits: str | Sequence[str] = ()) -> Results:
        """The results of some methods, on some splits. Raises BenchError for those that there are not."""
        names = [methods] if isinstance(methods, str) else list(methods)
        places = of_splits(self.places, [splits] if isinstance(splits, str) else list(splits))
        if names:
            places = method_order.of_methods(places, names)
        return Results(places, self.variants or bool(names))

    # ------------------------------------------------------------------------------------------ numbers
    @property
    def rows(self) -> pd.DataFrame:
        """Every number, one per row: ``dataset``, ``split``, ``method``, ``seed``, the case (``case``,
        ``source``, ``target``, ``bodies``, ``clip``, ``kind``, ``frames``), ``value_id``, ``index`` and
        ``value``.

        bodies: ``people``, ``four-legged`` or ``mixed``; "" in results that are older than these groups.
        index: the point of a curve, or "". Cases without an answer have no row: see ``problems``.
        Values per joint and frame, and values of whole sets such as FID, are in tables.
        """
        frames = []
        for matrix in self._matrices:
            cases = pd.DataFrame({name: _facts(matrix, name) for name in CASE})
            for row in matrix.rows:
                for paths, run in zip(row.all_paths, row.runs, strict=True):
                    numbers = np.array([*run.values()]).reshape(len(run), len(matrix.cases))
                    value, case = np.nonzero(matrix.own & ~np.isnan(numbers))
                    frame = cases.iloc[case].reset_index(drop=True)
                    frame[["value_id", "index"]] = np.array([*run], dtype=object).reshape(-1, 2)[value]
                    frame["value"] = numbers[value, case]
                    frame["dataset"], frame["split"] = matrix.dataset, matrix.split
                    frame["method"] = row.label
                    frame["seed"] = (store.read_header(paths.any_header).seeds or (0,))[0]
                    frames.append(frame)
        return pd.concat(frames, ignore_index=True)[list(ROW)].infer_objects()

    @property
    def problems(self) -> pd.DataFrame:
        """The cases that a method did not answer: ``dataset``, ``split``, ``method``, ``case``, ``status``
        (``unsupported``, ``invalid``, ``failed``, ``missing``) and ``message``; not those that a run has
        yet to do. Files that cannot be read are ``unreadable`` cases of no split and method."""
        rows = [
            (matrix.dataset, matrix.split, row.label, case, each.status, each.message)
            for matrix in self._matrices
            for row in matrix.rows
            for each in row.header.problems
            for case in each.cases
            if case not in row.header.waiting
        ]
        data = {matrix.dataset: row.header.dataset for matrix in self._matrices for row in matrix.rows}
        unreadable = [
            (dataset, "", "", file, "unreadable", problem)
            for dataset, facts in data.items()
            for file, problem in (facts.unreadable.problems.items() if facts.unreadable else ())
        ]
        columns = ["dataset", "split", "method", "case", "status", "message"]
        return pd.DataFrame([*unreadable, *rows], columns=columns)

    @checked
    def worst(
        self,
        method: str,
        value: str = builder.DEFAULT_COLUMNS[0],
        *,
        splits: str | Sequence[str] = (),
        n: int = 5,
        bodies: str = "",
    ) -> pd.DataFrame:
        """The cases in which a value of a method is worst, worst first: split, case, source, target,
        bodies, clip, kind, and the number under the value's id.

        value: an id or a name of it, such as ``MPJPE``. bodies: as for ``table``.
        A value that is best at a goal is worst where |ln(value / goal)| is largest. Raises BenchError for a
        method or value without results, for a value that has no number per case (a curve, FID), and for one
        of which neither end is better.
        """
        chosen = self.only(method, splits)
        frames, reasons = [], {}
        for matrix in of_bodies(chosen._matrices, bodies):
            of_cases, of_sets = names.declared([matrix])
            value_id = names.value_id(value, of_cases | of_sets)
            names.check_of_cases(value_id, of_cases, of_sets)
            facts = matrix.values[value_id]
            if facts.better == "none":
                raise BenchError(f"{value_id} is a description: no number of it is worse than another")
            (numbers,) = matrix.numbers((value_id, ""))
            loss = statistics.losses(numbers[None], facts.better, facts.goal)[0]
            frame = pd.DataFrame(
                {"split": matrix.split} | {name: _facts(matrix, name) for name in CASE[:-1]}
            )
            frames.append(
                frame.assign(**{value_id: numbers, "loss": loss})[matrix.own & ~np.isnan(numbers)]
            )
            reasons[matrix.split] = comparing.lacking(matrix, matrix.rows[0], value_id)
        if not any(map(len, frames)):
            why = "; ".join(dict.fromkeys(filter(None, reasons.values()))) or "no case is answered"
            raise BenchError(f"no answer of {method} has a {facts.label} ({value_id}): {why}")
        worst = pd.concat(frames).sort_values("loss", ascending=False, kind="stable")
        return ListFrame(worst.drop(columns="loss").head(n).reset_index(drop=True))

    # ------------------------------------------------------------------------------------- what is shown
    @takes(Request)
    def table(self, options: Request) -> TableView:
        """The table of ``bench table``: text by ``str``, rich in notebooks, numbers in ``.frame``.

        Raises BenchError for values and bodies that no result has.
        """
        request = replace(options, variants=options.variants or self.variants)
        return TableView(lambda form: requested.tables(self.places, request, form))

    @takes(PairOptions)
    def compare(self, options: PairOptions) -> Comparison:
        """Two methods value by value on every split: difference, 95 % interval, p-value and a verdict.

        Tests are over source clips, paired, and adjusted for the values compared. Raises BenchError for
        methods or values without results.
        """
        matrices = comparing.matrices_of(self.places, options)
        columns = listed(options.columns) if options.columns else None
        return Comparison(comparing.compare(matrices, options.first, options.second, columns, options.all))

    @checked
    def show(self, case: str, methods: str | Sequence[str] = (), *, overlay: bool = False) -> Player:
        """A player of a case: source, reference, and the answers of all methods or of these.

        case: its id, or a part of it that no other case has. Raises BenchError for an unknown case.
        """
        having, case_id = results_library.case(self.only(methods).places, case)
        scene = scene_builder.of_case(having, case_id)
        return Player(replace(scene, colours=results_library.colours(self._roots)), overlay)

    @checked
    def motion(self, case: str, of: str = "reference") -> Motion:
        """A motion of a case, to be saved or looked at: of ``source``, ``reference`` or a method's answer.

        case: as for ``show``. Raises BenchError where there is no such motion, with the reason.
        """
        scene = self.show(case, [of] if of in self.methods else ()).scene
        figures = {figure.label: figure for figure in scene.figures}
        if of not in figures:
            raise BenchError(f"{scene.title} has no {of!r}; there are {', '.join(figures)}")
        figure = figures[of]
        if figure.positions is None:
            raise BenchError(f"{of} has no answer to {scene.title} ({figure.status}): {figure.message}")
        return with_rotations(figure.motion or figure.character.positions(figure.positions, scene.fps))

    @takes(ReportOptions)
    def report(self, options: ReportOptions) -> Path:
        """Write one page with tables, charts and motion that opens from disk, or, where its name ends in
        ``.pdf``, for a paper's appendix, and return its path.

        Raises BenchError for another ending, and where a ``.pdf`` is asked for motion.
        """
        with stepped("report", options.progress) as over:
            writing.write(options, self._roots, only=self.places, variants=self.variants, over=over)
        return options.page

    @property
    def _roots(self) -> list[Path]:
        return list(dict.fromkeys(place.root for place in self.places))

    # --------------------------------------------------------------------------------------------- files
    @checked
    def save(self, folder: str | PathLike[str], *, overwrite: bool = False) -> Path:
        """Copy these results, and nothing else, to a new folder, predictions included; returns its path.

        The folder appears when all is there. overwrite: replace results that are there. Raises BenchError
        where the folder exists, two of these results would have one name, or one is not complete.
        """
        folder = Path(folder)
        if begun := [place.method for place in self.places if not place.complete]:
            raise BenchError(
                f"the results of {begun[0]} are not complete; a run without clips and limit does the rest, "
                "and then they can be saved"
            )
        inside = [place.header.relative_to(place.root) for place in self.places]
        if len(set(inside)) < len(inside):
            raise BenchError("these are results of one method in several folders; save them one by one")
        if any(place.root.resolve() == folder.resolve() for place in self.places):
            raise BenchError(f"{folder} is where these results lie")
        if folder.exists():
            _check_replaceable(folder, overwrite)
        new_folder = folder.with_name(f".{secrets.token_hex(6)}.{folder.name[-40:]}")
        old = new_folder.with_name(f"{new_folder.name}.old")
        try:
            for place in self.places:
                _copy(place, replace(place, root=new_folder).folder)
            if folder.exists():
                folder.rename(old)
            new_folder.rename(folder)
        except OSError as error:
            raise FileError(folder, f"cannot be written ({error.strerror or error})") from error
        finally:
            shutil.rmtree(new_folder, ignore_errors=True)
        shutil.rmtree(old, ignore_errors=True)
        return folder


def _facts(matrix: ResultMatrix, name: str) -> np.ndarray:
    """``(cases,)`` a column of ``CASE``: a fact of every case."""
    if name == "bodies":
        return bodies_of_cases(matrix)
    attribute = "id" if name == "case" else name
    return np.array([getattr(info, attribute) for info in matrix.cases], dtype=object)


def _check_replaceable(folder: Path, overwrite: bool) -> None:
    """Raises BenchError for a folder with anything but results in it, and for one with results unless these
    are to be overwritten."""
    inside = [each.relative_to(folder).parts for each in folder.rglob("*") if not each.is_dir()]
    strange = [
        parts for parts in inside if len(parts) < 4 or re.sub(r"-[0-9a-f]{8}$", "", parts[1]) not in TASKS
    ]
    if not folder.is_dir() or strange:
        raise BenchError(f"{folder} holds other files than results, and is not overwritten")
    if inside and not overwrite:
        raise BenchError(f"{folder} is there; overwrite=True replaces the results in it")


def _copy(place: ResultPaths, there: Path) -> None:
    """Copy every file of one method on one split, and the metadata of its cases, to a folder."""

    def others(folder: str, names: Sequence[str]) -> list[str]:
        inside = Path(folder) != place.folder  # predictions
        return [each for each in names if not (inside or _belongs(each, place.method))]

    shutil.copytree(place.folder, there, ignore=others, dirs_exist_ok=True)


def _belongs(name: str, method: str) -> bool:
    """True for a file of a method, ``ik.csv`` and ``ik.sets.csv``, but not ``ik.seed-1.csv``, its folder of
    predictions, and the metadata of cases."""
    rest = name.removeprefix(f"{method}.")
    own = rest != name and not rest.startswith("seed-") and not rest.endswith(("journal", "features"))
    return own or name == method or name.startswith("cases.")


@checked
def load_results(*folders: str | PathLike[str], task: str = TASKS[0]) -> Results:
    """Results that ``rb.run`` or ``bench run`` made, in one folder or several, ``runs`` by default.

    Methods of equal names in several folders are told apart by their folders. Raises BenchError where a
    folder has none.
    """
    places: list[ResultPaths] = []
    for folder in map(Path, folders or (defaults.OUT,)):
        if not (here := store.find_results(folder, task)):
            of = "" if task == TASKS[0] else f"task={task!r}, "
            raise BenchError(f"no results in {folder}; rb.run(..., {of}out={str(folder)!r}) makes some")
        places += here
    return Results(places)
