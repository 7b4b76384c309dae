"""Self-penetration of skins, which pictures and pages light up."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from retarget_bench.motion.penetration import inside_mask
from retarget_bench.viewer.scene import Figure

KEY = "striped: limb inside the body"
"""The meaning of stripes in pictures."""
_BLOCK = 64
"""Frames at a time."""


def lit(figure: Figure) -> Figure:
    """The figure with its self-penetration, where its body has a mesh and it was not looked for before.

    These are the vertices that the metric ``self_penetration`` counts (forearms, hands, shanks and feet in
    the rest of the body) but for those that are inside in the T-pose already.
    """
    mesh = figure.character.mesh if figure.has_skin and figure.inside is None else None
    if mesh is None or not len(mesh.faces) or not np.isfinite(mesh.vertices).all():
        return figure
    assert figure.positions is not None
    masks = [
        inside_mask(figure.character, figure.skin_at(slice(first, first + _BLOCK)))
        for first in range(0, len(figure.positions), _BLOCK)
    ]
    return replace(figure, inside=np.concatenate(masks))


def key(figures: Sequence[Figure], frames: Sequence[int]) -> str:
    """The meaning of stripes, where any figure has some at these frames; else ""."""
    any_lit = any(figure.inside is not None and figure.inside[list(frames)].any() for figure in figures)
    return KEY if any_lit else ""


def lit_faces(figure: Figure, frame: int) -> np.ndarray:
    """``(faces,)`` bool: faces of the mesh with a corner that is lit at a frame."""
    mesh = figure.character.mesh
    if figure.inside is None or mesh is None:
        return np.zeros(0 if mesh is None else len(mesh.faces), dtype=bool)
    inside: np.ndarray = figure.inside[frame][mesh.faces].any(axis=1)
    return inside
