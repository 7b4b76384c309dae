"""Everything in which the variants of PAN differ beside their networks, with the values of each."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Literal

from .design import PAPER, RELEASED, Design
from .form import Form, Yaw
from .learner import Choices
from .losses import Weights
from .windows import Statistics

Variant = Literal["own", "released", "paper"]


@dataclass(frozen=True)
class Settings:
    """See ``Design``, ``Form``, ``Weights`` and ``Choices``."""

    design: Design
    form: Form
    weights: Weights
    statistics: Statistics
    yaw: Yaw
    still: float = 0.0
    reversed_: bool = False

    @property
    def choices(self) -> Choices:
        return Choices(self.form, self.yaw, self.weights, self.statistics, self.still, self.reversed_)

    def between_legs(self) -> Settings:
        """For two legs and four (section 7): one layer, one head, no sigmoid, and eq. 20."""
        design = replace(self.design, layers=1, heads=1, dropout=0.0, interleaved=False, squashed=False)
        return replace(self, design=design, weights=replace(self.weights, velocity=1000.0))


RELEASED_WEIGHTS = Weights(
    places=100.0,
    local=True,
    root=100.0,
    latent=2.5,
    measure="l1",
    again=0.0,
    again_places=2.5,
    ends=50.0,
    judge="bones",
    pool=True,
)
SETTINGS: Mapping[Variant, Settings] = {
    "paper": Settings(PAPER, Form("velocity", "world", 0.0), Weights(), "structure", "predicted"),
    "released": Settings(
        RELEASED, Form("position", "world", 0.0), RELEASED_WEIGHTS, "character", "predicted", reversed_=True
    ),
    "own": Settings(
        replace(RELEASED, dropout=0.0),
        Form("height", "body", 0.0),
        replace(RELEASED_WEIGHTS, places=1000.0, root=20.0, again_places=100.0, adversarial=0.25),
        "structure",
        "source",
        still=0.02,
    ),
}
