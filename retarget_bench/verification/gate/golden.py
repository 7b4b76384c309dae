"""Golden rows and what is measured now, in one form, and the files that golden rows are kept in.

``golden.json`` has the facts and, last written, the hash of every other file, so that a torn set is seen;
``frozen.csv`` has metrics on frozen motions and the core on frozen inputs, ``rows/<method>.csv`` a method
on cases of the smoke split.
"""

import csv
import hashlib
import io
import json
from collections.abc import Mapping
from contextlib import ExitStack
from dataclasses import asdict, dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import retarget_bench
from retarget_bench.errors import FileError
from retarget_bench.evaluation.header_builder import versions
from retarget_bench.files import atomic, read_json
from retarget_bench.plugins.spec import Spec
from retarget_bench.results.store import Values

SCHEMA = 1
FACTS = "golden.json"
FROZEN = "frozen.csv"
FROZEN_DIGITS, ROW_DIGITS = 13, 9
"""Significant digits: frozen motions are compared to nine, rows hold what result files hold."""
MOTIONS = "frozen"
"""The folder of frozen motions, beside the golden rows."""

Table = dict[str, dict[str, float]]
"""Row -> column -> number. A column is a value id, or ``<value id>@<index>`` of a curve."""


def flat(values: Values) -> dict[str, float]:
    """Values as columns."""
    found: dict[str, float] = {}
    for value_id, value in values.items():
        if isinstance(value, Mapping):
            found |= {f"{value_id}@{index}": number for index, number in value.items()}
        else:
            found[value_id] = value
    return found


@dataclass
class Snapshot:
    """Golden rows, or what is measured now.

    complete: frozen motions are part of it, and every built-in method that runs by default.
    dataset:  ``spec`` as it was asked for, ``name``, ``parameters`` that are no defaults, ``content``, and
              of each split the number of its cases and a hash of their ids (``lists``).
    smoke:    split -> the ids of its cases that methods are asked.
    metrics:  metric -> version. values: value id -> its facts (``run.VALUE_FACTS``) and its metric.
    methods:  label -> version and hash of its weights.
    motions:  frozen file -> hash.
    frozen:   ``<file>/<prediction>`` or ``<part>/<input>`` -> column -> number.
    rows:     method -> ``<split> <case>`` (and ``<split> mean``, as tables have it) -> column -> number.
    problems: method -> ``<split> <case>`` -> why there is no answer.
    failures: ``<row> <metric>`` of frozen motions, or part of the core -> the error.
    missing:  sentences: what could not be measured at all. Never written to a file.
    """

    complete: bool
    dataset: dict[str, Any]
    smoke: dict[str, list[str]]
    metrics: dict[str, str]
    values: dict[str, dict[str, Any]]
    methods: dict[str, dict[str, str]] = field(default_factory=dict)
    motions: dict[str, str] = field(default_factory=dict)
    frozen: Table = field(default_factory=dict)
    rows: dict[str, Table] = field(default_factory=dict)
    problems: dict[str, dict[str, str]] = field(default_factory=dict)
    failures: dict[str, str] = field(default_factory=dict)
    missing: list[str] = field(default_factory=list)


def built_in() -> Path:
    """The golden rows that came with this package: inside it, or in ``results/golden`` of a checkout."""
    package = Path(retarget_bench.__file__).parent
    inside = package / "golden"
    return inside if inside.is_dir() else package.parent / "results" / "golden"


def exists(folder: Path) -> bool:
    return (folder / FACTS).is_file()


# -------------------------------------------------------------------------------------------- reading
def read(folder: Path) -> Snapshot:
    """Raises FileError that names the file which is missing, damaged or from a newer version."""
    path = folder / FACTS
    try:
        facts = read_json(path)
        schema, files = facts.pop("schema"), facts.pop("files")
        if not isinstance(schema, int) or schema > SCHEMA:
            problem = f"has schema {schema} of golden rows; this version reads up to {SCHEMA}. Upgrade"
            raise FileError(path, problem)
        facts.pop("made_with")
        golden = Snapshot(**facts)
        tables = {name: _table(folder / name, hash_) for name, hash_ in files.items()}
        if golden.complete:
            golden.frozen = tables[FROZEN]
        golden.rows = {label: tables[_file(label)] for label in golden.methods}
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        raise FileError(path, f"does not hold golden rows, or is damaged ({error})") from error
    return golden


def _table(path: Path, expected: str) -> Table:
    try:
        content = path.read_bytes()
    except OSError as error:
        raise FileError(path, f"cannot be read ({error.strerror}); restore the golden rows") from error
    if _hash(content) != expected:
        raise FileError(
            path, f"is not the file that {FACTS} beside it was written with; restore the golden rows"
        )
    rows = csv.DictReader(io.StringIO(content.decode("utf-8")))
    return {row.pop("row"): {name: float(cell) for name, cell in row.items() if cell} for row in rows}


def _hash(content: bytes) -> str:
    # a checkout may have changed line ends, which no number depends on
    return hashlib.sha256(content.replace(b"\r\n", b"\n")).hexdigest()[:16]


def _file(label: str) -> str:
    return f"rows/{Spec.parse(label).slug}.csv"


# -------------------------------------------------------------------------------------------- writing
def write(folder: Path, found: Snapshot, line: str) -> Path:
    """Replace the golden rows, and log one line; all files or none. Returns the log's path.

    The log of this repository's own rows lies beside their folder, that of any other inside it. Raises
    FileError, and then nothing has changed.
    """
    tables = {_file(label): _text(table, ROW_DIGITS) for label, table in found.rows.items()}
    if found.complete:
        tables[FROZEN] = _text(found.frozen, FROZEN_DIGITS)
    apart = ("frozen", "rows", "failures", "missing")
    facts = {
        "schema": SCHEMA,
        "made_with": versions(),
        **{name: part for name, part in asdict(found).items() if name not in apart},
        "files": {name: _hash(text.encode()) for name, text in sorted(tables.items())},
    }
    log = (folder.parent if folder.resolve() == built_in().resolve() else folder) / "CHANGES.md"
    old = log.read_text(encoding="utf-8") if log.is_file() else "# Accepted changes of the golden rows\n\n"
    day = datetime.now(UTC).date().isoformat()
    with ExitStack() as together:
        # left in reverse: the facts, which hold the hashes of the others, are renamed last
        for path, text in {
            folder / FACTS: json.dumps(facts, indent=1, ensure_ascii=False, allow_nan=False) + "\n",
            log: f"{old}- {day}: {line}\n",
            **{folder / name: text for name, text in tables.items()},
        }.items():
            temporary = together.enter_context(atomic(path))
            temporary.write_text(text, encoding="utf-8", newline="\n")
    for stale in (folder / "rows").glob("*.csv"):
        if f"rows/{stale.name}" not in tables:
            stale.unlink()
    return log


def _text(table: Table, digits: int) -> str:
    """Comma-separated, one line per row, sorted; an empty cell is a value that does not apply."""
    columns = sorted({column for row in table.values() for column in row})
    out = io.StringIO()
    writer = csv.DictWriter(out, ["row", *columns], lineterminator="\n")
    writer.writeheader()
    for name, row in sorted(table.items()):
        writer.writerow({"row": name, **{column: f"{each:.{digits}g}" for column, each in row.items()}})
    return out.getvalue()
