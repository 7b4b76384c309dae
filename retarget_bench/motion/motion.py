"""Motions of a character, under the path that plug-ins import them from; see ``character.py``."""

from retarget_bench.motion.character import Motion, Positions, Prediction, resampled_frames

__all__ = ["Motion", "Positions", "Prediction", "resampled_frames"]
