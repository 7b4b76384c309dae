"""A motion in the dress of another file: its joints, names, channels, unit, axes and OFFSETs stay."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from retarget_bench.errors import FileError, some
from retarget_bench.files import atomic
from retarget_bench.motion import bvh, rotation
from retarget_bench.motion.bvh import Document, Hierarchy, Recording
from retarget_bench.motion.bvh.document import POSITIONS, ROTATIONS
from retarget_bench.motion.bvh.recording import local_rotations
from retarget_bench.motion.importer import Imported, as_stated, places_as_stated
from retarget_bench.motion.motion import Motion
from retarget_bench.motion.recording import reach

_ANGLE = 1e-3
"""Degrees by which a written file may differ from the motion before it counts as another motion."""
_DIGITS = 6
_ROUNDED = 1e-3
"""Share of a body's reach within which a reader takes position channels for constant."""


@dataclass(frozen=True)
class _Pattern:
    """The file that is imitated. ``first`` is the joint that became the root; those above only carry it."""

    path: Path
    document: Document
    reading: str
    first: int


def write(
    path: str | Path,
    motion: Motion,
    like: Imported,
    *,
    root: str = "auto",
    places: np.ndarray | None = None,
) -> tuple[str, ...]:
    """Write a motion of the body of ``like`` as that file would state it; returns what could not be kept.

    ``like`` was loaded with the same ``root``. The file is read back before it takes its name, so that
    what lies there is the motion; nothing is left behind when it is not.
    places: ``(frames, joints, 3)`` metres, every joint in its parent's frame, where joints below the root
        move there; None: bones keep their length.
    Raises FileError where the body's file has no channels to say where the body is.
    """
    path, source = Path(path), like.findings.path
    rate = like.reading.rate
    recording, document = bvh.read(source, root=root, inner=True, rate=rate), bvh.parse(source)
    other = bvh.read(source, root="relative", inner=True, rate=rate)
    relative = np.array_equal(other.root, recording.root)
    first = len(document.hierarchy) - len(recording.skeleton)
    pattern = _Pattern(source, document, "relative" if relative else "absolute", first)
    expected = as_stated(motion, like)
    values, notes = _values(pattern, expected)
    steps = None if places is None else places_as_stated(places, like)
    notes = (*notes, *_place_inner(values, pattern, recording, steps))
    document = Document(pattern.document.hierarchy, 1.0 / motion.fps, np.round(values, _DIGITS))
    with atomic(path) as temporary:
        bvh.write_document(temporary, document)
        if not notes:
            _check(path, bvh.read(temporary, root=pattern.reading, inner=True), expected, steps)
    return notes


def _values(pattern: _Pattern, motion: Motion) -> tuple[np.ndarray, tuple[str, ...]]:
    """``(frames, columns)`` numbers of a file; joints above the first stay as in its first frame."""
    hierarchy = pattern.document.hierarchy
    values = np.repeat(pattern.document.values[:1], motion.frames, axis=0)
    place_channels, place, heading = _placed(pattern, motion.root)
    values[:, place_channels] = place
    turned = np.array(motion.rotations)
    turned[:, 0] = rotation.multiply(rotation.conjugate(heading)[None], turned[:, 0])
    columns = [_columns(hierarchy, joint, ROTATIONS) for joint in range(pattern.first, len(hierarchy))]
    orders = ["".join("XYZ"[axis] for axis in (*each, *sorted({0, 1, 2} - set(each)))) for each in columns]
    angles = np.stack([rotation.to_euler(turned[:, j], order) for j, order in enumerate(orders)], axis=1)
    angles = np.degrees(angles)
    angles = _without_jumps(angles, np.array([len(each) == 3 for each in columns]))
    notes = []
    for joint, each in enumerate(columns):
        values[:, list(each.values())] = angles[:, joint, : len(each)]
        lost = float(np.abs(angles[:, joint, len(each) :]).max(initial=0.0))
        if lost > _ANGLE:
            name = hierarchy.names[pattern.first + joint]
            notes.append(f"{name} has {len(each)} rotation channels: {lost:.1f} degrees lost")
    return values, tuple(notes)


def _place_inner(
    values: np.ndarray, pattern: _Pattern, recording: Recording, steps: np.ndarray | None
) -> list[str]:
    """Put the position channels of joints below the first to ``steps`` ``(frames, joints, 3)``, or to the
    places that the skeleton gives them; a note on joints that move and have no such channels."""
    if recording.places is None and steps is None:
        return []
    hierarchy, offsets = pattern.document.hierarchy, recording.skeleton.offsets
    steps = np.broadcast_to(offsets, (len(values), *offsets.shape)) if steps is None else steps
    without = []
    for joint in range(1, len(offsets)):
        own = pattern.first + joint
        columns = _columns(hierarchy, own, POSITIONS)
        if len(columns) == 3:
            stated = pattern.document.values[:, [columns[axis] for axis in range(3)]]
            place = offsets[joint] if recording.places is None else recording.places[:, joint]
            added = _nearest(place - stated, hierarchy.offsets[own])
            values[:, [columns[axis] for axis in range(3)]] = steps[:, joint] - added
        elif np.abs(steps[:, joint] - offsets[joint]).max() > _ROUNDED * reach(recording.skeleton):
            without.append(hierarchy.names[own])
    if not without:
        return []
    return [f"no position channels in the target's file, so positions are left out: {some(without)}"]


def _nearest(added: np.ndarray, offset: np.ndarray) -> np.ndarray:
    """0 or the OFFSET: whichever was added to position channels."""
    mean = added.mean(axis=0)
    return offset if np.abs(mean - offset).sum() < np.abs(mean).sum() else np.zeros(3)


def _without_jumps(angles: np.ndarray, free: np.ndarray) -> np.ndarray:
    """``(frames, joints, 3)`` the same rotations, each by those of their angles closest to the last ones.

    Three angles mean the same as both outer ones half a turn on and the middle one mirrored, and as any
    whole turns more. Curves that jump between these are what animators cannot edit.
    free: ``(joints,)`` whether the joint has all three angles, so that it may be said the other way.
    """
    other = 180.0 + angles * [1.0, -1.0, 1.0]
    smooth = angles.copy()
    for frame in range(1, len(angles)):
        before = smooth[frame - 1]
        near, far = (
            way + 360.0 * np.round((before - way) / 360.0) for way in (angles[frame], other[frame])
        )
        shorter = np.abs(far - before).sum(axis=-1) < np.abs(near - before).sum(axis=-1)
        smooth[frame] = np.where((shorter & free)[:, None], far, near)
    return smooth


def _placed(pattern: _Pattern, root: np.ndarray) -> tuple[list[int], np.ndarray, np.ndarray]:
    """Columns and numbers that bring the first joint to ``root``, and the heading that it inherits."""
    hierarchy, still = pattern.document.hierarchy, pattern.document.values[0]
    movable = [j for j in range(pattern.first + 1) if len(_columns(hierarchy, j, POSITIONS)) == 3]
    if not movable:
        raise FileError(pattern.path, "has no position channels: it cannot hold where a body is")
    mover = movable[-1]
    turned = local_rotations(replace(pattern.document, values=pattern.document.values[:1]))[0]
    fixed, heading, at_mover = np.zeros(3), rotation.identity(), rotation.identity()
    for joint in range(pattern.first + 1):
        columns = _columns(hierarchy, joint, POSITIONS)
        stated = joint in movable
        if joint == mover:
            at_mover = heading
        step = still[[columns[axis] for axis in range(3)]] if stated and joint != mover else np.zeros(3)
        if not stated or pattern.reading == "relative":
            step = step + hierarchy.offsets[joint]
        fixed = fixed + rotation.rotate(heading, step)
        if joint < pattern.first:
            heading = rotation.multiply(heading, turned[joint])
    columns = _columns(hierarchy, mover, POSITIONS)
    place = rotation.rotate(rotation.conjugate(at_mover)[None], root - fixed)
    return [columns[axis] for axis in range(3)], place, heading


def _columns(hierarchy: Hierarchy, joint: int, names: tuple[str, ...]) -> dict[int, int]:
    """Axis (0, 1, 2) -> column of the joint's position or rotation channels, in file order."""
    first = hierarchy.first_columns[joint]
    return {names.index(c): first + i for i, c in enumerate(hierarchy.channels[joint]) if c in names}


def _check(path: Path, written: Recording, expected: Motion, steps: np.ndarray | None) -> None:
    """Raise FileError where the file that was written holds another motion than the one it should."""
    turned = np.degrees(rotation.angle(written.rotations, expected.rotations)).max()
    size = max(float(np.abs(expected.skeleton.bone_lengths).sum()), 1e-9)
    moved = float(np.abs(written.root - expected.root).max()) / size
    if steps is not None:
        places = written.skeleton.offsets if written.places is None else written.places
        away = np.abs(places - steps)[:, 1:].max(initial=0.0)
        moved = max(moved, float(away) / size - _ROUNDED)
    if turned > _ANGLE or moved > 1e-5:
        raise FileError(
            path,
            f"not written: the target's file cannot state this motion (off by {turned:.2g} degrees, "
            f"{moved:.2g} of the body's size at the root)",
        )
