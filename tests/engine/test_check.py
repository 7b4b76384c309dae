"""The regression gate on toys: marks, accepting, and damaged files."""

import re
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from retarget_bench import cli
from retarget_bench.plugins import bound, registry
from retarget_bench.results import store
from retarget_bench.verification.gate import compare, golden

TOYS = Path(__file__).parent / "toys"


@pytest.fixture(autouse=True)
def _toys(monkeypatch):
    for file in sorted(TOYS.glob("*.py")):
        registry.add_file(file)
    for name in ("TOY_WEIGHTS", "TOY_OFF", "TOY_FAILS"):
        monkeypatch.delenv(name, raising=False)


@pytest.fixture
def bench(capsys):
    """Runs ``bench check`` and gives exit status and everything it printed."""

    def run(*arguments):
        with pytest.raises(SystemExit) as stop:
            cli.main(["check", *map(str, arguments)])
        printed = capsys.readouterr()
        return stop.value.code, printed.out + printed.err

    return run


@pytest.fixture
def baseline(tmp_path, bench):
    """Golden rows of the toy learner, 2 cm off, without weights."""
    return accepted(tmp_path / "golden", bench)


def accepted(folder, bench, *more):
    outcome = bench("-r", folder, "--methods", "toy_learner", "-d", "toy_cases", *more,
                 "--accept", "first rows")  # fmt: skip
    assert outcome[0] == 0, outcome[1]
    return folder


def content(folder):
    return {p.relative_to(folder).as_posix(): p.read_bytes() for p in folder.rglob("*") if p.is_file()}


# ---------------------------------------------------------------------------------------------- marks
def test_the_first_accept_makes_a_baseline_that_is_then_the_same(baseline, bench):
    status, output = bench("-r", baseline)
    assert (status, "Same" in output) == (0, True)
    assert re.search(r"^(\d+) compared: \1 same, 0 not\.$", output, re.MULTILINE)
    assert {p.name for p in baseline.iterdir()} == {"facts.csv", "rows", "CHANGES.md"}
    (paths,) = (each for each in store.find_results(baseline / "rows") if each.split == "intra")
    height = 1.5 * (0.3 + 0.4 + np.hypot(0.1, 0.05) + 0.8)
    (tall,) = (e for e in store.read_results(paths).entries if e.case == "toy/small>tall/clip 0")
    assert tall.values["mpjpe_h.world"] == pytest.approx(100 * 0.02 / height, rel=1e-5)


@pytest.mark.parametrize(
    ("off", "mark"),
    [("0.03", "worse"), ("0.01", "better"), ("0.0200001", "worse"), ("0.0199999", "better")],
)
def test_a_method_that_moves_is_seen_for_better_or_worse(baseline, bench, monkeypatch, off, mark):
    monkeypatch.setenv("TOY_OFF", off)
    status, output = bench("-r", baseline)
    assert status == 1
    assert re.search(
        rf"^{mark} +toy_learner +mpjpe_h\.world +(intra|cross) +\d\.\d+ +\d\.\d+", output, re.MULTILINE
    )


@pytest.mark.parametrize(
    ("off", "options", "status"),
    [
        ("0.0202", ["--tolerance", "2%", "--columns", "mpjpe,PA-MPJPE"], 0),
        ("0.0206", ["--tolerance", "2%", "--columns", "mpjpe"], 1),
        ("0.0206", ["--tolerance", "2%,mpjpe=4%", "--columns", "mpjpe"], 0),
        (
            "0.0202",
            ["--tolerance", "MPJPE=0.02", "--columns", "mpjpe"],
            0,
        ),  # of 0.95 % of height, 0.0095 more
        ("0.0206", ["--tolerance", "MPJPE=0.02", "--columns", "mpjpe"], 1),
        ("0.01", ["--worse-only"], 0),
        ("0.03", ["--worse-only"], 1),
        ("0.03", ["--columns", "jerk ratio"], 0),  # a shift, which shakes nothing
        ("0.03", ["--columns", "jerk ratio,MPJPE"], 1),
    ],
)
def test_authors_choose_what_counts(baseline, bench, monkeypatch, off, options, status):
    monkeypatch.setenv("TOY_OFF", off)
    got, output = bench("-r", baseline, *options)
    assert got == status, output


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--columns", "mpjp"], "did you mean mpjpe_h.world"),
        (["--columns", ","], "columns: ',' names nothing"),
        (["--tolerance", "2"], "--tolerance takes a share, such as 2%"),
        (["--tolerance", "mpjpe=much"], "--tolerance takes a share, such as 2%"),
        (["--worse-only", "--accept", "x"], "--accept takes everything"),
    ],
)
def test_criteria_that_mean_nothing_are_told(baseline, bench, options, words):
    status, output = bench("-r", baseline, *options)
    assert (status, words in output) == (2, True)


def test_methods_with_weights_may_move_farther(tmp_path, bench, monkeypatch):
    plain = accepted(tmp_path / "plain", bench)
    monkeypatch.setenv("TOY_WEIGHTS", "w1")
    learned = accepted(tmp_path / "learned", bench)
    monkeypatch.setenv("TOY_OFF", "0.020005")  # a quarter of a thousandth
    assert bench("-r", learned)[0] == 0
    monkeypatch.setenv("TOY_OFF", "0.0201")  # five thousandths
    assert bench("-r", learned)[0] == 1
    monkeypatch.setenv("TOY_WEIGHTS", "")
    monkeypatch.setenv("TOY_OFF", "0.020005")
    assert bench("-r", plain)[0] == 1


def test_other_weights_cannot_be_compared(tmp_path, bench, monkeypatch):
    monkeypatch.setenv("TOY_WEIGHTS", "w1")
    folder = accepted(tmp_path / "golden", bench)
    monkeypatch.setenv("TOY_WEIGHTS", "w2")
    status, output = bench("-r", folder)
    assert status == 1
    assert re.search(r"not comparable +weights toy_learner +w1 +w2", output)


def test_a_case_that_fails_now_is_newly_failing_and_the_other_way_round_is_better(
    tmp_path, baseline, bench, monkeypatch
):
    angle = str(float(np.sin(0.15 * np.sin(2 * np.pi * 3 / 30 / 2))))  # clip 0, frame 3
    monkeypatch.setenv("TOY_FAILS", angle)
    status, output = bench("-r", baseline)
    assert status == 1
    assert re.search(
        r"newly failing +toy_learner +answered cases +intra +4 +2 .*RuntimeError: no idea", output
    )
    failing = accepted(tmp_path / "failing", bench)
    assert bench("-r", failing)[0] == 0
    monkeypatch.delenv("TOY_FAILS")
    status, output = bench("-r", failing)
    assert status == 1
    assert re.search(r"better +toy_learner +answered cases +intra +2 +4", output)


def changed_card(monkeypatch, **changes):
    """The metric ``position`` with another card, or the first of its values otherwise declared."""
    from retarget_bench.metrics.position import Position

    card = Position.card
    first = {name: value for name, value in changes.items() if name != "version"}
    values = (replace(card.values[0], **first), *card.values[1:])
    changed = replace(card, version=changes.get("version", card.version), values=values)
    monkeypatch.setattr(Position, "card", changed)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"version": "7"}, "metric position version 1 version 7"),
        (
            {"tolerance": 10.0},
            "tolerance 1e-06 position: unit % of height, better lower, goal 1, tolerance 10",
        ),
        ({"unit": "heights"}, "1e-06 position: unit heights"),
        ({"better": "higher"}, "1e-06 position: unit % of height, better higher"),
        ({"with_self": True}, "tolerance 1e-06, with self pairs"),
    ],
)
def test_another_version_or_protocol_is_not_comparable_and_does_not_pass(
    baseline, bench, monkeypatch, changes, words
):
    changed_card(monkeypatch, **changes)
    status, output = bench("-r", baseline)
    assert status == 1
    assert words in " ".join(output.split())
    assert re.findall("^not comparable|^worse|^better|^moved", output, re.MULTILINE) == ["not comparable"]


def test_other_data_are_not_comparable_and_can_be_accepted(baseline, bench, monkeypatch):
    from retarget_bench.plugins.spec import Spec

    data = bound.dataset(Spec.parse("toy_cases")).built
    monkeypatch.setattr(data, "content", "toy-2")
    monkeypatch.setattr(type(data), "cases", fewer(type(data).cases))
    status, output = bench("-r", baseline)
    assert status == 1
    assert re.search("not comparable +dataset content +toy-1-3 +toy-2", output)
    assert bench("-r", baseline, "--accept", "new data")[0] == 0
    assert bench("-r", baseline)[0] == 0


def fewer(cases):
    return lambda self, task, split: cases(self, task, split)[1:]


# --------------------------------------------------------------------------------- could not measure
def test_cases_that_are_gone_end_with_two_and_cannot_be_accepted(baseline, bench, monkeypatch):
    from retarget_bench.plugins.spec import Spec

    before = content(baseline)
    data = bound.dataset(Spec.parse("toy_cases")).built
    monkeypatch.setattr(type(data), "cases", fewer(type(data).cases))
    status, output = bench("-r", baseline)
    assert status == 2
    assert "toy/small>tall/clip 0" in output
    assert "though the data set claims to hold what it held" in output
    status, output = bench("-r", baseline, "--accept", "never mind")
    assert status == 2
    assert "nothing was accepted" in output
    assert content(baseline) == before


def test_golden_rows_without_one_of_their_splits_end_with_two(baseline, bench):
    (folder,) = (each for each in baseline.rglob("intra") if each.is_dir())
    shutil.rmtree(folder)
    status, output = bench("-r", baseline)
    assert status == 2
    assert re.search(
        r"could not measure +golden rows +intra +the golden rows of this split are gone", output
    )


@pytest.mark.parametrize("value", ["fid", "mpjpe_h.joint"])
def test_values_that_nothing_measured_has_end_with_two(baseline, bench, value):
    """FID is of sets, and errors per joint are left to frozen motions."""
    status, output = bench("-r", baseline, "--methods", "toy_learner", "--columns", value)
    assert status == 2
    assert re.search(rf"could not measure +{re.escape(value)} .*not measured of methods", output)
    assert bench("-r", baseline, "--columns", "mpjpe_h.world")[0] == 0


def test_a_data_set_that_breaks_ends_with_two(baseline, bench, monkeypatch):
    from retarget_bench.plugins.spec import Spec

    def broken(self, info):
        raise OSError("the disk is gone")

    monkeypatch.setattr(type(bound.dataset(Spec.parse("toy_cases")).built), "load", broken)
    status, output = bench("-r", baseline)
    assert status == 2
    assert "cannot be loaded: OSError: the disk is gone" in output


def test_a_gate_that_breaks_ends_with_two_and_says_where(baseline, bench, monkeypatch):
    def broken(before, now, criteria):
        raise ZeroDivisionError("float division by zero")

    monkeypatch.setattr(compare, "compare", broken)
    status, output = bench("-r", baseline)
    assert status == 2
    assert "in broken" in output
    assert "Could not measure" in output


def test_no_case_at_all_ends_with_two(baseline, bench, tmp_path):
    status, output = bench("-r", baseline, "-d", "toy_cases[clips=0]")
    assert status == 2
    assert "has no case to ask methods" in output
    status, output = bench("-r", tmp_path / "new", "--methods", "toy_learner", "-d",
                         "toy_cases[clips=0]", "--accept", "empty")  # fmt: skip
    assert status == 2
    assert not (tmp_path / "new").exists()


def test_without_golden_rows_it_ends_with_two_and_says_how_to_make_some(tmp_path, bench):
    status, output = bench("-r", tmp_path / "nothing")
    assert status == 2
    assert f'bench check -r {tmp_path / "nothing"} --accept "why"' in output


def test_golden_rows_of_nothing_end_with_two(baseline, bench):
    edited(baseline, "facts.csv", lambda old: re.sub(rb"weights/.*\n", b"", old))
    assert bench("-r", baseline)[0] == 2


def test_a_method_that_is_gone_ends_with_two_until_its_rows_are_removed(baseline, bench):
    bench("-r", baseline, "--accept", "another", "--methods", "toy_method")
    assert set(golden.read(baseline).under("weights")) == {"toy_learner", "toy_method"}
    edited(baseline, "facts.csv", lambda old: old.replace(b"weights/toy_method", b"weights/lost_method"))
    status, output = bench("-r", baseline)
    assert status == 2
    assert "no method is called 'lost_method'" in output
    assert "remove its line from" in output
    edited(baseline, "facts.csv", lambda old: old.replace(b"weights/lost_method,\n", b""))
    assert bench("-r", baseline)[0] == 0


def test_a_method_that_answers_nothing_is_no_baseline(tmp_path, bench, monkeypatch):
    status, output = bench("-r", tmp_path / "golden", "--methods", "toy_method[does=raise]", "-d",
                         "toy_cases", "--accept", "x")  # fmt: skip
    assert status == 2
    assert "it answers nothing: RuntimeError: out of ideas" in output
    assert not (tmp_path / "golden").exists()


# --------------------------------------------------------------------------------------------- accept
def test_accepting_rewrites_and_logs_and_says_only_so(baseline, bench, monkeypatch):
    monkeypatch.setenv("TOY_OFF", "0.03")
    status, output = bench("-r", baseline, "--accept", "feet\nare held now")
    assert (status, output.splitlines()[0]) == (0, f"Accepted, and logged in {baseline / 'CHANGES.md'}.")
    assert "worse" not in output
    assert bench("-r", baseline)[0] == 0
    log = (baseline / "CHANGES.md").read_text().splitlines()
    assert len([line for line in log if line.startswith("- ")]) == 2
    assert re.fullmatch(
        r"- \d{4}-\d\d-\d\d: toy_learner \(\d+ worse\).* Because: feet are held now", log[-1]
    )


def test_where_nothing_moved_nothing_is_written(baseline, bench, monkeypatch):
    before = content(baseline)
    monkeypatch.setenv("TOY_OFF", "0.02000000001")
    status, output = bench("-r", baseline, "--accept", "creeping")
    assert (status, "Nothing to accept" in output) == (0, True)
    assert content(baseline) == before


@pytest.mark.parametrize("arguments", [["--accept"], ["--accept", " "]])
def test_accepting_needs_a_reason(baseline, bench, monkeypatch, arguments):
    before = content(baseline)
    monkeypatch.setenv("TOY_OFF", "0.03")
    status, output = bench("-r", baseline, *arguments)
    assert (status, "--accept" in output) == (2, True)
    assert content(baseline) == before


def test_all_files_are_replaced_or_none(baseline, bench, monkeypatch):
    before = content(baseline)
    monkeypatch.setenv("TOY_OFF", "0.03")
    full = OSError(28, "No space left on device")
    monkeypatch.setattr(golden.shutil, "copytree", lambda *paths: (_ for _ in ()).throw(full))
    status, output = bench("-r", baseline, "--accept", "full")
    assert (status, "No space left" in output) == (2, True)
    assert content(baseline) == before


# ---------------------------------------------------------------------------------------------- files
def edited(folder, name, change):
    path = folder / name
    path.write_bytes(change(path.read_bytes()))


@pytest.mark.parametrize(
    ("name", "change", "words"),
    [
        ("facts.csv", lambda old: b"", r"facts\.csv: cannot be read as a table"),
        ("facts.csv", lambda old: old.replace(b"fact,", b"fiction,", 1), r"facts\.csv:1: has columns"),
        ("facts.csv", lambda old: old + old.splitlines(True)[-1], r"facts\.csv: says a fact twice"),
        (
            "rows/toy_cases/retarget/intra/toy_learner.csv",
            lambda old: old.replace(b"1", b"2", 1),
            r"toy_learner\.csv: is not as it was written",
        ),
    ],
)
def test_damaged_files_are_named(baseline, bench, name, change, words):
    edited(baseline, name, change)
    status, output = bench("-r", baseline)
    assert status == 2
    assert re.search(words, output)
    assert "Traceback" not in output


# -------------------------------------------------------------------------------------- the summary
def test_the_summary_is_markdown_and_is_appended(baseline, bench, monkeypatch, tmp_path):
    monkeypatch.setenv("TOY_OFF", "0.03")
    summary = tmp_path / "summary.md"
    summary.write_text("before\n")
    bench("-r", baseline, "--summary", summary)
    lines = summary.read_text().splitlines()
    assert lines[0] == "before"
    assert lines[1] == "### bench check: moved"
    assert lines[-1].endswith('If it is meant: the same command with --accept "why".')
    assert any(line.startswith("| worse | toy_learner | mpjpe_h.world | ") for line in lines)
    rows = [line for line in lines if line.startswith("| ")]
    assert {len(re.findall(r"(?<!\\)\|", row)) for row in rows} == {8}
