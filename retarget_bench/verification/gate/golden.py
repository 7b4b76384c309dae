"""Golden rows as files: an ordinary results folder (``rows/``), and ``facts.csv`` for all else.

A fact is a name and a text. Those of ``PROTOCOL`` say what numbers hang on: the data, versions of metrics,
declarations of values, weights, networks and frozen files. All others are measured, and are called
``<part>/<input>/<value>``, where a value may have an index: ``motion/stairs/sunk/growth.world@1``.
"""

import shutil
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np

import retarget_bench
from retarget_bench.errors import FileError
from retarget_bench.files import write_csv
from retarget_bench.results import store

FACTS, ROWS, MOTIONS, LOG = "facts.csv", "rows", "frozen", "CHANGES.md"
FIELDS = ("fact", "value")
PROTOCOL = ("dataset", "cases", "metric", "value", "weights", "file")
MOTION, CLOUDS = "motion", "clouds"
"""Parts of the facts that metrics are asked for."""

Facts = dict[str, str]


@dataclass
class Measured:
    """Golden rows, or what is measured now.

    rows:    root of the results of methods.
    missing: sentences: what could not be measured at all.
    errors:  part, or ``<row>/<metric>`` of a frozen motion -> the error that its facts are lacking for.
    """

    rows: Path
    facts: Facts = field(default_factory=dict)
    missing: list[str] = field(default_factory=list)
    errors: dict[str, str] = field(default_factory=dict)

    @property
    def complete(self) -> bool:
        """Whether frozen motions are part of it, and every built-in method that runs by default."""
        return any(name.startswith(f"{MOTION}/") for name in self.facts)

    def under(self, kind: str) -> Facts:
        """The facts of a kind, by the rest of their names."""
        return {
            name.partition("/")[2]: text for name, text in self.facts.items() if name.startswith(f"{kind}/")
        }

    def add(self, row: str, values: Mapping[str, Any]) -> None:
        """Add facts of one row: texts, numbers with 13 significant digits, and curves or sequences of
        them as ``<value>@<index>``."""
        for value, each in values.items():
            if isinstance(each, np.ndarray | list | tuple):
                each = dict(enumerate(np.ravel(each).tolist()))
            points = {value: each}
            if isinstance(each, Mapping):
                points = {f"{value}@{index}": one for index, one in each.items()}
            for name, one in points.items():
                self.facts[f"{row}/{name}"] = one if isinstance(one, str) else f"{one:.13g}"


def built_in() -> Path:
    """The golden rows that came with this package: inside it, or in ``results/golden`` of a checkout."""
    package = Path(retarget_bench.__file__).parent
    inside = package / "golden"
    return inside if inside.is_dir() else package.parent / "results" / "golden"


def read(folder: Path) -> Measured:
    """Golden rows, without facts where there are none. Raises FileError for a damaged file of facts; rows
    are checked where they are read."""
    if not (folder / FACTS).is_file():
        return Measured(folder / ROWS)
    rows = store.read_csv(folder / FACTS, FIELDS)
    facts = dict(rows)
    if len(facts) < len(rows):
        raise FileError(folder / FACTS, "says a fact twice; restore the golden rows")
    if "dataset/spec" not in facts:
        raise FileError(folder / FACTS, "does not say what data it is of; restore the golden rows")
    return Measured(folder / ROWS, facts)


def accept(folder: Path, now: Measured, line: str) -> Path:
    """Replace the golden rows, and log one line; all or nothing. Returns the log's path.

    The log of this repository's own rows lies beside their folder, that of any other inside it. Raises
    FileError, and then nothing has changed.
    """
    log = (folder.parent if folder.resolve() == built_in().resolve() else folder) / LOG
    try:
        old = (
            log.read_text(encoding="utf-8")
            if log.is_file()
            else "# Accepted changes of the golden rows\n\n"
        )
        folder.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(prefix=".golden-", dir=folder.parent) as beside:
            fresh = Path(beside)
            write_csv(fresh / FACTS, FIELDS, sorted(now.facts.items()))
            shutil.copytree(now.rows, fresh / ROWS)
            day = datetime.now(UTC).date().isoformat()
            (fresh / LOG).write_text(f"{old}- {day}: {line}\n", encoding="utf-8", newline="\n")
            folder.mkdir(exist_ok=True)  # all is written; from here on files are renamed only
            if (folder / ROWS).exists():
                (folder / ROWS).replace(fresh / "before")
            for path in (folder / ROWS, folder / FACTS, log):
                (fresh / path.name).replace(path)
    except OSError as error:
        raise FileError(folder, f"cannot be written ({error.strerror or error})") from error
    return log


def parsed(name: str) -> tuple[str, str, str]:
    """Part, row and value (without index) of the name of a measured fact."""
    row, _, column = name.rpartition("/")
    part, _, where = row.partition("/")
    return part, where, column.split("@", 1)[0]
