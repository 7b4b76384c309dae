"""Keeps of an answer what the method changes from one body to the other, and copies the rest."""

from dataclasses import dataclass
from typing import Self

import numpy as np

from retarget_bench.api import Context, Prediction
from retarget_bench.errors import BenchError, NotSupported
from retarget_bench.motion import root_rules, rotation, transfer
from retarget_bench.motion.character import Character, Motion, Positions
from retarget_bench.motion.planting.cuts import takes
from retarget_bench.motion.roles import ancestors
from retarget_bench.motion.smoothing import averaged
from retarget_bench.plugins.post_processors import RECONSTRUCTION, Post, PostCard

_SHORT = 1e-3
"""Heights: a bone of the source that is no longer says nothing of the target's."""


class Residual(Post):
    """The copied source plus the difference between two answers: the target's, and the source's own.

    What a network loses of a motion, it loses on every body alike. Where it is asked for the source on the
    source's own body, the right answer is known, and so is what was lost. The answer is given that back:
    onto the same body nothing is changed at all. What is left of the method, its difference between both
    bodies, is averaged over time with Gaussian weights, but not over the source's cuts.

    Raises NotSupported for an answer with rotations where the source, or that on its own body, has none.
    """

    card = PostCard(
        name="residual",
        summary="Copies the source and adds what the method changes between the two bodies",
        version="1",
        accepts=("motion", "positions"),
        needs=(RECONSTRUCTION,),
        parameters={
            "sigma": "standard deviation in seconds of the weights that changes are averaged with",
            "root_rule": "length whose ratio scales the root path",
        },
    )

    def __init__(self, sigma: float = 0.1, root_rule: root_rules.ScalingRule = "hip_height") -> None:
        if not 0.0 <= sigma <= 1.0:
            raise BenchError(f"residual: sigma is in seconds, from 0 to 1; got {sigma:g}")
        self.sigma = sigma
        self.root_rule = root_rules.check(root_rule, root_rules.SCALING_RULES)

    def supports(self, source: Character, target: Character) -> str | None:
        return transfer.reason(source, target) or root_rules.reason(self.root_rule, source, target)

    def process(self, prediction: Prediction, source: Prediction, *, context: Context) -> Prediction:
        own, width, pieces = context.reconstruction, self.sigma * prediction.fps, takes(source)
        ratios = root_rules.ratios(self.root_rule, source.character, prediction.character)
        if isinstance(prediction, Motion):
            if not isinstance(source, Motion):
                raise NotSupported("residual needs a source with rotations for an answer with rotations")
            if not isinstance(own, Motion):
                raise NotSupported("residual needs rotations on the source's own body, too")
            return _turned(prediction, source, own, ratios, width, pieces)
        assert isinstance(prediction, Positions)
        assert own is not None
        return _placed(prediction, source, own, ratios, width, pieces)


def _turned(
    answer: Motion, source: Motion, own: Motion, ratios: np.ndarray, width: float, pieces: list[slice]
) -> Motion:
    """By orientations relative to the reference pose, a change as seen from the joint that it turns."""
    target = answer.character
    copied, reconstructed = (transfer.orientations(each, target) for each in (source, own))
    changed = rotation.multiply(
        rotation.conjugate(reconstructed), transfer.relative(answer)
    )  # (frames, joints, 4)
    moved = transfer.hips(answer) - ratios * transfer.hips(own)
    for piece in pieces:
        turns = rotation.continuous(rotation.normalise(changed[piece]))
        changed[piece] = rotation.normalise(averaged(turns, width))
        moved[piece] = averaged(moved[piece], width)
    local = transfer.from_relative(target, rotation.multiply(copied, changed))
    hips = ratios * transfer.hips(source) + moved
    return target.motion(local, transfer.root_from_hips(target, local, hips), answer.fps)


def _placed(
    answer: Positions,
    source: Prediction,
    own: Prediction,
    ratios: np.ndarray,
    width: float,
    pieces: list[slice],
) -> Positions:
    """By bones: what each lacks in the answer on the source's own body, in the length of the target's."""
    bones = _Bones.between(source.character, answer.character, ratios)
    lacking = bones.carried(source.positions - own.positions)
    changed = answer.positions - bones.carried(own.positions)  # (frames, joints, 3)
    trembling = np.concatenate([changed[piece] - averaged(changed[piece], width) for piece in pieces])
    places = answer.positions + lacking - trembling[:, bones.like]
    return answer.character.positions(places, answer.fps)


@dataclass(frozen=True, eq=False)
class _Bones:
    """The source's joint that each of the target's ``(joints,)`` takes after.

    like:  the joint itself where the source has a counterpart, else the nearest above that has one; the
           hips for what is above them. match: that joint's counterpart.
    above: the nearest such joint above; -1 for the hips and what is above them.
    scale: ``(joints, 3)`` length from ``above`` to ``like`` over the source's between the same, 0 where
           that has none; that of the root path where there is no ``above``.
    """

    like: np.ndarray
    match: np.ndarray
    above: np.ndarray
    scale: np.ndarray

    @classmethod
    def between(cls, source: Character, target: Character, ratios: np.ndarray) -> Self:
        answer, parents = transfer.correspondence(source, target), target.skeleton.parents.tolist()
        hips = target.joint_of["hips"]
        first = [hips, *ancestors(target.skeleton, hips)]
        like = np.full(len(parents), hips)
        for joint, parent in enumerate(parents):
            if answer[joint] >= 0:
                like[joint] = joint
            elif joint not in first:
                like[joint] = like[parent]
        above = np.where(np.isin(like, first), -1, like[np.array(parents)[like]])
        match = answer[like]
        target_places, source_places = target.reference_places, source.reference_places
        length = np.linalg.norm(target_places[like] - target_places[above], axis=-1)
        there = np.linalg.norm(source_places[match] - source_places[match[above]], axis=-1)
        scale = np.divide(length, there, out=np.zeros_like(length), where=there > _SHORT * source.height)
        return cls(like, match, above, np.where(above[:, None] < 0, ratios, scale[:, None]))

    def carried(self, positions: np.ndarray) -> np.ndarray:
        """``(frames, joints of the target, 3)``: displacements, or positions, ``(frames, joints of the
        source, 3)`` added up along the target's bones."""
        out = np.empty((len(positions), len(self.like), 3))
        order = sorted(set(self.like.tolist()), key=lambda joint: (self.above[joint] >= 0, joint))
        for joint in order:
            above, here = self.above[joint], positions[:, self.match[joint]]
            if above < 0:
                out[:, joint] = self.scale[joint] * here
            else:
                bone = here - positions[:, self.match[above]]
                out[:, joint] = out[:, above] + self.scale[joint] * bone
        return out[:, self.like]


plugin = Residual
