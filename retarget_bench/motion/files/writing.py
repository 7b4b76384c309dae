"""Motions as files of any format, by the ending of the name."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from retarget_bench.motion import bvh, inner_positions
from retarget_bench.motion.bvh import write_like
from retarget_bench.motion.character import Motion
from retarget_bench.motion.files import format_of
from retarget_bench.motion.files.formats import BVH, GLTF
from retarget_bench.motion.files.gltf import write_into
from retarget_bench.motion.files.gltf import writing as gltf
from retarget_bench.motion.importer import Imported


def write(
    path: Path, motion: Motion, like: Imported | None = None, places: np.ndarray | None = None
) -> tuple[str, ...]:
    """Write a motion; returns what could not be kept.

    like: the file of the body. Where it is of the format to be written and has this skeleton, the result
    keeps all of it: joints, names, unit, axes, and in a GLB mesh and materials. Else the result is in
    metres and Y up, and a GLB has the character's mesh where there is one.
    places: ``(frames, joints, 3)`` metres, every joint in its parent's frame, where joints below the root
        move there: kept where the result is as the file of the body and that file can state them.
    path: ends in one of ``files.suffixes(written=True)``.
    Raises FileError.
    """
    wanted = GLTF if path.suffix.lower() in GLTF.suffixes else BVH
    own = like is not None and motion.skeleton.same_as(like.motion.skeleton)
    if like is not None and own and format_of(like.findings.path) is wanted:
        if wanted is BVH:
            return write_like.write(path, motion, like, root=like.reading.root, places=places)
        return write_into.write(path, motion, like, places=places)
    if wanted is BVH:
        bvh.write(path, motion)
    else:
        gltf.write(path, motion)
    return () if places is None else (inner_positions.NOT_KEPT,)
