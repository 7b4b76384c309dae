"""A prediction compared with its case: arrays that metrics share, computed once."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache, wraps
from typing import TypeVar

import numpy as np

from retarget_bench.api.cases import Case, Touch
from retarget_bench.api.immutable import immutable
from retarget_bench.errors import BenchError, SkeletonError
from retarget_bench.motion.character import Character
from retarget_bench.motion.contact import CONTACT_ROLES, planted
from retarget_bench.motion.motion import Motion, Prediction, Surface
from retarget_bench.motion.roles import HANDS, ancestors, is_body, is_finger

RATE = 30.0
"""Frames per second at which whatever is stated per frame is stated; other rates are scaled to it."""

T = TypeVar("T")


@dataclass(frozen=True, eq=False)
class ContactLabels:
    """Planted joints of the target, by frame.

    joints:  ``(contacts,)`` joint indices of the target.
    planted: ``(frames, contacts)`` bool, those of the case or the reference.
    predicted: ``(frames, contacts)`` bool, the prediction's own labels by speed.
    pivoting: ``(frames, contacts)`` bool, where the case's labels say so: turns about a resting point.
    """

    joints: np.ndarray
    planted: np.ndarray
    predicted: np.ndarray
    pivoting: np.ndarray


def _shared(compute: "Callable[[Comparison], T]") -> cached_property[T]:
    """A property that is computed once, for all metrics."""

    @wraps(compute)
    def shared(comparison: "Comparison") -> T:
        return immutable(compute(comparison))

    return cached_property(shared)


@dataclass(frozen=True, eq=False)
class Comparison:
    """A case, a prediction of its target, and the arrays that metrics ask for more than once.

    Shapes: ``frames`` and all ``joints`` of the target's skeleton; metres, Y up. What needs a reference
    is None where the case has none. Every array is computed when it is first asked for, and cannot be
    written to; nor can case and prediction where they are ``immutable``, as in every run.

    Raises BenchError when prediction, source and reference do not have the same frames and rate, or the
    prediction or the reference is not a motion of the target, or the target has no height.
    """

    case: Case
    prediction: Prediction

    def __post_init__(self) -> None:
        where = f"case {self.case.info.id}"
        if self.frames == 0:
            raise BenchError(f"{where}: the prediction has no frames")
        if not (np.isfinite(self.height) and self.height > 0):
            raise BenchError(
                f"{where}: {self.target.name} has no height to divide errors by; check its roles"
            )
        for name, motion in (("source", self.case.source), ("reference", self.case.reference)):
            if motion is not None and motion.frames != self.frames:
                own = f"{self.frames} frames"
                raise BenchError(f"{where}: the prediction has {own}, the {name} {motion.frames}")
            if motion is not None and abs(motion.fps - self.fps) > 1e-3 * self.fps:
                own = f"{self.fps:g} frames per second"
                raise BenchError(f"{where}: the prediction has {own}, the {name} {motion.fps:g}")
        for name, motion in (("prediction", self.prediction), ("reference", self.case.reference)):
            if motion is not None and motion.skeleton.names != self.target.skeleton.names:
                raise BenchError(f"{where}: the {name} is not a motion of {self.target.name}'s skeleton")

    @property
    def target(self) -> Character:
        return self.case.target

    @property
    def height(self) -> float:
        """Metres: the target's height, which errors are divided by."""
        return float(self.target.height)

    @property
    def frames(self) -> int:
        return self.prediction.frames

    @property
    def fps(self) -> float:
        return float(self.prediction.fps)

    # ------------------------------------------------------------------------------------- positions
    @_shared
    def predicted(self) -> np.ndarray:
        """``(frames, joints, 3)`` where the prediction's joints are."""
        return self.prediction.positions

    @_shared
    def expected(self) -> np.ndarray | None:
        """``(frames, joints, 3)`` where the reference's joints are."""
        return None if self.case.reference is None else self.case.reference.positions

    @_shared
    def predicted_vertices(self) -> np.ndarray | None:
        """``(frames, V, 3)`` metres: the target's skin in the prediction, by skinning where it is known by
        rotations. None where the target has no mesh, or the prediction is known by positions."""
        return vertices(self.prediction, self.target)

    @_shared
    def expected_vertices(self) -> np.ndarray | None:
        """``(frames, V, 3)`` metres: the target's skin in the reference, likewise."""
        return None if self.case.reference is None else _expected(self.case.reference, self.target)

    @_shared
    def offsets(self) -> np.ndarray | None:
        """``(frames, joints, 3)`` from the reference's joints to the prediction's."""
        return None if self.expected is None else self.predicted - self.expected

    @_shared
    def squares(self) -> np.ndarray | None:
        """``(frames, joints)`` squared metres between prediction and reference in the world."""
        return None if self.offsets is None else squared_length(self.offsets)

    @_shared
    def distances(self) -> np.ndarray | None:
        """``(frames, joints)`` metres between prediction and reference in the world."""
        return None if self.squares is None else np.sqrt(self.squares)

    @_shared
    def centred_distances(self) -> np.ndarray | None:
        """``(frames, joints)`` metres after subtracting each side's own hips in every frame."""
        if self.offsets is None:
            return None
        return np.sqrt(squared_length(self.offsets - self.offsets[:, self.hips, None]))

    # ---------------------------------------------------------------------------------------- joints
    @property
    def hips(self) -> int:
        """The joint that root-relative values are relative to: the one with role hips, else the root."""
        return self.target.joint_of.get("hips", 0)

    @property
    def joints(self) -> np.ndarray:
        """Indices of the scored joints: the target's own body (``structure_joints``), and fingers and props
        where the source has the same ones. "Virtual" copies never count."""
        return scored_joints(self.case.source.character, self.target)

    @property
    def structure_joints(self) -> np.ndarray:
        """Indices of every joint on a chain from the root to a joint with a role that is not a finger:
        tips and split joints count, fingers, hair, props and "virtual" copies do not."""
        return structure_joints(self.target)

    def shared(self, roles: Sequence[str]) -> tuple[list[int], list[int]]:
        """Joints of the source and of the target that both have one of these roles, in that order."""
        source, target = self.case.source.character, self.target
        both = [role for role in roles if role in source.joint_of and role in target.joint_of]
        return source.joints(both), target.joints(both)

    # -------------------------------------------------------------------------------------- contacts
    @property
    def contact_roles(self) -> tuple[str, ...]:
        """The target's feet and toes, and the fore paws of a four-legged target."""
        return contact_roles(self.target)

    @_shared
    def contact_labels(self) -> ContactLabels | None:
        """The contacts asked for: the case's own labels where it has them, else the reference's by speed.

        None where there is neither, or no labelled joint exists on the target.
        """
        if self.case.contacts is not None:
            return self._labelled()
        if self.expected is None or not self.contact_roles:
            return None
        joints = self.target.joints(self.contact_roles)
        labels = planted(self.expected[:, joints], self.height, self.fps)
        return self._contact_labels(joints, labels, np.zeros_like(labels))

    @_shared
    def source_contact_labels(self) -> ContactLabels | None:
        """The contacts of the source by speed, for the contact joints that both bodies have."""
        at_source, joints = self.shared(self.contact_roles)
        height = float(self.case.source.character.height)
        if not joints or not height > 0:
            return None
        labels = planted(self.case.source.positions[:, at_source], height, self.fps)
        return self._contact_labels(joints, labels, np.zeros_like(labels))

    def _labelled(self) -> ContactLabels | None:
        contacts = self.case.contacts
        assert contacts is not None
        labels = np.asarray(contacts.planted, dtype=bool)
        pivots = np.zeros_like(labels) if contacts.pivoting is None else np.asarray(contacts.pivoting, bool)
        for flags in (labels, pivots):
            if flags.shape != (self.frames, len(contacts.roles)):
                raise BenchError(
                    f"case {self.case.info.id}: contacts of {len(contacts.roles)} roles need labels "
                    f"({self.frames}, {len(contacts.roles)}), got {flags.shape}"
                )
        rows = [k for k, role in enumerate(contacts.roles) if role in self.target.joint_of]
        if not rows:
            return None
        joints = self.target.joints([contacts.roles[k] for k in rows])
        return self._contact_labels(joints, labels[:, rows], pivots[:, rows])

    def _contact_labels(
        self, joints: Sequence[int], labels: np.ndarray, pivots: np.ndarray
    ) -> ContactLabels:
        predicted = planted(self.predicted[:, joints], self.height, self.fps)
        return ContactLabels(np.asarray(joints), labels, predicted, pivots)

    @_shared
    def touches(self) -> tuple[Touch, ...]:
        """The self-touches asked for whose joints the target has; empty where none is known.

        Raises BenchError when their labels are not of this case's frames.
        """
        for touch in self.case.touches or ():
            if touch.rests.shape != (self.frames,):
                raise BenchError(
                    f"case {self.case.info.id}: the touch of {touch.end} on {touch.bearing} needs labels "
                    f"({self.frames},), got {touch.rests.shape}"
                )
        has = self.target.joint_of
        return tuple(t for t in self.case.touches or () if t.end in has and t.bearing in has)

    # ------------------------------------------------------------------------------------- rotations
    @property
    def motions(self) -> tuple[Motion, Motion] | None:
        """Prediction and reference where both are known by rotations."""
        one, other = self.prediction, self.case.reference
        return (one, other) if isinstance(one, Motion) and isinstance(other, Motion) else None


def vertices(motion: Prediction, body: Character) -> np.ndarray | None:
    """``(frames, V, 3)`` metres: the skin of a body in a motion of it; None where it is not known."""
    if isinstance(motion, Surface):
        return motion.vertices
    if not isinstance(motion, Motion) or body.mesh is None:
        return None
    return body.mesh.skinned(motion)


@lru_cache(maxsize=1)
def _expected(reference: Prediction, body: Character) -> np.ndarray | None:
    """``vertices`` of a reference, which many predictions in turn are compared with."""
    return immutable(vertices(reference, body))


def squared_length(vectors: np.ndarray) -> np.ndarray:
    """``(frames, joints)`` squared lengths of vectors ``(frames, joints, 3)``."""
    return np.einsum("fjc,fjc->fj", vectors, vectors)


def steps(positions: np.ndarray, fps: float) -> np.ndarray:
    """``(frames - 1, joints, 3)`` metres moved per frame of 30 per second, from ``(frames, joints, 3)``."""
    return (positions[1:] - positions[:-1]) * (fps / RATE)


@lru_cache(maxsize=1024)
def scored_joints(source: Character, target: Character) -> np.ndarray:
    """The joint set of the primary protocol (see ``Comparison.joints``), as increasing indices.

    A target without any role is scored on all its joints.
    """
    body = set(structure_joints(target).tolist())
    source_names = set(source.skeleton.names)
    shared = (
        joint
        for joint, (name, role) in enumerate(zip(target.skeleton.names, target.roles, strict=True))
        if (role in source.joint_of if is_finger(role) else role is None and name in source_names)
        and not _virtual(name)
    )
    return _indices(sorted(body.union(shared)))


@lru_cache(maxsize=1024)
def structure_joints(target: Character) -> np.ndarray:
    """The joint set of the papers' position protocols (see ``Comparison.structure_joints``)."""
    parents = target.skeleton.parents.tolist()
    joints = set()
    for joint, role in enumerate(target.roles):
        while is_body(role) and joint >= 0:
            joints.add(joint)
            joint = parents[joint]
    names = target.skeleton.names
    return _indices([j for j in sorted(joints) if not _virtual(names[j])] or range(len(names)))


@lru_cache(maxsize=1024)
def body_joints(character: Character) -> tuple[int, ...]:
    """The structure joints at and below the hips, the hips first, as learned methods see a body.

    Raises SkeletonError where the character has no hips or nothing below them.
    """
    hips = character.joint_of.get("hips", -1)
    if hips < 0:
        raise SkeletonError(f"no joint of {character.name} is known as hips; name it in a roles file")
    joints = structure_joints(character).tolist()
    below = tuple(j for j in joints if j == hips or hips in ancestors(character.skeleton, j))
    if len(below) < 2:
        raise SkeletonError(f"{character.name} has no joints below its hips")
    return below


@lru_cache(maxsize=1024)
def contact_roles(target: Character) -> tuple[str, ...]:
    """The roles whose contacts are scored (see ``Comparison.contact_roles``)."""
    # the fore paws of four-legged bodies have the roles of hands
    paws = HANDS if target.four_legged else ()
    return tuple(role for role in (*CONTACT_ROLES, *paws) if role in target.joint_of)


def _virtual(name: str) -> bool:
    return "virtual" in name.lower()


def _indices(joints: Sequence[int]) -> np.ndarray:
    return immutable(np.array(joints, dtype=np.int64))
