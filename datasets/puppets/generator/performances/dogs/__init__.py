"""Kinds of performance on four legs."""

from collections.abc import Callable, Mapping
from functools import partial

from ...randomness import Stream
from ..score import DogScore
from .gaits import GALLOP, TROT, WALK, go
from .resting import shake_paw, sit_or_lie, stand, turn
from .sequencing import sequence

KINDS: Mapping[str, Callable[[Stream, int], DogScore]] = {
    **{gait.kind: partial(go, gait=gait) for gait in (WALK, TROT, GALLOP)},
    "dog_stand": stand,
    "dog_turn": turn,
    **{kind: partial(sit_or_lie, kind=kind) for kind in ("dog_sit", "dog_lie")},
    "shake_paw": shake_paw,
    "dog_sequence": sequence,
}
"""Kind -> the function that draws one performance of so many frames."""
