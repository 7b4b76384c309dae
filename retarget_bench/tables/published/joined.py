"""Published tables joined with our results: for ``bench table --paper``, ablations and pages."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

from retarget_bench import defaults
from retarget_bench.analysis.selection import Selection, group_of_bodies
from retarget_bench.errors import BenchError
from retarget_bench.results import case_metadata
from retarget_bench.results.result_matrix import ResultMatrix, result_matrices
from retarget_bench.results.store import ResultPaths
from retarget_bench.tables.model import Cell, Footnotes, Group, Row, Table
from retarget_bench.tables.model import Column as Heading
from retarget_bench.tables.published.our_sets import of_sets
from retarget_bench.tables.published.ours import OurRow, of_cases
from retarget_bench.tables.published.printed import COUNTED, STRUCTURE, Column, Number, PublishedTable
from retarget_bench.tables.requested import others

PRINTED = "printed"
NOT_PRINTED = "not printed in the paper"
READING = (
    f"Rows marked '{PRINTED}' are the paper's numbers; all others were computed here, under the protocol "
    "that each column names, and say which variant of a published method they are ('as published' is about "
    "settings, not about weights). Nothing is ranked. In a column ours are means over the same cases, but "
    "for rows that say otherwise."
)
OUR_STRUCTURES = "structures of these results"


def joined(
    table: PublishedTable,
    places: Sequence[ResultPaths],
    select: Selection,
    bodies: str = "",
    known_as: Mapping[str, str] | None = None,
) -> Table:
    """A published table with our results in it: the printed rows in their order, then ours by name.

    A group for each block of columns. Without results the printed rows stand alone.
    bodies: of ``selection.BODIES``, or ``all``; "": people, or all where there are none.
    known_as: label of ours -> the row that it is trained for, which it then stands under.
    Raises BenchError for methods or bodies that there are none of.
    """
    hints: list[str] = []
    if table.of_sets:
        if bodies:
            raise BenchError(
                "this table is between bodies on two legs and on four by itself; leave --bodies"
            )
        ours, counts = of_sets(table, replace(select, apart=False).parts(result_matrices(places)))
    else:
        matrices, hints = _of_bodies(select.parts(result_matrices(places)), bodies, table)
        table = _with_structures(table, matrices)
        ours, counts = of_cases(table, matrices)
    page = _Page(table, ours, known_as or {})
    groups = tuple(page.groups())
    why = dict.fromkeys(column.missing for column in table.columns)
    alone = f"Ours have no number here: {'; '.join(why)}."
    if any(column.value_id for column in table.columns):
        alone = "None of the results here has a case that this table asks for."
    no_results = () if ours else (alone,)
    copied = any(row.label.partition("[")[0] == defaults.COPYING for row in ours)
    if ours and not copied:
        hints.append(
            f"Read this beside the row of copied rotations, which bench run {defaults.COPYING} adds."
        )
    notes = (*table.notes, *no_results, *page.left_out(), *counts)
    return Table(
        table.title,
        groups,
        notes=notes,
        footnotes=tuple(page.footnotes.sentences),
        reading=READING,
        hints=tuple(hints),
    )


def _of_bodies(
    matrices: Sequence[ResultMatrix], bodies: str, table: PublishedTable
) -> tuple[list[ResultMatrix], list[str]]:
    """The matrices of a group of bodies, and sentences about what is left out or is not done yet."""
    group = group_of_bodies([matrix.bodies for matrix in matrices], bodies)
    shown = [matrix for matrix in matrices if group in ("all", matrix.bodies)]
    cases: dict[str, int] = {}
    for each in matrices:
        if group not in ("all", each.bodies) and any(column.takes(each.split) for column in table.columns):
            cases[each.bodies] = cases.get(each.bodies, 0) + int(each.own.sum())
    hints = [f"{matrix.split}: {matrix.so_far}" for matrix in shown if matrix.so_far]
    return shown, [*hints, *([f"Not shown: {', '.join(others(cases))}."] if cases else [])]


def _with_structures(table: PublishedTable, matrices: Sequence[ResultMatrix]) -> PublishedTable:
    """A table by what training had seen, with a further block: the structures of these results, and a note
    for every trained method that says which of them it knew; any other table as it is."""
    template = next((column for column in table.columns if column.chosen_by == "training"), None)
    if template is None:
        return table
    structures_here: set[str] = set()
    notes: dict[str, None] = {}
    for matrix, row in ((each, row) for each in matrices for row in each.rows):
        structures = case_metadata.read(row.paths).structures
        targets = {structures[info.target] for info in matrix.cases if info.target in structures}
        structures_here |= targets
        if trained := row.header.method.trained_on:
            trained_on = targets & set(trained.get("structures", ()))
            lists = [", ".join(sorted(each)) or "none" for each in (trained_on, targets - trained_on)]
            notes[f"{row.label}: trained on structures {lists[0]}; new to it: {lists[1]}."] = None
    columns = [
        replace(template, label=name, cases=f"{STRUCTURE} {name}", block=OUR_STRUCTURES)
        for name in sorted(structures_here)
    ]
    return replace(table, columns=(*table.columns, *columns), notes=(*table.notes, *notes))


@dataclass(frozen=True)
class _Page:
    """The groups of a table, a group for each block of columns."""

    table: PublishedTable
    rows: Sequence[OurRow]
    known_as: Mapping[str, str]
    footnotes: Footnotes = field(default_factory=Footnotes)

    @property
    def blocks(self) -> dict[str, list[Column]]:
        """Heading -> columns; the paper's first."""
        blocks: dict[str, list[Column]] = {}
        for column in self.table.columns:
            blocks.setdefault(column.block, []).append(column)
        return blocks

    def groups(self) -> Iterator[Group]:
        """The paper's columns, and each block of further ones in which any of ours has a number."""
        for block, columns in self.blocks.items():
            shown = self._rows(columns)
            if not block:
                yield self._group(self.table.source, columns, shown)
            elif shown and not all(self._repeats(row, columns) for row in shown):
                filled = [column for column in columns if any(column.label in row.numbers for row in shown)]
                yield self._group(f"{self.table.source}: {block}", filled, shown)

    def left_out(self) -> list[str]:
        """Sentences on methods without a number in a block of columns, and why."""
        sentences = []
        for block, columns in self.blocks.items():
            shown = self._rows(columns)
            if lacking := [row for row in self.rows if row not in shown]:
                why = dict.fromkeys(row.cells[column.label].reason for row in lacking for column in columns)
                labels = ", ".join(dict.fromkeys(row.label for row in lacking))
                where = block or "the columns of the paper"
                sentences.append(f"No number in {where}: {labels} ({'; '.join(why)}).")
        return sentences

    def _rows(self, columns: Sequence[Column]) -> list[OurRow]:
        """Our rows with a number in any of these columns."""
        labels = {column.label for column in columns}
        return [row for row in self.rows if labels & row.numbers.keys()]

    def _repeats(self, row: OurRow, columns: Sequence[Column]) -> bool:
        """True for a row whose numbers stand in the paper's columns, too, over as many cases."""
        pairs = ((row.cells[each.label], row.cells.get(each.repeats, Cell(""))) for each in columns)
        return all((one.n, one.value) == (two.n, two.value) for one, two in pairs)

    def _group(self, title: str, columns: Sequence[Column], shown: Sequence[OurRow]) -> Group:
        ours = [(row, self._own(row, columns)) for row in shown]
        ranked: list[Row] = []
        for label, numbers in self.table.rows.items():
            if any(column.label in numbers for column in columns):
                ranked.append(self._printed(label, numbers, columns))
            ranked += [drawn for row, drawn in ours if self.known_as.get(row.label) == label]
        known_as = self.known_as
        ranked += [drawn for row, drawn in ours if not row.mark and row.label not in known_as]
        where = ", ".join(dict.fromkeys(row.where for row in shown))
        return Group(
            title=f"{title}; ours on {where}" if where else title,
            split="",
            columns=tuple(_heading(column) for column in columns),
            ranked=tuple(ranked),
            unranked=tuple(drawn for row, drawn in ours if row.mark and row.label not in known_as),
            heading="row" if known_as else "method",
        )

    def _printed(self, label: str, numbers: Mapping[str, Number], columns: Sequence[Column]) -> Row:
        cells = []
        for column in columns:
            if (number := numbers.get(column.label)) is None:
                cells.append(self.footnotes.missing(NOT_PRINTED))
                continue
            text = f"{number.text} ±{number.spread}" if number.spread else number.text
            note = self.footnotes.number(number.note)
            digits = len(number.text.partition(".")[2])
            cells.append(Cell(text, float(number.text), decimals=digits, reason=number.note, footnote=note))
        counted = any(number.origin == COUNTED for number in numbers.values())
        rebuilt = dict.fromkeys(number.method for number in numbers.values() if number.method)
        about = f"here: {', '.join(rebuilt)}" if rebuilt else ""
        return Row(f"{label} ({COUNTED if counted else PRINTED})", "", tuple(cells), "", about)

    def _own(self, row: OurRow, columns: Sequence[Column]) -> Row:
        row_cells = (row.cells[column.label] for column in columns)
        cells = [replace(cell, footnote=self.footnotes.number(cell.reason)) for cell in row_cells]
        over = {
            (cell.n, row.common.get(column.label, cell.n))
            for column, cell in zip(columns, cells, strict=True)
            if cell.value is not None
        }
        (n, total) = over.pop() if len(over) == 1 else (0, 0)
        counted = "" if self.table.of_sets or not n else f"{n}" if n == total else f"{n}/{total}"
        if row.label in self.known_as:
            return Row(self.known_as[row.label], row.mark, tuple(cells), counted, row.label)
        label = f"{row.label} ({row.about})" if row.about else row.label
        label += f", {row.where}" if len({each.where for each in self.rows}) > 1 else ""
        return Row(label, row.mark, tuple(cells), counted)


def _heading(column: Column) -> Heading:
    """A column of the model. Less is better in all that we have a value for."""
    meaning = f"protocol {column.value_id}, mean over {column.over}" if column.value_id else ""
    return Heading(column.label, column.label, column.unit, "lower" if column.value_id else "none", meaning)
