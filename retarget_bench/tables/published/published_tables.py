"""Published tables: their columns and printed numbers.

``published/*.toml`` hold the printed numbers. Each column names our value of the same protocol and the
pairs it is a mean over, or why there is none.
"""

import tomllib
from collections.abc import Mapping, Sequence
from functools import cache
from importlib.resources import files

from pydantic import BaseModel, ConfigDict, Field

from retarget_bench.errors import BenchError
from retarget_bench.results import case_metadata
from retarget_bench.results.result_matrix import ResultMatrix

OUR_STRUCTURES = "structures of these results"


class _Facts(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class PublishedColumn(_Facts):
    """One column as printed.

    value:    our value of the same protocol, or "".
    pairs:    ``source>target`` of the cases that it is a mean over.
    any_pair: a mean over every pair that is no self pair, of whatever data. splits: likewise, over all
              cases of these splits.
    mean_of:  columns that it is the mean of.
    seen:     a mean over all target structures that training had (``seen``) or had not (``unseen``).
    structure: a mean over all bodies of a structure.
    legs, kind: of values of sets of answers: the legs of the targets, and the kind of the cases ("": all).
    block:    columns of one block are drawn together.
    repeats:  the column of the first block that has the same numbers where the data are the paper's.
    missing:  why we have no number for it, or "".
    """

    id: str
    label: str
    unit: str
    value: str = ""
    pairs: tuple[str, ...] = ()
    any_pair: bool = False
    splits: tuple[str, ...] = ()
    mean_of: tuple[str, ...] = ()
    seen: str = ""
    structure: str = ""
    legs: int = 0
    kind: str = ""
    block: str = ""
    repeats: str = ""
    missing: str = ""


class PublishedRow(_Facts):
    """One method as printed: column -> (number,) or (number, spread)."""

    method: str
    values: Mapping[str, tuple[int | float, ...]]


class PublishedTable(_Facts):
    """``clips``: how many test clips the paper has (0: its test set is another one). ``task``: whose
    results answer to it. ``counted``: rows of ours that are no results, such as numbers of parameters."""

    title: str
    paper: str
    clips: int
    task: str = "retarget"
    notes: tuple[str, ...]
    columns: tuple[PublishedColumn, ...]
    rows: tuple[PublishedRow, ...] = Field(min_length=1)
    counted: tuple[PublishedRow, ...] = ()

    @property
    def of_sets(self) -> bool:
        """It compares sets of answers with real motion, and not answers with right ones."""
        return any(column.legs for column in self.columns)


_FOLDER = files("retarget_bench.tables.published")


def names() -> list[str]:
    """The published tables there are."""
    return sorted(each.name[:-5] for each in _FOLDER.iterdir() if each.name.endswith(".toml"))


@cache
def published(name: str) -> PublishedTable:
    """A published table. Raises BenchError for a name that there is none of."""
    if name not in names():
        raise BenchError(f"there is no published table {name!r}; there are {', '.join(names())}")
    text = (_FOLDER / f"{name}.toml").read_text(encoding="utf-8")
    return PublishedTable.model_validate(tomllib.loads(text))


def with_structures(table: PublishedTable, matrices: Sequence[ResultMatrix]) -> PublishedTable:
    """A table by structures, with a further block: our own structures, and a note per trained method that
    says which of them it knew. The value is that of the columns by what was seen."""
    value, unit = next((column.value, column.unit) for column in table.columns if column.seen)
    found: set[str] = set()
    notes: dict[str, None] = {}
    for matrix, row in ((each, row) for each in matrices for row in each.rows):
        structures = case_metadata.read_structures(row.paths) or {}
        mine = {structures[info.target] for info in matrix.cases if info.target in structures}
        found |= mine
        if trained := row.header.method.trained_on:
            known = mine & set(trained.get("structures", ()))
            told = [", ".join(sorted(each)) or "none" for each in (known, mine - known)]
            notes[f"{row.label}: trained on structures {told[0]}; new to it: {told[1]}."] = None
    ours = tuple(
        PublishedColumn(id=name, label=name, unit=unit, value=value, structure=name, block=OUR_STRUCTURES)
        for name in sorted(found)
    )
    return table.model_copy(update={"columns": (*table.columns, *ours), "notes": (*table.notes, *notes)})
