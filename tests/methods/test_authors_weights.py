"""SAN and PAN with the files of their authors: what their code answers, and files that are not theirs."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import authors_files
import numpy as np
import pytest
import same_material
import test_r2et_released
import torch
from authors_files import MIXAMO, arrays
from torch import Tensor

from retarget_bench.api import Context
from retarget_bench.errors import BenchError, FileError
from retarget_bench.methods.pan import Pan
from retarget_bench.methods.pan.settings import VARIANTS
from retarget_bench.methods.r2et import R2ET
from retarget_bench.methods.same import Same
from retarget_bench.methods.san import San
from retarget_bench.plugins import bound
from retarget_bench.plugins.spec import Spec
from retarget_bench.training.learned_method import of_weights

STRUCTURES = {"S23": "mixamo-A", "S28": "mixamo-B", "human": "lafan22", "dog": "mann21_four_legged"}


@pytest.fixture
def small(monkeypatch):
    """PAN in the sizes of the networks whose answers we have."""
    for name in ("released", "released_three"):
        released = VARIANTS[name]
        design = replace(released.design, width=16, skeleton=16, feedforward=64)
        monkeypatch.setitem(VARIANTS, name, replace(released, design=design))


@pytest.fixture
def folders(small, real_data, tmp_path) -> Any:
    """Where the authors' files of a method lie, by its name."""

    def build(name: str, prefix: str = "") -> Path:
        if name == "three":
            return authors_files.between_legs(real_data, tmp_path / name)
        return authors_files.mixamo(real_data, name, tmp_path / name, prefix)

    return build


def method(name: str, folder: Path) -> Any:
    if name == "san":
        return San(variant="released", weights=str(folder))
    return Pan(variant="released", parts="three" if name == "three" else "six", weights=str(folder))


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
    oracle = arrays(real_data, f"{name}_{tree}")
    rows = oracle["input/character_of_sample"]
    bones = torch.from_numpy(np.roll(oracle["structure/offsets"][rows], -1, 1))
    motion = by_edge(oracle["input/motion"])
    code = structure.code(motion, bones)
    close(channels(code), oracle["output/motion_code"])
    answer = structure.answer(code, bones)
    close(channels(answer)[:, :-1], oracle["output/decoded"])
    names = [str(oracle["structure/characters"][row]) for row in rows]
    which = torch.tensor(structure.statistics_row(names))
    close(channels(structure.plain(motion, which))[:, :-1], oracle["output/motion_denormalised"])
    np.testing.assert_allclose(structure.mean[0], structure.mean[1:].mean(0), atol=1e-5)
    assert structure.statistics_row(["someone else"]) == [0]


@pytest.mark.parametrize("tree", MIXAMO)
@torch.inference_mode()
def test_the_root_s_offset_is_one_more_bone(folders, real_data, tree):
    """Codes of bones by dense layers times their masks, the root's OFFSET the first bone."""
    for name in ("san", "pan"):
        structure = method(name, folders(name)).structures[STRUCTURES[tree]]
        oracle = arrays(real_data, f"{name}_{tree}")
        offsets = torch.from_numpy(oracle["structure/offsets"])
        offsets[:, 0] = torch.tensor([0.0, 35.0, 0.0])
        bones, layers = offsets.roll(-1, 1), authors_files.state(oracle, "static_encoder")
        values = offsets.flatten(1)
        for layer in ("layers.0.0",) if name == "san" else ("linear1", "linear2", "linear3"):
            weight = layers[f"{layer}.weight"] * layers[f"{layer}.mask"]
            values = values @ weight.T + layers[f"{layer}.bias"]
            if name == "san":
                values = values @ layers["layers.0.1.weight"].T
            values = torch.nn.functional.leaky_relu(values, 0.2)
        if name == "san":
            close(structure.codes(bones)[1], values.numpy())
        else:
            close(100.0 * structure.skeleton(bones).flatten(1), values.numpy())


@pytest.mark.parametrize("species", ["human", "dog"])
@torch.inference_mode()
def test_networks_between_legs_answer_as_the_authors(folders, real_data, species):
    structure = method("three", folders("three")).structures[STRUCTURES[species]]
    oracle = {
        name.removeprefix(f"{species}/"): each for name, each in arrays(real_data, "pan_three").items()
    }
    joints = torch.from_numpy(oracle["input/offsets"]).unflatten(1, (-1, 3))
    bones = torch.nn.functional.pad(joints, (0, 0, 1, 1))
    code = structure.code(by_edge(oracle["input/motion"]), bones)
    close(channels(code), oracle["output/motion_code"])
    answer = structure.answer(code, bones)
    close(answer.flatten(2), oracle["output/decoded"])
    plain = structure.plain(by_edge(oracle["input/motion"]), torch.zeros(2, dtype=torch.long))
    close(plain.flatten(2), oracle["output/motion_denormalised"])


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
        key, body = built.assigned(cast[target])
        assert key == cast[target].structure
        bones = built.settings.features.bones(body, root_bone=built.root_bone)
        np.testing.assert_allclose(bones[-1], [0.0, {"Kaya": 0.0, "Mousey_m": 35.082581}[target], 0.0])
        answer = built.retarget(source, cast[target], context=Context())
        assert np.isfinite(answer.positions).all()


def test_people_and_dogs_of_the_data_set_go_through_their_own_networks(folders, real_data):
    if not (real_data / "lafan1").is_dir() or not (real_data / "dog").is_dir():
        pytest.skip("no files of LAFAN1 and MANN")
    cast = bound.dataset(Spec("lafan_dog", {"root": str(real_data)})).built.characters()
    build = method("three", folders("three"))
    assert {build.assigned(each)[0] for each in cast.values()} == {"lafan22", "mann21_four_legged"}
    for each in cast.values():
        assert build.assignment(each).note == ""
        assert build.supports(each, cast["dog"]) is None


@pytest.mark.parametrize("name", ["san", "pan", "three"])
def test_they_are_known_by_their_bytes_and_as_the_authors(folders, name):
    folder = folders(name)
    plugin, built = ("san" if name == "san" else "pan"), method(name, folder)
    assert built.untrained == ""
    assert built.weights_label == f"authors-{built.weights_hash[:8]}"
    again = of_weights(plugin, str(folder))
    assert again.facts() == built.facts()
    assert again.weights_card.notes[0].startswith("the authors' weights")
    spec = Spec(plugin, {"variant": "released", **({"parts": "three"} if name == "three" else {})})
    label = bound.method(spec.with_parameters(weights=str(folder))).known_as
    assert label == spec.with_parameters(weights=built.weights_label)
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
    request = Spec.parse(spec)
    folder = folders(request.name)
    with pytest.raises(BenchError, match=f"write {advice} in the brackets of {request.name}"):
        _ = bound.method(request.with_parameters(weights=str(folder))).known_as


# ------------------------------------------------------------------------------- files that are not theirs
class Evil:
    """Runs when it is unpickled in full."""

    def __reduce__(self):
        return (Path.touch, (Path("evil"),))


@pytest.fixture(params=["san", "pan", "three", "r2et", "same"])
def files(request, tmp_path) -> tuple[Any, Path]:
    """A method by the authors' files, anew on every call, and one of its files of tensors."""
    name = request.param
    if name == "r2et":
        file = test_r2et_released.repository(
            tmp_path, test_r2et_released.their_names(), test_r2et_released.random_statistics()
        )
        return lambda: R2ET(weights=str(file)), file
    if name == "same":
        oracle = same_material.oracle(request.getfixturevalue("real_data"))
        folder = same_material.write_released(oracle, tmp_path)
        return lambda: Same(weights=str(folder)), folder / same_material.MODEL
    folder = request.getfixturevalue("folders")(name)
    (file, *_) = sorted(folder.rglob("a*e*.pt*"))
    return lambda: method(name, folder), file


def spoilt(content: Any, value: Any) -> Any:
    """The content with another value in the place of its first tensor."""
    if isinstance(content.get("model"), dict):
        return {**content, "model": spoilt(content["model"], value)}
    return {**content, next(iter(content)): value}


WRONG = {
    "list": lambda content: [torch.ones(2)],
    "numbers": lambda content: {1: torch.ones(2)},
    "code": lambda content: spoilt(content, Evil()),
    "another network": lambda content: {"seq.weight": torch.ones(16, 3, 4)},
    "a text": lambda content: spoilt(content, "text"),
    "not finite": lambda content: spoilt(content, torch.full((3, 3), torch.nan)),
    "sparse": lambda content: spoilt(content, torch.ones(3).to_sparse()),
    "complex": lambda content: spoilt(content, torch.ones(3, dtype=torch.complex64)),
}


@pytest.mark.parametrize("wrong", WRONG)
def test_a_file_that_is_not_the_authors_is_refused_in_a_sentence(files, wrong, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    build, file = files
    torch.save(WRONG[wrong](torch.load(file)), file)
    with pytest.raises(FileError, match=f"^{file}: .* "):
        _ = build().tensors
    assert not Path("evil").exists()


@pytest.mark.parametrize("content", [b"", b"hello world", bytes(64), None], ids=repr)
def test_bytes_that_torch_did_not_write_are_refused(files, content):
    """None: the first half of the file."""
    build, file = files
    file.write_bytes(file.read_bytes()[: file.stat().st_size // 2] if content is None else content)
    with pytest.raises(FileError, match=f"{file.name}: cannot be read"):
        _ = build().tensors


def test_a_missing_file_is_named(files):
    build, file = files
    file.unlink()
    with pytest.raises(FileError, match=f"lacks {file.name}|there is no such file"):
        _ = build().weights_hash


@pytest.mark.parametrize("name", ["san", "pan", "three"])
def test_statistics_are_asked_for(folders, name):
    """Where they are missing, and where they are of other channels or not above zero."""
    folder = folders(name)
    three = name == "three"
    place = folder if three else folder.parent / "datasets" / "Mixamo" / "mean_var"
    (file, *_) = sorted(place.glob("humstats.npz" if three else "*23_var.npy"))

    def write(values: np.ndarray) -> None:
        np.savez(file, mean=values, std=values) if three else np.save(file, values)

    write(np.zeros(92 if three else 91))
    with pytest.raises(FileError, match=f"{file.name}: has deviations that are not above 0"):
        _ = method(name, folder).tensors
    write(np.full(92 if three else 91, np.nan))
    with pytest.raises(FileError, match=rf"{file.name}: .* not finite"):
        _ = method(name, folder).tensors
    write(np.ones(12))
    with pytest.raises(FileError, match="is of 12 channels, and the networks of 92"):
        _ = method(name, folder).tensors
    file.write_bytes(b"no array")
    with pytest.raises(FileError, match=f"{file.name}: holds no array"):
        _ = method(name, folder).tensors
    for each in list(place.glob("*.np*")):
        each.unlink()
    with pytest.raises(FileError, match=r"lacks the statistics of .* beside models"):
        _ = method(name, folder).weights_hash


def test_characters_of_other_structures_count_for_none(folders):
    folder = folders("san")
    for file in (folder.parent / "datasets").rglob("*28_*.npy"):
        np.save(file, np.ones(95))
    with pytest.raises(FileError, match="holds no statistics of 111 channels"):
        _ = method("san", folder).tensors


@pytest.mark.parametrize("name", ["san", "pan", "three"])
def test_networks_of_other_trees_are_refused(folders, name):
    """By a bit of a mask, and by the number of channels."""
    folder = folders(name)
    (file, *_) = sorted(folder.rglob("a*e*.pt*"))
    content = torch.load(file)
    last = f"dec.layers.1.{2 if name == 'san' else 1}"
    mask = content[f"{last}.mask"].clone()
    mask.view(-1)[-1] = 1.0 - mask.view(-1)[-1]
    torch.save({**content, f"{last}.mask": mask}, file)
    with pytest.raises(FileError, match=f"{last} has a mask for other joints"):
        _ = method(name, folder).tensors
    torch.save({**content, f"{last}.bias": torch.ones(60)}, file)
    with pytest.raises(FileError, match="writes 60 channels; those of known structures are"):
        _ = method(name, folder).tensors
    torch.save({**content, "enc.another.weight": torch.ones(2)}, file)
    with pytest.raises(FileError, match=r"holds enc\.another\.weight"):
        _ = method(name, folder).tensors
    first = "enc.layers.0.0.bias" if name == "san" else "enc.parameter_part"
    torch.save({**content, first: torch.ones(7)}, file)
    with pytest.raises(FileError, match="has tensors of other sizes"):
        _ = method(name, folder).tensors


def test_networks_of_other_sizes_are_refused(folders, monkeypatch):
    folder = folders("pan")
    monkeypatch.undo()
    with pytest.raises(BenchError, match="of another structure"):
        _ = method("pan", folder).tensors


def test_a_folder_without_an_epoch_is_refused(folders):
    folder = folders("san")
    for each in (folder / "models" / "topology1").iterdir():
        each.rename(each.with_name(f"epoch{each.name}"))
    with pytest.raises(FileError, match="topology1: there is no folder of an epoch"):
        _ = method("san", folder).weights_hash
