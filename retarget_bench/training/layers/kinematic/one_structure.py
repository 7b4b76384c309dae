"""Methods of one set of joints, the 22 roles, for bodies that have them or lack some."""

from functools import lru_cache

import numpy as np

from retarget_bench.motion.body22 import Body22, unfit
from retarget_bench.motion.character import Character
from retarget_bench.motion.structures import BODY22
from retarget_bench.training.layers.kinematic.retargeter import SightRetargeter, common_reasons

STRUCTURE = "body22"


class OneStructure(SightRetargeter):
    """All bodies are seen over the 22 roles, whatever their structure."""

    def unfit(self, character: Character) -> str:
        return unfit(character, self.card.name) or common_reasons(character)

    def body(self, character: Character) -> Body22:
        return _body(character)

    def lacks(self, character: Character) -> np.ndarray:
        return _body(character).lacks

    def roles(self, character: Character) -> tuple[str | None, ...]:
        del character  # all are seen over these
        return BODY22

    def structure(self, character: Character) -> str:
        del character
        return STRUCTURE


@lru_cache(maxsize=1024)
def _body(character: Character) -> Body22:
    return Body22(character)
