"""pmnet: its networks, its losses by their formulas in NumPy, what it learns from and what it answers."""

from __future__ import annotations

import numpy as np
import pytest
import torch
from method_bodies import carried, dance
from nkn_toys import CAST, training_module
from scipy.spatial.transform import Rotation
from training_material import batch

from retarget_bench.methods.pmnet import losses, plugin
from retarget_bench.methods.pmnet.network import DROP, Generator, divided
from retarget_bench.motion.body22 import PARENTS
from retarget_bench.motion.structures import BODY22
from retarget_bench.training.layers.masks import time_first_mask

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
def test_the_networks_have_the_parameters_of_record():
    module = training_module(plugin())
    counts = [
        sum(each.numel() for each in module.modules[name].parameters())
        for name in ("generator", "discriminator")
    ]
    assert counts == [918_244, 27_569]


def test_a_new_network_turns_nothing():
    generator = Generator(22)
    assert generator.turns.bias.tolist() == generator.mapping.bias.tolist() == [1.0, 0.0, 0.0, 0.0] * 22
    turns = generator.eval().solved(torch.randn(2, 3, 512)).detach()
    assert float((turns[..., 0] - 1.0).abs().max()) < 0.05


def test_poses_go_through_one_by_one():
    generator = Generator(22, 16).eval()
    places = torch.randn(5, 3, 66)
    others = torch.randn(5, 3, 66)
    others[2] = places[2]  # as many poses, so that matrix products round alike
    np.testing.assert_array_equal(
        generator.encode(places)[2].detach(), generator.encode(others)[2].detach()
    )


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


def test_joints_of_knees_feet_and_arms_weigh_twice():
    assert [rank for rank, weight in enumerate(losses.emphasis(BODY22)) if weight == 2.0] == [
        *(7, 8, 11, 12),
        *(15, 16, 19, 20),
    ]


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


def test_movements_are_divided_by_sizes_and_turns_are_not():
    moves = divided(torch.ones(3, 2, 4), torch.tensor([[2.0], [4.0]]))
    assert moves[1].tolist() == [[0.5, 0.5, 0.5, 1.0], [0.25, 0.25, 0.25, 1.0]]


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
