"""Tables for programs: CSV and JSON."""

import csv
import io
import json
from dataclasses import replace

import pytest
from small_tables import HOSTILE, make_table

from retarget_bench.errors import printable
from retarget_bench.files import spreadsheet
from retarget_bench.tables.model import Cell
from retarget_bench.tables.rendering import comma_separated
from retarget_bench.tables.rendering.as_data import json_document


def rows(*tables) -> list[dict[str, str]]:
    return list(csv.DictReader(io.StringIO(comma_separated(tables), newline=""), strict=True))


def test_every_number_stands_with_what_belongs_to_it():
    own, other, broken, old, *intra = rows(make_table())
    assert (own["dataset"], own["split"]) == ("data words", "cross")
    assert (own["method"], own["n"]) == ("ours", "47")
    world = {key: own[f"mpjpe_h.world{key}"] for key in ("", ":low", ":high", ":mark", ":n", ":clips")}
    assert list(world.values()) == ["3.321", "2.91", "3.8", "best", "47", "43"]
    assert (other["mpjpe_h.world:mark"], other["mpjpe_h.world:seeds_sd"]) == ("tied", "0.25")
    assert (other["recall"], other["recall:mark"]) == ("", "n/a")
    assert (broken["recall"], broken["recall:mark"], broken["not_ranked"]) == ("", "failed", "words")
    assert [old[f"{key}:mark"] for key in ("mpjpe_h.world", "jerk_ratio", "recall")] == [
        "other version", "not run", "",
    ]  # fmt: skip
    assert [row["split"] for row in intra] == ["intra", "intra"]


@pytest.mark.parametrize("name", HOSTILE)
def test_names_come_back_as_they_were_but_for_what_has_no_shape(name):
    (first, *_) = rows(make_table(name, name))
    shown = "".join(each if each.isprintable() else " " for each in name)
    assert first["method"] == ("'" if shown.startswith(("=", "-")) else "") + shown
    assert first["dataset"] == f"data {shown}"
    assert first["n"] == "47"


@pytest.mark.parametrize(
    "name", ["=cmd|' /C calc'!A0", "+1+1", "-2+3", "@SUM(1)", "\t=1", "\r=1", "-", " =1"]
)
def test_no_text_is_a_formula(name):
    (read,) = csv.reader(io.StringIO(spreadsheet([[name]])))
    assert read == ["'" + name.replace("\t", " ").replace("\r", " ")]
    (first, *_) = rows(make_table(name, name))
    assert first["method"] == read[0]


def test_numbers_stay_as_they_are():
    numbers = ["-3.25", "+1e-9", "-0", "-inf", "nan", "12"]
    assert spreadsheet([[*numbers, -2.5, None]]) == ",".join([*numbers, "-2.5", "\n"])


def test_several_data_sets_share_one_header():
    one, two = make_table(), replace(make_table(), title="second")
    assert [row["dataset"] for row in rows(one, two)].count("second") == 6


def test_parts_of_a_breakdown_name_their_value():
    group = make_table().groups[0]
    broken_down = replace(group, heading="kind", subject="mpjpe_h.world", title="cross, by kind")
    (first, *_) = rows(replace(make_table(), groups=(broken_down,)))
    assert (first["value"], first["kind"], first["split"]) == ("mpjpe_h.world", "ours", "cross")
    assert "method" not in first


def strict(constant):
    raise AssertionError(f"{constant} is no JSON")


@pytest.mark.parametrize("name", HOSTILE)
def test_json_has_every_number_with_what_belongs_to_it(name):
    (table,) = json.loads(json_document([make_table(name, name)]), parse_constant=strict)
    cross, intra = table["groups"]
    assert (cross["split"], intra["split"]) == ("cross", "intra")
    own, other = cross["ranked"]
    (broken, _) = cross["unranked"]
    assert [each["id"] for each in cross["columns"]] == ["mpjpe_h.world", "jerk_ratio", "recall"]
    world, ratio, _ = own["cells"]
    assert [world[key] for key in ("value", "interval", "mark", "n", "clips")] == [
        3.321, {"low": 2.91, "high": 3.8}, "best", 47, 43,
    ]  # fmt: skip
    assert (ratio["place"], other["cells"][0]["spread"]) == (1, 0.25)
    missing = other["cells"][2]
    assert (missing["value"], missing["text"]) == (None, "n/a")
    assert (broken["mark"], broken["n"]) == (printable(name), "0/47")
    assert own["label"] == printable(name)
    assert cross["columns"][0]["unit"] == "% of height"


def test_numbers_that_json_cannot_hold_are_missing():
    group = make_table().groups[0]
    row = replace(group.ranked[0], cells=(Cell("clip", float("inf")),) * 3)
    changed_table = replace(make_table(), groups=(replace(group, ranked=(row,), unranked=()),))
    (table,) = json.loads(json_document([changed_table]), parse_constant=strict)
    cell = table["groups"][0]["ranked"][0]["cells"][2]
    assert (cell["value"], cell["text"]) == (None, "clip")
