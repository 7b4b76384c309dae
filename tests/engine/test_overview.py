"""The table of all splits side by side: order, marks, rows over other cases, values of sets."""

import numpy as np
import pytest
from stored import metadata, store, with_sets

from retarget_bench.analysis import summary
from retarget_bench.errors import BenchError
from retarget_bench.evaluation.set_metrics import SetValue
from retarget_bench.results import store as records
from retarget_bench.tables import builder, rendering, requested
from retarget_bench.tables.model import Group, Table
from retarget_bench.tables.requested import Request

VALUE = "mpjpe_h.world"
PEOPLE = {"a": "2", "b": "2"}


def stored(root, split, name, numbers, **changes):
    """numbers: of clip after clip; None where there is no answer."""
    rows = [("a>b", f"c{n:02}", "failed" if x is None else {VALUE: x}) for n, x in enumerate(numbers)]
    place = store(root, split, name, rows, **changes)
    metadata(place, legs=PEOPLE, structure={"a": "s", "b": "s"})
    return place


def with_fid(place, value, spread, real="real", floor=1.0):
    """A value that differs by about so much, one tenth of the clips with another."""
    tenths = value + spread * np.random.default_rng(int(100 * value)).normal(size=10)
    ends = (value - spread, value + spread)
    values = [SetValue("fid", "two legs", 300, 30, value, *ends, floor, real, "net", without=tuple(tenths))]
    return with_sets(
        place, [*values, SetValue("fid.structure", "s", 9, 3, reason="too few windows")], "fid"
    )


def overview(places) -> list[Table]:
    return requested.tables(places, Request())


def only_group(places) -> Group:
    (table,) = overview(places)
    (group,) = table.groups
    return group


@pytest.fixture
def places(tmp_path):
    """On self ``near`` is better, on cross ``far``."""
    paths = []
    for split, near, far in (("self", 1.0, 2.0), ("cross", 4.0, 3.0)):
        paths += [
            stored(tmp_path, split, "near", [near + n / 100 for n in range(20)]),
            stored(tmp_path, split, "far", [far + n / 50 for n in range(20)]),
            stored(tmp_path, split, "floor", [9.0] * 20, control=True),
            stored(tmp_path, split, "some", [0.5] * 8 + [None] * 12),
        ]
    return paths


def test_columns_are_of_splits_hardest_first_and_rows_in_the_order_of_the_first(places):
    group = only_group(places)
    assert [(column.split, column.id) for column in group.columns] == [("cross", VALUE), ("self", VALUE)]
    assert [row.label for row in group.ranked] == ["far", "near"]
    marks = {row.label: [cell.mark for cell in row.cells] for row in group.ranked}
    assert marks == {"far": ["best", ""], "near": ["", "best"]}


def test_who_answered_fewer_cases_is_not_ranked_and_a_sentence_has_the_best_on_the_same(places):
    group = only_group(places)
    assert [heading for heading, _ in group.blocks] == ["", "not ranked", "controls, not ranked"]
    _, (some,), (floor,) = (rows for _, rows in group.blocks)
    assert (some.label, some.mark) == ("some", "answered 8 of 20")
    assert not any(cell.mark for cell in some.cells)
    assert floor.label == "floor"
    mean = 3.0 + 3.5 / 50  # of the first eight clips
    assert group.below == (f"cross: on the 8 cases of some, far has world {mean:.2f} (some 0.50).",)


def test_where_no_method_answered_all_cases_nobody_is_ranked_and_the_table_says_so(tmp_path):
    stored(tmp_path, "cross", "one", [None, *[1.0] * 19])
    stored(tmp_path, "cross", "two", [*[1.0] * 19, None])
    group = only_group(records.find_results(tmp_path))
    assert not group.ranked
    (note,) = group.below
    assert note.startswith("cross: no method is ranked by world, since none answered all cases.")


def test_few_clips_mark_nobody_and_tell_how_many_would_do(tmp_path):
    for name in range(11):
        numbers = [1.0 + name + n / 100 for n in range(9)]
        stored(tmp_path, "cross", f"m{name:02}", numbers)
    paths = records.find_results(tmp_path)
    group = only_group(paths)
    assert not any(cell.mark for row in group.rows for cell in row.cells)
    (note,) = group.below
    assert note.startswith("cross: 9 clips cannot tell the best method from others (that takes 10)")
    assert group.rows[0].cells[0].value < group.rows[-1].cells[0].value


def test_a_value_of_the_set_of_all_people_is_a_column(tmp_path):
    near, alike, far, other = (stored(tmp_path, "cross", name, [1.0] * 20) for name in ("a", "b", "c", "d"))
    with_fid(near, 2.0, 0.1)
    with_fid(alike, 2.3, 0.1)
    with_fid(far, 9.0, 0.1)
    with_fid(other, 1.5, 0.1, real="other", floor=0.9)
    group = only_group([near, alike, far, other])
    fid = next(n for n, column in enumerate(group.columns) if column.id == "fid")
    cells = {row.label: row.cells[fid] for row in group.rows}
    assert {label: (cell.value, cell.mark) for label, cell in cells.items()} == {
        "a": (2.0, "best"), "b": (2.3, "tied"), "c": (9.0, ""), "d": (1.5, ""),
    }  # fmt: skip
    assert "its own floor is 0.9" in cells["d"].reason
    assert "Floor of FID, that of real motion: cross 1.00." in group.below


def test_bodies_that_are_left_out_are_told(tmp_path):
    places = [stored(tmp_path, split, "m", [1.0] * 3) for split in ("cross", "intra")]
    for place in places:
        metadata(place, legs={"a": "4", "b": "4"})
    (table,) = requested.tables(places, Request())
    assert {column.split for column in table.groups[0].columns} == {"cross", "intra"}
    assert (table.title, table.hints) == ("data: four-legged", ())
    with pytest.raises(BenchError, match="no case is between bodies of the group 'people'; there are four"):
        requested.tables(places, Request(bodies="people"))
    other = stored(tmp_path / "people", "self", "m", [1.0] * 3)
    (table,) = requested.tables([*places, other], Request())
    assert table.hints == ("Not shown: four-legged bodies (6 cases, --bodies four-legged).",)


def test_all_splits_stand_side_by_side_where_they_fit_and_else_below_each_other(places):
    tables = overview(places)
    wide, narrow = (rendering.text(tables, columns=columns) for columns in (100, 24))
    heads = [line.replace("-", " ").split() for line in (*wide.splitlines(), *narrow.splitlines())]
    assert [head for head in heads if head and set(head) <= {"self", "cross"}] == [
        ["cross", "self"], ["cross"], ["self"],
    ]  # fmt: skip
    assert wide.count("3.19*") == narrow.count("3.19*") == 1


def test_structures_without_values_of_sets_share_one_note(tmp_path):
    for split in ("self", "cross"):
        place = stored(tmp_path, split, "m", [1.0] * 3)
        lacking = [
            SetValue("fid.structure", each, 9, 3, reason=f"fid.structure needs more on {each}")
            for each in ("s", "t")
        ]
        with_sets(place, lacking)
    summaries = summary.split_summaries(records.find_results(tmp_path))
    (table,) = builder.tables(summaries, with_sets=True)
    assert [line for line in table.hints if line.startswith("No values")] == [
        "No values of sets on bodies of these structures: cross s, cross t, self s, self t. "
        "The first: fid.structure needs more on s."
    ]


@pytest.mark.parametrize("form", ["text", "md", "tex", "html"])
def test_every_format_says_what_so_few_clips_can_miss(places, form):
    tables = overview(places)
    drawn = rendering.text(tables, notes=True) if form == "text" else rendering.RENDERERS[form](tables)
    assert "20 clips can miss failures on up to 14 % of all clips." in " ".join(drawn.split())


def test_floors_are_told_once_for_splits_that_share_a_table(tmp_path):
    for split in ("self", "cross"):
        for name in ("a", "b"):
            place = stored(tmp_path, split, name, [1.0] * 20)
            with_fid(place, 1.0, 0.5, 3.0)
    drawn = rendering.latex(overview(records.find_results(tmp_path)))
    lines = [line for line in drawn.splitlines() if line.startswith("% Floor")]
    assert lines == ["% Floor of FID, that of real motion: cross 1.00, self 1.00."]
