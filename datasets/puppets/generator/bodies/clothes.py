"""Clothed bodies: the skin moved outward by a smooth field, as loose cloth lies over it.

Trunk, arms and legs are covered; hands, feet, neck and head are not. Vertices, triangles and weights stay
those of the bare skin, one for one, so cloth moves with the joints under it. How far off it lies varies
over the body by smooth noise of its own for everybody, and cloth never reaches past the middle of a gap,
so that legs and armpits do not grow into each other in the T-pose.
"""

import numpy as np

from retarget_bench.files import digest
from retarget_bench.motion.mesh import Mesh

from ..cache import cached
from ..randomness import Stream
from .meshes import mesh
from .structures import Body
from .volume import BodyVolume

VERSION = "1"
"""Moves when any vertex does."""
_LOOSE = {
    "hips": 0.50,
    "spine": 0.40,
    "shoulder": 0.30,
    "up_leg": 0.38,
    "leg": 0.30,
    "arm": 0.34,
    "forearm": 0.26,
}
"""How far cloth lies off the skin of a part on average, girths."""
_NOISE = 0.6
"""Share by which that varies at most."""
_WAVES, _LENGTHS = 8, (2.0, 8.0)
"""Waves of the noise, and their lengths, girths."""
_STEPS = 8
_RISE = 0.5
"""Slope of the distance from the skin below which the middle of a gap is near."""
_ROUNDS = 4
"""Times that cloth which is held back somewhere holds back its surroundings."""
_LEAST = 1e-4
"""Metres: cloth nearer than that lies on the skin."""


def clothed(body: Body, pose: np.ndarray) -> Mesh:
    """The clothed surface of a body, in the T-pose, into which ``pose`` ``(joints, 4)`` brings its rig."""
    bare = mesh(body, pose)
    sizes = repr((body.structure.name, body.proportions))
    arrays = cached(
        f"puppets clothes {VERSION}",
        f"{body.name}-{digest(sizes)}",
        frozenset(("vertices",)),
        lambda: {"vertices": _dressed(body, bare)},
    )
    return Mesh(arrays["vertices"], bare.faces, bare.weights, pose)


def _dressed(body: Body, bare: Mesh) -> np.ndarray:
    """``(V, 3)`` metres."""
    outward = normals(bare.vertices, bare.faces)
    thickness = bare.weights @ looseness(body) * (1.0 + _NOISE * noise(body, bare.vertices))
    free = _free(BodyVolume(body, 0.0), bare.vertices, outward, thickness)
    edges = np.concatenate([bare.faces[:, [0, 1]], bare.faces[:, [1, 2]], bare.faces[:, [2, 0]]])
    for _ in range(_ROUNDS):
        sums, counts = np.zeros_like(free), np.zeros_like(free)
        np.add.at(sums, edges[:, 0], free[edges[:, 1]])
        np.add.at(counts, edges[:, 0], 1.0)
        free = np.minimum(free, sums / counts)
    return _unfolded(bare, free, outward)


def _unfolded(bare: Mesh, free: np.ndarray, outward: np.ndarray) -> np.ndarray:
    """``(V, 3)`` metres: vertices moved outward by ``free`` ``(V,)``, less where a triangle would turn
    over."""
    facing = _across(bare.vertices, bare.faces)
    while True:
        vertices = np.asarray(bare.vertices + free[:, None] * outward)
        over = (_across(vertices, bare.faces) * facing).sum(axis=-1) < 0.0
        if not over.any():
            return vertices
        held = np.unique(bare.faces[over])
        free = free.copy()
        free[held] = np.where(free[held] > _LEAST, 0.5 * free[held], 0.0)


def looseness(body: Body) -> np.ndarray:
    """``(joints,)`` metres: how far cloth lies off the skin of each joint on average."""
    structure, loose = body.structure, np.zeros(body.structure.joints)
    for joint, part in enumerate(structure.parts[: structure.joints]):
        stem = part.removeprefix("left_").removeprefix("right_")
        if part in structure.silent and structure.parents[joint] >= 0:
            loose[joint] = loose[structure.parents[joint]] / body.proportions.girth
        elif stem.startswith("spine"):
            loose[joint] = _LOOSE["spine"]
        else:
            loose[joint] = _LOOSE.get(stem, 0.0)
        loose[joint] *= body.proportions.girth
    return loose


def noise(body: Body, points: np.ndarray) -> np.ndarray:
    """``(points,)`` between -1 and 1, smooth: waves of random direction, length and phase."""
    stream = Stream("puppets", "clothes", VERSION, body.name)
    total, most = np.zeros(len(points)), 0.0
    for _ in range(_WAVES):
        way = np.array([stream.normal(), stream.normal(), stream.normal()])
        length = body.proportions.girth * stream.uniform(*_LENGTHS)
        way *= 2.0 * np.pi / (length * max(float(np.sqrt(way @ way)), 1e-9))
        total += length * np.sin(points @ way + stream.uniform(0.0, 2.0 * np.pi))
        most += length
    return np.asarray(total / most)


def _free(
    solid: BodyVolume, vertices: np.ndarray, outward: np.ndarray, thickness: np.ndarray
) -> np.ndarray:
    """``(V,)`` metres: how far each vertex goes outward, at most by ``thickness``, while the distance from
    the body grows."""
    step = thickness / _STEPS
    reached, active = np.zeros_like(thickness), thickness > 0.0
    before = solid.field(vertices)
    for number in range(1, _STEPS + 1):
        now = solid.field(vertices + (number * step)[:, None] * outward)
        active &= now - before >= _RISE * step
        reached = np.where(active, number * step, reached)
        before = now
    return reached


def normals(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """``(V, 3)`` unit vectors outward: those of the triangles around, by area."""
    across = _across(vertices, faces)
    sums = np.zeros_like(vertices)
    for corner in range(3):
        np.add.at(sums, faces[:, corner], across)
    return np.asarray(sums / np.maximum(np.linalg.norm(sums, axis=-1, keepdims=True), 1e-12))


def _across(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """``(F, 3)`` the normals of the triangles, twice their area long."""
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    return np.asarray(np.cross(b - a, c - a))
