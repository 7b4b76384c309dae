"""``bench table`` from the outside."""

import re

import pytest
from click.testing import CliRunner
from stored import store

from retarget_bench.cli import group
from retarget_bench.commands.table import BREAKDOWNS, FORMATS
from retarget_bench.tables.rendering import RENDERERS, WITH_INTERVALS


@pytest.fixture
def results(tmp_path):
    for name, shift in (("one", 0.0), ("two", 1.0)):
        numbers = [("a>b", f"c{n}", {"mpjpe_h.world": 2.0 + shift + n / 10}) for n in range(12)]
        store(tmp_path / "runs", "cross", name, numbers)
    return tmp_path / "runs"


def bench(*words) -> str:
    done = CliRunner().invoke(group, ["table", *map(str, words)])
    assert done.exit_code == 0, done.output
    return done.output


def test_the_formats_are_those_of_the_renderers():
    assert set(FORMATS) == set(RENDERERS) == set(WITH_INTERVALS)


@pytest.mark.parametrize("form", FORMATS)
def test_every_format_is_printed_and_written_alike(results, tmp_path, form):
    file = tmp_path / "table"
    assert bench(results, "-f", form, "-o", file) == f"wrote {file}\n"
    assert file.read_text(encoding="utf-8") == bench(results, "-f", form)
    assert "2.55" in file.read_text(encoding="utf-8")


def test_intervals_come_on_request_in_text_and_always_in_pages(results):
    assert "They hold for" not in bench(results)
    assert "They hold for" in bench(results, "--intervals")
    assert "They hold for" in bench(results, "-f", "html")


def test_breakdowns_are_asked_for_by_name(results):
    assert "by clip" in bench(results, "--by", "clip")
    done = CliRunner().invoke(group, ["table", str(results), "--by", "colour"])
    assert done.exit_code == 2
    assert all(each in done.output for each in BREAKDOWNS)


def test_speed_is_no_column_of_a_breakdown(results):
    done = CliRunner().invoke(group, ["table", str(results), "--by", "clip", "--columns", "fps"])
    assert done.exit_code != 0
    assert "no result has a value 'fps'" in str(done.exception) + done.output


@pytest.mark.parametrize("words", [["nowhere"], ["-d", "other"]])
def test_what_was_asked_for_and_is_not_there_is_told(results, words):
    done = CliRunner().invoke(group, ["table", str(results), *words])
    assert re.search("no results (in nowhere|of other in)", str(done.exception))


@pytest.mark.parametrize("form", FORMATS)
def test_published_tables_are_drawn_in_every_format(results, form):
    drawn = bench(results, "--paper", "pan-table1", "-f", form)
    assert "8.86" in drawn
    assert form == "csv" or "all others were computed here" in " ".join(drawn.replace("-{}", "-").split())


def test_published_tables_have_their_own_columns(results):
    done = CliRunner().invoke(group, ["table", str(results), "--paper", "pan-table1", "--all"])
    assert "--paper has columns of its own" in str(done.exception)
