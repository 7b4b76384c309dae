"""Copies joint orientations relative to a common reference pose and scales the root path by one ratio."""

from retarget_bench.api import Context, Method, MethodCard, Prediction
from retarget_bench.errors import NotSupported
from retarget_bench.motion import root_rules, transfer
from retarget_bench.motion.character import Character, Motion


class CopyRotations(Method):
    """Plain retargeting as in animation tools: the line that a method has to beat.

    Every joint of the target takes the world orientation of its counterpart, relative to the reference
    pose (T-pose) of both, so rest poses may differ; spines of different counts share the bend. Feet are
    not held and hands are not kept.

    root_rule: one of ``root_rules.ROOT_RULES``. The default, ``hip_height``, puts the soles of a standing
    target on the floor; on Mixamo's and the puppets' pairs it is the best rule or within 0.2 % of height of
    it. ``reference`` takes the right answer's own root path, an upper bound that is marked privileged.
    """

    def __init__(self, root_rule: root_rules.RootRule = "hip_height") -> None:
        self.root_rule = root_rules.check(root_rule)
        self.card = MethodCard(
            name="copy_rotations",
            summary="Joint orientations copied relative to the T-pose, root path scaled by one ratio",
            version="1",
            differs={"root_rule": f"root rule {root_rule}"},
            needs=("reference",) if root_rule == "reference" else (),
            variants=({"root_rule": "none"}, {"root_rule": "reference"}),
            parameters={"root_rule": "length whose ratio scales the root path"},
        )

    def supports(self, source: Character, target: Character) -> str | None:
        return transfer.reason(source, target) or root_rules.reason(self.root_rule, source, target)

    def retarget(self, source: Prediction, target: Character, *, context: Context) -> Motion:
        if not isinstance(source, Motion):
            raise NotSupported("copy_rotations needs a source with rotations, not positions only")
        return transfer.carry(source, target, self.root_rule, context.reference)


plugin = CopyRotations
