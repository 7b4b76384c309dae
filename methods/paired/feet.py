"""Feet held where the source's feet rest, at the height that the source's soles have."""

from dataclasses import replace

import numpy as np
import torch

from retarget_bench.motion import root_rules, rotation
from retarget_bench.motion.motion import Motion
from retarget_bench.motion.planting.ease import spread
from retarget_bench.motion.planting.feet import Exchange, held, hold, planted, walked
from retarget_bench.motion.planting.two_bone import Pose, rig_of
from retarget_bench.motion.roles import SIDES

from .pose import TOES, Goals


def planted_goals(goals: Goals, source: Motion, copied: Motion, offsets: np.ndarray) -> Goals:
    """Goals whose feet rest at one place as long as the source's do.

    The places are the goals' own, level; their heights are those of ``ik``. offsets: ``(22, 3)`` metres.
    """
    pose = Pose(copied.rotations, copied.root, copied.positions, copied.global_rotations)
    ratios = root_rules.ratios("hip_height", source.character, copied.character)
    exchange = Exchange(source, rig_of(source.character), rig_of(copied.character), pose, ratios)
    paths, ends = goals.feet[0].numpy().copy(), goals.ends[0].numpy().copy()
    for number, (side, toe) in enumerate(zip(SIDES, TOES, strict=True)):
        source_leg, target_leg = (
            exchange.source_rig.limbs[side, "leg"],
            exchange.target_rig.limbs[side, "leg"],
        )
        path, turned = paths[:, number].copy(), ends[:, number]
        still, stand = planted(source, source_leg.end), path.copy()
        if target_leg.tip < 0 or source_leg.tip < 0:
            stand[:, 1] = walked(exchange, source_leg.end, target_leg.end)[:, 1]
            paths[:, number] = path + spread(held(stand, still) - path, still, source.fps)
            continue
        sole = rotation.rotate(turned, np.broadcast_to(offsets[toe].astype(float), path.shape))
        stand[:, 1] = walked(exchange, source_leg.tip, target_leg.tip)[:, 1] - sole[:, 1]
        plan = hold(path, stand, sole, turned, (still, planted(source, source_leg.tip)), source.fps)
        paths[:, number], ends[:, number] = plan.goal, plan.orientation
    return replace(goals, feet=torch.from_numpy(paths)[None], ends=torch.from_numpy(ends)[None])
