"""``bench ablate``: rows trained alike and once, and a table whose numbers are those of the results."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from retarget_bench import cli
from retarget_bench.api import Ablation
from retarget_bench.errors import BenchError
from retarget_bench.evaluation import runner
from retarget_bench.plugins import bound
from retarget_bench.plugins.spec import Spec
from retarget_bench.python import ablations
from retarget_bench.results import store
from retarget_bench.tables.published import printed
from retarget_bench.tables.published.printed import Column, Number, PublishedTable
from retarget_bench.tables.rendering import WITH_INTERVALS
from retarget_bench.training import train
from tests.in_process import carried_out_here
from tests.training.conftest import Silent

TOY = Ablation(
    title="Toys: what picking does",
    tables=("toy-table1",),
    rows={"plain": {}, "slow": {"pause": 0.001}},
    notes=("a note",),
)


def column(label: str, cases: str, repeats: str = "", value_id: str = "mpjpe_h.world") -> Column:
    missing = "" if value_id else "nobody has one"
    return Column(label, "m", "", value_id, cases, "ours" if repeats else "", repeats, missing)


PAPER = PublishedTable(
    name="toy-table1",
    title="Toys, Table 1",
    source="A paper, Table 1",
    columns=(
        column("Theirs", "", value_id=""),
        column("Error", "all others", repeats="Theirs"),
        column("Within", "intra"),
        column("On pairs", "a>b c>d"),
    ),
    rows={"plain": {"Theirs": Number("0.12"), "Within": Number("0.1")}, "slow": {"Theirs": Number("0.34")}},
)
SPEC, DATA = Spec.parse("toy_trainee"), Spec.parse("toy_walks")


@pytest.fixture
def options(toy_plugins: None, in_process: None, monkeypatch: pytest.MonkeyPatch) -> train.TrainingOptions:
    from retarget_bench.training import clips

    monkeypatch.setattr(clips, "carried_out", carried_out_here)
    monkeypatch.setattr(train.log, "draw", lambda *_: None)  # takes longer than all the rest
    monkeypatch.setattr(type(bound.method(SPEC).built), "ablations", {"table1": TOY}, raising=False)
    monkeypatch.setattr(printed, "published", lambda name: PAPER)
    return train.TrainingOptions(SPEC, DATA, preset="quick", budget="4it", seed=0, device="cpu")


def test_unknown_tables_are_named_with_those_that_there_are(options):
    assert ablations.find(SPEC, "table1") is TOY
    with pytest.raises(BenchError, match=r"no ablation 'table7'; there are table1 \(Toys"):
        ablations.find(SPEC, "table7")
    with pytest.raises(BenchError, match="copy_rotations offers no ablation"):
        ablations.find(Spec.parse("copy_rotations"), "table1")
    with pytest.raises(BenchError, match=r"have no part in an ablation; ablate toy_trainee$"):
        ablations.find(Spec.parse("toy_trainee+footfix"), "table1")
    with pytest.raises(BenchError, match="pause is what rows of table1 change; leave it out"):
        ablations.find(Spec.parse("toy_trainee[pause=0.5]"), "table1")


def test_rows_are_trained_once_and_under_one_budget(options, tmp_path):
    reporter = Silent()
    trained = ablations.train_rows(TOY, options, tmp_path, reporter)
    assert {label: spec.parameters.get("pause") for label, spec in trained.items()} == {
        "plain": None,
        "slow": 0.001,
    }
    assert [status.step for status in reporter.moments] == [1, 2, 3, 4] * 2
    again = Silent()
    ablations.train_rows(TOY, options, tmp_path, again)
    assert not again.moments
    assert sum("trained already" in text for text in again.said) == 2
    with pytest.raises(BenchError, match="began with budget 4it, not 6it"):
        ablations.train_rows(TOY, replace(options, budget="6it"), tmp_path, Silent())


def test_the_table_has_the_numbers_of_the_results(options, tmp_path):
    trained = ablations.train_rows(TOY, options, tmp_path, Silent())
    plan = ablations.plan_of(TOY, trained, DATA, tmp_path / "results", 1)
    assert plan.splits == ("intra", "cross")
    assert len(plan.methods) == 2
    places = runner.run(plan, lambda done, total: None)
    table = ablations.table(TOY, trained, plan, "walks", "preset quick")
    (group,) = table.groups
    assert [each.id for each in group.columns] == ["Error", "Within"]
    assert [row.label for row in group.rows] == ["plain (printed)", "plain", "slow (printed)", "slow"]
    assert [cell.text for cell in group.rows[0].cells] == ["0.12", "0.1"]
    assert [cell.text for cell in group.rows[2].cells] == ["0.34", "n/a"]
    assert "toy_trainee[pause=0.001," in group.rows[3].about
    own_cells = group.rows[1].cells
    rows = [line.split(",") for place in places for line in place.rows.read_text().splitlines()[1:]]
    height = {name: body.height for name, body in bound.dataset(DATA).built.characters().items()}
    targets = {info.id: info.target for place in places for info in store.read_cases(place.cases, "", "")}
    metres = {
        case: float(value) / 100.0 * height[targets[case]]
        for case, name, _, value in rows
        if name == "mpjpe_h.world"
    }
    assert own_cells[0].n == len(metres) == 12
    # as many cases per clip
    assert own_cells[0].value == pytest.approx(np.mean(list(metres.values())), rel=1e-6)
    assert own_cells[1].n == 8
    text = " ".join(WITH_INTERVALS["text"]([table]).split())
    assert "n, toy_walks: people: Error: 12 cases, pairs 3, clips 4" in text
    assert "Every row of ours: preset quick, trained on walks, tested on toy_walks." in text


def test_a_value_that_no_metric_has_is_said(options, monkeypatch):
    odd = replace(PAPER, columns=(column("Odd", "intra", value_id="oddness"),))
    monkeypatch.setattr(printed, "published", lambda name: odd)
    with pytest.raises(BenchError, match="no metric computes oddness"):
        ablations.check(TOY, DATA)


# ------------------------------------------------------------------------------ another data set to test on
@pytest.fixture
def bench(options, monkeypatch, tmp_path, capsys):
    """``bench ablate`` in this process, its jobs too: exit status, output, errors."""
    often = ["--preset", "quick", "--budget", "4it", "-j", "1", "--out", str(tmp_path)]
    files = ["-d", "toy_walks", *often]

    def call(*arguments: str) -> tuple[int, str, str]:
        with pytest.raises(SystemExit) as ended:
            cli.main(["ablate", "toy_trainee", "table1", *files, *arguments])
        out, err = capsys.readouterr()
        return ended.value.code, " ".join(out.split()), err

    return call


def test_rows_are_tested_on_what_is_asked_for_and_not_trained_again(bench):
    few = ("--test", "toy_walks[kind=few]")
    status, text, _ = bench(*few)
    assert status == 0
    assert text.count("training toy_trainee") == 2
    assert "budget 4it, seed 0, trained on toy_walks, tested on toy_walks few." in text
    assert "n, toy_walks few: people: Error: 6 cases, pairs 3, clips 2" in text
    same = bench()[1]
    assert "training toy_trainee" not in same
    assert "n, toy_walks: people: Error: 12 cases, pairs 3, clips 4" in same
    assert "walks few" not in same
    again = bench(*few)[1]
    assert again[again.index("Toys:") :] == text[text.index("Toys:") :]


def test_what_cannot_be_tested_is_refused_before_anything_is_trained(bench, monkeypatch, tmp_path):
    between = replace(PAPER, columns=(column("Between", "cross"),))
    monkeypatch.setattr(printed, "published", lambda name: between)
    status, _, err = bench("--test", "toy_walks[kind=near]")
    assert (status, err) == (
        2,
        "bench: toy_walks near has no case of cross, and rows are measured on such; name another data set "
        "by --test\n",
    )
    assert bench("--test", "toy_wakls")[0] == 2
    status, _, err = bench("-d", "toy_walks+puppets", "--test", "puppets")
    assert (status, "several at once are for bench train alone" in err) == (2, True)
    assert not (tmp_path / "train").exists()


def test_the_tables_of_smrm_are_the_printed_ones():
    tables = {name: ablations.find(Spec.parse("smrm"), name) for name in ("table2", "table3")}
    assert list(tables["table3"].rows.values()) == [{"context": n} for n in (5, 10, 15, 30, 60)]
    assert tables["table2"].rows == {"With L_rot": {}, "Without L_rot": {"rotation_cycle": 0.0}}
    for name, ablation in tables.items():
        expected = printed.published(f"correspondence-free-{name}")
        rows = ablations.published(ablation)
        assert {
            row: [number.text for number in numbers.values()] for row, numbers in rows.rows.items()
        } == {row: [number.text for number in numbers.values()] for row, numbers in expected.rows.items()}
        assert [column.value_id for column in rows.columns] == [
            "mpjpe_h.world", "pa_mpjpe.rigid", "acc", "pa_acc.rigid", "mpvd_h", "pa_mpvd.rigid", "medl_h"
        ]  # fmt: skip
