"""Published tables: the numbers agree with themselves, and ours land in the right places."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from retarget_bench.analysis.selection import Selection
from retarget_bench.api import CaseInfo, optional
from retarget_bench.errors import BenchError
from retarget_bench.files import write_csv
from retarget_bench.plugins import registry
from retarget_bench.plugins.spec import Spec
from retarget_bench.results import store as records
from retarget_bench.results.header import SCHEMA, STATUSES, MethodInfo, parsed
from retarget_bench.results.result_matrix import result_matrices
from retarget_bench.results.store import CaseResult, ResultPaths
from retarget_bench.tables.published import published_tables
from retarget_bench.tables.published.layout import caveats, paper_table
from retarget_bench.tables.published.own import Counts, OwnRow, OwnRows, variant
from retarget_bench.tables.published.own_rows import own_rows
from retarget_bench.tables.published.own_set_rows import own_set_rows

ALL = published_tables.names()
VALUES = {
    value: {
        "label": value, "unit": unit, "better": "lower", "goal": 1.0, "index": "", "with_self": False,
        "meaning": "", "tolerance": 1e-6, "formula": "",
    }
    for value, unit in (("humot_mpjpe", "1"), ("san_code", "1"), ("mpjpe_h.world", "% of height"))
}  # fmt: skip


def store(
    root: Path, name: str, split: str, numbers: dict[tuple[str, str], float], file: str = "", **changes
) -> None:
    """``numbers``: (pair, clip) -> the value of every protocol. All targets are two metres tall."""
    infos, entries = [], []
    for (pair, clip), number in numbers.items():
        source, target = pair.split(">")
        infos.append(CaseInfo(f"mixamo/{pair}/{clip}", "retarget", split, source, target, clip, "", 10))
        entries.append(CaseResult(infos[-1].id, "ok", values=dict.fromkeys(VALUES, number)))
    header = {
        "schema": SCHEMA,
        "keys": {},
        "method": {
            "name": name,
            "label": name,
            "control": False,
            "privileged": [],
            "stochastic": False,
        },
        "dataset": {"name": "mixamo", "label": "mixamo", "content": "c", "notes": []},
        "metrics": {},
        "values": VALUES,
        "counts": {"asked": len(entries)} | {s: len(entries) * (s == "ok") for s in STATUSES},
        "problems": [],
    }
    for key, change in changes.items():
        header[key] = {**header.get(key, {}), **change} if isinstance(change, dict) else change
    place = ResultPaths(root, header["dataset"]["label"], "retarget", split, file or name)
    place.folder.mkdir(parents=True, exist_ok=True)
    records.write_results(place, parsed(header), entries, infos)
    targets = sorted({info.target for info in infos})
    write_csv(place.folder / "cases.heights.csv", ("target", "height"), [(name, "2") for name in targets])


def ours(name: str, *roots: Path) -> list[OwnRows]:
    """Our rows of a table from all results in these folders."""
    table = published_tables.published(name)
    places = [place for root in roots for place in records.find_results(root)]
    if table.of_sets:
        return own_set_rows(table, places)
    return own_rows(table, Selection(variants=True).parts(result_matrices(places)))


def rows_of(name: str, *roots: Path) -> tuple[OwnRow, ...]:
    """Likewise, where they are of one data set and group of bodies."""
    (part,) = ours(name, *roots)
    return part.rows


@pytest.mark.parametrize("name", ["humot-table3", "humot-table4", "humot-table5"])
def test_printed_overall_is_what_its_columns_say(name: str) -> None:
    """The mean of the pairs' means; spread: variance within pairs and of their means (0.0002: rounding)."""
    table = published_tables.published(name)
    *parts, overall = (column for column in table.columns if not column.block)
    assert overall.mean_of == tuple(column.id for column in parts)
    for row in table.rows:
        means, spreads = np.array([row.values[column.id] for column in parts]).T
        value, spread = row.values[overall.id]
        assert value == pytest.approx(means.mean(), abs=2e-4), row.method
        assert spread == pytest.approx(np.sqrt((spreads**2).mean() + means.var()), abs=3e-4), row.method


@pytest.mark.parametrize("name", ALL)
def test_every_printed_number_has_a_column(name: str) -> None:
    table = published_tables.published(name)
    columns = {column.id for column in table.columns}
    for row in table.rows:
        assert set(row.values) <= columns
        assert all(number > 0 for numbers in row.values.values() for number in numbers)
    for column in table.columns:
        assert bool(column.value) + bool(column.missing) + bool(column.mean_of) == 1, column.id


def test_pan_counts_self_pairs_and_humot_does_not() -> None:
    pairs = {column.id: column.pairs for column in published_tables.published("pan-table1").columns}
    assert len(pairs["intra"]) == len(set(pairs["intra"])) == 16
    assert sum(pair.split(">")[0] == pair.split(">")[1] for pair in pairs["intra"]) == 4
    assert len(pairs["cross"]) == 4
    asked = [pair for column in published_tables.published("humot-table4").columns for pair in column.pairs]
    assert len(asked) == len(set(asked)) == 12
    assert not [pair for pair in asked if pair.split(">")[0] == pair.split(">")[1]]


def test_our_numbers_land_in_the_papers_columns(tmp_path: Path) -> None:
    store(tmp_path, "mine", "intra", {
        ("Goblin_m>Mousey_m", "a"): 0.1, ("Mousey_m>Goblin_m", "a"): 0.3, ("Goblin_m>Mousey_m", "b"): 0.6,
        ("Goblin_m>Vampire_m", "a"): 0.5, ("Aj>BigVegas", "a"): 9.0,
    })  # fmt: skip
    store(tmp_path, "mine", "self", {("Goblin_m>Goblin_m", "a"): 0.2})
    table = published_tables.published("humot-table4")
    (part,) = ours("humot-table4", tmp_path)
    (row,) = part.rows
    pair = row.cells["G<->Mo"]
    # clip a: both directions, mean 0.2; clip b: 0.6
    assert (pair.value, pair.over) == (pytest.approx(0.4), Counts(3, 2, 2))
    assert pair.spread == pytest.approx(np.std([0.1, 0.3, 0.6]))
    assert row.cells["Overall"].value == pytest.approx((0.4 + 0.5) / 2)
    assert row.cells["Overall"].spread == pytest.approx(np.std([0.1, 0.3, 0.6, 0.5]))
    assert "Mr<->V" not in row.cells
    (pan,) = rows_of("pan-table1", tmp_path)
    assert pan.cells["intra"].over.cases == 5  # the self pair counts, Aj > BigVegas does not
    (sentence,) = caveats(table, [part])
    assert "3 of the 12 pairs and 2 of the 106 test clips" in sentence


def test_a_case_under_several_seeds_is_one_case(tmp_path: Path) -> None:
    pairs = [("BigVegas>Goblin_m", "a"), ("BigVegas>Goblin_m", "b")]
    for seed, numbers in enumerate([(0.1, 0.2), (0.3, 0.6)]):
        file = f"mine.seed-{seed}" if seed else "mine"
        store(tmp_path, "mine", "cross", dict(zip(pairs, numbers, strict=True)), file, seeds=[seed])
    (row,) = rows_of("humot-table5", tmp_path)
    cell = row.cells["B->G"]
    assert (cell.value, cell.over) == (pytest.approx(0.3), Counts(2, 2, 1))
    assert cell.spread == pytest.approx(np.std([0.2, 0.4]))


def test_one_method_in_two_folders_is_two_rows(tmp_path: Path) -> None:
    for folder, number in (("old", 0.1), ("new", 0.3)):
        store(tmp_path / folder, "mine", "cross", {("BigVegas>Goblin_m", "a"): number})
    rows = rows_of("humot-table5", *(tmp_path / folder for folder in ("old", "new", "new")))
    found = {row.label: row.cells["B->G"].value for row in rows}
    assert found == {f"mine ({tmp_path / 'old'})": 0.1, f"mine ({tmp_path / 'new'})": 0.3}


def test_numbers_of_an_older_metric_are_left_out(tmp_path: Path) -> None:
    for name, version, made in (("then", "1", "2026-01-01"), ("now", "2", "2026-06-01")):
        values = {"humot_mpjpe": {**VALUES["humot_mpjpe"], "metric": "papers"}}
        store(
            tmp_path, name, "cross", {("BigVegas>Goblin_m", "a"): 0.1},
            values=values, metrics={"papers": version}, date=made,
        )  # fmt: skip
    rows = rows_of("humot-table5", tmp_path)
    assert [row.label for row in rows] == ["now"]


def test_other_data_only_fill_columns_that_take_any_pair(tmp_path: Path) -> None:
    data = {"name": "folder", "label": "folder"}
    store(tmp_path, "mine", "intra", {("Goblin_m>Mousey_m", "a"): 0.1}, dataset=data)
    (row,) = rows_of("humot-table4", tmp_path)
    assert {key: cell.value for key, cell in row.cells.items()} == {"own": 0.1}
    (row,) = rows_of("correspondence-free-table4", tmp_path)
    assert {key: cell.value for key, cell in row.cells.items()} == {"here mpjpe": 0.1 / 100 * 2}


def test_metres_need_the_heights_of_targets(tmp_path: Path) -> None:
    store(tmp_path, "mine", "intra", {("Goblin_m>Mousey_m", "a"): 0.1})
    (heights,) = tmp_path.rglob("cases.heights.csv")
    heights.unlink()
    with pytest.raises(BenchError, match="do not say how tall their targets are"):
        ours("correspondence-free-table4", tmp_path)


@pytest.mark.parametrize("name", ALL)
def test_the_table_has_the_papers_layout_and_says_what_it_compares(name: str, tmp_path: Path) -> None:
    numbers = {("BigVegas>Goblin_m", "a"): 0.1, ("Goblin_m>BigVegas", "a"): 0.1}  # one beyond the paper's
    store(tmp_path, "mine", "cross", numbers)
    store(tmp_path, "peeks", "cross", numbers, method={"privileged": ["reference"]})
    table = published_tables.published(name)
    parts = ours(name, tmp_path)
    drawn = paper_table(table, parts)
    printed, *others = drawn.groups
    assert printed.columns == tuple(each for each in drawn.columns if each.id in _printed_block(table))
    assert [row.label for row in printed.ranked[: len(table.rows)]] == [
        f"{row.method} (printed)" for row in table.rows
    ]
    assert set(table.notes) <= set(drawn.notes)
    for each in drawn.groups:
        assert all(len(row.cells) == len(each.columns) for row in each.rows)
        assert all(cell.value is not None or cell.reason for row in each.rows for cell in row.cells)
    for each in others if printed.unranked else (printed, *others):
        assert not [row for row in each.rows if all(cell.value is None for cell in row.cells)]
    last = drawn.groups[-1]
    if parts:
        assert [(row.label, row.mark) for row in last.unranked] == [("peeks", "sees reference")]
        assert any("pairs" in note and "clips" in note for note in drawn.notes)
    elif any(column.pairs for column in table.columns):
        assert any("None of the results" in note for note in drawn.notes)


def _printed_block(table: published_tables.PublishedTable) -> list[str]:
    return [column.id for column in table.columns if not column.block]


@pytest.mark.parametrize("name", ALL)
def test_no_two_columns_have_one_label(name: str) -> None:
    """Notes and legends name columns by their labels."""
    labels = [column.label for column in published_tables.published(name).columns]
    assert len(set(labels)) == len(labels)


def test_a_second_table_that_repeats_the_first_is_left_out(tmp_path: Path) -> None:
    table = published_tables.published("pan-table1")
    theirs = {("BigVegas>Goblin_m", "a"): 0.1, ("BigVegas>Mousey_m", "a"): 0.3}
    store(tmp_path / "same", "mine", "cross", theirs)
    (only,) = paper_table(table, ours("pan-table1", tmp_path / "same")).groups
    assert [row.cells[1].text for row in only.ranked if row.label == "mine"] == ["0.20"]
    store(tmp_path / "more", "mine", "cross", {**theirs, ("Goblin_m>BigVegas", "a"): 0.8})
    own = paper_table(table, ours("pan-table1", tmp_path / "more")).groups[1]
    assert [column.label for column in own.columns] == ["all cross"]
    assert [row.cells[0].text for row in own.rows] == ["0.40"]


@pytest.mark.parametrize(
    ("name", "parameters", "words"),
    [
        ("pan", {}, "ours: "),
        ("pan", {"variant": "released"}, "as published"),
        ("pan", {"variant": "released", "weights": "elsewhere"}, "as published"),
        ("pan", {"variant": "released", "attention": False}, "ours, with these settings"),
        ("pan", {"variant": "released", "parts": "three"}, "as published"),
        (
            "nkn",
            {"variant": "released", "drift": 0.0, "lengths": "world", "path": "integrated"},
            "as published",
        ),
        ("nkn", {"drift": 0.0, "lengths": "world", "path": "integrated"}, "ours: own form"),
        ("pmnet", {"variant": "released", "lengths": "world", "path": "integrated"}, "as published"),
        ("smrm", {}, "ours: adversarial weight 0.0001"),
        ("smrm", {"variant": "paper", "path": "integrated"}, "as published"),
        ("r2et", {"dropout": 0.2, "size": "chain"}, "as published"),
        ("humot", {}, "ours: "),
        ("copy_rotations", {}, "root rule hip_height"),
        ("copy_rotations", {"root_rule": "none"}, ""),
        ("never_heard_of", {}, ""),
    ],
)
def test_rows_say_which_variant_they_are(name: str, parameters: dict, words: str) -> None:
    info = MethodInfo(name=name, label=name, parameters=parameters, privileged=(), control=False)
    said = variant(info)
    assert said.startswith(words) if words else said == ""


@pytest.mark.parametrize(
    ("spec", "words"),
    [
        ("humot", ("small", "ahead", "one size", "varied", "mirrored", "root rule hip_height")),
        ("humot[root_rule=leg_length,varied=false]", ("small", "ahead", "one size", "mirrored")),
        ("nkn", ("own form", "displacement", "hip heights", "path relative")),
        ("nkn[drift=0]", ("own form", "hip heights", "path relative")),
        ("pmnet", ("own form", "hip heights", "path relative")),
        ("smrm", ("adversarial", "path relative")),
        ("r2et", ("no dropout", "hip heights")),
        (
            "pan[dropout=0.1]",
            ("hip heights", "source's path", "by structure", "height as", "losses", "released", "masks"),
        ),
        ("pan[parts=three]", ("hip heights", "path relative", "height as", "losses", "released")),
    ],
)
def test_labels_say_every_setting_that_differs_from_the_paper_and_that_the_label_lacks(
    spec: str, words: tuple[str, ...]
) -> None:
    asked = Spec.parse(spec)
    info = MethodInfo(
        name=asked.name, label=spec, parameters=dict(asked.parameters), privileged=(), control=False
    )
    said = variant(info).removeprefix("ours: ").split(", ")
    assert len(said) == len(words)
    assert all(any(word in each for each in said) for word in words)


@pytest.mark.parametrize("name", ["humot", "nkn", "nkn_cross", "r2et", "same", "smrm"])
def test_what_a_published_set_changes_is_what_the_label_says(name: str) -> None:
    """A parameter that is added to one has to be added to the other."""
    card = optional.method_card(registry.create("methods", name))
    assert {each for change in card.published for each in change} == set(card.differs)


def test_what_pan_does_in_its_own_way_is_what_the_label_says() -> None:
    settings = {
        name: registry.create("methods", Spec("pan", {"variant": name})).settings.values()
        for name in ("own", "released")
    }
    changed = {key for key, value in settings["own"].items() if settings["released"][key] != value}
    # where it faces goes with the path, and all weights of losses stand together
    together = {"yaw", "adversarial"}
    card = registry.create("methods", "pan").card
    assert changed - together == set(card.differs) - {"variant"}


def test_what_a_card_calls_published_are_parameters_of_the_method() -> None:
    """Each set builds, and is another variant than the default."""
    for name, method in registry.working("methods")[0].items():
        card = optional.method_card(method)
        for each in card.published:
            spec = registry.canonical("methods", Spec(name, each))
            assert dict(spec.parameters) == dict(each), name


def test_variants_stand_in_the_rows_and_the_root_rule_of_copied_rotations_is_noted_first(
    tmp_path: Path,
) -> None:
    for name in ("pan", "copy_rotations"):
        store(tmp_path, name, "cross", {("BigVegas>Goblin_m", "a"): 0.1})
    table = published_tables.published("pan-table1")
    drawn = paper_table(table, ours("pan-table1", tmp_path))
    labels = [row.label for row in drawn.groups[0].ranked if "printed" not in row.label]
    assert labels[0] == "copy_rotations (root rule hip_height)"
    assert labels[1].startswith("pan (ours: ")
    assert "copied rotations treat the root" in drawn.notes[0]


def test_printed_numbers_keep_their_digits() -> None:
    (group,) = paper_table(published_tables.published("pan-table1"), []).groups
    shown = {row.label: [cell.text for cell in row.cells] for row in group.ranked}
    assert shown["PAN (printed)"] == ["0.50", "1.62"]
    assert shown["Copy rotations (printed)"] == ["8.86", "n/a"]


def test_an_unknown_table_names_those_there_are() -> None:
    with pytest.raises(BenchError, match=r"no published table 'pan-table9'; there are .*pan-table1"):
        published_tables.published("pan-table9")


def test_pans_table_1_on_the_pairs_at_hand(tmp_path: Path) -> None:
    """Self pairs count with intra, as in the code that made the printed numbers."""
    store(tmp_path, "mine", "self", {("Ann>Ann", "a"): 0.1})
    store(tmp_path, "mine", "intra", {("Ann>Bob", "a"): 0.3, ("Ann>Bob", "b"): 0.5})
    store(tmp_path, "mine", "cross", {("Ann>Cy", "a"): 0.7})
    (part,) = ours("pan-table1", tmp_path)
    (row,) = part.rows
    found = {key: (cell.value, cell.over.cases) for key, cell in row.cells.items()}
    assert found == {
        "intra own": (pytest.approx((0.2 + 0.5) / 2), 3),
        "cross own": (pytest.approx(0.7), 1),
    }
    first, own = paper_table(published_tables.published("pan-table1"), [part]).groups
    assert all("printed" in each.label for each in first.ranked)
    assert [each.label for each in own.ranked] == ["mine"]
