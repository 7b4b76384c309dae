"""``submission.toml``: who submits what, made how, at what cost."""

import json
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from retarget_bench.errors import FileError
from retarget_bench.files import read_toml, write_text

SCHEMA = 1
MANIFEST, CARD, ROWS, PREDICTIONS = "submission.toml", "CARD.md", "results", "predictions"
CARD_SECTIONS = ("Method", "Data", "Training", "Cost", "Limits")
"""Headings that a card must have, each with something below it."""

Text = Annotated[str, Field(min_length=1, max_length=1000)]
Optional = Annotated[str, Field(max_length=1000)]
Number = Annotated[float, Field(ge=0, le=1e12, strict=False)]


class _Table(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True)


class AboutMethod(_Table):
    """label: what its rows are called. sees: privileged inputs (reference, target_motions, ...)."""

    label: Text
    version: Text
    authors: list[Text] = Field(min_length=1)
    licence: Text
    summary: Text
    contact: Optional = ""
    paper: Optional = ""
    code: Optional = ""
    sees: list[Text] = []


class AboutData(_Table):
    """dataset: what it was run on, with parameters in brackets. trained_on: characters, structures or data
    sets that were trained on; empty for a method that is not trained."""

    dataset: Text
    trained_on: list[Text] = []


class Cost(_Table):
    """Cost of the method.

    parameters: numbers that were learnt. training_hours: of all runs behind the weights, on ``hardware``.
    peak_memory_mb: what a process grows by while it retargets. lookahead_frames: how many frames after the
    present one it needs, or "clip" where it needs the whole one. frames_per_second: of one process and one
    thread.
    """

    parameters: int = Field(ge=0, le=10**15)
    training_hours: Number
    hardware: Optional = ""
    peak_memory_mb: Number
    lookahead_frames: Annotated[int, Field(ge=0, le=10**9)] | Literal["clip"]
    frames_per_second: Annotated[Number, Field(gt=0)]


class Manifest(_Table):
    """The whole file."""

    schema_: int = Field(alias="schema", ge=1, le=SCHEMA)
    method: AboutMethod
    data: AboutData
    cost: Cost


def read(folder: Path) -> Manifest:
    """The manifest of a submission. Raises FileError that lists every mistake with its place."""
    path = folder / MANIFEST
    if not path.exists():
        raise FileError(path, "is missing; bench submit --make writes one")
    facts = read_toml(path)
    if isinstance(newer := facts.get("schema"), int) and newer > SCHEMA:
        raise FileError(
            path, f"has schema {newer}; this version reads up to {SCHEMA}. Upgrade retarget-bench"
        )
    try:
        return Manifest.model_validate(facts)
    except ValidationError as error:
        mistakes = [f"{'.'.join(map(str, each['loc']))}: {each['msg']}" for each in error.errors()]
        raise FileError(path, f"is not a manifest of a submission: {'; '.join(mistakes)}") from error


def write(folder: Path, tables: dict[str, dict[str, Any]]) -> None:
    """Write a manifest from its tables; JSON's text, number and list are TOML's too."""
    lines = [f"schema = {SCHEMA}"]
    for name, entries in tables.items():
        lines += ["", f"[{name}]"]
        lines += [f"{key} = {json.dumps(value, ensure_ascii=False)}" for key, value in entries.items()]
    write_text(folder / MANIFEST, "\n".join(lines) + "\n")
