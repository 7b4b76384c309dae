"""Golden rows as files: where they lie, how they are read, and written all together or not at all.

``golden.json`` has the facts and, last written, the hash of every other file, so that a torn set is seen;
``frozen.csv`` has metrics on frozen motions, ``rows/<method>.csv`` a method on cases of the smoke split.
"""

import hashlib
import json
from collections.abc import Mapping
from contextlib import ExitStack
from dataclasses import asdict
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import retarget_bench
from retarget_bench.errors import FileError
from retarget_bench.evaluation.header_builder import versions
from retarget_bench.files import atomic
from retarget_bench.plugins.spec import Spec
from retarget_bench.verification.gate.frozen import FOLDER
from retarget_bench.verification.gate.snapshot import Snapshot
from retarget_bench.verification.gate.table import Table, from_text, to_text

SCHEMA = 1
FACTS = "golden.json"
FROZEN = "frozen.csv"
ROWS = "rows"
CHANGES = "CHANGES.md"
DIGITS = {"frozen": 13, "rows": 9}
"""Significant digits: frozen motions are compared to nine, rows hold what result files hold."""
_TABLES = ("frozen", "rows", "failures", "missing")
"""Parts of a snapshot that are not among the facts."""
_TITLE = "# Accepted changes of the golden rows\n\n"


def built_in() -> Path:
    """The golden rows that came with this package: inside it, or in ``results/golden`` of a checkout."""
    package = Path(retarget_bench.__file__).parent
    inside = package / "golden"
    return inside if inside.is_dir() else package.parent / "results" / "golden"


def motions(folder: Path) -> Path:
    """Folder of the frozen motions: beside the golden rows where these have some, else in the package."""
    return folder if (folder / FOLDER).is_dir() else built_in()


def exists(folder: Path) -> bool:
    return (folder / FACTS).is_file()


# -------------------------------------------------------------------------------------------- reading
def read(folder: Path) -> Snapshot:
    """Raises FileError that names the file which is missing, damaged or from a newer version."""
    path = folder / FACTS
    try:
        facts = json.loads(path.read_text(encoding="utf-8"))
        schema, files = facts.pop("schema"), facts.pop("files")
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        raise FileError(path, f"does not hold golden rows, or is damaged ({error})") from error
    if not isinstance(schema, int) or schema > SCHEMA:
        raise FileError(
            path, f"has schema {schema} of golden rows; this version reads up to {SCHEMA}. Upgrade"
        )
    try:
        facts.pop("made_with")
        golden = Snapshot(**facts)
        texts = {name: _text(folder / name, hash_) for name, hash_ in files.items()}
        if golden.complete:
            golden.frozen = from_text(folder / FROZEN, texts[FROZEN])
        for label in golden.methods:
            name = _file(label)
            golden.rows[label] = from_text(folder / name, texts[name])
    except (KeyError, TypeError, AttributeError) as error:
        raise FileError(path, f"does not hold golden rows, or is damaged ({error})") from error
    return golden


def _text(path: Path, expected: str) -> str:
    try:
        content = path.read_bytes()
    except OSError as error:
        raise FileError(path, f"cannot be read ({error.strerror}); restore the golden rows") from error
    if _hash(content) != expected:
        raise FileError(
            path, f"is not the file that {FACTS} beside it was written with; restore the golden rows"
        )
    return content.decode("utf-8")


def _hash(content: bytes) -> str:
    # a checkout may have turned line ends, which no number hangs on
    return hashlib.sha256(content.replace(b"\r\n", b"\n")).hexdigest()[:16]


def _file(label: str) -> str:
    return f"{ROWS}/{Spec.parse(label).slug}.csv"


# -------------------------------------------------------------------------------------------- writing
def write(folder: Path, found: Snapshot, line: str) -> Path:
    """Replace the golden rows, and log one line; all files or none. Returns the log's path.

    The log of this repository's own rows lies beside their folder, that of any other inside it. Raises
    FileError, and then nothing has changed.
    """
    texts = _texts(found)
    log = (folder.parent if folder.resolve() == built_in().resolve() else folder) / CHANGES
    old = log.read_text(encoding="utf-8") if log.is_file() else _TITLE
    day = datetime.now(UTC).date().isoformat()
    with ExitStack() as together:
        # left in reverse: the facts, which hold the hashes of the others, are renamed last
        for path, text in {
            folder / FACTS: texts.pop(FACTS),
            log: f"{old}- {day}: {line}\n",
            **{folder / name: text for name, text in texts.items()},
        }.items():
            temporary = together.enter_context(atomic(path))
            temporary.write_text(text, encoding="utf-8", newline="\n")
    for stale in (folder / ROWS).glob("*.csv"):
        if f"{ROWS}/{stale.name}" not in texts:
            stale.unlink()
    return log


def _texts(found: Snapshot) -> dict[str, str]:
    """File name -> text."""
    tables: dict[str, tuple[Table, str]] = {
        _file(label): (table, "rows") for label, table in found.rows.items()
    }
    if found.complete:
        tables[FROZEN] = (found.frozen, "frozen")
    texts = {name: to_text(table, DIGITS[kind]) for name, (table, kind) in tables.items()}
    facts: Mapping[str, Any] = {
        "schema": SCHEMA,
        "made_with": versions(),
        **{name: part for name, part in asdict(found).items() if name not in _TABLES},
        "files": {name: _hash(text.encode()) for name, text in sorted(texts.items())},
    }
    return {FACTS: json.dumps(facts, indent=1, ensure_ascii=False, allow_nan=False) + "\n", **texts}
