"""PAN between two legs and four (section 7): three parts, arms and tails decoded only, eq. 20."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pan_material
import pytest
import torch
import training_material
from method_bodies import dance

from retarget_bench.api import Context
from retarget_bench.methods.pan import Pan
from retarget_bench.motion.root_rules import MEMORY
from retarget_bench.training.layers.skeletal.features import without_bias

BODIES, LEGS = pan_material.BODIES, pan_material.LEGS
DOG = "dog_four_legged"


@pytest.mark.parametrize("variant", ["own", "released", "paper"])
def test_arms_and_tails_are_decoded_and_not_encoded(variant):
    module = pan_material.training_module(LEGS, small=True, parts="three", variant=variant)
    for name, left_out in ((DOG, {"tail_1", "tail_2"}), ("plain", {"left_hand", "right_arm"})):
        structure = module._structures[name]
        layout = structure.layout
        hidden = np.flatnonzero(~layout.encoded[layout.leads])
        assert left_out <= {layout.roles[layout.leads[edge]] for edge in hidden}
        motion = torch.randn(1, 16, layout.edges + 1, 4)
        code = structure.encoder(motion)
        changed = motion.clone()
        changed[:, :, hidden] += 3.0
        assert torch.equal(structure.encoder(changed), code)
        bones = torch.randn(1, layout.edges + 1, 3)
        answer = structure.answer(code, bones)[:, :, hidden]
        other = structure.answer(code + 1.0, bones)[:, :, hidden]
        assert (answer - other).abs().flatten(0, 1).amax((0, 2)).min() > 1e-3, (
            "every one of them is decoded"
        )


def test_losses_are_over_common_parts_only():
    """What arms and tails do changes no loss but what discriminators say."""
    module = pan_material.training_module(LEGS, small=True, parts="three", variant="paper")
    batch = training_material.batch(module)
    before = module.losses("generator", batch, {})
    for side in batch["sides"]:
        layout = module._structures[module._names[side["structure"]]].layout
        hidden = np.flatnonzero(~layout.encoded[layout.leads])
        side["edges"][:, :, hidden] = torch.randn_like(side["edges"][:, :, hidden])
    memory: dict = {}
    after = module.losses("generator", batch, memory)
    assert {name: term.item() for name, term in after.items()} == pytest.approx(
        {name: term.item() for name, term in before.items()}, rel=1e-6
    )
    assert memory["shown"], "discriminators see whole bodies"


@pytest.mark.parametrize("turns", [False, True])
def test_eq_20_in_a_step(turns):
    """Eq. 20 by hand: rescaled velocities of sources and answers; the released code adds their turns."""
    module = pan_material.training_module(LEGS, small=True, parts="three", variant="paper")
    objective = module._objective
    objective.weights = replace(objective.weights, turns=turns)
    batch = training_material.batch(module)
    names = [module._names[side["structure"]] for side in batch["sides"]]
    real = [module._real(name, side) for name, side in zip(names, batch["sides"], strict=True)]
    codes = [module._structures[name].encoder(each.edges) for name, each in zip(names, real, strict=True)]
    squares = []
    for there, side in enumerate(batch["sides"]):
        answers = module._answers(names, there, codes, side, real)
        for here in (0, 1):
            moves = [each.plain[:, :, -1].detach().numpy() for each in (real[here], answers[here])]
            ranges = [objective._tensors["speeds", names[k]].numpy() for k in (here, there)]
            scaled = [_rescaled(m[..., :3], *r) for m, r in zip(moves, ranges, strict=True)]
            square = np.mean((scaled[0] - scaled[1]) ** 2)
            squares.append(square + turns * np.mean((moves[0][..., 3] - moves[1][..., 3]) ** 2))
    loss = module.losses("generator", batch, {})["velocity"].item()
    assert loss == pytest.approx(1000.0 * np.mean(squares), rel=1e-4)


def _rescaled(velocity, low, high):
    speed = np.linalg.norm(velocity, axis=-1, keepdims=True)
    return velocity / speed * (speed - low) / (high - low)


@pytest.mark.parametrize(("path", "parts"), [("decoded", "three"), ("carried", "three"), ("", "six")])
def test_paths_are_decoded_or_the_source_s(path, parts):
    """A decoder that says nothing: its answer goes at the mean pace of training, or as the source goes."""
    bodies = LEGS if parts == "three" else pan_material.TWO
    module = pan_material.training_module(bodies, parts=parts, path=path)
    for each in module._structures.values():
        for weights in each.decoder.parameters():
            torch.nn.init.zeros_(weights)
    motion = dance(pan_material.BODIES["one"], 30)
    answer = module.method().retarget(motion, BODIES["tall"], context=Context())
    ratio = BODIES["tall"].measures.hip_height / BODIES["one"].measures.hip_height
    paces = np.linalg.norm(np.diff(answer.root[:, [0, 2]], axis=0), axis=1)
    if path == "decoded":
        assert np.ptp(answer.root[:, 1]) < 1e-5, "hips stay as high as those of training are in the mean"
        np.testing.assert_allclose(paces, paces.mean(), rtol=1e-4)
    else:
        np.testing.assert_allclose(answer.root, ratio * motion.root, atol=1e-4)


def test_steady_paths_forget_what_differs_for_long():
    """Wherever its steps are too long by the same, the path is the source's; what it adds else fades."""
    random = np.random.default_rng(0)
    lead = random.normal(size=(300, 3)).cumsum(0)
    drifting = lead + 0.02 * np.arange(300)[:, None] * [1.0, 0.0, -2.0]
    np.testing.assert_allclose(without_bias(drifting, lead, 30.0), lead, atol=1e-12)
    np.testing.assert_array_equal(without_bias(lead[:1] + 1.0, lead[:1], 30.0), lead[:1])
    drifted = np.where(np.arange(300)[:, None] < 100, lead, drifting - 2.0 * np.array([1.0, 0.0, -2.0]))
    off = np.abs(without_bias(drifted, lead, 30.0) - lead).max(1)
    assert off[:100].max() < 1e-12
    assert off[100:130].max() > 0.02
    assert off[-100:].max() < 1e-4, "a new velocity is forgotten too"
    step = lead + (np.arange(300)[:, None] >= 100) * np.array([0.0, 0.1, 0.0])
    sums, keep = without_bias(step, lead, 30.0)[:, 1] - lead[:, 1], np.exp(-1.0 / (30.0 * MEMORY))
    # a single step of a tenth, less its own mean, which lasts as long
    after = np.arange(200.0)
    expected = 0.1 * keep**after * (1.0 - (1.0 - keep) / keep * after)
    np.testing.assert_allclose(sums[100:], expected, atol=1e-12)


def test_steady_paths_need_no_weights_of_their_own():
    one, other = Pan(parts="three"), Pan(parts="three", path="steady")
    assert one.facts() == other.facts()
    motion = dance(pan_material.BODIES["rex"], 90)
    relative, steady = (each.retarget(motion, BODIES["one"], context=Context()) for each in (one, other))
    np.testing.assert_array_equal(relative.rotations, steady.rotations)
    lead = motion.root * BODIES["one"].measures.hip_height / BODIES["rex"].measures.hip_height
    far = [np.linalg.norm(each.root - lead, axis=1)[30:].mean() for each in (relative, steady)]
    assert far[1] < 0.5 * far[0]
