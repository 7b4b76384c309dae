"""Copied rotations and the target's own skin, where the source is known by points; sees the true motion."""

from typing import Any

from retarget_bench.api import Context, Method, MethodCard
from retarget_bench.errors import NotSupported
from retarget_bench.motion import root_rules, transfer
from retarget_bench.motion.character import Character, Motion


class SkinnedCopy(Method):
    """Copied rotations on a mesh whose skeleton and exact skinning weights are known.

    The motion that the source's points were drawn from is privileged: with it nothing has to be estimated
    from points. So the error that is left is that of copying, and what a method of points does worse comes
    from what it estimates. The answer is a motion; its vertices are those of the target's mesh under it
    (linear blend skinning).

    root_rule: one of ``root_rules.SCALING_RULES``.
    """

    def __init__(self, root_rule: root_rules.ScalingRule = "hip_height") -> None:
        self.root_rule = root_rules.check(root_rule, root_rules.SCALING_RULES)
        self.card = MethodCard(
            name="skinned_copy",
            summary="Privileged: the rotations under the source's points copied, with exact skinning",
            version="1",
            accepts=("points", "motion"),
            needs=("source_motion",),
            tasks=("points",),
            parameters={"root_rule": "length whose ratio scales the root path"},
        )

    def supports(self, source: Character, target: Character) -> str | None:
        if target.skin is None:
            return f"{target.name} has no mesh to skin"
        return transfer.reason(source, target) or root_rules.reason(self.root_rule, source, target)

    def retarget(self, source: Any, target: Character, *, context: Context) -> Motion:
        """The copy of ``context.source_motion``; of ``source`` nothing but that it is there is used."""
        if context.source_motion is None:
            raise NotSupported("skinned_copy needs the motion that the source's points are of")
        return transfer.carry(context.source_motion, target, self.root_rule)


plugin = SkinnedCopy
