"""Cells of tables: marks that agree with rankings, and why there is no number where there is none."""

import random

import pytest
from stored import VALUES, changed, store

from retarget_bench.analysis import summary
from retarget_bench.evaluation import timing
from retarget_bench.results import store as records
from retarget_bench.tables import builder
from retarget_bench.tables.cells import STALE
from retarget_bench.tables.model import FAILED, NOT_APPLICABLE, NOT_RUN, OTHER_VERSION

WORLD = {"mpjpe_h.world": 1.0}


def cells_of(places, columns, split="intra") -> dict:
    """Method -> its cells on a split."""
    (table,) = builder.tables(summary.split_summaries(places), columns)
    (group,) = (group for group in table.groups if group.split == split)
    return {row.label: row.cells for row in group.rows} | {"table": table, "group": group}


def needing(**needs) -> dict:
    return {key: value | {"needs": needs.get(key, ["reference"])} for key, value in VALUES.items()}


def test_a_value_that_needs_what_predictions_lack_is_not_applicable_and_says_what(tmp_path):
    values = needing(ratio=["reference", "rotations"])
    complete = store(tmp_path, "intra", "whole", [("a>b", "c1", {**WORLD, "ratio": 1.0})])
    points = store(tmp_path, "intra", "points", [("a>b", "c1", WORLD)])
    cells = cells_of([changed(p, values=values) for p in (complete, points)], ["mpjpe_h.world", "ratio"])
    cell = cells["points"][1]
    assert (cell.text, cell.value) == (NOT_APPLICABLE, None)
    assert cell.reason == "needs rotations"
    assert cells["table"].footnotes[cell.footnote - 1] == cell.reason


def test_an_undefined_value_says_so(tmp_path):
    there = store(tmp_path, "intra", "there", [("a>b", "c1", {**WORLD, "ratio": 1.0})])
    still = store(tmp_path, "intra", "still", [("a>b", "c1", WORLD)])
    cells = cells_of([changed(p, values=needing()) for p in (there, still)], ["mpjpe_h.world", "ratio"])
    assert cells["still"][1].text == NOT_APPLICABLE
    assert cells["still"][1].reason == "undefined for all of these cases"


@pytest.mark.parametrize(
    ("status", "kind"),
    [("failed", FAILED), ("invalid", FAILED), ("unsupported", NOT_APPLICABLE), ("missing", NOT_RUN)],
)
def test_a_method_that_answered_nothing(tmp_path, status, kind):
    good = store(tmp_path, "intra", "good", [("a>b", "c1", WORLD)])
    none = store(tmp_path, "intra", "none", [("a>b", "c1", status)])
    cells = cells_of([good, none], ["mpjpe_h.world"])
    assert [cell.text for cell in cells["none"]] == [kind]
    (problem,) = cells["table"].problems
    assert (problem.label, problem.status, problem.message) == ("none", status, "because | of it")


def test_many_refusals_are_one_line(tmp_path):
    place = store(tmp_path, "intra", "picky", [("a>b", f"c{k}", "unsupported") for k in range(5)])
    problems = [
        {"status": "unsupported", "message": f"body {k} has no arms", "cases": [f"data/a>b/c{k}"]}
        for k in range(4)
    ]
    problems.append({"status": "failed", "message": "no idea", "cases": ["data/a>b/c4"]})
    refused, failed = cells_of([changed(place, problems=problems)], ["mpjpe_h.world"])["table"].problems
    assert refused.sentence.startswith("intra: picky unsupported on 4 cases (first data/a>b/c0): body 0")
    assert refused.sentence.endswith("; 3 reasons more of this kind")
    assert (failed.status, failed.cases) == ("failed", ("data/a>b/c4",))


def test_a_method_that_ran_elsewhere_only_is_told(tmp_path):
    both = [store(tmp_path, split, "both", [("a>b", "c1", WORLD)]) for split in ("intra", "cross")]
    one = store(tmp_path, "cross", "one", [("a>b", "c1", WORLD)])
    cells = cells_of([*both, one], ["mpjpe_h.world"])
    assert [row.label for row in cells["group"].rows] == ["both"]
    assert "intra: not run here: one." in cells["group"].below


def test_metrics_that_were_not_computed_are_not_run(tmp_path):
    values = {key: value | {"metric": key.split(".")[0]} for key, value in VALUES.items()}
    less = {key: value for key, value in values.items() if key != "ratio"}
    all_ = store(tmp_path, "intra", "all", [("a>b", "c1", {**WORLD, "ratio": 1.0})])
    some = store(tmp_path, "intra", "some", [("a>b", "c1", WORLD)])
    changed(all_, values=values, metrics={"mpjpe_h": "1+a", "ratio": "1+a"}, date="2026-01-01")
    changed(some, values=less, metrics={"mpjpe_h": "1+a"}, date="2026-01-01")
    cell = cells_of([all_, some], ["mpjpe_h.world", "ratio"])["some"][1]
    assert (cell.text, "ratio" in cell.reason, "bench run" in cell.reason) == (NOT_RUN, True, True)


def test_numbers_of_an_older_metric_and_of_older_data_stay_out(tmp_path):
    numbers = [("a>b", "c1", {**WORLD, "ratio": 1.0})]
    values = {key: value | {"metric": key.split(".")[0]} for key, value in VALUES.items()}
    places = {name: store(tmp_path, "intra", name, numbers) for name in ("new", "metric", "data", "code")}
    new = {"values": values, "date": "2026-01-02"}
    changed(places["new"], metrics={"mpjpe_h": "2+bb", "ratio": "1+aa"}, **new)
    changed(places["code"], metrics={"mpjpe_h": "2+cc", "ratio": "1+aa"}, **new)
    old = new | {"date": "2026-01-01"}
    changed(places["metric"], metrics={"mpjpe_h": "1+aa", "ratio": "1+aa"}, **old)
    dataset = {"name": "toys", "label": "data", "content": "c0", "notes": []}
    changed(places["data"], metrics={"mpjpe_h": "2+bb", "ratio": "1+aa"}, dataset=dataset, **old)
    cells = cells_of(places.values(), ["mpjpe_h.world", "ratio"])
    assert [cell.text for cell in cells["metric"]] == [OTHER_VERSION, "1.00"]
    assert "mpjpe_h 1" in cells["metric"][0].reason
    assert "mpjpe_h 2" in cells["metric"][0].reason
    assert [cell.text for cell in cells["data"]] == [OTHER_VERSION] * 2
    assert [row.label for row in cells["group"].unranked if row.mark == STALE] == ["data"]
    assert cells["code"][0].value == cells["new"][0].value == 1.0
    notes = " ".join(cells["table"].notes)
    assert "c0" in notes
    assert "mpjpe_h; bench run brings" in notes  # other code under the same version is told


def test_values_that_pool_self_pairs_say_why_they_are_missing(tmp_path):
    place = store(tmp_path, "intra", "m", [("a>b", "c1", {"pooled": 4.0, **WORLD})])
    other = store(tmp_path, "intra", "n", [("a>b", "c1", {"pooled": 4.0, **WORLD})])
    own = store(tmp_path, "self", "n", [("a>a", "c1", {"pooled": 0.0, **WORLD})])
    cell = cells_of([place, other, own], ["pooled"])["m"][0]
    assert (cell.text, "self split" in cell.reason) == (NOT_RUN, True)


def test_speed_of_predictions_made_elsewhere_is_not_applicable(tmp_path):
    timed = store(tmp_path, "intra", "timed", [("a>b", "c1", WORLD)])
    timing.write(timed, [timing.Time("x", 100, 2.0, 1.0)])
    idle = store(tmp_path, "intra", "idle", [("a>b", "c1", WORLD)])
    away = store(tmp_path, "intra", "away", [("a>b", "c1", WORLD)], origin="predictions made elsewhere")
    cells = cells_of([timed, idle, away], ["fps"])
    assert [cells[name][0].text for name in ("timed", "idle", "away")] == ["50.0", NOT_RUN, NOT_APPLICABLE]


# ----------------------------------------------------------------------------------------------- marks
def noisy(root, name, centre, seed, clips=30):
    draw = random.Random(seed)
    numbers = [
        (f"a>{target}", f"c{n}", {"mpjpe_h.world": centre + draw.gauss(0, 0.2), "ratio": 1.0})
        for n in range(clips)
        for target in "bc"
    ]
    return store(root, "intra", name, numbers)


def test_marks_are_those_of_the_ranking(tmp_path):
    places = [noisy(tmp_path, n, c, s) for s, (n, c) in enumerate([("a", 1.0), ("b", 1.01), ("c", 3.0)])]
    (section,) = summary.split_summaries(places)
    cells = cells_of(places, ["mpjpe_h.world"])
    ranking = section.rankings["mpjpe_h.world"]
    marks = {label: cells[label][0].mark for label in "abc"}
    assert [label for label, mark in marks.items() if mark == "best"] == [ranking.best]
    assert {label for label, mark in marks.items() if mark == "tied"} == set(ranking.tied)
    assert marks["c"] == ""
    assert [row.label for row in cells["group"].ranked] == list(ranking.order)
    mean = section.scores[0].means["mpjpe_h.world"]
    assert (cells["a"][0].interval, cells["a"][0].n, cells["a"][0].clips) == (mean.interval, 60, 30)
    assert cells["group"].common[0].cases == ranking.cases == 60


def test_a_method_alone_is_not_called_the_best(tmp_path):
    cells = cells_of([noisy(tmp_path, "alone", 1.0, 0)], ["mpjpe_h.world"])
    assert cells["alone"][0].mark == ""


def test_a_number_over_fewer_cases_says_why_it_is_not_ranked(tmp_path):
    noisy(tmp_path, "a", 1.0, 0)
    some = [("a>b", f"c{n}", {"ratio": 1.0} | (WORLD if n < 5 else {})) for n in range(30)]
    store(tmp_path, "intra", "some", [*some, *(("a>c", f"c{n}", {"ratio": 1.0}) for n in range(30))])
    noisy(tmp_path, "b", 1.0, 1)
    cell = cells_of(records.find_results(tmp_path), ["mpjpe_h.world"])["some"][0]
    assert (cell.text, cell.n, cell.mark) == ("1.00", 5, "")
    assert cell.reason == "not ranked by this column: has it for 5 of 60 cases"
    assert cell.footnote == 1


# ------------------------------------------------------------------------------------------ breakdowns


def test_a_line_on_which_a_method_did_not_answer_all_cases_says_so(tmp_path):
    """There it is over its own cases, and the others over all."""
    for name, second in (("m", 3.0), ("k", "failed")):
        numbers = [1.0, second, 1.0, 1.0]
        clips = zip(("a>b", "a>b", "a>c", "a>c"), "1212", numbers, strict=True)
        entries = [(pair, c, {"mpjpe_h.world": x} if isinstance(x, float) else x) for pair, c, x in clips]
        store(tmp_path, "cross", name, entries)
    (table,) = builder.tables(summary.split_summaries(records.find_results(tmp_path), "pair"), by="pair")
    (group,) = table.groups
    k, m = (
        [(row.cells[at].value, row.cells[at].footnote) for row in group.ranked]
        for at, _ in enumerate(group.columns)
    )
    assert (k, m) == ([(1.0, 1), (1.0, 0)], [(2.0, 0), (1.0, 0)])
    assert table.footnotes == ("over the cases that it answered, which are not all of this line",)


def test_self_pairs_have_a_line_only_for_values_that_count_them(tmp_path):
    store(tmp_path, "intra", "m", [("a>b", "c1", {"pooled": 4.0, **WORLD})])
    store(tmp_path, "self", "m", [("a>a", "c1", {"pooled": 0.0, **WORLD})])
    summaries = [
        s for s in summary.split_summaries(records.find_results(tmp_path), "pair") if s.split == "intra"
    ]
    (table,) = builder.tables(summaries, ["mpjpe_h.world", "pooled"], by="pair")
    lines = {group.subject: [row.label for row in group.ranked] for group in table.groups}
    assert lines == {"mpjpe_h.world": ["a>b"], "pooled": ["a>a", "a>b"]}
    assert [row.cells[0].value for row in table.groups[1].ranked] == [0.0, 4.0]


def test_usual_columns_that_only_some_data_know_are_missed_when_asked_for_alone(tmp_path):
    values = {**VALUES, "touch_gap": VALUES["ratio"] | {"label": "gap", "needs": ["touches"]}}
    place = changed(store(tmp_path, "intra", "m", [("a>b", "c1", WORLD)]), values=values)
    assert "gap" not in " ".join(cells_of([place], None)["group"].below)
    assert "not shown: gap" in " ".join(cells_of([place], ["mpjpe_h.world", "touch_gap"])["group"].below)
