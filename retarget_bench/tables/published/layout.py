"""A published table with our rows under the printed ones, as a table that every renderer can draw."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

from retarget_bench.tables.model import Cell, Column, Footnotes, Group, Row, Table, count
from retarget_bench.tables.published.own import Counts, OwnCell, OwnRow, OwnRows
from retarget_bench.tables.published.published_tables import PublishedColumn, PublishedRow, PublishedTable

PRINTED = "printed"
COUNTED = "counted"
NOT_PRINTED = "not printed in the paper"
OTHER_CASES = "these results have no case of this column"
OTHER_PAIRS = "the pairs are of Mixamo's test set, and these results have none of them"
READING = (
    f"Rows marked '{PRINTED}' are the paper's numbers; all others were computed here, under the protocol "
    "that each column names, and say which variant of a published method they are ('as published' is about "
    "settings, not about weights). Ours stand by name; nothing is ranked. "
)
CASES = (
    "In a column all of ours are means over the same cases (counted as n or as common cases), but for rows "
    "set apart, which answered fewer."
)
SETS = "In a column all of ours stand against the same real motion, but for numbers with a footnote."


def paper_table(table: PublishedTable, parts: Sequence[OwnRows]) -> Table:
    """The printed rows in their order, then ours by name, then controls; nothing is ranked.

    A group for each block of columns, data set and group of bodies. Rows, columns and blocks of ours
    without any number are left out.
    """
    page = _Page(table, parts)
    groups = tuple(page.groups())
    return Table(
        title=table.title,
        groups=groups,
        notes=(
            *table.notes[:1],
            *caveats(table, parts),
            *table.notes[1:],
            *page.empty(),
            *_counts(table, parts),
        ),
        footnotes=tuple(page.footnotes.sentences),
        reading=READING + (SETS if table.of_sets else CASES),
    )


@dataclass(frozen=True)
class _Page:
    table: PublishedTable
    parts: Sequence[OwnRows]
    footnotes: Footnotes = field(default_factory=Footnotes)

    def groups(self) -> list[Group]:
        """The blocks: the paper's own columns first, with the printed rows above ours of the first data."""
        made = []
        for block in dict.fromkeys(column.block for column in self.table.columns):
            shown = [
                part for part in self.parts if self._has(part, block) and not self._repeats(block, part)
            ]
            printed = _prints(self.table, block)
            if printed:
                made.append(self._group(block, shown[0] if shown else None, printed=True))
            made += [self._group(block, part) for part in shown[printed:]]
        return made

    def empty(self) -> list[str]:
        """A sentence on the blocks beside the paper's own that no row has a number in."""
        found: dict[str, list[str]] = {}
        for block in dict.fromkeys(column.block for column in self.table.columns if column.block):
            if self.parts and not any(self._has(part, block) for part in self.parts):
                found.setdefault(self._why(_columns(self.table, block)), []).append(block)
        return [
            f"Left out, since nothing has a number in it: {'; '.join(each)} ({why})."
            for why, each in found.items()
        ]

    def _why(self, columns: Sequence[PublishedColumn]) -> str:
        """The reasons why no row of ours has a number in any of these columns."""
        said = [
            column.missing or row.reasons.get(column.id, "")
            for part in self.parts
            for row in part.rows
            for column in columns
        ]
        other = OTHER_PAIRS if any(column.pairs for column in columns) else OTHER_CASES
        return (
            "; ".join(_merged([each for reason in said if reason for each in reason.split("; ")])) or other
        )

    def _has(self, part: OwnRows, block: str) -> bool:
        asked = [column.id for column in _columns(self.table, block)]
        return any(each in row.cells for row in part.rows for each in asked)

    def _repeats(self, block: str, part: OwnRows) -> bool:
        """True for a block whose every number stands in the first block, too, over the same cases."""

        def same(row: OwnRow, column: PublishedColumn) -> bool:
            one, two = row.cells.get(column.repeats), row.cells.get(column.id)
            return (one and one.over) == (two and two.over)

        mine = _columns(self.table, block)
        return bool(block) and all(
            column.repeats and same(row, column) for row in part.rows for column in mine
        )

    def _group(self, block: str, part: OwnRows | None, *, printed: bool = False) -> Group:
        """The rows of one data set and group of bodies, if any, below the printed ones, where wanted."""
        columns = [
            column
            for column in _columns(self.table, block)
            if printed or (part and any(column.id in row.cells for row in part.rows))
        ]
        theirs = [self._printed(row, columns) for row in self.table.rows] if printed else []
        theirs += [_counted_row(row, columns) for row in self.table.counted] if printed else []
        ours, apart, never = self._rows(part, columns) if part else ([], [], [])
        lacking = [f"Ours have no number here: {self._why(columns)}."] if self.parts and not part else []
        alike = self.table.of_sets or (len({row.n for row in ours}) == 1 and ours[0].n)
        common = [part.common.get(column.id) for column in columns] if part and not alike else []
        return Group(
            title=self._title(block, part, printed),
            split="",
            columns=tuple(_column(self.table, column) for column in columns),
            ranked=(*theirs, *ours),
            unranked=(*apart, *never),
            common=tuple(common),
            below=(*lacking, *(self._lacking(part, columns) if part else ())),
        )

    def _title(self, block: str, part: OwnRows | None, printed: bool) -> str:
        paper = f"{self.table.paper}: {block}" if block else self.table.paper
        if part is None:
            return paper
        return f"{paper}; ours on {part.where}" if printed else f"{paper} ({part.where})"

    def _printed(self, row: PublishedRow, columns: Sequence[PublishedColumn]) -> Row:
        cells = []
        for column in columns:
            if numbers := row.values.get(column.id):
                cells.append(_cell(numbers[0], (*numbers[1:], None)[0], decimals(self.table, column)))
            else:
                cells.append(self.footnotes.missing(NOT_PRINTED))
        return Row(f"{row.method} ({PRINTED})", "", tuple(cells), "")

    def _rows(
        self, part: OwnRows, columns: Sequence[PublishedColumn]
    ) -> tuple[list[Row], list[Row], list[Row]]:
        """Rows over the common cases; those over fewer; and controls."""
        compared, apart, never = [], [], []
        for row in part.rows:
            mine = [row.cells[column.id] for column in columns if column.id in row.cells]
            if not mine or row.beside:
                continue
            if row.mark:
                never.append(self._own(part, row, columns))
            elif all(cell.common for cell in mine):
                compared.append(self._own(part, row, columns))
            else:
                apart.append(self._own(part, row, columns, apart=True))
        return compared, apart, never

    def _lacking(self, part: OwnRows, columns: Sequence[PublishedColumn]) -> list[str]:
        """A sentence on the methods without a number in any of these columns."""
        found: dict[str, list[str]] = {}
        for row in part.rows:
            if not (row.beside or any(column.id in row.cells for column in columns)):
                ours = (column for column in columns if not column.missing)
                why = (row.reasons.get(column.id, OTHER_CASES) for column in ours)
                found.setdefault("; ".join(dict.fromkeys(why)), []).append(row.label)
        return [f"No number here: {', '.join(labels)} ({why})." for why, labels in found.items()]

    def _own(
        self, part: OwnRows, row: OwnRow, columns: Sequence[PublishedColumn], *, apart: bool = False
    ) -> Row:
        cells = []
        for column in columns:
            found = row.cells.get(column.id)
            if found is None:
                cells.append(
                    self.footnotes.missing(column.missing or row.reasons.get(column.id, OTHER_CASES))
                )
                continue
            shown = _cell(found.value, self._spread(found, column), decimals(self.table, column))
            noted = replace(shown, reason=found.note, footnote=self.footnotes.number(found.note))
            cells.append(replace(noted, n=found.over.cases, clips=found.over.clips))
        label = f"{row.label} ({row.variant})" if row.variant else row.label
        label += f", {part.where}" if len(self.parts) > 1 else ""
        mark = row.mark
        if apart:
            mark = f"answered {', '.join(dict.fromkeys(f'{cell.n}' for cell in cells if cell.n))}"
        n = "" if self.table.of_sets else _n(part, row, columns)
        return Row(label, mark, tuple(cells), n)

    def _spread(self, cell: OwnCell, column: PublishedColumn) -> float | None:
        prints = any(len(each.values.get(column.id, ())) > 1 for each in self.table.rows)
        return cell.spread if prints else None


def _counted_row(row: PublishedRow, columns: Sequence[PublishedColumn]) -> Row:
    """A row of counts of ours, with all their digits."""
    cells = []
    for column in columns:
        (number,) = row.values[column.id]
        cells.append(Cell(f"{number}", number, decimals=len(f"{number}".partition(".")[2])))
    return Row(row.method, COUNTED, tuple(cells), "")


def _merged(reasons: Sequence[str]) -> list[str]:
    """Each reason once; of those that differ in their last number, as in ``..., here 3``, the range."""
    found: dict[str, set[int]] = {}
    for reason in reasons:
        start, here, number = reason.rpartition(", here ")
        numbers = found.setdefault(start if here and number.isdigit() else reason, set())
        numbers |= {int(number)} if here and number.isdigit() else set()
    ranges = {
        start: " to ".join(str(each) for each in sorted({min(n), max(n)}))
        for start, n in found.items()
        if n
    }
    return [f"{start}, here {ranges[start]}" if start in ranges else start for start in found]


def _columns(table: PublishedTable, block: str) -> list[PublishedColumn]:
    return [column for column in table.columns if column.block == block]


def _prints(table: PublishedTable, block: str) -> bool:
    """The paper prints a number in this block."""
    asked = [column.id for column in _columns(table, block)]
    return any(each in row.values for row in table.rows for each in asked)


def _n(part: OwnRows, row: OwnRow, columns: Sequence[PublishedColumn]) -> str:
    """The cases of a row, of how many; "" where that differs between its columns."""
    found = set()
    for column in columns:
        if cell := row.cells.get(column.id):
            asked = part.common.get(column.id, cell.over).cases
            found.add(f"{cell.over.cases}" if cell.over.cases == asked else f"{cell.over.cases}/{asked}")
    return found.pop() if len(found) == 1 else ""


def _column(table: PublishedTable, column: PublishedColumn) -> Column:
    mean = f"protocol {column.value}, mean over"
    if column.mean_of:
        labels = {each.id: each.label for each in table.columns}
        meaning = f"mean of {', '.join(labels[each] for each in column.mean_of)}"
    elif column.any_pair:
        meaning = f"{mean} every pair but self pairs"
    elif column.splits:
        splits = (
            f"splits {' and '.join(column.splits)}" if column.splits[1:] else f"split {column.splits[0]}"
        )
        meaning = f"{mean} all cases of {splits}"
    elif column.legs:
        kind = f" of kind {column.kind}" if column.kind else ""
        meaning = f"{column.value} of all answers{kind} on bodies of {column.legs} legs"
    elif column.seen:
        had = "had" if column.seen == "seen" else "did not have"
        meaning = f"{mean} bodies of structures that training {had}"
    elif column.structure:
        meaning = f"{mean} bodies of structure {column.structure}"
    else:
        meaning = f"{mean} {', '.join(column.pairs)}" if column.pairs else ""
    return Column(column.id, column.label, column.unit, "lower", meaning)


def _cell(value: float, spread: float | None, decimals: int) -> Cell:
    text = f"{value:.{decimals}f}" + ("" if spread is None else f" ±{spread:.{decimals}f}")
    return Cell(text, value, decimals=decimals)


def decimals(table: PublishedTable, column: PublishedColumn) -> int:
    """As many as are printed; of columns that nothing is printed in, as many as elsewhere."""
    numbers = [row.values[column.id] for row in table.rows if column.id in row.values]
    if not numbers:
        numbers = [numbers for row in table.rows for numbers in row.values.values()]
    return max(len(repr(number).partition(".")[2]) for each in numbers for number in each)


# ------------------------------------------------------------------------------------------- sentences
def _counts(table: PublishedTable, parts: Sequence[OwnRows]) -> list[str]:
    """Numbers of cases, pairs and clips that our columns are means over, by data set."""
    sentences = []
    for part in parts:
        counts: dict[str, list[str]] = {}
        for column in table.columns:
            over = part.common.get(column.id)
            if over is not None and not column.mean_of:
                counts.setdefault(_counted(table, column, over), []).append(column.label)
        if counts:
            told = "; ".join(f"{', '.join(labels)}: {what}" for what, labels in counts.items())
            sentences.append(f"n, {part.where}: {told}.")
    return sentences


def _counted(table: PublishedTable, column: PublishedColumn, over: Counts) -> str:
    if column.legs:
        sets = f"{count(over.cases, 'window')} in each set, {count(over.clips, 'clip')}"
        return f"{sets}, {count(over.pairs, 'structure')} of targets"
    pairs = f"{over.pairs} of {len(column.pairs)}" if column.pairs else f"{over.pairs}"
    clips = f"{over.clips} of {table.clips}" if column.pairs else f"{over.clips}"
    return f"{count(over.cases, 'case')}, pairs {pairs}, clips {clips}"


def caveats(table: PublishedTable, parts: Sequence[OwnRows]) -> list[str]:
    """Sentences on why our numbers are not comparable with the printed ones."""
    if not parts and table.of_sets:
        return [
            "None of the results is between two legs and four without references: bench run METHOD -d "
            "'puppets[size=default,between=legs]' makes some."
        ]
    if table.counted:
        return ["Ours are counts of the networks as built; no method is run for them."]
    if not any(column.value for column in table.columns):
        why = dict.fromkeys(column.missing for column in table.columns)
        return [f"Ours have no number here: {'; '.join(why)}."]
    if not parts:
        return [
            "None of the results has a case that this table asks for: the pairs are of Mixamo's test set."
        ]
    asked = len({pair for column in table.columns for pair in column.pairs})
    found = []
    for part in parts:
        of_pairs = [column.id for column in table.columns if column.pairs and column.id in part.common]
        clips = max((part.common[each].clips for each in of_pairs), default=0)
        pairs = sum(part.common[each].pairs for each in of_pairs)
        if of_pairs and (clips, pairs) != (table.clips, asked):
            found.append(
                f"{part.where}: {pairs} of the {asked} pairs and {clips} of the {table.clips} "
                "test clips that the paper asks for, so its numbers do not compare with the printed ones."
            )
    return found
