"""Copies rotations, then plants the feet and keeps hand contacts by inverse kinematics."""

from dataclasses import replace

import numpy as np

from retarget_bench.api import Context, Method, MethodCard, Prediction
from retarget_bench.errors import NotSupported
from retarget_bench.motion import root_rules, transfer
from retarget_bench.motion.character import Character, Motion
from retarget_bench.motion.planting import feet
from retarget_bench.motion.planting.cuts import joined, takes
from retarget_bench.motion.planting.plant import limbs, no_legs, plant
from retarget_bench.motion.planting.two_bone import Pose, bend, ease_reach, rig_of

from . import hands, head


class InverseKinematics(Method):
    """Copied rotations with the contacts repaired, as an artist does after copying.

    1. Rotations are copied (see ``copy_rotations``) and the root path is scaled by ``root_rule``.
    2. Feet near the floor follow the source's own path, scaled like the root path, at the target's stance
       width. Ankles and toes that the source holds still (slower than 0.003 heights per frame at 30 fps)
       are held at one place; corrections are eased in and out over a third of a second, and from step to
       step over the swing.
    3. The hips take half of the height that the planted feet ask for together; where a planted foot would
       stretch its leg beyond 97 % of its length, and further than copied, they move towards it, smoothly.
    4. Legs bend in closed form, in the plane they are in, and are never stretched to the full; feet keep
       their copied orientation but for the turn that holds both ankle and toe.
    5. Where that brings the head far below the floor, the back is raised.
    6. Hands near the other hand, the own body or the floor keep that contact, likewise with the arms.

    What 4 to 6 change is slowed down where a joint would turn faster than 1.4 times its greatest copied
    speed. Cuts divide the motion: no correction is eased over them.

    Four-legged bodies among themselves are held by all four feet. No training, no optimisation.
    """

    def __init__(
        self,
        root_rule: root_rules.ScalingRule = "hip_height",
        feet: bool = True,
        hands: bool = True,
        floor: bool = False,
    ) -> None:
        self.root_rule = root_rules.check(root_rule, root_rules.SCALING_RULES)
        self.feet, self.hands, self.floor = feet, hands, floor
        self.card = MethodCard(
            name="ik",
            title="IK",
            summary="Copied rotations with planted feet and kept hand contacts, by two-bone IK",
            version="2",
            parameters={
                "root_rule": "length whose ratio scales the root path: "
                + ", ".join(root_rules.SCALING_RULES),
                "feet": "hold ankles and toes where the source holds them (true, false)",
                "hands": "keep hands that touch hands, the body or the floor (true, false)",
                "floor": "stand on the floor where the source's feet stand above or below it by much the "
                "same throughout (true, false)",
            },
        )

    def supports(self, source: Character, target: Character) -> str | None:
        if why := transfer.reason(source, target) or root_rules.reason(self.root_rule, source, target):
            return why
        return no_legs(source) or no_legs(target)

    def retarget(self, source: Prediction, target: Character, *, context: Context) -> Motion:
        if not isinstance(source, Motion):
            raise NotSupported("ik needs a source with rotations, not positions only")
        motion = feet.grounded(source) if self.floor else source
        cuts = takes(replace(motion))  # a copy's, so that its places are let go
        rotations, root = joined(self._piece(motion.at(piece), target) for piece in cuts)
        return target.motion(rotations, root, source.fps)

    def _piece(self, source: Motion, target: Character) -> tuple[np.ndarray, np.ndarray]:
        """Rotations and root path for a source without cuts."""
        pose = Pose.of(transfer.carry(source, target, self.root_rule))
        ratios = root_rules.ratios(self.root_rule, source.character, target)
        exchange = feet.Exchange(source, rig_of(source.character), rig_of(target), pose, ratios)
        if self.feet:
            plant(exchange)
            head.lift(exchange)
        if self.hands and not exchange.four_legged:
            _touch(exchange)
        return pose.rotations, pose.root


def _touch(exchange: feet.Exchange) -> None:
    """Keep what the hands touch, in place."""
    pose, body = exchange.pose, exchange.target_rig.character
    arms = limbs(exchange, "arm")
    lengths = (each.measures.arm_length for each in (exchange.source.character, body))
    if len(arms) < 2 or not all(lengths):
        return
    for (source_arm, target_arm), move in zip(arms, hands.touches(exchange, arms), strict=True):
        move = hands.lean(exchange, source_arm, target_arm, move)
        if np.abs(move).max() > 1e-9:
            goal = ease_reach(pose, target_arm, pose.places[:, target_arm.end] + move)
            bend(body, pose, target_arm, goal, pose.turned[:, target_arm.end], exchange.source.fps)


plugin = InverseKinematics
