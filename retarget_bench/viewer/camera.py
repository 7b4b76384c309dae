"""A perspective camera fitted to the motion that it shows."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from retarget_bench.motion.character import Character
from retarget_bench.motion.facing import facing, placed, smooth

VIEWS = {
    "front": (0.0, 0.14, 1.0),
    "side": (-1.0, 0.14, 0.0),
    "three-quarter": (-0.62, 0.30, 0.78),
}
"""View -> the way from the body to the eye, as left, up and forward of the body. Seen from its right side,
a body that goes forward goes to the right."""
DISTANCE = 5.0
"""Of the eye, in radii of the figures: far enough for limbs near it not to look large."""
NEAREST = 0.05
"""Share of that distance nearer than which nothing is seen."""
MARGIN = 0.04
"""Share of a picture's sides that is left free."""
LAG = 0.35
"""Seconds over which a following camera averages the way of what it follows."""
STAYS = 1.5
"""Heights: who moves no farther than this is seen by a camera that stands still."""


@dataclass(frozen=True, eq=False)
class Camera:
    """A perspective camera.

    axes:     ``(3, 3)`` rows: right, up and away from the eye, unit vectors of the world.
    distance: metres from the eye to the point that is looked at.
    zoom:     pixels per metre there.
    centre:   pixels, right and down, at which that point is seen.
    """

    axes: np.ndarray
    distance: float
    zoom: float = 1.0
    centre: tuple[float, float] = (0.0, 0.0)

    def project(self, points: np.ndarray, target: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Points ``(..., 3)`` metres, seen while the camera looks at ``target`` ``(..., 3)`` (broadcast):
        pixels ``(..., 2)``, right and down; metres from the eye ``(...)``; pixels per metre ``(...)``.
        """
        relative = (points - target) @ self.axes.T
        depth = np.maximum(relative[..., 2] + self.distance, NEAREST * self.distance)
        scale = self.zoom * self.distance / depth
        across = self.centre[0] + relative[..., 0] * scale
        down = self.centre[1] - relative[..., 1] * scale
        return np.stack([across, down], axis=-1), depth, scale


def axes(view: str, body: Character, places: np.ndarray) -> np.ndarray:
    """``(3, 3)`` axes of a camera that sees a body from one of ``VIEWS``.

    places: ``(joints, 3)`` of the body, which say where it faces.
    """
    turn = facing(places[None], body)[0]
    eye = placed(np.array(VIEWS[view]), turn)
    away = -eye / np.linalg.norm(eye)
    right = np.cross(away, (0.0, 1.0, 0.0))
    right /= np.linalg.norm(right)
    return np.stack([right, np.cross(right, away), away])


def fitted(
    shots: Sequence[tuple[np.ndarray, np.ndarray]], pad: float, size: tuple[float, float]
) -> list[Camera]:
    """Cameras of one scale and one centre, in whose pictures all points are seen.

    shots: axes, and points ``(n, 3)`` relative to what is looked at. pad: metres around them. size: pixels.
    """
    reach = max(float(np.linalg.norm(points, axis=1).max()) for _, points in shots) + pad
    unit = [Camera(turned, DISTANCE * reach) for turned, _ in shots]
    projected = np.concatenate(
        [camera.project(points, np.zeros(3))[0] for camera, (_, points) in zip(unit, shots, strict=True)]
    )
    low, high = projected.min(axis=0) - pad, projected.max(axis=0) + pad
    room = (1.0 - 2.0 * MARGIN) * np.array(size)
    zoom = float((room / (high - low)).min())
    middle = np.array(size) / 2 - zoom * (low + high) / 2
    centre = float(middle[0]), float(middle[1])
    return [Camera(camera.axes, camera.distance, zoom, centre) for camera in unit]


def stays(places: np.ndarray, height: float) -> bool:
    """True where ``places`` ``(frames, 3)`` stay within ``STAYS``, so that no camera need follow."""
    spread = np.ptp(places[:, [0, 2]], axis=0)
    return float(np.hypot(*spread)) <= STAYS * height


def track(places: np.ndarray, floor: float, fps: float, follow: bool) -> np.ndarray:
    """``(frames, 3)`` points of the floor that a camera looks at while something is at ``places``
    ``(frames, 3)``: below it, a little behind its way; or always the middle of its way."""
    positions = np.array(places)
    positions[:, 1] = floor
    if not follow:
        positions[:, [0, 2]] = (places[:, [0, 2]].min(axis=0) + places[:, [0, 2]].max(axis=0)) / 2
    elif len(places) > 1:
        reach = int(3 * LAG * fps)  # of a Gaussian average, at whose ends the way goes on as it came
        for axis in (0, 2):
            longer = np.pad(places[:, axis], reach, mode="reflect", reflect_type="odd")
            positions[:, axis] = smooth(longer, LAG * fps)[reach : reach + len(places)]
    return positions
