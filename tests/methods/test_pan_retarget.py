"""PAN as a method: any length, in pieces, in batches; who is refused, and whose statistics count."""

from __future__ import annotations

import method_bodies
import numpy as np
import pan_material
import pytest
import torch
from method_bodies import apart, carried, dance

from retarget_bench.errors import NotSupported
from retarget_bench.methods.pan import Pan

BODIES = pan_material.BODIES


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
        source = dance(BODIES[name], 20)
        assert np.isfinite(carried(method, source, odd).positions).all()
    assert method.supports(odd, BODIES["one"]) is None


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
    source = dance(BODIES["one"], 5)
    positions = source.character.positions(source.positions, 30.0)
    with pytest.raises(NotSupported, match="known by positions only"):
        carried(method, positions, BODIES["tall"])
    assert "pan[parts=three] is for bodies of two and of four" in Pan().unfit(BODIES["rex"])
    assert Pan().unfit(BODIES["one"]) == ""
    assert Pan(parts="three").unfit(BODIES["rex"]) == ""


def test_what_a_parameter_says_wins_over_the_variant():
    settings = Pan(variant="paper", cycle=0.0, root="height", facing=2.0, kinematic=10.0).settings
    assert (settings.weights.cycle, settings.features.root, settings.features.facing) == (
        0.0,
        "height",
        2.0,
    )
    assert (settings.weights.kinematic, settings.weights.again_positions) == (10.0, 10.0)
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
    source, motions = dance(BODIES["one"], 20), [dance(BODIES["legs"], 50)]
    leaked = carried(leaking, source, BODIES["legs"], target_motions=motions)
    other = carried(leaking, source, BODIES["legs"], target_motions=[m.at(slice(0, 9)) for m in motions])
    assert apart(leaked, other) > 1e-3
    alone = carried(plain, source, BODIES["legs"], target_motions=motions)
    assert apart(alone, carried(plain, source, BODIES["legs"])) == 0.0
    with pytest.raises(NotSupported, match="no motion of legs to take statistics of"):
        carried(leaking, source, BODIES["legs"])


def test_statistics_of_known_characters_are_their_own():
    method = pan_material.trained(statistics="character")
    structure = method.structures["plain"]
    assert structure.cast == ("one", "tall")
    assert not torch.equal(structure.mean[1], structure.mean[2])
