"""Writing documents as text."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from retarget_bench.errors import FileError, NotSupported
from retarget_bench.files import atomic
from retarget_bench.motion import rotation
from retarget_bench.motion.bvh.document import POSITIONS, Document, Hierarchy
from retarget_bench.motion.bvh.recording import is_relative
from retarget_bench.motion.skeleton import EndSite, Skeleton

if TYPE_CHECKING:
    from retarget_bench.motion.motion import Motion

_DECIMALS = 8
"""Of the angles and places of motions: a hundredth of what a round trip may lose."""


def write_document(path: str | Path, document: Document) -> None:
    """Write a document exactly: reading the file back gives the same numbers, bit for bit.

    The layout is always the same (tabs, one statement per line, end sites before child joints), so the
    text of a file that was written here does not change when it is read and written again.
    Raises FileError when a number is not finite or the file cannot be written.
    """
    _check_frames(path, document.values)
    header = (
        f"{hierarchy_text(document.hierarchy)}MOTION\n"
        f"Frames: {document.frames}\nFrame Time: {number_text(document.frame_time)}\n"
    )
    with atomic(path) as temporary:
        temporary.write_bytes(header.encode() + table_text(document.values))


def document_of(path: Path, motion: Motion, *, order: str, scale: float) -> Document:
    """The document for a motion; see ``bvh.write``."""
    if sorted(order) != ["X", "Y", "Z"]:
        raise NotSupported(f"order={order!r}: a BVH file turns about each of X, Y and Z once")
    if not (np.isfinite(scale) and scale > 0):
        raise NotSupported(f"scale must be positive, got {scale}")
    _check_frames(path, motion.root)
    _check_frames(path, motion.rotations)
    skeleton, offsets = motion.skeleton, np.array(motion.skeleton.offsets)
    if is_relative(skeleton, motion.rotations, motion.root, motion.root + offsets[0]):
        offsets[0] = 0.0  # or the motion would be taken for relative to it
    turns = tuple(f"{axis}rotation" for axis in order)
    joints = _depth_first(skeleton)
    place_of = {joint: place for place, joint in enumerate(joints)}
    hierarchy = Hierarchy(
        names=tuple(_checked_name(path, skeleton.names[joint]) for joint in joints),
        parents=np.array([place_of.get(skeleton.parents[joint], -1) for joint in joints]),
        offsets=_lengths(offsets[joints], scale),
        channels=((*POSITIONS, *turns), *[turns] * (len(joints) - 1)),
        end_sites=tuple(
            EndSite(place_of[site.parent], tuple(_lengths(np.array(site.offset), scale).tolist()))
            for site in sorted(skeleton.end_sites, key=lambda site: place_of[site.parent])
        ),
    )
    angles = np.degrees(rotation.to_euler(motion.rotations[:, joints], order))
    values = np.concatenate([motion.root * scale, angles.reshape(motion.frames, -1)], axis=1)
    return Document(hierarchy, 1.0 / motion.fps, np.round(values, _DECIMALS))


def _check_frames(path: str | Path, numbers: np.ndarray) -> None:
    """Refuse to write no frames ``(frames, ...)``, or frames that hold NaN or infinity."""
    if not len(numbers):
        raise FileError(path, "not written: the motion has no frames")
    broken = ~np.isfinite(numbers).reshape(len(numbers), -1).all(axis=1)
    if broken.any():
        raise FileError(
            path, f"not written: frame {np.argmax(broken) + 1} of the motion holds NaN or infinity"
        )


def _depth_first(skeleton: Skeleton) -> list[int]:
    order: list[int] = []
    open_joints = [0]
    while open_joints:
        order.append(joint := open_joints.pop())
        open_joints.extend(reversed(skeleton.children[joint]))
    return order


def _lengths(metres: np.ndarray, scale: float) -> np.ndarray:
    """In the file's unit: untouched at scale 1, else freed of the noise that scaling adds."""
    return np.array(metres) if scale == 1.0 else np.round(metres * scale, 12)


def _checked_name(path: Path, name: str) -> str:
    """The name, if it comes back unchanged from a file."""
    hidden = any("\ud800" <= sign <= "\udfff" for sign in name)
    if hidden or name != name.strip() or any(sign in name for sign in "{}\n\r"):
        raise FileError(path, f"not written: the joint name {name!r} cannot stand in a BVH file")
    return name


def hierarchy_text(hierarchy: Hierarchy) -> str:
    """The lines from HIERARCHY to the last brace."""
    tips: list[list[Sequence[float]]] = [[] for _ in hierarchy.names]
    for site in hierarchy.end_sites:
        tips[site.parent].append(site.offset)
    lines = ["HIERARCHY"]
    open_joints: list[int] = []
    for joint, parent in enumerate(hierarchy.parents.tolist()):
        while open_joints and open_joints[-1] != parent:
            open_joints.pop()
            lines.append("\t" * len(open_joints) + "}")
        tab = "\t" * len(open_joints)
        names = hierarchy.channels[joint]
        lines += [
            f"{tab}{'JOINT' if open_joints else 'ROOT'} {hierarchy.names[joint]}",
            f"{tab}{{",
            f"{tab}\tOFFSET {_offset_text(hierarchy.offsets[joint].tolist())}",
            f"{tab}\tCHANNELS {' '.join([str(len(names)), *names])}",
        ]
        for tip in tips[joint]:
            text = ("End Site", "{", f"\tOFFSET {_offset_text(tip)}", "}")
            lines += [f"{tab}\t{line}" for line in text]
        open_joints.append(joint)
    lines += ["\t" * depth + "}" for depth in reversed(range(len(open_joints)))]
    return "\n".join(lines) + "\n"


def _offset_text(offset: Sequence[float]) -> str:
    return " ".join(map(number_text, offset))


_TABLE_DECIMALS = (6, 8)
_LARGEST = 10**9
"""Whole parts below it, and eight decimals, fit 32-bit arithmetic, which is the fast one."""
_ROWS = 256


def number_text(number: float) -> str:
    """Six decimals where they are exact, else the shortest text that gives the same number back."""
    short = f"{number:.6f}"
    return short if float(short) == number else repr(float(number))


def table_text(values: np.ndarray) -> bytes:
    """Lines of finite numbers ``(rows, columns)``, with decimals enough to give each back exactly."""
    if not values.size or np.abs(values).max() < _LARGEST:
        for decimals in _TABLE_DECIMALS:
            if np.array_equal(np.round(values, decimals), values):
                parts = (values[at : at + _ROWS] for at in range(0, len(values), _ROWS))
                return b"".join(_fixed_text(part, decimals) for part in parts)
    return "".join(" ".join(map(repr, row)) + "\n" for row in values.tolist()).encode("ascii")


def _fixed_text(values: np.ndarray, decimals: int) -> bytes:
    """As ``%.6f`` would write them, ten times as fast: every digit of all numbers at once.

    Each number gets a row of characters: sign, whole part, point, decimals, separator. Signs and zeros
    that are not wanted are then left out of the text.
    """
    size = np.abs(values).ravel()
    integer = size.astype(np.uint32)
    decimal = np.rint((size - integer) * 10**decimals).astype(np.uint32)
    integer += decimal == 10**decimals  # rounded up
    decimal %= 10**decimals
    places = len(str(integer.max(initial=0)))
    text = np.empty((size.size, 1 + places + 1 + decimals + 1), dtype=np.uint8)
    kept = np.ones(text.shape, dtype=bool)
    text[:, 0] = ord("-")
    kept[:, 0] = np.signbit(values).ravel()
    for place in range(places):
        kept[:, places - place] = integer > 0 if place else True
        integer = _digit(integer, text[:, places - place])
    text[:, places + 1] = ord(".")
    for place in range(decimals):
        decimal = _digit(decimal, text[:, -2 - place])
    separators = text[:, -1].reshape(values.shape)
    separators[:, :-1] = ord(" ")
    separators[:, -1] = ord("\n")
    return text[kept].tobytes()


def _digit(numbers: np.ndarray, into: np.ndarray) -> np.ndarray:
    """Write the last digit of each number; the numbers without it."""
    rest = numbers // 10
    into[:] = numbers - 10 * rest + ord("0")
    return rest
