"""PAN's networks: motion to codes of body parts, bodies to codes, codes to motion, and the discriminator of motion.

Weights that a mask would blot out do not exist: what differs in size between parts is stored end to end.
"""

from .decoder import Decoder
from .discriminator import Discriminator
from .encoder import Encoder
from .encoder import SkeletonEncoder

__all__ = ["Decoder", "Discriminator", "Encoder", "SkeletonEncoder"]
