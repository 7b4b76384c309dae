"""A body as HuMoT sees it: positions of its joints, Z up, and its neutral pose."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from retarget_bench.api.comparison import body_joints, structure_joints
from retarget_bench.motion import aligned, rotation, transfer
from retarget_bench.motion.character import Character
from retarget_bench.motion.fitting.fit import fit
from retarget_bench.motion.motion import Motion, Positions, Prediction
from retarget_bench.motion.roles import SIDES, ancestors

USUAL = 1.3
"""Metres: the stature of the bodies that the networks were trained on, that of an adult."""
HEIGHTS = {"foot": 0.0, "leg": 0.31, "hand": 0.57, "up_leg": 0.61, "forearm": 0.78, "arm": 1.0}
MAJOR = {f"{side}_{part}": height for side in SIDES for part, height in HEIGHTS.items()}
"""Ankles, hips, knees, shoulders, elbows and wrists, which every structure has (section 3.4.1). Numbers:
how high they are in the neutral pose, in parts of the stature; means over puppets."""
LOW = 0.1
"""A body whose major joints are this close to each other there has no stature."""


@dataclass(frozen=True, eq=False)
class HumotBody:
    """joints: indices of those seen, the hips first. parents: ``(joints,)`` among them, -1 for the first.

    template: ``(joints, 3)`` metres, Z up, the hips at the origin.
    """

    character: Character
    joints: tuple[int, ...]
    parents: tuple[int, ...]
    template: np.ndarray

    @cached_property
    def stature(self) -> float:
        """Metres: see ``stature``; a part of a body is as tall as the whole of it."""
        complete = self.character.whole
        return body(complete).stature if complete is not None else stature(self.template, self.heights)

    @cached_property
    def heights(self) -> np.ndarray:
        """``(joints,)`` of ``HEIGHTS``, NaN for what is no major joint."""
        roles = [self.character.roles[joint] for joint in self.joints]
        return np.array([MAJOR.get(role or "", np.nan) for role in roles])

    @cached_property
    def major(self) -> np.ndarray:
        """``(joints,)`` bool."""
        return np.isfinite(self.heights)

    @cached_property
    def centring(self) -> np.ndarray:
        """``(joints,)`` bool: the joints that say where the body is: the major ones, or all where a part of
        a body has none of them."""
        return self.major if self.major.any() else np.ones_like(self.major)

    @cached_property
    def beside(self) -> np.ndarray:
        """``(3,)`` metres in the template, from the mean of those to that of the whole body's."""
        complete = self.character.whole
        every = self if complete is None else body(complete)
        return every.template[every.centring].mean(0) - self.template[self.centring].mean(0)

    def see(self, motion: Prediction) -> np.ndarray:
        """``(frames, joints, 3)`` metres, Z up."""
        return upright(motion.positions[:, list(self.joints)])

    def turns(self, motion: Prediction) -> np.ndarray:
        """``(frames, joints, 4)``, Z up: how what the bone to each joint hangs from is turned from the
        reference pose; all zero where only positions are known. The hips hang from themselves."""
        if not isinstance(motion, Motion):
            return np.zeros((motion.frames, len(self.joints), 4))
        above = [self.joints[max(parent, 0)] for parent in self.parents]
        w, x, y, z = np.moveaxis(transfer.relative(motion)[:, above], -1, 0)
        return np.stack([w, -x, z, y], axis=-1)

    @cached_property
    def visible(self) -> Character:
        """The joints seen as a body of their own, which rests in the reference pose."""
        one = self.character
        shown = aligned.Aligned(one, self.joints)
        still = rotation.identity(len(self.joints))
        skeleton, roles = shown.skeleton, shown.roles
        return Character(one.name, skeleton, one.structure, roles, still, one.measures, hinges=one.hinges)

    def positions(self, positions: np.ndarray, fps: float, source: Prediction | None = None) -> Positions:
        """The whole body from positions ``(frames, joints, 3)``, Z up, of the joints seen.

        A joint that is not seen keeps to the one that it hangs from as in the reference pose, turned as a
        fit to the joints seen turns that; one above the hips keeps to the hips.

        source: the motion that this is an answer to, as many frames; see ``fit``.
        """
        skeleton, rest = self.character.skeleton, self.character.reference_places
        places = np.zeros((len(positions), len(skeleton), 3))
        places[:, list(self.joints)] = shown = upright(positions)
        hips, rank = self.joints[0], {joint: number for number, joint in enumerate(self.joints)}
        if len(rank) < len(skeleton):
            turned = fit(self.visible.positions(shown, fps), source).motion.global_rotations
        for joint, parent in enumerate(skeleton.parents.tolist()):
            if joint in rank:
                continue
            if hips not in (above := ancestors(skeleton, joint)):
                places[:, joint] = places[:, hips] + rest[joint] - rest[hips]
                continue
            leader = next(rank[each] for each in above if each in rank)
            places[:, joint] = places[:, parent] + rotation.rotate(
                turned[:, leader], rest[joint] - rest[parent]
            )
        return self.character.positions(places, fps)


@lru_cache(maxsize=1024)
def body(character: Character) -> HumotBody:
    """The body of a character; a part without hips has all joints: it can be read, and not written.

    Raises SkeletonError where a whole character has no hips or nothing below them."""
    hipless = character.whole is not None and "hips" not in character.joint_of
    joints = tuple(structure_joints(character).tolist()) if hipless else body_joints(character)
    template = upright(aligned.template(character)[list(joints)])
    return HumotBody(
        character, joints, parents_among(character.skeleton.parents.tolist(), joints), template
    )


def parents_among(parents: Sequence[int], joints: Sequence[int]) -> tuple[int, ...]:
    """Each joint's nearest ancestor among ``joints``, by its place there; -1 where none is."""
    place = {joint: number for number, joint in enumerate(joints)}
    indices = []
    for joint in joints:
        above = parents[joint]
        while above >= 0 and above not in place:
            above = parents[above]
        indices.append(place.get(above, -1))
    return tuple(indices)


def stature(template: np.ndarray, heights: np.ndarray) -> float:
    """Metres from the ankles to the shoulders of a neutral pose ``(joints, 3)``; 0 where nothing tells.

    heights: ``(joints,)`` see ``HumotBody.heights``. A body without arms, or without legs, is as tall as
    others that are like it in what it has: the legs of an adult are not a small body to be enlarged.
    """
    measured = np.isfinite(heights)
    usual = float(np.ptp(heights[measured])) if measured.any() else 0.0
    return float(np.ptp(template[measured, 2])) / usual if usual > LOW else 0.0


def size_factor(height: float) -> float:
    """Factor that brings a body of this stature to the usual size; 1 where it has none."""
    return USUAL / height if height > 0.0 else 1.0


def upright(positions: np.ndarray) -> np.ndarray:
    """``(..., 3)`` from left, up, ahead to right, ahead, up; and back again."""
    return np.stack([-positions[..., 0], positions[..., 2], positions[..., 1]], axis=-1)


def blank(joints: Sequence[int], frames: int) -> dict[str, np.ndarray]:
    """Zeros for ``places`` ``(rows, frames, most, 3)`` and ``template`` ``(rows, most, 3)`` of bodies with
    so many joints; ``joints`` ``(rows, most)`` bool, those that there are."""
    rows, most = len(joints), max(joints)
    return {
        "places": np.zeros((rows, frames, most, 3), np.float32),
        "template": np.zeros((rows, most, 3), np.float32),
        "joints": np.arange(most) < np.array(joints)[:, None],
    }


def headings(
    positions: np.ndarray, template: np.ndarray, joints: np.ndarray, frames: np.ndarray
) -> np.ndarray:
    """``(rows,)`` radians: the turn, Z up, that brings each template nearest to the mean over frames.

    positions: ``(rows, frames, joints, 3)``. template: ``(rows, joints, 3)``. joints: ``(rows, joints)``
    and frames: ``(rows, frames)`` bool, True where there is one. The least squares have a closed form, as
    only one angle is sought; 0 where every turn is as good.
    """
    real = frames[:, :, None, None]
    mean = np.where(real, positions[..., :2], 0.0).sum(1) / real.sum(1)
    posed, still = (_level(each, joints) for each in (mean, template[..., :2]))
    return np.angle((posed * still.conj()).sum(1))


def _level(positions: np.ndarray, joints: np.ndarray) -> np.ndarray:
    """``(rows, joints)`` complex, about the mean of real joints, zero where there is none."""
    level = np.where(joints, positions[..., 0] + 1j * positions[..., 1], 0.0)
    return np.where(joints, level - level.sum(1, keepdims=True) / joints.sum(1, keepdims=True), 0.0)


def rotated(positions: np.ndarray, angles: np.ndarray) -> np.ndarray:
    """Positions ``(rows, ..., 3)`` turned by an angle ``(rows,)`` each."""
    level = (positions[..., 0] + 1j * positions[..., 1]) * np.exp(1j * angles).reshape(
        -1, *[1] * (positions.ndim - 2)
    )
    return np.stack([level.real, level.imag, positions[..., 2]], axis=-1).astype(positions.dtype)
