"""Motions as files of any format, by the ending of the name."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from retarget_bench.motion import bvh, inner_positions
from retarget_bench.motion.bvh import write_like
from retarget_bench.motion.character import Motion
from retarget_bench.motion.files import format_of
from retarget_bench.motion.files.formats import AMASS, BVH, FORMATS, GLTF
from retarget_bench.motion.files.gltf import write_into
from retarget_bench.motion.files.gltf import writing as gltf
from retarget_bench.motion.files.smpl import writing as smpl
from retarget_bench.motion.importer import Imported


def write(
    path: Path, motion: Motion, like: Imported | None = None, places: np.ndarray | None = None
) -> tuple[str, ...]:
    """Write a motion; returns what could not be kept.

    like: the file of the body. Where it is of the format to be written and has this skeleton, the result
    keeps all of it: joints, names, unit, axes, in a GLB mesh and materials, in an AMASS file betas and
    gender. Else the result is in metres and Y up (AMASS: Z up), a GLB has the character's mesh where there
    is one, and an AMASS file takes bodies with the joints of SMPL alone.
    places: ``(frames, joints, 3)`` metres, every joint in its parent's frame, where joints below the root
        move there: kept where the result is as the file of the body and that file can state them.
    path: ends in one of ``files.suffixes(written=True)``.
    Raises FileError.
    """
    output_format = next((form for form in FORMATS if path.suffix.lower() in form.suffixes), BVH)
    if like is not None and not motion.skeleton.same_as(like.motion.skeleton):
        like = None
    if like is not None and format_of(like.findings.path) is not output_format:
        like = None
    if like is not None and output_format is BVH:
        return write_like.write(path, motion, like, root=like.reading.root_place, places=places)
    if like is not None and output_format is GLTF:
        return write_into.write(path, motion, like, places=places)
    lost = () if places is None else (inner_positions.NOT_KEPT,)
    if output_format is AMASS:
        notes = smpl.write(path, motion) if like is None else smpl.write_into(path, motion, like)
        return (*notes, *lost)
    if output_format is GLTF:
        gltf.write(path, motion)
    else:
        bvh.write(path, motion)
    return lost
