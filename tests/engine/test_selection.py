"""Which methods and bodies tables are made of."""

import pytest
from click.testing import CliRunner
from stored import metadata, running, store

from retarget_bench.analysis import summary
from retarget_bench.analysis.selection import Selection, label_of
from retarget_bench.cli import group
from retarget_bench.errors import BenchError
from retarget_bench.figures.data import rows
from retarget_bench.report import chapters
from retarget_bench.results import result_matrix
from retarget_bench.results import store as records
from retarget_bench.tables import builder

VALUE = "mpjpe_h.world"
LEGS = {"ann": "2", "bo": "2", "rex": "4"}
CASES = (("ann>bo", "c1"), ("bo>ann", "c2"), ("rex>rex", "c3"), ("ann>rex", "c4"))


def stored(root, file, cases=CASES, **changes):
    place = store(
        root, "cross", file, [(*case, {VALUE: 1.0 + n}) for n, case in enumerate(cases)], **changes
    )
    metadata(place, legs=LEGS)
    return place


def sections(places, **choice):
    summaries = summary.split_summaries(places, select=Selection(**choice))
    return {section.bodies: section for section in summaries}


def labels(places, **choice):
    return [score.label for score in sections(places, **choice)["people"].scores]


def test_bodies_on_two_and_on_four_legs_are_told_apart(tmp_path):
    by_bodies = sections([stored(tmp_path, "m")])
    means = {bodies: section.scores[0].means[VALUE].value for bodies, section in by_bodies.items()}
    assert means == {"people": 1.5, "four-legged": 3.0, "mixed": 4.0}
    assert by_bodies["people"].clip_count == 2
    assert by_bodies["people"].scores[0].asked == 2


def test_who_answers_all_people_is_ranked_among_them(tmp_path):
    numbers = [(*case, {VALUE: 1.0} if "rex" not in case[0] else "unsupported") for case in CASES]
    places = [stored(tmp_path, "all"), store(tmp_path, "cross", "people_only", numbers)]
    assert summary.split_summaries(places)[0].scores[1].unranked == "answered 2 of 4"
    assert sections(places)["people"].scores[1].unranked == ""
    assert sections(places)["people"].rankings[VALUE].order == ("people_only", "all")


def test_a_name_alone_means_the_only_row_with_weights_of_ones_own(tmp_path):
    one, other = "mine[weights=a-1d1eaf33]", "mine[weights=b-2e2fb044]"
    assert label_of("mine", {one, "other"}) == one
    assert label_of("mine", {one, other}) is None
    assert label_of("mine", {one, "mine"}) == "mine"


def test_methods_are_chosen_by_label_in_any_case_and_controls_stay(tmp_path):
    places = [stored(tmp_path, "One"), stored(tmp_path, "two"), stored(tmp_path, "still", control=True)]
    assert labels(places, methods=("ONE",)) == ["One", "still"]
    assert labels(places, methods=("two", "One"), controls=False) == ["One", "two"]
    assert labels(places, controls=False) == ["One", "two"]
    with pytest.raises(BenchError, match=r"no results of 'tow' here; did you mean two"):
        sections(places, methods=("tow",))


def test_variants_of_the_card_step_back_where_the_method_itself_is_there(tmp_path):
    variant = "copy_rotations[root_rule=none]"
    method = {"name": "copy_rotations", "label": variant, "parameters": {"root_rule": "none"}}
    other = {"name": "copy_rotations", "label": "copy_rotations[root_rule=hips]"}
    places = [
        stored(tmp_path, "copy_rotations"),
        stored(tmp_path, "v", **method),
        stored(tmp_path, "w", **other, parameters={"root_rule": "hips"}),
    ]
    assert labels(places) == ["copy_rotations", "copy_rotations[root_rule=hips]"]
    assert sections(places)["people"].variants == (variant,)
    assert variant in labels(places, variants=True)
    assert labels(places[1:]) == [variant, "copy_rotations[root_rule=hips]"]
    assert labels(places, methods=(variant,)) == [variant]


def answered(places, **choice):
    parts = sections(places, **choice).values()
    return {(each.bodies, score.label): (score.ok, score.asked) for each in parts for score in each.scores}


def test_a_running_run_is_shown_over_the_cases_that_all_have_done(tmp_path):
    """By id the cases are ann>bo, ann>rex (mixed), bo>ann and rex>rex."""
    places = [
        running(stored(tmp_path, name), count) for name, count in (("most", 3), ("some", 1), ("none", 0))
    ]
    complete = stored(
        tmp_path, "whole", (("ann>bo", "c1"), ("bo>ann", "c2"), ("rex>rex", "c3"), ("ann>rex", "c4"))
    )
    assert set(records.find_results(tmp_path)) == {*places, complete}
    assert answered([*places, complete]) == {
        ("people", "most"): (1, 1), ("people", "some"): (1, 1), ("people", "whole"): (1, 1),
        ("mixed", "most"): (1, 1), ("mixed", "whole"): (1, 1),
        ("four-legged", "whole"): (1, 1),
    }  # fmt: skip
    people = sections([*places, complete])["people"]
    assert {score.means[VALUE].value for score in people.scores} == {1.0}  # of ann>bo
    assert not any(score.unranked for score in people.scores)
    assert people.so_far == "1 of 2 clips so far of some"
    assert answered(places, methods=("most",)) == {("people", "most"): (2, 2), ("mixed", "most"): (1, 1)}
    with pytest.raises(BenchError, match="no case is done by all of these methods yet"):
        sections(places, methods=("none",))


def test_nothing_is_marked_while_cases_lack_and_the_table_says_so(tmp_path):
    """Not even where so many clips tell the best from the worst; marks come with the last case."""
    names, clips = ("one", "two"), [("ann>bo", f"c{n:02}") for n in range(30)]
    places = [
        store(tmp_path, "cross", name, [(*each, {VALUE: number + n / 100}) for n, each in enumerate(clips)])
        for number, name in enumerate(names, 1)
    ]

    def table():
        (table,) = builder.tables(summary.split_summaries(places, select=Selection()), [VALUE])
        return list(table.groups[0].below), [row.cells[0].mark for row in table.groups[0].ranked]

    assert table() == ([], ["best", ""])
    running(places[0], 29)
    assert table() == (["cross: 29 of 30 clips so far of one."], ["", ""])
    (matrix,) = Selection().parts(result_matrix.result_matrices(places))
    with pytest.raises(BenchError, match="cases lack in these results, so there are no ties to show"):
        rows.ties([matrix], VALUE, {})


def test_a_case_that_failed_in_a_running_run_counts_as_not_answered(tmp_path):
    cases = [("ann>bo", f"c{n}") for n in range(8)]
    well = store(tmp_path, "cross", "well", [(*each, {VALUE: 1.0}) for each in cases])
    ill = store(
        tmp_path, "cross", "ill", [(*each, {VALUE: 1.0} if n else "failed") for n, each in enumerate(cases)]
    )
    (split_summary,) = summary.split_summaries([running(well, 6), running(ill, 4)], select=Selection())
    assert {score.label: (score.ok, score.asked) for score in split_summary.scores} == {
        "well": (4, 4),
        "ill": (3, 4),
    }
    assert split_summary.scores[0].unranked + split_summary.scores[1].unranked == "answered 3 of 4"


def test_comparisons_and_reports_read_a_running_run_and_say_so(tmp_path):
    places = [stored(tmp_path, name, [("ann>bo", f"c{n}") for n in range(5)]) for name in ("one", "two")]
    running(places[0], 3)
    result = CliRunner().invoke(group, ["compare", "one", "two", "--results", str(tmp_path)])
    assert "* one: 3 of 5 cases so far" in result.output
    assert "the same" in result.output
    none = running(stored(tmp_path, "three", [("ann>bo", f"c{n}") for n in range(5)]), 0)
    assert not none.complete
    result = CliRunner().invoke(group, ["compare", "one", "three", "--results", str(tmp_path)])
    assert "a number for; one: 3 of 5 cases so far; three: 0 of 5" in str(result.exception)
    page = tmp_path / "report.html"
    result = CliRunner().invoke(group, ["report", "-r", str(tmp_path), "--clips", "0", "-o", str(page)])
    assert result.exit_code == 0, result.exception
    assert "cross: 3 of 5 clips so far of one." in page.read_text()


def test_a_control_that_is_asked_for_comes_without_the_others(tmp_path):
    places = [stored(tmp_path, "m"), *(stored(tmp_path, name, control=True) for name in ("still", "right"))]
    assert labels(places, methods=("right",)) == ["right"]
    assert labels(places, methods=("m", "right")) == ["m", "right"]
    assert labels(places, methods=("m",)) == ["m", "still", "right"]


def test_a_report_leaves_them_out_unless_they_are_asked_for(tmp_path):
    variant = "copy_rotations[root_rule=none]"
    stored(tmp_path, "copy_rotations")
    stored(tmp_path, "v", name="copy_rotations", label=variant, parameters={"root_rule": "none"})

    def shown(table):
        return {row.label for row in table.groups[0].rows}

    for options in ({}, {"variants": True}, {"methods": [variant]}):
        chapter = chapters.chapters([tmp_path], **options)[0]
        assert (variant in shown(chapter.tables[0])) == bool(options)
        assert (variant in chapter.splits[0].section.rankings[VALUE].order) == bool(options)
