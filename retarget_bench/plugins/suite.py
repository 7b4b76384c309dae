"""A run written down: a TOML file with the same words as the command line.

methods = ["copy_rotations[root_rule=height]", "ik"]
dataset = "mixamo"
root = "PATH/TO/mixamo"
split = ["cross"]
"""

from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import AliasChoices, BaseModel, BeforeValidator, ConfigDict, Field, ValidationError

from retarget_bench.errors import FileError
from retarget_bench.files import read_toml


def _listed(value: Any) -> Any:
    return [value] if isinstance(value, str) else value


Names = Annotated[list[str], BeforeValidator(_listed)]


class Suite(BaseModel):
    """The entries of a suite file; each has the command line's default where it is left out."""

    model_config = ConfigDict(extra="forbid", strict=True)

    methods: Names | None = None
    dataset: str | None = None
    root: str | None = None
    split: Names | None = None
    metrics: Names | None = None
    clips: Names | None = None
    limit: int | None = Field(default=None, ge=1)
    seed: int | None = Field(default=None, ge=0)
    seeds: int | None = Field(default=None, ge=1)
    jobs: int | None = Field(default=None, ge=1)
    overwrite: Literal["never", "missing", "failed", "always"] | None = Field(
        default=None, validation_alias=AliasChoices("overwrite", "redo")
    )
    out: str | None = None
    plugin: Names | None = None
    timeout: float | None = Field(default=None, gt=0, lt=1e9)
    memory: float | None = Field(default=None, gt=0, lt=1e9)
    isolate: str | None = None
    executor: str | None = None


def read(path: Path) -> dict[str, Any]:
    """The options that a suite file sets. Raises FileError that lists every mistake with its place."""
    try:
        suite = Suite.model_validate(read_toml(path))
    except ValidationError as error:
        known = ", ".join(Suite.model_fields)
        mistakes = "".join(
            f"\n  {'.'.join(map(str, each['loc']))}: {each['msg']}" for each in error.errors()
        )
        raise FileError(path, f"is not a suite file (it may set {known}):{mistakes}") from error
    return suite.model_dump(exclude_none=True)
