"""What a run remembers and guards: what its weights have seen, its folder, its motion."""

import json
from dataclasses import replace

import pytest

from retarget_bench.errors import BenchError
from retarget_bench.plugins import bound, registry
from retarget_bench.plugins.spec import Spec
from retarget_bench.training import run_folder, train, weights
from retarget_bench.training.card_text import described
from tests.training.conftest import TOYS


def card(folder):
    return json.loads((folder / "weights.json").read_text())


# --------------------------------------------------------------------- what earlier training has seen
def _known_as(monkeypatch, **manifest):
    data = bound.dataset(Spec("toy_walks")).built
    monkeypatch.setattr(data, "training_manifest", lambda: manifest, raising=False)


def test_the_manifest_holds_what_all_generations_of_weights_have_seen(toy_run, tmp_path, monkeypatch):
    _known_as(monkeypatch, characters=["small", "bob"], kinds=["run"])
    toy_run("first", preset="quick")
    _known_as(monkeypatch, characters=["small", "tall"], clips=["walk"])
    toy_run("second", preset="quick", init=str(tmp_path / "first"))
    _known_as(monkeypatch, characters=["tall"])
    toy_run("third", preset="quick", init=str(tmp_path / "second"))
    facts = card(tmp_path / "third")
    assert {key: set(names) for key, names in facts["training_manifest"].items()} == {
        "characters": {"small", "bob", "tall"},
        "kinds": {"run"},
        "clips": {"walk"},
    }
    assert facts["notes"] == []


def test_weights_that_do_not_say_what_they_have_seen_are_noted_for_good(toy_run, tmp_path):
    toy_run("first", preset="quick")
    bundle = weights.read(tmp_path / "first")
    mute = replace(bundle.card, training_manifest=None)
    weights.write(tmp_path, "mute", bundle.tensors, mute)
    toy_run("second", preset="quick", init=str(tmp_path / "mute.json"))
    toy_run("third", preset="quick", init=str(tmp_path / "second"))
    for name in ("second", "third"):
        (note,) = card(tmp_path / name)["notes"]
        assert "not known in full" in note


# ------------------------------------------------------------------------------- one process, one motion
def test_a_folder_in_which_another_process_trains_is_refused(toy_run, tmp_path):
    toy_run(preset="quick", stop=6)
    with (
        run_folder.locked(tmp_path / "run"),
        pytest.raises(BenchError, match="another process is training in"),
    ):
        toy_run(resume=True)
    trained, _ = toy_run(resume=True)
    assert trained.steps == 10
    assert not (tmp_path / "run" / run_folder.LOCK).exists()


def test_a_run_keeps_its_folder_as_long_as_it_trains(toy_run, tmp_path, monkeypatch):
    messages = []

    def attempt(*_):
        with pytest.raises(BenchError) as caught, run_folder.locked(tmp_path / "run"):
            pass
        messages.append(str(caught.value))
        raise KeyboardInterrupt

    monkeypatch.setattr(train.Loop, "_after", attempt)
    toy_run(preset="quick")
    assert messages == [f"another process is training in {tmp_path / 'run'}"]


def test_other_training_motion_than_it_began_with_is_refused(toy_run, monkeypatch):
    toy_run(preset="quick", stop=6)
    method = type(bound.method(Spec("toy_trainee")).built)
    monkeypatch.setattr(method, "prepare", lambda self, motion: {"root": motion.root + 1e-3})
    with pytest.raises(BenchError, match="no longer the data that this run began with"):
        toy_run(resume=True)


# ------------------------------------------------------------------------------------ what the card says
def test_a_limit_of_time_leaves_no_number_of_steps_in_the_recipe(toy_run, tmp_path):
    toy_run(preset="quick", budget="0.2s")
    facts = weights.read_card(tmp_path / "run")
    assert (facts.recipe.steps, facts.recipe.batch) == (0, 4)
    assert any(line.startswith("recipe: quick: batch 4,") for line in described(facts))


def test_the_card_says_as_what_the_scores_were_measured(toy_run, tmp_path):
    toy_run(method="toy_trainee[does=slowly,weights=some]", preset="quick")
    facts = weights.read_card(tmp_path / "run")
    assert facts.scored_as == "toy_trainee[does=slowly]"
    assert "scored as: toy_trainee[does=slowly]" in described(facts)
    plain = described(replace(facts, scored_as="toy_trainee[kind=linear]"))
    assert not [line for line in plain if line.startswith("scored as")]


def test_a_run_knows_the_files_of_its_plug_ins(toy_run, tmp_path, monkeypatch):
    toy_run(preset="quick", budget="4it")
    monkeypatch.setattr(registry, "_FILES", {})  # as in another process
    trained, _ = toy_run(method=None, data=None, resume=True, budget="8it")
    assert trained.steps == 8
    assert trained.command.startswith("bench train toy_trainee.py -d toy_walks.py ")


def test_a_card_of_another_name_than_its_file_is_refused(toy_run, tmp_path):
    renamed = tmp_path / "renamed.py"
    renamed.write_text((TOYS / "toy_trainee.py").read_text())
    registry.add_file(renamed)
    with pytest.raises(BenchError, match="called renamed, and its card toy_trainee"):
        toy_run(method="renamed")


def test_a_run_of_other_parameters_names_them(toy_run, tmp_path):
    toy_run(stop=20)
    path = tmp_path / "run" / "run.json"
    facts = json.loads(path.read_text())
    path.write_text(json.dumps({**facts, "facts": {**facts["facts"], "depth": 3}}))
    with pytest.raises(BenchError, match=r"not what this run began with \(its depth\)"):
        toy_run(resume=True)
