"""Names as people write them: of columns, values, methods and formats."""

import pytest
from click.testing import CliRunner
from stored import VALUES, changed, store

from retarget_bench.commands import plot
from retarget_bench.commands.check import Options, _criteria
from retarget_bench.commands.plugins import info
from retarget_bench.errors import BenchError
from retarget_bench.plugins import registry
from retarget_bench.python import plans
from retarget_bench.results import result_matrix
from retarget_bench.results.header import DeclaredValue
from retarget_bench.tables import names
from retarget_bench.tables.builder import DEFAULT_COLUMNS


def value(label, metric="", index=""):
    return DeclaredValue(
        label=label, meaning="", unit="1", better="lower", goal=1.0, tolerance=0.0, index=index,
        with_self=False, metric=metric,
    )  # fmt: skip


KNOWN = {
    "contact_recall.speed": value("contact recall, by speed", "contact_speed"),
    "turn.local": value("turning error, local", "turns"),
    "turn.world": value("turning error, global", "turns"),
    "contact_f1": value("contact F1", "contact"),
    "contact_recall": value("contact recall", "contact"),
    "mpjpe_h.root": value("MPJPE, root-aligned", "position"),
    "mpjpe_h.world": value("MPJPE", "position"),
    "fid.structure": value("FID, by structure", "fid_structure"),
    "fid": value("FID", "fid"),
}


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("Turn.Local", "turn.local"),
        ("MPJPE", "mpjpe_h.world"),
        ("mpjpe-h", "mpjpe_h.world"),  # of a family, the first default column
        ("position", "mpjpe_h.world"),
        ("mpjpe, root aligned", "mpjpe_h.root"),
        ("contact recall, by speed", "contact_recall.speed"),
        ("contact_recall.speed", "contact_recall.speed"),  # an id, whatever else has it as its label
        ("contact-recall", "contact_recall"),
        ("contact", "contact_recall"),
        ("turning error,  GLOBAL", "turn.world"),
        ("root-aligned MPJPE", "mpjpe_h.root"),
        ("FID by structure", "fid.structure"),
        ("fid", "fid"),
        ("speed", "fps"),
    ],
)
def test_a_column_is_found_however_it_is_written(text, expected):
    assert names.value_id(text, {**KNOWN, "fps": names.SPEED}) == expected


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("n", "n is the number of cases, no value"),
        ("speed", "is no value of single cases; bench table --columns speed"),
        ("joint", r"give the id: jerk_ratio \(joint jerk\), joint_a \(joint, one\)"),
        ("ratio_src", "bench table --against source shows ratio, source"),
    ],
)
def test_columns_that_are_no_values_and_names_of_several_are_explained(text, message):
    values = KNOWN | {
        "joint_a": value("joint, one", "joint"),
        "joint_b": value("joint, two", "joint"),
        "jerk_ratio": value("joint jerk", "smoothness"),
        "ratio": value("ratio"),
        "ratio_src": value("ratio, source"),
    }
    with pytest.raises(BenchError, match=message):
        names.value_id(text, values)


def test_a_family_of_several_values_lists_them():
    for family in ("turn", "turns", "turning error"):
        with pytest.raises(BenchError, match=r"one of 2 values.*turn\.local \(turning.*, turn\.world"):
            names.value_id(family, KNOWN)


def test_of_values_of_one_label_the_one_that_tables_show_is_meant():
    values = KNOWN | {"older": value("FID", "older")}
    assert names.value_ids(["FID", "older"], values) == ["fid", "older"]


def test_labels_that_were_split_at_their_commas_are_one_name():
    words = ["mpjpe", "MPJPE", "Root-aligned", "contact recall", "by speed", "fid"]
    assert names.value_ids(words, KNOWN) == [
        *("mpjpe_h.world", "mpjpe_h.root", "contact_recall.speed", "fid"),
    ]


def test_an_unknown_name_is_answered_with_close_ones_or_all():
    with pytest.raises(
        BenchError, match=r"value 'contact recal'; did you mean contact_recall \(contact rec"
    ):
        names.value_id("contact recal", KNOWN)
    with pytest.raises(
        BenchError, match=r"value 'xyzzy'; there are mpjpe_h\.world \(MPJPE\), .*and others"
    ):
        names.value_id("xyzzy", {**KNOWN, "fps": names.SPEED})


def test_columns_are_shown_once():
    assert names.value_ids(["mpjpe", "FID", "position"], KNOWN) == ["mpjpe_h.world", "fid"]


def test_every_label_and_id_of_the_installed_metrics_is_known_by_itself():
    values = names.installed()
    assert set(DEFAULT_COLUMNS) - {"fps"} <= set(values)
    labels = [each.label for each in values.values()]
    for key, each in values.items():
        assert key in names.value_ids([key], values)
        assert names.value_id(each.label.upper(), values) == key
        assert names.value_id(" ".join(reversed(each.label.split(", "))), values) == key
    assert len(set(labels)) == len(labels)


@pytest.mark.parametrize(
    ("written", "meant"),
    [
        ("HuMoT", "humot"),
        ("PAN[variant=paper]+footfix", "pan[variant=paper]+footfix"),
        ("copy rotations", "copy_rotations"),
        ("Copy-Rotations[root_rule=none]", "copy_rotations[root_rule=none]"),
        ("no such thing", "no such thing"),
    ],
)
def test_methods_are_found_however_they_are_written(written, meant):
    assert registry.spelled(written, ("methods",)) == meant


@pytest.mark.parametrize(
    ("text", "first"),
    [
        ("mpjpe", "MPJPE, value of metric position"),
        ("contact recall", "contact recall, value of metric contact"),
        ("HuMoT", "method humot (built-in)"),
        ("FID", "metric fid (built-in)"),
        ("contact_recall", "contact recall, value of metric contact"),
        ("contact_recall.speed", "contact recall, by speed, value of metric contact_speed"),
    ],
)
def test_info_about_whatever_has_the_name(text, first):
    assert CliRunner().invoke(info, [text]).output.startswith(first)


def test_a_chart_of_a_value_of_sets_is_refused_by_a_sentence(tmp_path):
    place = store(tmp_path, "cross", "m", [("a>b", "c1", {"mpjpe_h.world": 1.0})])
    changed(place, set_values={"fid": VALUES["ratio"] | {"label": "FID"}})
    matrices = result_matrix.result_matrices([place])
    with pytest.raises(BenchError, match=r"FID .* is a value of all answers as one set"):
        plot._value_id(matrices, "FID")
    assert plot._value_id(matrices, "World") == "mpjpe_h.world"


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("MPJPE", ("position",)),
        ("position", ("position",)),
        ("contact recall", ("contact",)),
        ("contact_recall.speed", ("contact_speed",)),
        ("FID", ("fid",)),
        ("fid_structure[x=1]", ("fid_structure[x=1]",)),
        ("nothing", ("nothing",)),
    ],
)
def test_metrics_are_found_by_the_labels_of_their_values(text, expected):
    assert plans.metric_names([text]) == expected


def test_info_about_nothing_suggests_methods_and_values():
    messages = [str(CliRunner().invoke(info, [text]).exception) for text in ("humott", "foot skatin")]
    assert "did you mean humot" in messages[0]
    assert "did you mean foot_slide (foot skating)" in messages[1]


def test_check_watches_the_contact_recall_of_the_table():
    """The line of docs/check.md."""
    limits = ("2%", "contact recall=1%, contact F1, by speed=3%")
    criteria = _criteria(Options(columns="mpjpe,contact recall", worse_only=True, tolerance=limits))
    assert criteria.values == {"mpjpe_h.world", "contact_recall"}
    shares = {key: each.relative for key, each in criteria.tolerances.items()}
    assert shares == {"": 0.02, "contact_recall": 0.01, "contact_f1.speed": 0.03}
