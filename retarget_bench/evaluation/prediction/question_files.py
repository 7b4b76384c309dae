"""Files of a question: bodies as JSON, motions as ``.npz`` in double precision, so that nothing is lost.

The name of a file is a random part, which no other process can guess, and a digest of what it holds, by
which whoever reads it sees that nobody has changed it since.
"""

import json
from collections.abc import Callable, Mapping
from dataclasses import asdict
from functools import lru_cache
from io import BytesIO
from pathlib import Path
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np

from retarget_bench.api.datasets import Cast
from retarget_bench.errors import BenchError
from retarget_bench.evaluation.prediction.numpy_worker import digest
from retarget_bench.motion.character import Character
from retarget_bench.motion.ground import Ground
from retarget_bench.motion.measures import Measures
from retarget_bench.motion.mesh import Mesh
from retarget_bench.motion.motion import Motion, PointSets, Positions, Prediction, Source, Surface
from retarget_bench.motion.skeleton import EndSite, Skeleton


class Changed(BenchError):
    """A file is not what was written."""


def checked(path: Path) -> bytes:
    """The contents of a file. Raises Changed where its name ends in another digest than theirs."""
    try:
        data = path.read_bytes()
    except OSError as error:
        raise Changed(f"a file of the question cannot be read ({error.strerror})") from error
    if digest(data) != path.stem.rpartition("-")[2]:
        raise Changed("a file of the question was changed")
    return data


def _written(folder: Path, token: str, data: bytes, ending: str) -> Path:
    """The file with these contents; written if it is not there."""
    path = folder / f"{token}-{digest(data)}{ending}"
    if not path.exists():
        path.write_bytes(data)  # no rename: nobody is told of the file before it is whole
    return path


# ---------------------------------------------------------------------------------------------- bodies
def character_facts(body: Character) -> dict[str, Any]:
    """All of a body but its skin, as JSON: field -> value, arrays as lists."""
    skeleton = body.skeleton
    return {
        "name": body.name,
        "structure": body.structure,
        "names": list(skeleton.names),
        "parents": skeleton.parents.tolist(),
        "offsets": skeleton.offsets.tolist(),
        "end_sites": [[site.parent, list(map(float, site.offset))] for site in skeleton.end_sites],
        "roles": list(body.roles),
        "reference_pose": body.reference_pose.tolist(),
        "measures": asdict(body.measures),
        "hinges": {role: np.asarray(axis).tolist() for role, axis in body.hinges.items()},
        "whole": body.whole and character_facts(body.whole),
        "skinned": body.skin is not None,
    }


def character(facts: Mapping[str, Any], skin: Callable[[], Mesh] | None = None) -> Character:
    """The body of these facts. skin: makes its mesh, if the facts say that it has one."""
    tips = tuple(EndSite(parent, tuple(offset)) for parent, offset in facts["end_sites"])
    offsets = np.array(facts["offsets"], dtype=np.float64)
    return Character(
        name=facts["name"],
        structure=facts["structure"],
        skeleton=Skeleton(tuple(facts["names"]), np.array(facts["parents"]), offsets, tips),
        roles=tuple(facts["roles"]),
        reference_pose=np.array(facts["reference_pose"], dtype=np.float64),
        measures=Measures(**facts["measures"]),
        hinges={role: np.array(axis) for role, axis in facts["hinges"].items()},
        whole=facts["whole"] and character(facts["whole"]),
        skin=skin if facts["skinned"] else None,
    )


@lru_cache(maxsize=1024)
def _text_of(body: Character) -> bytes:
    return json.dumps(character_facts(body)).encode()


def write_character(folder: Path, token: str, body: Character) -> Path:
    """The file of a body, written if it is not there."""
    return _written(folder, token, _text_of(body), ".json")


def read_character(path: Path, skin: Callable[[], Mesh] | None = None) -> Character:
    """Raises Changed."""
    return character(json.loads(checked(path)), skin)


# --------------------------------------------------------------------------------------------- motions
_PACKED: WeakKeyDictionary[Source, bytes] = WeakKeyDictionary()
"""A source is written for every method anew, so that none can change what another is asked."""


def write_motion(folder: Path, token: str, motion: Source) -> Path:
    if motion not in _PACKED:
        if isinstance(motion, PointSets):
            _PACKED[motion] = _packed_points(motion)
        else:
            _PACKED[motion] = _packed(motion, np.float64)
    return _written(folder, token, _PACKED[motion], ".npz")


def write_answer(path: Path, answer: Prediction) -> str:
    """Write it in single precision, as predictions are stored; the digest of the file."""
    data = _packed(answer, np.float32)
    path.write_bytes(data)
    return digest(data)


def _packed(motion: Prediction, kind: type[np.floating]) -> bytes:
    arrays = {name: getattr(motion, name).astype(kind, copy=False) for name in motion.arrays}
    return _npz({"fps": np.float64(motion.fps), **arrays})


def _packed_points(motion: PointSets) -> bytes:
    """All frames' points one after the other, in the precision that they have, and how many each has."""
    points = np.concatenate(motion.points) if motion.frames else np.zeros((0, 3))
    return _npz({"fps": np.float64(motion.fps), "points": points, "counts": motion.counts})


def _npz(arrays: Mapping[str, Any]) -> bytes:
    stream = BytesIO()
    np.savez(stream, **arrays)
    return stream.getvalue()


def read_source(path: Path, body: Character) -> Source:
    """Raises Changed."""
    arrays = _arrays(path)
    if "points" not in arrays:
        return _motion(arrays, body)
    ends = np.cumsum(arrays["counts"])
    points = np.split(arrays["points"], ends[:-1]) if len(ends) else []
    return PointSets(body, tuple(points), float(arrays["fps"]))


def read_motion(path: Path, body: Character) -> Prediction:
    """Raises Changed."""
    return _motion(_arrays(path), body)


def _arrays(path: Path) -> dict[str, np.ndarray]:
    with np.load(BytesIO(checked(path))) as file:
        return {name: file[name] for name in file.files}


def _motion(arrays: Mapping[str, np.ndarray], body: Character) -> Prediction:
    fps = float(arrays["fps"])
    if "rotations" in arrays:
        return Motion(body, arrays["rotations"], arrays["root"], fps)
    if "vertices" in arrays:
        return Surface(body, arrays["vertices"], fps)
    return Positions(body, arrays["positions"], fps)


def write_mesh(folder: Path, token: str, mesh: Mesh) -> Path:
    arrays = {name: getattr(mesh, name) for name in ("vertices", "faces", "weights")}
    if mesh.pose is not None:
        arrays["pose"] = mesh.pose
    return _written(folder, token, _npz(arrays), ".npz")


def read_mesh(path: Path) -> Mesh:
    """Raises Changed."""
    return Mesh(**_arrays(path))


def ground_facts(ground: Ground) -> dict[str, Any]:
    heights = None if ground.heights is None else np.asarray(ground.heights).tolist()
    return {**asdict(ground), "heights": heights}


def ground(facts: Mapping[str, Any]) -> Ground:
    heights = None if facts["heights"] is None else np.array(facts["heights"], dtype=np.float64)
    return Ground(**{**facts, "heights": heights, "origin": tuple(facts["origin"])})


# -------------------------------------------------------------------------------------------- training
def write_training(folder: Path, token: str, cast: Cast) -> Path:
    """All training clips of a data set: a file for each, and their index, which is given back."""
    index: dict[str, dict[str, Any]] = {}
    for structure, members in cast.items():
        for name, clips in members.items():
            motions = [clips[number] for number in range(len(clips))]
            bodies = [str(write_character(folder, token, motion.character)) for motion in motions]
            files = [str(write_motion(folder, token, motion)) for motion in motions]
            index.setdefault(structure, {})[name] = [list(clips.names), bodies, files]
    return _written(folder, token, json.dumps(index).encode(), ".json")


class StoredClips:
    """Training motions of one character, each read when it is asked for."""

    def __init__(self, names: list[str], bodies: list[Character], files: list[str]) -> None:
        self.names, self._bodies, self._files = names, bodies, files

    def __len__(self) -> int:
        return len(self._files)

    def __getitem__(self, index: int, /) -> Motion:
        """Raises Changed."""
        motion = read_motion(Path(self._files[index]), self._bodies[index])
        assert isinstance(motion, Motion)
        return motion


def read_training(index: Path, body_of: Callable[[str], Character]) -> Cast:
    """What ``write_training`` wrote. body_of: the body in a file. Raises Changed."""
    return {
        structure: {
            name: StoredClips(names, [body_of(body) for body in bodies], files)
            for name, (names, bodies, files) in members.items()
        }
        for structure, members in json.loads(checked(index)).items()
    }
