"""Types of the fields of a card of weights, checked once where a card is read."""

from collections.abc import Mapping
from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from retarget_bench.plugins.spec import Scalar

Text = Annotated[str, Field(description="a text")]
Whole = Annotated[int, Field(description="a whole number")]
Scores = Annotated[dict[str, dict[str, float]], Field(description="numbers by split and name")]


class _Fields(BaseModel):
    model_config = ConfigDict(strict=True, extra="allow")


class _Data(_Fields):
    hours: float = 0.0


class _Validation(_Fields):
    step: int
    scores: dict[str, Annotated[dict[str, float], Field(min_length=1)]] = Field(min_length=1)


class _Card(_Fields):
    """The fields that ``weights`` describes; a description ends the sentence "its NAME has to be"."""

    hash: Text
    method: Text
    version: Text
    facts: dict[str, Scalar] = Field(description="parameters by name")
    data: _Data = Field(_Data(), description="facts by name, hours a number")
    recipe: dict[str, Scalar | None] = Field({}, description="values by name")
    preset: Text = ""
    command: Text = ""
    seed: Whole = 0
    steps: Whole = 0
    step: Whole = 0
    seconds: float = Field(0.0, description="a number")
    hardware: Text = ""
    torch: Text = ""
    processes: Whole = 1
    init: str | None = Field(None, description="a text or null")
    losses: dict[str, float] = Field({}, description="numbers by name")
    validation: list[_Validation] = Field(
        [], description="a list, each with a step and with scores by split and name"
    )
    scores: Scores = {}
    scored_as: Text = ""
    training_manifest: dict[str, list[Scalar]] = Field({}, description="lists of names")
    notes: list[str] = Field([], description="a list of sentences")


def wrong(card: Mapping[str, Any]) -> str:
    """The first known field that is not what it has to be, as a sentence's end; "" where all are."""
    try:
        _Card.model_validate(card)
    except ValidationError as error:
        name = str(error.errors()[0]["loc"][0])
        return f"its {name} has to be {_Card.model_fields[name].description}"
    return ""
