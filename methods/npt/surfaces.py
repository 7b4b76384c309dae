"""Surfaces as NPT sees them: skins that follow transforms, points on them, and a common size."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Self

import numpy as np

from retarget_bench.motion.character import Character
from retarget_bench.motion.mesh import Mesh
from retarget_bench.motion.motion import Motion, PointSets
from retarget_bench.motion.point_sets import unknown_body
from retarget_bench.motion.scan_path import centre, standing
from retarget_bench.motion.surface_sampling import sampled
from retarget_bench.training.layers.skinned_body import SkinnedBody

STATURE = 1.7
"""Units that every target is tall in its T-pose: the network answers at most 2 units (``REACH``)."""

POINTS = 2048
"""Of each frame, where the source is a motion with a mesh."""


@dataclass(frozen=True, eq=False)
class Identity:
    """A target's vertices in the T-pose.

    vertices: ``(V, 3)`` metres, centred. scale: units per metre.
    """

    vertices: np.ndarray
    scale: float

    @classmethod
    def of(cls, character: Character) -> Self:
        vertices = standing(character)
        return cls(vertices - centre(vertices), STATURE / float(np.ptp(vertices[:, 1])))


class Skin:
    """A body's mesh for drawing many poses of it, its size at rest and its edges."""

    def __init__(self, character: Character) -> None:
        self.identity = Identity.of(character)
        self.body = SkinnedBody.of(character)

    @cached_property
    def edges(self) -> np.ndarray:
        """``(edges, 2)`` vertices, each edge once."""
        faces = self.body.faces
        pairs = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]))
        return np.unique(pairs, axis=0)

    def posed(self, arrays: Mapping[str, np.ndarray], frame: int) -> np.ndarray:
        """``(V, 3)`` metres: the vertices in one frame of a clip's arrays, see ``moves``."""
        return self.body.posed(arrays["turns"][frame], arrays["shifts"][frame])


def on_mesh(numbers: np.random.Generator, motion: Motion, mesh: Mesh) -> PointSets:
    """``POINTS`` points on the skin of a moving body, new ones in each frame."""
    drawn = sampled(mesh.skinned(motion), mesh.faces, numbers.random((motion.frames, 3, POINTS)))
    return PointSets(unknown_body(motion.character.name), tuple(drawn), motion.fps)


def drawn(numbers: np.random.Generator, frames: Sequence[np.ndarray], count: int) -> np.ndarray:
    """``(frames, count, 3)``: of the points of each frame so many in random order; where it has fewer, some
    of them more than once."""
    chosen = [frame[np.resize(numbers.permutation(len(frame)), count)] for frame in frames]
    return np.stack(chosen)
