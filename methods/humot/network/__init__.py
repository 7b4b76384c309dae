"""HuMoT's networks: motion to a code that is independent of the body, and back for any template."""

from collections.abc import Mapping

from torch import Tensor, nn

from retarget_bench.errors import BenchError
from retarget_bench.training.contract import Batch

from ..design import Design
from .decoder import Decoder
from .encoder import Encoder


class Autoencoder(nn.Module):
    """Encoder and decoder, for all structures."""

    def __init__(self, design: Design) -> None:
        super().__init__()
        self.encoder, self.decoder = Encoder(design), Decoder(design)

    def forward(self, given: Batch, asked: Batch, frames: Tensor) -> Tensor:
        """``(rows, frames, joints asked, 3)`` metres. given, asked: see ``HumotTraining.draw``."""
        code = self.encoder(given["places"], given["template"], given["joints"], frames)
        answer: Tensor = self.decoder(code, asked["template"], asked["joints"], frames)
        return answer

    def load(self, tensors: Mapping[str, Tensor]) -> None:
        """Take over weights. Raises BenchError where they do not fit."""
        device = next(self.parameters()).device
        try:
            self.load_state_dict({name: each.to(device) for name, each in tensors.items()})
        except RuntimeError as error:
            raise BenchError(f"these weights do not fit humot's networks: {error}") from None


__all__ = ["Autoencoder", "Decoder", "Encoder"]
