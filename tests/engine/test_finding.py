"""The sentence on what a table shows: each part is computed, and left out where its facts are missing."""

import numpy as np
import pytest
from stored import VALUES, changed, store

from retarget_bench.results import store as records
from retarget_bench.tables import requested
from retarget_bench.tables.finding import RECALL
from retarget_bench.tables.requested import Request

WORLD = "mpjpe_h.world"
RECALLS = VALUES | {RECALL: VALUES["curve"] | {"label": "contact recall", "index": ""}}


def stored(root, name, world, recall=None, split="cross", **about):
    """A method with these numbers on 20 clips."""
    recalls = {} if recall is None else {RECALL: recall}
    rows = [("a>b", f"c{n:02}", {WORLD: world + n / 1000, **recalls}) for n in range(20)]
    return changed(store(root, split, name, rows, **about), values=RECALLS)


def learned(root, name, world, recall=None, share=None, at_least=False, **about):
    facts = {"trained_on": {"characters": ("here",)}}
    facts |= {} if share is None else {"training_share": {"part": share, "at_least": at_least}}
    return stored(root, name, world, recall, **facts, **about)


def said(root) -> str:
    (table,) = requested.tables(records.find_results(root), Request())
    return table.finding


def test_all_that_is_known_is_said(tmp_path):
    stored(tmp_path, "ik", 1.0, 0.96)
    stored(tmp_path, "copy", 2.0, 0.5)
    learned(tmp_path, "net", 3.0, 0.09, 0.0001)
    learned(tmp_path, "deep", 4.0, 0.46, 0.02)
    assert said(tmp_path) == (
        "Across structures (cross) ik is best by world and contact recall; learned methods keep 9 to "
        "46 % of contacts, ik 96 %, other untrained ones 50 %; they saw 0.01 to 2 % of their papers' "
        "windows."
    )


def test_another_best_by_another_value_and_a_learned_one_alone(tmp_path):
    stored(tmp_path, "ik", 2.0, 0.96)
    learned(tmp_path, "net", 1.0, 0.25, 0.5)
    assert said(tmp_path) == (
        "Across structures (cross) net is best by world and ik by contact recall; net keeps 25 % of "
        "contacts, ik 96 %; net saw 50 % of its paper's windows."
    )


def test_ties_are_counted(tmp_path):
    random = np.random.default_rng(0)
    for name, mean in (("one", 1.0), ("two", 1.001), ("three", 1.002), ("worse", 2.0)):
        rows = [("a>b", f"c{n:02}", {WORLD: mean + 0.1 * random.normal()}) for n in range(20)]
        changed(store(tmp_path, "cross", name, rows), values=RECALLS)
    (table,) = requested.tables(records.find_results(tmp_path), Request())
    marks = {row.label: row.cells[0].mark for row in table.groups[0].ranked}
    assert sorted(marks.values()) == ["", "best", "tied", "tied"]
    best = next(label for label, mark in marks.items() if mark == "best")
    assert table.finding == f"Across structures (cross) {best} is best by world (2 others tied)."


@pytest.mark.parametrize(("equals", "who"), [(2, "a and b are"), (4, "4 methods are")])
def test_equal_means_share_the_first_place(tmp_path, equals, who):
    """Means that differ by no more than the tolerance of the value, 1e-6."""
    for number, name in enumerate("abcd"[:equals]):
        stored(tmp_path, name, 1.0 + 2e-7 * number)
    stored(tmp_path, "worse", 2.0)
    assert said(tmp_path) == f"Across structures (cross) {who} best by world."
    (table,) = requested.tables(records.find_results(tmp_path), Request())
    assert [row.cells[0].mark for row in table.groups[0].ranked] == ["best"] * equals + [""]


@pytest.mark.parametrize("share", [None, 0.1])
def test_what_is_not_known_is_left_out(tmp_path, share):
    learned(tmp_path, "net", 1.0, share=share)
    learned(tmp_path, "deep", 2.0)
    sentence = "Across structures (cross) net is best by world"
    assert said(tmp_path) == (
        f"{sentence}; net saw 10 % of its paper's windows, of others it is not known."
        if share
        else f"{sentence}."
    )


def test_windows_that_were_not_counted_and_weights_of_authors(tmp_path):
    learned(tmp_path, "pan", 1.0, share=0.0023, at_least=True, authors_weights="on their site")
    learned(tmp_path, "net", 2.0, share=0.0001)
    assert said(tmp_path) == (
        "Across structures (cross) pan is best by world; learned methods saw at least 0.01 to 0.23 % of "
        "their papers' windows; authors' weights: bench info pan."
    )


def test_too_few_clips_for_marks_and_splits_of_a_data_sets_own_name_nobody_wrongly(tmp_path):
    rows = [("a>b", "c1", {WORLD: 1.0})]
    for name in ("one", "two"):
        store(tmp_path / "few", "cross", name, rows)
    assert said(tmp_path / "few") == ""
    stored(tmp_path / "own", "good", 1.0, split="stairs")
    stored(tmp_path / "own", "bad", 2.0, split="stairs")
    assert said(tmp_path / "own") == "On stairs good is best by world."


def test_a_breakdown_and_a_split_alone_have_none(tmp_path):
    for number, name in enumerate(("one", "two"), 1):
        stored(tmp_path, name, float(number))
    places = records.find_results(tmp_path)
    for request in (Request(by="pair"), Request(splits=("cross",))):
        (table,) = requested.tables(places, request)
        assert table.finding == ""
