"""What the header of submitted results must look like: strangers write them, and tables trust them."""

from __future__ import annotations

from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, ValidationError

from retarget_bench.results.store import Results


class _Part(BaseModel):
    model_config = ConfigDict(extra="allow", strict=True)


class _Method(_Part):
    label: str
    name: str = ""
    summary: str = ""
    version: str | None = ""
    code: str | None = ""
    parameters: dict[str, str | int | float | bool] = {}
    origin: str = ""
    privileged: list[str]
    control: bool
    stochastic: bool = False
    trained_on: dict[str, list[str]] | None = None


class _Dataset(_Part):
    name: str
    label: str
    content: str
    notes: list[str]
    parameters: dict[str, str | int | float | bool] = {}


class _Value(_Part):
    label: str
    meaning: str
    unit: str
    better: Literal["lower", "higher", "target", "none"]
    goal: float
    tolerance: float
    index: str
    with_self: bool
    metric: str = ""
    needs: list[str] = []
    protocol: dict[str, str] = {}


class _Counts(_Part):
    asked: int
    ok: int
    unsupported: int = 0
    invalid: int = 0
    failed: int = 0
    missing: int = 0


class _Problem(_Part):
    status: Literal["unsupported", "invalid", "failed", "missing"]
    message: str
    cases: list[str]


class _Heading(_Part):
    method: _Method
    dataset: _Dataset
    values: dict[str, _Value]
    set_values: dict[str, _Value] = {}
    metrics: dict[str, str] = {}
    counts: _Counts
    problems: list[_Problem]
    seeds: list[int] = [0]
    versions: dict[str, str] = {}
    revision: str = ""
    date: str = ""


FIELDS = tuple(_Heading.model_fields)


def mistakes(header: dict[str, Any]) -> list[str]:
    """Where a header is not what it must be: ``method.privileged: Field required``."""
    try:
        _Heading.model_validate(header)
    except ValidationError as error:
        return [f"{'.'.join(map(str, each['loc']))}: {each['msg']}" for each in error.errors()]
    return []


def undeclared(results: Results) -> list[str]:
    """Ids of values in the rows that the header does not declare."""
    found = {value for entry in results.entries for value in entry.values}
    return sorted(found - results.header.values.keys())
