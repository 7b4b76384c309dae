"""PAN as a method: any length, in pieces, in batches; who is refused, and whose statistics count."""

from __future__ import annotations

import method_bodies
import numpy as np
import pan_material
import pytest
import torch

from retarget_bench.api import Context
from retarget_bench.errors import BenchError, NotSupported
from retarget_bench.methods.pan import Pan
from retarget_bench.training.layers.skeletal import inference
from retarget_bench.training.layers.skeletal.inference import answered

BODIES = pan_material.BODIES


def carried(method, source, target, **context):
    return method.retarget(source, target, context=Context(**context))


def apart(one, other) -> float:
    """In heights."""
    return float(np.abs(one.positions - other.positions).max()) / one.character.height


def test_a_batch_gives_what_its_rows_give_alone():
    method = pan_material.trained()
    cases = [("one", 40, "legs"), ("legs", 21, "tall"), ("tall", 40, "stout"), ("one", 40, "stout")]
    sources = [pan_material.dances(name, (frames,))[0] for name, frames, _ in cases]
    targets = [BODIES[target] for *_, target in cases]
    contexts = [Context() for _ in cases]
    found = method.retarget_batch(sources, targets, contexts=contexts)
    turned = method.retarget_batch(sources[::-1], targets[::-1], contexts=contexts)[::-1]
    for source, target, one, other in zip(sources, targets, found, turned, strict=True):
        alone = carried(method, source, target)
        assert (one.frames, one.fps) == (source.frames, source.fps)
        assert one.character is target
        assert apart(alone, one) < 1e-5
        assert apart(alone, other) < 1e-5


def test_pieces_give_what_the_whole_gives(monkeypatch):
    method = pan_material.trained()
    structures = method.structures
    edges = np.random.default_rng(0).normal(size=(1, 401, 22, 4)).astype(np.float32)
    numbers = np.random.default_rng(1)
    bones = tuple(numbers.normal(size=(1, slots, 3)).astype(np.float32) for slots in (22, 21))
    known = (structures[name] for name in ("plain", "short_spine"))
    statistics = tuple(torch.stack([each.mean[:1], each.deviation[:1]], 1) for each in known)

    def answer():
        return answered(structures["plain"], structures["short_spine"], edges, bones, statistics, False)

    whole = answer()
    assert whole.shape == (1, 401, 21, 4)
    for piece in (64, 128, 200):
        monkeypatch.setattr(inference, "PIECE", piece)
        np.testing.assert_allclose(answer(), whole, atol=1e-5 * np.abs(whole).max())


@pytest.mark.parametrize(
    ("frames", "fps"), [*((n, 30.0) for n in (1, 2, 3, 5, 15, 16, 17, 70)), (31, 60.0), (2, 24.0)]
)
def test_any_length_and_rate(frames, fps):
    method = pan_material.trained()
    source = pan_material.dances("one", (frames,))[0]
    source = source.character.motion(source.rotations, source.root, fps)
    found = carried(method, source, BODIES["legs"])
    assert (found.frames, found.fps) == (frames, fps)
    assert np.isfinite(found.positions).all()


def test_bodies_without_training_go_through_what_is_nearest():
    method = pan_material.trained()
    odd = pan_material.without(method_bodies.body("odd"), "LeftToe", "RightToe", structure="odd")
    assert method.assignment(odd).structure == "plain"
    assert (
        method.assignment(pan_material.without(BODIES["legs"], "LeftToe", structure="odd")).structure
        == "short_spine"
    )
    assert method.assignment(BODIES["one_one_armed"]).structure == "plain"
    for name in ("one", "one_one_armed"):
        (source,) = pan_material.dances(name, (20,))
        assert np.isfinite(carried(method, source, odd).positions).all()
    assert method.supports(odd, BODIES["one"]) is None


def test_structures_with_five_common_parts():
    method = pan_material.trained(pan_material.THREE)
    assert method.assignment(BODIES["one_one_armed"]).structure == "one_armed"
    for source, target in (("one", "one_one_armed"), ("one_one_armed", "tall")):
        (motion,) = pan_material.dances(source, (20,))
        assert np.isfinite(carried(method, motion, BODIES[target]).positions).all()


# ----------------------------------------------------------------------------------------- refusals
def test_refusals_are_sentences():
    method = pan_material.trained()
    assert "rex stands on four legs, and these weights know no such body" in method.supports(
        BODIES["rex"], BODIES["one"]
    )
    legless = pan_material.without(
        BODIES["one"],
        "LeftUpLeg",
        "LeftLeg",
        "LeftFoot",
        "LeftToe",
        "RightUpLeg",
        "RightLeg",
        "RightFoot",
        "RightToe",
        structure="legless",
    )
    why = method.supports(legless, BODIES["one"])
    assert why
    with pytest.raises(NotSupported, match=r"one"):
        carried(method, method_bodies.pose(legless, 5, {}, np.zeros((5, 3))), BODIES["one"])
    (source,) = pan_material.dances("one", (5,))
    positions = source.character.positions(source.positions, 30.0)
    with pytest.raises(NotSupported, match="known by positions only"):
        carried(method, positions, BODIES["tall"])
    assert "pan[parts=three] is for bodies of two and of four" in Pan().unfit(BODIES["rex"])
    assert Pan().unfit(BODIES["one"]) == ""
    assert Pan(parts="three").unfit(BODIES["rex"]) == ""


@pytest.mark.parametrize(
    ("odd", "problem"),
    [
        ({"dropout": 1.0}, "dropout of pan is a share below 1"),
        ({"dropout": float("nan")}, "dropout of pan is a share below 1"),
        ({"kinematic": float("inf")}, "finite"),
        ({"facing": float("nan")}, "finite"),
        ({"target_stats": "own"}, "needs statistics=character"),
        ({"velocity": 1.0, "root": "position"}, "root=position does not say it"),
        ({"parts": "three", "root": "position"}, "root=position does not say it"),
    ],
)
def test_parameters_that_cannot_be(odd, problem):
    with pytest.raises(BenchError, match=problem):
        Pan(**odd)


def test_what_a_parameter_says_wins_over_the_variant():
    found = Pan(variant="paper", cycle=0.0, root="height", facing=2.0, kinematic=10.0).settings
    assert (found.weights.cycle, found.features.root, found.features.facing) == (0.0, "height", 2.0)
    assert (found.weights.kinematic, found.weights.again_positions) == (10.0, 10.0)
    without = Pan(kinematic=0.0).settings.weights
    assert (without.kinematic, without.again_positions, without.root) == (0.0, 0.0, 0.0)


# --------------------------------------------------------------------------------------- statistics
def test_statistics_of_the_target_are_privileged_and_change_the_answer():
    plain = Pan(statistics="character")
    leaking = Pan(statistics="character", target_stats="own")
    assert plain.card.needs == ()
    assert leaking.card.needs == ("target_motions",)
    assert plain.facts() == leaking.facts(), "the same weights serve both"
    tensors = pan_material.trained(statistics="character").tensors
    plain, leaking = plain.using(tensors), leaking.using(tensors)
    (source,), motions = pan_material.dances("one", (20,)), pan_material.dances("legs", (50,))
    seen = carried(leaking, source, BODIES["legs"], target_motions=motions)
    other = carried(leaking, source, BODIES["legs"], target_motions=[m.at(slice(0, 9)) for m in motions])
    assert apart(seen, other) > 1e-3
    alone = carried(plain, source, BODIES["legs"], target_motions=motions)
    assert apart(alone, carried(plain, source, BODIES["legs"])) == 0.0
    with pytest.raises(NotSupported, match="no motion of legs to take statistics of"):
        carried(leaking, source, BODIES["legs"])


def test_statistics_of_known_characters_are_their_own():
    method = pan_material.trained(statistics="character")
    structure = method.structures["plain"]
    assert structure.cast == ("one", "tall")
    assert not torch.equal(structure.mean[1], structure.mean[2])
