"""A published table with our rows under the printed ones, as a table that every renderer can draw."""

from collections.abc import Sequence
from dataclasses import replace

from retarget_bench.tables.model import NOT_APPLICABLE, Cell, Column, Footnotes, Group, Row, Table, count
from retarget_bench.tables.published.published_tables import (
    OwnRow,
    PublishedColumn,
    PublishedRow,
    PublishedTable,
    caveats,
)

PRINTED = "printed"
NOT_PRINTED = "not printed in the paper"
OTHER_CASES = "these results have no case of this column"


def paper_table(table: PublishedTable, rows: Sequence[OwnRow]) -> Table:
    """The printed rows in their order, then ours by name, then controls; nothing is ranked."""
    footnotes = Footnotes()
    printed = [_printed(table, row, footnotes) for row in table.rows]
    several = len({row.dataset for row in rows}) > 1
    by_name = sorted(rows, key=lambda row: (row.dataset, row.label))
    ours = [_own(table, row, footnotes, several) for row in by_name]
    blocks = [
        each for each in dict.fromkeys(c.block for c in table.columns) if not _repeats(table, each, rows)
    ]
    groups = tuple(group for each in blocks if (group := _block(table, each, printed, ours)).rows)
    return Table(
        title=table.title,
        groups=groups,
        notes=(*table.notes[:1], *caveats(table, rows), *table.notes[1:], *_counts(table, rows)),
        footnotes=tuple(footnotes.sentences),
        reading=f"Rows marked '{PRINTED}' are the paper's numbers; all others were computed here, under "
        "the protocol that each column names, and say which variant of a published method they are ('as "
        "published' is about settings, not about weights). Nothing is ranked.",
    )


def _repeats(table: PublishedTable, block: str, rows: Sequence[OwnRow]) -> bool:
    """A later block that has the cases of the first one: every cell has a twin of its label there."""
    if not block or not rows:
        return False
    first = {column.label: column.id for column in table.columns if not column.block}

    def same(row: OwnRow, column: PublishedColumn) -> bool:
        one, two = row.cells.get(first.get(column.label, "")), row.cells.get(column.id)
        return (one and (one.cases, one.pairs)) == (two and (two.cases, two.pairs))

    mine = [column for column in table.columns if column.block == block]
    return all(column.label in first and same(row, column) for row in rows for column in mine)


def _block(table: PublishedTable, block: str, printed: Sequence[Row], ours: Sequence[Row]) -> Group:
    """The columns of one block. Printed rows are left out where the paper prints nothing at all."""
    numbers = [number for number, column in enumerate(table.columns) if column.block == block]

    def part(row: Row) -> Row:
        return replace(row, cells=tuple(row.cells[number] for number in numbers))

    shown = [row for row in map(part, ours) if any(cell.reason != OTHER_CASES for cell in row.cells)]
    theirs = map(part, printed if _prints(table, block) else ())
    return Group(
        title=f"{table.paper}: {block}" if block else table.paper,
        split="",
        columns=tuple(_column(table.columns[number]) for number in numbers),
        ranked=(*theirs, *(row for row in shown if not row.mark)),
        unranked=tuple(row for row in shown if row.mark),
    )


def _prints(table: PublishedTable, block: str) -> bool:
    """The paper prints a number in this block."""
    asked = [column.id for column in table.columns if column.block == block]
    return any(each in row.values for row in table.rows for each in asked)


def _column(column: PublishedColumn) -> Column:
    mean = f"protocol {column.value}, mean over"
    if column.mean_of:
        meaning = f"mean of {', '.join(column.mean_of)}"
    elif column.any_pair:
        meaning = f"{mean} every pair but self pairs"
    elif column.splits:
        meaning = f"{mean} all cases of split {' and '.join(column.splits)}"
    elif column.legs:
        kind = f" of kind {column.kind}" if column.kind else ""
        meaning = f"{column.value} of all answers{kind} on bodies of {column.legs} legs"
    elif column.seen:
        had = "had" if column.seen == "seen" else "did not have"
        meaning = f"{mean} bodies of structures that training {had}"
    elif column.structure:
        meaning = f"{mean} bodies of structure {column.structure}"
    else:
        meaning = f"{mean} {', '.join(column.pairs)}" if column.pairs else column.missing
    return Column(column.id, column.label, column.unit, "lower", meaning)


def _printed(table: PublishedTable, row: PublishedRow, footnotes: Footnotes) -> Row:
    cells = []
    for column in table.columns:
        if numbers := row.values.get(column.id):
            cells.append(_cell(numbers[0], (*numbers[1:], None)[0], _decimals(table, column)))
        else:
            note = footnotes.number(NOT_PRINTED) if _prints(table, column.block) else 0
            cells.append(Cell(NOT_APPLICABLE, reason=NOT_PRINTED, footnote=note))
    return Row(f"{row.method} ({PRINTED})", "", tuple(cells), "")


def _own(table: PublishedTable, row: OwnRow, footnotes: Footnotes, several: bool) -> Row:
    cells = []
    for column in table.columns:
        found = row.cells.get(column.id)
        if found is None:
            reason = column.missing or row.reasons.get(column.id, OTHER_CASES)
            cells.append(footnotes.missing(reason))
            continue
        prints_spread = any(len(each.values.get(column.id, ())) > 1 for each in table.rows)
        spread = found.spread if prints_spread else None
        shown = _cell(found.value, spread, _decimals(table, column))
        cells.append(replace(shown, n=found.cases, clips=found.clips))
    label = f"{row.label} ({row.variant})" if row.variant else row.label
    label += f", {row.dataset}" if several else ""
    n = "" if table.of_sets else str(sum(row.cells[each].cases for each in _counted(table, row)))
    return Row(label, row.mark, tuple(cells), n)


def _counted(table: PublishedTable, row: OwnRow) -> list[str]:
    """The columns whose cases add up to what the row is a mean over."""
    apart = [c.id for c in table.columns if (c.pairs or c.structure) and c.id in row.cells]
    return apart or [*row.cells][:1]


def _cell(value: float, spread: float | None, decimals: int) -> Cell:
    text = f"{value:.{decimals}f}" + ("" if spread is None else f" ±{spread:.{decimals}f}")
    return Cell(text, value, decimals=decimals)


def _decimals(table: PublishedTable, column: PublishedColumn) -> int:
    """As many as are printed; of columns that nothing is printed in, as many as elsewhere."""
    numbers = [row.values[column.id] for row in table.rows if column.id in row.values]
    if not numbers:
        numbers = [numbers for row in table.rows for numbers in row.values.values()]
    return max(len(repr(number).partition(".")[2]) for each in numbers for number in each)


def _counts(table: PublishedTable, rows: Sequence[OwnRow]) -> list[str]:
    """Numbers of cases, pairs and clips that our columns are means over, by data set."""
    sentences = []
    for dataset in dict.fromkeys(row.dataset for row in rows):
        mine = [row.cells for row in rows if row.dataset == dataset]
        counts: list[str] = []
        for column in table.columns:
            found = [cells[column.id] for cells in mine if column.id in cells and not column.mean_of]
            if not found:
                continue
            least = min(found, key=lambda cell: cell.cases)
            if column.legs:
                sets = f"{count(least.cases, 'window')} in each set, {count(least.clips, 'clip')}"
                counts.append(f"{column.id}: {sets}, {count(least.pairs, 'structure')} of targets")
            else:
                pairs = f"{least.pairs} of {len(column.pairs)}" if column.pairs else f"{least.pairs}"
                clips = f"{least.clips} of {table.clips}" if column.pairs else f"{least.clips}"
                counts.append(f"{column.label}: {count(least.cases, 'case')}, pairs {pairs}, clips {clips}")
        if counts:
            sentences.append(f"n, {dataset}: {'; '.join(counts)}.")
    return sentences
