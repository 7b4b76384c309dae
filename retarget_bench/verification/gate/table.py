"""Numbers by row and column, and the text files that they are kept in."""

import csv
import io
import math
from collections.abc import Mapping
from pathlib import Path

from retarget_bench.errors import FileError
from retarget_bench.results.store import ARRAY_INDICES, Values

Table = dict[str, dict[str, float]]
"""Row -> column -> number. A column is a value id, or ``<value id>@<index>`` of a curve."""

ROW = "row"


def flat(values: Values) -> dict[str, float]:
    """Values as columns."""
    found: dict[str, float] = {}
    for value_id, value in values.items():
        if isinstance(value, Mapping):
            found |= {f"{value_id}@{index}": number for index, number in value.items()}
        else:
            found[value_id] = value
    return found


def without_arrays(values: Values, index: Mapping[str, str]) -> Values:
    """The values but those per joint or frame; ``index``: value id -> what it is a curve over."""
    return {key: value for key, value in values.items() if index.get(key) not in ARRAY_INDICES}


def value_id(column: str) -> str:
    """The value that a column belongs to."""
    return column.split("@", 1)[0]


def to_text(table: Table, digits: int) -> str:
    """Comma-separated, one line per row, sorted; an empty cell is a value that does not apply."""
    columns = sorted({column for row in table.values() for column in row})
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow([ROW, *columns])
    for name, row in sorted(table.items()):
        writer.writerow([name, *(f"{row[c]:.{digits}g}" if c in row else "" for c in columns)])
    return out.getvalue()


def from_text(path: Path, text: str) -> Table:
    """Raises FileError with the line that is not as ``to_text`` writes it."""
    try:
        head, *rows = list(csv.reader(io.StringIO(text)))
    except (ValueError, csv.Error) as error:
        raise FileError(path, f"cannot be read as a table ({error})") from error
    if head[:1] != [ROW]:
        raise FileError(path, f"begins with {head[:1]} instead of {ROW!r}", 1)
    table: Table = {}
    for line, (name, *cells) in enumerate(rows, 2):
        if len(cells) != len(head) - 1:
            raise FileError(path, f"has {len(cells) + 1} cells instead of {len(head)}", line)
        pairs = zip(head[1:], cells, strict=True)
        table[name] = {column: _number(path, line, cell) for column, cell in pairs if cell}
    return table


def _number(path: Path, line: int, cell: str) -> float:
    try:
        number = float(cell)
    except ValueError:
        number = math.nan
    if not math.isfinite(number):
        raise FileError(path, f"{cell!r} is not a number", line)
    return number
