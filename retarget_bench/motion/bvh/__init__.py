"""BVH files, read and written.

``parse`` gives a file's content; ``read`` turns that into a skeleton and its motion; ``write`` goes back.
Every number is kept exactly. What cannot be kept is refused with a FileError that names file and line.
"""

import hashlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

from retarget_bench.errors import FileError
from retarget_bench.motion.bvh import cache as bvh_cache
from retarget_bench.motion.bvh.document import Document, Header, Hierarchy
from retarget_bench.motion.bvh.header import check_begins, plain, reaches_the_numbers, read_header
from retarget_bench.motion.bvh.recording import record
from retarget_bench.motion.bvh.values import read_values
from retarget_bench.motion.bvh.writing import document_of, write_document
from retarget_bench.motion.character import Motion
from retarget_bench.motion.file_kinds import TEXT, check_kind
from retarget_bench.motion.recording import Recording

__all__ = [
    "Document",
    "Header",
    "Hierarchy",
    "Recording",
    "parse",
    "parse_header",
    "read",
    "write",
    "write_document",
]

_CHUNK = 1 << 16


def parse(path: str | Path, *, cache: bool = True) -> Document:
    """The content of a file: joints with their channels, frame time, numbers.

    cache: keep what was parsed in the user's cache, under the hash of the file, and read it from there.
    Raises FileError, with file and line, for whatever is not a complete BVH file.
    """
    path = Path(path)
    if not cache:
        return _parse(path, _read(path))
    stamp = bvh_cache.stamp(path)
    if (document := bvh_cache.load(bvh_cache.content_hash(stamp))) is not None:
        return document
    data = _read(path)
    text = hashlib.sha256(data).hexdigest()
    if (document := bvh_cache.load(text)) is None:
        document = _parse(path, data)
        bvh_cache.save(text, document)
    bvh_cache.remember(stamp, text)
    return document


def parse_header(path: str | Path) -> Header:
    """The joints, the declared number of frames and the frame time, without reading the numbers.

    Raises FileError as ``parse`` does, as far as the header goes.
    """
    path = Path(path)
    with _opened(path) as file:
        data = file.read(_CHUNK)
        while not reaches_the_numbers(data) and (more := file.read(len(data))):
            data += more
    return read_header(path, plain(data))[0]


def read(
    path: str | Path,
    *,
    root: str = "auto",
    scale: float = 1.0,
    fold: bool = True,
    inner: bool = False,
    rate: float | None = None,
) -> Recording:
    """The motion of a file, in its own axes, lengths multiplied by ``scale``.

    root: how the root's position channels are meant: ``absolute`` places, ``relative`` to its OFFSET, or
        ``auto``, which finds out (``recording.is_relative``) and says so in the notes.
    fold: make the hips the root where the file's root only carries them.
    inner: where joints below the root move against their parents, give their ``places``. Without it such a
        file is refused; position channels that are constant do no harm.
    rate: frames per second of a file that states none (``Frame Time: 0``, or no number), which is else
        refused.

    A joint name that occurs twice gets a number. Clips of one body may share their ``Skeleton``.
    Raises FileError for what cannot be read.
    """
    path, document = Path(path), parse(path)
    if not document.frame_time and rate is None:
        raise FileError(
            path, "'Frame Time:' says no time: say how many frames there are a second (rate=30)"
        )
    return record(path, document, root=root, scale=scale, fold=fold, inner=inner, rate=rate)


def write(path: str | Path, motion: Motion, *, order: str = "ZXY", scale: float = 1.0) -> None:
    """Write a motion: lengths in metres times ``scale``, root places absolute, all joints with one order.

    Angles are written to 1e-8 degrees, lengths to 1e-8. Joints come in depth-first order, as the format
    wants. Where ``read`` would take the places for relative ones (a body far below its rest height), the
    root's OFFSET is written as 0, which every reader understands.
    Raises FileError when a number is not finite or a name cannot stand in a BVH file.
    """
    write_document(path, document_of(Path(path), motion, order=order, scale=scale))


@contextmanager
def _opened(path: Path) -> Iterator[BinaryIO]:
    """The file, which may be BVH by its first bytes."""
    kind = check_kind(path, "BVH", text=True)
    try:
        with path.open("rb") as file:
            if kind is TEXT:
                check_begins(path, file.read(_CHUNK))
                file.seek(0)
            yield file
    except OSError as error:
        raise FileError(path, f"cannot be read ({error.strerror or error})") from error


def _read(path: Path) -> bytes:
    with _opened(path) as file:
        return file.read()


def _parse(path: Path, data: bytes) -> Document:
    data = plain(data)
    header, end, lines = read_header(path, data)
    hierarchy = header.hierarchy
    if not hierarchy.columns:
        raise FileError(path, "no joint has channels: there is no motion in it")
    if not header.frames:
        raise FileError(path, "'Frames:' says 0: there is no motion in it", lines - 1)
    values = read_values(path, data, end, frames=header.frames, columns=hierarchy.columns, line=lines + 1)
    values.setflags(write=False)
    return Document(hierarchy, header.frame_time, values)
