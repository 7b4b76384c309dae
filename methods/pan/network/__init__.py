"""PAN's networks: encoders of motion and skeletons, decoder, discriminator.

Weights that a mask would blot out do not exist: what differs in size between parts is stored end to end.
"""

from .decoder import Decoder
from .discriminator import Discriminator
from .encoder import Encoder, SkeletonEncoder

__all__ = ["Decoder", "Discriminator", "Encoder", "SkeletonEncoder"]
