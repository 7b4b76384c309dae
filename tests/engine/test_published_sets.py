"""PAN's Table 3: values of sets on two legs and on four land in the paper's columns, with their floor."""

from __future__ import annotations

from pathlib import Path

import pytest
import stored

from retarget_bench.analysis.selection import Selection
from retarget_bench.evaluation import set_metrics
from retarget_bench.evaluation.set_metrics import SetValue
from retarget_bench.results import store as records
from retarget_bench.results.result_matrix import result_matrices
from retarget_bench.tables.model import Table
from retarget_bench.tables.published import printed
from retarget_bench.tables.published.joined import NOT_PRINTED, joined
from retarget_bench.tables.published.our_sets import of_sets
from retarget_bench.tables.published.ours import OurRow

TABLE = printed.published("pan-table3")
TO_TWO, TO_FOUR = "quadruped → biped", "biped → quadruped"
DECLARED = {
    key: {
        "label": key, "metric": "fid_structure", "unit": "1", "better": "lower", "goal": 1.0, "index": "",
        "with_self": False, "meaning": "", "tolerance": 1e-6,
    }
    for key in ("fid.structure", "kid")
}  # fmt: skip


def value(structure: str, number: float | None, kind: str = "", **changes) -> SetValue:
    facts = {
        "value_id": "fid.structure",
        "n": 1200,
        "clips": 30,
        "floor": 5.0,
        "real": "r",
    } | changes
    return SetValue(structure=structure, value=number, kind=kind, **facts)


def store(
    root: Path,
    name: str,
    values: list[SetValue],
    split: str = "cross",
    file: str = "",
    control=False,
    **changes,
) -> None:
    place = stored.store(root, split, file or name, [], name=name, label=name, control=control)
    stored.changed(place, **{"set_values": DECLARED, "four_legged": ["dog"], **changes})
    set_metrics.write(place, values)


def rows(root: Path) -> dict[str, OurRow]:
    matrices = Selection(variants=True, apart=False).parts(result_matrices(records.find_results(root)))
    own_rows, _ = of_sets(TABLE, matrices)
    return {row.label: row for row in own_rows}


def drawn(root: Path, *methods: str) -> Table:
    return joined(TABLE, records.find_results(root), Selection(methods, variants=True))


def test_directions_are_told_by_the_targets_legs_and_structures_are_averaged(tmp_path: Path) -> None:
    store(
        tmp_path, "mine", [value("dog", 40.0), value("man", 10.0), value("child", 30.0, n=1100, clips=20)]
    )
    by_label = rows(tmp_path)
    cells = by_label["mine"].cells
    assert cells[TO_FOUR].value == 40.0
    assert (cells[TO_TWO].value, cells[TO_TWO].n, cells[TO_TWO].clips) == (20.0, 1100, 20)
    floor = by_label["floor"]
    assert floor.mark
    assert {key: cell.value for key, cell in floor.numbers.items()} == {TO_TWO: 5.0, TO_FOUR: 5.0}


def test_kinds_and_kid_have_columns_of_their_own(tmp_path: Path) -> None:
    store(
        tmp_path,
        "mine",
        [value("dog", 1.0, "idle"), value("dog", 2.0, "sit"), value("man", 3.0, "move", value_id="kid")],
    )
    cells = rows(tmp_path)["mine"].cells
    assert {key: cell.value for key, cell in cells.items() if cell.value is not None} == {
        "B → Q, idle": 1.0,
        "B → Q, sit": 2.0,
        "Q → B, move, KID": 3.0,
    }


def test_what_has_no_number_says_why(tmp_path: Path) -> None:
    why = "fid.structure needs 1024 windows in each set, here 85"
    store(tmp_path, "mine", [value("dog", None, reason=why, floor=None), value("man", 9.0)])
    table = drawn(tmp_path)
    (own,) = (row for row in table.groups[0].ranked if row.label == "mine")
    assert [cell.value for cell in own.cells] == [9.0, None]
    assert own.cells[1].reason == why
    assert why in table.footnotes
    assert NOT_PRINTED not in table.footnotes
    assert any("quadruped → biped: 1200 windows in each set" in note for note in table.notes)


def test_results_with_references_and_later_seeds_are_not_of_this_table(tmp_path: Path) -> None:
    store(tmp_path, "itself", [value("dog", 1.0)], split="self")
    store(tmp_path, "paired", [value("dog", 1.0)], four_legged=None)
    store(tmp_path, "mine", [value("dog", 2.0)])
    store(tmp_path, "mine", [value("dog", 3.0)], file="mine.seed-1", seeds=[1])
    by_label = rows(tmp_path)
    assert set(by_label) == {"mine", "floor"}
    assert by_label["mine"].cells[TO_FOUR].value == 2.0


def test_a_number_of_other_windows_or_fewer_structures_says_so(tmp_path: Path) -> None:
    for name in ("a", "b"):
        store(tmp_path, name, [value("dog", 2.0), value("man", 3.0), value("child", 4.0)])
    store(tmp_path, "lacking", [value("dog", 2.0, real="other", floor=50.0), value("man", 3.0)])
    cells = rows(tmp_path)["lacking"].cells
    assert "other windows" in cells[TO_FOUR].reason
    assert "1 structure fewer" in cells[TO_TWO].reason
    assert not any(cell.reason for cell in rows(tmp_path)["a"].numbers.values())
    assert rows(tmp_path)["floor"].cells[TO_FOUR].value == 5.0, "that of most methods"


def test_controls_stand_apart_and_the_papers_rows_only_where_it_prints(tmp_path: Path) -> None:
    store(tmp_path, "still", [value("dog", 7.0), value("dog", 1.0, "idle")], control=True)
    table = drawn(tmp_path)
    first, *others = table.groups
    assert [row.label for row in first.ranked] == [
        f"{name} (printed)" for name in ("NKN*", "PMnet*", "SAN", "PAN")
    ]
    assert [cell.text for cell in first.ranked[-1].cells] == ["51.68", "132.76"]
    assert all(not group.ranked for group in others)
    assert {row.label for row in first.unranked} == {"still", "floor"}
    assert any("cannot be compared" in note for note in table.notes)


@pytest.mark.parametrize("column", TABLE.columns, ids=lambda column: column.label)
def test_every_column_is_of_a_direction(column: printed.Column) -> None:
    legs, _, kind = column.cases.partition(" legs")
    assert legs == {"quadruped": "2", "Q": "2", "biped": "4", "B": "4"}[column.label.partition(" ")[0]]
    assert kind.strip() == next((kind for kind in ("idle", "move", "sit") if kind in column.label), "")
    assert column.value_id == ("kid" if column.label.endswith("KID") else "fid.structure")
