"""The content of Acclaim files: the bones of an ASF file, and the numbers of an AMC file."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from retarget_bench.errors import FileError
from retarget_bench.motion.file_kinds import check_kind
from retarget_bench.motion.recording import MOST_JOINTS

TRANSLATIONS, ROTATIONS, LENGTH = ("tx", "ty", "tz"), ("rx", "ry", "rz"), "l"
ROOT = "root"
_DOFS = (*TRANSLATIONS, *ROTATIONS, LENGTH)
_LONGEST = 1e9
"""No body is longer in any unit, and no angle larger."""
_ZERO = (0.0, 0.0, 0.0)
_SECTIONS = ("version", "name", "units", "documentation", "root", "bonedata", "hierarchy", "skin")
_HEAD = re.compile(rb"\A(?:[^\S\n]*+(?:[#:][^\n]*+)?\n)*+")
_ANGLES = re.compile(rb"^\s*:(degrees|radians)\s*$", re.IGNORECASE | re.MULTILINE)
_NUMERIC = b"0123456789+-.eE"

Values = Mapping[str, np.ndarray]
"""Bone -> ``(frames, numbers)``, in the order of its degrees of freedom."""


@dataclass(frozen=True)
class Bone:
    """A bone as the file states it, or the root, which has no length.

    parent:    the place of the bone at whose end it begins, -1 of the root.
    direction: ``(3,)`` unit vector in the world at rest. length: in the file's unit.
    axis, axis_order: ``(3,)`` radians about the fixed X, Y and Z, and the order of these turns: the frame
        in which ``dof`` is meant; of the root how it stands at rest.
    dof: what it can do, in the order of its numbers in a motion: tx ty tz, rx ry rz, and l along it.
    """

    name: str
    parent: int
    direction: np.ndarray
    length: float
    axis: np.ndarray
    axis_order: str
    dof: tuple[str, ...]


@dataclass(frozen=True)
class Body:
    """An ASF file.

    bones: the root, and those that hang on it, parents first. left_out: the others' names.
    position: ``(3,)`` of the root at rest.
    length: the file's ``length`` under ``:units``: inches times this are its unit. radians: of one unit of
        its angles.
    """

    bones: tuple[Bone, ...]
    left_out: tuple[str, ...]
    position: np.ndarray
    length: float
    radians: float


# ------------------------------------------------------------------------------------------------- lines
class _Line(NamedTuple):
    """The words of a line, the first of them in small letters."""

    path: Path
    number: int
    keyword: str
    words: Sequence[str]

    def fault(self, problem: str) -> FileError:
        return FileError(self.path, problem, self.number)

    def numbers(self, words: Sequence[str], count: int) -> list[float]:
        """So many finite numbers. Raises FileError where these are others."""
        try:
            values = [float(word) for word in words if "_" not in word]
        except ValueError:
            values = []
        if not len(values) == len(words) == count or not all(abs(each) <= _LONGEST for each in values):
            plural, found = "s" * (count > 1), " ".join(words)[:60]
            raise self.fault(
                f"expected {count} finite number{plural} behind {self.keyword[:40]!r}, found {found!r}"
            )
        return values


def _lines(path: Path, text: bytes, first: int = 1) -> Iterator[_Line]:
    """The lines with something in them, without comments; commas and brackets are blanks."""
    for number, line in enumerate(text.decode("utf-8", "replace").split("\n"), first):
        if words := re.sub("[,()]", " ", line.partition("#")[0]).split():
            yield _Line(path, number, words[0].lower(), words[1:])


def _content(path: Path, name: str) -> bytes:
    """The bytes of an "ASF" or "AMC" file with LF at line ends. Raises FileError."""
    check_kind(path, name, text=True)
    try:
        data = path.read_bytes().removeprefix(b"\xef\xbb\xbf")
    except OSError as error:
        raise FileError(path, f"cannot be read ({error.strerror or error})") from error
    data = data if b"\n" in data else data.replace(b"\r", b"\n")
    return data if data.endswith(b"\n") else data + b"\n"


# ---------------------------------------------------------------------------------------------- skeleton
def read_skeleton(path: Path) -> Body:
    """The skeleton of a file. Raises FileError, with its line, for whatever is not one."""
    sections = _sections(path)
    for needed in ("bonedata", "hierarchy"):
        if needed not in sections:
            raise FileError(path, f"has no section :{needed}: it is no Acclaim skeleton, or cut off")
    units, root = (_facts(sections.get(each, ())) for each in ("units", "root"))
    length, radians = units.get("length", 1.0), units.get("angle", math.radians(1.0))
    if length <= 0:
        line = next(line for line in sections["units"] if line.keyword == "length")
        raise line.fault("the unit of length must be above 0")
    stated = _bones(sections["bonedata"])
    tree = _tree(path, stated, sections["hierarchy"])
    own = {"dof": (*TRANSLATIONS, *ROTATIONS), **root, "axis": root.get("orientation", _ZERO)}
    bones = []
    for name, parent in tree.items():
        facts = own if name == ROOT else stated[name]
        direction = facts.get("direction", _ZERO)
        size = math.hypot(*direction)
        unit = np.array([each / size if size > 1e-12 else 0.0 for each in direction])
        axis = radians * np.array(facts.get("axis", _ZERO))
        order = facts.get("axis order", "XYZ")
        bones.append(Bone(name, parent, unit, facts.get("length", 0.0), axis, order, facts.get("dof", ())))
    left_out = tuple(name for name in stated if name not in tree)
    return Body(tuple(bones), left_out, np.array(root.get("position", _ZERO)), length, radians)


def _sections(path: Path) -> dict[str, list[_Line]]:
    """The lines of each section, the words behind its own keyword as its first line."""
    sections: dict[str, list[_Line]] = {}
    current: list[_Line] = []
    for line in _lines(path, _content(path, "ASF")):
        if not line.keyword.startswith(":"):
            current.append(line)
            continue
        name = line.keyword[1:]
        if name not in _SECTIONS:
            raise line.fault(f":{name[:40]} is no section of an Acclaim skeleton")
        if name in sections:
            raise line.fault(f"a second section :{name}")
        current = sections[name] = []
        if line.words:
            current.append(_Line(path, line.number, line.words[0].lower(), line.words[1:]))
    return sections


def _facts(lines: Sequence[_Line]) -> dict[str, Any]:
    """Facts of the units, the root or a bone, by keyword; ids, masses and limits of angles say nothing of a
    motion that was recorded."""
    facts: dict[str, Any] = {}
    for line in lines:
        keyword, words = line.keyword, line.words
        if keyword == "length":
            (facts[keyword],) = line.numbers(words, 1)
        elif keyword in ("position", "orientation", "direction"):
            facts[keyword] = line.numbers(words, 3)
        elif keyword == "axis":
            if len(words) > 1:  # the root has the order alone
                facts[keyword], words = line.numbers(words[:3], 3), words[3:]
            facts["axis order"] = order = words[0].upper() if words else "XYZ"
            if sorted(order) != ["X", "Y", "Z"]:
                raise line.fault(f"{order[:40]!r} is no order of axes such as XYZ")
        elif keyword in ("order", "dof"):
            facts["dof"] = names = tuple(word.lower() for word in words)
            for name in names:
                if name not in _DOFS or names.count(name) > 1:
                    known = ", ".join(_DOFS)
                    raise line.fault(f"{name[:40]!r} is not one of {known}, or stands here twice")
        elif keyword == "angle":
            if (unit := words[0].lower() if words else "") not in ("deg", "rad"):
                raise line.fault("angle is deg or rad")
            facts[keyword] = 1.0 if unit == "rad" else math.radians(1.0)
        elif keyword == "name":
            if len(words) != 1 or not words[0].isprintable():
                raise line.fault("a bone's name is one word")
            facts[keyword] = words[0].lower()
    return facts


def _bones(section: Sequence[_Line]) -> dict[str, dict[str, Any]]:
    """Bone -> its facts."""
    bones: dict[str, dict[str, Any]] = {}
    start = 0
    for at, line in enumerate(section):
        if line.keyword == "begin" and at > start:
            raise line.fault(f"'begin' inside the bone that begins in line {section[start].number}")
        if line.keyword != "begin" and at == start:
            raise line.fault(f"{line.keyword[:40]!r} stands outside of 'begin' and 'end'")
        if line.keyword == "end":
            facts = _facts(section[start:at])
            if (name := facts.get("name")) is None:
                raise line.fault(f"the bone that begins in line {section[start].number} has no name")
            if name in bones or name == ROOT:
                raise line.fault(f"a second bone is called {name!r}")
            if len(bones) == MOST_JOINTS:
                raise line.fault(f"more than {MOST_JOINTS} bones")
            bones[name] = facts
            start = at + 1
    if section[start:]:
        raise section[start].fault("this bone has no 'end': the file is cut off")
    return bones


def _tree(path: Path, bones: Mapping[str, Any], section: Sequence[_Line]) -> dict[str, int]:
    """The root and the bones that hang on it, depth first -> the place of the parent among them, or -1."""
    children: dict[str, list[str]] = {}
    lines: dict[str, int] = {}
    for line in section:
        parent, below = line.keyword, [word.lower() for word in line.words]
        if parent in ("begin", "end") and not below:
            continue
        for name in (parent, *below):
            if name != ROOT and name not in bones:
                raise line.fault(f"{name[:40]!r} is no bone of :bonedata")
        for name in below:
            if name in lines or name == ROOT:
                where = f"line {lines[name]}" if name in lines else ":root"
                raise line.fault(f"{name!r} has a parent already, in {where}")
            lines[name] = line.number
        children.setdefault(parent, []).extend(below)
    if not children.get(ROOT):
        raise FileError(path, "nothing hangs on the root in :hierarchy")
    tree: dict[str, int] = {}
    waiting = [(ROOT, -1)]
    while waiting:
        name, above = waiting.pop()
        waiting += [(child, len(tree)) for child in reversed(children.get(name, []))]
        tree[name] = above
    return tree


# ------------------------------------------------------------------------------------------------ motion
def read_motion(path: Path, widths: Mapping[str, int], skeleton: Path) -> tuple[Values, float | None]:
    """The numbers of bones with so many degrees of freedom each (``widths``, in ``skeleton``), and the
    radians of one unit of their angles; None where the file does not say.

    A file whose frames are written alike is cut into words and converted as a whole. Raises FileError, with
    its line, where frames name other bones than the first.
    """
    data = _content(path, "AMC")
    block = _HEAD.sub(b"", data)
    head = data[: len(data) - len(block)]
    units = _ANGLES.findall(head)
    radians = (1.0 if units[-1].lower() == b"radians" else math.radians(1.0)) if units else None
    words, first = block.split(), head.count(b"\n") + 1
    if not words:
        raise FileError(path, "has no frames: there is no motion in it", first - 1)
    values = _alike(words, widths)
    if values is None:
        values = _by_lines(list(_lines(path, block, first)), widths, skeleton)
    return values, radians


def _alike(words: Sequence[bytes], widths: Mapping[str, int]) -> Values | None:
    """The numbers where every frame names the same bones in the same order; None where that is not sure."""
    places: dict[str, int] = {}
    size = 1
    while size < len(words) and not words[size].isdigit():
        name = words[size].decode("utf-8", "replace").lower()
        if name not in widths or name in places:
            return None
        places[name] = size
        size += 1 + widths[name]
    frames = len(words) // size
    if not places or len(words) % size or not all(map(bytes.isdigit, words[::size])):
        return None
    by_bone: dict[str, np.ndarray] = {}
    for name, place in places.items():
        columns = [words[n::size] for n in range(place + 1, place + 1 + widths[name])]
        try:
            numbers = [list(map(float, column)) for column in columns]
        except ValueError:
            return None
        # what float() takes beside plain numbers: nan, inf, 1_000
        plain = not any(b"".join(column).translate(None, _NUMERIC) for column in columns)
        by_bone[name] = np.array(numbers, dtype=np.float64).reshape(widths[name], frames).T
        alike = words[place::size].count(words[place]) == frames
        if not (alike and plain and np.abs(by_bone[name]).max() <= _LONGEST):
            return None
    return by_bone


def _by_lines(lines: Sequence[_Line], widths: Mapping[str, int], skeleton: Path) -> Values:
    """The slow way, for files with a fault, which it finds, and frames that are written in other orders."""
    starts: list[_Line] = []
    frames: list[dict[str, list[float]]] = []
    for line in lines:
        if line.keyword.isdigit() and not line.words:
            starts.append(line)
            frames.append({})
        elif not frames:
            shown = " ".join((line.keyword, *line.words))[:40]
            raise line.fault(f"expected the number of the first frame, found {shown!r}")
        elif line.keyword not in widths:
            raise line.fault(f"{line.keyword[:40]!r} is no bone of {skeleton.name} that can move")
        elif line.keyword in frames[-1]:
            raise line.fault(f"{line.keyword!r} stands twice in frame {len(frames)}")
        else:
            frames[-1][line.keyword] = line.numbers(line.words, widths[line.keyword])
    for number, (start, frame) in enumerate(zip(starts, frames, strict=True), 1):
        if not frame:
            raise start.fault(f"frame {number} is empty")
        if missing := [name for name in frames[0] if name not in frame]:
            more = f" and {len(missing) - 1} more bones" if len(missing) > 1 else ""
            raise start.fault(f"frame {number} lacks {missing[0]!r}{more}: the file is cut off or damaged")
        if extra := [name for name in frame if name not in frames[0]]:
            raise start.fault(f"frame {number} has {extra[0]!r}, which frame 1 lacks")
    return {name: np.array([frame[name] for frame in frames]) for name in frames[0]}
