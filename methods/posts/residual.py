"""Keeps of an answer what the method changes from one body to the other, and copies the rest."""

import numpy as np

from retarget_bench.api import Context, Prediction
from retarget_bench.errors import BenchError, NotSupported
from retarget_bench.motion import root_rules, rotation, transfer
from retarget_bench.motion.character import Character, Motion, Positions
from retarget_bench.motion.planting.cuts import takes
from retarget_bench.motion.smoothing import averaged
from retarget_bench.plugins.post_processors import RECONSTRUCTION, PostCard

RULE = "hip_height"


class Residual:
    """The copied source plus the difference between two answers: the target's, and the source's own.

    What a network loses of a motion, it loses on every body alike. Where it is asked for the source on the
    source's own body, the right answer is known, and so is what was lost. The answer is given that back:
    onto the same body nothing is changed at all. What is left of the method, its difference between both
    bodies, is averaged over time with Gaussian weights, but not over the source's cuts.
    """

    card = PostCard(
        name="residual",
        summary="Copies the source and adds what the method changes between the two bodies",
        version="1",
        accepts=("motion", "positions"),
        needs=(RECONSTRUCTION,),
        parameters={"sigma": "standard deviation in seconds of the weights that changes are averaged with"},
    )

    def __init__(self, sigma: float = 0.1) -> None:
        if not 0.0 <= sigma <= 10.0:
            raise BenchError(f"residual: sigma is in seconds, from 0 to 10; got {sigma:g}")
        self.sigma = sigma

    def supports(self, source: Character, target: Character) -> str | None:
        return transfer.reason(source, target) or root_rules.reason(RULE, source, target)

    def process(self, prediction: Prediction, source: Prediction, *, context: Context) -> Prediction:
        own, ratio = context.reconstruction, root_rules.ratio(RULE, source.character, prediction.character)
        width, pieces = self.sigma * prediction.fps, takes(source)
        if isinstance(prediction, Motion):
            if not (isinstance(source, Motion) and isinstance(own, Motion)):
                raise NotSupported("residual needs a source with rotations for an answer with rotations")
            return _turned(prediction, source, own, ratio, width, pieces)
        assert isinstance(prediction, Positions)
        assert own is not None
        return _placed(prediction, source, own, ratio, width, pieces)


def _turned(
    answer: Motion, source: Motion, own: Motion, ratio: float, width: float, pieces: list[slice]
) -> Motion:
    """By orientations relative to the reference pose, a change as seen from the joint that it turns."""
    target = answer.character
    copied, kept = (transfer.orientations(each, target) for each in (source, own))
    changed = rotation.multiply(rotation.conjugate(kept), transfer.relative(answer))  # (frames, joints, 4)
    moved = transfer.hips(answer) - ratio * transfer.hips(own)
    for piece in pieces:
        turns = rotation.continuous(rotation.normalise(changed[piece]))
        changed[piece] = rotation.normalise(averaged(turns, width))
        moved[piece] = averaged(moved[piece], width)
    local = transfer.from_relative(target, rotation.multiply(copied, changed))
    hips = ratio * transfer.hips(source) + moved
    return target.motion(local, transfer.root_from_hips(target, local, hips), answer.fps)


def _placed(
    answer: Positions, source: Prediction, own: Prediction, ratio: float, width: float, pieces: list[slice]
) -> Positions:
    """By positions; a joint that the source lacks is moved by as much as the one that it hangs from."""
    target = answer.character
    match = transfer.correspondence(source.character, target)
    lost = ratio * (source.positions - own.positions)
    given = transfer.shared_out(lost, match, target, np.zeros(3))  # (frames, joints, 3)
    known = np.flatnonzero(match >= 0)
    changed = answer.positions[:, known] - ratio * own.positions[:, match[known]]
    trembling = np.concatenate([changed[piece] - averaged(changed[piece], width) for piece in pieces])
    rank = np.full(len(match), transfer.FOLLOW)
    rank[known] = np.arange(len(known))
    given -= transfer.shared_out(trembling, rank, target, np.zeros(3))
    return target.positions(answer.positions + given, answer.fps)


plugin = Residual
