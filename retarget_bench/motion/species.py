"""Sizes of animals, by the words that files are named after.

Animals stand between a few centimetres and several metres tall, so a size in a file's numbers does not show
their unit as a person's does. The name of the file, or of its folder, often says what animal it is.
"""

import math
from pathlib import Path

from retarget_bench.motion import role_aliases

STANDING: dict[str, float] = {
    animal: metres
    for metres, animals in (
        (0.08, "mouse hamster gecko"),
        (0.12, "rat lizard frog sparrow pigeon"),
        (0.2, "rabbit squirrel hedgehog crow raven parrot hawk turtle"),
        (0.35, "cat kitten chicken hen rooster duck eagle owl raccoon raptor pug dachshund"),
        (0.5, "fox turkey goose beagle corgi lynx coyote"),
        (0.7, "dog puppy wolf hyena goat sheep lamb pig boar hound leopard cheetah jaguar"),
        (1.0, "lion tiger bear panther deer donkey ibex pony flamingo kangaroo crocodile"),
        (1.4, "cow bull ox zebra buffalo elk stag bison"),
        (1.7, "horse camel rhino hippo moose ostrich polarbear"),
        (3.0, "elephant mammoth"),
        (4.0, "trex tyrannosaurus"),
        (5.0, "giraffe"),
    )
    for animal in animals.split()
}
"""Animal -> metres that an adult typically stands tall, head up; rounded, within a factor of about two."""
SMALLEST, LARGEST = 0.04, 6.0
"""Metres between which animals stand."""
_TYPICAL = 1.0
_VAGUE = 0.5
"""Weight of the distance from the typical size where the animal is not known."""
_IMPOSSIBLE = 2.0
"""Added weight of what lies beyond the smallest and the largest animals."""


def animal_of(path: Path) -> str:
    """The animal that a file's name, else its folder's, speaks of; "" where none is known."""
    for text in (path.stem, path.parent.name):
        words = role_aliases.words(text)
        animal = next((word for word in words if word in STANDING), "")
        if animal:
            return animal
    return ""


def improbable(stands: float, animal: str = "") -> float:
    """The misfit of a standing height (metres) to an animal: about the logarithm of the ratio to its
    own."""
    if animal:
        return abs(math.log(stands / STANDING[animal]))
    beyond = max(0.0, math.log(SMALLEST / stands), math.log(stands / LARGEST))
    return _VAGUE * abs(math.log(stands / _TYPICAL)) + _IMPOSSIBLE * beyond


def plausible(stands: float, animal: str = "") -> bool:
    """Whether an animal may stand so tall (metres)."""
    if animal:
        return abs(math.log(max(stands, 1e-9) / STANDING[animal])) < math.log(2.5)
    return SMALLEST <= stands <= LARGEST
