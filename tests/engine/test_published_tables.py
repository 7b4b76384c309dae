"""Published tables: the numbers agree with themselves, and ours land in the right places."""

from __future__ import annotations

import json
from collections import Counter
from pathlib import Path

import numpy as np
import pytest
import stored

from retarget_bench.analysis.selection import Selection
from retarget_bench.api import TrainingShare
from retarget_bench.errors import BenchError
from retarget_bench.plugins import registry
from retarget_bench.plugins.spec import Spec
from retarget_bench.results import store as records
from retarget_bench.results.header import MethodInfo
from retarget_bench.results.result_matrix import result_matrices
from retarget_bench.tables.model import Table
from retarget_bench.tables.published import printed
from retarget_bench.tables.published.joined import joined
from retarget_bench.tables.published.our_sets import of_sets
from retarget_bench.tables.published.ours import OurRow, about, of_cases, variant

ALL = printed.names()
VALUES = {
    value: stored.VALUES["mpjpe_h.world"] | {"label": value, "unit": unit}
    for value, unit in (("humot_mpjpe", "1"), ("san_code", "1"), ("mpjpe_h.world", "% of height"))
}


def store(
    root: Path, name: str, split: str, numbers: dict[tuple[str, str], float], file: str = "", **changes
) -> None:
    """``numbers``: (pair, clip) -> the value of every protocol. All targets are two metres tall."""
    entries = [(*case, dict.fromkeys(VALUES, number)) for case, number in numbers.items()]
    place = stored.store(root, split, file or name, entries)
    facts = json.loads(place.header.read_text()) | {"values": VALUES}
    usual = {"method": {"name": name, "label": name}, "dataset": {"name": "mixamo", "label": "mixamo"}}
    for key, change in (*usual.items(), *changes.items()):
        facts[key] = {**facts[key], **change} if isinstance(change, dict) else change
    stored.changed(place, **facts)
    targets = {pair.split(">")[1] for pair, _ in numbers}
    stored.metadata(place, height=dict.fromkeys(sorted(targets), "2"))


def drawn(name: str, *roots: Path) -> Table:
    """A table with all results in these folders."""
    places = [place for root in roots for place in records.find_results(root)]
    return joined(printed.published(name), places, Selection(variants=True))


def ours(name: str, *roots: Path) -> tuple[list[OurRow], list[str]]:
    """Our rows of a table from all results in these folders, and notes on them."""
    table = printed.published(name)
    places = [place for root in roots for place in records.find_results(root)]
    parts = Selection(variants=True).parts(result_matrices(places))
    return of_sets(table, parts) if table.of_sets else of_cases(table, parts)


def rows_of(name: str, *roots: Path) -> list[OurRow]:
    """Likewise, where they are of one data set and group of bodies."""
    rows, _ = ours(name, *roots)
    assert len({row.where for row in rows}) == 1
    return rows


def numbers(name: str, row: str) -> dict[str, float]:
    """Column -> number, as printed."""
    return {label: float(number.text) for label, number in printed.published(name).rows[row].items()}


def spreads(name: str, row: str) -> dict[str, float]:
    return {label: float(number.spread) for label, number in printed.published(name).rows[row].items()}


@pytest.mark.parametrize("name", ["humot-table3", "humot-table4", "humot-table5"])
def test_printed_overall_is_what_its_columns_say(name: str) -> None:
    """The mean of the pairs' means; spread: variance within pairs and of their means (0.0002: rounding)."""
    table = printed.published(name)
    parts = [column.label for column in table.columns if column.pairs]
    (overall,) = (column.label for column in table.columns if column.cases == printed.MEAN)
    for row in table.rows:
        value, spread = numbers(name, row), spreads(name, row)
        means = np.array([value[part] for part in parts])
        within = np.array([spread[part] for part in parts])
        assert value[overall] == pytest.approx(means.mean(), abs=2e-4), row
        assert spread[overall] == pytest.approx(np.sqrt((within**2).mean() + means.var()), abs=3e-4), row


def test_as_many_numbers_as_the_papers_print() -> None:
    """Counted in the papers: tables, and sizes, times and examples of the text."""
    counts: Counter[str] = Counter()
    for name in ALL:
        for row in printed.published(name).rows.values():
            counts[name.partition("-")[0]] += sum(each.origin == "printed" for each in row.values())
    assert counts == {"pan": 55, "humot": 93, "correspondence": 110}


@pytest.mark.parametrize("name", ALL)
def test_every_column_has_a_value_of_ours_or_a_reason(name: str) -> None:
    table = printed.published(name)
    labels = {column.label for column in table.columns}
    for column in table.columns:
        assert bool(column.value_id) != bool(column.missing), column.label
        assert bool(column.value_id) == bool(column.cases), column.label
        assert bool(column.block) != bool(column.protocol), "a protocol is that of printed numbers"
        assert column.repeats in (*labels, "")
    for row in table.rows.values():
        assert row
        assert all(float(number.text) > 0 for number in row.values())


def test_values_of_ours_are_of_metrics_that_there_are() -> None:
    defined = {
        value.id for metric in registry.working("metrics")[0].values() for value in metric.card.values
    }
    value_ids = {column.value_id for name in ALL for column in printed.published(name).columns}
    assert value_ids - {""} <= defined


def test_pan_counts_self_pairs_and_humot_does_not() -> None:
    pairs = {column.label: column.pairs for column in printed.published("pan-table1").columns}
    intra = pairs["intra, self pairs included"]
    assert len(intra) == 16
    assert sum(pair.split(">")[0] == pair.split(">")[1] for pair in intra) == 4
    assert len(pairs["cross"]) == 4
    all_pairs = [pair for column in printed.published("humot-table4").columns for pair in column.pairs]
    assert len(all_pairs) == len(set(all_pairs)) == 12
    assert not [pair for pair in all_pairs if pair.split(">")[0] == pair.split(">")[1]]


def test_our_numbers_land_in_the_papers_columns(tmp_path: Path) -> None:
    store(tmp_path, "mine", "intra", {
        ("Goblin_m>Mousey_m", "a"): 0.1, ("Mousey_m>Goblin_m", "a"): 0.3, ("Goblin_m>Mousey_m", "b"): 0.6,
        ("Goblin_m>Vampire_m", "a"): 0.5, ("Aj>BigVegas", "a"): 9.0,
    })  # fmt: skip
    store(tmp_path, "mine", "self", {("Goblin_m>Goblin_m", "a"): 0.2})
    (row,), notes = ours("humot-table4", tmp_path)
    pair = row.cells["G ↔ Mo"]
    # clip a: both directions, mean 0.2; clip b: 0.6
    assert (pair.value, pair.n, pair.clips) == (pytest.approx(0.4), 3, 2)
    assert pair.text == f"0.4000 ±{np.std([0.1, 0.3, 0.6]):.4f}"
    overall = row.cells["overall"]
    assert overall.value == pytest.approx((0.4 + 0.5) / 2)
    assert overall.text == f"0.4500 ±{np.std([0.1, 0.3, 0.6, 0.5]):.4f}"
    assert "Mr ↔ V" not in row.numbers
    (pan,) = rows_of("pan-table1", tmp_path)
    assert pan.cells["intra, self pairs included"].n == 5  # the self pair counts, Aj > BigVegas does not
    counts, warning = notes
    assert "G ↔ Mo: 3 cases, pairs 2 of 2, clips 2 of 106" in counts
    assert "do not compare" in warning


def test_other_data_only_fill_columns_that_take_any_pair(tmp_path: Path) -> None:
    data = {"name": "folder", "label": "folder"}
    store(tmp_path, "mine", "intra", {("Goblin_m>Mousey_m", "a"): 0.1}, dataset=data)
    (row,) = rows_of("humot-table4", tmp_path)
    assert {key: cell.value for key, cell in row.numbers.items()} == {"all intra": 0.1}
    (row,) = rows_of("correspondence-free-table4", tmp_path)
    assert {key: cell.value for key, cell in row.numbers.items()} == {"MPJPE": 0.1 / 100 * 2}


@pytest.mark.parametrize("name", ALL)
def test_the_table_has_the_papers_layout_and_says_what_it_compares(name: str, tmp_path: Path) -> None:
    numbers = {("BigVegas>Goblin_m", "a"): 0.1, ("Goblin_m>BigVegas", "a"): 0.1}  # one beyond the paper's
    store(tmp_path, "mine", "cross", numbers)
    store(tmp_path, "peeks", "cross", numbers, method={"privileged": ["reference"]})
    table = printed.published(name)
    rows, _ = ours(name, tmp_path)
    drawn_table = drawn(name, tmp_path)
    first, *others = drawn_table.groups
    assert [each.id for each in first.columns] == [c.label for c in table.columns if not c.block]
    assert [row.label.rpartition(" (")[0] for row in first.ranked[: len(table.rows)]] == list(table.rows)
    assert set(table.notes) <= set(drawn_table.notes)
    for each in drawn_table.groups:
        assert all(len(row.cells) == len(each.columns) for row in each.rows)
        assert all(cell.value is not None or cell.reason for row in each.rows for cell in row.cells)
        assert not [row for row in each.rows if all(cell.value is None for cell in row.cells)]
    for each in others:
        assert "peeks" in {row.label for row in each.unranked}
    if rows:
        assert [(row.label, row.mark) for row in drawn_table.groups[-1].unranked] == [
            ("peeks", "sees reference")
        ]
        assert any("pairs" in note and "clips" in note for note in drawn_table.notes)
    elif any(column.value_id for column in table.columns):
        assert any("None of the results" in note for note in drawn_table.notes)


@pytest.mark.parametrize("name", ALL)
def test_without_results_the_printed_numbers_stand_alone(name: str) -> None:
    table, drawn_table = printed.published(name), drawn(name)
    (group,) = drawn_table.groups
    shown = {
        row.label.rpartition(" (")[0]: [cell.text.partition(" ±")[0] for cell in row.cells]
        for row in group.rows
    }
    for label, row in table.rows.items():
        there = [column.label for column in table.columns if not column.block]
        assert shown[label] == [row[each].text if each in row else "n/a" for each in there]
    assert not {cell.footnote for cell in drawn_table.cells} - set(range(len(drawn_table.footnotes) + 1))
    assert any("None of the results" in note or "no number here" in note for note in drawn_table.notes)


def test_a_second_table_that_repeats_the_first_is_left_out(tmp_path: Path) -> None:
    shared_numbers = {("BigVegas>Goblin_m", "a"): 0.1, ("BigVegas>Mousey_m", "a"): 0.3}
    store(tmp_path / "same", "mine", "cross", shared_numbers)
    (only,) = drawn("pan-table1", tmp_path / "same").groups
    assert [row.cells[1].text for row in only.ranked if row.label == "mine"] == ["0.20"]
    store(tmp_path / "more", "mine", "cross", {**shared_numbers, ("Goblin_m>BigVegas", "a"): 0.8})
    own = drawn("pan-table1", tmp_path / "more").groups[1]
    assert [column.label for column in own.columns] == ["all cross"]
    assert [row.cells[0].text for row in own.rows] == ["0.40"]


@pytest.mark.parametrize(
    ("name", "parameters", "words"),
    [
        ("pan", {"variant": "released"}, "as published"),
        ("pan", {"variant": "released", "attention": False}, "ours, with these settings"),
        ("smrm", {}, "ours: adversarial weight 0.0001"),
        ("copy_rotations", {}, "root rule hip_height"),
        ("never_heard_of", {}, ""),
    ],
)
def test_rows_say_which_variant_they_are(name: str, parameters: dict, words: str) -> None:
    info = MethodInfo(name=name, label=name, parameters=parameters, privileged=(), control=False)
    text = variant(info)
    assert text.startswith(words) if words else text == ""


@pytest.mark.parametrize(
    ("spec", "words"),
    [
        ("humot", ("small", "ahead", "one size", "varied", "mirrored", "root rule hip_height")),
        ("nkn[drift=0]", ("own form", "hip heights", "path relative")),
        ("smrm", ("adversarial", "path relative")),
        ("r2et", ("no dropout", "hip heights")),
        (
            "pan[dropout=0.1]",
            ("hip heights", "source's path", "by structure", "height as", "losses", "released", "masks"),
        ),
    ],
)
def test_labels_say_every_setting_that_differs_from_the_paper_and_that_the_label_lacks(
    spec: str, words: tuple[str, ...]
) -> None:
    parsed = Spec.parse(spec)
    info = MethodInfo(
        name=parsed.name, label=spec, parameters=dict(parsed.parameters), privileged=(), control=False
    )
    settings = variant(info).removeprefix("ours: ").split(", ")
    assert len(settings) == len(words)
    assert all(any(word in each for each in settings) for word in words)


@pytest.mark.parametrize("name", ["humot", "nkn", "nkn_cross", "r2et", "same", "smrm"])
def test_what_a_published_set_changes_is_what_the_label_says(name: str) -> None:
    """A parameter that is added to one has to be added to the other."""
    card = registry.create("methods", name).card
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
        card = method.card
        for each in card.published:
            spec = registry.canonical("methods", Spec(name, each))
            assert dict(spec.parameters) == dict(each), name


def test_an_unknown_table_names_those_there_are() -> None:
    with pytest.raises(BenchError, match=r"no published table 'pan-table9'; there are .*pan-table1"):
        printed.published("pan-table9")


@pytest.mark.parametrize(
    ("weights", "trained_on", "share", "words"),
    [
        (
            "puppets",
            {"kinds": ("walk",)},
            TrainingShare(0.0031),
            "own weights, 0.31 % of its paper's windows; ours: ",
        ),
        (
            "puppets",
            {"kinds": ("walk",)},
            TrainingShare(0.996),
            "own weights, 100 % of its paper's windows; ours: ",
        ),
        ("puppets", {"kinds": ("walk",)}, None, "own weights; ours: "),
        ("authors-12345678", None, None, "authors' weights; ours: "),
        ("puppets", None, None, "ours: "),
    ],
)
def test_rows_say_whose_weights_they_have(
    weights: str, trained_on: dict | None, share: TrainingShare | None, words: str
) -> None:
    facts = {"trained_on": trained_on, "training_share": share, "privileged": (), "control": False}
    info = MethodInfo(name="same", label="same", parameters={"weights": weights}, **facts)
    assert about(info) == f"{words}path relative to the source's"
