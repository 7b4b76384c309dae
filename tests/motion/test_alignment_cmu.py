"""The same CMU takes on CMU's own T-pose skeleton and on a rig whose bones all lie along +Y."""

from __future__ import annotations

import numpy as np
import pytest

from retarget_bench.motion import bvh, importer, rotation
from retarget_bench.motion.character import Character
from retarget_bench.motion.transfer import from_relative, orientations, relative

LIMITS = {
    "hips": 2.0,
    "head": 2.0,
    **{f"{side}_{part}": 4.0 for side in ("left", "right") for part in ("arm", "forearm", "up_leg", "leg")},
    **{f"{side}_foot": 12.0 for side in ("left", "right")},
}
"""Degrees, mean over time. Whoever made the copy gave it that rig's own back, collar bones and wrists."""


@pytest.mark.parametrize("take", ["01", "02", "03"])
def test_orientations_agree_between_the_rigs(real_data, take):
    folder = real_data / "cmu_asfamc"
    every_second = importer.load(folder / f"02_{take}.amc").motion.at(slice(None, None, 2))
    cmu = every_second.character
    copy = bvh.read(real_data / f"cmu_iclone/002_{take}.bvh", scale=0.01)
    iclone = Character.of("iclone", copy.skeleton, sample=copy.rotations)
    count = min(every_second.frames, len(copy.rotations))
    moving = every_second.at(slice(0, count))
    own = relative(moving)
    reference = relative(iclone.motion(copy.rotations[:count], copy.root[:count], 60.0))
    for role, limit in LIMITS.items():
        apart = rotation.angle(own[:, cmu.joint_of[role]], reference[:, iclone.joint_of[role]])
        assert np.degrees(apart).mean() < limit, role
    carried = iclone.motion(from_relative(iclone, orientations(moving, iclone)), copy.root[:count], 60.0)
    again = iclone.motion(copy.rotations[:count], copy.root[:count], 60.0)
    for role in ("left_arm", "right_leg"):
        joint = iclone.joint_of[role]
        apart = rotation.angle(carried.global_rotations[:, joint], again.global_rotations[:, joint])
        assert np.degrees(apart).mean() < LIMITS[role], role
