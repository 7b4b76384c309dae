"""MPJPE once the root's path has been scaled and lifted as suits the pair of bodies best."""

from collections.abc import Mapping, Sequence
from functools import partial

import numpy as np

from retarget_bench.api import MetricCard, PairMetric, Value, protocol
from retarget_bench.api.comparison import Comparison, squared_length

SOURCE = (
    "the project's primary protocol after an alignment, as visual odometry prints errors of paths after "
    "the best scale and offset (Zhang and Scaramuzza, IROS 2018)"
)
FIT = (
    "d: displacement of the predicted hips from the source's hips of the first frame, level; s: the level "
    "factor, at least 0, and b: the constant lift, for which the hips are nearest to the reference's over "
    "all clips of the pair of bodies (least squares); left out for pairs of fewer than 3 clips"
)
LEVEL = (0, 2)
_value = partial(Value, source=SOURCE, needs=("reference", "source", "clips"))


class PathFitted(PairMetric):
    """What is left of MPJPE when a rule for the root's path is no longer at fault."""

    card = MetricCard(
        name="path_fitted",
        summary="MPJPE after the best scale and lift of the root's path",
        version="1",
        values=(
            _value(
                "mpjpe_h.path_fitted",
                "MPJPE, path fitted",
                "mean joint position error after the best level scale and lift of the pair's root paths",
                unit="% of height",
                better="lower",
                formula=f"mpjpe_h.world of the answer moved by (s - 1) d level and b in height; {FIT}",
                protocol=protocol(placed="path fitted"),
            ),
            _value(
                "path_fit.level",
                "path fit, level",
                "factor that the pair's level paths are best scaled by; 1 needs no change",
                unit="1",
                better="none",
                least=0.0,
                formula=f"s, 1 where no answer moves; {FIT}",
            ),
            _value(
                "path_fit.lift",
                "path fit, lift",
                "height that the pair's answers are best lifted by",
                unit="% of height",
                better="none",
                formula=f"100 * b / h; {FIT}",
            ),
            _value(
                "path_fit.clips",
                "path fit, clips",
                "clips of the pair that the two numbers are fitted to",
                unit="clips",
                better="none",
                least=3.0,
                formula="number of answered clips of the pair of bodies; left out where below 3",
            ),
        ),
        kind="pair",
    )
    least = 3

    def extract(self, comparison: Comparison) -> np.ndarray:
        """``(frames, joints + 2, 3)`` heights: how far each joint is from the reference's, the same of the
        hips, and the hips' displacement from the source's of the first frame."""
        assert comparison.offsets is not None
        hips, source = comparison.hips, comparison.case.source
        start = source.positions[0, source.character.joint_of.get("hips", 0)]
        moved = comparison.predicted[:, hips] - start
        offsets = comparison.offsets[:, [*comparison.joints, hips]]
        return np.concatenate([offsets, moved[:, None]], axis=1) / comparison.height

    def values(self, clips: Sequence[np.ndarray]) -> Sequence[Mapping[str, float]]:
        """The values of each clip of a pair."""
        hips, moved = (np.concatenate([clip[:, part] for clip in clips]).astype(float) for part in (-2, -1))
        level, lift = _fit(hips, moved)
        fit = {"path_fit.level": level, "path_fit.lift": 100.0 * lift, "path_fit.clips": float(len(clips))}
        return [{"mpjpe_h.path_fitted": _error(clip.astype(float), level, lift), **fit} for clip in clips]


def _fit(offset: np.ndarray, moved: np.ndarray) -> tuple[float, float]:
    """The level factor and the lift that bring hips ``(n, 3)`` nearest to where they should be."""
    move, expected = moved[:, LEVEL], (moved - offset)[:, LEVEL]
    size = float((move * move).sum())
    factor = max(0.0, float((move * expected).sum()) / size) if size > 0.0 else 1.0
    return factor, -float(offset[:, 1].mean())


def _error(clip: np.ndarray, level: float, lift: float) -> float:
    """MPJPE of a clip, by its extract, moved by a fit, % of height."""
    shift = (level - 1.0) * clip[:, -1]
    shift[:, 1] = lift
    return 100.0 * float(np.sqrt(squared_length(clip[:, :-2] + shift[:, None])).mean())


plugin = PathFitted
