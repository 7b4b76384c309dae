"""Motions and characters from files, retargeting of one motion, and saving and showing what comes of it."""

from __future__ import annotations

import re
import warnings
from collections.abc import Sequence
from dataclasses import dataclass, field, fields, replace
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

from retarget_bench import defaults
from retarget_bench.api import CROSS, Case, CaseInfo, Context
from retarget_bench.errors import BenchError
from retarget_bench.files import check_writable
from retarget_bench.motion import character, files, importer
from retarget_bench.motion.editing import edits as editing
from retarget_bench.motion.editing import legs, loops
from retarget_bench.motion.editing.edits import Edits
from retarget_bench.motion.files import role_file, writing
from retarget_bench.motion.findings import counted_frames
from retarget_bench.motion.importer import Imported
from retarget_bench.plugins import registry
from retarget_bench.python import known
from retarget_bench.python.arguments import checked
from retarget_bench.python.plans import Named, method_spec

if TYPE_CHECKING:
    import numpy as np

    from retarget_bench.python.views import Player


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


@checked
def load_motion(
    path: str | PathLike[str],
    *,
    fps: float | None = None,
    rate: float | None = None,
    unit: str = "auto",
    up: str = "auto",
    root_place: str = "auto",
    roles: dict[str, str | None] | str | Path | None = None,
    name: str | None = None,
    take: str | None = None,
    body: str | None = None,
    inner_positions: str = "auto",
    skeleton: str | PathLike[str] | None = None,
    body_model: str | PathLike[str] | None = None,
) -> Motion:
    """The motion of a file (BVH, GLB, glTF, FBX, AMC, AMASS ``.npz``, ``.npy``), in metres, Y up.

    What the file does not say (unit, up axis, roles of joints) is found from the body and its motion; a
    warning names what is doubtful and the argument that settles it.

    fps:   resample to this rate.
    rate:  frames per second that the file truly has, over what it says.
    unit:  ``m``, ``cm``, ``mm``, ``inch``, ``cmu``, or metres of one unit, as text.
    up:    ``y``, ``z``, ``x``, or ``-y``, ...
    root_place: ``absolute`` or ``relative`` to the root's OFFSET.
    roles: joint name -> role, over what is found, or a TOML file of it. name: of the character.
    take:  which motion of a file with several, by name or number from 1 on; or as in ``Fox.glb#Walk``.
    body:  which body of a file with several, by the name of its root, or number.
    inner_positions: ``drop``, ``bake`` (into rotations) or ``keep`` (in files of the same body) what joints
           below the root do that bones of constant length cannot.
    skeleton: the ASF file of an AMC file's bones; by default the one beside it.
    body_model: of an AMASS file: an ``.npz`` file of an SMPL body model, or a folder of them.
    Raises BenchError for files that cannot be read, and for unknown options.
    """
    asked: dict[str, Any] = {"unit": unit, "up": up, "root": root_place, "roles": roles, "fps": fps}
    asked |= {"name": name, "take": take, "body": body, "rate": rate, "inner_positions": inner_positions}
    return _loaded(path, **asked, skeleton=skeleton, body_model=body_model)


@checked
def load_character(path: str | PathLike[str], **options: Any) -> Character:
    """The character of a motion file, which may have a single frame; options are those of
    ``load_motion``."""
    if "root_place" in options:
        options["root"] = options.pop("root_place")
    body = _loaded(path, **options).character
    assert isinstance(body, Character)
    return body


def _loaded(path: str | PathLike[str], **options: Any) -> Motion:
    """A file's motion; options are those of ``importer.load``. Warnings point at the caller of its caller,
    which is ``checked``."""
    fps, roles = options.pop("fps", None), options.get("roles")
    if isinstance(roles, str | PathLike):
        options["roles"] = role_file.read(Path(roles))
    found = importer.load(Path(path), **options)
    for warning in found.findings.warnings:
        warnings.warn(f"{path}: {_in_python(warning)}", stacklevel=4)
    return imported(found) if fps is None else imported(found).resample(fps)


@checked
def retarget(
    source: character.Prediction | str | PathLike[str],
    target: character.Character | character.Motion | str | PathLike[str],
    method: Named = defaults.METHOD,
    *,
    seed: int = 0,
    start: str = "keep",
    root_motion: str = "keep",
    hands: str = "relaxed",
) -> Motion:
    """Retarget a motion to another character: as many frames as the source, at its rate.

    source: a motion, or a file. target: a character, a motion of it, or a file of it.
    method: a spec such as ``"ik"`` or ``"nkn+footfix"``, or the file of your own method.
    start:  of a source that begins with a T-pose or elsewhere: ``keep``, ``cut`` (fewer frames), ``ease``.
    root_motion: ``keep``, ``in-place``, or the axis to travel along: ``x``, ``-x``, ``z``, ``-z``.
    hands:  ``relaxed`` or ``open``, where the source shows no fingers and the target has them.
    The notes of the result say where rotations were fitted to positions, and what was edited unasked. A
    warning says where the source begins with something else than its motion, and where the method is known
    to be worse than the default one. Raises BenchError with the reason where it gives no answer.
    """
    wanted = Edits(start, root_motion, hands)
    moved = _loaded(source) if isinstance(source, str | PathLike) else source
    named = _loaded(target) if isinstance(target, str | PathLike) else target
    body = named.character if isinstance(named, character.Motion) else named
    found = answer(moved, body, method, seed, wanted)
    for caution in (*cautions(method, moved.character, body), *doubts(moved, wanted)):
        warnings.warn(_in_python(caution), stacklevel=3)
    return found


def cautions(method: Named, source: character.Character, target: character.Character) -> tuple[str, ...]:
    """Sentences on what not to expect of a method on two bodies."""
    told = known.caution(method_spec(method), source, target)
    return tuple(filter(None, (legs.guess(source, target), told)))


def doubts(source: character.Prediction, wanted: Edits) -> tuple[str, ...]:
    """Sentences on a source that begins with something else than its motion, with the option for it."""
    found = editing.doubt(source, wanted)
    return (found,) if found else ()


def answer(
    source: character.Prediction,
    target: character.Character,
    method: Named,
    seed: int = 0,
    wanted: Edits = editing.USUAL,
) -> Motion:
    """``retarget`` without warnings."""
    spec = method_spec(method)
    asked = registry.create("methods", spec)
    learned = bool(getattr(asked, "weights_hash", ""))  # raises where weights are missing or do not fit
    notes: list[tuple[str, ...]] = []

    def plain(one: character.Prediction, body: character.Character) -> Motion:
        found = _answer(asked, str(spec), one, body, seed)
        notes.append(found.notes)
        return found

    found, done = editing.edited(source, target, wanted, plain, posed=not learned)
    made = Motion(target, found.rotations, found.root, found.fps, (*notes[-1], *done))
    return _with_places(made, source)


def _answer(
    asked: Any, spec: str, source: character.Prediction, target: character.Character, seed: int
) -> Motion:
    """What a method gives, with rotations. Raises BenchError with the reason where it gives nothing."""
    from retarget_bench.evaluation.predict import predict

    names = (source.character.name, target.name)
    case = Case(CaseInfo("file", "retarget", CROSS, *names, clip=names[0]), source, target)
    outcome = predict(asked, case, Context(seed=seed))
    if (found := outcome.prediction) is None:
        raise BenchError(f"{spec} gave no motion ({outcome.status}): {outcome.message}")
    return with_rotations(found, source=source)


def _with_places(found: Motion, source: character.Prediction) -> Motion:
    """A result with the inner positions of its source, where it is on the same body: the later ones of a
    source whose start was cut off."""
    if not isinstance(source, Motion) or source.places is None:
        return found
    if found.skeleton.same_as(source.skeleton, tolerance=1e-3 * source.character.height):
        return replace(found, places=source.places[source.frames - found.frames :])
    left_out = "positions of inner joints are left out: the target is another body"
    return replace(found, notes=(*found.notes, left_out))


def with_rotations(
    found: character.Prediction,
    body: character.Character | None = None,
    source: character.Prediction | None = None,
) -> Motion:
    """A motion by its rotations, which are fitted to positions where it is known by these. body: whose
    motion it is, where that character knows more than the motion's own. source: see ``fit``."""
    notes: tuple[str, ...] = ()
    if not isinstance(found, character.Motion):
        from retarget_bench.motion.fitting import fit

        fitted = fit.fit(found, source)
        found, notes = fitted.motion, (f"rotations were fitted to positions: {fitted}",)
    return Motion(body or found.character, found.rotations, found.root, found.fps, notes)


def imported(found: Imported) -> Motion:
    """A file's motion as one that knows its file."""
    moved, body = found.motion, found.motion.character
    known = {each.name: getattr(body, each.name) for each in fields(character.Character)}
    named = Character(**known, file=found)
    return Motion(named, moved.rotations, moved.root, moved.fps, places=found.places)


def write(path: Path, motion: character.Motion) -> tuple[str, ...]:
    """Write a motion as ``Motion.save`` does; returns what could not be kept. Raises BenchError."""
    body = motion.character
    like = body.file if isinstance(body, Character) else None
    check_output(path, *([like.findings.path] if like else []))
    places = motion.places if isinstance(motion, Motion) else None
    return writing.write(path, motion, like, places)


def check_output(path: Path, *given: Path) -> None:
    """Raises BenchError where results cannot be written under a name, or it is that of a file given."""
    if path.suffix.lower() not in files.suffixes(written=True):
        known = " or ".join(files.suffixes(written=True))
        why = "the result is a motion file"
        if path.suffix.lower() == ".fbx":
            why = "FBX is read and not written; programs that import FBX import GLB as well"
        raise BenchError(f"{path}: {why}; give it a name that ends in {known}")
    check_writable(path)
    for each in (files.split_take(one)[0] for one in given):
        if path.exists() and each.exists() and path.samefile(each):
            raise BenchError(f"{path} would overwrite {each}; choose another name for the result")


def _in_python(warning: str) -> str:
    """A warning of a file's findings with arguments instead of options."""
    said = re.sub(r"--(unit|up|take|body|start) (\S+)", r'\1="\2"', warning)
    said = re.sub(r"--rate(?: ([\d.]+))?", r"rate=\1", said)
    said = said.replace("--inner-positions bake", 'inner_positions="bake"')
    return said.replace("--body-model", "body_model=").replace("--roles", 'roles="roles.toml"')
