"""A motion as a file states it, before anything is guessed about it: what every reader gives."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import lru_cache, partial
from typing import Any

import numpy as np

from retarget_bench.motion import rotation
from retarget_bench.motion.mesh import Mesh
from retarget_bench.motion.skeleton import EndSite, Skeleton

MOST_JOINTS = 2_000
"""No body has more joints."""


@dataclass(frozen=True, eq=False)
class Recording:
    """A motion as a file states it, in the file's axes, without roles and units.

    rotations: ``(frames, joints, 4)`` local unit quaternions, w first, continuous in sign.
    root:      ``(frames, 3)`` the root joint's place in the world, in the file's unit times the scale.
    fps:       frames per second.
    notes:     one sentence for each thing that was decided, folded or renamed.
    doubts:    one sentence for each thing of the motion that could not be kept.
    unit:      name of the unit that the file or its format states ("m"); "" where neither does.
    up:        the up axis likewise ("y"), or "".
    positions: ``(frames, joints, 3)`` of a file that states these and no rotations, which are then those of
               the rest pose until ``fitting.recorded`` has found them; None: the file states rotations.
    skin:      makes the body's surface, in the file's unit and axes, with the root at its rest offset;
               None: the file has none.
    places:    ``(frames, joints, 3)`` every joint in its parent's frame, in the file's unit, where joints
               below the root move against their parents (``inner_positions.py``); None: none does.
    roles:     joint name -> role, where the file states what joints are.
    rate_stated: False where the file does not say its rate; ``fps`` is then the usual one of the format.
    """

    skeleton: Skeleton
    rotations: np.ndarray
    root: np.ndarray
    fps: float
    notes: tuple[str, ...] = ()
    doubts: tuple[str, ...] = ()
    unit: str = ""
    up: str = ""
    skin: Callable[[], Mesh] | None = None
    positions: np.ndarray | None = None
    rate_stated: bool = True
    places: np.ndarray | None = None
    roles: Mapping[str, str] = field(default_factory=dict)


def of_positions(skeleton: Skeleton, positions: np.ndarray, fps: float, **facts: Any) -> Recording:
    """A recording of joint positions ``(frames, joints, 3)``; facts: other fields of ``Recording``."""
    still = np.broadcast_to(np.array([1.0, 0.0, 0.0, 0.0]), (*positions.shape[:2], 4))
    return Recording(skeleton, still, positions[:, 0], fps, positions=positions, **facts)


@lru_cache(maxsize=256)
def unique_names(names: tuple[str, ...]) -> tuple[str, ...]:
    """The names, with ``_2``, ``_3`` ... behind those that occurred before."""
    originals, used, last = set(names), set[str](), dict[str, int]()
    unique = []
    for name in names:
        free = name
        while free in used or (free != name and free in originals):
            last[name] = last.get(name, 1) + 1
            free = f"{name}_{last[name]}"
        used.add(free)
        unique.append(free)
    return tuple(unique)


MIRROR = np.array([-1.0, 1.0, 1.0])
"""What places are multiplied by in a mirror across X."""


def mirrored(recording: Recording) -> Recording:
    """A recording in a mirror across X, as left-handed files are to right-handed ones: each joint keeps its
    name."""
    skeleton = recording.skeleton
    sites = (EndSite(site.parent, (-site.offset[0], *site.offset[1:])) for site in skeleton.end_sites)
    return replace(
        recording,
        skeleton=replace(skeleton, offsets=skeleton.offsets * MIRROR, end_sites=tuple(sites)),
        rotations=rotation.mirrored(recording.rotations),
        root=recording.root * MIRROR,
        positions=None if recording.positions is None else recording.positions * MIRROR,
        places=None if recording.places is None else recording.places * MIRROR,
        skin=recording.skin and partial(_mirrored_mesh, recording.skin),
    )


def _mirrored_mesh(skin: Callable[[], Mesh]) -> Mesh:
    mesh = skin()
    pose = None if mesh.pose is None else rotation.mirrored(mesh.pose)
    return replace(mesh, vertices=mesh.vertices * MIRROR, faces=mesh.faces[:, ::-1], pose=pose)


def reach(skeleton: Skeleton) -> float:
    """The longest way from the root along the bones to a joint: the body's size, whatever its pose."""
    along = skeleton.bone_lengths.tolist()
    for joint, parent in enumerate(skeleton.parents.tolist()):
        if parent >= 0:
            along[joint] += along[parent]
    return max(along)


def resting(stated: np.ndarray, positions: np.ndarray, within: float) -> np.ndarray:
    """``(joints, 3)`` places at which moving joints stay when they are dropped: the ``stated`` ones where
    the ``positions`` ``(frames, joints, 3)`` lie around them, to ``within``; else the median over time."""
    around = (positions.min(axis=0) - within <= stated) & (stated <= positions.max(axis=0) + within)
    return np.where(around.all(axis=1, keepdims=True), stated, np.median(positions, axis=0))
