"""Answers as sequences of meshes: a folder of PLY files, one for each frame."""

import os
import shutil
from collections.abc import Sequence
from pathlib import Path
from tempfile import mkdtemp

import numpy as np

from retarget_bench.errors import FileError

_FACE = np.dtype([("count", "u1"), ("corners", "<i4", 3)])


def write_frames(folder: Path, vertices: np.ndarray, faces: np.ndarray, names: Sequence[str] = ()) -> None:
    """Write ``(frames, V, 3)`` metres, Y up, as binary PLY files in a new folder, all or none of them.

    names: of the files, without suffix; frames are numbered where two are alike, or there are none.
    Raises FileError where the folder is there, or cannot be written.
    """
    if folder.exists():
        raise FileError(folder, "is there; choose another name for the folder of the result")
    if len(set(names)) != len(vertices):
        names = [f"{number:0{max(4, len(str(len(vertices))))}d}" for number in range(len(vertices))]
    temporary: Path | None = None
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        temporary = Path(mkdtemp(prefix=f".{folder.name}-", dir=folder.parent))
        temporary.chmod(0o777 & ~_umask())
        for name, frame in zip(names, vertices, strict=True):
            (temporary / f"{name}.ply").write_bytes(ply(frame, faces))
        temporary.rename(folder)
        temporary = None
    except OSError as error:
        raise FileError(folder, f"cannot be written ({error.strerror})") from error
    finally:
        if temporary is not None:
            shutil.rmtree(temporary, ignore_errors=True)


def ply(vertices: np.ndarray, faces: np.ndarray) -> bytes:
    """A mesh as a PLY file: vertices in single precision, faces as lists of three."""
    header = (
        f"ply\nformat binary_little_endian 1.0\nelement vertex {len(vertices)}\n"
        "property float x\nproperty float y\nproperty float z\n"
        f"element face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    rows = np.empty(len(faces), dtype=_FACE)
    rows["count"], rows["corners"] = 3, faces
    return header.encode() + vertices.astype("<f4").tobytes() + rows.tobytes()


def _umask() -> int:
    """The process's umask; reading it means setting it."""
    mask = os.umask(0o022)
    os.umask(mask)
    return mask
