"""The table of all splits side by side: order, marks, rows over other cases, values of sets."""

import csv
import io

import pytest
from stored import changed, store

from retarget_bench.analysis import summary
from retarget_bench.analysis.selection import Selection
from retarget_bench.errors import BenchError
from retarget_bench.evaluation.set_metrics import SetValue, files
from retarget_bench.results import store as records
from retarget_bench.tables import body_groups, builder, rendering
from retarget_bench.tables.model import OTHER_CASES, Group

VALUE = "mpjpe_h.world"
PEOPLE = "character,legs\na,2\nb,2\n"
FID = {
    "label": "FID", "unit": "1", "better": "lower", "goal": 1.0, "index": "", "with_self": False,
    "meaning": "how unlike real motion", "tolerance": 1e-2, "formula": "", "needs": [],
    "metric": "fid",
}  # fmt: skip


def stored(root, split, name, numbers, **changes):
    """numbers: of clip after clip; None where there is no answer."""
    rows = [("a>b", f"c{n:02}", "failed" if x is None else {VALUE: x}) for n, x in enumerate(numbers)]
    place = store(root, split, name, rows, **changes)
    (place.folder / "cases.bodies.csv").write_text(PEOPLE)
    (place.folder / "cases.structures.csv").write_text("target,structure\na,s\nb,s\n")
    return place


def with_set(place, value, low, high, real="real", floor=1.0):
    values = [SetValue("fid_people", "two legs", 300, 30, value, low, high, floor, real, "net")]
    files.write(place, [*values, SetValue("fid", "s", 9, 3, reason="too few windows")])
    told = {"fid_people": FID, "fid": FID}
    return changed(place, set_values=told, metrics={"fid": "1+aa"}, date="2026-01-01")


def only_group(places, **choice) -> Group:
    (made,) = builder.overview(places, Selection(**choice))
    (group,) = made.groups
    return group


@pytest.fixture
def places(tmp_path):
    """On self ``near`` is better, on cross ``far``."""
    found = []
    for split, near, far in (("self", 1.0, 2.0), ("cross", 4.0, 3.0)):
        found += [
            stored(tmp_path, split, "near", [near + n / 100 for n in range(20)]),
            stored(tmp_path, split, "far", [far + n / 50 for n in range(20)]),
            stored(tmp_path, split, "floor", [9.0] * 20, control=True),
            stored(tmp_path, split, "some", [0.5] * 8 + [None] * 12),
        ]
    return found


def test_columns_are_of_splits_and_rows_in_the_order_of_the_last(places):
    group = only_group(places)
    assert [(column.split, column.id) for column in group.columns] == [("self", VALUE), ("cross", VALUE)]
    assert [row.label for row in group.ranked] == ["far", "near"]
    marks = {row.label: [cell.mark for cell in row.cells] for row in group.ranked}
    assert marks == {"far": ["", "best"], "near": ["best", ""]}


def test_rows_over_fewer_cases_stand_apart_with_the_best_on_the_same(places):
    group = only_group(places)
    (heading, apart), (_, controls) = group.blocks
    assert heading == OTHER_CASES
    assert [(row.label, row.beside) for row in apart] == [("some", ""), ("far", "some")]
    assert apart[0].mark == "answered 8, 8"
    values = [cell.value for cell in apart[1].cells]  # of the first eight clips
    assert values == pytest.approx([2.0 + 3.5 / 50, 3.0 + 3.5 / 50])
    assert not any(cell.mark for row in apart for cell in row.cells)
    assert [row.label for row in controls] == ["floor"]


def test_a_method_that_fails_on_one_case_stands_apart_with_its_sentence(tmp_path):
    for label, number in (("good", 1.0), ("better", 0.5)):
        stored(tmp_path, "cross", label, [number] * 20)
    stored(tmp_path, "cross", "fails", [None, *[0.1] * 19])
    (made,) = builder.overview(records.find_results(tmp_path))
    (group,) = made.groups
    assert [(row.label, row.n) for row in group.ranked] == [("better", "20"), ("good", "20")]
    assert [(row.label, row.mark, row.n) for row in group.unranked] == [
        ("fails", "answered 19 of 20", "19/20"),
        ("better", "", "19"),
    ]
    assert [(each.label, each.status, len(each.cases)) for each in made.problems] == [
        ("fails", "failed", 1)
    ]
    said = rendering.text([made])
    assert "answered fewer cases: over those only" in said
    assert "no method is ranked" not in said


def test_where_no_method_answered_all_cases_nobody_is_ranked_and_the_table_says_so(tmp_path):
    stored(tmp_path, "cross", "one", [None, *[1.0] * 19])
    stored(tmp_path, "cross", "two", [*[1.0] * 19, None])
    group = only_group(records.find_results(tmp_path))
    assert not group.ranked
    (said,) = group.absent
    assert said.startswith("cross: no method is ranked by world, since none answered all cases.")


def test_a_split_alone_has_n_and_the_same_rows(places):
    found = summary.split_summaries(places, select=Selection())
    (made,) = builder.tables(found)
    cross = made.groups[1]
    assert [row.n for row in cross.rows] == ["20", "20", "8/20", "8", "20"]
    assert [row.label for row in cross.rows] == [row.label for row in only_group(places).rows]


def test_few_clips_mark_nobody_and_tell_how_many_would_do(tmp_path):
    for name in range(11):
        numbers = [1.0 + name + n / 100 for n in range(10)]
        stored(tmp_path, "cross", f"m{name:02}", numbers)
    found = records.find_results(tmp_path)
    group = only_group(found)
    assert not any(cell.mark for row in group.rows for cell in row.cells)
    (said,) = group.absent
    assert said.startswith(
        "cross: 10 clips cannot tell the best of 11 methods from the worst (that takes 12)"
    )
    assert group.rows[0].cells[0].value < group.rows[-1].cells[0].value


def test_a_value_of_the_set_of_all_people_is_a_column(tmp_path):
    near, meets, far, other = (stored(tmp_path, "cross", name, [1.0] * 20) for name in ("a", "b", "c", "d"))
    with_set(near, 2.0, 1.8, 2.2)
    with_set(meets, 2.3, 2.1, 2.5)
    with_set(far, 9.0, 8.0, 10.0)
    with_set(other, 1.5, 1.4, 1.6, real="other", floor=0.9)
    group = only_group([near, meets, far, other])
    fid = next(n for n, column in enumerate(group.columns) if column.id == "fid_people")
    cells = {row.label: row.cells[fid] for row in group.rows}
    assert {label: (cell.value, cell.mark) for label, cell in cells.items()} == {
        "a": (2.0, "best"), "b": (2.3, "tied"), "c": (9.0, ""), "d": (1.5, ""),
    }  # fmt: skip
    assert "its own floor is 0.9" in cells["d"].reason
    assert group.floors == (("FID", "cross", "1.00"),)


def test_values_of_sets_left_from_a_run_with_other_metrics_are_no_column(tmp_path):
    place = with_set(stored(tmp_path, "cross", "a", [1.0] * 20), 2.0, 1.8, 2.2)
    changed(place, set_values={})
    assert [column.id for column in only_group([place]).columns] == [VALUE]


def test_bodies_and_variants_that_are_left_out_are_told(tmp_path):
    place = stored(tmp_path, "cross", "m", [1.0] * 3)
    (place.folder / "cases.bodies.csv").write_text("character,legs\na,4\nb,4\n")
    found = summary.split_summaries([place], select=Selection())
    shown, hints = body_groups.shown(found, "")
    assert ([section.bodies for section in shown], hints) == (["four-legged"], [])
    with pytest.raises(BenchError, match="no case is between bodies of the group 'people'; there are four"):
        body_groups.shown(found, "people")


@pytest.mark.parametrize("form", sorted(rendering.RENDERERS))
def test_every_format_tells_the_splits_apart_and_whose_cases_a_row_is_over(places, form):
    drawn = rendering.RENDERERS[form](builder.overview(places))
    assert {"text": "same cases", "tex": "not ranked"}.get(form, "on the cases of some") in drawn
    assert "cross" in drawn


@pytest.mark.parametrize("form", ["text", "md", "tex", "html"])
def test_every_format_says_what_so_few_clips_can_miss(places, form):
    drawn = rendering.RENDERERS[form](builder.overview(places))
    assert "20 clips can miss failures on up to 14 % of all clips." in " ".join(drawn.split())


def test_full_notes_say_it_too(places):
    drawn = rendering.text(builder.overview(places), notes=True)
    assert "20 clips can miss failures on up to 14 % of all clips." in " ".join(drawn.split())


def test_floors_and_learned_methods_are_named_once_for_splits_that_share_a_table(tmp_path):
    for split, order in (("self", (1.0, 2.0)), ("cross", (2.0, 1.0))):
        for name, number in zip(("a", "b"), order, strict=True):
            place = stored(tmp_path, split, name, [number] * 20, trained_on={"characters": ("here",)})
            with_set(place, number, 0.5, 3.0)
    found = summary.split_summaries(records.find_results(tmp_path), select=Selection())
    drawn = rendering.latex(builder.tables(found, builder.OVERVIEW_COLUMNS))
    told = [line for line in drawn.splitlines() if line.startswith(("% Floor", "% Learned", "% n:"))]
    assert told == [
        "% Floor of FID, that of the references: self 1.00, cross 1.00.",
        "% Learned: b, a (bench info says from what and for how long).",
    ]


def test_all_splits_stand_side_by_side_where_they_fit_and_else_below_each_other(places):
    made = builder.overview(places)
    wide, narrow = (rendering.text(made, columns=columns) for columns in (100, 30))
    heads = [line.split() for line in (*wide.splitlines(), *narrow.splitlines())]
    assert [head for head in heads if head and set(head) <= {"self", "cross"}] == [
        ["self", "cross"], ["self"], ["cross"],
    ]  # fmt: skip
    assert wide.count("3.19") == narrow.count("3.19") == 1


def test_csv_has_a_line_per_split(places):
    found = summary.split_summaries(places, select=Selection())
    lines = list(csv.DictReader(io.StringIO(rendering.comma_separated(builder.tables(found)))))
    mine = [line for line in lines if line["method"] == "near" and not line["not_ranked"]]
    assert [line["split"] for line in mine] == ["self", "cross"]


def test_what_decides_ties_of_fid_is_told_where_there_is_any(tmp_path):
    plain = [stored(tmp_path / "plain", "cross", name, [x] * 20) for name, x in (("a", 1.0), ("b", 2.0))]
    whole = [
        with_set(stored(tmp_path, "cross", n, [x] * 20), x, 1.0, 9.0) for n, x in (("a", 1.0), ("b", 2.0))
    ]
    for places, there in ((plain, False), (whole, True)):
        made = builder.overview(places, Selection())
        for drawn in (
            rendering.text(made, notes=True), rendering.markdown(made), rendering.RENDERERS["html"](made),
        ):  # fmt: skip
            said = " ".join(drawn.split())
            assert ("of FID: its interval meets that of the best" in said) is there
    assert "tied: its interval meets that of the best" in rendering.RENDERERS["html"](made)
    assert "over 300 windows of 30 clips" in rendering.RENDERERS["html"](made)


def test_structures_without_values_of_sets_share_one_note(tmp_path):
    for split in ("self", "cross"):
        place = stored(tmp_path, split, "m", [1.0] * 3)
        lacking = [SetValue("fid", each, 9, 3, reason=f"fid needs more on {each}") for each in ("s", "t")]
        files.write(place, lacking)
        changed(place, set_values={"fid": FID}, metrics={"fid": "1+aa"}, date="2026-01-01")
    found = summary.split_summaries(records.find_results(tmp_path))
    (made,) = builder.tables(found, with_sets=True)
    assert [line for line in made.hints if line.startswith("No values")] == [
        "No values of sets on bodies of these structures: self, cross: s, t. "
        "The first: fid needs more on s."
    ]
