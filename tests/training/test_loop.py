"""The loop: what a step does, how it ends, budgets, and the log."""

from __future__ import annotations

import csv
import dataclasses
import json

import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st

from retarget_bench.errors import BenchError, FileError
from retarget_bench.plugins import bound, registry
from retarget_bench.plugins.spec import Spec
from retarget_bench.training import log, loop, run_folder, train, validate, weights
from retarget_bench.training.config import Budget
from retarget_bench.training.gather import gather
from retarget_bench.training.record import Run, error


def rows(folder):
    """The log without the column of seconds."""
    return [{name: text for name, text in row.items() if name != "seconds"} for row in log.read(folder)]


def state(folder):
    return run_folder.tensors(folder, run_folder.read(folder))


def same(tensors, expected):
    assert tensors.keys() == expected.keys()
    for name in tensors:
        assert torch.equal(tensors[name], expected[name]), name


# ------------------------------------------------------------------------------------------ what it does
def bare_loop(steps, config, seed):
    """The toy trained by hand: both losses as formulas, and Adam as in its paper."""
    built = registry.create("methods", "toy_trainee")
    training_data = gather(Spec("toy_walks"), Spec("toy_trainee"), 30.0, 1, lambda *_: None)
    torch.manual_seed(seed)
    module = built.training_module(training_data, config)
    maps = [p.detach().clone() for p in module.modules["map"].parameters()]
    critics = [p.detach().clone() for p in module.modules["critic"].parameters()]
    history, score = torch.zeros(8, 3), torch.zeros(())
    moments = {
        id(group): [(torch.zeros_like(p), torch.zeros_like(p)) for p in group] for group in (maps, critics)
    }
    counts = {id(maps): 0, id(critics): 0}

    def adam(group, grads, rate, betas):
        counts[id(group)] += 1
        t = counts[id(group)]
        for p, g, (m, v) in zip(group, grads, moments[id(group)], strict=True):
            m.mul_(betas[0]).add_((1 - betas[0]) * g)
            v.mul_(betas[1]).add_((1 - betas[1]) * g * g)
            p -= rate * (m / (1 - betas[0] ** t)) / ((v / (1 - betas[1] ** t)).sqrt() + 1e-8)

    for step in range(steps):
        sequence = np.random.SeedSequence([seed, step, 0])
        torch.manual_seed(int(sequence.generate_state(1, np.uint64)[0] >> np.uint64(1)))
        numbers = np.random.default_rng(sequence)
        cut = training_data.draw(numbers, training_data.cast(numbers, config.batch), config.window)
        root = torch.from_numpy(cut.arrays["root"])
        rate = config.rate_at(step, step / steps)
        live = [p.clone().requires_grad_() for p in maps]
        answer = torch.nn.functional.linear(torch.nn.functional.dropout(root, 0.1), *live)
        fooled = torch.nn.functional.linear(answer, *critics) - score
        total = (answer - root).square().mean() + 0.01 * fooled.square().mean()
        grads = torch.autograd.grad(total, live)
        norm = torch.cat([g.flatten() for g in grads]).norm()
        adam(maps, [g * min(1.0, 1.0 / (norm + 1e-6)) for g in grads], rate, (0.9, 0.999))
        if step % 2:
            history = torch.cat([history[1:], answer.detach().mean(dim=(0, 1))[None]])
            live = [p.clone().requires_grad_() for p in critics]
            scores = torch.nn.functional.linear(root, *live)
            score = scores.detach().mean()
            total = (scores - 1).square().mean()
            total = total + torch.nn.functional.linear(history, *live).square().mean()
            adam(critics, torch.autograd.grad(total, live), 0.5 * rate, (0.5, 0.999))
    return maps, critics, history, score


def test_it_does_what_a_loop_written_out_does(toy_run, tmp_path):
    """Phases in turn with their own rates, clipping, left-out steps, memory, schedule, seeds."""
    toy_run(seed=3, budget="24it")
    config = dataclasses.replace(registry.create("methods", "toy_trainee").presets["default"], steps=24)
    maps, critics, history, score = bare_loop(24, config, seed=3)
    stored = state(tmp_path / "run")
    for name, expected in {
        "map.weight": maps[0],
        "map.bias": maps[1],
        "critic.weight": critics[0],
        "critic.bias": critics[1],
        "critic.history": history,
        "critic.score": score,
    }.items():
        torch.testing.assert_close(stored[f"modules/{name}"], expected, rtol=1e-5, atol=1e-6, msg=name)


def test_the_rate_in_the_log_is_the_schedule(toy_run, tmp_path):
    toy_run()
    config = registry.create("methods", "toy_trainee").presets["default"]
    rates = {int(row["step"]): float(row["rate"]) for row in rows(tmp_path / "run")}
    assert sorted(rates) == [10, 15, 20, 30, 40]
    for step, rate in rates.items():
        steps = step - 1
        half = 0.5 * (1 + np.cos(np.pi * steps / 40))
        assert rate == pytest.approx(min(step / 5, 1) * config.rate * (0.01 + 0.99 * half), rel=1e-5)


def test_mixed_precision_trains_and_is_another_computation(toy_run, tmp_path):
    toy_run("full")
    toy_run("mixed", precision="bfloat16")
    full, mixed = (
        [float(row["generator.rebuilt"]) for row in rows(tmp_path / name)] for name in ("full", "mixed")
    )
    assert full != mixed
    np.testing.assert_allclose(mixed, full, rtol=0.1)
    assert all(each.dtype == torch.float32 for each in state(tmp_path / "mixed").values() if each.ndim == 2)


@pytest.mark.parametrize("stop", [3, 10, 17, 30, 39])
def test_interrupted_anywhere_and_resumed_it_is_the_uninterrupted_run(toy_run, tmp_path, monkeypatch, stop):
    toy_run("whole")
    monkeypatch.setattr(loop, "SAVED", 0.0)
    toy_run("cut", stop=stop)
    assert not (tmp_path / "cut" / "step-40.safetensors").exists()
    trained, _ = toy_run("cut", resume=True)
    assert trained.steps == 40
    assert rows(tmp_path / "cut") == rows(tmp_path / "whole")
    same(state(tmp_path / "cut"), state(tmp_path / "whole"))
    assert weights.read(tmp_path / "cut").hash == weights.read(tmp_path / "whole").hash


def test_validation_does_not_disturb_training(toy_run, tmp_path, monkeypatch):
    """Neither modes nor random numbers: here the method draws some and leaves eval mode on."""
    method = type(bound.method(Spec("toy_trainee")).built)
    retarget = method.retarget

    def noisy(self, source, target, *, context):
        assert not torch.is_grad_enabled()
        torch.rand(5)
        return retarget(self, source, target, context=context)

    monkeypatch.setattr(method, "retarget", noisy)
    toy_run("watched")
    toy_run("unwatched", data="toy_walks[kind=unwatched]")
    watched = state(tmp_path / "watched")
    expected = state(tmp_path / "unwatched")
    same({name: watched[name] for name in watched if not name.startswith("best/")}, expected)


def test_modules_are_in_evaluation_mode_while_they_are_validated(toy_run, monkeypatch):
    """And in training mode again in the next step; what was in evaluation mode before stays in it."""
    method, modes = type(bound.method(Spec("toy_trainee")).built), []
    build, retarget = method.training_module, method.retarget

    def training_module(self, training_data, config):
        learner = build(self, training_data, config)
        learner.modules["critic"].eval()
        draw = learner.draw

        def drawing(numbers, count):
            modes.append(("step", *(part.training for part in learner.modules.values())))
            return draw(numbers, count)

        learner.draw, self.seen = drawing, learner.modules
        return learner

    def recorded(self, source, target, *, context):
        modules = bound.method(Spec("toy_trainee")).built.seen
        modes.append(("case", *(part.training for part in modules.values())))
        return retarget(self, source, target, context=context)

    monkeypatch.setattr(method, "training_module", training_module)
    monkeypatch.setattr(method, "retarget", recorded)
    toy_run(budget="20it")
    assert set(modes) == {("step", True, False, True), ("case", False, False, False)}


# ------------------------------------------------------------------------------------------- how it ends
def test_a_loss_that_is_not_finite_stops_it_with_step_term_and_phase(toy_run, tmp_path, monkeypatch):
    monkeypatch.setattr(loop, "SAVED", 0.0)
    with pytest.raises(BenchError, match=r"at step 13 the loss term rebuilt of phase generator") as caught:
        toy_run(method="toy_trainee[does=nan]")
    assert "keeps step 10" in str(caught.value)
    assert run_folder.read(tmp_path / "run").steps == 10
    assert all(each.isfinite().all() for each in state(tmp_path / "run").values())


def test_a_time_budget_is_spent_over_all_resumptions(toy_run, tmp_path, monkeypatch):
    """By a clock that moves a hundredth of a second whenever it is looked at."""
    clock = iter(np.arange(0, 1e4, 0.01))
    monkeypatch.setattr(loop.time, "perf_counter", lambda: float(next(clock)))
    monkeypatch.setattr(loop, "SAVED", 0.0)
    toy_run(budget="6s", stop=60)
    before = run_folder.read(tmp_path / "run")
    assert 0 < before.seconds < 6
    trained, reporter = toy_run(resume=True)
    assert reporter.moments[0].step == before.steps + 1
    assert reporter.moments[0].share == pytest.approx(before.seconds / 6, abs=0.05)
    assert [status.share >= 1 for status in reporter.moments] == [False] * (len(reporter.moments) - 1) + [
        True
    ]
    rates = [float(row["rate"]) for row in rows(tmp_path / "run")]
    assert rates[-1] == pytest.approx(0.0005, rel=0.1)
    again, reporter = toy_run(resume=True)
    assert again.steps == trained.steps
    assert not reporter.moments


def test_a_finished_run_goes_on_under_a_longer_budget_as_one_run(toy_run, tmp_path):
    """To the bit where the schedule does not depend on the budget, as a constant one does not."""
    toy_run("whole", preset="quick", budget="30it")
    toy_run(preset="quick", budget="20it")
    trained, reporter = toy_run(resume=True, budget="30it")
    assert [status.step for status in reporter.moments] == list(range(21, 31))
    assert rows(tmp_path / "run") == rows(tmp_path / "whole")
    same(state(tmp_path / "run"), state(tmp_path / "whole"))
    assert weights.read(tmp_path / "run").hash == weights.read(tmp_path / "whole").hash
    card = weights.read_card(tmp_path / "run")
    assert (card.budget, card.recipe.steps) == ("30it", 30)
    assert card.notes == ["the budget was 20it up to step 20"]
    timed, _ = toy_run(resume=True, budget="1h", stop=33)
    assert timed is None
    assert (trained.budget, run_folder.read(tmp_path / "run").budget) == ("30it", "1h")


@pytest.mark.parametrize(("a_case", "cases", "end"), [(0.1, 4, 18.0), (2.0, 2, 20.0)])
def test_preparing_validating_and_ending_are_in_a_budget_of_time(
    toy_run, tmp_path, monkeypatch, a_case, cases, end
):
    """Gathering takes five seconds, a step a tenth; of cases of two seconds two are left out."""
    now = [0.0]
    monkeypatch.setattr(loop.time, "perf_counter", lambda: now[0])

    def slowly(owner, name, seconds):
        quick = getattr(owner, name)

        def slow(*args):
            now[0] += seconds(*args)
            return quick(*args)

        monkeypatch.setattr(owner, name, slow)

    slowly(train, "gather", lambda *_: 5.0)
    slowly(loop.Loop, "_do", lambda *_: 0.1)
    slowly(validate.Validator, "_rows", lambda _, __, chosen: a_case * len(chosen))
    trained, reporter = toy_run(budget="20s", preset="quick")
    validations = trained.validation
    assert {sum(split["n"] for split in each.scores.values()) for each in validations} == {cases}
    assert [f"validating {cases} of 4 cases" in text for text in reporter.said].count(True) == (cases < 4)
    assert now[0] == pytest.approx(end, abs=0.3)
    assert trained.seconds == pytest.approx(max(now[0], 20.0))
    shares = [status.share for status in reporter.moments]
    assert shares[0] < 0.02
    again, reporter = toy_run(resume=True)
    assert (again.steps, reporter.moments) == (trained.steps, [])


def test_the_weights_kept_are_those_that_validate_best(toy_run, tmp_path, monkeypatch):
    """Even where later ones are worse: here the rate grows until the map is spoilt."""
    method = type(bound.method(Spec("toy_trainee")).built)
    wild = dataclasses.replace(method.presets["default"], schedule="triangular", period=80, rate=4.0)
    monkeypatch.setattr(method, "presets", {"default": dataclasses.replace(wild, validate=5, warm_up=0)})
    trained, _ = toy_run()
    errors = {
        each.step: np.mean([split["mpjpe_h.world"] for split in each.scores.values()])
        for each in trained.validation
    }
    best = min(errors, key=errors.get)
    assert best < 40
    assert trained.best.step == best
    assert error(trained.best.scores) == pytest.approx(errors[best])
    bundle = weights.read(tmp_path / "run")
    stored = state(tmp_path / "run")
    torch.testing.assert_close(bundle.tensors["weight"], stored["best/weight"], rtol=1e-3, atol=1e-4)
    assert not torch.allclose(bundle.tensors["weight"], stored["modules/map.weight"])
    assert json.loads((tmp_path / "run" / "weights.json").read_text())["step"] == best


def test_between_validations_lies_a_pause(toy_run, tmp_path, monkeypatch):
    """Without one, a validation is due every five steps; the last step always has one."""
    every, _ = toy_run("every", preset="quick")
    monkeypatch.setitem(loop.PAUSE, "cpu", 1e9)
    trained, _ = toy_run("paused", preset="quick")
    assert [each.step for each in every.validation] == [5, 10]
    assert [each.step for each in trained.validation] == [10]
    same(state(tmp_path / "every"), state(tmp_path / "paused"))


# ------------------------------------------------------------------------------------ drawn beforehand
def test_batches_drawn_beforehand_by_processes_change_nothing(toy_plugins, tmp_path):
    built = registry.create("methods", "toy_trainee")
    config = dataclasses.replace(built.presets["quick"], validate=0)
    data = gather(Spec("toy_walks"), Spec("toy_trainee"), 30.0, 1, lambda *_: None)
    for workers in (0, 2):
        torch.manual_seed(0)
        module = built.training_module(data, config)
        run = Run(method="", version="", facts={}, dataset="", recipe=config, budget="6it", seed=7)
        folder, cpu = tmp_path / str(workers), torch.device("cpu")
        folder.mkdir()
        callbacks = [lambda *_: None] * 2
        loop.Loop(run, module, cpu, folder, None, *callbacks, workers=workers).run({})
    same(state(tmp_path / "0"), state(tmp_path / "2"))


# -------------------------------------------------------------------------------------- budgets and the log
# --------------------------------------------------------------------------------------------- budgets
@pytest.mark.parametrize(
    ("text", "budget"),
    [
        ("90s", Budget(seconds=90)),
        ("30m", Budget(seconds=1800)),
        ("1.5h", Budget(seconds=5400)),
        (" 2 H ", Budget(seconds=7200)),
        ("1d", Budget(seconds=86400)),
        ("20000it", Budget(steps=20000)),
    ],
)
def test_budgets_are_time_or_steps(text, budget):
    assert Budget.parse(text) == budget


@pytest.mark.parametrize(
    "text", ["", "30", "m", "-5m", "0h", "1.5it", "0it", "ten minutes", "5 weeks", "1e3it"]
)
def test_what_is_no_budget_is_refused_with_the_way_to_write_one(text):
    with pytest.raises(BenchError, match=r"write time as 90s, 30m, 2h or 1d, or steps as 20000it"):
        Budget.parse(text)


@pytest.mark.parametrize(
    "text", ["9" * 400 + "it", "9" * 400 + "s", "9" * 300 + "it", "1" + "0" * 12 + "d"]
)
def test_a_budget_beyond_all_counting_is_one_short_sentence(text):
    with pytest.raises(BenchError, match=r"is more than any training takes") as caught:
        Budget.parse(text)
    assert len(str(caught.value)) < 100


# ------------------------------------------------------------------------------------------------- log
def fill(folder, steps, start=0, late=0):
    """A log with a row every two steps; a second term appears after step ``late``."""
    writer = log.Log(folder, start)
    for step in range(start + 1, steps + 1):
        writer.add({"a.x": step**0.5} | ({"b.y": -float(step)} if step > late else {}))
        if step % 2 == 0:
            writer.row(step, 0.5 * step, 1e-3, {"validation self e": 7.0} if step % 4 == 0 else {})


def table(folder):
    with (folder / log.NAME).open(newline="") as file:
        return list(csv.DictReader(file))


@given(values=st.lists(st.floats(-1e6, 1e6, width=32), min_size=1, max_size=12))
def test_a_row_has_the_mean_of_what_came_since_the_row_before(tmp_path_factory, values):
    folder = tmp_path_factory.mktemp("log")
    writer = log.Log(folder)
    writer.add({"a.x": 1e9})
    writer.row(1, 0.0, 0.1, {})
    for value in values:
        writer.add({"a.x": value})
    writer.row(1 + len(values), 1.0, 0.1, {})
    last = table(folder)[-1]
    assert float(last["a.x"]) == pytest.approx(np.mean(values), rel=1e-8, abs=1e-8)
    assert int(last["step"]) == 1 + len(values)


def test_a_term_that_comes_later_has_a_column_of_its_own_and_empty_cells_before(tmp_path):
    fill(tmp_path, 8, late=4)
    rows = table(tmp_path)
    assert [row["b.y"] for row in rows] == ["", "", "-5.5", "-7.5"]
    assert [row["validation self e"] for row in rows] == ["", "7", "", "7"]


@pytest.mark.parametrize("cut", [2, 4, 6])
def test_a_log_that_is_cut_back_and_continued_is_the_log_of_an_uninterrupted_run(tmp_path, cut):
    for name in ("whole", "cut"):
        (tmp_path / name).mkdir()
    fill(tmp_path / "whole", 12, late=4)
    fill(tmp_path / "cut", 9, late=4)
    with (tmp_path / "cut" / log.NAME).open("a") as file:
        file.write("10,5.0,0.0")  # killed while it wrote
    fill(tmp_path / "cut", 12, start=cut, late=4)
    assert (tmp_path / "cut" / log.NAME).read_bytes() == (tmp_path / "whole" / log.NAME).read_bytes()


def test_a_log_that_cannot_be_written_is_one_sentence(tmp_path):
    writer = log.Log(tmp_path)
    writer.add({"a.x": 1.0})
    writer.row(1, 0.0, 0.1, {})
    (tmp_path / log.NAME).unlink()
    (tmp_path / log.NAME).mkdir()
    with pytest.raises(FileError, match=r"log.csv: cannot be written"):
        writer.row(2, 0.0, 0.1, {})


# ---------------------------------------------------------------------------------------------- curves
def test_the_thinned_curve_keeps_the_mean_of_all_rows(tmp_path):
    fill(tmp_path, 60)
    thinned = log.losses(tmp_path, 5)
    assert [point["step"] for point in thinned] == [12, 24, 36, 48, 60]
    rows = [float(row["a.x"]) for row in table(tmp_path)]
    assert np.mean([point["a.x"] for point in thinned]) == pytest.approx(np.mean(rows), rel=1e-4)


def test_a_picture_is_drawn_with_and_without_validation(tmp_path):
    fill(tmp_path, 12)
    log.draw(tmp_path, "a title")
    tall = _size(tmp_path / log.PICTURE)
    (tmp_path / "bare").mkdir()
    fill(tmp_path / "bare", 3)
    log.draw(tmp_path / "bare", "a title")
    assert tall[0] == _size(tmp_path / "bare" / log.PICTURE)[0]
    assert tall[1] > _size(tmp_path / "bare" / log.PICTURE)[1]


def _size(path):
    """Width and height of a PNG file, from its header."""
    data = path.read_bytes()
    assert data[:8] == b"\x89PNG\r\n\x1a\n"
    return int.from_bytes(data[16:20], "big"), int.from_bytes(data[20:24], "big")
