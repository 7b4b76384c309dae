"""The up axis of a motion file: as its format or an option states it, or along which the body stands."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from retarget_bench.motion import kinematics, rotation
from retarget_bench.motion.body import PosedBody
from retarget_bench.motion.mesh import Mesh
from retarget_bench.motion.recording import Recording
from retarget_bench.motion.roles import HANDS

UP_AXES = {
    "y": (0.0, 0.0, 0.0),
    "z": (-math.pi / 2, 0.0, 0.0),
    "x": (0.0, 0.0, math.pi / 2),
    "-y": (math.pi, 0.0, 0.0),
    "-z": (math.pi / 2, 0.0, 0.0),
    "-x": (0.0, 0.0, -math.pi / 2),
}
"""Up axis of a file -> the turn (rotation vector) that makes it +Y."""
_USUAL = {"y": 1.0, "z": 0.9, "x": 0.5, "-y": 0.5, "-z": 0.5, "-x": 0.5}
"""Prior weight of an up axis, for bodies that mostly lie or sit."""
_FLOOR = (-0.07, 0.09)
"""Of the body's extent: between which heights the lowest joint of one on the floor is."""
_LYING = 0.5
"""Certainty of the axis of a body that lies on the floor."""
SAMPLE = 2000
"""Frames that are looked at to find out about a body."""
_AGAINST = 0.8
"""Certainty of another axis than the format's above which a doubt is reported."""


@dataclass(frozen=True)
class Axis:
    """The up axis of a file, how sure that is (0 to 1), and whether an option named it."""

    up: str
    sure: float
    explicit: bool
    doubts: tuple[str, ...]


def axis(recording: Recording, roles: Sequence[str | None], up: str) -> Axis:
    stands, sure = _up_axis(recording, roles)
    if up != "auto":
        return Axis(up, sure if up == stands else 1.0, True, ())
    axis = recording.up or stands
    doubts: tuple[str, ...] = ()
    if _contradicts(recording, roles, stands, sure):
        doubts = (f"{axis} is stated to be up, and the body stands along {stands}: say up={stands}",)
    return Axis(axis, sure if axis == stands else 1.0, False, doubts)


def _up_axis(recording: Recording, roles: Sequence[str | None]) -> tuple[str, float]:
    """The axis that bodies stand along, and how sure that is (0 to 1).

    Mean over time of the direction from the feet to the head, or from the paws to the trunk of an animal.
    A body that lies or crawls all the time says little; then the rest pose decides if it is one that a body
    can take. It also decides if the body is on the floor 0 in every frame along its axis, and not along the
    other: who lies still points along one axis all the time.
    """
    body = PosedBody(recording.skeleton, roles)
    lower = body.joints("left_foot", "right_foot", *(HANDS if body.quadruped else ()))
    upper = [body.hips, body.trunk_end] if body.level else body.joints("head") or [body.trunk_end]
    if not lower or set(upper) <= {body.hips}:
        return "y", 0.0
    some = np.unique(np.linspace(0, len(recording.root) - 1, SAMPLE).astype(int))
    places, _ = kinematics.forward(recording.skeleton, recording.rotations[some], recording.root[some])
    moving = _standing_along(places, lower, upper)
    resting = _standing_along(np.asarray(recording.skeleton.rest_positions)[None], lower, upper)
    best = moving
    if np.abs(moving).max() < 0.5 and body.rests_in_a_pose:
        best = moving + resting
    signs = {axis: -1.0 if axis.startswith("-") else 1.0 for axis in UP_AXES}
    likely = {axis: _USUAL[axis] * float(signs[axis] * best["xyz".index(axis[-1])]) for axis in UP_AXES}
    axis = max(likely, key=likely.__getitem__)
    rest = _nearest(resting)
    if axis != rest and body.rests_in_a_pose and _on_floor(places, rest) and not _on_floor(places, axis):
        return rest, _LYING
    return axis, float(np.clip(likely[axis], 0.0, 1.0))


def _nearest(line: np.ndarray) -> str:
    """The axis that is nearest to a direction ``(3,)``."""
    along = int(np.abs(line).argmax())
    return "-" * bool(line[along] < 0.0) + "xyz"[along]


def _on_floor(places: np.ndarray, axis: str) -> bool:
    """Whether the lowest joint is near height 0 in nearly every frame."""
    heights = places[..., "xyz".index(axis[-1])] * (-1.0 if axis.startswith("-") else 1.0)
    size = np.linalg.norm(np.ptp(places, axis=1), axis=-1).max()
    low, high = np.quantile(heights.min(axis=1), (0.05, 0.95))
    return bool(_FLOOR[0] * size < low and high < _FLOOR[1] * size)


def _contradicts(recording: Recording, roles: Sequence[str | None], stands: str, sure: float) -> bool:
    """Whether a body stands along another axis than its format's, at rest too: not one that lies down."""
    if recording.up in ("", stands) or sure < _AGAINST * _USUAL[stands]:
        return False
    skeleton = recording.skeleton
    still = rotation.identity(1, len(skeleton))
    resting = _up_axis(replace(recording, rotations=still, root=skeleton.offsets[:1]), roles)
    return resting[0] == stands and resting[1] >= _AGAINST * _USUAL[stands]


def _standing_along(places: np.ndarray, lower: list[int], upper: list[int]) -> np.ndarray:
    """``(3,)`` mean unit vector from the lower to the upper joints."""
    line = places[:, upper].mean(axis=1) - places[:, lower].mean(axis=1)
    return np.asarray((line / np.maximum(np.linalg.norm(line, axis=1, keepdims=True), 1e-12)).mean(axis=0))


def upright(recording: Recording, up: str) -> Recording:
    """The same recording with its up axis turned to +Y."""
    if up == "y":
        return recording
    turn = rotation.from_rotation_vector(np.array(UP_AXES[up]))
    offsets = np.array(recording.skeleton.offsets)
    offsets[0] = rotation.rotate(turn, offsets[0])
    skeleton = replace(recording.skeleton, offsets=offsets)
    turned = np.array(recording.rotations)
    turned[:, 0] = rotation.multiply(turn[None], turned[:, 0])
    place = rotation.rotate(turn[None], recording.root)
    skin = recording.skin and partial(
        _moved_mesh, recording.skin, offsets[0] - recording.skeleton.offsets[0]
    )
    return replace(recording, skeleton=skeleton, rotations=turned, root=place, skin=skin)


def _moved_mesh(skin: Callable[[], Mesh], by: np.ndarray) -> Mesh:
    """A mesh that goes with its root's rest offset: the unturned pose itself is not turned."""
    mesh = skin()
    return replace(mesh, vertices=mesh.vertices + by)
