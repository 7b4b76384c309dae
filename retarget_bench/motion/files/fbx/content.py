"""The content of an FBX file, extracted by a process of its own (``child.py``)."""

from __future__ import annotations

import importlib.util
import json
import os
import subprocess
import sys
import zipfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from retarget_bench.errors import FileError, NotSupported, visible
from retarget_bench.files import scratch_folder
from retarget_bench.motion.file_kinds import check_kind
from retarget_bench.motion.files.fbx import child

_MEMORY = 3 << 30
_MEMORY_PER_BYTE = 30
"""Address space of the child, for any file and for each of its bytes."""
_SECONDS = 60
_SECONDS_PER_MB = 3
"""Processor time likewise."""
_WAITED = 4
"""So much longer the child may take by the clock: others may use the processor."""


@dataclass(frozen=True, eq=False)
class Content:
    """The content of a file, in right-handed axes.

    arrays: ``parents (nodes,)``; ``rest (nodes, 10)`` translation, rotation w first, scale; ``bones`` and
            ``plain (nodes,)`` whether a node is a bone, and whether it is neither mesh nor camera or the
            like; ``spreads (takes, nodes, 3)`` ranges of the curves of translation, rotation (degrees) and
            scale, -1 without curves; of one take ``times (frames,)``, ``moved`` the nodes that it animates,
            and for the nth of these ``moved_translation_n``, ``moved_rotation_n``, ``moved_scale_n``;
            ``surfaces (meshes, 3)`` node, mesh and skin (-1: none), ``geometry (meshes, 4, 4)`` from a mesh
            to its node; ``vertices_m``, ``faces_m``; ``skin_joints_s``, ``skin_matrices_s`` from the mesh
            to the joints when it was bound, ``skin_worlds_s`` from the joints to the world then, and
            ``skin_weights_s (weights, 3)`` joint of the skin, vertex and share.
    facts:  names, takes (as they can be shown), unit (metres), axes (right, up, front: numbers of ufbx, of
            the file itself but for up), fps and rate_stated; characters: of each HumanIK character its
            links and their nodes; baked: the number of the take with frames, its rate, and
            keys_per_second, 0 where its keys are not evenly spaced.
    """

    arrays: dict[str, np.ndarray]
    facts: dict[str, Any]


def extract(path: Path, take: str = "") -> Content:
    """The content of a file, with the frames of a take: by name or number from 1 on; "": of the first that
    moves a bone.

    Raises FileError where the file cannot be read or reading it crashes; NotSupported without ufbx.
    """
    if importlib.util.find_spec("ufbx") is None:
        raise NotSupported(f"{path} is an FBX file, which needs ufbx: pip install 'retarget-bench[fbx]'")
    check_kind(path, "FBX")
    with scratch_folder() as folder:
        _run(path, folder, take)
        return _answer(path, folder)


def _run(path: Path, folder: Path, take: str) -> None:
    """Have a process take the content out of a file. Raises FileError where it crashes or does not end."""
    size = path.stat().st_size
    seconds = _SECONDS + _SECONDS_PER_MB * (size >> 20)
    memory = _MEMORY + _MEMORY_PER_BYTE * size
    arguments = [str(path.resolve()), str(folder), take, str(memory), str(seconds)]
    try:
        code, output = process(arguments, _WAITED * seconds)
    except subprocess.TimeoutExpired as error:
        raise FileError(path, f"took more than {_WAITED * seconds:g} s to read: it is damaged") from error
    except (OSError, ValueError) as error:
        raise FileError(
            path, f"cannot be read: no process to read it could be started ({error})"
        ) from error
    if not 0 <= code < 256:  # a signal, on Windows an exception
        raise FileError(path, f"crashes ufbx ({code}): it is damaged, or too large")
    if code:
        last = (output.strip().splitlines() or ["nothing was said"])[-1][:200]
        raise FileError(path, f"cannot be read: the process that reads it failed ({last})")


def process(arguments: list[str], seconds: float) -> tuple[int, str]:
    """Run ``child.py`` with arguments; returns its exit code, and what it said of its failure.

    Raises TimeoutExpired, once it is ended, where it takes longer.
    """
    threads = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
    completed = subprocess.run(
        [sys.executable, "-P", child.__file__, *arguments],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        timeout=seconds,
        check=False,
        env={**os.environ, **threads},
    )
    return completed.returncode, completed.stderr.decode("utf-8", "replace")


def _answer(path: Path, folder: Path) -> Content:
    """The output of the process. Raises FileError."""
    try:
        if (folder / child.PROBLEM).exists():
            raise FileError(path, (folder / child.PROBLEM).read_text(encoding="utf-8"))
        with np.load(folder / child.SCENE) as file:
            arrays = {name: file[name] for name in file.files}
    except (OSError, ValueError, zipfile.BadZipFile) as error:
        raise FileError(
            path, f"cannot be read: the process that reads it wrote nothing ({error})"
        ) from error
    facts = json.loads(arrays.pop("facts").tobytes())
    for listed in ("names", "takes"):
        facts[listed] = [visible(name, lines=False) for name in facts[listed]]
    if _handedness(facts["axes"]) < 0:
        facts["axes"][1] ^= facts["axes"][1] < 2  # up along x is turned round
        arrays = {name: _mirrored(name, array) for name, array in arrays.items()}
    return Content(arrays, facts)


def _handedness(axes: list[int]) -> float:
    """1 where the axes right, up and front of a file are right-handed, -1 where they are left-handed, 0
    where they are no axes."""
    directions = np.zeros((3, 3))
    for row, axis in enumerate(axes if max(axes) < 6 else ()):
        directions[row, axis // 2] = -1.0 if axis % 2 else 1.0
    return float(np.linalg.det(directions))


_TURNS, _MIRROR = np.array([1.0, 1.0, -1.0, -1.0]), np.array([-1.0, 1.0, 1.0])
"""Signs of a quaternion and of a position in a mirror across x = 0."""


def _mirrored(name: str, array: np.ndarray) -> np.ndarray:
    """An array of a file in left-handed axes, mirrored across x = 0."""
    if name == "rest":
        return array * np.concatenate([_MIRROR, _TURNS, np.ones(3)])
    if name.startswith("moved_rotation_"):
        return array * _TURNS
    if name.startswith(("moved_translation_", "vertices_")):
        return array * _MIRROR
    if name.startswith(("skin_matrices_", "skin_worlds_")) or name == "geometry":
        across = np.append(_MIRROR, 1.0)
        return array * across[:, None] * across
    return array[:, ::-1] if name.startswith("faces_") else array
