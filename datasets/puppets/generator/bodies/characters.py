"""The cast of ``characters.toml``: people drawn from anthropometry, caricatures and dogs.

Bodies marked ``held_out`` are in no training set, and neither is any body of ``h36m17``. Among people who
are built alike copying is an answer, so out of 200 draws under every name those were taken that make people
most unlike in build (``corpus/families.py``), all within the ellipsoid that holds 95 % of people.
"""

import tomllib
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from .dogs import DOG21, dog
from .proportions import Proportions, drawn, human
from .structures import H36M17, STRUCTURES, Body, Structure

_TABLES = tomllib.loads(Path(__file__).with_name("characters.toml").read_text(encoding="utf-8"))

MIDDLING_DOG: Mapping[str, float] = _TABLES["middling_dog"]
"""Lengths of a dog of middling build, shares of the withers."""


def _body(name: str, structure: Structure, row: Mapping[str, Any]) -> Body:
    held_out = row.get("held_out", False) or structure is H36M17
    return Body(name, structure, _proportions(name, row), row["rest"], held_out)


def _proportions(name: str, row: Mapping[str, Any]) -> Proportions:
    factors = dict(row.get("factors", {}))
    if "withers" in row:
        return dog(MIDDLING_DOG, row["withers"], **factors)
    if "draw" in row:
        return drawn(f"{name} {row['draw']}", row["sex"], row["age"])
    stature = row["stature"]
    hunch = factors.pop("hunch", 0.0) * stature
    return replace(human(row["sex"], stature).scaled(**factors), hunch=hunch)


BODIES = {
    name: _body(name, structure, row)
    for structure in STRUCTURES.values()
    for name, row in _TABLES[structure.name].items()
}
"""Everybody on two legs."""

DOGS = {name: _body(name, DOG21, row) for name, row in _TABLES[DOG21.name].items()}
