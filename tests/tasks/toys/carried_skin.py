"""A toy that sees the motion that points are of, and answers with a skin."""

from retarget_bench.api import MethodCard
from retarget_bench.motion.transfer import carry, reason


class CarriedSkin:
    """Rotations carried over, then skinned."""

    card = MethodCard(
        name="carried_skin",
        summary="Copied rotations, skinned",
        version="1",
        accepts=("motion", "points"),
        needs=("source_motion",),
    )

    def supports(self, source, target):
        return reason(source, target)

    def retarget(self, source, target, *, context):
        moved = carry(context.source_motion, target, "hip_height")
        return target.surface(target.mesh.skinned(moved), source.fps)


plugin = CarriedSkin
