"""Retargeting by SAME: the authors' own pairs, any bodies, lengths and rates, and their weights."""

from __future__ import annotations

import numpy as np
import pytest
import same_material
import torch
from method_bodies import dance

from retarget_bench.api import Context
from retarget_bench.errors import BenchError, FileError
from retarget_bench.methods.same import Same
from retarget_bench.methods.same.inference import retargeted
from retarget_bench.methods.same.released import MODEL, STATISTICS
from retarget_bench.motion import facing, rotation
from retarget_bench.plugins import bound
from retarget_bench.plugins.spec import Spec

BODIES = same_material.BODIES


# ------------------------------------------------------------------------------------------ the authors'
@pytest.mark.parametrize("pair", same_material.PAIRS)
def test_the_whole_way_is_the_authors(real_data, tmp_path, pair) -> None:
    """From two files to where all joints are, up to where the path begins; centimetres."""
    arrays = same_material.oracle(real_data)
    source, target = (
        same_material.standing(real_data / "same_pairs" / name) for name in arrays[f"{pair}/files"]
    )
    source = source.at(slice(41))  # the authors leave out the first frame, which has no frame before it
    answer = retargeted(same_material.released(arrays, tmp_path), source, target.character)
    target_names = arrays[f"{pair}/target/names"].tolist()
    names = [name for name in target_names if not name.endswith("_End")]
    expected = arrays[f"{pair}/output/world_positions"][:, [target_names.index(name) for name in names]]
    actual = 100 * answer.positions[1:, [target.skeleton.index(name) for name in names]]
    level = [each - each[:1, :1] * [1, 0, 1] for each in (actual, expected)]
    paths = [(each[..., 2] + 1j * each[..., 0]).ravel() for each in level]
    turn = np.vdot(*paths)
    placed = facing.placed(level[0], turn / abs(turn))
    assert np.linalg.norm(placed - level[1], axis=-1).max() < 0.01


def test_released_files_are_read_and_known_by_what_they_hold(real_data, tmp_path) -> None:
    arrays = same_material.oracle(real_data)
    folder = same_material.write_released(arrays, tmp_path)
    method = Same(weights=str(folder))
    assert method.supports(BODIES["plain"], BODIES["small"]) is None
    assert method.weights_label == f"authors-{method.weights_hash[:8]}"
    assert Same.card_of(str(folder))["hash"] == method.weights_hash
    assert Same(weights=str(folder / MODEL)).weights_hash == method.weights_hash  # a file for its folder
    answer = method.retarget(dance(BODIES["plain"]), BODIES["small"], context=Context())
    assert np.isfinite(answer.positions).all()
    stored = torch.load(folder / STATISTICS, weights_only=True)
    torch.save(stored | {"q_m": stored["q_m"] + 1}, folder / STATISTICS)
    assert Same(weights=str(folder)).weights_hash != method.weights_hash


def test_files_that_are_not_the_authors_are_refused_in_a_sentence(tmp_path) -> None:
    statistics = {f"{part}_{kind}": torch.ones(6) for part in ("lo", "go") for kind in "ms"}
    torch.save(statistics, tmp_path / STATISTICS)
    with pytest.raises(FileError, match=f"lacks {MODEL}; SAME needs both"):
        Same(weights=str(tmp_path)).supports(BODIES["plain"], BODIES["small"])
    for wrong, message in (
        ([1, 2], "holds something else than named tensors"),
        ({3: torch.ones(2)}, "holds something else than named tensors"),
        ({"weights": 1}, "holds no network of SAME's"),
        ({"model": {}}, "lacks SAME's statistics q_m, p_m"),
    ):
        torch.save(wrong, tmp_path / MODEL)
        with pytest.raises(FileError, match=message):
            _ = Same(weights=str(tmp_path)).tensors
    torch.save({"model": {"encoder.0.convs.3.bias": torch.full((16,), torch.inf)}}, tmp_path / MODEL)
    with pytest.raises(FileError, match=rf"{MODEL}: encoder\.0\.convs\.3\.bias .*not finite"):
        _ = Same(weights=str(tmp_path)).tensors
    torch.save({"model": {}}, tmp_path / MODEL)
    parts = ("lo", "go", "q", "p", "r", "pv", "qv", "pprev")
    statistics |= {f"{part}_{kind}": torch.ones(6) for part in parts for kind in "ms"}
    torch.save({**statistics, "r_s": torch.full((4,), torch.nan)}, tmp_path / STATISTICS)
    with pytest.raises(FileError, match=f"{STATISTICS}: r_s .*not finite"):
        _ = Same(weights=str(tmp_path)).tensors


def test_another_network_under_the_authors_names_is_refused(real_data, tmp_path) -> None:
    arrays = dict(same_material.oracle(real_data))
    del arrays["state/encoder.0.convs.3.bias"]
    folder = same_material.write_released(arrays, tmp_path)
    with pytest.raises(BenchError, match=r"encoder\.3\.bias is missing"):
        Same(weights=str(folder)).retarget(dance(BODIES["plain"]), BODIES["small"], context=Context())


# ------------------------------------------------------------------------------------ bodies and lengths
def test_dogs_and_rigs_of_puppets() -> None:
    cast = bound.dataset(Spec.parse("puppets")).built.characters()
    method = same_material.trained()
    for name in ("fox", "hugo", "dora"):
        assert method.supports(cast[name], cast["fox"]) is None
        answer = method.retarget(dance(cast[name], 12), cast["fox"], context=Context())
        assert np.isfinite(answer.positions).all()


def test_errors_of_a_relative_path_fade_and_those_of_an_integrated_one_add_up() -> None:
    source = dance(BODIES["plain"], 300)
    ratio = BODIES["small"].measures.hip_height / BODIES["plain"].measures.hip_height
    away = {}
    for path in ("relative", "integrated"):
        answer = same_material.trained(path=path).retarget(source, BODIES["small"], context=Context())
        away[path] = np.linalg.norm((answer.root - ratio * source.root)[:, [0, 2]], axis=-1)
        assert away[path][0] < 1e-9
    growth = {path: each[150:].max() / each[:50].max() for path, each in away.items()}
    assert growth["relative"] < 1.5
    assert growth["integrated"] > 3.0


def test_where_the_source_stands_and_faces_is_where_the_answer_does() -> None:
    method, source = same_material.trained(), dance(BODIES["plain"])
    turn = rotation.about(np.array([0.0, 1.0, 0.0]), 1.9)
    rotations = source.rotations.copy()
    rotations[:, 0] = rotation.multiply(turn, rotations[:, 0])
    moved = source.character.motion(rotations, rotation.rotate(turn, source.root), source.fps)
    one, other = (method.retarget(each, BODIES["small"], context=Context()) for each in (source, moved))
    np.testing.assert_allclose(rotation.rotate(turn, one.positions), other.positions, atol=1e-4)
