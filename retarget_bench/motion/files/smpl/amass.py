"""Motions as AMASS archives state them (Mahmood et al. 2019): turns of the joints, translation and betas.

The root joint turns in its place at rest and is then moved by ``trans``: it is at J + trans, where J is its
place in the rest pose of the body model. Bodies are shaped after Loper et al. 2015 (SMPL), eq. 8 to 10: the
template plus shape directions times betas, and joints as weighted means of its vertices. Pose blend shapes
are not applied.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable
from dataclasses import dataclass
from itertools import islice
from os import PathLike
from pathlib import Path

import numpy as np

from retarget_bench.errors import FileError
from retarget_bench.motion import rotation
from retarget_bench.motion.files.smpl import skeletons
from retarget_bench.motion.files.smpl.arrays import Archive, check_shape, shape_text
from retarget_bench.motion.files.smpl.skeletons import BODY, BY_JOINTS, FAMILIES, Family
from retarget_bench.motion.mesh import Mesh
from retarget_bench.motion.recording import Recording
from retarget_bench.motion.skeleton import Skeleton

_POSES, _TRANS = ("poses", "smpl_poses", "pose", "fullpose"), ("trans", "transl", "smpl_trans")
_ROOT, _TRUNK = ("root_orient", "global_orient"), ("pose_body", "body_pose")
"""Names of AMASS, those of the arguments of SMPL models, of AIST++, and of estimators (``pose``)."""
_SCALING = "smpl_scaling"
"""The size of a person of AIST++, whose translation is that of a body so much larger than the model."""
_OTHERS = ("pose_jaw", "pose_eye", "pose_hand")
"""The joints after root and trunk in ``poses``."""
_RATES = ("mocap_framerate", "mocap_frame_rate", "fps", "frame_rate", "framerate")
_AXES = ("x", "y", "z", "-x", "-y", "-z")
_DEFAULT_RATE = 30.0
_SLOWEST, _FASTEST = 0.1, 10_000.0
_MOST_TURN, _FARTHEST = 1e3, 1e9
_ROUNDED = 1e-2
"""How far rotation matrices may be from orthogonal."""
_DEGREES = 8 * np.pi
"""Radians: joints that turn by more are thought to be stated in degrees."""
_NEEDED = ("v_template", "shapedirs", "J_regressor", "kintree_table")
_GENDERS = {"male": {"male", "m"}, "female": {"female", "f"}, "neutral": {"neutral", "n"}}
_DEEPEST, _MOST_FILES = 4, 10_000
_LARGEST = 1e3
"""Metres of a body."""
_PICKLED = (
    "a pickle, which could run anything when it is opened and is never loaded: take the .npz file of the "
    "same model, or save its arrays with numpy.savez where you trust it"
)


@dataclass(frozen=True, eq=False)
class Parameters:
    """The content of an archive.

    turns:  ``(frames, joints, 3)`` radians: axis times angle, in the parent's frame.
    trans:  ``(frames, 3)`` metres.
    betas:  ``(n,)`` of the shape. gender: ``male``, ``female`` or ``neutral``.
    fps:    frames per second. rate_stated: whether the file says them.
    model:  ``surface_model_type``, "" where the file has none. up: its ``up_axis``, likewise.
    notes, doubts: as of a ``Recording``.
    """

    family: Family
    turns: np.ndarray
    trans: np.ndarray
    betas: np.ndarray
    gender: str
    fps: float
    rate_stated: bool
    model: str
    up: str
    notes: tuple[str, ...]
    doubts: tuple[str, ...]


def holds_motion(path: Path) -> bool:
    """Whether an archive is of this format, by the names of its arrays; False for what cannot be read."""
    try:
        return _is_motion(Archive(path).names)
    except FileError:
        return False


def _is_motion(names: Iterable[str]) -> bool:
    names = set(names)
    return bool(names & set(_POSES) or (names & set(_ROOT) and names & set(_TRUNK)))


def read(path: Path, model: str | PathLike[str] | None = None, rate: float | None = None) -> Recording:
    """The motion of an archive, in metres, on the joints of a body model or on an average skeleton.

    model: file or folder of body models. rate: frames per second, where they are told: the file's own may
        then be missing or wrong.
    Raises FileError for what cannot be read or does not fit.
    """
    content = parameters(path, rate)
    notes, doubts = list(content.notes), list(content.doubts)
    skeleton, skin = skeletons.average(content.family), None
    if model is None:
        doubts.append("an average skeleton: say body_model=FILE for this person's joints")
    else:
        shaped = load_model(Path(model).expanduser(), content.family, content.gender, content.betas)
        skeleton, skin = shaped.skeleton, shaped.skin
        notes.append(f"joints and skin of {shaped.path.name}, without pose blend shapes")
        if shaped.unused:
            doubts.append(
                f"{shaped.unused} of the {len(content.betas)} betas are beyond those of {shaped.path.name}"
            )
    missing = len(skeleton) - len(content.family)
    turns = np.pad(content.turns, ((0, 0), (0, missing), (0, 0)))
    rotations = rotation.continuous(rotation.in_blocks(rotation.from_rotation_vector, turns))
    root = content.trans + skeleton.offsets[0]
    return Recording(
        skeleton,
        rotations,
        root,
        content.fps,
        tuple(notes),
        tuple(doubts),
        unit="m",
        up=content.up,
        skin=skin,
        rate_stated=content.rate_stated,
    )


def parameters(path: Path, rate: float | None = None) -> Parameters:
    """The content of an archive. Raises FileError."""
    archive = Archive(path)
    if not _is_motion(archive.names):
        held = ", ".join(archive.names[:8]) or "no arrays"
        raise FileError(
            path, f"is no AMASS file: it has neither poses nor root_orient and pose_body, but {held}"
        )
    turns, doubts = _turns(archive)
    frames = len(turns)
    name = _first(archive, _TRANS)
    if name:
        trans = archive.numbers(name)
        check_shape(path, name, trans, (frames, 3))
        _check_size(archive, name, trans, _FARTHEST)
        if name == "smpl_trans" and _SCALING in archive.names:
            trans = trans / _scaling(archive)
    else:
        trans = np.zeros((frames, 3))
        doubts.append("states no 'trans': the body stays in its place")
    betas, notes = _betas(archive, frames)
    fps, stated = _rate(archive, rate)
    if not stated and rate is None:
        doubts.append(f"states no mocap_framerate: {_DEFAULT_RATE:g} frames per second; else say rate=...")
    gender = archive.text("gender").lower() if "gender" in archive.names else ""
    gender = gender.removeprefix("b'").removesuffix("'")  # bytes that somebody took for text
    if gender not in ("male", "female", "neutral"):
        notes.append("states no gender that is known: taken for neutral")
        gender = "neutral"
    family = BY_JOINTS[turns.shape[1]]
    notes.insert(0, f"{family.name}, {gender}, {len(betas)} betas")
    model = archive.text("surface_model_type") if "surface_model_type" in archive.names else ""
    up = archive.text("up_axis") if "up_axis" in archive.names else ""
    return Parameters(
        *(family, turns, trans, betas, gender, fps, stated, model, up if up in _AXES else ""),
        tuple(notes),
        tuple(doubts),
    )


def _scaling(archive: Archive) -> float:
    scaling = archive.numbers(_SCALING)
    if scaling.size != 1 or not 1e-3 <= (value := float(scaling.reshape(-1)[0])) <= 1e3:
        raise FileError(archive.path, f"has {_SCALING!r} that is no size of a body: leave it out")
    return value


def _first(archive: Archive, names: tuple[str, ...]) -> str:
    """The first of some names that an archive has, or ""."""
    return next((name for name in names if name in archive.names), "")


def _parts(archive: Archive) -> np.ndarray:
    """``(frames, n)`` what archives without ``poses`` state in parts."""
    names = [_first(archive, _ROOT), _first(archive, _TRUNK), *(n for n in _OTHERS if n in archive.names)]
    parts = [archive.numbers(name) for name in names]
    flat = [each.reshape(len(each), -1) if each.ndim > 1 and each.size else each for each in parts]
    if any(each.ndim != 2 for each in flat) or len({len(each) for each in flat}) > 1:
        listed = ", ".join(f"{n!r} {shape_text(each.shape)}" for n, each in zip(names, parts, strict=True))
        raise FileError(archive.path, f"has parts of poses that do not fit each other: {listed}")
    return np.concatenate(flat, axis=1)


def _turns(archive: Archive) -> tuple[np.ndarray, list[str]]:
    """``(frames, joints, 3)`` of all joints, and doubts."""
    name = _first(archive, _POSES)
    poses = archive.numbers(name) if name else _parts(archive)
    what = repr(name) if name else "root, body and hands together"
    if poses.shape[2:] in ((3,), (3, 3)):
        poses = poses.reshape(len(poses), math.prod(poses.shape[1:]))
    _check_size(archive, name or "poses", poses, _MOST_TURN)
    if poses.ndim == 2 and len(poses) and poses.shape[1] in {9 * joints for joints in BY_JOINTS}:
        poses = _of_matrices(archive.path, what, poses.reshape(len(poses), -1, 3, 3))
    if poses.ndim != 2 or poses.shape[1] not in {3 * joints for joints in BY_JOINTS}:
        shapes = ", ".join(f"{3 * len(family)} ({family.name})" for family in FAMILIES)
        raise FileError(
            archive.path,
            f"has {what} of shape {shape_text(poses.shape)}; known are (frames, n) with n = {shapes}",
        )
    if not len(poses):
        raise FileError(archive.path, "has no frames")
    turns = poses.reshape(len(poses), -1, 3)
    doubts = []
    if (most := float(np.linalg.norm(turns, axis=2).max())) > _DEGREES:
        doubts.append(f"turns by up to {most:.0f} radians: are they degrees?")
    return turns, doubts


def _of_matrices(path: Path, what: str, matrices: np.ndarray) -> np.ndarray:
    """``(frames, 3 joints)`` axis times angle, of rotation matrices ``(frames, joints, 3, 3)``."""
    off = np.abs(matrices @ matrices.swapaxes(-1, -2) - np.eye(3)).max(initial=0.0)
    if off > _ROUNDED or (np.linalg.det(matrices) < 0).any():
        raise FileError(path, f"has {what} with matrices that are no rotations")
    turns = (rotation.to_rotation_vector(rotation.from_matrix(frame)) for frame in matrices)
    return np.stack([turn.reshape(-1) for turn in turns])


def _betas(archive: Archive, frames: int) -> tuple[np.ndarray, list[str]]:
    """``(n,)`` of the whole motion, and notes."""
    if "betas" not in archive.names:
        return np.zeros(0), []
    betas = archive.numbers("betas")
    _check_size(archive, "betas", betas, _MOST_TURN)
    if betas.ndim == 2 and len(betas) in (1, frames):
        if np.ptp(betas, axis=0).max(initial=0.0) > 1e-6:
            return betas.mean(axis=0), ["betas change from frame to frame: their mean is taken"]
        betas = betas[0]
    if betas.ndim != 1:
        raise FileError(archive.path, f"has 'betas' of shape {shape_text(betas.shape)}; (n,) is known")
    return betas, []


def _rate(archive: Archive, explicit: float | None) -> tuple[float, bool]:
    """Frames per second, and whether the file says them; it must be a valid rate unless ``explicit``
    gives one."""
    name = _first(archive, _RATES)
    if not name:
        return explicit or _DEFAULT_RATE, False
    try:
        array = archive.numbers(name)
    except FileError:
        if explicit is None:
            raise
        return explicit, False
    if array.size == 1 and _SLOWEST <= (rate := float(array.reshape(-1)[0])) <= _FASTEST:
        return rate, True
    if explicit is not None:
        return explicit, False
    text = f"{float(array.reshape(-1)[0]):g}" if array.size == 1 else shape_text(array.shape)
    raise FileError(
        archive.path, f"has {name!r} = {text}, which is no frame rate: say the true one: rate=..."
    )


def _check_size(archive: Archive, name: str, array: np.ndarray, most: float) -> None:
    if np.abs(array).max(initial=0.0) > most:
        raise FileError(archive.path, f"has {name!r} with numbers above {most:g}: it is damaged")


# ------------------------------------------------------------------------------------------- body models
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

    @property
    def skeleton(self) -> Skeleton:
        parents = np.array(self.family.parents)
        offsets = self.joints - np.where(parents[:, None] >= 0, self.joints[parents], 0.0)
        return Skeleton(self.family.joints, parents, offsets)

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


def load_model(place: Path, family: Family, gender: str, betas: np.ndarray) -> Shaped:
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
    own = _family_of_model(path, archive, regressor, count)
    if family is not BODY and own is not family:
        raise FileError(path, f"is a model of {own.name}, and the motion is of {family.name}")
    used = directions.shape[2]
    with np.errstate(all="ignore"):
        vertices = template + directions @ betas[:used]
        joints = regressor @ vertices
    if not (np.abs(vertices).max() < _LARGEST and np.abs(joints).max() < _LARGEST):
        raise FileError(
            path, f"gives a body beyond {_LARGEST:g} m for these betas: one of the two is damaged"
        )
    return Shaped(path, own, joints, vertices, len(betas) - used)


def _family_of_model(path: Path, archive: Archive, regressor: np.ndarray, vertices: int) -> Family:
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


def _model_file(folder: Path, family: Family, gender: str) -> Path:
    """The file of a folder that is named after family and gender: ``SMPLH_MALE.npz``,
    ``smplx/SMPLX_NEUTRAL.npz``, ``smplh/male/model.npz``, ``male/model.npz``."""
    listed = (each for depth in range(_DEEPEST) for each in folder.glob("*/" * depth + "*"))
    models = sorted(each for each in islice(listed, _MOST_FILES) if each.suffix.lower() in (".npz", ".pkl"))
    words = {path: {*re.findall("[a-z]+", str(path.relative_to(folder)).lower())} for path in models}
    others = (
        {each.word for each in FAMILIES if each.word not in ("", family.word)} if family.word else set()
    )
    fitting = [path for path in models if words[path] & _GENDERS[gender] and not words[path] & others]
    fitting.sort(key=lambda path: (family.word not in words[path], len(path.parts), path))
    for path in fitting:
        if path.suffix.lower() == ".npz" and set(_NEEDED) <= set(Archive(path).names):
            return path
    if pickled := [path for path in fitting if path.suffix.lower() != ".npz"]:
        return pickled[0]
    model = f"{gender} {family.name if family is not BODY else 'SMPL'} model"
    archives = [str(path.relative_to(folder)) for path in models if path.suffix.lower() == ".npz"]
    holds = ", ".join(archives[:6]) or "no .npz file"
    raise FileError(
        folder, f"has no {model}, as in smplh/male/model.npz or SMPLX_NEUTRAL.npz; it holds {holds}"
    )
