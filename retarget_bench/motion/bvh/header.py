"""Reading the text before the numbers: joints, number of frames, frame time."""

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np

from retarget_bench.errors import FileError
from retarget_bench.motion.bvh.document import POSITIONS, ROTATIONS, Header, Hierarchy
from retarget_bench.motion.skeleton import EndSite

_MOTION = re.compile(rb"^[ \t]*MOTION[ \t\r]*$", re.IGNORECASE | re.MULTILINE)
_FRAMES = re.compile(r"\s*Frames\s*:\s*(\S+)\s*", re.IGNORECASE)
_FRAME_TIME = re.compile(r"\s*Frame\s+Time\s*:\s*(\S+)\s*", re.IGNORECASE)
_NO_TIME = re.compile(r"\s*Frame\s+Time\s*:\s*([-+]?(1\.#)?(nan|inf|q?nan|ind)\S*)?\s*", re.IGNORECASE)
"""A rate that the exporter did not know: nothing, or what division by it gives."""
_BRACE = re.compile("([{}])")
_NUMBERS = re.compile(
    rb"^[ \t]*+(?:OFFSET\b|Frame[ \t]++Time[ \t]*+:)?+([-+0-9.,E \t\r]++)$", re.IGNORECASE | re.MULTILINE
)
"""The numbers of a line: of an OFFSET, a frame, or the frame time."""
_DECIMAL_COMMA = re.compile(rb"[-+]?[0-9]*,[0-9]+(?:[eE][-+]?[0-9]+)?")
_THOUSANDS = re.compile(rb"[-+]?[1-9][0-9]{0,2},[0-9]{3}")
REMARK = re.compile(rb"^[ \t]*+(?:#|//|;)[^\n]*", re.MULTILINE)
"""A line that some programs write, like which no statement and no number begins."""
_DOS_END = b"\x1a"
_CHANNELS = {name.lower(): name for name in (*POSITIONS, *ROTATIONS)}
_END_SITE = -1
_LONGEST_NAME = 1000
_MOST_JOINTS = 10_000
"""More than any body has; it bounds the work on a damaged or hostile file."""
_LONGEST = 1 << 22
"""Bytes before the line MOTION: a hundred times those of a usual skeleton."""
_REMEMBERED = 1 << 18
_AFTER_MOTION = 4096
_SHOWN = 60

Offset = tuple[float, float, float]

_BOM = b"\xef\xbb\xbf"


def plain(data: bytes) -> bytes:
    """Without a byte order mark and DOS' end mark, lines ended by LF or CRLF, decimal points for commas."""
    data = data.removeprefix(_BOM)
    if _DOS_END in data[-_SHOWN:]:
        data = data.rstrip(_DOS_END + b" \t\r\n") + b"\n"
    data = data if b"\n" in data else data.replace(b"\r", b"\n")
    return _with_points(data) if b"," in data else data


def _with_points(data: bytes) -> bytes:
    """With decimal points, where all fractions have decimal commas, and without commas that stand before
    blanks; unchanged where commas and points are mixed otherwise, or commas might group thousands."""
    numbers = b" ".join(match[1] for match in _NUMBERS.finditer(data))
    commas = [word for word in numbers.split() if b"," in word]
    if all(word.find(b",") == len(word) - 1 for word in commas):
        return _NUMBERS.sub(lambda match: match[0].replace(b",", b" "), data)
    clear = all(map(_DECIMAL_COMMA.fullmatch, commas)) and not all(map(_THOUSANDS.fullmatch, commas))
    if b"." in numbers or not clear:
        return data
    return _NUMBERS.sub(lambda match: match[0].replace(b",", b"."), data)


def check_begins(path: Path, start: bytes) -> None:
    """Raise FileError where text begins with something else than HIERARCHY or remarks."""
    text = REMARK.sub(b"", start.removeprefix(_BOM)).lstrip()
    if text and text[:9].upper() != b"HIERARCHY":
        first = text.splitlines()[0][:40].decode("ascii", "replace")
        raise FileError(path, f"is not BVH: it begins with {first!r} instead of HIERARCHY")


def read_header(path: Path, data: bytes) -> tuple[Header, int, int]:
    """The header at the start of ``data``, the place where it ends, and the number of its lines.

    Raises FileError with the line at fault.
    """
    motion = _find_motion(data)
    head = data[: motion if motion >= 0 else _LONGEST]
    try:
        # the clips of a character mostly share the text of the hierarchy
        hierarchy = _remembered_hierarchy(head) if len(head) < _REMEMBERED else _hierarchy(head)
        line = head.count(b"\n") + 1
        if motion < 0:
            raise _Fault("the line MOTION is missing", line)
        _, motion, line = _next_line(data, motion, line)
        text, motion, line = _next_line(data, motion, line)
        frames = _frames(text, line - 1)
        text, motion, line = _next_line(data, motion, line)
        return Header(hierarchy, frames, _frame_time(text, line - 1)), motion, line - 1
    except _Fault as fault:
        raise FileError(path, fault.problem, fault.line) from None


def reaches_the_numbers(data: bytes) -> bool:
    """True if the first bytes of a file hold all of its header, or more than a header may have."""
    return 0 <= _find_motion(data) <= len(data) - _AFTER_MOTION or len(data) > _LONGEST


def _find_motion(data: bytes) -> int:
    """The start of the line MOTION, or -1."""
    usual = data.find(b"\nMOTION", 0, _LONGEST) + 1  # many times faster than the pattern
    match = (_MOTION.match(data, usual) if usual else None) or _MOTION.search(data, 0, _LONGEST)
    return match.start() if match else -1


def _next_line(data: bytes, start: int, line: int) -> tuple[str, int, int]:
    """The next line that is not blank, the place after it, and the number of the line there."""
    while start < len(data):
        feed = data.find(b"\n", start)
        text = data[start : feed if feed >= 0 else len(data)]
        start = feed + 1 if feed >= 0 else len(data)
        line += 1
        if text and not text.isspace() and not REMARK.match(text):
            return text.decode("latin-1"), start, line
    raise _Fault("ends before the lines 'Frames:' and 'Frame Time:'", line)


def _frames(text: str, line: int) -> int:
    match = _FRAMES.fullmatch(text)
    if not match or not re.fullmatch("[0-9]{1,15}", match[1]):
        raise _Fault(f"expected 'Frames:' and a whole number, found {text.strip()[:_SHOWN]!r}", line)
    return int(match[1])


def _frame_time(text: str, line: int) -> float:
    if _NO_TIME.fullmatch(text):
        return 0.0
    match = _FRAME_TIME.fullmatch(text)
    seconds = number(match[1]) if match else None
    if seconds is None or not (seconds == 0 or 1e-6 <= seconds <= 1e4):
        raise _Fault(f"expected 'Frame Time:' and seconds above 0, found {text.strip()[:_SHOWN]!r}", line)
    return seconds


def _hierarchy(head: bytes) -> Hierarchy:
    head = REMARK.sub(b"", head)
    try:
        text = head.decode("utf-8")
    except UnicodeDecodeError:
        text = head.decode("latin-1")  # never fails, and keeps names apart that are apart
    return _Reader().hierarchy(text.split("\n"))


_remembered_hierarchy = lru_cache(maxsize=256)(_hierarchy)


class _Fault(Exception):
    """A fault and its line."""

    def __init__(self, problem: str, line: int) -> None:
        super().__init__(problem)
        self.problem = problem
        self.line = line


def number(token: str) -> float | None:
    """A finite number, or None."""
    try:
        value = float(token)
    except ValueError:
        return None
    return value if math.isfinite(value) and "_" not in token else None


@dataclass
class _Block:
    """The braces of one joint or end site (``joint`` is -1) while they are being read."""

    joint: int
    label: str
    parent: int
    line: int
    opened: bool = False
    offset: Offset | None = None


class _Reader:
    """Walks over the lines; ``blocks`` are the joints that are still open, the outermost first."""

    def __init__(self) -> None:
        self.line = 0
        self.begun = False
        self.names: list[str] = []
        self.parents: list[int] = []
        self.offsets: list[Offset] = []
        self.channels: list[tuple[str, ...] | None] = []
        self.end_sites: list[EndSite] = []
        self.blocks: list[_Block] = []
        self.open_names: set[str] = set()

    def hierarchy(self, lines: Sequence[str]) -> Hierarchy:
        for number, line in enumerate(lines, 1):
            self.line = number
            self._statements(line.strip())
        if self.blocks:
            block = self.blocks[-1]
            raise self._fault(
                f"the hierarchy is cut off: {block.label}, begun in line {block.line}, has no '}}'"
            )
        if not self.names:
            raise self._fault("a hierarchy without a ROOT")
        return Hierarchy(
            names=tuple(self.names),
            parents=np.array(self.parents, dtype=np.int64),
            offsets=np.array(self.offsets, dtype=np.float64),
            channels=tuple(each or () for each in self.channels),
            end_sites=tuple(self.end_sites),
        )

    # ------------------------------------------------------------------------------------- statements
    def _statements(self, text: str) -> None:
        """One line: mostly one statement, but braces may share it with others."""
        if text == "{":
            self._open()
        elif text == "}":
            self._close()
        elif "{" not in text and "}" not in text:
            self._statement(text)
        else:
            for part in _BRACE.split(text):
                self._statements(part.strip())

    def _statement(self, text: str) -> None:
        words = text.split()
        if not words:
            return
        keyword = words[0].upper()
        if self.blocks and not self.blocks[-1].opened:
            raise self._fault(f"expected '{{' after {self.blocks[-1].label}, found {text[:_SHOWN]!r}")
        if keyword == "OFFSET":
            self._offset(words)
        elif keyword == "CHANNELS":
            self._channel_list(words)
        elif keyword in ("JOINT", "ROOT"):
            self._joint(keyword, text[len(keyword) :].strip())
        elif keyword == "END" and self.blocks:
            self._begin(_Block(_END_SITE, "End Site", self.blocks[-1].joint, self.line))
        elif keyword != "HIERARCHY" or self.begun:
            raise self._fault(f"{text[:_SHOWN]!r} is not a line of a BVH hierarchy")
        self.begun = True

    def _joint(self, keyword: str, name: str) -> None:
        if not name:
            raise self._fault(f"{keyword} without a name")
        if not name.isprintable():
            raise self._fault(
                f"{keyword} {name[:_SHOWN]!r} has characters in its name that cannot be printed"
            )
        if len(name) > _LONGEST_NAME:
            raise self._fault(f"{keyword} {name[:_SHOWN]!r}... has a name of {len(name):,} characters")
        if keyword == "ROOT" and self.names:
            raise self._fault(f"a second ROOT {name[:_SHOWN]!r}: save each skeleton in a file of its own")
        if keyword == "JOINT" and not self.blocks:
            raise self._fault(f"JOINT {name[:_SHOWN]!r} lies outside of the ROOT")
        if name in self.open_names:
            raise self._fault(
                f"joint {name[:_SHOWN]!r} lies below a joint of the same name: the hierarchy is cyclic"
            )
        if len(self.names) == _MOST_JOINTS:
            raise self._fault(f"more than {_MOST_JOINTS} joints")
        parent = self.blocks[-1].joint if self.blocks else -1
        self._begin(_Block(len(self.names), f"{keyword} {name[:_SHOWN]!r}", parent, self.line))
        self.open_names.add(name)
        self.names.append(name)
        self.parents.append(parent)
        self.channels.append(None)
        self.offsets.append((0.0, 0.0, 0.0))

    def _begin(self, block: _Block) -> None:
        if self.blocks and self.blocks[-1].joint == _END_SITE:
            raise self._fault(f"{block.label} lies inside an End Site")
        self.blocks.append(block)

    def _open(self) -> None:
        if not self.blocks or self.blocks[-1].opened:
            raise self._fault("'{' without a ROOT, JOINT or End Site before it")
        self.blocks[-1].opened = True

    def _close(self) -> None:
        if not self.blocks or not self.blocks[-1].opened:
            raise self._fault("'}' without a '{' before it")
        block = self.blocks.pop()
        if block.offset is None:
            raise self._fault(f"{block.label}, begun in line {block.line}, has no OFFSET")
        if block.joint == _END_SITE:
            self.end_sites.append(EndSite(block.parent, block.offset))
        else:
            self.open_names.discard(self.names[block.joint])

    def _offset(self, words: list[str]) -> None:
        numbers = [number(word) for word in words[1:]]
        x, y, z = numbers if len(numbers) == 3 else (None, None, None)
        if x is None or y is None or z is None:
            raise self._fault(f"OFFSET needs three finite numbers, found {' '.join(words[1:])[:_SHOWN]!r}")
        if not self.blocks or self.blocks[-1].offset is not None:
            raise self._fault("OFFSET outside of a joint, or the second one of a joint")
        block = self.blocks[-1]
        block.offset = (x, y, z)
        if block.joint != _END_SITE:
            self.offsets[block.joint] = block.offset

    def _channel_list(self, words: list[str]) -> None:
        joint = self.blocks[-1].joint if self.blocks else _END_SITE
        if joint == _END_SITE or self.channels[joint] is not None:
            raise self._fault("CHANNELS outside of a joint, or the second one of a joint")
        labels = words[2:]
        if len(words) < 2 or words[1] != str(len(labels)):
            says = words[1][:_SHOWN] if len(words) > 1 else "nothing"
            raise self._fault(f"CHANNELS says {says}, but {len(labels)} names follow")
        names = [_CHANNELS.get(word.lower()) for word in labels]
        if None in names:
            raise self._fault(
                f"channel {labels[names.index(None)][:_SHOWN]!r} is not one of Xposition, Yposition, "
                "Zposition, Xrotation, Yrotation and Zrotation"
            )
        if len(set(names)) < len(names):
            raise self._fault(f"a channel is named twice: {' '.join(labels)[:_SHOWN]}")
        self.channels[joint] = tuple(name for name in names if name)

    def _fault(self, problem: str) -> _Fault:
        return _Fault(problem, self.line)
