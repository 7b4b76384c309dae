"""The two joint sets, with names in the convention of the rigs they stand for.

``body22`` is the 22-joint body of motion-capture data sets. ``body28`` is the 28-joint structure of the
skeleton-aware retargeting papers: toe ends and head top are joints, and each collar bone and one spine
bone are split by a joint that never turns on its own.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .proportions import Proportions
from .score import SIDES, sign


@dataclass(frozen=True)
class Structure:
    """names: of the joints. parts: what each joint is. parents: -1 for the root.

    bending: the parts of the spine that bend, with their share of the whole bend.
    levels:  all parts of the spine, with the share of the trunk's length from their parent; the last is
             the chest.
    silent:  parts that never turn on their own.
    collar:  number of joints that a collar bone has.
    """

    name: str
    names: tuple[str, ...]
    parts: tuple[str, ...]
    parents: tuple[int, ...]
    bending: tuple[tuple[str, float], ...]
    levels: tuple[tuple[str, float], ...]
    silent: tuple[str, ...]
    collar: int

    @property
    def chest(self) -> str:
        return self.levels[-1][0]

    def offset(self, part: str, sizes: Proportions) -> tuple[float, float, float]:
        """From the parent's joint to this part's joint in the T-pose, metres."""
        if part == "hips":
            return (0.0, sizes.leg + sizes.pelvis, 0.0)
        if part.startswith("spine"):
            return (0.0, dict(self.levels)[part] * sizes.trunk, _CURVE.get(part, 0.0) * sizes.trunk)
        side, _, rest = part.partition("_")
        if side in SIDES:
            across, up, ahead = self._limb_offset(rest, sizes)
            return (sign(side) * across, up, ahead)
        return {
            "neck": (0.0, self._rest_of_trunk * sizes.trunk, -0.05 * sizes.trunk),
            "head": (0.0, sizes.neck, 0.25 * sizes.neck),
            "head_top": (0.0, sizes.head, 0.0),
        }[part]

    @property
    def _rest_of_trunk(self) -> float:
        return 1.0 - sum(share for _, share in self.levels)

    def _limb_offset(self, part: str, sizes: Proportions) -> tuple[float, float, float]:
        """Outward, up and forward."""
        half = (sizes.shoulder_half - sizes.clavicle) / self.collar
        return {
            "up_leg": (sizes.hip_half, -sizes.pelvis, 0.0),
            "leg": (0.0, -sizes.thigh, 0.0),
            "foot": (0.0, -sizes.shank, 0.0),
            "toe": (0.0, sizes.ball_height - sizes.ankle, sizes.ball),
            "toe_end": (0.0, 0.0, sizes.toes),
            "shoulder": (sizes.clavicle, self._rest_of_trunk * sizes.trunk - sizes.shoulder_drop, 0.0),
            "shoulder_split": (half, 0.0, 0.0),
            "arm": (half, 0.0, 0.0),
            "forearm": (sizes.upper_arm, 0.0, 0.0),
            "hand": (sizes.forearm, 0.0, 0.0),
        }[part]

    def tips(self, sizes: Proportions) -> dict[str, np.ndarray]:
        """Where the last bones end, from their joint."""
        ends = {f"{side}_hand": np.array([sign(side) * sizes.hand, 0.0, 0.0]) for side in SIDES}
        if "head_top" in self.parts:
            return ends
        ends["head"] = np.array([0.0, sizes.head, 0.0])
        for side in SIDES:
            ends[f"{side}_toe"] = np.array([0.0, 0.0, sizes.toes])
        return ends


_CURVE = {"spine_2": 0.03, "spine_3": -0.02}
"""The small of the back lies forward, the upper back behind (shares of the trunk)."""


def _structure(
    name: str, chain: list[tuple[str, str, str]], bending: dict[str, float], levels: dict[str, float]
) -> Structure:
    """``chain``: joint name, part and parent's part, the root first."""
    parts = [part for _, part, _ in chain]
    return Structure(
        name=name,
        names=tuple(joint for joint, _, _ in chain),
        parts=tuple(parts),
        parents=tuple(parts.index(parent) if parent else -1 for _, _, parent in chain),
        bending=tuple(bending.items()),
        levels=tuple(levels.items()),
        silent=tuple(part for part in parts if part.endswith(("_split", "_end", "_top"))),
        collar=2 if "left_shoulder_split" in parts else 1,
    )


def _both(rows: list[tuple[str, str, str]]) -> list[tuple[str, str, str]]:
    """The rows for the left, then for the right; ``*`` stands for the side."""
    centre = ("hips", "spine_3")
    return [
        (
            joint.replace("*", side.capitalize()),
            f"{side}_{part}",
            parent if parent in centre else f"{side}_{parent}",
        )
        for side in SIDES
        for joint, part, parent in rows
    ]


BODY22 = _structure(
    "body22",
    [
        ("Hips", "hips", ""),
        *_both(
            [
                ("*UpLeg", "up_leg", "hips"),
                ("*Leg", "leg", "up_leg"),
                ("*Foot", "foot", "leg"),
                ("*Toe", "toe", "foot"),
            ]
        ),
        ("Spine", "spine_1", "hips"),
        ("Spine1", "spine_2", "spine_1"),
        ("Spine2", "spine_3", "spine_2"),
        ("Neck", "neck", "spine_3"),
        ("Head", "head", "neck"),
        *_both(
            [
                ("*Shoulder", "shoulder", "spine_3"),
                ("*Arm", "arm", "shoulder"),
                ("*ForeArm", "forearm", "arm"),
                ("*Hand", "hand", "forearm"),
            ]
        ),
    ],
    bending={"spine_1": 0.30, "spine_2": 0.35, "spine_3": 0.35},
    levels={"spine_1": 0.14, "spine_2": 0.24, "spine_3": 0.26},
)

BODY28 = _structure(
    "body28",
    [
        ("Hips", "hips", ""),
        *_both(
            [
                ("*UpLeg", "up_leg", "hips"),
                ("*Leg", "leg", "up_leg"),
                ("*Foot", "foot", "leg"),
                ("*ToeBase", "toe", "foot"),
                ("*Toe_End", "toe_end", "toe"),
            ]
        ),
        ("Spine", "spine_1", "hips"),
        ("Spine1", "spine_2", "spine_1"),
        ("Spine1_split", "spine_2_split", "spine_2"),
        ("Spine2", "spine_3", "spine_2_split"),
        ("Neck", "neck", "spine_3"),
        ("Head", "head", "neck"),
        ("HeadTop_End", "head_top", "head"),
        *_both(
            [
                ("*Shoulder", "shoulder", "spine_3"),
                ("*Shoulder_split", "shoulder_split", "shoulder"),
                ("*Arm", "arm", "shoulder_split"),
                ("*ForeArm", "forearm", "arm"),
                ("*Hand", "hand", "forearm"),
            ]
        ),
    ],
    bending={"spine_1": 0.30, "spine_2": 0.35, "spine_3": 0.35},
    levels={"spine_1": 0.14, "spine_2": 0.16, "spine_2_split": 0.16, "spine_3": 0.16},
)

STRUCTURES = {each.name: each for each in (BODY22, BODY28)}
