"""Reading the block of numbers, by pandas' C reader."""

from __future__ import annotations

import csv
from collections.abc import Iterator
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any, cast

import numpy as np

from retarget_bench.errors import FileError
from retarget_bench.motion.bvh.header import REMARK, number

if TYPE_CHECKING:
    from pandas.io.parsers import TextFileReader

_NUMBER = b"0123456789+-.eE"
_BLANK = b" \t\r\v\f"
# Whatever no number contains becomes '?', so that 'nan', 'inf', '1,5' or '"3"' never pass for one.
_CLEAN = bytes(b if b in _NUMBER + b"\n" else 32 if b in _BLANK else 63 for b in range(256))
# What no number of a file can be stands for the end of a line, so that one pass finds numbers and lines.
_END = b" inf "
_PIECE, _ROWS = 1 << 15, 1 << 16
"""Bytes handed to pandas and numbers taken from it at a time: few enough for the processor's caches."""


def read_values(path: Path, data: bytes, start: int, *, frames: int, columns: int, line: int) -> np.ndarray:
    """``(frames, columns)`` numbers that fill ``data`` from ``start`` on, the first in line ``line``.

    A frame is a line; frames that are broken over lines, or share one, are read where there are as many
    numbers as declared. Raises FileError, with its line, for the first frame that has too few or too many
    numbers or one that is not finite, and for missing or surplus frames. Memory is bounded by the size of
    the data, whatever number of frames the file declares.
    """
    tail = data[max(start, len(data) - _PIECE) :]
    text = _Text(data, start, len(data) - len(tail) + len(tail.rstrip()))
    values = _parse(text, frames, columns)
    return values if values is not None else _parse_checked(path, data[start:], frames, columns, line)


class _Text:
    """A stretch of the data as a file that pandas can read: numbers and line ends, spaces between them."""

    def __init__(self, data: bytes, start: int, stop: int) -> None:
        self.data = data
        self.at = start
        self.stop = stop
        self.ended = False

    def read(self, size: int = -1) -> bytes:  # noqa: ARG002
        """The next piece, of a size of our own choice; empty after the last."""
        piece = self.data[self.at : min(self.at + _PIECE, self.stop)]
        self.at += len(piece)
        if piece:
            return piece.translate(_CLEAN).replace(b"\n", _END)
        last, self.ended = b"" if self.ended else _END, True
        return last

    def __iter__(self) -> Iterator[bytes]:
        """Pandas takes for a file what has ``read`` and can be iterated over."""
        return iter(self.read, b"")


def _parse(text: _Text, frames: int, columns: int) -> np.ndarray | None:
    """``(frames, columns)`` finite numbers, or None where that is not exactly what the text holds."""
    if frames * columns * 2 > text.stop - text.at + 1:
        return None
    numbers = np.empty(frames * (columns + 1))
    filled = 0
    try:
        with _pandas_reader(text) as reader:
            for table in reader:
                some = table.to_numpy()[:, 0]
                numbers[filled : filled + some.size] = some
                filled += some.size
    except ValueError:  # not a number, or more of them than there is room for
        return None
    rows = numbers.reshape(frames, columns + 1)
    values = rows[:, :columns]
    with np.errstate(over="ignore", invalid="ignore"):  # whose sum is too large take the slow way
        finite = np.isfinite(values.sum())
    complete = filled == numbers.size and np.isinf(rows[:, columns]).all() and finite
    return values if complete else None


def _pandas_reader(text: _Text) -> TextFileReader:
    import pandas as pd  # half a second: only who parses pays for it

    # exact by default since 3.1, where asking for it is deprecated
    old = tuple(map(int, pd.__version__.split(".")[:2])) < (3, 1)
    exact: dict[str, Any] = {"float_precision": "round_trip"} if old else {}
    # For pandas every number is a line of its own: converting one long column is twice as fast as many
    # short ones. low_memory would cut that column into pieces.
    return pd.read_csv(
        cast("IO[bytes]", text),
        lineterminator=" ",
        header=None,
        dtype=np.float64,
        engine="c",
        na_filter=False,
        quoting=csv.QUOTE_NONE,
        low_memory=False,
        chunksize=_ROWS,
        **exact,
    )


def _parse_checked(path: Path, block: bytes, frames: int, columns: int, line: int) -> np.ndarray:
    """The slow way, for files with a fault, which it finds, and files with blank, commented or wrapped
    lines."""
    block = REMARK.sub(b"", block)
    as_declared = len(block.split()) == frames * columns
    lines = [(number, text) for number, text in enumerate(block.split(b"\n"), line) if text.strip()]
    if as_declared and len(lines) != frames:
        lines = _unwrapped(lines, columns)
    for frame, (own_line, text) in enumerate(lines, 1):
        if problem := _fault(text.split(), columns, last=frame == len(lines)):
            raise FileError(path, f"frame {frame} {problem}", own_line)
    if len(lines) > frames:
        follow = f"but {len(lines)} follow, of which this is the first surplus one"
        raise FileError(path, f"'Frames:' says {frames}, {follow}", lines[frames][0])
    if len(lines) < frames:
        problem = f"'Frames:' says {frames}, but only {len(lines)} follow: the file is cut off"
        raise FileError(path, problem, lines[-1][0] if lines else line - 1)
    return np.array(block.split(), dtype=np.float64).reshape(frames, columns)


def _unwrapped(lines: list[tuple[int, bytes]], columns: int) -> list[tuple[int, bytes]]:
    """Lines of a frame each, with the numbers of the lines in which they begin, of frames that were broken
    over lines or share them."""
    words = [(number, word) for number, text in lines for word in text.split()]
    frames = (words[at : at + columns] for at in range(0, len(words), columns))
    return [(frame[0][0], b" ".join(word for _, word in frame)) for frame in frames]


def _fault(words: list[bytes], columns: int, *, last: bool) -> str | None:
    """The fault of the words of a frame, or None."""
    if len(words) != columns:
        reason = "the file is cut off" if last and len(words) < columns else f"there are {columns} channels"
        return f"has {len(words)} of {columns} numbers: {reason}"
    for place, word in enumerate(words, 1):
        if word.translate(None, _NUMBER) or number(word.decode("latin-1")) is None:
            return (
                f"has {word[:40].decode('ascii', 'replace')!r} as number {place}, which is no finite number"
            )
    return None
