"""Files and folders of meshes as vertices and faces, frame by frame."""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from retarget_bench.errors import FileError, NotSupported
from retarget_bench.files import LARGEST, check_ordinary
from retarget_bench.motion.file_kinds import check_kind

SUFFIXES = (".ply", ".obj", ".glb", ".stl", ".off")
_RIGGED = (".glb",)
"""Formats that may hold a rigged character as well: alone, such a file is read as one."""
_KINDS = {".ply": "PLY", ".glb": "glTF", ".obj": "OBJ", ".off": "OFF"}
"""Kinds of files (``file_kinds``) by their endings; binary STL begins with anything."""
_NUMBER = re.compile(r"(\d+)")


@dataclass(frozen=True, eq=False)
class Frame:
    """A mesh as its file has it: vertices ``(V, 3)`` in the file's unit and axes, faces ``(F, 3)``, which
    may be none. name: of the file, or of the mesh in it. path: the file."""

    path: Path
    name: str
    vertices: np.ndarray
    faces: np.ndarray


def is_scan(path: Path) -> bool:
    """Whether a path is a folder, or a file of a format that holds meshes alone."""
    return path.is_dir() or (path.suffix.lower() in SUFFIXES and path.suffix.lower() not in _RIGGED)


def files_of(path: Path) -> list[Path]:
    """The mesh files of a folder in natural order (2 before 10), or the file itself.

    Raises FileError for what is not there or no mesh file, and a folder with none or several formats.
    """
    if not path.is_dir():
        if not path.exists():
            raise FileError(path, "is not there")
        if path.suffix.lower() not in SUFFIXES:
            raise FileError(path, f"is no mesh file; give {', '.join(SUFFIXES)}, or a folder of them")
        return [path]
    files = [each for each in path.iterdir() if each.suffix.lower() in SUFFIXES and each.is_file()]
    if not files:
        raise FileError(path, f"has no frames: the folder holds no file that ends in {', '.join(SUFFIXES)}")
    if len(kinds := sorted({each.suffix.lower() for each in files})) > 1:
        raise FileError(path, f"holds files of several formats ({', '.join(kinds)}); keep those of one")
    return sorted(files, key=lambda each: natural(each.stem))


def natural(name: str) -> list[tuple[int, int, str]]:
    """Sorts names with numbers in them by these."""
    parts = _NUMBER.split(name)
    return [(1, int(part), "") if part.isdigit() else (0, 0, part) for part in parts]


def frames_of(path: Path) -> Iterator[Frame]:
    """The frames of a file or folder, read one by one.

    A file is a frame, and all meshes in it are parts of that. A file of several meshes that are named alike
    but for a number is a sequence. Raises FileError for what cannot be read, NotSupported without trimesh.
    """
    files = files_of(path)
    for file in files:
        if kind := _KINDS.get(file.suffix.lower()):
            check_kind(file, kind, text=True)
        else:
            check_ordinary(file, LARGEST)
        parts = list(_parts(file))
        if not parts:
            raise FileError(file, "holds no mesh")
        numbered = {_NUMBER.sub("#", part.name) for part in parts}
        if len(files) == 1 and len(parts) > 1 and len(numbered) == 1 and "#" in numbered.pop():
            yield from sorted(parts, key=lambda part: natural(part.name))
        else:
            yield _joined(file, parts)


def _joined(file: Path, parts: list[Frame]) -> Frame:
    starts = np.cumsum([0, *(len(part.vertices) for part in parts)])
    faces = [part.faces + start for part, start in zip(parts, starts, strict=False)]
    return Frame(file, file.stem, np.concatenate([part.vertices for part in parts]), np.concatenate(faces))


def _parts(file: Path) -> Iterator[Frame]:
    """The meshes and point clouds in a file, in its own world."""
    try:
        import trimesh
    except ImportError:
        raise NotSupported(
            f"{file}: reading meshes needs trimesh; install it with pip install 'retarget-bench[mesh]'"
        ) from None
    try:
        scene = trimesh.load_scene(file, process=False, skip_materials=True, maintain_order=True)
        placed = [(scene.graph[node], node) for node in scene.graph.nodes_geometry]
        parts = [(str(node), scene.geometry[name], matrix) for (matrix, name), node in placed]
    except Exception as error:  # readers of many formats, each with errors of its own
        raise FileError(file, f"cannot be read as a mesh ({' '.join(str(error).split())[:200]})") from error
    for name, geometry, matrix in parts:
        if (frame := _frame(file, name, geometry, matrix)) is not None:
            yield frame


def _frame(file: Path, name: str, geometry: Any, matrix: np.ndarray) -> Frame | None:
    vertices = np.asarray(getattr(geometry, "vertices", ()), dtype=np.float64)
    if vertices.ndim != 2 or vertices.shape[1:] != (3,) or not len(vertices):
        return None
    if not np.array_equal(matrix, np.eye(4)):
        vertices = vertices @ matrix[:3, :3].T + matrix[:3, 3]
    faces = np.asarray(getattr(geometry, "faces", np.zeros((0, 3))), dtype=np.int64).reshape(-1, 3)
    if len(faces) and not 0 <= int(faces.min()) <= int(faces.max()) < len(vertices):
        raise FileError(file, f"has faces with other indices than its {len(vertices)} vertices")
    return Frame(file, name, vertices, faces)
