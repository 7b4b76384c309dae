"""Weights as files: what is kept, what comes back, and what is refused."""

from __future__ import annotations

import errno
import json
import math
import os
import re
from dataclasses import replace
from pathlib import Path

import pytest
import safetensors.torch
import torch
from hypothesis import example, given
from hypothesis import strategies as st
from torch import nn

from retarget_bench.errors import BenchError, FileError
from retarget_bench.plugins import registry
from retarget_bench.plugins.spec import Spec
from retarget_bench.training import tensor_files, weights
from retarget_bench.training.config import Augmentation, TrainingConfig
from retarget_bench.training.learned_method import LearnedMethod
from retarget_bench.training.record import Record, TrainedOn, Validation
from tests.examples import examples

FITTING = {"method": "mine", "version": "2", "facts": {"cell": "torch", "layers": 2, "dropout": 0.1}}
CARD = Record(**FITTING)
SHIPPED = sorted((Path(__file__).parents[2] / "methods").glob("*/weights/*.json"))


def some(seed: int = 0) -> dict[str, torch.Tensor]:
    numbers = torch.Generator().manual_seed(seed)
    return {
        "matrix": torch.randn(50, 90, generator=numbers),
        "bias": torch.randn(90, generator=numbers),
        "statistics": torch.randn(22, 3, generator=numbers),
        "scale": torch.tensor(3.3),
        "count": torch.tensor(70_001),
    }


def nested(depth: int) -> list:
    """Lists in lists."""
    return [nested(depth - 1)] if depth else []


# ------------------------------------------------------------------------------------------ there and back
SHAPES = st.lists(st.integers(0, 24), max_size=3).map(tuple)


@examples(50)
@example(shapes={"at most": (64, 64), "more": (4097,)}, seed=0)
@given(shapes=st.dictionaries(st.text("abc._1", min_size=1), SHAPES, max_size=5), seed=st.integers(0, 99))
def test_what_comes_back_is_what_half_precision_leaves_of_many_numbers(tmp_path_factory, shapes, seed):
    numbers = torch.Generator().manual_seed(seed)
    tensors = {name: 100 * torch.randn(shape, generator=numbers) for name, shape in shapes.items()}
    folder = tmp_path_factory.mktemp("bundle")
    weights.write(folder, "all", tensors, CARD)
    back = weights.read(folder / "all.json").tensors
    assert set(back) == set(tensors)
    for name, tensor in tensors.items():
        expected = tensor.half().float() if tensor.numel() > 4096 else tensor
        assert back[name].dtype == torch.float32
        assert torch.equal(back[name], expected)


def test_the_file_is_plain_safetensors(tmp_path):
    """As another reader sees it: half precision where there are many numbers, and nothing rounded twice."""
    written = weights.write(tmp_path, "w", some(), CARD, exact=("precise",))
    assert {k: v.dtype for k, v in safetensors.torch.load_file(tmp_path / "w.safetensors").items()} == {
        "matrix": torch.float16,
        "bias": torch.float32,
        "statistics": torch.float32,
        "scale": torch.float32,
        "count": torch.int64,
    }
    assert torch.equal(written.tensors["matrix"], weights.read(tmp_path / "w.json").tensors["matrix"])
    (tmp_path / "any").touch()
    assert (tmp_path / "w.safetensors").stat().st_mode == (tmp_path / "any").stat().st_mode


def test_what_half_precision_cannot_hold_stays_as_it_is(tmp_path):
    tensors = {"far": torch.full((90, 90), 1e5), "precise": torch.full((90, 90), 1.0001)}
    assert not torch.equal(tensors["precise"].half().float(), tensors["precise"])
    back = weights.write(tmp_path, "w", tensors, CARD, exact=("precise",)).tensors
    assert torch.equal(back["far"], tensors["far"])
    assert torch.equal(back["precise"], tensors["precise"])


def test_the_card_comes_back_and_needs_no_tensor(tmp_path):
    card = replace(
        CARD,
        data=TrainedOn(spec="puppets", clips=3, hours=0.1),
        recipe=TrainingConfig(steps=3, batch=2, window=1, rate=1e-4, augmentation=Augmentation()),
        curve=[{"step": 3.0, "a.b": 1e-30}],
        validation=[Validation(3, 0.5, {"self": {"mpjpe_h.world": 1 / 3, "n": 2}})],
        training_manifest={"characters": ["zoë"]},
        notes=["größer"],
    )
    weights.write(tmp_path, "w", some(), card)
    (tmp_path / "w.safetensors").write_bytes(b"")
    read = weights.read_card(tmp_path / "w.json")
    assert read == replace(card, hash=read.hash)
    assert re.fullmatch("[0-9a-f]{16}", read.hash)


def test_weights_are_found_by_card_by_file_by_name_and_by_folder(tmp_path):
    weights.write(tmp_path, weights.BEST, some(), CARD)
    places = (tmp_path, tmp_path / "weights.json", tmp_path / "weights.safetensors", tmp_path / "weights")
    assert {weights.locate(place) for place in places} == {tmp_path / "weights.json"}


# ---------------------------------------------------------------------------------------------- refusals
def flip(path: Path) -> None:
    data = bytearray(path.read_bytes())
    data[-3] ^= 1
    path.write_bytes(data)


def exchanged(path: Path) -> None:
    weights.write(path.parent / "other", "w", some(1), CARD)
    path.write_bytes((path.parent / "other" / "w.safetensors").read_bytes())


def pickled(path: Path) -> None:
    torch.save(some(), path)


@pytest.mark.parametrize(
    ("harm", "words"),
    [
        (flip, "is not what w.json describes"),
        (exchanged, "is not what w.json describes"),
        (pickled, "cannot be read"),
        (lambda path: path.write_bytes(path.read_bytes()[:50]), "cannot be read"),
        (Path.unlink, "cannot be read"),
    ],
)
def test_files_that_are_damaged_or_belong_to_others_are_refused(tmp_path, harm, words):
    weights.write(tmp_path, "w", some(), CARD)
    harm(tmp_path / "w.safetensors")
    with pytest.raises(FileError, match=words) as caught:
        weights.read(tmp_path / "w.json")
    assert str(caught.value).startswith(str(tmp_path / "w.safetensors"))


@pytest.mark.parametrize(
    ("tensor", "words"),
    [
        (torch.tensor([0.0, math.nan]), "x has numbers that are not finite"),
        (torch.tensor([math.inf]).half(), "x has numbers that are not finite"),
        (torch.tensor([1e300]).double(), "x has numbers that are not finite"),
        (torch.zeros(3).bfloat16(), "of a type that cannot be read"),
        (torch.zeros(3).to(torch.float8_e5m2), "of a type that cannot be read"),
        (torch.zeros(3).to(torch.complex64), "x is of type complex64"),
    ],
)
def test_tensors_that_are_no_weights_are_refused(tmp_path, monkeypatch, tensor, words):
    """A card can name them: its hash says nothing of what they are."""
    card = weights.write(tmp_path, "w", some(), CARD).card
    safetensors.torch.save_file({"x": tensor}, tmp_path / "w.safetensors")
    monkeypatch.setattr(tensor_files, "arrays_hash", lambda arrays: card.hash)
    with pytest.raises(FileError, match=words):
        weights.read(tmp_path / "w.json")


def test_a_pipe_in_place_of_tensors_does_not_block(tmp_path):
    weights.write(tmp_path, "w", some(), CARD)
    for name, words in (("w.safetensors", "cannot be read"), ("w.json", "is not the card of weights")):
        (tmp_path / name).unlink()
        os.mkfifo(tmp_path / name)
        with pytest.raises(FileError, match=words):
            weights.read(tmp_path / "w.json")


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"schema": tensor_files.SCHEMA + 1}, rf"has schema {tensor_files.SCHEMA + 1}; this version reads"),
        ({"schema": "1"}, "has schema 1"),
        ({"schema": None}, "it has no schema"),
        ({"hash": None}, "is not what w.json describes"),
        ({"facts": None}, r"is not the card of weights of a method \(facts: Field required"),
    ],
)
def test_cards_that_cannot_be_relied_on_are_refused(tmp_path, change, words):
    weights.write(tmp_path, "w", some(), CARD)
    place = tmp_path / "w.json"
    card = json.loads(place.read_text()) | change
    place.write_text(json.dumps({key: value for key, value in card.items() if value is not None}))
    with pytest.raises(FileError, match=words):
        weights.read(place)


DEEP = json.dumps({"schema": 1, "hash": "", **FITTING, "notes": nested(200)})


@pytest.mark.parametrize("text", ["", "[]", "{", "3", "[" * 200_000, DEEP, DEEP + " " * 20_000_000])
def test_what_is_no_card_is_refused(tmp_path, text):
    weights.write(tmp_path, "w", some(), CARD)
    (tmp_path / "w.json").write_text(text)
    with pytest.raises(FileError, match="is not the card of weights"):
        weights.read(tmp_path / "w.safetensors")


def test_weights_that_are_not_there_are_told_from_weights_without_a_card(tmp_path):
    with pytest.raises(FileError, match="there are no weights of this name"):
        weights.read(tmp_path / "w.json")
    weights.write(tmp_path, "w", some(), CARD)
    (tmp_path / "w.json").unlink()
    with pytest.raises(FileError, match=r"lies without its card w\.json"):
        weights.read(tmp_path / "w.safetensors")


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"method": "yours"}, "weights of mine, not of yours"),
        ({"version": "3"}, "trained with version 2 of mine, and this is version 3"),
        ({"facts": {**CARD.facts, "cell": "tf"}}, r"trained as mine\[cell=torch\]; write cell=torch in"),
        (
            {"facts": {"cell": "tf", "layers": 1, "dropout": 0.1}},
            r"trained as mine\[cell=torch,layers=2\]; write cell=torch,layers=2 in",
        ),
        ({"facts": {**CARD.facts, "width": 3}}, "one of the two lacks width"),
        ({"facts": {"cell": "torch", "layers": 2}}, "one of the two lacks dropout"),
    ],
)
def test_weights_of_another_method_version_or_make_are_refused(changes, words):
    weights.check("w.json", CARD, **FITTING)
    with pytest.raises(BenchError, match=words):
        weights.check("w.json", CARD, **(FITTING | changes))


# ------------------------------------------------------------------------------------- writing that fails
def test_diverged_weights_are_not_written_and_those_before_stay(tmp_path):
    before = weights.write(tmp_path, "w", some(), CARD)
    with pytest.raises(BenchError, match="bias is not finite"):
        weights.write(tmp_path, "w", some(1) | {"bias": torch.tensor([torch.nan])}, CARD)
    assert weights.read(tmp_path / "w.json").hash == before.hash


@pytest.mark.parametrize("nth", [1, 2])
def test_a_full_disk_is_told_and_what_was_there_stays(tmp_path, monkeypatch, nth):
    """Whichever of the two files no longer fits."""
    before = weights.write(tmp_path, "w", some(), CARD)
    writes = []

    def full(write):
        def wrapped(self, *args, **kwargs):
            writes.append(self)
            if len(writes) == nth:
                raise OSError(errno.ENOSPC, "No space left on device")
            return write(self, *args, **kwargs)

        return wrapped

    monkeypatch.setattr(Path, "write_bytes", full(Path.write_bytes))
    monkeypatch.setattr(Path, "write_text", full(Path.write_text))
    with pytest.raises(FileError, match="No space left on device"):
        weights.write(tmp_path, "w", some(1), CARD)
    assert len(writes) == nth
    monkeypatch.undo()
    assert weights.read(tmp_path / "w.json").hash == before.hash
    assert sorted(path.name for path in tmp_path.iterdir()) == ["w.json", "w.safetensors"]


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("facts", None),
        ("facts", [1]),
        ("version", 1),
        ("validation", [{}]),
        ("validation", [{"step": 1, "scores": {}}]),
        ("validation", {"step": 1}),
        ("recipe", {"steps": "40", "batch": 8, "window": 16, "rate": 0.05}),
        ("training_manifest", []),
        ("training_manifest", {"characters": "ada"}),
        ("data", "puppets"),
        ("steps", "many"),
        ("steps", True),
        ("seconds", None),
        ("seconds", 10**400),
        ("data", {"hours": 10**400}),
        ("notes", "all is well"),
        ("notes", nested(10)),
    ],
)
def test_a_damaged_field_of_a_card_is_named(tmp_path, field, value):
    weights.write(tmp_path, "w", some(), CARD)
    place = tmp_path / "w.json"
    place.write_text(json.dumps({**json.loads(place.read_text()), field: value}))
    for read in (weights.read_card, weights.read):
        with pytest.raises(FileError, match=rf"w.json: is not the card of weights of a method \({field}"):
            read(tmp_path / "w")


# ------------------------------------------------------------------------------------------ into modules
def test_modules_take_tensors_of_their_own_names_and_shapes_only():
    module, other = nn.GRUCell(3, 4), nn.GRUCell(3, 4)
    weights.fill(module, other.state_dict())
    assert all(torch.equal(a, b) for a, b in zip(module.parameters(), other.parameters(), strict=True))
    before = {name: tensor.clone() for name, tensor in module.state_dict().items()}
    complete = {name: tensor + 1 for name, tensor in other.state_dict().items()}
    wrong = [
        ({"more": torch.zeros(1)}, "more is not known to it"),
        ({"weight_ih": torch.zeros(12, 4)}, r"weight_ih has shape \(12, 4\), the network's has \(12, 3\)"),
    ]
    for change, words in wrong:
        with pytest.raises(BenchError, match=words):
            weights.fill(module, complete | change)
    with pytest.raises(BenchError, match="bias_hh is missing"):
        weights.fill(module, {name: each for name, each in complete.items() if name != "bias_hh"})
    assert all(torch.equal(tensor, before[name]) for name, tensor in module.state_dict().items())


# -------------------------------------------------------------------------------------------- as shipped
@pytest.mark.parametrize("place", SHIPPED, ids=lambda path: f"{path.parents[1].name}-{path.stem}")
def test_shipped_weights_are_small_and_fit_their_method_as_it_is(place):
    card = weights.read_card(place)
    assert place.with_suffix(".safetensors").stat().st_size < weights.LARGEST
    built = registry.create("methods", Spec(card.method, {**card.facts, "weights": place.stem}))
    assert isinstance(built, LearnedMethod)
    if built.stages:  # their weights count as well
        assert built.weights_hash not in ("", card.hash)
    else:
        assert built.weights_hash == card.hash
    assert all(torch.isfinite(tensor).all() for tensor in built.tensors.values())
    assert set(card.training_manifest) >= {"characters", "structures"}
    assert card.best in card.validation
    assert card.command.startswith("bench train ")
