"""A scene: the figures of one case and the joints that rest on the ground."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Literal

import numpy as np

from retarget_bench.api import Ground, Source
from retarget_bench.api.comparison import contact_roles
from retarget_bench.errors import BenchError
from retarget_bench.motion.character import Character
from retarget_bench.motion.contact import planted
from retarget_bench.motion.motion import Motion, PointSets, Surface
from retarget_bench.motion.penetration import inside_mask

Part = Literal["source", "reference", "prediction", "motion"]
"""``motion``: one that is no part of a case, such as a file."""


@dataclass(frozen=True, eq=False)
class Figure:
    """One body in a scene.

    label:     its name for people (a method, ``source``, ``reference``, a file).
    positions: ``(frames, joints, 3)`` metres, Y up; None where there is nothing to show (see ``message``).
    motion:    with rotations, where they are known: a skin can follow these.
    joints:    indices of the joints that contacts are of. planted: ``(frames, len(joints))`` bool, the
               figure's own contacts. Both None where contacts are not known.
    error:     ``(frames,)`` % of height off the reference in the world; None where there is no reference.
    joint_error: ``(joints,)`` the same, mean over frames, NaN for joints that are not scored.
    status:    as in results: ok, unsupported, invalid, failed, missing.
    surface:   ``(frames, V, 3)`` metres, the vertices of the body's mesh, where they are known without
               rotations. points: of each frame ``(n, 3)`` metres, where a body is known by points.
    """

    label: str
    part: Part
    character: Character
    positions: np.ndarray | None
    motion: Motion | None = None
    joints: tuple[int, ...] | None = None
    planted: np.ndarray | None = None
    error: np.ndarray | None = None
    joint_error: np.ndarray | None = None
    status: str = "ok"
    message: str = ""
    surface: np.ndarray | None = None
    points: tuple[np.ndarray, ...] | None = None

    @property
    def has_skin(self) -> bool:
        """True where the body has a mesh and it is known where that is."""
        posable = self.surface is not None or self.motion is not None
        return posable and self.character.mesh is not None

    def skin_at(self, frames: slice) -> np.ndarray:
        """``(frames, V, 3)`` metres: the vertices of the body's mesh, of a figure that has them."""
        if self.surface is not None:
            return self.surface[frames]
        assert self.motion is not None
        assert self.character.mesh is not None
        return self.character.mesh.skinned(self.motion.at(frames))

    @cached_property
    def testable(self) -> bool:
        """True where self-penetration can be looked for: of a skin with faces and finite vertices."""
        mesh = self.character.mesh if self.has_skin else None
        return mesh is not None and len(mesh.faces) > 0 and bool(np.isfinite(mesh.vertices).all())

    def inside_at(self, frame: int) -> np.ndarray:
        """``(V,)`` bool: vertices of the mesh that are inside the body at a frame, of a testable figure.

        These are the vertices that the metric ``self_penetration`` counts (forearms, hands, shanks and feet
        in the rest of the body) but for those that are inside in the reference pose already.
        """
        return np.asarray(inside_mask(self.character, self.skin_at(slice(frame, frame + 1)))[0])

    @property
    def parents(self) -> np.ndarray:
        """``(joints,)``, -1 for roots."""
        return self.character.skeleton.parents


@dataclass(frozen=True, eq=False)
class Scene:
    """Figures that share frames, rate and floor.

    title: for people. case: the id, "" for files. kind: of performance, "" where unknown.
    values: label of a figure -> value id -> number, the case's rows, where there are results.
    colours: label of a method -> ``#rrggbb``, by its rank among all results; {} for colours by order.

    Raises BenchError where figures differ in frames, or none can be shown.
    """

    title: str
    figures: tuple[Figure, ...]
    fps: float
    case: str = ""
    split: str = ""
    kind: str = ""
    ground: Ground = field(default_factory=Ground)
    values: dict[str, dict[str, float]] = field(default_factory=dict)
    colours: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        lengths = {len(figure.positions) for figure in self.figures if figure.positions is not None}
        if not lengths:
            raise BenchError(f"{self.title}: there is nothing to show")
        if len(lengths) > 1:
            raise BenchError(
                f"{self.title}: its figures have different numbers of frames, {sorted(lengths)}"
            )

    @property
    def frames(self) -> int:
        """Number of frames of every figure."""
        return next(len(figure.positions) for figure in self.figures if figure.positions is not None)


Labels = tuple[tuple[int, ...] | None, np.ndarray | None]
"""Contact joints, and ``(frames, joints)`` bool, true where planted; both None where not known."""


def figure_of(label: str, part: Part, motion: Source, labels: Labels | None = None) -> Figure:
    """A motion as a figure. labels: its contacts; None: they are found by speed, where the body has contact
    joints and a height."""
    body = motion.character
    if labels is None:
        joints = tuple(body.joints(contact_roles(body)))
        labels = None, None
        if joints and body.height > 0:
            labels = joints, planted(motion.positions[:, joints], body.height, motion.fps)
    return Figure(
        label,
        part,
        body,
        motion.positions,
        motion=motion if isinstance(motion, Motion) else None,
        surface=motion.vertices if isinstance(motion, Surface) else None,
        points=motion.points if isinstance(motion, PointSets) else None,
        joints=labels[0],
        planted=labels[1],
    )


def distinct(labels: Sequence[str], used: Sequence[str] = ()) -> list[str]:
    """Labels made distinct from each other and from those used: the second of a kind gets a number."""
    names: list[str] = []
    for label in labels:
        name, number = label, 1
        while name in (*used, *names):
            number += 1
            name = f"{label} ({number})"
        names.append(name)
    return names
