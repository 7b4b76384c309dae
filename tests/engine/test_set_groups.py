"""Values of whole sets in tables: their floor, their n, and when they may not stand beside each other."""

import csv
import io
from dataclasses import replace

import pytest
from stored import FID, changed, store, with_sets

from retarget_bench.analysis import summary
from retarget_bench.api import TWO_LEGS
from retarget_bench.evaluation import set_metrics
from retarget_bench.evaluation.set_metrics import SetValue
from retarget_bench.tables import builder, rendering
from retarget_bench.tables.model import NOT_APPLICABLE, NOT_RUN, OTHER_VERSION

COMPLETE = SetValue("fid.structure", "body22", 300, 30, 12.5, 10.0, 15.0, 8.25, "real", "net")


def store_sets(root, name, values, metrics="1+aa", **changes):
    place = store(root, "cross", name, [("a>b", "c1", {"mpjpe_h.world": 1.0})])
    return with_sets(place, values, metrics={"fid_structure": metrics}, **changes)


def groups(places, columns):
    return groups_of(summary.split_summaries(places), columns)


def groups_of(summaries, columns):
    (table,) = builder.tables(summaries, columns)
    return table, table.groups


def test_values_stand_beside_their_floor_and_interval(tmp_path):
    other = SetValue("fid.structure", "body28", 200, 25, 20.0, None, None, 9.0, "real28", "net28")
    places = [
        store_sets(tmp_path, "near", [COMPLETE, other]),
        store_sets(
            tmp_path,
            "far",
            [SetValue("fid.structure", "body22", 300, 30, 40.0, 35.0, 45.0, 8.25, "real", "net")],
        ),
    ]
    _, (of_cases, one, two) = groups(places, ["mpjpe_h.world", "fid.structure"])
    assert of_cases.counted == "cases"
    assert (one.counted, one.split) == ("windows", "cross")
    assert (
        one.title == "cross, all answers on bodies of structure body22 as one set: 300 windows of 30 clips"
    )
    assert [row.label for row in one.rows] == ["near", "far"]
    near, far = (row.cells[0] for row in one.rows)
    assert (near.value, near.interval.low, near.n, near.clips, near.mark) == (12.5, 10.0, 300, 30, "")
    assert far.value == 40.0
    assert one.below[0] == "Floor of FID, that of real motion: cross 8.2."
    assert {row.label: row.cells[0].text for row in two.rows} == {
        "near": "20.0", "far": NOT_APPLICABLE,
    }  # fmt: skip
    assert "Not ranked" in one.below[1]


def test_what_was_measured_otherwise_stays_out_or_says_so(tmp_path):
    def value(**others):
        return [SetValue(**(vars(COMPLETE) | others))]

    places = [
        store_sets(tmp_path, "a", [COMPLETE], date="2026-02-01"),
        store_sets(tmp_path, "b", [COMPLETE], date="2026-02-01"),
        store_sets(tmp_path, "fewer", value(real="another", n=280, floor=8.5), date="2026-02-01"),
        store_sets(tmp_path, "metric", [COMPLETE], metrics="0+aa"),
        store_sets(
            tmp_path, "small", value(value=None, reason="fid.structure needs 1024 windows, here 300")
        ),
        changed(store_sets(tmp_path, "without", []), metrics={}, set_values={}),
    ]
    table, (group,) = groups(places, ["fid.structure"])
    cells = {row.label: row.cells[0] for row in group.rows}
    assert cells["fewer"].value == 12.5
    assert "280 windows" in cells["fewer"].reason
    assert "its own floor is 8.5" in cells["fewer"].reason
    assert cells["metric"].text == OTHER_VERSION
    assert cells["small"].text == NOT_APPLICABLE
    assert cells["small"].reason.startswith("fid.structure needs ")
    assert cells["without"].text == NOT_RUN
    assert group.below[0].endswith("cross 8.2.")
    assert len(table.footnotes) == 4


def test_they_are_shown_when_asked_for_and_pointed_at_otherwise(tmp_path):
    places = [store_sets(tmp_path, "m", [COMPLETE])]
    (plain,) = builder.tables(summary.split_summaries(places))
    assert [group.counted for group in plain.groups] == ["cases"]
    assert any("--columns fid.structure" in note for note in plain.notes)
    assert builder.all_columns(summary.split_summaries(places))[-1] == "fid.structure"
    assert set_metrics.read(places[0]) == [COMPLETE]


@pytest.mark.parametrize("form", sorted(rendering.RENDERERS))
def test_every_renderer_says_what_n_counts(tmp_path, form):
    table, _ = groups([store_sets(tmp_path, "m", [COMPLETE])], ["fid.structure"])
    drawn = rendering.RENDERERS[form]([table])
    assert "12.5" in drawn
    assert "8.2" in drawn or form == "csv"
    assert form in ("csv", "json", "tex") or (
        "windows" in drawn and "compare such values by their intervals" in " ".join(drawn.split())
    )


def test_a_set_of_a_metrics_own_has_a_group_with_its_values_alone(tmp_path):
    """Columns of other sets would be empty there, and its column in those of structures."""
    place = store_sets(
        tmp_path,
        "near",
        [COMPLETE, SetValue("fid", TWO_LEGS, 316, 43, 1.05, 0.5, 1.5, 0.75, "real", "small")],
    )
    changed(place, set_values={"fid.structure": FID, "fid": {**FID, "metric": "fid"}})
    _, (of_structure, of_people) = groups([place], ["fid.structure", "fid"])
    assert [column.id for column in of_structure.columns] == ["fid.structure"]
    assert [column.id for column in of_people.columns] == ["fid"]
    assert of_people.title == "cross, all answers on bodies on two legs as one set: 316 windows of 43 clips"
    assert [row.cells[0].value for row in of_people.rows] == [1.05]


def test_an_unfinished_split_beside_a_finished_one_says_why_it_has_no_value_of_its_set(tmp_path):
    people = SetValue("fid", TWO_LEGS, 316, 43, 1.05, 0.98, 1.12, 0.75, "real", "net")
    place = store_sets(tmp_path, "m", [people])
    changed(place, set_values={"fid": {**FID, "metric": "fid"}})
    (complete,) = (replace(each, bodies="people") for each in summary.split_summaries([place]))
    begun = replace(
        complete,
        split="intra",
        so_far="1 of 2 clips so far",
        scores=[replace(each, sets=[]) for each in complete.scores],
    )
    _, shown = groups_of([complete, begun], ["mpjpe_h.world", "fid"])
    sentences = [sentence for group in shown for sentence in group.below]
    assert "intra: not shown: FID (computed of all cases, once they are done)" in sentences


def test_of_several_seeds_the_first_is_told(tmp_path):
    place = changed(store_sets(tmp_path, "m", [COMPLETE]), seeds=[0, 1, 2])
    _, (group,) = groups([place], ["fid.structure"])
    assert group.rows[0].cells[0].reason == "of the first of its 3 seeds"


def test_csv_names_the_structure(tmp_path):
    table, _ = groups([store_sets(tmp_path, "m", [COMPLETE])], ["mpjpe_h.world", "fid.structure"])
    lines = list(csv.DictReader(io.StringIO(rendering.comma_separated([table]))))
    assert [(row["structure"], row["method"], row["fid.structure"]) for row in lines] == [
        ("", "m", ""), ("body22", "m", "12.5"),
    ]  # fmt: skip
