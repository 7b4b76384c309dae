"""Metrics and data sets that misbehave: each costs its own values, is named, and nothing else changes."""

from __future__ import annotations

import re
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from small_plans import asked, carry_out

from retarget_bench.analysis import summary
from retarget_bench.api.completing import original
from retarget_bench.errors import BenchError
from retarget_bench.evaluation import attempt, cases, runner, score, set_metrics
from retarget_bench.evaluation.executors import local
from retarget_bench.plugins import bound, registry
from retarget_bench.plugins.spec import Spec
from retarget_bench.results import store
from retarget_bench.tables import builder, rendering
from tests.in_process import run_here

pytestmark = pytest.mark.usefixtures("in_process")

HERE = Path(__file__).parent
METHODS = ("copy_rotations", "toy_method")
VICTIM = "toy/small>tall/clip 0"
ORDERLY = ("position", "smoothness")
WRONG = {
    "write": r"read-only \(sway.py:\d+\); what metrics are given cannot be written to, so take a copy",
    "setflags": r"cannot set WRITEABLE flag to True of this array \(sway.py:\d+\); what metrics are given",
    "fail": r"ValueError: no \\ud800 sway \(sway.py:\d+\)",
    "quit": "SystemExit: 3",
    "hang": "no answer within 0.2 s",
    "nan": "gave nan for sway; what is undefined for a case must be left out",
    "inf": "gave -inf for sway; what is undefined",
    "text": "gave an object of type str instead of a number for sway",
    "large": r"gave a number beyond 1e\+100 for sway",
    "digits": r"gave a number beyond 1e\+100 for sway",
    "nothing": "gave an object of type NoneType instead of a number for sway",
    "list": "gave an object of type list instead of numbers by the ids of values",
    "curve": "gave an object of type dict instead of a number for sway",
    "unnamed": "gave an index for sway_by that cannot be written, ''",
    "undeclared": "gave 'sway.secret', a value that its card does not declare",
}
LONG = 9.0
ENDING = {"exit": "exit code 5", "segfault": "signal SIGSEGV"}


@pytest.fixture(autouse=True)
def _plugins(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(registry, "_FILES", dict(registry._FILES))  # no other test is to know these
    for file in (*sorted((HERE / "toys").glob("*.py")), *sorted((HERE / "bad_toys").glob("*.py"))):
        registry.add_file(file)
    monkeypatch.setattr(score, "BASE", 0.2)
    monkeypatch.setattr(score, "PER_FRAME", 0.0)
    monkeypatch.setattr(attempt, "_late_times", Counter())


@pytest.fixture(scope="module")
def without(tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    """The rows and arrays of a run without any metric that misbehaves."""
    for name in ("toy_cases", "toy_method"):
        registry.add_file(HERE / "toys" / f"{name}.py")
    root = tmp_path_factory.mktemp("without")
    run_here(asked(root, *METHODS, metrics=ORDERLY))
    return _numbers(root)


def _numbers(root: Path) -> dict[str, bytes]:
    """File of rows or arrays -> what it holds but for values of the metric that misbehaves."""
    contents = {}
    for path in sorted([*root.rglob("intra/*.csv"), *root.rglob("intra/*.npz")]):
        lines = path.read_bytes().split(b"\n") if path.suffix == ".csv" else [path.read_bytes()]
        contents[path.name] = b"\n".join(line for line in lines if b",sway" not in line)
    return contents


def _check(results: list[store.Results], without: dict[str, bytes], words: str) -> None:
    """All numbers are there but those of the metric for one answer, and that is told of the metric."""
    assert _numbers(results[0].paths.root) == without
    entries = {(each.header.method.label, entry.case): entry for each in results for entry in each.entries}
    assert len(entries) == 12
    assert {entry.status for entry in entries.values()} == {"ok"}
    bad = entries.pop(("toy_method", VICTIM))
    assert list(bad.faults) == ["sway"]
    assert re.search(words, bad.faults["sway"])
    assert not bad.values.keys() & {"sway", "sway_by"}
    assert bad.values.keys() | {"sway", "sway_by"} == entries["copy_rotations", VICTIM].values.keys()
    assert all(
        {"sway", "sway_by"} <= entry.values.keys() and not entry.faults for entry in entries.values()
    )
    assert [fault.cases for each in results for fault in each.header.faults] == [(VICTIM,)]


@pytest.mark.parametrize("does", WRONG)
def test_what_a_metric_does_wrong_costs_its_own_values_of_that_answer(tmp_path, without, does):
    metrics = (f"sway[does={does}]", *ORDERLY)  # asked before those whose numbers are compared
    _check(carry_out(tmp_path, *METHODS, metrics=metrics), without, WRONG[does])


@pytest.mark.processes
@pytest.mark.parametrize("does", [pytest.param("exit", marks=pytest.mark.slow), "segfault"])
def test_a_metric_that_ends_its_process_likewise(tmp_path, without, does):
    metrics = (ORDERLY[0], f"sway[does={does}]", ORDERLY[1])
    results = carry_out(tmp_path, *METHODS, metrics=metrics, jobs=2)
    _check(results, without, rf"ended the process that scores, twice \({ENDING[does]}\)")


@pytest.mark.slow
@pytest.mark.processes
def test_a_metric_that_hangs_outside_of_python_likewise(tmp_path, without, monkeypatch):
    monkeypatch.setattr(local, "SILENCE", 15.0)
    results = carry_out(tmp_path, *METHODS, metrics=(*ORDERLY, "sway[does=hang_outside]"))
    _check(results, without, r"ended the process that scores, twice \(no sign of life for 15 s\)")


def test_a_call_that_goes_on_after_its_limit_is_no_sign_of_life(monkeypatch):
    """One that cannot be interrupted is ended from outside: see ``SILENCE``."""
    monkeypatch.setattr(attempt, "GRACE", 0.0)
    overdue = []

    def linger() -> None:
        try:
            time.sleep(LONG)
        except BaseException:  # it goes on
            overdue.append(attempt.overdue())

    attempt.attempt(linger, 0.05, "test")
    assert overdue == [True]
    assert not attempt.overdue()


def test_what_is_late_three_times_in_a_row_is_asked_no_more(tmp_path, monkeypatch):
    times = []

    def hang(*_: object) -> None:
        times.append(time.monotonic())
        time.sleep(LONG)

    monkeypatch.setattr(type(original(bound.metrics(("sway",)).of_cases[0])), "compute", hang)
    (result,) = carry_out(tmp_path, "toy_method", metrics=("sway", "position"))
    assert len(times) == 3
    faults = [entry.faults["sway"] for entry in result.entries]
    assert faults.count("no answer within 0.2 s") == 3
    assert faults.count("no answer in time, 3 times in a row; it was asked no more") == 3


# ---------------------------------------------------------------------------------------- metrics of sets
TWICE = r"ended the process that scores, twice \(exit code 5\)"


@pytest.mark.parametrize(
    ("stage", "does", "words"),
    [
        ("features", "fail", "RuntimeError: odd sets"),
        ("features", "nan", "gave features that are not finite"),
        ("features", "ragged", r"gave features \(3, 3\), \(1, 3\) and \(3,\)"),
        ("features", "text", "AttributeError: 'str' object has no attribute 'generated'"),
        ("features", "hang", "no answer within 0.2 s"),
        ("features", "wider", "gave features of 3 and 6 numbers"),
        ("value", "fail", "RuntimeError: odd sets"),
        ("value", "text", "TypeError"),
        ("value", "huge", r"gave a number beyond 1e\+100 for sway_gap"),
        ("value", "hang", "no answer within"),
        pytest.param("features", "exit", TWICE, marks=[pytest.mark.processes, pytest.mark.slow]),
        pytest.param("value", "exit", TWICE, marks=pytest.mark.processes),
    ],
)
def test_what_a_metric_of_sets_does_wrong_costs_its_values_alone(tmp_path, without, stage, does, words):
    results = carry_out(tmp_path, "toy_method", metrics=(*ORDERLY, f"sway_sets[{stage}={does}]"))
    numbers = {name: held for name, held in _numbers(tmp_path).items() if name in without}
    assert numbers == {name: held for name, held in without.items() if name in numbers}
    assert {"toy_method.csv", "toy_method.npz"} <= numbers.keys()
    (value,) = set_metrics.read(results[0].paths)
    assert value.value is None
    assert re.match(f"metric sway_sets failed: .*{words}", value.reason)
    at_fault = [entry.case for entry in results[0].entries if entry.faults]
    assert at_fault == ([VICTIM] if stage == "features" and does != "wider" else [])


# ------------------------------------------------------------------------------------------------- tables
def test_tables_tell_which_metric_failed_and_why(tmp_path):
    """A column, its cells, a note; another column ranks as ever."""
    root = tmp_path / "all"
    sway = type(original(bound.metrics(("sway",)).of_cases[0]))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sway, "compute", lambda self, comparison: [])
        places = runner.run(asked(root, *METHODS, metrics=("position", "sway")), lambda done, total: None)
    (table,) = builder.tables(summary.split_summaries(places), ["mpjpe_h.world", "sway"])
    text = rendering.text([table])
    failed = "metric sway failed: gave an object of type list instead of numbers by the ids of values"
    assert f"intra: not shown: sway ({failed})" in " ".join(text.split())
    assert "intra: metric sway failed on 12 answers of 2 methods (first toy/small>tall/clip 0)" in " ".join(
        text.split()
    )
    assert "no usable answer" not in text
    assert [row.label for row in table.groups[0].ranked] == ["toy_method", "copy_rotations"]


def test_a_cell_without_a_number_names_the_metric_that_failed(tmp_path):
    places = runner.run(asked(tmp_path, *METHODS, metrics=("position", "sway")), lambda done, total: None)
    (bad,) = (each for each in places if "toy" in each.method)
    sway = type(original(bound.metrics(("sway",)).of_cases[0]))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sway, "compute", lambda self, comparison: {"sway": "much"})
        plan = asked(tmp_path, "toy_method", metrics=("position", "sway"), overwrite="always")
        runner.run(plan, lambda done, total: None)
    (table,) = builder.tables(summary.split_summaries(places), ["mpjpe_h.world", "sway"])
    (row,) = (row for row in table.groups[0].rows if row.label == "toy_method")
    assert row.cells[0].place == 0
    assert row.cells[1].text == "n/a"
    assert row.cells[1].reason.startswith(
        "metric sway failed: gave an object of type str instead of a number"
    )
    assert store.read_header(bad.header).counts.ok == 6
    second_plan = asked(tmp_path, "toy_method", metrics=("position", "sway"), overwrite="failed")
    runner.run(second_plan, lambda done, total: None)
    assert store.read_header(bad.header).faults == ()


# ---------------------------------------------------------------------------------------------- data sets
def _raise(*_: object) -> Any:
    raise RuntimeError("no list")


def _toys(monkeypatch: pytest.MonkeyPatch, name: str, change: Callable[..., Any]) -> None:
    """Have the toy data set answer otherwise."""
    toys = type(bound.dataset("toy_cases").built)
    before = getattr(toys, name)
    monkeypatch.setattr(toys, name, lambda *arguments: change(before(*arguments)))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (_raise, r"RuntimeError: no list \(test_bad_plugins.py:\d+\)"),
        (lambda infos: (info for info in infos), "it gave an object of type generator instead of a list"),
        (lambda infos: None, "it gave an object of type NoneType instead of a list"),
        (lambda infos: "cases", "it gave an object of type str instead of a list"),
        (lambda infos: [1, 2], "it lists an object of type int that has no id"),
        (lambda infos: [*infos, infos[0]], "it lists 'toy/small>tall/clip 0' twice"),
        (lambda infos: [replace(infos[0], clip=None)], "it lists a case whose names are no texts without"),
        (lambda infos: [replace(infos[0], frames="many")], "it lists .* with 'many' frames"),
        (lambda infos: time.sleep(LONG), "no answer within 0.2 s"),
    ],
)  # fmt: skip
def test_a_data_set_that_lists_no_cases_is_named(tmp_path, monkeypatch, change, words):
    monkeypatch.setattr(cases, "LISTING", 0.2)
    _toys(monkeypatch, "cases", change)
    with pytest.raises(
        BenchError, match=rf"^data set toy_cases: cases\('retarget', 'intra'\) failed: {words}"
    ):
        carry_out(tmp_path, "toy_method")
    assert not list(tmp_path.rglob("*.json"))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (_raise, r"RuntimeError: no list"),
        (lambda case: None, "it gave an object of type NoneType that has no info"),
        (lambda case: replace(case, target="tall"), "its target is an object of type str"),
        (lambda case: replace(case, reference=0), "its reference is an object of type int"),
        (lambda case: replace(case, reference=replace(case.reference, root=case.reference.root * np.nan)),
         "its reference has numbers that are not finite"),
        (lambda case: time.sleep(LONG), "no answer within 0.2 s"),
    ],
)  # fmt: skip
def test_a_case_that_cannot_be_loaded_costs_that_case(tmp_path, monkeypatch, change, words):
    monkeypatch.setattr(cases, "LOADING", 0.2)
    monkeypatch.setattr(cases, "PER_FRAME", 0.0)
    _toys(monkeypatch, "load", lambda case: change(case) if case.info.id == VICTIM else case)
    for results in carry_out(tmp_path, *METHODS):
        (lost,) = (entry for entry in results.entries if entry.status != "ok")
        assert (lost.case, lost.status) == (VICTIM, "failed")
        assert lost.message.startswith(f"data set toy_cases: load({VICTIM!r}) failed: {words}")


@pytest.mark.processes
def test_a_data_set_that_ends_its_process_costs_that_case(tmp_path):
    source = (HERE / "toys" / "toy_cases.py").read_text().replace("toy_cases", "ending_cases")
    loads = f"    def load(self, info):\n        info.id == {VICTIM!r} and __import__('os')._exit(4)\n"
    (tmp_path / "ending_cases.py").write_text(source.replace("    def load(self, info):\n", loads))
    registry.add_file(tmp_path / "ending_cases.py")
    data = (Spec.parse("ending_cases"),)
    for results in carry_out(tmp_path / "runs", *METHODS, datasets=data):
        (lost,) = (entry for entry in results.entries if entry.status != "ok")
        why = "the data set ended the process that loads this case, twice (exit code 4)"
        assert (lost.case, lost.message) == (VICTIM, why)


def test_a_case_that_does_not_fit_together_costs_that_case(tmp_path, monkeypatch):
    def shorter(case: Any) -> Any:
        short = case.info.id == VICTIM
        return replace(case, reference=case.reference.at(slice(5))) if short else case

    _toys(monkeypatch, "load", shorter)
    for results in carry_out(tmp_path, *METHODS):
        (lost,) = (entry for entry in results.entries if entry.status != "ok")
        assert lost.message == f"case {VICTIM}: the prediction has 12 frames, the reference 5"
