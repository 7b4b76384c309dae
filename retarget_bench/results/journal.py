"""The journal of a run: every finished case at once, a line each, from which the next run goes on."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from retarget_bench.errors import FileError
from retarget_bench.files import sweep, write_text
from retarget_bench.results.header import SCHEMA
from retarget_bench.results.paths import CaseResult, ResultPaths


def open_journal(
    paths: ResultPaths, keys: Mapping[str, str], *, anew: bool = False
) -> dict[str, CaseResult]:
    """The finished cases of an interrupted run with the same keys; a stale journal is begun anew.

    The journal is left ending on a whole line, ready to be appended to. What killed runs left of files that
    they were writing is removed.
    """
    try:
        for each in (paths.journal, paths.begun, paths.rows, paths.arrays, paths.header):
            sweep(each)
        entries, length = ({}, 0) if anew else read_journal(paths.journal, keys)
        if not length:
            write_text(paths.journal, json.dumps({"schema": SCHEMA, **keys}) + "\n")
        elif length < paths.journal.stat().st_size:
            with paths.journal.open("r+b") as file:
                file.truncate(length)
    except OSError as error:
        raise FileError(paths.journal, f"cannot be continued ({error.strerror})") from error
    return entries


def read_journal(path: Path, keys: Mapping[str, str]) -> tuple[dict[str, CaseResult], int]:
    """Entries, and the length in bytes of the whole lines (0: stale or none)."""
    entries: dict[str, CaseResult] = {}
    length = 0
    if not path.exists():
        return entries, 0
    with path.open("rb") as file:
        for number, line in enumerate(file):
            try:
                record: Any = json.loads(line) if line.endswith(b"\n") else None  # else it is torn
                entry = CaseResult(**record) if number else None
            except (ValueError, TypeError, RecursionError):
                break
            if entry is not None:
                entries[entry.case] = entry
            elif record != {"schema": SCHEMA, **keys}:
                return entries, 0
            length += len(line)
    return entries, length


def append_journal(paths: ResultPaths, entry: CaseResult) -> None:
    """One line, written at once."""
    line = json.dumps(vars(entry), allow_nan=False) + "\n"
    try:
        with paths.journal.open("ab", buffering=0) as file:
            file.write(line.encode())
    except OSError as error:
        raise FileError(paths.journal, f"cannot be written ({error.strerror})") from error
