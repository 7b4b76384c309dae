"""``bench train`` as a whole: what it refuses, what it begins and goes on with, and what it leaves."""

import json
from dataclasses import asdict, replace
from types import SimpleNamespace

import pytest
import torch

from retarget_bench.errors import BenchError
from retarget_bench.plugins import bound, registry
from retarget_bench.plugins.spec import Spec
from retarget_bench.training import log, parallel, run_folder, weights
from retarget_bench.training.config import Augmentation
from retarget_bench.training.record import PARTS


def card(folder):
    return json.loads((folder / "weights.json").read_text())


def state(folder):
    return run_folder.tensors(folder, run_folder.read(folder))


# ------------------------------------------------------------------------------------------- what it leaves
def test_the_card_says_how_the_weights_came_about(toy_run, tmp_path):
    trained, _ = toy_run(data="toy_walks[root=/secret/place]", seed=4, budget="25it")
    facts = card(tmp_path / "run")
    assert (
        facts["command"]
        == "bench train toy_trainee.py -d toy_walks.py --preset default --budget 25it --seed 4"
    )
    assert "secret" not in json.dumps(facts)
    assert (facts["method"], facts["version"], facts["facts"]) == ("toy_trainee", "1", {"kind": "linear"})
    assert facts["data"] == {
        "spec": "toy_walks",
        "label": "toy_walks",
        "parts": PARTS,
        "content": "one",
        "motion": trained.data.motion,
        "clips": 6,
        "hours": pytest.approx(6 * 40 / 30 / 3600, abs=1e-3),
    }
    assert (facts["steps"], facts["seed"], facts["init"], facts["processes"]) == (25, 4, None, 1)
    assert (facts["recipe"]["steps"], facts["recipe"]["batch"], facts["preset"]) == (25, 8, "default")
    assert facts["training_manifest"] == {"characters": ["small", "tall"], "structures": ["toy"]}
    assert [each["step"] for each in facts["validation"]] == [15, 25]
    assert facts["step"] in (15, 25)
    assert facts["curve"][-1]["step"] == 25
    assert set(facts["curve"][-1]) == {"step", "generator.rebuilt", "generator.fooled", "critic.told"}
    assert facts["torch"] == torch.__version__
    assert "threads" in facts["hardware"]
    assert facts["notes"] == []
    assert facts["hash"] == weights.read(tmp_path / "run").hash
    assert trained.steps == 25


def test_the_manifest_is_the_data_sets_without_what_the_method_left_out(toy_run, tmp_path, monkeypatch):
    data, method = (
        type(bound.dataset(Spec("toy_walks")).built),
        type(bound.method(Spec("toy_trainee")).built),
    )
    two, training = {"characters": ["small", "tall", "held"], "structures": ["toy", "dog"]}, data.training
    monkeypatch.setattr(
        data, "training", lambda self: {**training(self), "dog": {"rex": training(self)["toy"]["tall"]}}
    )
    one = bound.dataset(Spec("toy_walks")).built
    monkeypatch.setattr(one, "training_manifest", lambda: {**two, "clips": ["walk"]}, raising=False)
    monkeypatch.setattr(method, "unfit", lambda self, body: "on four legs" if body.name == "rex" else "")
    monkeypatch.setattr(data, "characters", _with_rex(data.characters))
    two["characters"].append("rex")
    toy_run()
    assert card(tmp_path / "run")["training_manifest"] == {
        "characters": ["small", "tall", "held"],
        "structures": ["toy"],
        "clips": ["walk"],
    }


def _with_rex(characters):
    def more(self):
        tall = characters(self)["tall"]
        return {**characters(self), "rex": replace(tall, name="rex")}

    return more


def test_its_folder_is_a_value_of_the_parameter_weights(toy_run, tmp_path):
    toy_run()
    method = registry.create("methods", f"toy_trainee[weights={tmp_path / 'run'}]")
    stored = state(tmp_path / "run")["best/weight"]
    torch.testing.assert_close(method.tensors["weight"], stored, rtol=1e-3, atol=1e-4)


def test_validation_is_of_held_out_cases_that_the_method_supports(toy_run):
    trained, _ = toy_run(preset="quick")
    for each in trained.validation:
        assert {split: values["n"] for split, values in each.scores.items()} == {"intra": 2, "cross": 2}


def test_cases_without_right_answers_do_not_keep_weights_from_being_chosen(toy_run):
    trained, _ = toy_run(data="toy_walks[kind=apart]")
    assert trained.best is not None
    assert all(set(each.scores) == {"intra"} for each in trained.validation)


def test_without_validation_the_last_weights_are_kept_and_it_is_said(toy_run, tmp_path):
    trained, reporter = toy_run(data="toy_walks[kind=unwatched]")
    assert trained.best is None
    assert reporter.said == [
        "the data set has no validation part: no weights were chosen by validation, these are the last "
        "ones",
        "training on 0 minutes of motion: 6 clips of 2 characters",
    ]
    assert "these are the last ones" in card(tmp_path / "run")["notes"][0]
    last = state(tmp_path / "run")["modules/map.bias"]
    assert torch.equal(weights.read(tmp_path / "run").tensors["bias"], last)


def test_a_case_that_gets_no_answer_is_told_of_and_chooses_nothing(toy_run, monkeypatch):
    method = type(bound.method(Spec("toy_trainee")).built)
    retarget = method.retarget

    def lame(self, source, target, *, context):
        assert target.name != "tall", "cannot walk tall"
        return retarget(self, source, target, context=context)

    monkeypatch.setattr(method, "retarget", lame)
    trained, reporter = toy_run()
    assert trained.best is None
    problems = {status.problem for status in reporter.moments if status.validation}
    assert len(problems) == 1
    assert "cannot walk tall" in problems.pop()


# ---------------------------------------------------------------------------------------- what it refuses
@pytest.mark.parametrize(
    ("options", "says"),
    [
        ({"method": None}, "holds no run to go on with; bench train METHOD begins one"),
        ({"data": None}, "say what to train on: -d DATASET"),
        ({"method": "copy_rotations"}, "copy_rotations has nothing to train"),
        ({"preset": "papre"}, "toy_trainee has no preset 'papre'; there are gpu, quick, default, wild"),
        ({"budget": "soon"}, "'soon' is no budget; write time as"),
        ({"data": "toy_walks[kind=empty]"}, "toy_walks has no training motion"),
        ({"method": "toy_trainee[does=pick]"}, "toy_trainee needs motion of two characters"),
        ({"method": "toy_trainee[dose=nan]"}, "did you mean does"),
        ({"init": "/nowhere"}, "there are no weights of this name"),
    ],
)
def test_what_cannot_be_trained_is_one_sentence_and_leaves_nothing(toy_run, tmp_path, options, says):
    with pytest.raises(BenchError) as caught:
        toy_run(**options)
    assert says in str(caught.value)
    assert not (tmp_path / "run").exists()


def test_a_structure_that_the_method_cannot_take_is_said_with_the_reason(toy_run, monkeypatch):
    method = type(bound.method(Spec("toy_trainee")).built)
    monkeypatch.setattr(method, "unfit", lambda self, body: f"{body.name} has no tail")
    with pytest.raises(
        BenchError, match=r"no motion that toy_trainee can be trained on: small has no tail"
    ):
        toy_run()


def test_a_character_that_is_left_out_is_named_and_is_not_in_the_manifest(toy_run, tmp_path, monkeypatch):
    method = type(bound.method(Spec("toy_trainee")).built)
    monkeypatch.setattr(method, "unfit", lambda self, body: "too tall" if body.name == "tall" else "")
    monkeypatch.setattr(method, "training_module", _any_number(method.training_module))
    _, reporter = toy_run()
    assert reporter.said == [
        "not trained on tall: too tall",
        "training on 0 minutes of motion: 3 clips of 1 character",
    ]
    assert card(tmp_path / "run")["training_manifest"]["characters"] == ["small"]
    assert card(tmp_path / "run")["notes"] == reporter.said[:1]


def test_clips_that_are_shorter_than_a_window_are_counted(toy_run, monkeypatch):
    every = bound.dataset(Spec("toy_walks")).built.training()["toy"]
    kind, window = type(every["tall"]), bound.method(Spec("toy_trainee")).built.presets["quick"].window
    usual = kind.__getitem__
    lengths = iter([window, window - 1, 3, window, 2 * window, window - 1])
    monkeypatch.setattr(kind, "__getitem__", lambda self, n: usual(self, n).at(slice(next(lengths))))
    _, reporter = toy_run(preset="quick")
    assert reporter.said == [
        "training on 0 minutes of motion: 6 clips of 2 characters, 3 of them shorter than a window "
        f"({window} frames) and padded"
    ]


def _any_number(build):
    """The toy's learner without its demand for two characters."""

    def training_module(self, training_data, config):
        learner = build(self, SimpleNamespace(clips={"one": 1, "two": 2}), config)
        learner.training_data = training_data
        return learner

    return training_module


def test_a_folder_that_holds_a_run_is_not_written_over(toy_run, tmp_path):
    toy_run()
    before = {path.name: path.read_bytes() for path in (tmp_path / "run").iterdir()}
    with pytest.raises(BenchError, match=r"already holds a run \(bench train toy_trainee.py .*--resume"):
        toy_run()
    assert {path.name: path.read_bytes() for path in (tmp_path / "run").iterdir()} == before


def test_a_batch_that_processes_cannot_share_evenly_is_refused(toy_run, monkeypatch):
    monkeypatch.setattr(parallel, "world", lambda: 2)
    monkeypatch.setattr(parallel, "join", lambda where: None)
    with pytest.raises(BenchError, match="a batch of 3 cannot be shared evenly by 2 processes"):
        toy_run(preset="wild")


def test_a_device_that_is_not_there_is_refused(monkeypatch):
    monkeypatch.setattr(torch.cuda, "is_available", lambda: False)
    assert parallel.device("auto") == torch.device("cpu")
    with pytest.raises(BenchError, match="no CUDA device here; train with --device cpu"):
        parallel.device("cuda")


# ---------------------------------------------------------------------------------------- going on
@pytest.mark.parametrize(
    ("options", "says"),
    [
        ({"method": "rest_pose"}, "began with method toy_trainee, not rest_pose"),
        ({"data": "toy_walks[content=two]"}, "began with dataset toy_walks, not toy_walks[content=two]"),
        ({"budget": "12it"}, "holds a run of 15 steps in 0 s, and a budget of 12it leaves nothing"),
        ({"budget": ""}, "began with budget 30it"),
        ({"preset": "quick"}, "began with preset default, not quick"),
        ({"seed": 7}, "began with seed 0, not 7"),
        ({"batch": 3}, "began with batch 8, not 3"),
        ({"precision": "bfloat16"}, "began with precision float32, not bfloat16"),
        ({"augment": True}, "began with augment False, not True"),
    ],
)
def test_options_that_contradict_the_run_are_refused(toy_run, options, says):
    toy_run(budget="30it", stop=20)
    with pytest.raises(BenchError) as caught:
        toy_run(resume=True, **options)
    assert says in str(caught.value)


@pytest.mark.parametrize(
    ("options", "words", "recipe"),
    [
        ({"precision": "bfloat16"}, "--precision bfloat16", {"precision": "bfloat16"}),
        ({"batch": 3}, "--batch 3", {"batch": 3}),
        ({"augment": True}, "--augment", {"augmentation": asdict(Augmentation())}),
    ],
)
def test_options_are_recorded_told_on_the_card_and_kept(toy_run, tmp_path, options, words, recipe):
    assert toy_run(stop=17, **options)[0] is None
    assert run_folder.read(tmp_path / "run").command.endswith(f"{words} --seed 0")
    toy_run(resume=True, **options)
    finished = card(tmp_path / "run")
    assert words in finished["command"]
    assert recipe.items() <= finished["recipe"].items()
    toy_run("whole", **options)
    toy_run("plain")
    resumed, uninterrupted, plain = (
        weights.read(tmp_path / name).hash for name in ("run", "whole", "plain")
    )
    assert resumed == uninterrupted != plain


def test_data_that_lie_elsewhere_now_are_the_same_data(toy_run):
    toy_run(data="toy_walks[root=/old]", preset="quick", stop=6)
    trained, _ = toy_run(data="toy_walks[root=/new]", resume=True)
    assert (trained.steps, trained.dataset) == (10, "toy_walks[root=/new]")


def test_only_the_torchrun_that_began_a_run_goes_on_with_it_by_itself(toy_run, monkeypatch):
    monkeypatch.setenv("TORCHELASTIC_RUN_ID", "mine")
    toy_run(preset="quick", stop=6)
    monkeypatch.setenv("TORCHELASTIC_RESTART_COUNT", "1")
    trained, reporter = toy_run(preset="quick")
    assert (trained.steps, reporter.moments[0].step) == (10, 6)
    monkeypatch.setenv("TORCHELASTIC_RUN_ID", "another")
    with pytest.raises(BenchError, match="already holds a run"):
        toy_run(preset="quick")


def test_another_number_of_processes_is_said(toy_run, tmp_path):
    toy_run(preset="quick", stop=6)
    recorded = run_folder.read(tmp_path / "run")
    run_folder.write(tmp_path / "run", replace(recorded, processes=4))
    _, reporter = toy_run(resume=True)
    assert reporter.said == ["this run had 4 processes before; its batches are now others"]


def test_a_run_goes_on_by_its_folder_alone(toy_run):
    toy_run(budget="30it", preset="quick", seed=2, stop=20)
    trained, _ = toy_run(method=None, data=None, resume=True)
    assert (trained.steps, trained.preset, trained.seed) == (30, "quick", 2)


def test_resume_begins_a_run_where_there_is_none_yet(toy_run):
    trained, _ = toy_run(preset="quick", resume=True)
    assert trained.steps == 10


@pytest.mark.parametrize(
    ("spoil", "says"),
    [
        (lambda: setattr(bound.dataset(Spec("toy_walks")).built, "content", "two"), "no longer the data"),
        (
            lambda: bound.method(Spec("toy_trainee")).built.__dict__.update(
                facts=lambda: {"kind": "cubic"}
            ),
            "its kind",
        ),
    ],
)
def test_other_data_or_another_method_than_it_began_with_is_refused(toy_run, spoil, says):
    bound._dataset.cache_clear()
    bound._method.cache_clear()
    toy_run(stop=20)
    spoil()
    with pytest.raises(BenchError, match=says):
        toy_run(resume=True)
    bound._dataset.cache_clear()
    bound._method.cache_clear()


def test_a_checkpoint_of_another_network_is_refused(toy_run, tmp_path):
    toy_run(stop=20)
    tensors = {name: x for name, x in state(tmp_path / "run").items() if "critic.bias" not in name}
    run_folder.save(tmp_path / "run", run_folder.read(tmp_path / "run"), tensors)
    with pytest.raises(BenchError, match="the checkpoint is of another network"):
        toy_run(resume=True)


def test_init_begins_with_given_weights_and_a_fresh_optimiser(toy_run, tmp_path):
    toy_run("first", budget="200it")
    first = weights.read(tmp_path / "first")
    trained, _ = toy_run("more", init=str(tmp_path / "first"), budget="10it")
    assert trained.init == first.hash
    assert card(tmp_path / "more")["init"] == first.hash
    recipe = trained.recipe
    assert first.card.frames == 200 * recipe.batch * recipe.window
    assert trained.frames == 210 * recipe.batch * recipe.window
    assert not trained.uncounted
    assert str(tmp_path) not in json.dumps(card(tmp_path / "more"))
    started, fresh = (
        float(log.read(tmp_path / name)[0]["generator.rebuilt"]) for name in ("more", "first")
    )
    assert started < 0.3 * fresh
    steps = [each for name, each in state(tmp_path / "more").items() if name.endswith("/step")]
    assert {float(each) for each in steps} == {10.0, 5.0}


def test_init_takes_only_weights_of_this_make_and_goes_on_with_the_same(toy_run, tmp_path):
    toy_run("first", preset="quick")
    bundle = weights.read(tmp_path / "first")
    weights.write(tmp_path, "odd", bundle.tensors, replace(bundle.card, facts={"kind": "cubic"}))
    with pytest.raises(BenchError, match="kind=cubic"):
        toy_run("more", init=str(tmp_path / "odd.json"))
    toy_run("more", init=str(tmp_path / "first"), stop=4)
    doubled = {name: 2 * each for name, each in bundle.tensors.items()}
    weights.write(tmp_path / "first", "weights", doubled, bundle.card)
    with pytest.raises(BenchError, match="no longer the weights that this run began with"):
        toy_run("more", resume=True)
