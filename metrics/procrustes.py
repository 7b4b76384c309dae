"""Procrustes-aligned position errors: pose and shape without global position and orientation."""

from collections.abc import Mapping

import numpy as np

from retarget_bench.api import Metric, MetricCard, Value, protocol
from retarget_bench.api.comparison import RATE, Comparison, squared_length
from retarget_bench.motion.alignment import RIGID, SIMILAR, fits, residuals

FITS = {
    "rigid": "turned and moved in every frame",
    "similarity": "turned, moved and scaled in every frame",
    "rigid_clip": "turned and moved once per clip",
    "similarity_clip": "turned, moved and scaled once per clip",
}
SOURCE = "Procrustes-aligned MPJPE (pa_mpjpe); fit by Kabsch 1976 and Umeyama 1991"


def _value(variant: str, label: str, meaning: str, formula: str) -> Value:
    return Value(
        id=f"pa_mpjpe.{variant}",
        label=label,
        meaning=meaning,
        unit="% of height",
        better="lower",
        formula=f"{formula}; joints and h as mpjpe_h.world",
        source=SOURCE,
        protocol=protocol(placed=FITS[variant]),
    )


class Procrustes(Metric):
    """Mean distances that remain after a least-squares alignment."""

    card = MetricCard(
        name="procrustes",
        summary="Procrustes-aligned position errors",
        version="1",
        values=(
            _value(
                "rigid",
                "PA-MPJPE, rigid",
                "mean joint position error after a rigid alignment (rotation, translation) of each frame",
                f"100 * mean over frames and joints of |R p + t - g| / h, {RIGID}, chosen in every frame "
                "for the least sum of squares",
            ),
            _value(
                "similarity",
                "PA-MPJPE",
                "mean joint position error after a similarity alignment (with scale) of each frame",
                f"100 * mean over frames and joints of |s R p + t - g| / h, {SIMILAR}, chosen in every "
                "frame for the least sum of squares",
            ),
            _value(
                "rigid_clip",
                "PA-MPJPE of the clip, rigid",
                "mean joint position error after one rigid alignment of the whole clip",
                f"as pa_mpjpe.rigid with one fit for all frames of the clip; {RIGID}",
            ),
            _value(
                "similarity_clip",
                "PA-MPJPE of the clip",
                "mean joint position error after one similarity alignment of the whole clip",
                f"as pa_mpjpe.similarity with one fit for all frames of the clip; {SIMILAR}",
            ),
            Value(
                id="pa_acc",
                label="PA acceleration error",
                meaning="mean difference of joint accelerations after one rigid alignment of the clip",
                unit="m/frame^2",
                better="lower",
                formula=(
                    "mean over frames and joints of |R D(p) - D(g)| * (fps / 30)^2, R as in "
                    "pa_mpjpe.rigid_clip (a fit per frame would add jitter of its own), D(x) = x(t+1) - "
                    "2 x(t) + x(t-1); left out for clips of fewer than three frames"
                ),
                source="printed for SMPL bodies as PA-Acc; one fit per clip is our choice, and leaves most "
                "clips nearly as acc has them",
            ),
            Value(
                id="pa_acc.rigid",
                label="PA acceleration error, fit per frame",
                meaning="mean difference of joint accelerations after a rigid alignment of each frame",
                unit="m/frame^2",
                better="lower",
                formula=(
                    "mean over frames and joints of |D(R p + t) - D(g)| * (fps / 30)^2, R and t of each "
                    "frame as in pa_mpjpe.rigid, D as in pa_acc; left out for clips of fewer than three "
                    "frames"
                ),
                source="printed for SMPL bodies as PA-Acc, 0.5 to 0.85 of Acc, which a fit per clip does "
                "not give; rigid or similar is not said",
                protocol=protocol(placed=FITS["rigid"]),
            ),
        ),
    )

    def compute(self, comparison: Comparison) -> Mapping[str, float]:
        """Left out without a reference."""
        if comparison.expected is None:
            return {}
        joints = comparison.joints
        predicted, expected = comparison.predicted[:, joints], comparison.expected[:, joints]
        scale = 100.0 / comparison.height
        as_one = predicted.reshape(1, -1, 3), expected.reshape(1, -1, 3)
        frames, clip = residuals(predicted, expected), residuals(*as_one)
        values = {
            "pa_mpjpe.rigid": frames[0] * scale,
            "pa_mpjpe.similarity": frames[1] * scale,
            "pa_mpjpe.rigid_clip": clip[0] * scale,
            "pa_mpjpe.similarity_clip": clip[1] * scale,
        }
        if comparison.frames > 2:
            turn = fits(*as_one)[0][0]
            scale = (comparison.fps / RATE) ** 2
            values["pa_acc"] = _acceleration(predicted @ turn.T - expected) * scale
            values["pa_acc.rigid"] = _acceleration(_fitted(predicted, expected) - expected) * scale
        return values


def _acceleration(error: np.ndarray) -> float:
    """Mean length of second differences ``(frames, joints, 3)``."""
    return float(np.sqrt(squared_length(np.diff(error, n=2, axis=0))).mean())


def _fitted(moving: np.ndarray, fixed: np.ndarray) -> np.ndarray:
    """Each set of points ``(sets, points, 3)`` where its best rigid fit puts it."""
    middle = fixed.mean(axis=1, keepdims=True)
    turn, _ = fits(moving, fixed)
    return (moving - moving.mean(axis=1, keepdims=True)) @ turn.transpose(0, 2, 1) + middle


plugin = Procrustes
