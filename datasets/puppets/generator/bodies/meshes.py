"""Skinned bodies: one closed surface of about two thousand vertices around every body, kept on disk.

The volume is a field of distances, negative inside. Its surface is found by dual contouring of a regular
grid: one vertex for each piece of surface in a cell of the grid, one quad around each edge of the grid
that crosses the surface (surface nets, Gibson 1998; with several vertices a cell as in dual marching
cubes, Nielson 2004). The vertices are then moved onto the surface along the gradient. Inner corners that
face each other across a side of a cell count as apart, which both cells of the side agree on: the surface
has no holes.
"""

from collections.abc import Callable
from functools import cache
from itertools import product

import numpy as np

from retarget_bench.files import digest
from retarget_bench.motion.mesh import Mesh

from ..cache import Arrays, cached
from .structures import Body
from .volume import BodyVolume

Field = Callable[[np.ndarray], np.ndarray]
"""``(points, 3)`` metres -> ``(points,)`` distance to the surface, roughly; negative inside."""

_CORNERS = tuple(product((0, 1), repeat=3))
_EDGES = tuple((axis, corner) for axis in range(3) for corner in _CORNERS if corner[axis] == 0)
"""Axis and lower end of the twelve edges of a cell."""
_STEPS = 3
"""Newton steps from the middle of a cell's crossings to the surface."""


def surface(field: Field, low: np.ndarray, high: np.ndarray, step: float) -> tuple[np.ndarray, np.ndarray]:
    """Vertices ``(V, 3)`` and triangles ``(F, 3)``, counter-clockwise seen from outside.

    low, high: ``(3,)`` corners of a box that holds the solid with a cell to spare. step: of the grid,
    metres. The grid has a plane of nodes at x = 0, so a symmetric solid has a symmetric surface.
    """
    first = np.floor(low / step)
    count = (np.ceil(high / step) - first).astype(int) + 1
    nodes = np.stack(np.meshgrid(*map(np.arange, count), indexing="ij"), axis=-1) + first
    values = field((nodes * step).reshape(-1, 3)).reshape(tuple(count))
    inside = values < 0.0
    code = _codes(inside)
    patches, numbers = _table()
    start = np.cumsum(numbers[code].ravel()).reshape(code.shape) - numbers[code]
    sums, shares = np.zeros((int(numbers[code].sum()), 3)), np.zeros(int(numbers[code].sum()))
    quads = []
    for axis in range(3):
        at, rising = _crossing(inside, axis)
        here, there = values[tuple(at.T)], values[tuple((at + np.eye(3, dtype=int)[axis]).T)]
        points = (at + first) + np.eye(3)[axis] * (here / (here - there))[:, None]
        around = []
        for back in _around(axis):
            cell = at - back
            edge = _EDGES.index((axis, tuple(back)))
            vertex = start[tuple(cell.T)] + patches[code[tuple(cell.T)], edge]
            np.add.at(sums, vertex, points * step)
            np.add.at(shares, vertex, 1.0)
            around.append(vertex)
        quad = np.stack(around, axis=-1)
        quads.append(np.where(rising[:, None], quad, quad[:, ::-1]))
    vertices = _settled(field, sums / shares[:, None], step)
    quad = np.concatenate(quads)
    return vertices, np.concatenate([quad[:, [0, 1, 2]], quad[:, [0, 2, 3]]])


def _codes(inside: np.ndarray) -> np.ndarray:
    """Corners of each cell that are inside, as bits."""
    nx, ny, nz = (size - 1 for size in inside.shape)
    code = np.zeros((nx, ny, nz), dtype=np.int64)
    for bit, (x, y, z) in enumerate(_CORNERS):
        code |= inside[x : x + nx, y : y + ny, z : z + nz].astype(np.int64) << bit
    return code


def _crossing(inside: np.ndarray, axis: int) -> tuple[np.ndarray, np.ndarray]:
    """Lower ends ``(edges, 3)`` of the grid's edges that cross the surface, and whether they leave it."""
    low = [slice(None)] * 3
    high = list(low)
    low[axis], high[axis] = slice(None, -1), slice(1, None)
    at = np.argwhere(inside[tuple(low)] != inside[tuple(high)])
    return at, inside[tuple(at.T)]


def _around(axis: int) -> list[np.ndarray]:
    """From the four cells around an edge, in turn, to the edge's lower end: counter-clockwise seen from
    the edge's upper end."""
    u, v = np.eye(3, dtype=int)[(axis + 1) % 3], np.eye(3, dtype=int)[(axis + 2) % 3]
    return [u + v, v, 0 * u, u]


def _settled(field: Field, points: np.ndarray, step: float) -> np.ndarray:
    """The points moved onto the surface, no farther than half a cell a step."""
    reach = 0.05 * step
    for _ in range(_STEPS):
        slope = np.stack(
            [(field(points + reach * e) - field(points - reach * e)) / (2.0 * reach) for e in np.eye(3)],
            axis=-1,
        )
        move = -field(points)[:, None] * slope / np.maximum((slope**2).sum(axis=-1, keepdims=True), 0.05)
        points = points + np.clip(move, -0.5 * step, 0.5 * step)
    return points


@cache
def _table() -> tuple[np.ndarray, np.ndarray]:
    """For each of the 256 ways to cut a cell: the piece of surface at each edge (-1: no crossing), and how
    many pieces there are."""
    patches, numbers = np.full((256, len(_EDGES)), -1), np.zeros(256, dtype=np.int64)
    for code in range(256):
        inside = {corner for bit, corner in enumerate(_CORNERS) if code >> bit & 1}
        pieces = _pieces(inside)
        numbers[code] = len(pieces)
        for piece, edges in enumerate(pieces):
            patches[code, list(edges)] = piece
    return patches, numbers


def _pieces(inside: set[tuple[int, ...]]) -> list[set[int]]:
    """Crossing edges of one cell, by connected piece of surface."""
    ends = {
        number: (corner, tuple(c + (k == axis) for k, c in enumerate(corner)))
        for number, (axis, corner) in enumerate(_EDGES)
    }
    crossing = {number: pair for number, pair in ends.items() if (pair[0] in inside) != (pair[1] in inside)}
    pieces = [{number} for number in crossing]
    for axis, side in product(range(3), (0, 1)):
        face = [n for n, pair in crossing.items() if all(corner[axis] == side for corner in pair)]
        for a in face:
            for b in face:
                # on a face with four crossings the lines go round the inner corners, each on its own
                joined = len(face) == 2 or set(crossing[a]) & set(crossing[b]) & inside
                if a < b and joined:
                    one = next(piece for piece in pieces if a in piece)
                    other = next(piece for piece in pieces if b in piece)
                    if one is not other:
                        one |= other
                        pieces.remove(other)
    return pieces


VERTICES = 2000
"""Of a mesh, roughly."""
_MAKE = "puppets meshes 1"
_THINNEST = 0.8
"""Radius of the thinnest limb, steps of the grid: thinner ones would fall between its nodes."""
_DENSITY = 1.5
"""Vertices a square step of surface."""


def mesh(body: Body, pose: np.ndarray) -> Mesh:
    """The skin of a body, drawn in the T-pose, into which ``pose`` ``(joints, 4)`` brings its rig."""
    sizes = repr((body.structure.name, body.proportions))
    arrays = cached(
        _MAKE,
        f"{body.name}-{digest(sizes)}",
        frozenset(("vertices", "faces", "weights")),
        lambda: _built(body),
    )
    return Mesh(arrays["vertices"], arrays["faces"], arrays["weights"], pose)


def _built(body: Body) -> Arrays:
    vertices, faces, solid = skin(body)
    return {"vertices": vertices, "faces": faces, "weights": solid.weights(vertices)}


def skin(body: Body) -> tuple[np.ndarray, np.ndarray, BodyVolume]:
    """Vertices ``(V, 3)`` and triangles ``(F, 3)`` around a body, made anew, and the volume inside.

    Drawn once to count vertices, and again with the step that gives the right number of them. The first
    step of the grid, metres, is from the area of the cones, as if half of each lay on the outside."""
    solid = BodyVolume(body, 0.0)
    lengths, radius = np.sqrt((solid.line**2).sum(axis=-1)), solid.radii.mean(axis=-1)
    area = float((2.0 * np.pi * radius * (lengths + 2.0 * radius)).sum())
    step = round((_DENSITY * 0.4 * area / VERTICES) ** 0.5, 4)
    coarse, _ = _drawn(BodyVolume(body, _THINNEST * step), step)
    step = round(step * (len(coarse) / VERTICES) ** 0.5, 4)
    solid = BodyVolume(body, _THINNEST * step)
    return *_drawn(solid, step), solid


def _drawn(solid: BodyVolume, step: float) -> tuple[np.ndarray, np.ndarray]:
    low, high = solid.box
    return surface(solid.field, low - 2.0 * step, high + 2.0 * step, step)
