"""PAN while it is trained, with any structures and between two legs and four; its weights."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pan_material
import pytest
import torch
import training_material
from method_bodies import dance

from retarget_bench.api import Context
from retarget_bench.errors import BenchError, NotSupported
from retarget_bench.methods.pan import Pan
from retarget_bench.methods.pan.losses import Objective
from retarget_bench.motion.root_rules import MEMORY
from retarget_bench.training.config import TrainingConfig
from retarget_bench.training.layers.skeletal.features import without_bias

BODIES, TWO, THREE = pan_material.BODIES, pan_material.TWO, pan_material.THREE


def terms(module, batch):
    """Of both phases."""
    memory: dict = {}
    return {phase.name: module.losses(phase.name, batch, memory) for phase in module.phases}


def test_windows_backwards_are_what_is_seen_of_the_reversed_motion():
    """Root numbers too: a body that walks backwards, and turns the other way."""
    for root in ("position", "velocity", "height"):
        module = pan_material.training_module(variant="released", root=root, lengths=(16,))
        features, directions = Pan(variant="released", root=root).settings.features, set()
        for seed in range(6):
            for side in training_material.batch(module, seed=seed)["sides"]:
                cast = [name for name in TWO if _structure(name) == module._names[side["structure"]]]
                for row in side["edges"].numpy():
                    directions.add(_direction(row, cast, features))
        assert directions == {"on", "back"}


def _direction(row, cast, features):
    """Whether a window is a clip as it was performed, or backwards."""
    for name in cast:
        motion = dance(pan_material.BODIES[name], 16)
        body = Pan(variant="released").body(BODIES[name])
        for way, shown in (("on", motion), ("back", motion.at(np.arange(16)[::-1]))):
            expected = features.see(shown, body)["edges"]
            same = np.abs(np.abs(row[:, :-1]) - np.abs(expected[:, :-1])).max() < 1e-5
            if same and np.abs(row[:, -1] - expected[:, -1]).max() < 1e-2 * np.abs(expected[:, -1]).max():
                return way
    raise AssertionError("a window that no clip has, forwards or backwards")


def _structure(name):
    return BODIES[name].structure.replace(".", "_")


@pytest.mark.parametrize("frames", [2, 3, 7])
def test_clips_shorter_than_a_window_are_gone_through_there_and_back(frames):
    module = pan_material.training_module(lengths=(frames,))
    side = training_material.batch(module)["sides"][0]
    edges = side["edges"][:, :, :-1].numpy()
    period = max(2 * (frames - 1), 1)
    np.testing.assert_array_equal(edges[:, :-period], edges[:, period:])
    np.testing.assert_array_equal(edges[:, 1], edges[:, period - 1 if frames > 2 else 3])
    losses = terms(module, training_material.batch(module))
    assert all(each.isfinite() for phase in losses.values() for each in phase.values())


# ---------------------------------------------------------------------------------------- structures


def test_structures_without_a_common_end_effector_have_the_term_all_the_same():
    module = pan_material.training_module()
    objective: Objective = module._objective
    first, second = module._names
    none = torch.zeros(0, dtype=torch.long)
    for pair in ((first, second), (second, first)):
        objective._tensors["ends", *pair] = none
    assert terms(module, training_material.batch(module))["generator"]["ends"] > 0  # within structures
    for name in (first, second):
        objective._tensors["ends", name, name] = none
    assert terms(module, training_material.batch(module))["generator"]["ends"] == 0


def test_codes_of_bodies_with_one_arm_are_compared_over_five_parts():
    module = pan_material.training_module(names=("one", "tall", "one_one_armed", "tall_one_armed"))
    objective = module._objective
    names = tuple(module._names)  # one_armed, plain
    assert names == ("one_armed", "plain")
    code = torch.randn(2, 4, 5, 32)
    arranged = torch.cat([code, torch.full((2, 4, 1, 32), 9.0)], 2)  # of the arm that is not there
    objective.begin(torch.device("cpu"))
    objective.compare(names, code, arranged)
    assert objective.total()["latent"].item() == 0.0


# -------------------------------------------------------------------------------------------- weights
def test_structures_are_known_by_their_joints():
    """Weights of more structures, and of other names, serve."""
    tensors = pan_material.training_module(names=THREE, small=True, seed=1).export()
    renamed = {name.replace("plain.", "elsewhere."): each for name, each in tensors.items()}
    module = pan_material.training_module(small=True)
    module.load(renamed)
    for name, each in module.export().items():
        assert torch.equal(each, tensors[name]), name


def test_weights_of_other_structures_and_networks_are_refused():
    module = pan_material.training_module(names=THREE)
    with pytest.raises(
        BenchError, match=r"no structure with the joints of one_armed; they know plain, short"
    ):
        module.load(pan_material.training_module().export())
    with pytest.raises(BenchError, match="the weights do not fit this network"):
        pan_material.training_module().load(
            pan_material.training_module(variant="paper", attention=False).export()
        )


def test_weights_of_other_joints_are_refused():
    tensors = dict(pan_material.training_module().export())
    parents = tensors["plain.parents"].clone()
    parents[-1] = 0
    for odd in ({"plain.parents": parents}, {"plain.roles": tensors["short_spine.roles"]}):
        with pytest.raises(BenchError, match="no structure with the joints of plain"):
            pan_material.training_module().load({**tensors, **odd})


def test_statistics_by_character_are_of_each():
    module = pan_material.training_module(statistics="character")
    structure = module._structures["plain"]
    assert structure.cast == ("one", "tall")
    clips = module._windows._material.clips
    for row, name in enumerate(structure.cast, 1):
        values = np.concatenate([clip.arrays["edges"] for clip in clips[name]]).astype(np.float64)
        np.testing.assert_allclose(structure.mean[row].numpy(), values.mean(axis=0), atol=1e-4)
    assert structure.statistics_row(["tall", "nobody"]) == [2, 0]


# -------------------------------------------------------------------------------------- what is refused
def test_bodies_of_one_structure_with_different_joints_are_named():
    method = Pan()
    odd = replace(BODIES["one_one_armed"], name="odd", structure="plain")
    cast = {**{name: BODIES[name] for name in TWO}, "odd": odd}
    mixed = training_material.training_data(method, cast, (30,))
    with pytest.raises(NotSupported, match="odd and one are both of structure plain and have different"):
        method.training_module(mixed, TrainingConfig(steps=1, batch=4, window=16, rate=1e-3))


@pytest.mark.parametrize("window", [8, 18])
def test_windows_that_networks_cannot_halve_twice(window):
    with pytest.raises(NotSupported, match=f"a multiple of 4 and 16 or more, and not {window}"):
        pan_material.training_module(window=window)


@pytest.mark.parametrize("name", ["keys", "train", "half", "a.b", "their_four_legged"])
def test_structures_of_any_name(name):
    method = Pan()
    cast = {each: replace(BODIES[each], structure=name) for each in TWO[:2]}
    torch.manual_seed(0)
    module = method.training_module(
        training_material.training_data(method, cast, (30,)),
        TrainingConfig(steps=1, batch=4, window=16, rate=1e-3),
    )
    loaded = module.method()
    assert len(loaded.structures) == 1
    assert loaded.supports(cast["one"], cast["tall"]) is None


# ------------------------------------------------------------------------------------------- initialisation
def structures(**parameters):
    return pan_material.training_module(**parameters)._structures


def test_what_structures_share_begins_alike():
    plain, short = structures().values()
    for name, first in plain.encoder.named_parameters():
        second = dict(short.encoder.named_parameters())[name]
        if first.shape == second.shape:
            assert torch.equal(first, second), name
    outputs = [dict(zip(each.layout.roles[1:], _biases(each), strict=True)) for each in (plain, short)]
    both = [role for role in outputs[0] if role and role in outputs[1]]
    assert len(both) > 10
    assert all(torch.equal(outputs[0][role], outputs[1][role]) for role in both)


def test_slots_of_one_role_are_heard_alike():
    plain, short = structures().values()
    heard = [_heard(each) for each in (plain, short)]
    both = heard[0].keys() & heard[1].keys()
    assert ("left_arm", "left_hand") in both
    assert all(torch.equal(heard[0][key], heard[1][key]) for key in both)


def test_published_variants_begin_each_for_itself():
    plain, short = structures(variant="released").values()
    assert not torch.equal(plain.decoder.inner.weight, short.decoder.inner.weight)


def _biases(structure):
    return structure.decoder.outer.bias.detach().view(-1, 4)[:-1]


def _heard(structure):
    """(part, role) -> weights of the convolution from the edges themselves."""
    layout = structure.layout
    weights = structure.encoder.raw.weight.detach()
    blocks, start = {}, 0
    for name, part in zip(layout.names, layout.parts, strict=True):
        for edge in (*part, layout.edges):
            role = "root" if edge == layout.edges else layout.roles[edge + 1]
            blocks[name, role] = weights[start : start + 4]
            start += 4
    return blocks


# -------------------------------------------------------------------------------- between two legs and four
LEGS = pan_material.LEGS
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


def test_positions_are_sums_of_what_roots_move_only_where_roots_say_that():
    released = {
        root: Pan(variant="released", parts="three", root=root) for root in (None, "velocity", "height")
    }
    by_root = {root: each.settings.weights.positions for root, each in released.items()}
    assert by_root == {None: "summed", "velocity": "summed", "height": "world"}


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


@pytest.mark.parametrize(("path", "parts"), [("decoded", "three"), ("carried", "three"), (None, "six")])
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


def test_eq_20_takes_the_range_of_the_training_motion():
    module = pan_material.training_module(LEGS, small=True, parts="three", variant="paper")
    clips = module._windows._material.clips
    for name, cast in ((DOG, ("pup", "rex")), ("plain", ("one", "tall"))):
        speeds = np.concatenate(
            [
                np.linalg.norm(clip.arrays["edges"][:, -1, :3], axis=-1)
                for each in cast
                for clip in clips[each]
            ]
        )
        ranges = module._objective._tensors["speeds", name].numpy()
        np.testing.assert_allclose(ranges, [speeds.min(), speeds.max()], rtol=1e-5)
