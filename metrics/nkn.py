"""Position errors as NKN, PMnet and STaR print them: 22 joints, windows of 120 frames."""

from collections.abc import Mapping
from functools import lru_cache, partial

import numpy as np

from retarget_bench.api import Metric, MetricCard, Value, protocol
from retarget_bench.api.comparison import Comparison, squared_length
from retarget_bench.motion.character import Character

ROLES = (
    *("hips", "spine_1", "spine_2", "spine_3", "neck", "head"),
    *("left_up_leg", "left_leg", "left_foot", "left_toe"),
    *("right_up_leg", "right_leg", "right_foot", "right_toe"),
    *("left_shoulder", "left_arm", "left_forearm", "left_hand"),
    *("right_shoulder", "right_arm", "right_forearm", "right_hand"),
)
LEFT = [ROLES.index("left_up_leg"), ROLES.index("left_shoulder")]
RIGHT = [ROLES.index("right_up_leg"), ROLES.index("right_shoulder")]
WINDOW = 120
SIGMA = 20.0
"""Frames: the facing direction is smoothed with this Gaussian, cut off at four of them."""

APPLIES = (
    "left out without a reference, where source or target lack one of the 22 joints (three spines, one "
    "neck) or H2 is unknown"
)
LONG = "and for clips of fewer than 121 frames"
H2 = "H2: bone lengths hips-to-head + upper leg-to-toe, the hip bone left out"


_value = partial(Value, unit="cm", better="lower", tolerance=1e-5, needs=("reference", "source"))
_protocol = partial(protocol, divided_by="H2", joints="22")


class Nkn(Metric):
    """Legacy protocols on 22 joints and H2."""

    card = MetricCard(
        name="nkn",
        summary="position errors of the 22-joint papers",
        version="1",
        values=(
            _value(
                "nkn_mse_h",
                "NKN error",
                "squared position error over height, in windows of 120 frames with a common start",
                formula=(
                    "mean over windows, frames and 22 joints of |w(p) - w(g')|^2 / H2, lengths in cm; "
                    "windows: 120 frames, consecutive, the last one ending with the clip; g': the "
                    "reference, its lowest joint of frame 0 put at the height of the source's (so where "
                    "their floors differ the reference itself does not score 0); w, in the window "
                    "beginning at s: level place relative to the hips in s, height relative to the hips "
                    "in s plus the hips' height in frame 0, turned about Y until the facing direction of "
                    "s is +Z, each side by its own (what integrating root velocities and turns from zero "
                    "gives); facing: across = unit of (left - right upper leg) + (left - right "
                    "shoulder), forward = across x up, smoothed over the clip by a Gaussian of 20 "
                    f"frames, ends repeated; {H2}; no resampling; {APPLIES}, {LONG}"
                ),
                source="NKN (Villegas et al. 2018), evaluation code; PMnet; R2ET by ancestry (assumed)",
                protocol=_protocol(
                    "squared distance", placed="start and facing of every window", frames="windows of 120"
                ),
            ),
            _value(
                "nkn_mse_local",
                "NKN error, local",
                "squared position error over height per frame, without root path and heading",
                formula=(
                    "as nkn_mse_h, with every frame's horizontal place relative to its own hips, its "
                    "hips kept at their height in frame 0, and turned by its own facing direction; "
                    f"{APPLIES}, {LONG}"
                ),
                source="NKN's local motion representation; R2ET's MSE^lc by ancestry (assumed)",
                protocol=_protocol(
                    "squared distance", placed="hips and facing of every frame", frames="windows of 120"
                ),
            ),
            _value(
                "star",
                "STaR error",
                "mean position error in heights, 22 joints (called MSE there, but not squared)",
                unit="heights",
                formula=f"mean over frames and 22 joints of |p - g| / H2, no alignment; {H2}; {APPLIES}",
                source="STaR, test code",
                tolerance=1e-8,
                needs=("reference",),
                protocol=_protocol(),
            ),
        ),
    )

    def compute(self, comparison: Comparison) -> Mapping[str, float]:
        """Ids that do not apply are left out, as their formulas say."""
        h2 = float(comparison.target.measures.h2)
        joints = body22(comparison.target)
        if comparison.expected is None or comparison.distances is None or not h2 > 0 or joints is None:
            return {}
        values = {"star": float(comparison.distances[:, joints].mean()) / h2}
        source = body22(comparison.case.source.character)
        if comparison.frames > WINDOW and source is not None:
            lowest = comparison.case.source.positions[0, source, 1].min()
            predicted = comparison.predicted[:, joints]
            expected = comparison.expected[:, joints].copy()
            expected[..., 1] += lowest - expected[0, :, 1].min()
            values |= _squared_errors(predicted, expected, 100.0 / h2)
        return values


def _squared_errors(predicted: np.ndarray, expected: np.ndarray, scale: float) -> dict[str, float]:
    """Both windowed values from positions ``(frames, 22, 3)`` metres."""
    sides = [(side, _origin(side), _facing(side)) for side in (predicted, expected)]
    local = [_turned(side - origin[:, None], yaw[:, None]) for side, origin, yaw in sides]
    local_error = squared_length(local[0] - local[1])
    world, near = [], []
    for start in _starts(len(predicted)):
        frames = slice(start, start + WINDOW)
        placed = [_turned(side[frames] - origin[start], yaw[start]) for side, origin, yaw in sides]
        world.append(squared_length(placed[0] - placed[1]).mean())
        near.append(local_error[frames].mean())
    return {"nkn_mse_h": float(np.mean(world)) * scale, "nkn_mse_local": float(np.mean(near)) * scale}


def _starts(frames: int) -> list[int]:
    """First frames of the windows: consecutive ones, then one that ends with the clip."""
    starts = list(range(0, frames - WINDOW + 1, WINDOW))
    return starts if frames % WINDOW == 0 else [*starts, frames - WINDOW]


def _origin(positions: np.ndarray) -> np.ndarray:
    """``(frames, 3)`` metres: the hips, their height counted from that in frame 0."""
    origin = positions[:, 0].copy()
    origin[:, 1] -= origin[0, 1]
    return origin


def _facing(positions: np.ndarray) -> np.ndarray:
    """``(frames,)`` radians about Y from +Z to where a body ``(frames, 22, 3)`` faces, smoothed in time."""
    across = (positions[:, LEFT] - positions[:, RIGHT]).sum(axis=1)
    length = np.linalg.norm(across, axis=1, keepdims=True)
    across = across / np.where(length > 0, length, 1.0)
    radius = int(4 * SIGMA)
    weights = np.exp(-0.5 * (np.arange(-radius, radius + 1) / SIGMA) ** 2)
    padded = np.pad(across, ((radius, radius), (0, 0)), mode="edge")
    # forward = across x up = (-across z, 0, across x)
    return np.arctan2(
        np.convolve(-padded[:, 2], weights, "valid"), np.convolve(padded[:, 0], weights, "valid")
    )


def _turned(vectors: np.ndarray, yaw: np.ndarray) -> np.ndarray:
    """Vectors ``(frames, 22, 3)`` turned about Y by ``-yaw``, which broadcasts over frames and joints."""
    cos, sin = np.cos(yaw), np.sin(yaw)
    x, y, z = vectors[..., 0], vectors[..., 1], vectors[..., 2]
    return np.stack([x * cos - z * sin, y, x * sin + z * cos], axis=-1)


@lru_cache(maxsize=1024)
def body22(character: Character) -> np.ndarray | None:
    """The 22 joints in the papers' order, or None where the body has not exactly these."""
    joint_of = character.joint_of
    if any(role not in joint_of for role in ROLES) or "spine_4" in joint_of:
        return None
    return np.array([joint_of[role] for role in ROLES])


plugin = Nkn
