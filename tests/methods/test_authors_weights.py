"""SAN and PAN with the files of their authors: what their code answers, and files that are not theirs."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import authors_files
import numpy as np
import pytest
import torch
from authors_files import MIXAMO, arrays
from torch import Tensor

from retarget_bench.api import Context
from retarget_bench.errors import BenchError, FileError
from retarget_bench.methods.pan import Pan
from retarget_bench.methods.pan.settings import BETWEEN_LEGS, SETTINGS
from retarget_bench.methods.san import San
from retarget_bench.plugins import bound
from retarget_bench.plugins.spec import Spec
from retarget_bench.training.learned_method import of_weights

STRUCTURES = {"S23": "mixamo-A", "S28": "mixamo-B", "human": "lafan22", "dog": "mann21_four_legged"}


@pytest.fixture
def small(monkeypatch):
    """PAN in the sizes of the networks whose answers we have."""
    for variants in (SETTINGS, BETWEEN_LEGS):
        released = variants["released"]
        design = replace(released.design, width=16, skeleton=16, feedforward=64)
        monkeypatch.setitem(variants, "released", replace(released, design=design))


@pytest.fixture
def folders(small, real_data, tmp_path) -> Any:
    """Where the authors' files of a method lie, by its name."""

    def made(name: str, prefix: str = "") -> Path:
        if name == "three":
            return authors_files.between_legs(real_data, tmp_path / name)
        return authors_files.mixamo(real_data, name, tmp_path / name, prefix)

    return made


def method(name: str, folder: Path) -> Any:
    if name == "san":
        return San("released", weights=str(folder))
    return Pan("released", "three" if name == "three" else "six", weights=str(folder))


def close(answer: Tensor, expected: np.ndarray) -> None:
    assert answer.shape == expected.shape
    assert np.abs(answer.detach().numpy() - expected).max() <= 1e-5 * np.abs(expected).max()


def by_edge(channels: np.ndarray) -> Tensor:
    """``(rows, frames, edges + 1, 4)`` of ``(rows, channels, frames)``."""
    values = torch.from_numpy(channels).transpose(1, 2)
    return torch.nn.functional.pad(values, (0, -values.shape[2] % 4)).unflatten(2, (-1, 4))


def channels(values: Tensor) -> Tensor:
    """``(rows, channels, frames)`` of ``(rows, frames, parts, width)``."""
    return values.flatten(2).transpose(1, 2)


# ------------------------------------------------------------------------------------- the same answers
@pytest.mark.parametrize("name", ["san", "pan"])
@pytest.mark.parametrize("tree", MIXAMO)
@torch.inference_mode()
def test_mixamo_networks_answer_as_the_authors(folders, real_data, name, tree):
    structure = method(name, folders(name, "module." * (tree == "S28"))).structures[STRUCTURES[tree]]
    found = arrays(real_data, f"{name}_{tree}")
    rows = found["input/character_of_sample"]
    bones = torch.from_numpy(np.roll(found["structure/offsets"][rows], -1, 1))
    motion = by_edge(found["input/motion"])
    code = structure.code(motion, bones)
    close(channels(code), found["output/motion_code"])
    answer = structure.answer(code, bones)
    close(channels(answer)[:, :-1], found["output/decoded"])
    names = [str(found["structure/characters"][row]) for row in rows]
    which = torch.tensor(structure.statistics_row(names))
    close(channels(structure.plain(motion, which))[:, :-1], found["output/motion_denormalised"])
    np.testing.assert_allclose(structure.mean[0], structure.mean[1:].mean(0), atol=1e-5)
    assert structure.statistics_row(["someone else"]) == [0]


@pytest.mark.parametrize("species", ["human", "dog"])
@torch.inference_mode()
def test_networks_between_legs_answer_as_the_authors(folders, real_data, species):
    structure = method("three", folders("three")).structures[STRUCTURES[species]]
    found = {
        name.removeprefix(f"{species}/"): each for name, each in arrays(real_data, "pan_three").items()
    }
    joints = torch.from_numpy(found["input/offsets"]).unflatten(1, (-1, 3))
    bones = torch.nn.functional.pad(joints, (0, 0, 1, 1))
    code = structure.code(by_edge(found["input/motion"]), bones)
    close(channels(code), found["output/motion_code"])
    answer = structure.answer(code, bones)
    close(answer.flatten(2), found["output/decoded"])
    plain = structure.plain(by_edge(found["input/motion"]), torch.zeros(2, dtype=torch.long))
    close(plain.flatten(2), found["output/motion_denormalised"])


# ------------------------------------------------------------------------------------ weights like others
@pytest.mark.parametrize("name", ["san", "pan"])
def test_characters_of_the_data_set_go_through_them(folders, real_data, name):
    root = real_data / "mixamo_san"
    if not root.is_dir():
        pytest.skip("no files of Mixamo")
    data = bound.dataset(Spec("mixamo", {"root": str(root)})).built
    cast, built = data.characters(), method(name, folders(name))
    source = data.motion("Aj", "Catwalk Idle To Walk Forward").at(slice(40))
    for target in ("Kaya", "Mousey_m"):
        assert built.supports(source.character, cast[target]) is None
        assert built.assigned(cast[target])[0] == cast[target].structure
        answer = built.retarget(source, cast[target], context=Context())
        assert np.isfinite(answer.positions).all()


@pytest.mark.parametrize("name", ["san", "pan", "three"])
def test_they_are_known_by_their_bytes_and_as_the_authors(folders, name):
    folder = folders(name)
    plugin, built = ("san" if name == "san" else "pan"), method(name, folder)
    assert built.untrained == ""
    assert built.weights_label == f"authors-{built.weights_hash[:8]}"
    again = of_weights(plugin, str(folder))
    assert again.facts() == built.facts()
    assert again.weights_card["notes"][0].startswith("the authors' weights")
    spec = Spec(plugin, {"variant": "released", **({"parts": "three"} if name == "three" else {})})
    known = bound.method(spec.with_parameters(weights=str(folder))).known_as
    assert known == spec.with_parameters(weights=built.weights_label)
    file = next(folder.rglob("s*enc*.p*"))
    torch.save({**torch.load(file), "another": torch.ones(1)}, file)
    assert method(name, folder).weights_hash != built.weights_hash


@pytest.mark.parametrize(
    ("spec", "advice"),
    [
        ("san", "variant=released"),
        ("san[variant=released,neighbours=fixed]", "neighbours=released"),
        ("pan", "variant=released"),
        ("pan[variant=paper]", "variant=released"),
        ("pan[variant=released,parts=three]", "parts=six"),
    ],
)
def test_they_need_the_parameters_of_the_authors(folders, spec, advice):
    asked = Spec.parse(spec)
    folder = folders(asked.name)
    with pytest.raises(BenchError, match=f"write {advice} in the brackets of {asked.name}"):
        _ = bound.method(asked.with_parameters(weights=str(folder))).known_as
