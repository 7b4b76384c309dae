"""Control: a second answer that is as right as the reference (how far two right answers lie apart)."""

from retarget_bench.api import Context, Method, MethodCard, Prediction
from retarget_bench.errors import NotSupported
from retarget_bench.motion.character import Character


class AmbiguityFloor(Method):
    """The same performance by the same body in another manner, where the data set has one.

    A body that does the same steps and touches may turn its knees and elbows, bend its spine and keep its
    balance in other ways. Errors against the reference below those of this row say nothing.
    """

    card = MethodCard(
        name="ambiguity_floor",
        title="second right answer",
        summary="Control: a second right answer: MPJPE below its own tells nothing more",
        version="1",
        accepts=("motion", "positions"),
        needs=("second_reference",),
        control=True,
    )

    def supports(self, source: Character, target: Character) -> str | None:
        return None

    def retarget(self, source: Prediction, target: Character, *, context: Context) -> Prediction:
        if context.second_reference is None:
            raise NotSupported("this case has no second right answer")
        return context.second_reference


plugin = AmbiguityFloor
