"""Scenes of motion files: BVH files, and predictions, side by side."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from zipfile import BadZipFile

import numpy as np

from retarget_bench.api import Prediction
from retarget_bench.errors import BenchError, FileError
from retarget_bench.evaluation.predict import read_prediction
from retarget_bench.motion import importer
from retarget_bench.motion.character import Character
from retarget_bench.motion.motion import resampled_frames
from retarget_bench.viewer.figures import distinct, figure_of
from retarget_bench.viewer.scene import Scene

SAME_RATE = 1e-3
"""Share by which two rates may differ and still count as one: frame times in files are rounded."""


def of_files(
    paths: Sequence[str | Path], labels: Sequence[str] | None = None, *, body: Character | None = None
) -> Scene:
    """BVH files and prediction files (``.npz``) as one scene, at the rate of the first, as long as the
    shortest; the ``message`` of every figure that was changed says how.

    labels: of the files; their names by default. A prediction file holds no bones: it is of ``body``, or of
    the first BVH file given here that has its joints.
    Raises FileError for files that cannot be read, and BenchError where there is no frame or no file.
    """
    files = [Path(path) for path in paths]
    if not files:
        raise BenchError("there is no file to show; give BVH or prediction files")
    names = distinct(list(labels) if labels is not None else [path.stem for path in files])
    motions = _read(files, body)
    fps = float(motions[0].fps)
    length = min(resampled_frames(motion.frames, motion.fps, fps) for motion in motions)
    if length == 0:
        raise BenchError(f"{', '.join(map(str, files))}: one of these has no frames")
    figures = []
    for name, motion in zip(names, motions, strict=True):
        shown, said = _fitted(motion, fps, length)
        figures.append(replace(figure_of(name, "motion", shown), message=said))
    return Scene(title=", ".join(names), figures=tuple(figures), fps=fps)


def _read(files: Sequence[Path], body: Character | None) -> list[Prediction]:
    """Every file's motion, in their order; BVH files first, since predictions need their bodies."""
    found: dict[Path, Prediction] = {}
    for path in files:
        if path.suffix.lower() == ".bvh":
            found[path] = importer.load(path).motion
        elif path.suffix.lower() != ".npz":
            raise FileError(path, "is no motion file that can be shown; give .bvh, or .npz of a prediction")
    bodies = [body] if body is not None else [motion.character for motion in found.values()]
    for path in files:
        if path not in found:
            found[path] = _prediction(path, bodies)
    return [found[path] for path in files]


def _prediction(path: Path, bodies: Sequence[Character]) -> Prediction:
    """A prediction file as a motion of the first of these bodies that has its joints."""
    joints, fps = _named(path)
    for body in bodies:
        if not joints or set(body.skeleton.names) <= set(joints):
            found: Prediction = read_prediction(path, body, fps)
            if not np.isfinite(found.positions).all():
                raise FileError(path, "has places or rotations that are not finite")
            return found
    raise FileError(
        path,
        "is a prediction, which holds no bones: give the BVH file of its body beside it, or show the case "
        "that it is of",
    )


def _named(path: Path) -> tuple[list[str], float]:
    """The joints that a prediction file names, none where it does not, and its rate."""
    try:
        with path.open("rb") as opened, np.load(opened) as file:
            joints = [str(name) for name in np.atleast_1d(file["joints"])] if "joints" in file else []
            return joints, float(file["fps"]) if "fps" in file else 30.0
    except (OSError, ValueError, TypeError, EOFError, BadZipFile) as error:
        raise FileError(path, f"is not a readable .npz file ({error})") from error


def _fitted(motion: Prediction, fps: float, length: int) -> tuple[Prediction, str]:
    """A motion at a rate and cut to a length, and what was done to it, as a sentence ("" for nothing)."""
    said = []
    if abs(motion.fps - fps) > SAME_RATE * fps:
        said.append(f"brought from {motion.fps:g} to {fps:g} frames per second")
        motion = motion.resample(fps)
    if motion.frames > length:
        said.append(f"the first {length} of {motion.frames} frames")
        motion = motion.at(slice(length))
    return motion, "; ".join(said)
