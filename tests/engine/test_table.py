"""Means and tables against numbers worked out by hand, and where their rows come from."""

import shlex

import pytest
from stored import changed, store

from retarget_bench.analysis import summary
from retarget_bench.errors import BenchError
from retarget_bench.plugins.spec import Spec
from retarget_bench.results import store as records
from retarget_bench.tables import builder, rendering
from retarget_bench.tables.rendering import words


def test_clips_weigh_the_same_however_many_cases_they_have(tmp_path):
    numbers = [("a>b", "c1", {"mpjpe_h.world": 1.0}), ("b>a", "c1", {"mpjpe_h.world": 3.0})]
    numbers.append(("a>b", "c2", {"mpjpe_h.world": 10.0, "curve": {"0.1": 0.5}}))
    place = store(tmp_path, "intra", "m", numbers)
    (section,) = summary.split_summaries([place])
    mean = section.scores[0].means["mpjpe_h.world"]
    assert mean == summary.Mean(value=(2.0 + 10.0) / 2, n=3, clips=2)
    assert section.scores[0].curves["curve"]["0.1"] == summary.Mean(0.5, 1, 1)
    assert (section.pair_count, section.clip_count) == (2, 2)
    assert sum(info.frames for info in section.infos) == 30


def test_legacy_protocols_pool_self_pairs_and_say_nothing_without_them(tmp_path):
    intra = store(tmp_path, "intra", "m", [("a>b", "c1", {"pooled": 4.0, "mpjpe_h.world": 4.0})])
    (alone,) = summary.split_summaries([intra])
    assert "pooled" not in alone.scores[0].means
    own = store(tmp_path, "self", "m", [("a>a", "c1", {"pooled": 0.0, "mpjpe_h.world": 0.0})])
    split = {section.split: section for section in summary.split_summaries([intra, own])}
    assert split["intra"].scores[0].means["pooled"].value == 2.0
    assert split["intra"].scores[0].means["mpjpe_h.world"].value == 4.0


def test_ranked_rows_come_best_first_and_controls_apart(tmp_path):
    clips = [("a>b", f"c{n}") for n in range(20)]
    place = [
        store(tmp_path, "intra", "worse", [(*c, {"mpjpe_h.world": 2.0}) for c in clips]),
        store(tmp_path, "intra", "better", [(*c, {"mpjpe_h.world": 1.0}) for c in clips]),
        store(tmp_path, "intra", "floor", [(*c, {"mpjpe_h.world": 9.0}) for c in clips], control=True),
        store(
            tmp_path,
            "intra",
            "leak",
            [(*c, {"mpjpe_h.world": 0.1}) for c in clips],
            privileged=["reference"],
        ),
        store(
            tmp_path,
            "intra",
            "lazy",
            [(*c, {"mpjpe_h.world": 0.05}) for c in clips[:18]] + [(*c, "unsupported") for c in clips[18:]],
        ),
        store(tmp_path, "intra", "broken", [(*c, "failed") for c in clips]),
    ]
    (table,) = builder.tables(summary.split_summaries(place), ["mpjpe_h.world"])
    (group,) = table.groups
    assert [row.label for row in group.ranked] == ["better", "worse"]
    assert [(row.label, row.mark, row.n) for row in group.unranked] == [
        ("lazy", "answered 18 of 20", "18/20"),
        ("leak", "sees reference", "20"),
        ("floor", "control", "20"),
        ("broken", "answered 0 of 20", "0/20"),
    ]
    assert group.unranked[-1].cells[0].text == "failed"
    problem = next(problem for problem in table.problems if problem.label == "broken")
    assert (problem.status, problem.message, len(problem.cases)) == ("failed", "because | of it", 20)
    assert "two clips were dropped" in table.notes


@pytest.mark.parametrize(
    ("exact", "others", "text"),
    [
        (0.0, [2.31375], "2.31"),
        (8e-7, [2.31375, 1.325], "2.31"),  # positions in single precision, in centimetres
        (8e-7, [0.04412], "0.0441"),
        (0.0, [], ""),
        (8e-7, [], ""),
    ],
)
@pytest.mark.parametrize("ranked", [True, False])
def test_exact_answers_do_not_decide_how_many_decimals_others_have(tmp_path, exact, others, text, ranked):
    """The exact one is ranked; the others are, or were not answered by all."""
    clips = [("a>b", f"c{n}") for n in range(20)]
    places = [store(tmp_path, "intra", "exact", [(*c, {"mpjpe_h.world": exact}) for c in clips])]
    for number, value in enumerate(others):
        rows = [(*c, {"mpjpe_h.world": value}) for c in clips]
        places.append(store(tmp_path, "intra", f"other{number}", rows, control=not ranked))
    (table,) = builder.tables(summary.split_summaries(places), ["mpjpe_h.world"])
    cells = {row.label: row.cells[0].text for row in table.groups[0].rows}
    zero = cells["exact"]
    assert float(zero) == 0.0
    assert zero == f"{0.0:.{len(text.partition('.')[2]) or 2}f}"
    assert cells.get("other0", "") == text


def test_without_a_reference_the_source_stands_in(tmp_path):
    own = store(tmp_path, "self", "m", [("a>a", "c1", {"ratio": 1.2})])
    other = store(tmp_path, "cross", "m", [("a>b", "c1", {"ratio_src": 2.0})])
    for name, ratio in (("n", 0.5), ("k", 0.9)):
        store(tmp_path, "cross", name, [("a>b", "c1", {"ratio_src": ratio})])
    places = [
        own,
        other,
        *(records.ResultPaths(tmp_path, "data", "retarget", "cross", n) for n in ("n", "k")),
    ]
    (table,) = builder.tables(summary.split_summaries(places), ["ratio"])
    assert [[column.id for column in group.columns] for group in table.groups] == [["ratio_src"], ["ratio"]]
    assert table.groups[0].ranked[0].label == "k"  # best at 1, ranked by the log of the ratio
    assert {row.label for row in table.groups[0].ranked[1:]} == {"m", "n"}
    assert "ratio" in rendering.text([table])


def test_a_method_of_a_breakdown_is_told_apart_where_no_part_ranks_it(tmp_path):
    clips = [("a>b", f"c{n}") for n in range(4)]
    entries = [(*c, {"mpjpe_h.world": 1.0}) for c in clips]
    places = [
        store(tmp_path, "intra", "floor", entries, control=True),
        store(tmp_path, "intra", "lazy", [(*clips[0], "failed"), *entries[1:]]),
        store(tmp_path, "intra", "broken", [(*c, "failed") for c in clips]),
        store(tmp_path, "intra", "whole", entries),
    ]
    (table,) = builder.tables(summary.split_summaries(places, "clip"), ["mpjpe_h.world"], "clip")
    (group,) = table.groups
    assert [(column.id, column.mark) for column in group.columns] == [
        ("lazy", ""),
        ("whole", ""),
        ("floor", "control"),
        ("broken", "answered 0 of 1"),
    ]
    assert [row.n for row in group.ranked] == ["1"] * 4


@pytest.mark.parametrize(("by", "n"), [("pair", "4"), ("joint", "2"), ("part", "2")])
def test_n_of_a_joint_counts_the_cases_that_have_it(tmp_path, by, n):
    numbers = [("a>b", f"c{i}", {"mpjpe_h.world": 1.0} if i % 2 else {}) for i in range(4)]
    summaries = summary.split_summaries([store(tmp_path, "intra", "m", numbers)], "pair")
    (table,) = builder.tables(summaries, ["mpjpe_h.world"], by)
    assert [row.n for row in table.groups[0].rows] == [n]


@pytest.mark.parametrize(
    ("lacking", "counts", "message"),
    [(0, [], False), (1, ["20"], False), (21, [], True)],
    ids=["all", "all but one", "none"],
)
def test_how_many_cases_stand_behind_a_column_is_told(tmp_path, lacking, counts, message):
    """Of 21 methods some lack the value on one case, each on another."""
    places = []
    for name in range(21):
        has = [{} if n == name < lacking else {"mpjpe_h.world": 1.0} for n in range(21)]
        numbers = [("a>b", f"c{n:02}", values) for n, values in enumerate(has)]
        places.append(store(tmp_path, "intra", f"m{name:02}", numbers))
    (table,) = builder.tables(summary.split_summaries(places), ["mpjpe_h.world"])
    (group,) = table.groups
    assert words.common_counts(group) == counts
    assert any("no case has a number of all ranked methods" in each for each in group.below) == message


@pytest.mark.parametrize("columns", [[], ["curve"]])
def test_no_column_and_curves_are_refused(tmp_path, columns):
    place = store(tmp_path, "intra", "m", [("a>b", "c1", {"curve": {"0.1": 0.5}})])
    with pytest.raises(BenchError, match=r"name at least one column|a number per threshold"):
        builder.tables(summary.split_summaries([place]), columns)


@pytest.mark.parametrize("form", sorted(rendering.RENDERERS))
def test_a_split_without_any_of_the_values_is_drawn_all_the_same(tmp_path, form):
    one = store(tmp_path, "self", "m", [("a>a", "c1", {"ratio": 1.0})])
    two = store(tmp_path, "cross", "m", [("a>b", "c1", {"pooled": 1.0})])
    (table,) = builder.tables(summary.split_summaries([one, two]), ["ratio"])
    shown = rendering.RENDERERS[form]([table])
    assert "cross" in shown
    assert (words.NO_COLUMN in shown) == (form not in ("csv", "json"))


def test_results_with_none_of_the_usual_values_show_what_they_have(tmp_path):
    """Such as those of a metric of one's own alone; curves have tables of their own."""
    values = {"ratio": 1.2, "pooled": 3.0, "curve": {"0.1": 0.5}}
    place = store(tmp_path, "cross", "m", [("a>b", "c1", values)])
    for layout in ("splits", "overview", "both"):
        for table in builder.tables(summary.split_summaries([place]), layout=layout):
            shown = [[column.id for column in group.columns] for group in table.groups]
            assert {tuple(ids) for ids in shown} == {("ratio", "pooled")}


# ------------------------------------------------------------------------------------- where rows come from
NUMBERS = [("a>b", "c1", {"mpjpe_h.world": 1.0})]
DATASET = {
    "name": "puppets", "parameters": {"size": "tiny"}, "label": "data", "version": "2", "content": "c1",
    "notes": [],
}  # fmt: skip


def table_of(places):
    (table,) = builder.tables(summary.split_summaries(places), ["mpjpe_h.world"])
    return table


def test_splits_that_were_made_alike_are_told_together(tmp_path):
    label = "copy[rule='odd; name']"
    provenance = {"dataset": DATASET, "seeds": [3], "revision": "beef", "versions": {"numpy": "2"}}
    places = [
        changed(
            store(tmp_path, split, "m", NUMBERS, label=label, version="1", code="ab"),
            **provenance,
            date=date,
        )
        for split, date in (("intra", "2026-01-01T10:00:00+00:00"), ("cross", "2026-01-02T10:00:00+00:00"))
    ]
    table = table_of(places)
    (origin,) = table.provenance
    assert (origin.splits, origin.date, origin.seeds) == (("cross", "intra"), "2026-01-02", (3,))
    assert (origin.version, origin.code, origin.revision, origin.versions) == ("1", "ab", "beef", "numpy 2")
    words = shlex.split(origin.command)
    assert words[:3] == ["bench", "run", label]
    assert str(Spec.parse(words[words.index("-d") + 1])) == "puppets[size=tiny]"
    assert words[-4:] == ["-s", "cross,intra", "--seed", "3"]
    assert ("version", "2") in table.data


@pytest.mark.parametrize("change", [{"seeds": [1]}, {"revision": "dead"}, {"versions": {"numpy": "3"}}])
def test_what_was_made_otherwise_is_told_apart(tmp_path, change):
    provenance = {"dataset": DATASET, "seeds": [0], "revision": "beef", "versions": {"numpy": "2"}}
    one = changed(store(tmp_path, "intra", "m", NUMBERS), **provenance)
    two = changed(store(tmp_path, "cross", "m", NUMBERS), **provenance | change)
    assert [origin.splits for origin in table_of([one, two]).provenance] == [("cross",), ("intra",)]


def test_predictions_made_elsewhere_are_scored_again(tmp_path):
    place = store(tmp_path, "intra", "m", NUMBERS, origin="predictions made elsewhere")
    (origin,) = table_of([place]).provenance
    assert origin.command == "bench score FOLDER"


def test_columns_unknown_to_every_result_are_refused(tmp_path):
    place = store(tmp_path, "intra", "m", [("a>b", "c1", {"mpjpe_h.world": 1.0})])
    with pytest.raises(BenchError, match="no result has a value 'mpjpe'"):
        builder.tables(summary.split_summaries([place]), ["mpjpe"])
