"""Dogs: what a performance asks of a body on four legs, and its poses.

Paws follow their contacts. The line from the hip joints to the shoulder joints goes where the score has it,
no higher than the paws allow; the back bends evenly about that line. Blades swing with the fore legs, and
all four legs are two bones each whose planes follow rump and chest: stifles bend forward, elbows back.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache

import numpy as np

from retarget_bench.motion import rotation

from ...contract import SECOND, USUAL, Manner
from ..bodies.dogs import TAIL_DOWN
from ..bodies.structures import Body
from ..conventions import SIDES, across, along, sign
from ..curves import lower_envelope, soft_min
from ..matrices import about, from_vector, length, part_way, rotated, unit
from ..performances.score import LIMBS, DogScore
from .limbs import Limb, X, Y, bend
from .paws import PARTS, THICK, ends, paw_path, sizes_of
from .pose import Pose


@dataclass(frozen=True)
class DogManner:
    """A dog's way to do what the score leaves open. Another manner is another right answer.

    knees, elbows: turned outward, radians. front: share of the back's bend moved from its hind to its fore
    half. blades: share of a fore leg's swing that the blade makes.
    """

    knees: float = 0.05
    elbows: float = 0.05
    front: float = 0.0
    blades: float = 0.55


MANNERS: Mapping[Manner, DogManner] = {
    USUAL: DogManner(),
    SECOND: DogManner(knees=0.20, elbows=0.18, front=0.25, blades=0.38),
}


class Dog:
    """The demands of a score on a body, computed once, and how far both ends of the trunk are lowered."""

    passes = 5

    def __init__(self, score: DogScore, body: Body, manner: DogManner) -> None:
        self.score, self.body, self.manner, self.sizes = score, body, manner, sizes_of(body)
        self.ends = ends(score, body)
        self.paths = {limb: paw_path(score.paws[limb], limb, body, self.ends) for limb in LIMBS}
        self.lowered = {end: np.zeros(score.frames) for end in PARTS}

    def pose(self) -> Pose:
        """The pose with its ends lowered so far."""
        pose = Pose(self.body, self.score.frames)
        self._set_trunk(pose)
        self._set_head_and_tail(pose)
        for end in PARTS:
            self._set_legs(pose, end)
        return pose

    def adjust(self, pose: Pose) -> None:
        """Lower rump and shoulders that are too high in a pose for the paws to stay down."""
        for end, (top, _, _) in PARTS.items():
            over = np.zeros(self.score.frames)
            reach = 0.955 * limb_of(self.body, end).longest
            for side in SIDES:
                path = self.paths[f"{side}_{end}"]
                apart = pose.at(f"{side}_{top}") - path.joint
                flat = (apart[:, [0, 2]] ** 2).sum(axis=-1)
                rise = np.sqrt(np.maximum(reach * reach - flat, 0.04 * reach * reach))
                over = np.maximum(over, np.where(path.down, apart[:, 1] - rise, 0.0))
            self.lowered[end] = self.lowered[end] - lower_envelope(-over, 4)

    def _set_trunk(self, pose: Pose) -> None:
        body, trunk = self.body, self.score.trunk
        rear, fore = self._place("hind"), self._place("fore")
        line = unit(fore - rear)
        to_hips = _middle(body, "up_leg", "hips")
        drawn = _middle(body, "arm", "hips") - to_hips
        slope = np.arcsin(line[:, 1]) - float(np.arctan2(drawn[1], drawn[2]))
        base = about(1, np.arctan2(line[:, 0], line[:, 2])) @ about(0, -slope)
        turn, arch, roll = trunk.chest.T
        bend = np.stack([arch, turn, -roll], axis=-1)
        base = base @ from_vector(-0.5 * bend)
        hips = base @ from_vector(trunk.pelvis[:, [1, 0, 2]] * [1.0, 1.0, -1.0])
        # where the shoulder joints come to lie, blades at rest on the chest, says how far all must turn
        pose.set("hips", hips)
        pose.bend_spine(base, bend, -0.5 * self.manner.front)
        chest = pose.at("spine_2") + pose.of("spine_2") @ _middle(body, "arm", "spine_2")
        current = chest - hips @ to_hips
        back = rotation.to_matrix(rotation.between(current, line))
        place = rear + self.score.anchor[:, None] * (fore - rotated(back, current) - rear)
        pose.positions[0] = place - back @ hips @ to_hips
        pose.set("hips", back @ hips)
        pose.bend_spine(back @ base, bend, -0.5 * self.manner.front)
        pose.set_both("shoulder", [pose.of("spine_2")] * 2)

    def _place(self, end: str) -> np.ndarray:
        """``(frames, 3)`` metres: where one end of the trunk should be."""
        score, ground = self.score, self.ends[end]
        left, ahead = score.sway[:, :1], score.sway[:, 1:]
        sway = self.sizes.leg * (left * across(score.heading) + ahead * along(score.heading))
        x, z = (ground.floor + sway).T
        return np.stack([x, ground.height - self.lowered[end], z], axis=-1)

    def _set_head_and_tail(self, pose: Pose) -> None:
        score, sizes, ahead = self.score, self.sizes, self.ends["fore"].heading
        turn, down, left = score.trunk.gaze.T
        neck = about(1, ahead + 0.45 * turn) @ about(0, score.neck + 0.2 * down)
        pose.set("neck", part_way(pose.of("spine_2"), neck, np.array(0.8)))
        pose.set("head", about(1, ahead + turn) @ about(0, down) @ about(2, -left))
        behind = self.ends["hind"].heading
        for part, (raised, aside) in (("tail_1", score.tail[:, :2].T), ("tail_2", score.tail[:, 2:].T)):
            # it hangs from the rump, but not lower than the floor allows, with a round corner
            room = (pose.at(part)[:, 1] - 0.5 * THICK * sizes.leg) / (0.5 * sizes.tail)
            lowest = np.arcsin(0.95 * np.tanh(np.maximum(room, 0.0) / 0.95))
            down = soft_min(TAIL_DOWN - raised, lowest, np.sqrt(0.02))
            pose.set(part, about(1, behind + aside) @ about(0, TAIL_DOWN - down))

    def _set_legs(self, pose: Pose, end: str) -> None:
        """Both legs of an end: upper and lower bones, and paws; of fore legs, the blades before."""
        score, manner, (top, middle, last), hind = self.score, self.manner, PARTS[end], end == "hind"
        paths = [self.paths[f"{side}_{end}"] for side in SIDES]
        airs = [score.paws[f"{side}_{end}"].air for side in SIDES]
        goal, base = np.stack([path.joint for path in paths]), pose.of("hips" if hind else "spine_2")
        for k, side in enumerate(SIDES):
            if air := airs[k]:
                reach = air.reach * self.sizes.fore_leg * [sign(side), 1.0, 1.0]
                held = pose.at(f"{side}_{top}") + rotated(about(1, score.heading), reach)
                goal[k] += air.weight[:, None] * (held - goal[k])
        if not hind:
            # a blade turns about its top as the leg below it swings
            below = rotated(np.swapaxes(base, -1, -2), goal - pose.both("shoulder"))
            drawn = self.body.reach("left_hand", "left_shoulder")
            swung = np.arctan2(below[..., 2], -below[..., 1]) - float(np.arctan2(drawn[2], -drawn[1]))
            pose.set_both("shoulder", base @ about(0, -0.7 * np.tanh(manner.blades * swung / 0.7)))
        outward = manner.knees + score.spread[:, 0] if hind else -manner.elbows - score.spread[:, 1]
        swivel = np.stack([sign(side) * outward for side in SIDES])
        upper, lower = bend((limb_of(self.body, end),) * 2, pose.both(top), goal, base, swivel)
        pose.set_both(top, upper)
        pose.set_both(middle, lower)
        for k, side in enumerate(SIDES):
            paw = paths[k].orientation
            if air := airs[k]:
                paw = part_way(paw, lower[k] @ about(0, np.array(0.5)), air.weight)
            pose.set(f"{side}_{last}", paw)


def _middle(body: Body, part: str, ancestor: str) -> np.ndarray:
    """``(3,)`` from a joint to between a pair of joints, standing."""
    return 0.5 * (body.reach(f"left_{part}", ancestor) + body.reach(f"right_{part}", ancestor))


@cache
def limb_of(body: Body, end: str) -> Limb:
    """The upper two bones of either leg; elbows point back, stifles forward."""
    joints = [body.part[f"left_{part}"] for part in PARTS[end][1:]]
    bones = body.offsets[joints]
    (upper, lower), hinge = length(bones).tolist(), X if end == "hind" else -X
    return Limb(
        unit(bones),
        np.stack([hinge, hinge]),
        upper,
        lower,
        ease=-Y,
        natural=hinge,
        tightest=np.radians(24.0),
        exact=0.97,
    )
