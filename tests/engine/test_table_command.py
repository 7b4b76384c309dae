"""``bench table`` from the outside."""

import os
import pty
from typing import get_args

import pytest
from click.testing import CliRunner
from stored import VALUES, changed, store

from retarget_bench.analysis.breakdown import By
from retarget_bench.cli import group
from retarget_bench.commands.options import screen_width
from retarget_bench.commands.table import Options
from retarget_bench.evaluation import timing
from retarget_bench.options import declared
from retarget_bench.python import progress
from retarget_bench.results import store as records
from retarget_bench.tables.rendering import RENDERERS, WITH_INTERVALS

FORMATS = [each for each in declared(Options)["format"].choices if each]


@pytest.fixture
def results(tmp_path):
    for name, shift in (("one", 0.0), ("two", 1.0)):
        numbers = [("a>b", f"c{n}", {"mpjpe_h.world": 2.0 + shift + n / 10}) for n in range(12)]
        store(tmp_path / "runs", "cross", name, numbers)
    return tmp_path / "runs"


def bench(*words) -> str:
    result = CliRunner().invoke(group, ["table", "-r", *map(str, words)])
    assert result.exit_code == 0, result.output
    return result.output


def test_the_formats_are_those_of_the_renderers():
    assert set(FORMATS) == set(RENDERERS) == set(WITH_INTERVALS)


@pytest.mark.parametrize(
    ("ending", "form"),
    [("txt", "text"), ("md", "md"), ("tex", "tex"), ("html", "html"), ("csv", "csv"), ("json", "json")],
)
def test_the_format_follows_the_ending_of_the_file(results, tmp_path, ending, form):
    assert bench(results, "-o", tmp_path / f"t.{ending}") == f"wrote {tmp_path / f't.{ending}'}\n"
    assert (tmp_path / f"t.{ending}").read_text(encoding="utf-8") == bench(results, "-f", form)
    bench(results, "-o", tmp_path / f"u.{ending}", "-f", "csv")
    assert (tmp_path / f"u.{ending}").read_text(encoding="utf-8") == bench(results, "-f", "csv")


@pytest.mark.parametrize("ending", ["png", "xlsx"])
def test_an_ending_that_is_no_format_of_tables_is_refused(results, tmp_path, ending):
    file = tmp_path / f"t.{ending}"
    result = CliRunner().invoke(group, ["table", "-r", str(results), "-o", str(file)])
    assert result.exit_code
    assert f"t.{ending} is to be {ending}; there are text, md" in str(result.exception)
    assert not file.exists()
    bench(results, "-o", file, "-f", "text")
    assert file.exists()


def test_intervals_come_on_request_in_text_and_always_in_pages(results):
    assert "They hold for" not in bench(results)
    assert "They hold for" in bench(results, "--intervals")
    assert "They hold for" in bench(results, "-f", "html")


def test_breakdowns_are_asked_for_by_name(results):
    assert "by clip" in bench(results, "--by", "clip")
    result = CliRunner().invoke(group, ["table", "-r", str(results), "--by", "colour"])
    assert result.exit_code == 2
    assert all(each in result.output for each in get_args(By))


def test_a_task_that_there_is_not_is_told(results):
    result = CliRunner().invoke(
        group, ["table", "-r", str(results), "--task", "upsamle"], standalone_mode=False
    )
    assert "there is no task 'upsamle'; results are of retarget, reconstruct" in str(result.exception)


@pytest.mark.parametrize("form", FORMATS)
def test_published_tables_are_drawn_in_every_format(results, form):
    drawn = bench(results, "--paper", "pan-table1", "-f", form)
    assert "8.86" in drawn
    assert form == "csv" or "all others were computed here" in " ".join(drawn.replace("-{}", "-").split())


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["pan-table1", "--all"], "--paper has columns and splits of its own"),
        (["pan-table3", "--bodies", "people"], "leave --bodies"),
    ],
)
def test_published_tables_have_their_own_columns_and_sets_their_own_bodies(results, words, message):
    result = CliRunner().invoke(group, ["table", "-r", str(results), "--paper", *words])
    assert message in str(result.exception)


def test_one_split_has_more_columns_and_all_stand_side_by_side(results):
    for name in ("one", "two"):
        numbers = [("a>a", f"c{n}", {"mpjpe_h.world": 1.0, "jerk_ratio": 1.0}) for n in range(3)]
        values = VALUES | {"jerk_ratio": VALUES["ratio"] | {"label": "jerk ratio"}}
        changed(store(results, "self", name, numbers), values=values)
    both = bench(results)
    assert "cross: 12 cases of 12 clips; self: 3 cases of 3 clips" in both
    assert "jerk" not in both.partition("method")[0]
    alone = bench(results, "-s", "self")
    assert "cross" not in alone
    assert "jerk" in alone.partition("method")[0]
    result = CliRunner().invoke(group, ["table", "-r", str(results), "-s", "up"])
    assert "no case is in the split up; self and cross have some" in str(result.exception)


def test_methods_are_named_in_one_word_or_several(results):
    numbers = [("a>b", f"c{n}", {"mpjpe_h.world": 7.0}) for n in range(12)]
    store(results, "cross", "three[a=1,b=2]", numbers)
    shown = bench(results, "-m", "ONE,three[a=1,b=2]")
    assert ("one" in shown, "three[a=1,b=2]" in shown, "two" in shown) == (True, True, False)
    assert bench(results, "-m", "one", "-m", "three[a=1,b=2]") == shown


def test_notes_come_on_request(results):
    assert "two clips were dropped" not in bench(results)
    assert "two clips were dropped" in bench(results, "--notes")


@pytest.mark.parametrize(("columns", "most"), [("20", 80), ("90", 90), ("", 100), ("999", 200)])
def test_text_is_as_wide_as_the_terminal(results, monkeypatch, columns, most):
    monkeypatch.setenv("COLUMNS", columns)
    assert screen_width() == most
    assert max(map(len, bench(results, "--notes").splitlines())) <= most


@pytest.mark.parametrize("form", ["text", "md", "tex"])
def test_speeds_are_no_means_and_controls_have_none_worth_telling(results, form):
    numbers = [("a>b", f"c{n}", {"mpjpe_h.world": 9.0}) for n in range(12)]
    store(results, "cross", "still", numbers, control=True)
    for place in records.find_results(results):
        timing.write(place, [timing.Time("data/a>b/c1", 100, 0.5, 0.0)])
    shown = bench(results, "--columns", "speed", "-f", form)
    assert "200" in shown
    assert "still" not in shown
    assert "means over source clips" not in shown.lower()
    assert "measured once" in shown


def test_progress_is_a_line_a_minute_where_there_is_no_terminal(monkeypatch, capsys):
    clock = [0.0]
    monkeypatch.setattr(progress.time, "monotonic", lambda: clock[0])
    with progress.progress_bar("bench run", "cases") as report:
        for clock[0], count in ((0.0, 0), (30.0, 100), (60.0, 200), (61.0, 201), (120.0, 400)):
            report(count, 400)
    assert capsys.readouterr().err.splitlines() == [
        "bench run: 200 of 400 cases, about 1.0 min left",
        "bench run: 400 of 400 cases in 2.0 min",
    ]


def stepped_work(clock, seconds):
    """Work in two loops, of which the first is left early."""
    with progress.stepped("bench report") as over:
        for each in over(range(10)):
            if each == 2:
                break
        for _ in over("abcde"):
            clock[0] += seconds / 5


def test_steps_of_several_loops_are_one_progress(monkeypatch, capsys):
    clock = [0.0]
    monkeypatch.setattr(progress.time, "monotonic", lambda: clock[0])
    stepped_work(clock, 150.0)
    assert capsys.readouterr().err.splitlines() == [
        "bench report: 12 of 15 steps, about 0.2 min left",
        "bench report: 14 of 15 steps, about 0.1 min left",
        "bench report: 15 of 15 steps in 2.5 min",
    ]
    stepped_work(clock, 1.9)
    assert capsys.readouterr().err == "", "what is quick says nothing"


def test_progress_is_lines_on_a_terminal_without_a_size(monkeypatch):
    master, terminal_fd = pty.openpty()  # as yet without a size
    with os.fdopen(terminal_fd, "w") as terminal:
        monkeypatch.setattr(progress.sys, "stderr", terminal)
        with progress.progress_bar("bench run ik", "answers") as tell:
            tell(4, 4)
    assert os.read(master, 1000).decode().startswith("bench run ik: 4 of 4 answers")
    os.close(master)


def test_speed_is_no_column_of_a_breakdown(results):
    result = CliRunner().invoke(group, ["table", "-r", str(results), "--by", "clip", "--columns", "fps"])
    assert result.exit_code != 0
    assert "fps has no number per clip" in str(result.exception) + result.output


def test_a_name_without_an_ending_is_text(results, tmp_path):
    bench(results, "-o", tmp_path / "table")
    assert (tmp_path / "table").read_text(encoding="utf-8") == bench(results)


def test_an_ending_that_a_command_does_not_write_is_refused(results, tmp_path):
    words = ["compare", "one", "two", "--results", str(results), "-o", str(tmp_path / "c.html")]
    result = CliRunner().invoke(group, words)
    assert "c.html is to be html; there are text, md, csv" in str(result.exception)
    assert not (tmp_path / "c.html").exists()
