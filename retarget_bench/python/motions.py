"""Motions and characters from files, retargeting of one motion, and saving and showing what comes of it."""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, fields, replace
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast, overload

import numpy as np

from retarget_bench import defaults
from retarget_bench.api import CROSS, Case, CaseInfo, Context
from retarget_bench.errors import BenchError
from retarget_bench.files import check_writable
from retarget_bench.motion import character, files, importer
from retarget_bench.motion.editing import edits as editing
from retarget_bench.motion.editing import legs, loops
from retarget_bench.motion.editing.edits import Edits
from retarget_bench.motion.files import writing
from retarget_bench.motion.files.formats import of_array
from retarget_bench.motion.files.reading import Reading
from retarget_bench.motion.files.smpl.arrays import Joints, finite
from retarget_bench.motion.findings import counted_frames
from retarget_bench.motion.importer import Imported
from retarget_bench.motion.point_sets import PointSets
from retarget_bench.options import OptionSet, option
from retarget_bench.plugins import registry
from retarget_bench.plugins.spec import Spec
from retarget_bench.python import known
from retarget_bench.python.arguments import checked, takes
from retarget_bench.python.plans import MethodLike, method_spec
from retarget_bench.verification import verdict as verdicts
from retarget_bench.verification.verdict import Verdict

if TYPE_CHECKING:
    from retarget_bench.python.views import Player

Loadable = str | PathLike[str] | np.ndarray
"""A file, or joint positions ``(frames, joints, 3)``."""
Source = character.Prediction | Loadable
_ONE = (str, PathLike, np.ndarray, character.Motion, character.Positions, character.Surface)
"""What is a source by itself, and no list of them."""
Target = character.Character | character.Motion | str | PathLike[str]


@dataclass(frozen=True, eq=False, repr=False)
class Character(character.Character):
    """A character that knows the file it was read from, so that its motions are written as that file is.

    file: what was read, and how.
    The other fields are those of the benchmark's ``Character``: name, skeleton, roles, measures, ...
    """

    file: Imported | None = field(default=None, repr=False)

    def __repr__(self) -> str:
        legs = "four" if self.four_legged else "two"
        return (
            f"<Character {self.name}: {len(self.skeleton)} joints, {legs} legs, {self.height:.2f} m tall>"
        )


@dataclass(frozen=True, eq=False, repr=False)
class Motion(character.Motion):
    """A motion of a character: ``rotations`` ``(frames, joints, 4)``, ``root`` ``(frames, 3)`` in metres,
    and ``fps``; ``positions`` ``(frames, joints, 3)`` follow from them.

    notes: sentences on how it was made, such as a fit of rotations to positions.
    places: ``(frames, joints, 3)`` metres, every joint in its parent's frame, where joints below the root
        move there and ``inner_positions="keep"`` was asked for; saved in files of the same body.
    """

    notes: tuple[str, ...] = ()
    places: np.ndarray | None = None

    @checked
    def resample(self, fps: float) -> Motion:
        """The same motion at another rate: slerp for rotations, linear for places. A loop stays one: its
        length is rounded to whole frames."""
        return cast(Motion, loops.resampled(self, fps))

    @property
    def arrays(self) -> tuple[str, ...]:  # type: ignore[override]
        return character.Motion.arrays if self.places is None else (*character.Motion.arrays, "places")

    def __repr__(self) -> str:
        lasts = f"{counted_frames(self.frames)} at {self.fps:g} per second, {self.frames / self.fps:.1f} s"
        return f"<Motion of {self.character.name}: {lasts}>"

    @checked
    def save(self, path: str | PathLike[str]) -> Path:
        """Write the motion as a BVH, GLB or AMASS file (``.npz``), and return its path.

        Where the character was read from a file of that format, the result is as that file: joints, names,
        channels, unit, axes and OFFSETs, all of a GLB with its mesh and other animations, betas and gender
        of an AMASS file. Else it is in metres, Y up; an AMASS file then is Z up, and takes characters with
        the joints of SMPL alone. A warning says what could not be kept. Raises BenchError for another
        ending than .bvh, .glb and .npz, and where the character's own file would be overwritten.
        """
        path = Path(path)
        for note in write(path, self):
            warnings.warn(f"{path}: {note}", stacklevel=3)
        return path

    @checked
    def show(
        self, *others: character.Prediction, labels: Sequence[str] = (), overlay: bool = False
    ) -> Player:
        """A player of the motion, of other motions beside it (``overlay``: in one picture), for notebooks;
        ``.save("page.html")`` writes it as a page that opens from disk.

        Others are shown at this motion's rate, all as long as the shortest. labels: names of the motions,
        by default those of their characters. Raises BenchError where one has no frames.
        """
        from retarget_bench.python.views import Player
        from retarget_bench.viewer import scene_builder

        motions = [self, *others]
        names = list(labels) or [each.character.name for each in motions]
        if len(names) != len(motions):
            raise BenchError(
                f"{len(names)} labels were given for {len(motions)} motions; give one for each"
            )
        return Player(scene_builder.of_motions(motions, names), overlay=overlay)


class _ArrayOptions(OptionSet):
    """The skeleton of an array of positions."""

    joints: Joints | None = option(
        "Of an array: the skeleton whose joints it has (smpl, smplh, smplx, body, h36m), or their names in "
        "order, roles or those of SMPL.",
        default=None,
        shown="of the SMPL family, by their number",
        python=True,
    )


class LoadOptions(_ArrayOptions, Reading):
    """How a motion is loaded."""

    fps: float | None = option("Resample to this rate.", default=None, above=0)
    name: str | None = option("Name of the character.", default=None, shown="that of the file")


class RetargetOptions(_ArrayOptions, Edits):
    """How a motion is retargeted."""

    method: MethodLike | None = option(
        "The method, with parameters in brackets, or the file of your own (my_method.py).",
        default=None,
        shown=f"{defaults.METHOD}; for scans {defaults.SCAN_METHOD}",
        letter="m",
        metavar="METHOD",
        names=("methods",),
        kw_only=False,
    )
    seed: int = option(
        "Seed of a method that draws numbers.", default=0, at_least=0, below=2**63, metavar="N"
    )


@takes(LoadOptions)
@checked
def load_motion(path: Loadable, options: LoadOptions) -> Motion:
    """The motion of a file (BVH, GLB, glTF, FBX, AMC, AMASS ``.npz``, ``.npy``), in metres, Y up; or of an
    array of joint positions ``(frames, joints, 3)``, to which rotations are fitted.

    A take of a file may stand behind its name, as in ``Fox.glb#Walk``. What the file does not say (unit, up
    axis, roles of joints) is found from the body and its motion; a warning names what is doubtful and what
    to say. Raises BenchError for what cannot be read, and for unknown options.
    """
    motion, doubts = _loaded(path, options)
    _warn(doubts)
    return motion


@takes(LoadOptions)
@checked
def load_character(path: Loadable, options: LoadOptions) -> Character:
    """The character of a motion, which may have a single frame, as ``load_motion`` reads it."""
    motion, doubts = _loaded(path, options)
    _warn(doubts)
    assert isinstance(motion.character, Character)
    return motion.character


def _loaded(source: Loadable, options: LoadOptions) -> tuple[Motion, list[str]]:
    """A motion, and sentences on what is doubtful in its file."""
    if isinstance(source, np.ndarray):
        path = Path("array")
        if source.dtype.kind not in "fiu":
            raise BenchError(f"an array of {source.dtype} has no joint positions; give one of numbers")
        stated = of_array(path, finite(path, "it", source), options, options.joints or ())
        file = importer.understood(path, stated, options, options.name)
    elif options.joints is not None:
        raise BenchError(f"{source}: joints are said of arrays; a file has its own")
    else:
        path = Path(source)
        file = importer.load(path, options, name=options.name)
    motion = imported(file, of_file=not isinstance(source, np.ndarray))
    doubts = [f"{path}: {each}" for each in file.findings.warnings]
    return motion if options.fps is None else motion.resample(options.fps), doubts


def _warn(sentences: Iterable[str]) -> None:
    """Emit warnings that point at the caller of the interface."""
    for each in sentences:
        warnings.warn(each, stacklevel=5)


@overload  # a text is a file, and no list of them
@takes(RetargetOptions)
def retarget(  # type: ignore[overload-overlap]
    source: Source, target: Target, options: RetargetOptions
) -> Motion: ...
@overload
@takes(RetargetOptions)
def retarget(source: Sequence[Source], target: Target, options: RetargetOptions) -> list[Motion]: ...
@takes(RetargetOptions)
@checked
def retarget(
    source: Source | Sequence[Source], target: Target, options: RetargetOptions
) -> Motion | list[Motion]:
    """Retarget a motion to another character: as many frames as the source, at its rate. A list of motions
    gives a list.

    source: a motion, a file, or an array of joint positions ``(frames, joints, 3)``, as ``load_motion``
    takes it. target: a character, a motion of it, or a file of it.
    The notes of the result say where rotations were fitted to positions, and what was edited unasked. A
    warning says where the source begins with something else than its motion, and where the method is known
    to be worse than the default one. Raises BenchError with the reason where it gives no answer.
    """
    if isinstance(target, character.Character | character.Motion):
        body = target.character if isinstance(target, character.Motion) else target
    else:
        loaded, doubts = _loaded(target, LoadOptions())
        _warn(doubts)
        body = loaded.character
    answers = []
    for each in [source] if isinstance(source, _ONE) else source:
        if isinstance(each, character.Prediction):
            motion, doubts = each, []
        else:
            motion, doubts = _loaded(each, LoadOptions(joints=options.joints))
        answers.append(answer(motion, body, options))
        _warn((*doubts, *cautions(motion, body, options)))
    return answers[0] if isinstance(source, _ONE) else answers


def cautions(
    source: character.Prediction, target: character.Character, options: RetargetOptions
) -> tuple[str, ...]:
    """Warnings about a method on two bodies, and about a start that was kept."""
    method = method_spec(options.method or defaults.METHOD)
    sentences = legs.guess(source.character, target), known.caution(method, source.character, target)
    return (*filter(None, sentences), *editing.doubts(source, options))


def answer(source: character.Prediction, target: character.Character, options: RetargetOptions) -> Motion:
    """``retarget`` without warnings."""
    spec, method, learned = ready(options.method or defaults.METHOD)
    notes: list[tuple[str, ...]] = []

    def plain(motion: character.Prediction, body: character.Character) -> Motion:
        prediction = predicted(method, spec, defaults.TASK, motion, body, options.seed)
        fitted = with_rotations(prediction, motion)
        notes.append(fitted.notes)
        return fitted

    edited, edits_made = editing.edited(source, target, options, plain, posed=not learned)
    result = Motion(target, edited.rotations, edited.root, edited.fps, (*notes[-1], *edits_made))
    if not isinstance(source, Motion) or source.places is None:
        return result
    if result.skeleton.same_as(source.skeleton, tolerance=1e-3 * source.character.height):
        # the later ones of a source whose start was cut off
        return replace(result, places=source.places[source.frames - result.frames :])
    left_out = "positions of inner joints are left out: the target is another body"
    return replace(result, notes=(*result.notes, left_out))


def ready(method: MethodLike) -> tuple[Spec, Any, bool]:
    """A method's spec, the method, and whether it is learned. Raises BenchError where it, its parameters or
    its weights cannot be used."""
    spec = method_spec(method)
    built = registry.create("methods", spec)
    return spec, built, bool(built.weights_hash)


def predicted(
    method: Any,
    spec: Spec,
    task: str,
    source: character.Prediction | PointSets,
    target: character.Character,
    seed: int,
) -> character.Prediction:
    """The answer of a method. Raises BenchError with the reason where it gives none."""
    from retarget_bench.evaluation.predict import predict

    names = (source.character.name, target.name)
    case = Case(CaseInfo("file", task, CROSS, *names, clip=names[0]), source, target)
    outcome = predict(method, case, Context(seed=seed))
    if outcome.prediction is None:
        raise BenchError(f"{spec} gave no motion ({outcome.status}): {outcome.message}")
    return outcome.prediction


def with_rotations(motion: character.Prediction, source: character.Prediction | None = None) -> Motion:
    """A motion by its rotations, which are fitted to positions where it is known by these. source: see
    ``fit``."""
    notes: tuple[str, ...] = ()
    if not isinstance(motion, character.Motion):
        from retarget_bench.motion.fitting import fit

        fitted = fit.fit(motion, source)
        motion, notes = fitted.motion, (f"rotations were fitted to positions: {fitted}",)
    return Motion(motion.character, motion.rotations, motion.root, motion.fps, notes)


def imported(file: Imported, *, of_file: bool = True) -> Motion:
    """A motion that was read, with its file for writing. of_file: False for an array."""
    motion, body = file.motion, file.motion.character
    facts = {each.name: getattr(body, each.name) for each in fields(character.Character)}
    body_of_file = Character(**facts, file=file if of_file else None)
    return Motion(body_of_file, motion.rotations, motion.root, motion.fps, places=file.places)


def write(path: Path, motion: character.Motion) -> tuple[str, ...]:
    """Write a motion as ``Motion.save`` does; returns what could not be kept. Raises BenchError."""
    body = motion.character
    like = body.file if isinstance(body, Character) else None
    check_output(path, *([like.findings.path] if like else []))
    places = motion.places if isinstance(motion, Motion) else None
    return writing.write(path, motion, like, places)


def check_output(path: Path, *sources: Path) -> None:
    """Raises BenchError where results cannot be written under a name, or it is that of a source."""
    if path.suffix.lower() not in files.suffixes(written=True):
        endings = " or ".join(files.suffixes(written=True))
        why = "the result is a motion file"
        if path.suffix.lower() == ".fbx":
            why = "FBX is read and not written; programs that import FBX import GLB as well"
        raise BenchError(f"{path}: {why}; give it a name that ends in {endings}")
    check_writable(path)
    for each in (files.split_take(one)[0] for one in sources):
        if path.exists() and each.exists() and path.samefile(each):
            raise BenchError(f"{path} would overwrite {each}; choose another name for the result")


@checked
def verdict(
    source: character.Prediction | str | PathLike[str], result: character.Prediction | str | PathLike[str]
) -> Verdict:
    """Frames of a retargeted motion to look at and why, told from its source; ``print`` shows them.

    source, result: motions, or files, with as many frames at one rate. The Verdict has ``defects``, worst
    first, each with ``first``, ``last`` and ``worst`` frame, counted from 0, and a ``reason``; and
    ``doubts``, sentences on what is a guess or was read wrongly, where all is to be looked at.
    ``as_dict()`` is what ``bench retarget --report`` writes. Hands in the body are looked for where the
    result's character has a mesh. Raises BenchError where frames or rates differ.
    """
    source, result = (
        load_motion(each) if isinstance(each, str | PathLike) else each for each in (source, result)
    )
    return verdicts.verdict(source, result)
