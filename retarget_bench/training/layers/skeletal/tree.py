"""Trees of joints as the published code of SAN and PAN has them: from where the legs begin, limb by limb.

It turns the tree of a body with a pelvis below its hips round, so that legs and spine hang from the pelvis
(``set_new_root`` of their reader), and lists joints as legs, spine, head, arms, left before right. Masks
of theirs that are wrong by one joint depend on this order.
"""

from collections.abc import Sequence

from retarget_bench.motion import roles as anatomy

ORDER = ("left_leg", "right_leg", "trunk", "head", "left_arm", "right_arm")
"""The order of limbs; what else there is comes last."""


def rerooted(parents: Sequence[int], roles: Sequence[str | None]) -> tuple[list[int], list[int]]:
    """Parents in the new order, the root (-1) first, and which joint of the old order each is.

    parents: ``(joints,)``, the hips (-1) first. roles: of the joints.
    """
    beside: list[list[int]] = [[] for _ in parents]
    for joint, parent in enumerate(parents):
        if parent >= 0:
            beside[joint].append(parent)
            beside[parent].append(joint)
    above: dict[int, int] = {}
    order: list[int] = []
    rest = [where_legs_begin(parents, roles)]
    while rest:
        joint = rest.pop()
        order.append(joint)
        below = [each for each in beside[joint] if each != above.get(joint)]
        above |= dict.fromkeys(below, joint)
        rest += sorted(below, key=lambda each: (_limb(each, joint, beside, roles), each), reverse=True)
    place = {joint: rank for rank, joint in enumerate(order)}
    return [place[above[joint]] if joint in above else -1 for joint in order], order


def where_legs_begin(parents: Sequence[int], roles: Sequence[str | None]) -> int:
    """The lowest joint that both legs hang from; the first one where there are not two legs."""
    lines = []
    for side in anatomy.SIDES:
        leg = [joint for joint, role in enumerate(roles) if role == f"{side}_up_leg"]
        line = leg[:1]
        while line and parents[line[-1]] >= 0:
            line.append(parents[line[-1]])
        lines.append(line[1:])
    both = [joint for joint in lines[0] if joint in lines[1]]
    return both[0] if both else 0


def _limb(joint: int, parent: int, beside: Sequence[Sequence[int]], roles: Sequence[str | None]) -> int:
    """The limb that a joint is of: its own, or the first of what hangs from it."""
    role = roles[joint]
    if role is not None:
        part = anatomy.body_part(role)
        return ORDER.index(part) if part in ORDER else len(ORDER)
    below = (each for each in beside[joint] if each != parent)
    return min((_limb(each, joint, beside, roles) for each in below), default=len(ORDER))
