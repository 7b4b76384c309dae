"""Scenes of stored results, of predictions made now, and of motion files."""

import difflib
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any
from zipfile import BadZipFile

import numpy as np

from retarget_bench.analysis.selection import of_dataset
from retarget_bench.api import Case, CaseInfo, Dataset, Prediction
from retarget_bench.api.comparison import Comparison
from retarget_bench.errors import BenchError, FileError
from retarget_bench.evaluation import plan
from retarget_bench.evaluation.predict import Outcome, context_for, predict
from retarget_bench.evaluation.tasks import RETARGET
from retarget_bench.figures import method_order
from retarget_bench.files import digest
from retarget_bench.motion import importer
from retarget_bench.motion.character import Character, Positions
from retarget_bench.motion.file_kinds import kind_of
from retarget_bench.motion.files import split_take
from retarget_bench.motion.files.smpl import amass
from retarget_bench.motion.fitting.fit import fit
from retarget_bench.motion.motion import resampled_frames
from retarget_bench.plugins import bound, registry
from retarget_bench.plugins.spec import Spec
from retarget_bench.results import store
from retarget_bench.results.predictions import read_prediction
from retarget_bench.results.store import ResultPaths
from retarget_bench.viewer import results_library
from retarget_bench.viewer.results_library import StoredResults, listed, read_stored
from retarget_bench.viewer.scene import Figure, Scene, distinct, figure_of

Over = Callable[[Collection[Any]], Iterable[Any]]
"""Goes over items, and may show how far it is."""
REFERENCE = "reference"
INPUTS = ("source", REFERENCE)
"""Labels of the figures that every case may have."""


def of_case(places: Sequence[ResultPaths], case_id: str, *, dataset: Spec | None = None) -> Scene:
    """A case of stored results: source, reference, and the prediction of every place, in their order.

    places that do not list the case (those of another split) are passed over. A prediction that is missing,
    or not the one that was scored, is a figure without positions and with a message. dataset: instead of
    the one that the results name. Raises BenchError where no place lists the case, or it cannot be loaded.
    """
    having = [each for each in map(read_stored, places) if case_id in each.cases]
    if not having:
        raise _unknown(case_id, listed(places))
    return of_stored(having, case_id, dataset)


def of_stored(
    having: Sequence[StoredResults],
    case_id: str,
    dataset: Spec | None = None,
    colours: Mapping[str, str] | None = None,
) -> Scene:
    """Likewise of results that were read already, all of which list the case. colours: of methods."""
    first = having[0]
    data = plan.data_of(bound.dataset(dataset or first.dataset), first.task)
    cases = data.cases(Spec.parse(first.task).name, first.place.split)
    if (info := next((each for each in cases if each.id == case_id), None)) is None:
        raise BenchError(
            f"{data.label} has no case {case_id!r} any more, though {first.place.cases} lists it; run again"
        )
    case = _loaded(data, info)
    changed = Outcome("missing", "these results are of other data than are here now; run again")
    answers = [
        (each.label, changed if each.content and each.content != data.content else each.outcome(case))
        for each in having
    ]
    return _scene(case, answers, [each.values(case_id) for each in having], colours or {})


def of_case_asked(
    dataset: Spec, name: str, methods: Sequence[Spec], *, task: str = RETARGET, over: Over = iter
) -> Scene:
    """A case of a data set with predictions made now; nothing is stored.

    name: as ``results_library.matching`` takes it. task: as in ``bench run --task``.
    Raises BenchError for an unknown case or method.
    """
    data = plan.data_of(bound.dataset(dataset), task)
    cases = (data.cases(Spec.parse(task).name, split) for split in data.card.splits)
    infos = {info.id: info for each in cases for info in each}
    case_id = results_library.matching(list(infos), name)
    case = _loaded(data, infos[case_id])
    answers = []
    for spec in over([registry.canonical("methods", each) for each in methods]):
        method = bound.method(spec).built
        seed = store.case_seed(0, str(bound.method(spec).known_as.alone), case_id)
        answers.append((str(spec), predict(method, case, context_for(method, data, case, seed))))
    return _scene(case, answers)


def dressed(scene: Scene, over: Over = iter) -> Scene:
    """The scene with rotations for every figure whose body has a skin and that is known by positions
    alone.

    Rotations are fitted to the positions (``motion.fitting``), which stay as they are; the figure's
    ``message`` says how far the fitted joints are from them. Raises BenchError where a position is not
    finite.
    """
    return replace(scene, figures=tuple(_dressed(each, scene.fps) for each in over(scene.figures)))


def _dressed(figure: Figure, fps: float) -> Figure:
    if figure.positions is None or figure.character.mesh is None or figure.has_skin:
        return figure
    fitted = fit(Positions(figure.character, figure.positions, fps))
    message = f"skin by rotations fitted to positions: {fitted}"
    return replace(figure, motion=fitted.motion, message="; ".join(filter(None, (figure.message, message))))


# ----------------------------------------------------------------------------------------- the case
def _loaded(data: Dataset, info: CaseInfo) -> Case:
    case = data.load(info)
    if case.source.frames == 0:
        raise BenchError(f"case {info.id}: its source has no frames, so there is nothing to show")
    return case


def _unknown(case_id: str, ids: Sequence[str]) -> BenchError:
    near = difflib.get_close_matches(case_id, ids, 3, 0.5) or ids[:3]
    return BenchError(
        f"these results have no case {case_id!r}"
        + (f"; near it: {', '.join(near)}" if near else ", and no other")
    )


def _answer(label: str, case: Case, outcome: Outcome) -> Figure:
    """A method's answer, or the reason why there is none."""
    if outcome.prediction is None:
        return Figure(
            label, "prediction", case.target, None, status=outcome.status, message=outcome.message
        )
    drawn = figure_of(label, "prediction", outcome.prediction)
    compared = _compared(case, outcome.prediction)
    if compared is None or compared.distances is None:
        return drawn
    scored = compared.joints
    shares = 100.0 * compared.distances[:, scored] / compared.height
    by_joint = np.full(len(case.target.skeleton), np.nan)
    by_joint[scored] = shares.mean(axis=0)
    return replace(drawn, error=shares.mean(axis=1), joint_error=by_joint)


def _source(case: Case) -> Figure:
    """The source; of points, also the motion that they are of, where it is known."""
    drawn = figure_of("source", "source", case.source)
    if case.source_motion is None or drawn.points is None:
        return drawn
    return replace(figure_of("source", "source", case.source_motion), points=drawn.points)


def _compared(case: Case, motion: Prediction) -> Comparison | None:
    """A motion of the target beside its case; None where the target has no height to measure by."""
    return Comparison(case, motion) if case.target.height > 0 else None


def _scene(
    case: Case,
    answers: Sequence[tuple[str, Outcome]],
    values: Sequence[dict[str, float]] = (),
    colours: Mapping[str, str] | None = None,
) -> Scene:
    """The source, the reference where the case has one, and an answer of every method, by its label.

    The control of that name answers with the reference, which is shown once.
    """
    figures = [_source(case)]
    if case.reference is not None:
        compared = _compared(case, case.reference)
        schedule = compared.contact_labels if compared else None
        labels = None if schedule is None else (tuple(schedule.joints.tolist()), schedule.planted)
        figures.append(figure_of("reference", "reference", case.reference, labels))
    once = case.reference is not None
    names = [REFERENCE if once and label == REFERENCE else "" for label, _ in answers]
    others = iter(
        distinct([label for (label, _), name in zip(answers, names, strict=True) if not name], INPUTS)
    )
    names = [name or next(others) for name in names]
    figures += [
        _answer(name, case, outcome)
        for name, (_, outcome) in zip(names, answers, strict=True)
        if not (once and name == REFERENCE)
    ]
    info = case.info
    return Scene(
        title=f"{info.clip}: {info.source} to {info.target}",
        figures=tuple(figures),
        fps=float(case.source.fps),
        case=info.id,
        split=info.split,
        kind=info.kind,
        ground=case.ground,
        values=dict(zip(names, values, strict=False)),
        colours=colours or {},
    )


SAME_RATE = 1e-3
"""Share by which two rates may differ and still count as one: frame times in files are rounded."""


def of_files(
    paths: Sequence[str | Path], labels: Sequence[str] | None = None, *, body: Character | None = None
) -> Scene:
    """Motion files and prediction files (``.npz``) as one scene, at the rate of the first, as long as the
    shortest; the ``message`` of every figure that was changed says how.

    labels: of the files; their names by default. A prediction file holds no bones: it is of ``body``, or of
    the first motion file given here that has its joints.
    Raises FileError for files that cannot be read, and BenchError where there is no frame or no file.
    """
    files = [Path(path) for path in paths]
    if not files:
        raise BenchError("there is no file to show; give motion or prediction files")
    return of_motions(_read(files, body), labels if labels is not None else [path.stem for path in files])


def of_motions(motions: Sequence[Prediction], labels: Sequence[str]) -> Scene:
    """Motions as one scene, likewise. Raises BenchError where one has no frame."""
    names = distinct(list(labels))
    fps = float(motions[0].fps)
    length = min(resampled_frames(motion.frames, motion.fps, fps) for motion in motions)
    if length == 0:
        raise BenchError(f"{', '.join(names)}: one of these has no frames")
    figures = []
    for name, motion in zip(names, motions, strict=True):
        shown, change = _fitted(motion, fps, length)
        figures.append(replace(figure_of(name, "motion", shown), message=change))
    return Scene(title=", ".join(names), figures=tuple(figures), fps=fps)


def _read(files: Sequence[Path], body: Character | None) -> list[Prediction]:
    """Every file's motion, in their order; predictions last, since they need the bodies of the others."""
    motions: dict[Path, Prediction] = {}
    for path in files:
        if kind_of(split_take(path)[0]).name != "NPZ" or amass.holds_motion(path):
            motions[path] = importer.load(path).motion
    bodies = [body] if body is not None else [motion.character for motion in motions.values()]
    for path in files:
        if path not in motions:
            motions[path] = _prediction(path, bodies)
    return [motions[path] for path in files]


def _prediction(path: Path, bodies: Sequence[Character]) -> Prediction:
    """A prediction file as a motion of the first of these bodies that has its joints."""
    try:
        with path.open("rb") as opened, np.load(opened) as file:
            joints = [str(name) for name in np.atleast_1d(file["joints"])] if "joints" in file else []
            fps = float(file["fps"]) if "fps" in file else 30.0
    except (OSError, ValueError, TypeError, EOFError, BadZipFile) as error:
        raise FileError(path, f"is not a readable .npz file ({error})") from error
    for body in bodies:
        if not joints or set(body.skeleton.names) <= set(joints):
            prediction: Prediction = read_prediction(path, body, fps)
            if not np.isfinite(prediction.positions).all():
                raise FileError(path, "has places or rotations that are not finite")
            return prediction
    beside = "has joints that no motion file beside it has" if bodies else "holds no bones"
    raise FileError(
        path,
        f"is a prediction, and {beside}: give a motion file of its body beside it, or show the case that "
        "it is of",
    )


def _fitted(motion: Prediction, fps: float, length: int) -> tuple[Prediction, str]:
    """A motion at a rate and cut to a length, and a sentence on the changes ("" for none)."""
    changes = []
    if abs(motion.fps - fps) > SAME_RATE * fps:
        changes.append(f"brought from {motion.fps:g} to {fps:g} frames per second")
        motion = motion.resample(fps)
    if motion.frames > length:
        changes.append(f"the first {length} of {motion.frames} frames")
        motion = motion.at(slice(length))
    return motion, "; ".join(changes)


# ------------------------------------------------------------------------------------------- lists of cases
def _changed(path: Path) -> tuple[str, int, int]:
    """A path, when it was written and its size; zeros where there is none."""
    try:
        facts = path.stat()
    except OSError:
        return str(path), 0, 0
    return str(path), facts.st_mtime_ns, facts.st_size


@dataclass
class CaseList:
    """Cases to choose from.

    roots: of results. dataset: see ``of_dataset``. root: where its files lie, if not as usual. files: shown
    in place of results.
    """

    roots: Sequence[Path] = ()
    task: str = "retarget"
    dataset: str | None = None
    methods: Sequence[str] = ()
    root: str | None = None
    files: Sequence[Path] = ()
    _results: list[StoredResults] = field(default_factory=list)
    problem: str = ""

    def refresh(self, over: Over = iter) -> list[str]:
        """The ids of all cases now, in the order of the results; one, "", of files.

        ``problem`` says why results cannot be shown; "" where all can.
        """
        if self.files:
            return [""]
        self.problem = ""
        entries = [self._read(place) for place in over(self._places())]
        self._results = [each for each in entries if each is not None]
        return list(dict.fromkeys(case for each in self._results for case in each.cases))

    def state(self) -> str:
        """A text that changes when results or files do."""
        places = [place for root in self.roots for place in store.find_results(root, self.task)]
        paths = [split_take(path)[0] for path in self.files]
        for place in places:
            paths += [place.header, place.journal, place.folder / place.method]
        return digest(repr([_changed(path) for path in paths]))

    def state_of(self, case: str) -> str:
        """A text that changes when what is shown of a case does; as of the last ``refresh``."""
        if self.files:
            return self.state()
        having = [each for each in self._results if case in each.cases]
        answers = [
            (each.label, each.entries.get(case), _changed(each.place.prediction(case))) for each in having
        ]
        return digest(repr(answers))

    def scene(self, case: str) -> Scene:
        """A case as it is now. Raises BenchError."""
        if self.files:
            return of_files(self.files)
        having = [each for each in self._results if case in each.cases]
        if not having:
            raise BenchError(f"there are no results of case {case!r} any more")
        first = having[0].place
        same = [
            each for each in having if (each.place.dataset, each.place.task) == (first.dataset, first.task)
        ]
        spec = having[0].dataset
        data = spec if self.root is None else spec.with_parameters(root=self.root)
        return of_stored(same, case, data, results_library.colours(self.roots))

    def _places(self) -> list[ResultPaths]:
        places = [place for root in self.roots for place in store.find_results(root, self.task)]
        places = method_order.of_methods(places, self.methods) if self.methods else places
        try:
            return places if self.dataset is None else of_dataset(places, self.dataset)
        except BenchError as error:
            self.problem = str(error)
            return []

    def _read(self, place: ResultPaths) -> StoredResults | None:
        try:
            return read_stored(place)
        except BenchError as error:
            self.problem = str(error)
            return None
