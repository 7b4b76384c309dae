"""The drawn floor: grid or height field, shadows and contacts."""

from collections.abc import Iterator

import numpy as np
from PIL.ImageDraw import ImageDraw

from retarget_bench.api import Ground
from retarget_bench.motion.ground import ground_height
from retarget_bench.viewer.bodies import Solid, tube
from retarget_bench.viewer.camera import Camera
from retarget_bench.viewer.colours import CONTACT, FLOOR, GRID, SHADOW, STAGE, mixed, shade

CUTS = 5
"""Pieces of which a line of the grid is made, each fainter than the one nearer to the middle."""
FADING = [mixed(GRID, STAGE, level / 8) for level in range(8)]
"""Colours of the grid, from the middle outwards."""
LINES = 24
"""Lines of the grid in one direction, at most."""
STEEP = 0.3
"""Share by which a step or a wall is darker than an even floor."""
SUN = np.array([0.30, 1.0, 0.22])
"""Towards the light that throws shadows."""
HALO = 0.055
"""Radius of the mark under a foot that rests, in heights of the body."""
CORNERS = np.linspace(0.0, 2 * np.pi, 20, endpoint=False)
DISC = np.stack([np.cos(CORNERS), np.zeros_like(CORNERS), np.sin(CORNERS)], axis=1)


def draw(pen: ImageDraw, ground: Ground, camera: Camera, target: np.ndarray, reach: float) -> None:
    """The ground around a point of it. reach: metres to where it fades out."""
    if ground.heights is not None:
        _field(pen, ground, camera, target, reach)
        return
    for share in (1.0, 0.85, 0.7):
        pixels = camera.project(target + share * reach * DISC, target)[0]
        pen.polygon(pixels.ravel().tolist(), fill=mixed(FLOOR, STAGE, (share - 0.7) / 0.45))
    step = 0.5  # metres between lines, doubled until they are few
    while 2 * reach / step > LINES:
        step *= 2
    starts, ends, fading = _lines(target, reach, step)
    first, second = camera.project(starts, target)[0], camera.project(ends, target)[0]
    corners = np.concatenate([first, second], axis=1).tolist()
    for place, level in zip(corners, fading.tolist(), strict=True):
        pen.line(place, fill=FADING[level], width=2)


def _lines(target: np.ndarray, reach: float, step: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Starts and ends ``(n, 3)`` of the grid's pieces within reach, and ``(n,)`` how faint they are, as
    places in ``FADING``; the faintest first."""
    at = np.arange(np.ceil(-reach / step), np.floor(reach / step) + 1) * step
    cuts = np.linspace(-1.0, 1.0, CUTS + 1)
    lines = []
    for along, across in ((0, 2), (2, 0)):
        fixed = np.round(target[across] / step) * step + at
        half = np.sqrt(np.maximum(reach**2 - (fixed - target[across]) ** 2, 0.0))
        points = np.empty((len(fixed), CUTS + 1, 3))
        points[..., 1] = target[1]
        points[..., across] = fixed[:, None]
        points[..., along] = target[along] + half[:, None] * cuts
        lines.append(np.stack([points[:, :-1], points[:, 1:]]).reshape(2, -1, 3))
    starts, ends = np.concatenate(lines, axis=1)
    away = np.linalg.norm((starts + ends) / 2 - target, axis=1) / reach
    fading = np.minimum(len(FADING) * away**2, len(FADING) - 1).astype(int)
    order = np.argsort(-fading, kind="stable")
    return starts[order], ends[order], fading[order]


def _field(pen: ImageDraw, ground: Ground, camera: Camera, target: np.ndarray, reach: float) -> None:
    """A field of heights as tiles, the farthest first, the steeper the darker; its edges go on outside."""
    tiles = tiled(ground, target, reach)
    pixels, depths, _ = camera.project(tiles, target)
    edges = np.diff(tiles[:, [3, 0, 1]], axis=1)  # along both sides of a tile
    rise = np.abs(edges[..., 1])
    slope = (rise / np.maximum(np.hypot(edges[..., 0], edges[..., 2]), 1e-9)).max(axis=1)
    for k in np.argsort(-depths.mean(axis=1)).tolist():
        colour = shade(FLOOR, 1.0 - STEEP * min(1.0, float(slope[k])))
        pen.polygon(pixels[k].ravel().tolist(), fill=colour, outline=GRID)


def tiled(ground: Ground, target: np.ndarray, reach: float) -> np.ndarray:
    """``(tiles, 4, 3)`` corners of the tiles of a field of heights within reach of a place, as few as tell
    its heights: where it is even, half a metre long."""
    assert ground.heights is not None
    heights = np.asarray(ground.heights, dtype=float)
    knots = []
    for axis, rows in ((0, heights.T), (1, heights)):
        bends = np.abs(np.diff(rows, n=2, axis=0)).max(axis=1, initial=0.0) > 1e-6
        kept = np.flatnonzero(np.concatenate([[True], bends, [True]])[: len(rows)])
        middle = target[2 * axis]
        own = ground.origin[axis] + ground.spacing * kept
        even = np.arange(-reach, reach + 0.25, 0.5) + np.round(middle * 2) / 2
        both = np.unique(np.concatenate([own[np.abs(own - middle) < reach], even]))
        knots.append(both[np.concatenate([[True], np.diff(both) > 1e-4])])
    x, z = knots
    y = ground_height(ground, x[None, :], z[:, None])
    points = np.stack(np.broadcast_arrays(x[None, :], y, z[:, None]), axis=-1)
    corners = np.stack([points[:-1, :-1], points[:-1, 1:], points[1:, 1:], points[1:, :-1]], axis=2)
    tiles = corners.reshape(-1, 4, 3)
    return tiles[np.linalg.norm((tiles.mean(axis=1) - target)[:, [0, 2]], axis=1) < reach]


def shadows(
    pen: ImageDraw, solid: Solid, frame: int, floor: float, camera: Camera, target: np.ndarray
) -> None:
    """The shadow of a body on a flat floor."""
    ends, radii, _ = solid.bones(frame)
    fallen = ends - (np.maximum(ends[..., 1:2] - floor, 0.0) / SUN[1]) * SUN
    fallen[..., 1] = floor
    pixels, _, scales = camera.project(fallen, target)
    limit = 4.0 * max(pen.im.size)
    good = np.isfinite(pixels).all(axis=(1, 2)) & (np.abs(pixels).max(axis=(1, 2)) < limit)
    for corners in tube(pixels, 0.6 * radii * scales)[good]:
        pen.polygon(corners.ravel().tolist(), fill=SHADOW)


def halos(
    pen: ImageDraw, solid: Solid, frame: int, ground: Ground, camera: Camera, target: np.ndarray
) -> None:
    """A lit disc on the floor under every joint that rests."""
    for place in resting(solid, frame):
        below = float(ground_height(ground, place[0], place[2]))
        disc = DISC * HALO * solid.size + np.array([place[0], min(below, place[1]), place[2]])
        pixels = camera.project(disc, target)[0]
        if np.abs(pixels).max() < 4.0 * max(pen.im.size):
            pen.polygon(pixels.ravel().tolist(), fill=CONTACT, outline=shade(CONTACT, 0.6))


def resting(solid: Solid, frame: int) -> Iterator[np.ndarray]:
    """Places ``(3,)`` of the joints that rest at a frame."""
    figure = solid.figure
    if figure.joints is None or figure.planted is None:
        return
    for joint, rests in zip(figure.joints, figure.planted[frame].tolist(), strict=True):
        if rests:
            yield solid.places[frame, joint]
