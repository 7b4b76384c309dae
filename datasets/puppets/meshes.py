"""Skinned bodies: one closed surface of about two thousand vertices around every body, kept on disk."""

from __future__ import annotations

import numpy as np

from retarget_bench.files import digest
from retarget_bench.motion.mesh import Mesh

from . import flesh, fur
from .bodies import Body
from .cache import Arrays, kept
from .flesh import Flesh
from .surface import surface

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
    arrays = kept(
        _MAKE,
        f"{body.name}-{digest(sizes)}",
        frozenset(("vertices", "faces", "weights")),
        lambda: _built(body),
    )
    return Mesh(arrays["vertices"], arrays["faces"], arrays["weights"], pose)


def _built(body: Body) -> Arrays:
    """Drawn once to count vertices, and again with the step that gives the right number of them."""
    step = _step(body)
    coarse, _ = _drawn(filled(body, _THINNEST * step), step)
    step = round(step * (len(coarse) / VERTICES) ** 0.5, 4)
    solid = filled(body, _THINNEST * step)
    vertices, faces = _drawn(solid, step)
    return {"vertices": vertices, "faces": faces, "weights": solid.weights(vertices)}


def filled(body: Body, least: float) -> Flesh:
    """A body's flesh, no limb of it thinner than the radius ``least``."""
    cones = fur.cones if "tail_1" in body.part else flesh.cones
    return Flesh(body, cones(body), least)


def _drawn(solid: Flesh, step: float) -> tuple[np.ndarray, np.ndarray]:
    low, high = solid.box
    return surface(solid.field, low - 2.0 * step, high + 2.0 * step, step)


def _step(body: Body) -> float:
    """Of the grid, metres, from the area of the cones as if they did not overlap by more than a half."""
    solid = filled(body, 0.0)
    lengths = np.sqrt((solid.line**2).sum(axis=-1))
    radius = solid.radii.mean(axis=-1)
    area = float((2.0 * np.pi * radius * (lengths + 2.0 * radius)).sum())
    return round((_DENSITY * 0.4 * area / VERTICES) ** 0.5, 4)
