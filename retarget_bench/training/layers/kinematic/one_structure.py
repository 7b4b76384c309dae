"""Methods of one set of joints, the 22 roles, for bodies that have them or lack some."""

import numpy as np

from retarget_bench.motion.body22 import Body22
from retarget_bench.motion.character import Character
from retarget_bench.motion.structures import BODY22
from retarget_bench.training.layers.kinematic.retargeter import SightRetargeter

STRUCTURE = "body22"


class OneStructure(SightRetargeter):
    """All bodies are seen over the 22 roles, whatever their structure."""

    over_roles = True

    def body(self, character: Character) -> Body22:
        return Body22.of(character)

    def lacks(self, character: Character) -> np.ndarray:
        return self.body(character).lacks

    def roles(self, character: Character) -> tuple[str | None, ...]:
        del character  # all are seen over these
        return BODY22

    def structure(self, character: Character) -> str:
        del character
        return STRUCTURE
