"""Scanned motion as points, and a body's mesh as a character, in metres, Y up; every guess is listed."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from retarget_bench.errors import FileError
from retarget_bench.motion.character import Character
from retarget_bench.motion.files.reading import UNITS, Reading
from retarget_bench.motion.mesh import Mesh
from retarget_bench.motion.point_sets import PointSets, unknown_body
from retarget_bench.motion.scans.checks import TWO, check_numbers, check_one_body, topology
from retarget_bench.motion.scans.loose import without_loose_parts
from retarget_bench.motion.scans.orientation import unit_of, up_axis, upright
from retarget_bench.motion.scans.reading import Frame, files_of, frames_of
from retarget_bench.motion.surface_sampling import sampled, uniform

POINTS = 2048
"""Points that are drawn on the mesh of a frame, or taken of its vertices where it has no faces."""
_LOOKED_AT = 20
"""Frames that unit and up axis are found from."""


@dataclass(frozen=True)
class ScanFindings:
    """The interpretation of a file or folder of meshes.

    unit: name and metres of one unit. unit_explicit, up_explicit: True where the user named them.
    up_clear: False where the body is as wide as high, and no mirror image of itself.
    height: metres, the extent along the up axis. frames: their names. notes: what is wrong with the meshes.
    """

    path: Path
    unit: tuple[str, float]
    unit_explicit: bool
    up: str
    up_explicit: bool
    up_clear: bool
    height: float
    frames: tuple[str, ...]
    notes: tuple[str, ...]

    @property
    def warnings(self) -> tuple[str, ...]:
        """Doubtful points, and what settles each."""
        warnings = list(self.notes)
        if not self.unit_explicit and not 1.1 <= self.height <= 2.6:
            warnings.append(
                f"the unit is a guess: in {self.unit[0]} the body is {self.height:.2f} m tall; say unit=..."
            )
        if not self.up_explicit and not self.up_clear:
            warnings.append(f"the up axis is a guess ({self.up}): say up=y or up=z")
        return tuple(warnings)


@dataclass(frozen=True, eq=False)
class ImportedScan:
    """A scanned motion, and how its files were understood."""

    motion: PointSets
    findings: ScanFindings


@dataclass(frozen=True, eq=False)
class ImportedBody:
    """A character whose mesh alone is known, and how its file was understood.

    Its skeleton is one joint that carries all vertices: who needs joints has to find them on the mesh.
    """

    character: Character
    findings: ScanFindings


def load_scan(
    path: str | Path,
    reading: Reading = Reading(),
    *,
    fps: float = 30.0,
    progress: Callable[[int, int], None] | None = None,
) -> ImportedScan:
    """A mesh file, or a folder with one for each frame, as points that are drawn on its surfaces.

    reading: its unit and up axis. fps: frames per second, which such files do not say.
    progress: is told how many files are read, and how many there are.
    Meshes may be open, not manifold, in parts, or without faces, and differ in their numbers of vertices:
    that is told. Raises FileError for a frame with vertices that are not finite or with two bodies, and
    for a folder without frames; NotSupported for unknown options, and without trimesh.
    """
    path = Path(path)
    drawn: list[np.ndarray] = []
    names: list[str] = []
    notes: dict[str, list[str]] = {}
    files = len(files_of(path))
    for number, frame in enumerate(frames_of(path)):
        points, _, remarks = _points(frame, number)
        drawn.append(points)
        names.append(frame.name)
        for each in remarks:
            notes.setdefault(each, []).append(frame.name)
        if progress is not None:
            progress(min(number + 1, files), files)
    sentences = [_of_frames(note, where, len(drawn)) for note, where in _alike(notes).items()]
    findings = _findings(path, drawn, reading, names, sentences)
    moved = [upright(each, findings.up, findings.unit[1]).astype(np.float32) for each in drawn]
    return ImportedScan(PointSets(unknown_body(path.stem), tuple(moved), fps), findings)


def load_body(path: str | Path, reading: Reading = Reading()) -> ImportedBody:
    """A mesh file as a character that motion can be retargeted to. reading: its unit and up axis.

    An open mesh, one that is not manifold, and loose parts such as eyes are told. Raises FileError for a
    file without faces, with vertices that are not finite, with two bodies or several frames; NotSupported
    for unknown options, and without trimesh.
    """
    path = Path(path)
    if path.is_dir():
        raise FileError(path, "is a folder; a target is one mesh file")
    first, *others = frames_of(path)
    if others:
        raise FileError(path, f"holds {1 + len(others)} frames; a target is one mesh")
    if not len(first.faces):
        raise FileError(path, "has no faces; a target needs a surface")
    points, first, notes = _points(first, 0)
    sentences = [f"the mesh {note}" for note in notes]
    findings = _findings(path, [points], reading, [first.name], sentences)
    vertices = upright(first.vertices, findings.up, findings.unit[1])
    mesh = Mesh(vertices, first.faces, np.ones((len(vertices), 1)))
    body = unknown_body(path.stem)
    tall = replace(body.measures, height=float(np.ptp(vertices[:, 1])))
    return ImportedBody(replace(body, measures=tall, skin=lambda: mesh), findings)


def _points(frame: Frame, number: int) -> tuple[np.ndarray, Frame, tuple[str, ...]]:
    """``(points, 3)`` on the surface of a frame in its file's unit, the frame without what is no part of
    the body, and notes on it."""
    check_numbers(frame)
    frame, left_out, others = without_loose_parts(frame)
    if others:
        raise FileError(frame.path, TWO)
    points, notes = _drawn(frame, number)
    check_one_body(frame, points)
    return points, frame, (*left_out, *notes)


def _drawn(frame: Frame, number: int) -> tuple[np.ndarray, tuple[str, ...]]:
    if not len(frame.faces):
        numbers = uniform(number, min(POINTS, len(frame.vertices)))
        chosen = np.floor(numbers * len(frame.vertices)).astype(int)
        return frame.vertices[chosen], ("has no faces: its vertices are taken for the points",)
    notes = topology(frame).notes
    numbers = uniform(number, 3 * POINTS).reshape(1, 3, POINTS)
    return sampled(frame.vertices[None], frame.faces, numbers)[0], notes


def _alike(notes: dict[str, list[str]]) -> dict[str, list[str]]:
    """Notes that begin alike, merged with the first one's numbers."""
    groups: dict[str, tuple[str, list[str]]] = {}
    for note, where in notes.items():
        groups.setdefault(note.partition(":")[0], (note, []))[1].extend(where)
    return dict(groups.values())


def _of_frames(note: str, where: Sequence[str], frames: int) -> str:
    if frames == 1:
        return f"the mesh {note}"
    return f"the mesh of {len(where)} of {frames} frames {note}, the first being {where[0]}"


def _findings(
    path: Path, frames: list[np.ndarray], reading: Reading, names: Sequence[str], notes: Sequence[str]
) -> ScanFindings:
    some = [frames[k] for k in np.unique(np.linspace(0, len(frames) - 1, _LOOKED_AT).astype(int))]
    axis, clear = up_axis(some) if reading.up == "auto" else (reading.up, True)
    height = float(np.median([np.ptp(each["xyz".index(axis[-1])]) for each in (each.T for each in some)]))
    metres = reading.metres
    chosen = unit_of(height) if metres is None else str(reading.unit)
    scale = UNITS[chosen] if metres is None else metres
    return ScanFindings(
        path=path,
        unit=(chosen, scale),
        unit_explicit=metres is not None,
        up=axis,
        up_explicit=reading.up != "auto",
        up_clear=clear,
        height=height * scale,
        frames=tuple(names),
        notes=tuple(notes),
    )
