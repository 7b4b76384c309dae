"""Everything in which the variants of PAN differ beside their networks, with the values of each."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, Final, Literal

from retarget_bench.errors import BenchError

from .design import PAPER, RELEASED, RELEASED_THREE, Design
from .form import Form, Yaw
from .losses import Weights
from .objective import Choices
from .windows import Statistics

Variant = Literal["own", "released", "paper"]
AS: Final = ""
"""A choice that the variant makes."""
VARIANT: Final = -1.0
"""A number that the variant sets."""


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
    alike: bool = False

    @property
    def choices(self) -> Choices:
        return Choices(
            self.form, self.yaw, self.weights, self.statistics, self.still, self.reversed_, self.alike
        )

    def but(
        self,
        *,
        form: Mapping[str, Any],
        design: Mapping[str, Any],
        weights: Mapping[str, float],
        others: Mapping[str, Any],
    ) -> Settings:
        """With what is given, by names of fields; an empty word or a negative number leaves a field as it
        is. Raises BenchError where a number is not one, or fields do not go together."""
        if not all(math.isfinite(number) for number in (*weights.values(), form["smoothing"])):
            raise BenchError("weights and facing of pan are finite numbers")
        numbers = _given(weights)
        places = numbers.pop("places", None)
        weighed = self.weights if places is None else self.weights.kinematic(places)
        found = replace(
            self,
            form=replace(self.form, **_given(form)),
            design=replace(self.design, **_given(design)),
            weights=replace(weighed, **numbers),
            **_given(others),
        )
        found.check()
        return found

    def check(self) -> None:
        """Raises BenchError where fields do not go together."""
        if not self.design.dropout < 1.0:
            raise BenchError("dropout of pan is a share below 1")
        if self.weights.velocity and self.form.root == "position":
            raise BenchError(
                "eq. 20 (velocity) is about how hips move, and root=position does not say it; "
                "use root=velocity or root=height"
            )


def _given(values: Mapping[str, Any]) -> dict[str, Any]:
    """Without what the variant decides."""
    return {
        name: value
        for name, value in values.items()
        if value != AS and not (isinstance(value, float | int) and value < 0.0)
    }


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
        Form("height", "body", 0.0, "carried"),
        replace(RELEASED_WEIGHTS, places=1000.0, root=300.0, again_places=100.0, adversarial=0.25),
        "structure",
        "source",
        still=0.02,
        alike=True,
    ),
}
BETWEEN_LEGS: Mapping[Variant, Settings] = {
    "paper": replace(SETTINGS["paper"], weights=Weights(velocity=1000.0, turns=False)),
    "released": Settings(
        RELEASED_THREE,
        Form("velocity", "world", 8.0),
        Weights(
            moves=100.0,
            places=0.01,
            lengths="units",
            latent=1e-3,
            again=0.0,
            again_places=1e-3,
            judge="places",
            velocity=1000.0,
        ),
        "structure",
        "source",
    ),
    "own": replace(
        SETTINGS["own"],
        design=RELEASED_THREE,
        form=replace(SETTINGS["own"].form, path="decoded"),
        weights=replace(SETTINGS["own"].weights, ends=0.0, adversarial=1.0, velocity=1000.0),
    ),
}
"""For two legs and four (section 7). ``paper``: eq. 14 as it is, and eq. 20. ``released``: lengths in
centimetres; directions are averaged over 8 frames, which the code does for dogs alone. ``own``: feet of two
legs and of four need not move alike, and eq. 20 asks for another path than the source's."""
