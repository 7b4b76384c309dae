"""Motions of a character, under the path that plug-ins import them from; see ``character.py``."""

from retarget_bench.motion.character import Motion, Positions, Prediction, Surface, resampled_frames
from retarget_bench.motion.point_sets import PointSets, Source, kind_of

__all__ = [
    "Motion",
    "PointSets",
    "Positions",
    "Prediction",
    "Source",
    "Surface",
    "kind_of",
    "resampled_frames",
]
