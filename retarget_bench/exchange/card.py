"""``card.toml``: the authors, training and costs of a submitted method."""

import json
from pathlib import Path
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from retarget_bench.api import MethodCard
from retarget_bench.errors import FileError, mistakes
from retarget_bench.files import read_toml
from retarget_bench.plugins import bound
from retarget_bench.plugins.spec import Spec
from retarget_bench.results.header import MethodInfo

CARD, LARGEST = "card.toml", 1_000_000
"""The file, and the bytes that it may have."""
FILL_IN = "TO BE FILLED IN"
"""The placeholder of facts that only the authors know."""


Text = Annotated[str, Field(min_length=1, max_length=10_000)]
Optional = Annotated[str, Field(max_length=1000)]
Number = Annotated[float, Field(ge=0, le=1e12, strict=False)]


class Card(BaseModel):
    """Who made a method, how it was trained, and what it costs.

    summary, training, limits: in words. contact, paper, code: links, or empty.
    trained_on:         characters, structures or data sets; empty for a method that is not trained.
    parameters:         numbers that were learnt.
    training_hours:     of all runs behind the weights, on ``hardware``.
    peak_memory_mb:     what a process grows by while it retargets.
    lookahead_frames:   frames after the present one that it needs, or "clip" where it needs the whole one.
    frames_per_second:  of one process and one thread.
    """

    model_config = ConfigDict(extra="forbid", strict=True)

    version: Text
    authors: list[Text] = Field(min_length=1)
    licence: Text
    summary: Text
    training: Text
    limits: Text
    contact: Optional = ""
    paper: Optional = ""
    code: Optional = ""
    trained_on: list[Text] = []
    parameters: int = Field(ge=0, le=10**15)
    training_hours: Number
    hardware: Optional = ""
    peak_memory_mb: Number
    lookahead_frames: Annotated[int, Field(ge=0, le=10**9)] | Literal["clip"]
    frames_per_second: Annotated[Number, Field(gt=0)]


def read(folder: Path) -> Card:
    """The card of a submission. Raises FileError that lists every mistake with its field."""
    path = folder / CARD
    if not path.exists():
        raise FileError(path, "is missing; bench submit --make writes one")
    facts = read_toml(path, LARGEST)
    if left := [name for name, fact in facts.items() if fact in (FILL_IN, [FILL_IN])]:
        raise FileError(path, f"is still to be filled in: {', '.join(left)}")
    try:
        return Card.model_validate(facts)
    except ValidationError as error:
        raise FileError(path, f"is not the card of a submission: {mistakes(error)}") from error


def begun(about: MethodInfo, rate: float | None) -> str:
    """The text of a card, begun with facts from the results of a method; the rest is to be filled in.

    rate: frames per second; None where the results have no times. Raises BenchError for a method that is
    not here.
    """
    built = None if about.external else bound.method(Spec.parse(about.label).here).built
    about_method = built.card if built else MethodCard("", "", "")
    facts = {
        "version": about.version,
        "authors": [FILL_IN],
        "licence": about_method.licence,
        "summary": about.summary,
        "paper": about_method.paper,
        "frames_per_second": rate and float(f"{rate:.3g}"),
    }
    lines = []
    for name, field in Card.model_fields.items():
        fact = facts.get(name) or (FILL_IN if field.is_required() else field.default)
        # JSON's texts, numbers and lists are TOML's, too
        lines.append(f"{name} = {json.dumps(fact, ensure_ascii=False)}\n")
    return "".join(lines)
