"""Control: gives the source back, noise and all; for source and target of one body."""

from retarget_bench.api import Context, MethodCard, Prediction
from retarget_bench.motion.character import Character


class Identity:
    """What doing nothing scores: zero where the motion itself is asked for, the noise where it is noisy.

    A method that denoises has to stay below it, and one that reconstructs cannot.
    """

    card = MethodCard(
        name="identity",
        summary="Control: gives the source back as it is",
        version="1",
        accepts=("motion", "positions"),
        control=True,
        tasks=("reconstruct", "denoise"),
    )

    def supports(self, source: Character, target: Character) -> str | None:
        if source.skeleton.same_as(target.skeleton):
            return None
        return f"gives the source back, and {target.name} has another skeleton than {source.name}"

    def retarget(self, source: Prediction, target: Character, *, context: Context) -> Prediction:
        return source


plugin = Identity
