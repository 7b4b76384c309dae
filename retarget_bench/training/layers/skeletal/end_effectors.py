"""End effectors of a structure, and the published constants of the loss on how they move."""

from collections.abc import Sequence

from retarget_bench.training.layers.skeletal.layout import Layout

NEAR = 0.008
"""Heights a frame times ``FASTER``: an end effector that is slower is taken to rest (published code)."""
FASTER, RESTING = 10.0, 100.0
"""Factors of displacements, and of the error where an end effector rests (published code)."""
FOOT = ("toe_end", "toe", "foot")
END_EFFECTORS = (
    ("head_top", "head"),
    ("left_hand",),
    ("right_hand",),
    *(tuple(f"{side}_{part}" for part in FOOT) for side in ("left", "right")),
)
"""Roles of the end effectors; of several the first that a structure has."""


def ends_of(layout: Layout) -> dict[int, int]:
    """Number of an end effector -> its joint, if that belongs to a part: others are not encoded."""
    joint_of: dict[int, int] = {}
    for number, roles in enumerate(END_EFFECTORS):
        present: Sequence[str] = [role for role in roles if role in layout.roles]
        joints = [layout.roles.index(role) for role in present]
        if joints and layout.encoded[joints[0]]:
            joint_of[number] = joints[0]
    return joint_of
