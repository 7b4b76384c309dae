"""``bench ablate``: rows trained alike and once, and a table whose numbers are those of the results."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from retarget_bench import cli
from retarget_bench.api import CaseInfo
from retarget_bench.errors import BenchError
from retarget_bench.evaluation import runner
from retarget_bench.plugins import bound
from retarget_bench.plugins.spec import Spec
from retarget_bench.results import store
from retarget_bench.tables.rendering import WITH_INTERVALS
from retarget_bench.training import ablation_runner, train
from retarget_bench.training.ablation import Ablation, AblationColumn, AblationRow
from tests.in_process import carried_out_here
from tests.training.conftest import TOYS, Silent

TOY = Ablation(
    title="Toys: what picking does",
    paper="A paper, Table 1",
    columns=(
        AblationColumn("Error", "m", "mpjpe_h.world"),
        AblationColumn("Within", "m", "mpjpe_h.world", splits=("intra",)),
        AblationColumn("Skin", "m", missing="nobody has one"),
    ),
    rows=(
        AblationRow("plain", {}, {"Error": "0.12", "Within": "0.1", "Skin": "0.3"}),
        AblationRow("slow", {"pause": 0.001}, {"Error": "0.34"}),
    ),
    notes=("a note",),
)
SPEC, DATA = Spec.parse("toy_trainee"), Spec.parse("toy_walks")
HERE = ("toys", "toys", "preset quick")


def info(pair: str, clip: str, split: str) -> CaseInfo:
    source, target = pair.split(">")
    return CaseInfo(f"toys/{pair}/{clip}", "retarget", split, source, target, clip)


@pytest.fixture
def asked(toy_plugins: None, in_process: None, monkeypatch: pytest.MonkeyPatch) -> train.TrainingOptions:
    from retarget_bench.training import clips

    monkeypatch.setattr(clips, "carried_out", carried_out_here)
    monkeypatch.setattr(train.log, "draw", lambda *_: None)  # takes longer than all the rest
    monkeypatch.setattr(type(bound.method(SPEC).built), "ablations", {"table1": TOY}, raising=False)
    return train.TrainingOptions(SPEC, DATA, "quick", "4it", 0, device="cpu")


def test_unknown_tables_are_named_with_those_that_there_are(asked):
    assert ablation_runner.find(SPEC, "table1") is TOY
    with pytest.raises(BenchError, match=r"no ablation 'table7'; there are table1 \(Toys"):
        ablation_runner.find(SPEC, "table7")
    with pytest.raises(BenchError, match="copy_rotations offers no ablation"):
        ablation_runner.find(Spec.parse("copy_rotations"), "table1")
    with pytest.raises(BenchError, match=r"have no part in an ablation; ablate toy_trainee$"):
        ablation_runner.find(Spec.parse("toy_trainee+footfix"), "table1")
    with pytest.raises(BenchError, match="pause is what rows of table1 change; leave it out"):
        ablation_runner.find(Spec.parse("toy_trainee[pause=0.5]"), "table1")


def test_rows_are_trained_once_and_under_one_budget(asked, tmp_path):
    reporter = Silent()
    trained = ablation_runner.train_rows(TOY, asked, tmp_path, reporter)
    assert [str(each.method) for each in trained] == ["toy_trainee", "toy_trainee[pause=0.001]"]
    assert [status.step for status in reporter.moments] == [1, 2, 3, 4] * 2
    again = Silent()
    ablation_runner.train_rows(TOY, asked, tmp_path, again)
    assert not again.moments
    assert sum("trained already" in text for text in again.said) == 2
    with pytest.raises(BenchError, match="began with budget 4it, not 6it"):
        ablation_runner.train_rows(TOY, replace(asked, budget="6it"), tmp_path, Silent())


def test_an_interrupted_row_goes_on(asked, tmp_path):
    # a validation, and with it a checkpoint, is due after step 5
    with pytest.raises(KeyboardInterrupt):
        ablation_runner.train_rows(TOY, replace(asked, budget="8it"), tmp_path, Silent(stop=6))
    reporter = Silent()
    ablation_runner.train_rows(TOY, replace(asked, budget="8it"), tmp_path, reporter)
    assert [status.step for status in reporter.moments] == [6, 7, 8, *range(1, 9)]


def test_the_table_has_the_numbers_of_the_results(asked, tmp_path):
    trained = ablation_runner.train_rows(TOY, asked, tmp_path, Silent())
    wanted = ablation_runner.plan_of(TOY, trained, DATA, tmp_path / "results", 1)
    assert wanted.splits == ("intra", "cross")
    assert len(wanted.methods) == 2
    places = runner.run(wanted, lambda done, total: None)
    found = ablation_runner.numbers_of(TOY, wanted, trained)
    table = ablation_runner.table(TOY, trained, found, "walks", "walks", "preset quick")
    names = [row.label for row in table.groups[0].rows]
    assert names == ["plain (printed)", "plain", "slow (printed)", "slow"]
    ours = table.groups[0].rows[1].cells
    rows = [line.split(",") for place in places for line in place.rows.read_text().splitlines()[1:]]
    height = {name: body.height for name, body in bound.dataset(DATA).built.characters().items()}
    targets = {info.id: info.target for place in places for info in store.read_cases(place.cases, "", "")}
    mine = {
        case: float(value) / 100.0 * height[targets[case]]
        for case, name, _, value in rows
        if name == "mpjpe_h.world"
    }
    assert ours[0].n == len(mine) == 12
    assert ours[0].value == pytest.approx(
        np.mean(list(mine.values())), rel=1e-6
    )  # clips have as many cases
    assert ours[1].n == 8
    assert ours[2].value is None
    text = WITH_INTERVALS["text"]([table])
    assert "0.34" in text
    assert "nobody has one" in text
    assert "12 cases, 3 pairs, 4 clips" in text
    assert "trained and run here, on walks" in " ".join(text.split())


def test_ours_are_means_per_clip_over_common_cases():
    cases = [info(pair, clip, "cross") for pair in ("a>b", "b>a") for clip in ("x", "y")]
    numbers = dict(zip(cases, (1.0, 5.0, 3.0, 100.0), strict=True))
    other = dict.fromkeys(cases[:3], 2.0)
    trained: Any = [ablation_runner.TrainedRow(row, SPEC, SPEC) for row in TOY.rows]
    table = ablation_runner.table(
        TOY, trained, [{"mpjpe_h.world": numbers}, {"mpjpe_h.world": other}], *HERE
    )
    cell = table.groups[0].rows[1].cells[0]
    assert (cell.value, cell.n, cell.clips) == (pytest.approx(((1 + 3) / 2 + 5) / 2), 3, 2)
    assert table.groups[0].rows[1].cells[1].value is None  # no intra pair
    assert cell.interval is None


def test_many_clips_have_an_interval():
    cases = [info("a>b", f"clip {k}", "cross") for k in range(20)]
    numbers = {case: 1.0 + 0.1 * (k % 5) for k, case in enumerate(cases)}
    trained: Any = [ablation_runner.TrainedRow(row, SPEC, SPEC) for row in TOY.rows]
    table = ablation_runner.table(TOY, trained, [{"mpjpe_h.world": numbers}] * 2, *HERE)
    cell = table.groups[0].rows[1].cells[0]
    assert cell.interval.low < cell.value < cell.interval.high


def test_a_value_that_no_metric_has_is_said(asked):
    odd = replace(TOY, columns=(AblationColumn("Odd", "m", "oddness"),))
    with pytest.raises(BenchError, match="no metric computes oddness"):
        ablation_runner.check(odd, DATA)


# ------------------------------------------------------------------------------ another data set to test on
@pytest.fixture
def bench(asked, monkeypatch, tmp_path, capsys):
    """``bench ablate`` in this process, its jobs too: exit status, output, errors."""
    files = [word for name in ("walks", "trainee") for word in ("--plugin", str(TOYS / f"toy_{name}.py"))]
    often = ["--preset", "quick", "--budget", "4it", "--device", "cpu", "-j", "1", "--out", str(tmp_path)]
    files += ["-d", "toy_walks", *often]

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
    assert "trained here on toy_walks and run on toy_walks few:" in text
    assert "budget 4it, seed 0, trained on toy_walks, tested on toy_walks few." in text
    assert "n, toy_walks few: 6 cases, 3 pairs, 2 clips (Error)" in text
    same = bench()[1]
    assert "training toy_trainee" not in same
    assert "n, toy_walks: 12 cases, 3 pairs, 4 clips (Error)" in same
    assert "walks few" not in same
    again = bench(*few)[1]
    assert again[again.index("Toys:") :] == text[text.index("Toys:") :]


def test_a_test_set_that_has_changed_is_run_again(bench, monkeypatch):
    few = "toy_walks[kind=few]"
    data = bound.dataset(Spec.parse(few)).built
    load = data.load

    def elsewhere(info):
        case = load(info)
        here = case.reference
        away = here.root + np.array([3.0, 0.0, 4.0])
        return replace(case, reference=case.target.motion(here.rotations, away, 30.0))

    before = bench("--test", few)[1]
    monkeypatch.setattr(data, "load", elsewhere, raising=False)
    same = bench("--test", few)[1]
    assert same[same.index("Toys:") :] == before[before.index("Toys:") :], "what is known is not run"
    monkeypatch.setattr(data, "content", "another")
    status, after, _ = bench("--test", few)
    assert status == 0
    assert "training toy_trainee" not in after
    ours = re.search(r" plain ([\d.]+) ", after)
    assert float(ours[1]) == pytest.approx(5.0, abs=1.0), "references are five metres away now"


def test_what_cannot_be_tested_is_refused_before_anything_is_trained(bench, monkeypatch, tmp_path):
    between = replace(TOY, columns=(AblationColumn("Between", "m", "mpjpe_h.world", splits=("cross",)),))
    monkeypatch.setattr(type(bound.method(SPEC).built), "ablations", {"table1": between})
    status, _, err = bench("--test", "toy_walks[kind=near]")
    assert (status, err) == (
        2,
        "bench: toy_walks near has no cross case, and rows are measured on such; name another data set by "
        "--test\n",
    )
    assert bench("--test", "toy_wakls")[0] == 2
    status, _, err = bench("-d", "toy_walks+puppets", "--test", "puppets")
    assert (status, "several at once are for bench train alone" in err) == (2, True)
    assert not (tmp_path / "train").exists()


def test_the_tables_of_smrm_are_the_printed_ones():
    tables = bound.method(Spec.parse("smrm")).built.ablations
    assert [row.parameters for row in tables["table3"].rows] == [
        {"context": n} for n in (5, 10, 15, 30, 60)
    ]
    best = min(tables["table3"].rows, key=lambda row: float(row.printed["MPJPE"]))
    assert best.label == "0.5s (15 frames)"
    with_rotations, without = tables["table2"].rows
    assert without.parameters == {"rotation_cycle": 0.0}
    for name in ("MPJPE", "PA-MPJPE", "Acc", "PA-Acc", "MPVD", "PA-MPVD", "MEDL"):
        assert float(with_rotations.printed[name]) < float(without.printed[name])
