"""Reading the block of numbers, by pandas' C reader."""

from __future__ import annotations

import io
import math
from pathlib import Path

import numpy as np

from retarget_bench.errors import FileError

_NUMBER = b"0123456789+-.eE"
_BLANK = b" \t\r\n\v\f"
_SPACE, _LINE_FEED = b" \n"
# Whatever no number contains becomes '?', so that 'nan', 'inf', '1,5' or '"3"' never pass for one.
_CLEAN = bytes(b if b in _NUMBER else 32 if b in _BLANK else 63 for b in range(256))


def read_values(path: Path, block: bytes, *, frames: int, columns: int, line: int) -> np.ndarray:
    """``(frames, columns)`` numbers of a block whose first line is line ``line`` of the file.

    A frame is a line. Raises FileError, with its line, for the first frame that has too few or too many
    numbers or one that is not finite, and for missing or surplus frames. Memory is bounded by the size of
    the block, whatever number of frames the file declares.
    """
    clean = block.translate(_CLEAN)
    starts, words = _lines(block, clean)
    used = np.flatnonzero(words)
    if used.size == frames and (words[used] == columns).all():
        values = _parse(clean)
        if values is not None and values.size == frames * columns and np.isfinite(values).all():
            return values.reshape(frames, columns)
    _check_lines(path, block, starts, words, columns, line)
    held = used.size
    if held > frames:
        where = line + int(used[frames])
        raise FileError(
            path, f"'Frames:' says {frames}, but there are {held}: this is the first surplus one", where
        )
    raise FileError(
        path,
        f"'Frames:' says {frames}, but there are only {held}: the file is cut off",
        line + len(words) - 1,
    )


def _lines(block: bytes, clean: bytes) -> tuple[np.ndarray, np.ndarray]:
    """Where every line starts, and how many words it holds."""
    if not block:
        return np.zeros(1, dtype=np.int64), np.zeros(1, dtype=np.int64)
    feeds = np.flatnonzero(np.frombuffer(block, dtype=np.uint8) == _LINE_FEED)
    starts = np.concatenate(([0], feeds + 1))
    starts = starts[starts < len(block)]
    blank = np.frombuffer(clean, dtype=np.uint8) == _SPACE
    begins = ~blank
    begins[1:] &= blank[:-1]
    return starts, np.add.reduceat(begins.view(np.uint8), starts, dtype=np.int64)


def _check_lines(
    path: Path, block: bytes, starts: np.ndarray, words: np.ndarray, columns: int, line: int
) -> None:
    """Raise for the first frame that has a wrong number of words or a word that is no finite number."""
    ends = [*starts[1:].tolist(), len(block)]
    frame = 0
    for index, (start, end, count) in enumerate(zip(starts.tolist(), ends, words.tolist(), strict=True)):
        frame += count > 0
        if count not in (0, columns):
            cut = count < columns and not block[end:].strip()
            reason = "it is cut off" if cut else f"the channels of the hierarchy need {columns}"
            raise FileError(path, f"frame {frame} has {count} of {columns} numbers: {reason}", line + index)
        for place, word in enumerate(block[start:end].split(), 1):
            if not _is_finite(word):
                shown = word[:40].decode("ascii", "replace")
                raise FileError(
                    path, f"number {place} of frame {frame} is {shown!r}, not a finite number", line + index
                )


def _is_finite(word: bytes) -> bool:
    try:
        return not word.translate(None, _NUMBER) and math.isfinite(float(word))
    except ValueError:
        return False


def _parse(clean: bytes) -> np.ndarray | None:
    """All numbers of a text that blanks alone separate, or None when one of them is not a number."""
    import pandas as pd  # half a second: only who parses pays for it

    # One column that "lines" of one number each make up: converting many short columns costs more.
    try:
        table = pd.read_csv(
            io.BytesIO(clean),
            lineterminator=" ",
            header=None,
            names=["value"],
            dtype=np.float64,
            engine="c",
            float_precision="round_trip",
            na_filter=False,
            quoting=3,
        )
    except (ValueError, pd.errors.ParserError):
        return None
    return table["value"].to_numpy()
