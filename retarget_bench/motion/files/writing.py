"""Motions as files of any format, by the ending of the name."""

from __future__ import annotations

from pathlib import Path

from retarget_bench.motion import bvh
from retarget_bench.motion.bvh import write_like
from retarget_bench.motion.character import Motion
from retarget_bench.motion.files import format_of
from retarget_bench.motion.files.formats import AMASS, BVH, FORMATS, GLTF
from retarget_bench.motion.files.gltf import write_into
from retarget_bench.motion.files.gltf import writing as gltf
from retarget_bench.motion.files.smpl import writing as smpl
from retarget_bench.motion.importer import Imported


def write(path: Path, motion: Motion, like: Imported | None = None) -> tuple[str, ...]:
    """Write a motion; returns what could not be kept.

    like: the file of the body. Where it is of the format to be written and has this skeleton, the result
    keeps all of it: joints, names, unit, axes, in a GLB mesh and materials, in an AMASS file betas and
    gender. Else the result is in metres and Y up (AMASS: Z up), a GLB has the character's mesh where there
    is one, and an AMASS file takes bodies with the joints of SMPL alone.
    path: ends in one of ``files.suffixes(written=True)``.
    Raises FileError.
    """
    wanted = next((form for form in FORMATS if path.suffix.lower() in form.suffixes), BVH)
    own = like is not None and motion.skeleton.same_as(like.motion.skeleton)
    if like is not None and own and format_of(like.findings.path) is wanted:
        if wanted is BVH:
            return write_like.write(path, motion, like, root=like.reading.root)
        if wanted is AMASS:
            return smpl.write_into(path, motion, like)
        return write_into.write(path, motion, like)
    if wanted is AMASS:
        return smpl.write(path, motion)
    if wanted is GLTF:
        gltf.write(path, motion)
    else:
        bvh.write(path, motion)
    return ()
