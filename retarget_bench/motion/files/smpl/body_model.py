"""Body models of the SMPL family as the user has them: joints and skin of a shape.

After Loper et al. 2015 (SMPL), eq. 8 to 10: the template plus shape directions times betas, and joints as
weighted means of its vertices. Pose blend shapes are not applied.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import islice
from pathlib import Path

import numpy as np

from retarget_bench.errors import FileError
from retarget_bench.motion.files.smpl.arrays import Archive, check_shape, shape_text
from retarget_bench.motion.files.smpl.families import BODY, BY_JOINTS, FAMILIES, Family
from retarget_bench.motion.mesh import Mesh

_NEEDED = ("v_template", "shapedirs", "J_regressor", "kintree_table")
_GENDERS = {"male": {"male", "m"}, "female": {"female", "f"}, "neutral": {"neutral", "n"}}
_DEEPEST, _MOST_FILES = 3, 10_000
_FARTHEST = 1e3
"""Metres."""
_PICKLED = (
    "a pickle, which could run anything when it is opened and is never loaded: take the .npz file of the "
    "same model, or save its arrays with numpy.savez where you trust it"
)


@dataclass(frozen=True, eq=False)
class Shaped:
    """A body model in the shape of some betas.

    joints:   ``(joints, 3)`` metres at rest. vertices: ``(vertices, 3)`` likewise.
    unused:   so many of the betas are beyond those that the model has.
    """

    path: Path
    family: Family
    joints: np.ndarray
    vertices: np.ndarray
    unused: int

    def skin(self) -> Mesh:
        """The surface at rest. Raises FileError where faces or weights do not fit."""
        archive = Archive(self.path)
        faces, weights = archive.numbers("f"), archive.numbers("weights")
        count = len(self.vertices)
        check_shape(self.path, "weights", weights, (count, len(self.family)))
        check_shape(self.path, "f", faces, (len(faces) if faces.ndim else 0, 3))
        if not 0 <= faces.min() <= faces.max() < count:
            raise FileError(self.path, "has faces ('f') with vertices that it has not: it is damaged")
        total = weights.sum(axis=1, keepdims=True)
        if (weights < -1e-6).any() or (np.abs(total - 1.0) > 0.1).any():
            raise FileError(self.path, "has 'weights' that are no shares of 1: it is damaged")
        return Mesh(self.vertices, faces.astype(np.int64), weights / total)


def load(place: Path, family: Family, gender: str, betas: np.ndarray) -> Shaped:
    """A body model in the shape of betas ``(n,)``.

    place:  an ``.npz`` file, or a folder with files of the usual names, of which the one of family and
        gender is taken.
    family: of the motion; with ``BODY`` any will do.
    Raises FileError where there is none, or it does not fit.
    """
    path = _model_file(place, family, gender) if place.is_dir() else place
    if path.suffix.lower() in (".pkl", ".pickle"):
        raise FileError(path, f"is {_PICKLED}")
    archive = Archive(path)
    if missing := [name for name in _NEEDED if name not in archive.names]:
        raise FileError(path, f"is no SMPL body model: it lacks {', '.join(missing)}")
    template = archive.numbers("v_template")
    count = len(template) if template.ndim else 0
    check_shape(path, "v_template", template, (count, 3))
    directions = archive.numbers("shapedirs", len(betas))
    if directions.ndim != 3 or directions.shape[:2] != (count, 3):
        check_shape(path, "shapedirs", directions, (count, 3, len(betas)))
    regressor = archive.numbers("J_regressor")
    own = _family(path, archive, regressor, count)
    if family is not BODY and own is not family:
        raise FileError(path, f"is a model of {own.name}, and the motion is of {family.name}")
    used = directions.shape[2]
    with np.errstate(all="ignore"):
        vertices = template + directions @ betas[:used]
        joints = regressor @ vertices
    if not (np.abs(vertices).max() < _FARTHEST and np.abs(joints).max() < _FARTHEST):
        raise FileError(
            path, f"gives a body beyond {_FARTHEST:g} m for these betas: one of the two is damaged"
        )
    return Shaped(path, own, joints, vertices, len(betas) - used)


def _family(path: Path, archive: Archive, regressor: np.ndarray, vertices: int) -> Family:
    """The family of a model, by its joints and their tree."""
    own = BY_JOINTS.get(len(regressor) if regressor.ndim else 0, BODY)
    if own is BODY:
        counts = ", ".join(f"{len(each)} ({each.name})" for each in FAMILIES if each is not BODY)
        raise FileError(
            path, f"has a J_regressor of shape {shape_text(regressor.shape)}; joints are {counts}"
        )
    check_shape(path, "J_regressor", regressor, (len(own), vertices))
    tree = archive.numbers("kintree_table")
    check_shape(path, "kintree_table", tree, (2, len(own)))
    if tree[0, 1:].tolist() != list(own.parents[1:]):
        raise FileError(path, f"has a kintree_table that is not that of {own.name}")
    return own


# ------------------------------------------------------------------------------------ which of a folder
def _model_file(folder: Path, family: Family, gender: str) -> Path:
    """The file of a folder that is named after family and gender: ``SMPLH_MALE.npz``,
    ``smplx/SMPLX_NEUTRAL.npz``, ``smplh/male/model.npz``, ``male/model.npz``."""
    listed = list(islice(_files(folder, 0), _MOST_FILES))
    fitting = [path for path in listed if _fits(path.relative_to(folder), family, gender)]
    fitting.sort(
        key=lambda path: (family.word not in _words(path.relative_to(folder)), len(path.parts), path)
    )
    for path in fitting:
        if path.suffix.lower() == ".npz" and set(_NEEDED) <= set(Archive(path).names):
            return path
    model = f"{gender} {family.name if family is not BODY else 'SMPL'} model"
    if pickled := [path for path in fitting if path.suffix.lower() != ".npz"]:
        return pickled[0]
    models = [str(path.relative_to(folder)) for path in listed if path.suffix.lower() == ".npz"]
    holds = ", ".join(models[:6]) or "no .npz file"
    raise FileError(
        folder, f"has no {model}, as in smplh/male/model.npz or SMPLX_NEUTRAL.npz; it holds {holds}"
    )


def _files(folder: Path, depth: int) -> Iterator[Path]:
    try:
        entries = sorted(folder.iterdir())
    except OSError as error:
        raise FileError(folder, f"cannot be listed ({error.strerror or error})") from error
    for entry in entries:
        if entry.is_dir():
            if depth < _DEEPEST:
                yield from _files(entry, depth + 1)
        elif entry.suffix.lower() in (".npz", ".pkl"):
            yield entry


def _fits(path: Path, family: Family, gender: str) -> bool:
    """Whether a path names the gender, and no other family."""
    words = _words(path)
    others = {each.word for each in FAMILIES if each.word not in ("", family.word)}
    return bool(words & _GENDERS[gender]) and (family is BODY or not words & others)


def _words(path: Path) -> set[str]:
    return set(re.findall(r"[a-z]+", str(path).lower()))
