"""Retargeting of scanned motion: a sequence of meshes or points in, a sequence of the target's mesh out."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING

from retarget_bench import defaults
from retarget_bench.errors import BenchError, FileError
from retarget_bench.motion import character
from retarget_bench.motion.files.reading import Reading
from retarget_bench.motion.point_sets import PointSets
from retarget_bench.motion.scans.importing import load_body, load_scan
from retarget_bench.motion.scans.reading import SUFFIXES, is_scan
from retarget_bench.motion.scans.writing import write_frames
from retarget_bench.python.arguments import checked
from retarget_bench.python.motions import predicted, ready
from retarget_bench.python.plans import MethodLike

if TYPE_CHECKING:
    from retarget_bench.motion.scans.importing import ScanFindings

FPS = 30.0
"""Frames per second of scans, which their files do not say."""


@dataclass(frozen=True, eq=False, repr=False)
class Surface(character.Surface):
    """A body's mesh in motion: ``vertices`` ``(frames, V, 3)`` in metres, Y up, and ``fps``.

    notes: sentences on how it was made, such as a target that was brought into the T-pose.
    names: of the frames, as those of the source.
    """

    names: tuple[str, ...] = ()

    def __repr__(self) -> str:
        size = f"{self.frames} frames of {self.vertices.shape[1]} vertices at {self.fps:g} per second"
        return f"<Surface of {self.character.name}: {size}>"

    @checked
    def save(self, folder: str | PathLike[str]) -> Path:
        """Write a PLY file for each frame in a new folder, all or none of them, and return its path.

        Raises BenchError where the folder is there already, or cannot be written.
        """
        folder = Path(folder)
        mesh = self.character.mesh
        assert mesh is not None
        write_frames(folder, self.vertices, mesh.faces, self.names)
        return folder


@checked
def retarget_scans(
    source: str | PathLike[str],
    target: str | PathLike[str],
    method: MethodLike = defaults.SCAN_METHOD,
    *,
    fps: float = FPS,
    unit: str = "auto",
    up: str = "auto",
    target_unit: str = "auto",
    target_up: str = "auto",
    seed: int = 0,
) -> Surface:
    """Retarget a scanned motion to a mesh: as many frames as the source, at its rate.

    source: a folder of mesh or point files, one for each frame, or a file. target: a mesh file.
    method: one that takes points. fps: of the source, whose files do not say it. unit, up: as of
    ``load_motion``; likewise of the target, which should be in T-pose: where a method brings it into one,
    the result's notes and a warning say it. Warnings name what is doubtful in the files. Raises BenchError
    for files that cannot be read, and with the reason where the method gives no answer.
    """
    body = load_body(Path(target), Reading(unit=target_unit, up=target_up))
    scan = load_scan(Path(source), Reading(unit=unit, up=up), fps=fps)
    for findings in (scan.findings, body.findings):
        for warning in findings.warnings:
            warnings.warn(f"{findings.path}: {warning}", stacklevel=3)
    result = answer(scan.motion, body.character, method, seed, scan.findings.frames)
    for note in result.notes:
        warnings.warn(f"{body.findings.path}: {note}", stacklevel=3)
    return result


def answer(
    source: PointSets,
    target: character.Character,
    method: MethodLike,
    seed: int = 0,
    names: tuple[str, ...] = (),
) -> Surface:
    """``retarget_scans`` of what was read already, without warnings. names: of the frames."""
    spec, built, _ = ready(method)
    prediction = predicted(built, spec, "points", source, target, seed)
    if isinstance(prediction, character.Positions):
        raise BenchError(f"{spec} answers joints alone; ask a method that answers a surface")
    if isinstance(prediction, character.Surface):
        return Surface(target, prediction.vertices, prediction.fps, prediction.notes, names)
    assert target.mesh is not None
    return Surface(target, target.mesh.skinned(prediction), prediction.fps, names=names)


def check_pair(source: Path, target: Path) -> bool:
    """Whether these are scans and a mesh; raises BenchError where one is and the other is not."""
    scanned = is_scan(source)
    meshed = target.suffix.lower() in SUFFIXES
    if not scanned and is_scan(target) and not target.is_dir():
        raise BenchError(f"{target} is a mesh without a rig: give a folder of meshes as the source too")
    if scanned and not meshed:
        raise FileError(target, f"is no mesh file; scans move a mesh: give {', '.join(SUFFIXES)}")
    return scanned


def check_folder(out: Path) -> None:
    """Raises BenchError where a path cannot be the new folder of a result."""
    if out.suffix.lower() in (".bvh", *SUFFIXES):
        raise BenchError(f"{out}: the result is a folder of .ply files; give it the name of a folder")
    if out.exists():
        raise FileError(out, "is there; choose another name for the folder of the result")


def facts(findings: ScanFindings) -> str:
    """Unit, up axis and height, in a few words."""
    return f"unit {findings.unit[0]}, {findings.up} up, {findings.height:.2f} m tall"
