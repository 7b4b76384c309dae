"""pmnet: its networks, its losses by their formulas in NumPy, what it learns from and what it answers."""

from __future__ import annotations

import numpy as np
import pytest
import torch
from method_bodies import carried, dance
from nkn_toys import CAST, STRUCTURES, training_module
from scipy.spatial.transform import Rotation
from training_material import batch

from retarget_bench.methods.pmnet import plugin
from retarget_bench.methods.pmnet.network import DROP, Generator
from retarget_bench.methods.pmnet_cross import plugin as PmnetCross
from retarget_bench.motion.body22 import PARENTS
from retarget_bench.training.layers.masks import time_first_mask
from retarget_bench.training.phases import to_device

SMALL = {"hidden": 24, "facing": 3.0}
VARIANTS = {"own": SMALL, "released": {**SMALL, **plugin.card.published[0]}}


def moving(variant: str, rows: int = 6):
    """A training module whose answers turn, without dropout, and a batch of rows of unequal length."""
    module = training_module(plugin(**VARIANTS[variant]), window=30)
    module.modules.eval()
    for each in module.modules["generator"].parameters():
        each.data += 0.1 * torch.randn_like(each)
    for each in module.modules["discriminator"].values():
        each.dropout = 0.0
    drawn = (batch(module, rows, step) for step in range(50))
    return module, next(now for now in drawn if 0 < int(now["groups"][0]["same"].sum()) < rows)


# ------------------------------------------------------------------------------------------ the networks


def test_a_new_network_turns_nothing():
    generator = Generator(22)
    assert generator.turns.bias.tolist() == generator.mapping.bias.tolist() == [1.0, 0.0, 0.0, 0.0] * 22
    turns = generator.eval().solved(torch.randn(2, 3, 512)).detach()
    assert float((turns[..., 0] - 1.0).abs().max()) < 0.05


def test_a_fifth_of_hidden_numbers_is_dropped_while_it_learns():
    """As released: behind three layers of the encoder, and of the target's numbers."""
    assert DROP == 0.2
    torch.manual_seed(0)
    generator = Generator(22).train()
    shares: list[float] = []

    def record_share(module, inputs):
        shares.append(float((inputs[0] == 0).float().mean()))

    with torch.no_grad():
        for layer in generator.encoder:
            layer.weight.fill_(0.01)
            layer.bias.fill_(1.0)
            layer.register_forward_pre_hook(record_share)
        generator.encode(torch.ones(50, 4, 66))
    assert shares[0] == 0.0
    assert shares[1:] == [pytest.approx(0.2, abs=0.01)] * 3


def test_both_sides_learn_with_the_published_momentum():
    """Adam's first beta is 0.5, and gradients are cut to a norm of 25, as in NKN."""
    module, _ = moving("released")
    assert {(phase.betas, phase.clip) for phase in module.phases} == {((0.5, 0.999), 25.0)}


def test_movements_are_two_convolutions_of_three_frames():
    generator = Generator(22, 16)
    first, second = (layer.weight.detach().double().numpy() for layer in generator.movement)
    for layer in generator.movement:
        layer.bias.data.normal_()
    biases = [layer.bias.detach().double().numpy() for layer in generator.movement]
    moves = np.random.default_rng(0).normal(size=(7, 4))

    def convolved(signal, weight, bias):
        ended = np.pad(signal, ((1, 1), (0, 0)))
        return np.array(
            [bias + sum(weight[:, :, k] @ ended[t + k] for k in range(3)) for t in range(len(signal))]
        )

    hidden = convolved(moves, first, biases[0])
    expected = convolved(np.where(hidden > 0, hidden, 0.2 * hidden), second, biases[1])
    rows = torch.zeros(9, 2, 4)
    rows[:7, 0] = torch.from_numpy(moves)
    rows[7:] = 1e3
    moved = generator.moved(rows, time_first_mask(torch.tensor([7, 9]), 9))[:, 0].detach().numpy()
    np.testing.assert_allclose(moved[:7], expected, atol=1e-5)
    assert not moved[7:].any()


# -------------------------------------------------------------------------------------------- the losses
class Plain:
    """A batch carried over by the networks' layers and by kinematics in NumPy: one row at a time."""

    def __init__(self, module, group) -> None:
        self.network, self.group = module.modules["generator"]["body22"], group
        scale = self.network.scale
        self.mean, self.deviation = (
            np.concatenate(
                [getattr(scale, f"{kind}_{what}").double().numpy() for kind in ("places", "moves")]
            )
            for what in ("mean", "deviation")
        )
        self.same = group["same"].numpy()
        self.rows = [self.row(number, int(n)) for number, n in enumerate(group["lengths"])]
        self.frames = int(group["lengths"].sum())

    def row(self, row: int, length: int) -> dict[str, np.ndarray]:
        poses = self.group["poses"][row, :length].double().numpy()
        normalised = (poses - self.mean) / self.deviation
        features = self.encoded(normalised[:, :66])
        solved = self.turned(self.layer("turns", features))
        heights = [
            float(self.group[key][row]) if key in self.group else 0.0
            for key in ("heights", "target_heights")
        ]
        bones = [self.group[key][row].double().numpy() for key in ("bones", "target_bones")]
        sizes = [float(self.group[key][row]) for key in ("sizes", "target_sizes")]
        rest = bones[1].copy()
        rest[0, 1] = heights[1]
        reference = (rest.reshape(-1) - self.mean[:66]) / self.deviation[:66]
        reference = 1.0 / (1.0 + np.exp(-self.layer("reference", reference)))
        reference = np.tile(reference, (length, 1))
        change = self.turned(self.layer("mapping", np.concatenate([features, reference], -1)))
        answers = [[a * b for a, b in zip(*both, strict=True)] for both in zip(solved, change, strict=True)]
        here = [self.kinematics(turns, bones[0], heights[0]) for turns in solved]
        there = [self.kinematics(turns, bones[1], heights[1]) for turns in answers]
        here, there = ((np.array(x) - self.mean[:66]) / self.deviation[:66] for x in (here, there))
        walked = normalised[:, 66:] / np.array([*[sizes[0]] * 3, 1.0])
        with torch.no_grad():
            inputs = torch.from_numpy(walked).float()[:, None]
            walks = self.network.moved(inputs, torch.ones(length, 1))[:, 0].double().numpy()
        moved = walks * np.array([*[sizes[1]] * 3, 1.0])
        return {
            "seen": normalised, "features": features, "solved": solved, "answers": answers, "here": here,
            "there": there, "walked": walked, "walks": walks, "sizes": sizes,
            "given": np.concatenate([there, moved], -1),
        }  # fmt: skip

    def layer(self, name: str, inputs: np.ndarray) -> np.ndarray:
        layer = self.network.get_submodule(name)
        return inputs @ layer.weight.detach().double().numpy().T + layer.bias.detach().double().numpy()

    def encoded(self, places: np.ndarray) -> np.ndarray:
        for number in range(4):
            places = np.maximum(self.layer(f"encoder.{number}", places), 0.0)
        return places

    def turned(self, numbers: np.ndarray) -> list[list[Rotation]]:
        return [
            [Rotation.from_quat(each[[1, 2, 3, 0]]) for each in frame.reshape(22, 4)] for frame in numbers
        ]

    def kinematics(self, turns: list[Rotation], bones: np.ndarray, height: float) -> np.ndarray:
        places, turned = [np.array([0.0, height, 0.0])], [turns[0]]
        for joint in range(1, 22):
            places.append(places[PARENTS[joint]] + turned[PARENTS[joint]].apply(bones[joint]))
            turned.append(turned[PARENTS[joint]] * turns[joint])
        return np.concatenate(places)

    def trajectory(self, poses: np.ndarray, size: float, variant: str) -> np.ndarray:
        """The mean of all joints in the world, step by step, in heights; ``released``: normalised."""
        if variant == "own":
            poses = poses * self.deviation + self.mean
            size *= 100.0
        place, yaw, places = np.zeros(3), 0.0, []
        for frame, pose in enumerate(poses):
            if variant == "own" and frame:
                yaw += pose[69]
                place = place + Rotation.from_euler("Y", yaw).apply(pose[66:69])
            middle = Rotation.from_euler("Y", yaw).apply(pose[:66].reshape(22, 3).mean(0))
            places.append((middle + place) / size)
            if variant == "released":
                yaw += pose[69]
                place = place + Rotation.from_euler("Y", yaw).apply(pose[66:69])
        return np.array(places)

    def judged(self, module, which: str, variant: str) -> np.ndarray:
        size = 0 if which == "seen" else 1
        paths = [self.trajectory(row[which], row["sizes"][size], variant) for row in self.rows]
        padded = np.zeros((len(paths), max(map(len, paths)), 3))
        for row, path in enumerate(paths):
            padded[row, : len(path)] = path
        with torch.no_grad():
            logits = module.modules["discriminator"]["body22"](
                torch.from_numpy(padded).float(), torch.zeros(len(paths), 0), self.group["lengths"]
            )
        return logits.double().numpy()


def twisted(turns: list[Rotation]) -> float:
    beyond = [max(0.0, abs(each.as_euler("YZX")[0]) - np.radians(100.0)) for each in turns[1:]]
    return float(np.mean(np.square(beyond)))


@pytest.mark.parametrize("variant", ["own", "released"])
def test_every_term_is_its_formula(variant):
    module, now = moving(variant)
    (group,), memory = now["groups"], {}
    terms = {name: each.item() for name, each in module.losses("generator", now, memory).items()}
    plain = Plain(module, group)
    emphasis = np.ones(22)
    emphasis[[7, 8, 11, 12, 15, 16, 19, 20]] = 2.0

    def places(row, key) -> float:
        squares = (row[key] - row["seen"][:, :66]).reshape(-1, 22, 3) ** 2
        return float((squares.sum(-1) @ emphasis).sum())

    own_rows = [row for row, same in zip(plain.rows, plain.same, strict=True) if same]
    others = [row for row, same in zip(plain.rows, plain.same, strict=True) if not same]
    own = sum(len(row["seen"]) for row in own_rows)
    twists = sum(
        twisted(turns) for row in plain.rows for key in ("solved", "answers") for turns in row[key]
    )
    logits = plain.judged(module, "given", variant)
    expected = {
        "places": sum(places(row, "here") for row in plain.rows) / plain.frames,
        "same_places": sum(places(row, "there") for row in own_rows) / own,
        "same_moves": sum(float(((row["walks"] - row["walked"]) ** 2).sum()) for row in own_rows) / own,
        "twist": 10.0 * twists / plain.frames,
        "features": 20.0
        * sum(float(((row["features"] - plain.encoded(row["there"])) ** 2).sum()) for row in others)
        / plain.frames,
        "adversarial": 2.0 * np.log1p(np.exp(-logits[~plain.same])).mean(),
    }
    assert min(expected.values()) > 0.0
    assert terms == pytest.approx(expected, rel=1e-3)
    loss = module.losses("discriminator", now, memory)["cross_entropy"].item()
    real = plain.judged(module, "seen", variant)
    assert loss == pytest.approx(np.log1p(np.exp(-real)).mean() + np.log1p(np.exp(logits)).mean(), rel=1e-3)


def test_presets_are_the_papers_and_smaller_ones():
    paper = plugin.presets["paper"]
    assert (paper.steps, paper.batch, paper.window, paper.rate) == (15_000, 16, 60, 1e-4)


# -------------------------------------------------------------------------------------------- retargeting
@pytest.mark.parametrize("variant", ["own", "released"])
def test_movements_that_are_kept_are_scaled_by_heights_alone(variant):
    """With the identity for its movement network, lengths in the world's unit and no mean, an answer goes
    as far as the source does, times the ratio of heights along the bones."""
    module = training_module(plugin(**{**VARIANTS[variant], "lengths": "world"}))
    network = module.modules["generator"]["body22"]
    network.scale.moves_mean.zero_()
    first, second = network.movement
    for layer in (first, second):
        layer.weight.data.zero_()
    for k in range(4):  # a leaky ReLU of x less that of -x is 1.2 x
        first.weight.data[2 * k, k, 1], first.weight.data[2 * k + 1, k, 1] = 1.0, -1.0
        second.weight.data[k, 2 * k, 1], second.weight.data[k, 2 * k + 1, 1] = 1 / 1.2, -1 / 1.2
    source, target = dance(CAST["one"], 30), CAST["small"]
    integrated = plugin(**{**VARIANTS[variant], "lengths": "world", "path": "integrated"})
    answer = carried(integrated.using(module.export()), source, target)
    np.testing.assert_allclose(np.diff(answer.root, axis=0), 0.6 * np.diff(source.root, axis=0), atol=1e-5)


# --------------------------------------------------------------------------------------- between structures
SMALL_CROSS = {"hidden": 12, "facing": 3.0}


@pytest.fixture(scope="module")
def module():
    built = training_module(PmnetCross(**SMALL_CROSS), cast=STRUCTURES)
    for each in built.modules["generator"].parameters():
        each.data += 0.1 * torch.randn_like(each)
    return built


def group_of(module, crossing: bool):
    drawn = (module.draw(np.random.default_rng(seed), 4)["groups"] for seed in range(50))
    chosen = next(
        group
        for groups in drawn
        for group in groups
        if (group["structures"][0] != group["structures"][1]) == crossing
    )
    return to_device(chosen, torch.device("cpu"))


def test_rows_of_two_structures_are_held_to_features_and_ends(module):
    crossing, within = ({"groups": [group_of(module, kind)]} for kind in (True, False))
    terms = {name: each.item() for name, each in module.losses("generator", crossing, {}).items()}
    assert terms["same_places"] == terms["same_moves"] == 0.0
    assert min(terms[name] for name in ("places", "features", "adversarial", "ends", "ends_moves")) > 0.0
    other = module.losses("generator", within, {})
    assert list(other) == list(terms)
    assert other["ends"].item() == other["ends_moves"].item() == 0.0
    assert training_module(PmnetCross(**SMALL_CROSS, ends=0.0), cast=STRUCTURES).ends is None


def test_gradients_of_a_crossing_row_reach_the_heads_of_the_target_alone(module):
    group = group_of(module, True)
    source, target = (module.modules["generator"][module._names[k]] for k in group["structures"])
    module.losses("generator", {"groups": [group]}, {})["features"].backward()
    assert float(target.mapping.weight.grad.abs().max()) > 0.0
    assert source.mapping.weight.grad is None
    assert float(source.encoder[0].weight.grad.abs().max()) > 0.0
    module.modules.zero_grad(set_to_none=True)


def test_sources_are_real_to_the_discriminator_of_their_own_structure(module):
    group, memory = group_of(module, True), {}
    module.losses("generator", {"groups": [group]}, memory)
    module.losses("discriminator", {"groups": [group]}, memory)["cross_entropy"].backward()
    answered = module._names[group["structures"][1]]
    for name, network in module.modules["discriminator"].items():
        learned = network.last.weight.grad is not None
        assert learned == (name == answered)  # the other has judged no answer, so its score stays
    module.modules.zero_grad(set_to_none=True)
