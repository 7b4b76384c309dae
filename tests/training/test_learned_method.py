"""Learned methods: which weights they take, what is known of these without reading them, and results."""

from __future__ import annotations

import shutil
import subprocess
import sys
from functools import cached_property
from pathlib import Path

import pytest
import torch
from click.testing import CliRunner

from retarget_bench import cli
from retarget_bench.errors import BenchError
from retarget_bench.evaluation import runner
from retarget_bench.evaluation.plan import Plan
from retarget_bench.plugins import bound, registry
from retarget_bench.plugins.spec import Spec
from retarget_bench.results import store
from retarget_bench.training import weights
from retarget_bench.training.card_text import described
from retarget_bench.training.config import TrainingConfig
from retarget_bench.training.record import Record, TrainedOn, Validation
from tests.in_process import without_processes

HERE = Path(__file__).parent
CASES = HERE.parent / "engine" / "toys" / "toy_cases.py"
MANIFEST = {"characters": ["small"], "structures": ["toy"], "kinds": ["wiggle"]}


def card(**changes):
    fields = {"method": "shifter", "version": "1", "facts": {"cell": "tf", "layers": 1}}
    return Record(**(fields | {"training_manifest": MANIFEST} | changes))


def write(folder: Path, left: float = 0.0, name: str = weights.BEST, **changes) -> weights.Bundle:
    return weights.write(folder, name, {"shift": torch.tensor([left, 0.0, 0.0])}, card(**changes))


@pytest.fixture
def shifter(tmp_path, monkeypatch):
    """The folder of a method of its own, in which it may have weights."""
    monkeypatch.setattr(registry, "_FILES", dict(registry._FILES))
    for cached in (bound._method, bound.method_code):
        cached.cache_clear()
    folder = tmp_path / "method"
    folder.mkdir()
    shutil.copy(HERE / "learned_toys" / "shifter.py", folder)
    registry.add_file(folder / "shifter.py")
    registry.add_file(CASES)
    yield folder
    for cached in (bound._method, bound.method_code):
        cached.cache_clear()


def made(text: str = "shifter"):
    return registry.create("methods", text)


# ---------------------------------------------------------------------------------------- which weights
def test_without_weights_it_can_be_built_and_says_what_is_missing(shifter):
    method = made()
    body = next(iter(registry.create("datasets", "toy_cases").characters().values()))
    assert (method.weights_hash, method.weights_card, method.training_manifest) == ("", None, None)
    assert method.supports(body, body) == ("shifter has no weights; bench train shifter.py makes some")
    with pytest.raises(BenchError, match="has no weights; bench train"):
        _ = method.tensors
    assert method.training_manifest is None


def test_shipped_weights_are_those_beside_the_method(shifter):
    bundle = write(shifter / "weights", 0.5, "walks")
    method = made()
    assert method.weights_hash == bundle.hash
    assert method.training_manifest == MANIFEST
    assert method.untrained == ""
    assert float(method.tensors["shift"][0]) == 0.5
    assert made("shifter[weights=walks]").weights_label == "walks"
    (shifter / "weights" / "walks.json").rename(shifter / "weights" / "runs.json")
    assert made().untrained.endswith("'walks'; there are runs")


def test_weights_elsewhere_are_taken_by_folder_card_or_file(shifter, tmp_path, monkeypatch):
    bundle = write(tmp_path / "trained", 0.25)
    monkeypatch.chdir(tmp_path)
    for place in ("trained", "trained/weights.json", str(tmp_path / "trained" / "weights.safetensors")):
        method = made(f"shifter[weights='{place}']")
        assert method.weights_hash == bundle.hash
        assert method.weights_label == f"local-{bundle.hash[:8]}"
        assert float(method.tensors["shift"][0]) == 0.25


def test_a_folder_of_the_same_name_is_not_taken_for_weights(shifter, tmp_path, monkeypatch):
    """Neither in place of shipped ones nor where none are shipped."""
    write(tmp_path / "walks", 0.5)
    monkeypatch.chdir(tmp_path)
    assert made().weights_hash == ""
    bundle = write(shifter / "weights", 0.25, "walks")
    assert made().weights_hash == bundle.hash
    assert made("shifter[weights='./walks']").weights_hash not in ("", bundle.hash)


@pytest.mark.parametrize(
    ("written", "words"),
    [
        ("weights=wlaks", "has no shipped weights of the name 'wlaks'; there are walks"),
        ("weights=no/such/folder", "there are no weights of this name"),
        ("weights=nothing.json", "there are no weights of this name"),
        ("cell=torch", r"trained as shifter\[cell=tf\]; write cell=tf in the brackets"),
        ("layers=2,cell=torch", r"trained as shifter\[cell=tf,layers=1\]"),
    ],
)
def test_what_was_asked_for_and_is_not_there_is_an_error_not_a_row(shifter, written, words):
    """Found when a run is planned, not when its last case is reached."""
    write(shifter / "weights", name="walks")
    method = made(f"shifter[{written}]")
    for call in (lambda: method.weights_hash, lambda: method.training_manifest, lambda: method.tensors):
        with pytest.raises(BenchError, match=words):
            call()


def test_weights_older_than_a_parameter_were_made_with_its_default(shifter, tmp_path):
    written = write(tmp_path / "trained", facts={"cell": "tf"})
    place = f"weights='{tmp_path / 'trained'}'"
    assert made(f"shifter[{place}]").weights_hash == written.hash
    with pytest.raises(
        BenchError, match="older than shifter's parameter layers; leave it at its default 1"
    ):
        _ = made(f"shifter[layers=2,{place}]").weights_hash


def test_docstrings_under_fields_are_the_card_s_lines(shifter):
    assert made().card.parameters == {
        "cell": "the kind of its cells", "layers": "their number", "weights": "name or path",
    }  # fmt: skip
    assert made("shifter[layers=2]").facts() == {"cell": "tf", "layers": 2}


def test_what_the_refusal_says_to_write_is_taken(shifter, tmp_path):
    write(tmp_path / "trained", facts={"cell": "torch", "layers": 3})
    place = f"weights='{tmp_path / 'trained'}'"
    with pytest.raises(BenchError) as caught:
        _ = made(f"shifter[{place}]").weights_hash
    advice = str(caught.value).partition("; write ")[2].partition(" in the brackets")[0]
    assert made(f"shifter[{advice},{place}]").weights_hash


def test_training_goes_on_whatever_weights_lie_there(shifter):
    write(shifter / "weights", name="walks", version="0")
    method = made("shifter[cell=torch]").using({"shift": torch.ones(3)})
    assert method.untrained == ""
    assert method.weights_hash == ""
    assert method.tensors["shift"].tolist() == [1, 1, 1]


def test_networks_made_of_other_tensors_are_forgotten(shifter):
    class Networked(type(made())):
        @cached_property
        def network(self):
            return 2 * self.tensors["shift"]

    method = Networked().using({"shift": torch.ones(3)})
    assert method.network.tolist() == [2, 2, 2]
    assert method.using({"shift": torch.zeros(3)}).network.tolist() == [0, 0, 0]


def test_a_card_is_read_without_torch(tmp_path):
    bundle = write(tmp_path)
    code = f"""
import sys
from retarget_bench.api import MethodCard
from retarget_bench.training.learned_method import LearnedMethod

class Mine(LearnedMethod):
    card = MethodCard("shifter", "mine", "1")
    def facts(self):
        return {{"cell": "tf", "layers": 1}}

assert Mine(weights={str(tmp_path)!r}).weights_hash == {bundle.hash!r}
assert not {{"torch", "scipy", "pandas", "matplotlib"}} & set(sys.modules)
"""
    subprocess.run([sys.executable, "-c", code], check=True)


# --------------------------------------------------------------------------------------------- results
def carry_out(root: Path, *methods: str, **changes) -> list[store.Results]:
    plan = Plan(
        methods=tuple(map(Spec.parse, methods)),
        datasets=(Spec("toy_cases"),),
        splits=("intra",),
        metrics=("position",),
        out=root,
        **changes,
    )
    with without_processes():
        return [store.read_results(place) for place in runner.run(plan, lambda done, total: None)]


def test_local_weights_are_known_by_what_they_are_and_not_by_where_they_lie(shifter, tmp_path):
    """Two of them keep apart; moved elsewhere, they are the same and nothing is computed again."""
    own, others = write(tmp_path / "a", 0.01), write(tmp_path / "b", 0.5)
    both = [f"shifter[weights='{tmp_path / name}']" for name in "ab"]
    stored = carry_out(tmp_path / "runs", *both)
    errors = [
        sum(entry.values["mpjpe_h.world"] for entry in results.entries) / len(results.entries)
        for results in stored
    ]
    assert errors[0] < 1e-3 < 10 < errors[1]  # the references of the toy cases are 1 cm to the left
    labels = [results.header.method.label for results in stored]
    assert labels == [f"shifter[weights=local-{bundle.hash[:8]}]" for bundle in (own, others)]
    shown = [results.header.method.shown for results in stored]
    assert shown == [
        f"shifter[weights={name}-{bundle.hash[:8]}]"
        for name, bundle in zip("ab", (own, others), strict=True)
    ]
    assert stored[0].header.method.trained_on == {key: tuple(names) for key, names in MANIFEST.items()}
    for path in (tmp_path / "runs").rglob("*"):
        assert path.is_dir() or str(tmp_path / "a").encode() not in path.read_bytes(), path
    (tmp_path / "a").rename(tmp_path / "moved")
    (again,) = carry_out(tmp_path / "runs", f"shifter[weights='{tmp_path / 'moved'}']", overwrite="never")
    assert again.header == stored[0].header
    assert {entry.status for entry in again.entries} == {"ok"}


def test_other_weights_under_the_same_name_are_computed_anew(shifter, tmp_path):
    write(shifter / "weights", 0.01, "walks")
    (first,) = carry_out(tmp_path / "runs", "shifter")
    write(shifter / "weights", 0.5, "walks")
    bound._method.cache_clear()
    (second,) = carry_out(tmp_path / "runs", "shifter")
    assert first.header.keys != second.header.keys
    assert first.header.method.label == second.header.method.label == "shifter"


# ------------------------------------------------------------------------------------------ bench info
FULL = {
    "data": TrainedOn(spec="puppets[size=default]", label="puppets-1.0 default", clips=800, hours=1.21),
    "preset": "default",
    "recipe": TrainingConfig(steps=6000, batch=32, window=60, rate=0.0005),
    "command": "bench train shifter -d puppets[size=default]",
    "seed": 3,
    "steps": 6000,
    "step": 4500,
    "seconds": 12_600,
    "hardware": "a slow processor, 2 threads",
    "torch": "2.13.0",
    "processes": 2,
    "init": "0123456789abcdef",
    "curve": [{"step": 6000, "generator.cycle": 0.123}],
    "validation": [
        Validation(
            500 * k, 60.0, {split: {"mpjpe_h.world": 20.0 - k, "n": 12} for split in ("intra", "cross")}
        )
        for k in range(1, 13)
    ],
    "notes": ["not trained on rex: it stands on four legs"],
}


def test_a_card_is_told_in_words():
    text = dict(line.split(": ", 1) for line in described(card(**FULL, hash="ff")))
    assert text["trained as"] == "shifter[cell=tf,layers=1], version 1"
    assert text["trained on"] == (
        "the training motion of puppets-1.0 default (puppets[size=default]), 800 clips, 1.21 h of motion"
    )
    assert text["chosen by"] == (
        "validation cases of these data (12 intra, 12 cross); test cases were not used"
    )
    assert text["training"] == "6,000 steps (kept: those of step 4,500), 192,000 windows, 3.5 h, seed 3"
    assert text["began with"].startswith("weights 0123456789abcdef")
    assert text["machine"] == "a slow processor, 2 threads, torch 2.13.0, 2 processes"
    assert text["recipe"].startswith("default: steps 6000, batch 32, window 60, rate 0.0005, fps 30")
    assert text["losses"] == "generator.cycle 0.123"
    assert text["scores"] == "intra: mpjpe_h.world 11, n 12; cross: mpjpe_h.world 11, n 12"
    points = text["validation"].partition("splits: ")[2].split(", ")
    assert points[0] == "19.00 at 500"
    assert points[-1] == "8.00 at 6,000"
    assert len(points) == 9
    assert text["has seen"] == "characters small; structures toy; kinds wiggle"
    assert text["hash"] == "ff"


def test_windows_count_over_several_trainings_as_a_share_of_the_papers(tmp_path):
    """PAN's paper: 150,000 steps of 256 windows of 64 frames."""
    recipe = TrainingConfig(steps=0, batch=16, window=32, rate=1e-3)
    facts = {"recipe": recipe, "steps": 1000, "init": "0123456789abcdef", "earlier": 64 * 16_000}
    for uncounted, words in ((False, "0.062 %"), (True, "at least 0.062 %")):
        record = Record(method="pan", version="1", facts={}, uncounted=uncounted, **facts)
        pan = registry.create("methods", "pan")
        pan.__dict__["_card"] = record
        assert str(pan.training_share) == words
        assert f"windows: {words} of its paper's" in described(record, pan.training_share)
    ours = registry.create("methods", "paired")  # no paper
    ours.__dict__["_card"] = Record(method="paired", version="1", facts={}, **facts)
    assert ours.training_share is None


def test_what_a_card_does_not_say_is_left_out():
    text = described(Record(method="shifter", version="1", facts={}, notes=["by hand"], hash="ff"))
    assert text == ["trained as: shifter, version 1", "note: by hand", "hash: ff"]


def test_info_shows_the_cards_of_shipped_weights_and_of_a_path(shifter, tmp_path):
    def info(text: str) -> str:
        result = CliRunner().invoke(cli.group, ["info", text])
        assert result.exit_code == 0, result.output
        return " ".join(result.output.split())

    assert "Weights: none are shipped; bench train shifter.py makes some" in info("shifter")
    for name in ("walks", "runs"):
        write(shifter / "weights", name=name, **FULL)
    write(tmp_path / "own", facts={"cell": "torch", "layers": 1}, seed=77, steps=9)
    write(tmp_path / "others", method="lifter")
    result = CliRunner().invoke(cli.group, ["info", f"shifter[weights='{tmp_path / 'others'}']"])
    assert isinstance(result.exception, BenchError) or result.exit_code == 2
    assert "weights of lifter, not of shifter" in f"{result.output} {result.exception}"
    both = info("shifter")
    assert "Weights runs trained as" in both
    assert "Weights walks trained as" in both
    assert "command: bench train shifter" in both
    own = info(f"shifter[weights='{tmp_path / 'own'}']")
    assert "Weights walks" not in own
    assert "seed 77" in own
    assert "trained as: shifter[cell=torch" in own


def test_tensors_changed_behind_the_card_are_told_before_old_results_are_shown(shifter, tmp_path):
    """A file that was edited has the old card; what is stored under the card's hash is not its result."""
    write(tmp_path / "mine", 0.5)
    assert made(f"shifter[weights={tmp_path / 'mine'}]").weights_hash
    file = next((tmp_path / "mine").glob("*.safetensors"))
    content = bytearray(file.read_bytes())
    content[-12:] = bytes(each ^ 0x80 for each in content[-12:])  # the signs of three numbers
    file.write_bytes(content)
    with pytest.raises(BenchError, match=r"is not what .* describes; train it anew"):
        _ = made(f"shifter[weights={tmp_path / 'mine'}]").weights_hash
    file.unlink()
    with pytest.raises(BenchError, match="cannot be read"):
        _ = made(f"shifter[weights={tmp_path / 'mine'}]").weights_hash
