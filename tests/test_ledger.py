"""The ledger: as committed, complete, and its verdicts."""

from __future__ import annotations

import re
from collections import Counter
from pathlib import Path

import pytest

from retarget_bench.errors import FileError
from tools import ledger
from tools.ledger import printed
from tools.ledger.judging import Entry, Judge, Reason, TableFacts
from tools.ledger.measured import result_tables
from tools.ledger.printed import PrintedColumn, PrintedNumber, PrintedTable

THREE_PAPERS = ("pan-", "pan ", "humot-", "correspondence-free-", "smrm ")
"""How the names of their tables begin."""

PAGE = """
## Toy, Table 1

| method | G → G ↓<br>heights | G ↔ H ↓<br>heights | mean ↓<br>heights | n |
|---|---:|---:|---:|---:|
| Toy (printed) | 0.10 | 0.20 | 0.15 |  |
| copy\\_rotations (root rule hip\\_height) | {number} ±{spread} | 0.20 | 0.15 | {clips} |
| *common cases* | {clips} | {clips} |  |  |

### Toy, Table 1: the same on all pairs of the data at hand

| method | all self ↓<br>heights |
|---|---:|
| copy\\_rotations (root rule hip\\_height) | 0.33 |
| ik | 0.44<br>0.40–0.50 |

- n, toys (a part): people: G → G: {clips} cases, pairs 1 of 1, clips {clips} of 106; \
G ↔ H, mean two: 9 cases, pairs 1 of 2, clips 9 of 106; all self: 5 cases, pairs 5, clips 5.
"""
SELF = PrintedColumn("g", "G → G", "heights", other="all self")
PAIRS = PrintedColumn("gh", "G ↔ H", "heights")
MEAN = PrintedColumn("mean", "mean", "heights", parts=("G → G", "G ↔ H"))


def entry(
    folder: Path,
    column: PrintedColumn,
    method: str = "copy_rotations",
    number: float = 0.10,
    spread: float = 0.02,
    clips: int = 106,
) -> Entry:
    """The entry of a printed 0.1 where ours is a number over some of 106 clips."""
    (folder / "toy.md").write_text(PAGE.format(number=number, spread=spread, clips=clips), encoding="utf-8")
    shown = PrintedNumber(0.10, None, "0.10")
    table = PrintedTable("toy", "Toy, Table 1", "Toy, Table 1", (column,), {"Toy": {column.id: shown}})
    reasons = (Reason(differs="of what it learned"), Reason(rows=("Other",), differs="no"))
    facts = TableFacts(
        table="toy", prose="", results=("toy.md",), ours={"Toy": {column.id: method}}, reasons=reasons
    )
    (found,) = Judge(table, facts, {"toy.md": result_tables(folder / "toy.md")}).entries()
    return found


def everything() -> list[Entry]:
    return [each for paper in ledger.papers() for table in paper.tables for each in table.entries()]


def test_the_committed_page_is_up_to_date() -> None:
    assert ledger.PAGE.read_text(encoding="utf-8") == ledger.written(), (
        "numbers, weights or reasons have changed: write the page again with python -m tools.ledger"
    )


def test_every_printed_number_of_the_papers_stands_on_the_page_exactly_once() -> None:
    expected: Counter[tuple[str, ...]] = Counter()
    for name in printed.names():
        if name.startswith(THREE_PAPERS):
            table = printed.table(name)
            columns = {each.id: each for each in table.columns}
            for row, numbers in table.rows.items():
                for key, number in numbers.items():
                    label, unit = columns[key].label, columns[key].unit
                    shown = label + (f" [{unit}]" if unit != "1" else "")
                    expected[table.title, row, shown, number.text] += 1
    found: Counter[tuple[str, ...]] = Counter()
    for section in ledger.PAGE.read_text(encoding="utf-8").split("\n### ")[1:]:
        title, *lines = section.splitlines()
        rows = [line.replace("\\*", "*")[2:].split(" | ") for line in lines if line.startswith("| ")]
        found.update((title, *row[:3]) for row in rows if row[0] not in ("row", "---"))
    assert found == expected
    assert set(found.values()) == {1}


def test_as_many_numbers_as_the_papers_print() -> None:
    """Counted in the papers: tables, and sizes, times and examples of the text."""
    counts = {paper.title: sum(len(each.entries()) for each in paper.tables) for paper in ledger.papers()}
    assert list(counts.values()) == [55, 93, 110]


def test_an_ablation_that_repeats_published_numbers_repeats_them_exactly() -> None:
    assert {"humot losses", "smrm table2", "smrm table3"} == printed.REPEATS
    for which in ("table2", "table3"):
        one, two = (printed.table(name) for name in (f"smrm {which}", f"correspondence-free-{which}"))
        assert [[n.text for n in row.values()] for row in one.rows.values()] == [
            [n.text for n in row.values()] for row in two.rows.values()
        ]
        assert list(one.rows) == list(two.rows)
    rows = printed.table("humot losses").rows
    tables = {
        "Self": "humot-table3",
        "Intra-structural": "humot-table4",
        "Cross-structural": "humot-table5",
    }
    for label, table in tables.items():
        published = printed.table(table).rows
        for row, numbers in rows.items():
            assert numbers[label].value == published[row]["Overall"].value, (row, label)


def test_everything_that_is_not_reproduced_has_a_reason() -> None:
    assert [each for each in everything() if (each.word == "reproduced") is bool(each.because)] == []


def test_no_table_is_explained_in_more_than_three_sentences() -> None:
    for paper in ledger.facts():
        for table in paper.tables:
            assert 1 <= len(re.findall(r"[.!?](?:\s|$)", table.prose)) <= 3, table.table


def test_reasons_and_methods_are_of_rows_and_columns_that_there_are() -> None:
    for paper in ledger.facts():
        for facts in paper.tables:
            table = printed.table(facts.table)
            columns = {each.id for each in table.columns}
            assert {*facts.ours, *facts.also} <= set(table.rows), facts.table
            for each in facts.reasons:
                assert set(each.rows) <= set(table.rows), facts.table
                assert set(each.columns) <= columns, facts.table
            for known in facts.elsewhere:
                assert known.column in table.rows[known.row], facts.table


@pytest.mark.parametrize(
    ("number", "spread", "clips", "word"),
    [
        (0.104, 0.02, 106, "reproduced"),
        (0.106, 0.02, 106, "differs"),  # beyond 5 %
        (0.094, 0.02, 106, "differs"),
        (0.104, 0.02, 53, "cannot be told"),  # as near, but a half of the clips is no whole
        (0.106, 0.0218, 53, "differs"),  # two standard errors: 0.00599
        (0.106, 0.0219, 53, "cannot be told"),  # 0.00602
        (0.104, 0.001, 53, "cannot be told"),  # significant, but within 5 %
    ],
)
def test_verdicts_on_the_same_pairs(
    number: float, spread: float, clips: int, word: str, tmp_path: Path
) -> None:
    found = entry(tmp_path, SELF, number=number, spread=spread, clips=clips)
    assert found.word == word
    assert found.ratio == pytest.approx(number / 0.10)
    assert found.on == f"toys, 1 of 1 pairs, {clips} of 106 clips"
    if word == "differs":
        assert found.because == "of what it learned"
    if word == "cannot be told":
        assert found.because == "53 of 106 clips do not tell the two apart"


def test_a_part_of_the_pairs_tells_nothing(tmp_path: Path) -> None:
    for column, said in ((PAIRS, "1 of 2 pairs, 9 of 106 clips"), (MEAN, "2 of 3 pairs, 106 of 106 clips")):
        found = entry(tmp_path, column)
        assert (found.word, found.because) == ("cannot be told", f"only {said} are at hand")
        assert found.ratio is None


def test_other_data_tell_nothing(tmp_path: Path) -> None:
    found = entry(tmp_path, SELF, "ik")
    assert (found.ours, found.ratio) == ("0.44", None)
    assert (found.word, found.because) == ("cannot be told", "ours is on other data")
    assert found.on == "toys, 5 pairs, 5 clips"


def test_a_method_without_a_number_is_named(tmp_path: Path) -> None:
    found = entry(tmp_path, SELF, "san")
    assert (found.word, found.ours) == ("cannot be told", "")
    assert found.because == "no table of ours has `san` in this column"


def test_a_page_without_tables_is_refused(tmp_path: Path) -> None:
    (tmp_path / "empty.md").write_text("nothing", encoding="utf-8")
    with pytest.raises(FileError, match="holds no table of results"):
        result_tables(tmp_path / "empty.md")
    with pytest.raises(FileError, match="cannot be read"):
        result_tables(tmp_path / "none.md")
