"""The record of a training, declared once: what was asked for, what it saw, how far it is, on what machine.

A run keeps it in its folder (``run_folder.py``), and the card of weights (``weights.py``) is the record as
it was when they were written. What an older file lacks has its default here.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from typing import Annotated

from pydantic import Field

from retarget_bench import defaults
from retarget_bench.plugins import registry
from retarget_bench.plugins.spec import Scalar
from retarget_bench.training.config import Budget, TrainingConfig
from retarget_bench.training.tensor_files import Hashed

DECISIVE = defaults.VALIDATION[1][0]
"""The value that weights are chosen by."""
PARTS = (
    "the training motion, and for validation the cases that the data keep for that; a part 'test' in "
    "content names the cases that they offer for tests, which were not used"
)

Finite = Annotated[float, Field(allow_inf_nan=False)]
OfCases = Annotated[Mapping[str, float], Field(min_length=1)]
Scores = Annotated[Mapping[str, OfCases], Field(min_length=1)]
"""Split -> value id -> mean over its cases, and ``n`` -> how many gave an answer."""


def error(scores: Scores) -> float:
    """The decisive value, as mean over splits; infinite where one of them lacks it."""
    return sum(values.get(DECISIVE, math.inf) for values in scores.values()) / len(scores)


@dataclass(frozen=True)
class Validation:
    """One validation: the step after which it was, the seconds until then, and what was measured."""

    step: int
    seconds: Finite
    scores: Scores


@dataclass(frozen=True)
class TrainedOn:
    """Training data. spec: without where files lie. content: of the data set, ``parts`` says what of it was
    used. motion: hash of the motion that was gathered; "": not known. hours: of motion."""

    spec: str = ""
    label: str = ""
    parts: str = PARTS
    content: str = ""
    motion: str = ""
    clips: int = 0
    hours: Finite = 0.0


@dataclass(frozen=True, kw_only=True)
class Record(Hashed):
    """A training.

    method, version, facts: what the weights fit: the method's name and version, and ``Trainable.facts()``.
    recipe:       of the preset, with the budget's steps. budget: "": the preset's steps.
    command:      that asks for this, without places of files. init: hash of the weights that it began with.
    earlier:      frames of the windows that training had drawn for those; uncounted: some were not counted.
    scored_as:    the method with all its parameters but its weights, as validation measures it.
    steps:        done, in ``seconds``. step: that of the weights kept; 0: validation chose none.
    processes:    that train together.
    curve:        the loss terms by step, each the mean since the one before.
    training_manifest: ``characters``, ``structures``, ``kinds`` and/or ``clips`` that it has seen, and the
                  weights that it began with; None: not known.
    hash:         of the tensors beside it: the identity of weights in results.
    """

    method: str
    version: str
    facts: Mapping[str, Scalar]
    data: TrainedOn = TrainedOn()
    recipe: TrainingConfig | None = None
    preset: str = ""
    budget: str = ""
    command: str = ""
    seed: int = 0
    init: str | None = None
    earlier: int = 0
    uncounted: bool = False
    scored_as: str = ""
    steps: int = 0
    step: int = 0
    seconds: Finite = 0.0
    hardware: str = ""
    torch: str = ""
    processes: int = 1
    curve: Sequence[Mapping[str, float]] = ()
    validation: Sequence[Validation] = ()
    training_manifest: Mapping[str, Sequence[str]] | None = None
    notes: Sequence[str] = ()

    @property
    def frames(self) -> int:
        """Of all windows that were drawn for these weights, of those that they began with, too."""
        return self.earlier + (self.steps * self.recipe.batch * self.recipe.window if self.recipe else 0)

    @property
    def best(self) -> Validation | None:
        """The validation by which the weights were chosen."""
        return next((each for each in self.validation if each.step == self.step), None)


@dataclass(frozen=True, kw_only=True)
class Run(Record):
    """The training in one folder, and what is of this machine alone.

    dataset:   canonical spec, with where files lie. init_path: the weights that it began with, as given.
    plugin_files: path and kind of the plug-ins that were named by their files.
    job:       the ``torchrun`` that trains or trained last, which goes on by itself.
    versions:  of packages.
    """

    recipe: TrainingConfig = field()  # a field without default in place of the one above
    dataset: str
    init_path: str = ""
    plugin_files: Sequence[tuple[str, registry.Kind]] = ()
    job: str = ""
    versions: Mapping[str, str] = field(default_factory=dict)

    @property
    def limit(self) -> Budget:
        return Budget.parse(self.budget) if self.budget else Budget(steps=self.recipe.steps)

    @property
    def ended(self) -> bool:
        """True if the budget is used up."""
        return self.limit.used(self.steps, self.seconds) >= 1.0

    @property
    def record(self) -> Record:
        """What may be on a card."""
        return Record(**{each.name: getattr(self, each.name) for each in fields(Record)})
