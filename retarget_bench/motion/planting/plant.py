"""Plants the feet of a pose on its way from one body to another."""

from retarget_bench.motion.character import Character
from retarget_bench.motion.planting import feet
from retarget_bench.motion.planting.two_bone import LEG, Limb, bend, ease_reach, rig_of
from retarget_bench.motion.roles import SIDES


def no_legs(body: Character) -> str | None:
    """The reason why its feet cannot be planted; None where they can."""
    limbs = rig_of(body).limbs
    if all((side, "leg") in limbs for side in SIDES):
        return None
    return f"{body.name} has no two legs of upper leg, leg and foot to plant"


def limbs(exchange: feet.Exchange, kind: str) -> list[tuple[Limb, Limb]]:
    """The left and right ``leg`` or ``arm`` on the source and on the target, where both have them."""
    on_source, on_target = exchange.source_rig.limbs, exchange.target_rig.limbs
    return [
        (on_source[side, kind], on_target[side, kind])
        for side in SIDES
        if (side, kind) in on_source.keys() & on_target
    ]


def plant(exchange: feet.Exchange) -> None:
    """Hold the feet, in place; the pose's places and orientations are up to date afterwards."""
    pose, body = exchange.pose, exchange.target_rig.character
    kinds = ("leg", "arm") if exchange.four_legged else ("leg",)
    legs = [pair for kind in kinds for pair in limbs(exchange, kind)]
    plans = [feet.plan(exchange, *pair) for pair in legs]
    target_legs = [leg for _, leg in legs]
    pose.shift(feet.settle(pose, target_legs, plans, exchange.source.fps))
    pose.shift(feet.give(pose, target_legs, plans, exchange.source.fps))
    for leg, each in zip(target_legs, plans, strict=True):
        goal = ease_reach(pose, leg, each.goal, LEG)
        bend(body, pose, leg, goal, each.orientation, exchange.source.fps)
    pose.stand(body)
