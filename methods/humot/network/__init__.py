"""HuMoT's networks: motion of any body to a code without a body, and with another body's template back."""

from .decoder import Decoder
from .encoder import Encoder

__all__ = ["Decoder", "Encoder"]
