"""Control: gives the source back, noise and all; for source and target of one body."""

from retarget_bench.api import Context, Method, MethodCard, Prediction
from retarget_bench.motion import transfer
from retarget_bench.motion.character import Character


class Identity(Method):
    """The score of doing nothing: zero error for clean motion, the noise for noisy motion.

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
        return transfer.another_skeleton("gives the source back", source, target)

    def retarget(self, source: Prediction, target: Character, *, context: Context) -> Prediction:
        return source


plugin = Identity
