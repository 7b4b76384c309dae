"""Control: the right answer, written and read again like any prediction (the noise floor)."""

from retarget_bench.api import Context, Method, MethodCard, Prediction
from retarget_bench.errors import NotSupported
from retarget_bench.motion.character import Character


class Reference(Method):
    """The upper bound: what a perfect method would score, rounding in files included."""

    card = MethodCard(
        name="reference",
        summary="Control: the right answer itself",
        version="1",
        accepts=("motion", "positions", "points"),
        needs=("reference",),
        control=True,
    )

    def supports(self, source: Character, target: Character) -> str | None:
        return None

    def retarget(self, source: Prediction, target: Character, *, context: Context) -> Prediction:
        if context.reference is None:
            raise NotSupported("this case has no reference motion to hand back")
        return context.reference


plugin = Reference
