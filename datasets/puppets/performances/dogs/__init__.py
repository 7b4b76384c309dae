"""Kinds of performance on four legs."""

from collections.abc import Callable, Mapping

from ...randomness import Stream
from ..score import DogScore
from .gaits import gallop, trot, walk
from .resting import lie, shake_paw, sit, stand, turn
from .sequencing import sequence

KINDS: Mapping[str, Callable[[Stream, int], DogScore]] = {
    "dog_walk": walk,
    "trot": trot,
    "gallop": gallop,
    "dog_stand": stand,
    "dog_turn": turn,
    "dog_sit": sit,
    "dog_lie": lie,
    "shake_paw": shake_paw,
    "dog_sequence": sequence,
}
"""Kind -> the function that draws one performance of so many frames."""
