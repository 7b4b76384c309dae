"""Published tables: which cases our rows are over, and who is set apart."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path

import pytest
from click.testing import CliRunner
from stored import VALUES, changed, metadata
from stored import store as stored

from retarget_bench.analysis.selection import Selection
from retarget_bench.cli import group as commands
from retarget_bench.errors import BenchError
from retarget_bench.results import store as records
from retarget_bench.tables.model import Table
from retarget_bench.tables.published.joined import joined
from retarget_bench.tables.published.printed import of_rows, published

PAPERS = {
    key: VALUES["mpjpe_h.world"] | {"label": key} for key in ("humot_mpjpe", "san_code", "restored_cm")
}
PEOPLE = [("ann>bo", f"c{n}") for n in range(8)]
DOGS = [("rex>waldi", f"d{n}") for n in range(4)]
LEGS = {"ann": "2", "bo": "2", "rex": "4", "waldi": "4"}


def store(
    root: Path, split: str, method: str, numbers: dict[tuple[str, str], float | str], **changes
) -> None:
    """``numbers``: (pair, clip) -> the value of every protocol, or the status of a case without one."""
    entries = [
        (*case, dict.fromkeys(PAPERS, number) if isinstance(number, float) else number)
        for case, number in numbers.items()
    ]
    place = changed(stored(root, split, method, entries, **changes), values=PAPERS)
    metadata(place, legs=LEGS)


def all_of(cases: list[tuple[str, str]], number: float | str) -> dict[tuple[str, str], float | str]:
    return dict.fromkeys(cases, number)


def made(root: Path, name: str, bodies: str = "", **choice) -> Table:
    return joined(published(name), records.find_results(root), Selection(variants=True, **choice), bodies)


def rows(table: Table) -> dict[str, tuple[list[str], str]]:
    """Label -> texts of the cells, and n, of rows that are not printed ones."""
    return {
        row.label: ([cell.text for cell in row.cells], row.n)
        for group in table.groups
        for row in group.rows
        if "(printed)" not in row.label
    }


@pytest.fixture
def with_dogs(tmp_path: Path) -> Path:
    """``wide`` is better than ``narrow`` on people, and far off on dogs, which ``narrow`` refuses."""
    store(tmp_path, "intra", "wide", all_of(PEOPLE, 0.1) | all_of(DOGS, 9.0))
    store(tmp_path, "intra", "narrow", all_of(PEOPLE, 0.2) | all_of(DOGS, "unsupported"))
    return tmp_path


def test_people_are_shown_and_who_refuses_dogs_stands_among_them(with_dogs: Path) -> None:
    table = made(with_dogs, "humot-table4")
    assert rows(table) == {"wide": (["0.1000"], "8"), "narrow": (["0.2000"], "8")}
    assert not any(row.mark for group in table.groups for row in group.rows)
    hint = table.hints[0]
    assert "four-legged bodies (4 cases, --bodies four-legged)" in hint
    assert any("data: people: all intra: 8 cases, pairs 1, clips 8" in note for note in table.notes)


def test_rows_say_the_bodies_that_they_are_of(with_dogs: Path) -> None:
    assert rows(made(with_dogs, "humot-table4", "four-legged")) == {"wide": (["9.0000"], "4")}
    both = made(with_dogs, "humot-table4", "all")
    assert "ours on data: people, data: four-legged" in both.groups[1].title
    assert rows(both) == {
        "wide, data: people": (["0.1000"], "8"),
        "narrow, data: people": (["0.2000"], "8"),
        "wide, data: four-legged": (["9.0000"], "4"),
    }
    with pytest.raises(BenchError, match="no case is between bodies of the group 'mixed'"):
        made(with_dogs, "humot-table4", "mixed")


def test_a_case_that_one_method_did_not_answer_is_taken_from_nobody(tmp_path: Path) -> None:
    many = [("ann>bo", f"c{n:02}") for n in range(40)]
    store(tmp_path, "intra", "most", all_of(many[:39], 0.1) | {many[39]: "failed"})
    store(tmp_path, "intra", "all", all_of(many[:39], 0.2) | {many[39]: 40.2})
    store(tmp_path, "intra", "still", all_of(many[:30], 0.3) | all_of(many[30:], "failed"), control=True)
    table = made(tmp_path, "humot-table4")
    by_row = rows(table)
    assert by_row["most"] == (["0.1000"], "39/40")
    assert by_row["all"] == (["1.2000"], "40")
    assert by_row["still"] == (["0.3000"], "30/40")
    assert table.footnotes == ("over the 30 of the 40 common cases that it has",)
    assert any("all intra: 40 cases, pairs 1, clips 40" in note for note in table.notes)
    assert [(row.label, row.mark) for row in table.groups[-1].unranked] == [
        ("most", "answered fewer cases"),
        ("still", "control"),
    ]
    assert "most answered fewer cases; on these all has all intra 0.2000." in table.notes


def test_what_counts_self_pairs_says_where_they_are_missing(tmp_path: Path) -> None:
    values = PAPERS | {"san_code": PAPERS["san_code"] | {"with_self": True}}
    for name, splits in (("both", ("self", "intra")), ("one", ("intra", "cross"))):
        for split in splits:
            store(tmp_path, split, name, all_of(PEOPLE, 0.1))
    for place in records.find_results(tmp_path):
        changed(place, values=values)
    table = made(tmp_path, "pan-table1")
    cells = {row.label: [cell.reason for cell in row.cells] for row in table.groups[-1].rows}
    assert cells["one"] == ["no results on self intra", ""]
    assert cells["both"] == ["", "no results on cross"]
    assert (
        "No number in the columns of the paper: both, one (no results on the paper's pairs)." in table.notes
    )


def test_columns_over_different_cases_say_how_many_each(tmp_path: Path) -> None:
    for name in ("one", "two"):
        store(tmp_path, "self", name, all_of([("ann>ann", "c0")], 0.1))
        store(tmp_path, "intra", name, all_of(PEOPLE, 0.1))
        store(tmp_path, "cross", name, all_of(PEOPLE[:3], 0.1))
    table = made(tmp_path, "pan-table1")
    own = table.groups[-1]
    assert [column.label for column in own.columns] == ["self + intra", "all cross"]
    assert [[cell.n for cell in row.cells] for row in own.rows] == [[9, 3]] * 2
    assert {row.n for row in own.rows} == {""}
    assert any("self + intra: 9 cases" in note and "all cross: 3 cases" in note for note in table.notes)


def test_a_method_without_one_of_the_pairs_of_an_overall_mean_is_set_apart(tmp_path: Path) -> None:
    pairs = ("Goblin_m>Mousey_m", "Goblin_m>Vampire_m")
    cases = [(pair, f"c{n}") for pair in pairs for n in range(3)]
    store(tmp_path, "intra", "whole", all_of(cases, 0.5))
    store(tmp_path, "intra", "half", all_of(cases[:3], 0.1) | all_of(cases[3:], "unsupported"))
    for place in records.find_results(tmp_path):
        facts = asdict(records.read_header(place.header).dataset)
        changed(place, dataset=facts | {"name": "mixamo"})
    table = made(tmp_path, "humot-table4")
    (group,) = table.groups
    assert any("on these whole has" in note and "overall 0.5000" in note for note in table.notes)
    own_rows = [row for row in group.ranked if "printed" not in row.label]
    assert [row.label for row in own_rows] == ["whole"]
    (half,) = group.unranked
    overall = [column.id for column in group.columns].index("overall")
    assert (half.label, half.cells[overall].value) == ("half", pytest.approx(0.1))


def test_methods_are_chosen_and_numbers_are_over_the_cases_of_those(tmp_path: Path) -> None:
    many = [("ann>bo", f"c{n:02}") for n in range(40)]
    store(tmp_path, "intra", "most", all_of(many[:39], 0.1) | {many[39]: {}})
    for name in ("one", "two"):
        store(tmp_path, "intra", name, all_of(many, 0.2))
    store(tmp_path, "intra", "still", all_of(many, 0.3), control=True)
    assert {label: n for label, (_, n) in rows(made(tmp_path, "humot-table4")).items()} == dict.fromkeys(
        ("one", "two", "most", "still"), "39"
    )
    chosen = made(tmp_path, "humot-table4", methods=("ONE", "two"), controls=False)
    assert {label: n for label, (_, n) in rows(chosen).items()} == {"one": "40", "two": "40"}
    with pytest.raises(BenchError, match=r"no results of 'tow' here; did you mean two"):
        made(tmp_path, "humot-table4", methods=("tow",))


def test_the_command_prints_the_papers_numbers_where_there_are_no_results(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    for words in ([], ["-r", str(tmp_path)]):
        result = CliRunner().invoke(commands, ["table", *words, "--paper", "pan-table1"])
        assert result.exit_code == 0
        assert "8.86" in result.output
    refused = CliRunner().invoke(commands, ["table", "-r", "nowhere", "--paper", "pan-table1"])
    assert str(refused.exception) == "there is no folder nowhere"


def test_ours_stand_under_the_rows_that_they_are_trained_for(tmp_path: Path) -> None:
    store(tmp_path, "intra", "one", all_of(PEOPLE, 0.123456))
    store(tmp_path, "intra", "two", all_of(PEOPLE[:4], 0.2) | all_of(PEOPLE[4:], "failed"))
    table = of_rows(("pan-table5",), ["w.o. PAN", "no such row", "ours"], "title", ("a note",), 4)
    known_as = {"one": "w.o. PAN", "two": "no such row"}
    combined = joined(table, records.find_results(tmp_path), Selection(), known_as=known_as)
    (group,) = combined.groups
    assert [(row.label, row.mark, row.n, [cell.text for cell in row.cells]) for row in group.rows] == [
        ("w.o. PAN (printed)", "", "", ["1.19", "2.28"]),
        ("w.o. PAN", "", "8", ["0.1235", "n/a"]),
        ("no such row", "answered fewer cases", "4/8", ["0.2000", "n/a"]),
        ("ours (printed)", "", "", ["0.50", "1.62"]),
    ]
    assert combined.notes[0] == "a note"


def test_trained_on_other_structures_numbers_of_seen_ones_say_how_many_cases(tmp_path: Path) -> None:
    for name, structures in (("one", ["a"]), ("two", ["a", "b"])):
        numbers = all_of(PEOPLE[:3], 0.1) | {("bo>ann", "c9"): 0.5}
        store(tmp_path, "intra", name, numbers, trained_on={"structures": structures})
    (place, _) = records.find_results(tmp_path)
    metadata(place, structure={"bo": "a", "ann": "b"})
    table = made(tmp_path, "humot-table2")
    overall_cells = {
        row.label: next(
            cell
            for cell, column in zip(row.cells, table.groups[0].columns, strict=True)
            if column.id == "overall, seen"
        )
        for row in table.groups[0].rows
        if "printed" not in row.label
    }
    assert {label: cell.n for label, cell in overall_cells.items()} == {
        "one (own weights)": 3,
        "two (own weights)": 4,
    }
    assert len({cell.footnote for cell in overall_cells.values()} - {0}) == 2
