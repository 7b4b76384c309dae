"""The content of an ASF file: units, the root, bones with their axes and degrees of freedom, the tree."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from retarget_bench.errors import FileError
from retarget_bench.motion.files.acclaim.text import Line, lines, numbers
from retarget_bench.motion.recording import MOST_JOINTS

TRANSLATIONS, ROTATIONS, LENGTH = ("tx", "ty", "tz"), ("rx", "ry", "rz"), "l"
_DOFS = (*TRANSLATIONS, *ROTATIONS, LENGTH)
_SECTIONS = ("version", "name", "units", "documentation", "root", "bonedata", "hierarchy", "skin")
_ROOT = "root"

Triple = tuple[float, float, float]


@dataclass
class Bone:
    """A bone as the file states it, angles in radians.

    direction: unit vector in the world at rest. length: in the file's unit.
    axis, axis_order: angles about the fixed axes that ``axis_order`` ("XYZ") names, in this order: the
        frame in which ``dof`` is meant.
    dof: what the bone can do, in the order of its numbers in a motion: tx ty tz, rx ry rz, and l along it.
    """

    line: int
    name: str = ""
    direction: Triple = (0.0, 0.0, 0.0)
    length: float = 0.0
    axis: Triple = (0.0, 0.0, 0.0)
    axis_order: str = "XYZ"
    dof: tuple[str, ...] = ()


@dataclass
class AcclaimSkeleton:
    """An ASF file. ``bones`` are in an order with parents first, without the root, which is -1 among
    ``parents``.

    length: the file's ``length`` under ``:units``: inches times this are its unit.
    radians: of one unit of its angles. order: of the root's numbers, and of its turns about fixed axes.
    """

    path: Path
    length: float = 1.0
    radians: float = math.radians(1.0)
    order: tuple[str, ...] = (*TRANSLATIONS, *ROTATIONS)
    position: Triple = (0.0, 0.0, 0.0)
    orientation: Triple = (0.0, 0.0, 0.0)
    orientation_order: str = "XYZ"
    bones: list[Bone] = field(default_factory=list)
    parents: list[int] = field(default_factory=list)
    left_out: list[str] = field(default_factory=list)


def read_skeleton(path: Path) -> AcclaimSkeleton:
    """The skeleton of a file. Raises FileError, with its line, for whatever is not one."""
    skeleton = AcclaimSkeleton(path)
    sections = _sections(path)
    for needed in ("bonedata", "hierarchy"):
        if needed not in sections:
            raise FileError(path, f"has no section :{needed}: it is no Acclaim skeleton, or cut off")
    _units(skeleton, sections.get("units", []))
    _root(skeleton, sections.get("root", []))
    bones = _bones(skeleton, sections["bonedata"])
    _hierarchy(skeleton, bones, sections["hierarchy"])
    return skeleton


def _sections(path: Path) -> dict[str, list[Line]]:
    """The lines of each section, the words behind its own keyword as its first line."""
    sections: dict[str, list[Line]] = {}
    current: list[Line] = []
    for line in lines(path):
        if line.words[0].startswith(":"):
            name = line.words[0][1:].lower()
            if name not in _SECTIONS:
                raise line.fault(f":{name[:40]} is no section of an Acclaim skeleton")
            if name in sections:
                raise line.fault(f"a second section :{name}")
            current = sections[name] = []
            line = Line(path, line.number, line.words[1:])
        if line.words:
            current.append(line)
    return sections


def _units(skeleton: AcclaimSkeleton, section: Sequence[Line]) -> None:
    for line in section:
        keyword = line.words[0].lower()
        if keyword == "length":
            (skeleton.length,) = numbers(line, line.words[1:], 1)
            if skeleton.length <= 0:
                raise line.fault("the unit of length must be above 0")
        elif keyword == "angle":
            kind = line.words[1].lower() if len(line.words) > 1 else ""
            if kind not in ("deg", "rad"):
                raise line.fault("angle is deg or rad")
            skeleton.radians = 1.0 if kind == "rad" else math.radians(1.0)


def _root(skeleton: AcclaimSkeleton, section: Sequence[Line]) -> None:
    for line in section:
        keyword, words = line.words[0].lower(), line.words[1:]
        if keyword == "order":
            skeleton.order = _dof(line, words, (*TRANSLATIONS, *ROTATIONS))
        elif keyword == "axis":
            skeleton.orientation_order = _axis_order(line, words[:1])
        elif keyword == "position":
            skeleton.position = _triple(line, words)
        elif keyword == "orientation":
            skeleton.orientation = _angles(line, words, skeleton.radians)


def _bones(skeleton: AcclaimSkeleton, section: Sequence[Line]) -> dict[str, Bone]:
    bones: dict[str, Bone] = {}
    bone: Bone | None = None
    for line in section:
        keyword = line.words[0].lower()
        if keyword == "begin":
            if bone is not None:
                raise line.fault(f"'begin' inside the bone that begins in line {bone.line}")
            bone = Bone(line.number)
        elif bone is None:
            raise line.fault(f"{line.words[0][:40]!r} stands outside of 'begin' and 'end'")
        elif keyword == "end":
            if not bone.name:
                raise line.fault(f"the bone that begins in line {bone.line} has no name")
            if bone.name in bones or bone.name == _ROOT:
                raise line.fault(f"a second bone is called {bone.name!r}")
            if len(bones) == MOST_JOINTS:
                raise line.fault(f"more than {MOST_JOINTS} bones")
            bones[bone.name] = bone
            bone = None
        else:
            _fact(bone, keyword, line, skeleton.radians)
    if bone is not None:
        raise FileError(
            skeleton.path, f"the bone {bone.name!r} has no 'end': the file is cut off", bone.line
        )
    return bones


def _fact(bone: Bone, keyword: str, line: Line, radians: float) -> None:
    """A line of a bone; ids, masses and limits of angles say nothing of a motion that was recorded."""
    words = line.words[1:]
    if keyword == "name":
        if len(words) != 1 or not words[0].isprintable():
            raise line.fault("a bone's name is one word")
        bone.name = words[0].lower()
    elif keyword == "direction":
        x, y, z = _triple(line, words)
        size = math.hypot(x, y, z)
        bone.direction = (x / size, y / size, z / size) if size > 1e-12 else (0.0, 0.0, 0.0)
    elif keyword == "length":
        (bone.length,) = numbers(line, words, 1)
    elif keyword == "axis":
        bone.axis = _angles(line, words[:3], radians)
        bone.axis_order = _axis_order(line, words[3:])
    elif keyword == "dof":
        bone.dof = _dof(line, words, _DOFS)


def _hierarchy(skeleton: AcclaimSkeleton, bones: dict[str, Bone], section: Sequence[Line]) -> None:
    children: dict[str, list[str]] = {}
    lines: dict[str, int] = {}
    for line in section:
        parent, *below = [word.lower() for word in line.words]
        if parent in ("begin", "end") and not below:
            continue
        for name in (parent, *below):
            if name != _ROOT and name not in bones:
                raise line.fault(f"{name[:40]!r} is no bone of :bonedata")
        for name in below:
            if name in lines or name == _ROOT:
                where = f"line {lines[name]}" if name in lines else ":root"
                raise line.fault(f"{name!r} has a parent already, in {where}")
            lines[name] = line.number
        children.setdefault(parent, []).extend(below)
    if not children.get(_ROOT):
        raise FileError(skeleton.path, "nothing hangs on the root in :hierarchy")
    for name, parent_joint in _from_the_root(children):
        skeleton.bones.append(bones[name])
        skeleton.parents.append(parent_joint)
    used = {bone.name for bone in skeleton.bones}
    skeleton.left_out = [name for name in bones if name not in used]


def _from_the_root(children: dict[str, list[str]]) -> Iterator[tuple[str, int]]:
    """Bones and the places of their parents among them, -1 for the root: depth first."""
    waiting = [(name, -1) for name in reversed(children[_ROOT])]
    count = 0
    while waiting:
        name, parent = waiting.pop()
        yield name, parent
        waiting += [(child, count) for child in reversed(children.get(name, []))]
        count += 1


def _triple(line: Line, words: Sequence[str]) -> Triple:
    x, y, z = numbers(line, words, 3)
    return x, y, z


def _angles(line: Line, words: Sequence[str], radians: float) -> Triple:
    x, y, z = numbers(line, words, 3)
    return x * radians, y * radians, z * radians


def _axis_order(line: Line, words: Sequence[str]) -> str:
    order = words[0].upper() if words else "XYZ"
    if sorted(order) != ["X", "Y", "Z"]:
        raise line.fault(f"{order[:40]!r} is no order of axes such as XYZ")
    return order


def _dof(line: Line, words: Sequence[str], allowed: Sequence[str]) -> tuple[str, ...]:
    names = tuple(word.lower() for word in words)
    for name in names:
        if name not in allowed or names.count(name) > 1:
            raise line.fault(f"{name[:40]!r} is not one of {', '.join(allowed)}, or stands here twice")
    return names
