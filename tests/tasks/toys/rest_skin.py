"""A toy that answers points with the target's resting skin, moved along with them."""

from retarget_bench.api import MethodCard


class RestSkin:
    """The target's skin at rest, in the middle of the points."""

    card = MethodCard(name="rest_skin", summary="Resting skin", version="1", accepts=("points",))

    def supports(self, source, target):
        assert source.roles == (None,), "nothing is known of the source's body"
        return None if target.mesh is not None else f"{target.name} has no mesh"

    def retarget(self, source, target, *, context):
        still = target.mesh.vertices - target.mesh.vertices.mean(axis=0)
        return target.surface(source.root[:, None] + still, source.fps)


plugin = RestSkin
