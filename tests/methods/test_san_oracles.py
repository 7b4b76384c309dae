"""SAN's networks and one training step beside what the authors' code answers with the same weights."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

import authors_files
import numpy as np
import pytest
import torch
from san_reference import PlainDiscriminator
from torch import Tensor
from training_material import single_precision

from retarget_bench.methods.san import San, released
from retarget_bench.methods.san.network import Design, Discriminator
from retarget_bench.methods.san.skeleton import layout_of
from retarget_bench.methods.san.structure import Structure
from retarget_bench.methods.san.training import SanTraining
from retarget_bench.motion.character import Character
from retarget_bench.motion.skeleton import Skeleton
from retarget_bench.training.config import TrainingConfig
from retarget_bench.training.data import ClipArrays, TrainingData
from retarget_bench.training.layers.skeletal.body import LayoutBody, aligned
from retarget_bench.training.layers.skeletal.discriminators import discriminator_loss
from retarget_bench.training.layers.skeletal.kinematics import Kinematics, world
from retarget_bench.training.layers.skeletal.released import SavedNetwork

BOTH = ("S23", "S28")
RELEASED = Design("released", padded=True)


class Oracle:
    """Arrays of a file of the authors' answers, as tensors."""

    def __init__(self, path: Path) -> None:
        self.arrays = np.load(path, allow_pickle=False)
        self.names = tuple(self.arrays.files)

    def __getitem__(self, name: str) -> Any:
        array = self.arrays[name]
        return torch.from_numpy(array) if array.dtype.kind == "f" else array


@cache
def _oracle(folder: Path, name: str) -> Oracle:
    return Oracle(folder / f"san_{name}.npz")


@pytest.fixture(scope="module")
def oracle(real_data):
    if not (real_data / "oracles").is_dir():
        pytest.skip("no answers of the authors' code")
    return lambda name: _oracle(real_data / "oracles", name)


@pytest.fixture(params=BOTH)
def recorded(request, oracle):
    return oracle(request.param)


def character(recorded: Oracle, number: int, structure: str) -> Character:
    """A body of the authors', in metres; its root is called the hips."""
    names = ["Hips" if not k else name.replace("Hips", "Lower") for k, name in enumerate(_names(recorded))]
    parents = np.array([-1, *recorded["structure/parents"][1:]])
    offsets = recorded["structure/offsets"][number].double().numpy() / 100
    skeleton = Skeleton(tuple(names), parents, offsets)
    return Character.of(str(recorded["structure/characters"][number]), skeleton, structure=structure)


def _names(recorded: Oracle) -> list[str]:
    return [str(name) for name in recorded["structure/names"]]


def structure_of(recorded: Oracle, design: Design = RELEASED) -> Structure:
    """Ours with the authors' weights; rows 1 and 2 of the statistics are those of their characters."""
    body = character(recorded, 0, "any")
    structure = Structure(layout_of(body.skeleton.parents.tolist(), body.roles), design, ("a", "b"))
    networks = (saved(recorded, name) for name in ("auto_encoder", "static_encoder"))
    for name, tensor in released.parameters(structure, *networks):
        structure.get_parameter(name).data = tensor.contiguous()
    for statistic, name in ((structure.mean, "norm/mean"), (structure.deviation, "norm/var")):
        statistic[1:].flatten(1)[:, :-1] = recorded[name][..., 0]
    structure.mean[1:, -1, 3], structure.deviation[1:, -1, 3] = 0.0, 1.0
    return structure


def saved(recorded: Oracle, network: str) -> SavedNetwork:
    return SavedNetwork(Path(network), authors_files.state(recorded.arrays, network))


def discriminator_of(recorded: Oracle) -> Discriminator:
    body = character(recorded, 0, "any")
    layout = layout_of(body.skeleton.parents.tolist(), body.roles)
    discriminator = Discriminator(RELEASED.levels(layout))
    fill_discriminator(discriminator, recorded)
    return discriminator


def fill_discriminator(discriminator: Discriminator, recorded: Oracle) -> None:
    network = saved(recorded, "discriminator")
    for layer, name in ((discriminator.first, "layers.0.0"), (discriminator.last, "layers.1.0")):
        count = 1 + layer.pairs[-1][0]
        layer.weight.data = network.blocks(name, layer.pairs, (count, count)).contiguous()
    discriminator.last.bias.data = network.take("layers.1.0.bias").view_as(discriminator.last.bias)
    for name in ("weight", "bias", "running_mean", "running_var"):
        getattr(discriminator.norm, name).data = recorded[f"state/discriminator/layers.0.1.{name}"].clone()


def slots(channels: Tensor) -> Tensor:
    """``(rows, frames, slots, 4)`` from the authors' ``(rows, channels, frames)``."""
    filled = torch.cat([channels, torch.zeros_like(channels[:, :1])], 1)
    return filled.transpose(1, 2).unflatten(2, (-1, 4))


def channels(values: Tensor) -> Tensor:
    """The inverse."""
    return values.flatten(2)[..., :-1].transpose(1, 2)


def bones(recorded: Oracle, rows: Any = None) -> Tensor:
    """``(rows, slots, 3)`` centimetres, of the characters of the input if not said otherwise; the root's
    offset, zero, is last."""
    rows = recorded["input/character_of_sample"] if rows is None else rows
    return recorded["structure/offsets"][rows.tolist()].roll(-1, 1)


def rows(recorded: Oracle) -> Tensor:
    """Of the statistics of the characters of the input."""
    return torch.from_numpy(recorded["input/character_of_sample"]).long() + 1


def close(actual: Tensor, expected: Tensor, relative: float = 1e-5) -> None:
    """Within a share of the largest of their numbers."""
    assert actual.shape == expected.shape
    assert (actual - expected).abs().max() <= relative * expected.abs().max()


def listed(table: np.ndarray) -> tuple[tuple[int, ...], ...]:
    return tuple(tuple(int(each) for each in row if each >= 0) for row in table)


# ----------------------------------------------------------------------------------------- networks
def test_networks_answer_as_the_authors(recorded):
    structure = structure_of(recorded).eval()
    motion = slots(recorded["input/motion"])
    with torch.no_grad():
        both = structure.codes(bones(recorded, np.arange(2)))
        close(both[0].view_as(recorded["output/skeleton_code/0"]), recorded["output/skeleton_code/0"])
        close(both[1], recorded["output/skeleton_code/1"])
        close(structure.skeleton.layer(1, both[1]), recorded["output/skeleton_code/2"])
        codes = structure.codes(bones(recorded))
        code = structure.encoder(motion, codes)
        close(code.flatten(2).transpose(1, 2), recorded["output/motion_code"])
        decoded = structure.decoder(code, codes)
        close(channels(decoded), recorded["output/decoded"])
        close(channels(structure.plain(motion, rows(recorded))), recorded["output/motion_denormalised"])
        structure.freeze()
        close(
            channels(structure.decoder(structure.encoder(motion, codes), codes)), recorded["output/decoded"]
        )


def test_layers_answer_as_the_authors(recorded):
    """Behind poolings, which are part of our layers, and between two of them, which are not."""
    structure = structure_of(recorded).eval()
    leak = torch.nn.functional.leaky_relu
    with torch.no_grad():
        codes = structure.codes(bones(recorded))
        motion = slots(recorded["input/motion"]).flatten(2).transpose(1, 2)
        first, second = structure.encoder.layers
        close(leak(first(motion, codes[0]), 0.2), recorded["between/encoder_layer0"])
        pools = [recorded[f"pool_weight/auto_encoder/enc.layers.{k}.1"] for k in range(2)]
        close(first(motion, codes[0]), pools[0] @ recorded["between/encoder_conv0"])
        hidden = recorded["between/encoder_layer0"]
        close(leak(second(hidden, codes[1]), 0.2), recorded["between/encoder_layer1"])
        close(second(hidden, codes[1]), pools[1] @ recorded["between/encoder_conv1"])
        answer = structure.decoder.layers[0](recorded["between/encoder_layer1"], codes[1])
        close(leak(answer, 0.2), recorded["between/decoder_layer0"])


def test_kinematics_are_the_authors(recorded):
    kinematics = kinematics_of(recorded)
    plain = slots(recorded["output/motion_denormalised"])
    local = kinematics(plain, bones(recorded))
    root = plain[:, :, -1:, :3]
    close(torch.cat([root, local[:, :, 1:]], 2), recorded["output/fk_relative_to_root"])
    close(world(local, plain[:, :, -1], "position"), recorded["output/fk_world"])
    close(torch.cat([root, kinematics.vectors(local)], 2), recorded["output/fk_bone_vectors"])
    ends = world(local, plain[:, :, -1], "position")[:, :, recorded["structure/ee_ids"].tolist()]
    close(ends, recorded["output/end_positions"])
    heights = recorded["structure/height"][rows(recorded) - 1].view(2, 1, 1, 1)
    close(10 * ends.diff(dim=1) / heights, recorded["output/end_velocities"])


def kinematics_of(recorded: Oracle) -> Kinematics:
    body = character(recorded, 0, "any")
    aligned_body = aligned(body)
    return Kinematics(
        LayoutBody(
            body, layout_of(aligned_body.skeleton.parents.tolist(), aligned_body.roles), aligned_body.joints
        )
    )


@pytest.mark.parametrize("training", [False, True], ids=["eval", "train"])
def test_discriminators_answer_as_the_authors(recorded, training):
    for name in ("input", "decoded"):
        judge = discriminator_of(recorded).train(training)
        vectors = bone_vectors(recorded, name)
        scores = judge(vectors)
        close(scores, recorded[f"output/discriminator_of_{name}_{'train' if training else 'eval'}"])


def bone_vectors(recorded: Oracle, name: str) -> Tensor:
    """What a discriminator sees, in the authors' order: the root's place, then bones."""
    if name == "input":
        return recorded["output/fk_bone_vectors"].flatten(2).unflatten(2, (-1, 3))
    plain = structure_of(recorded).plain(slots(recorded["output/decoded"]), rows(recorded))
    kinematics = kinematics_of(recorded)
    local = kinematics(plain, bones(recorded))
    return RELEASED.arranged(torch.cat([kinematics.vectors(local), plain[:, :, -1:, :3]], 2)).detach()


# ------------------------------------------------------------------------------------- training step
class Step:
    """Our training module through the authors' step: what it computes on the way, and gradients."""

    def __init__(self, oracle: Any) -> None:
        self.module, self.memory, self.terms = training_module(oracle), {}, []
        self.answers: dict[tuple[str, str], Any] = {}
        self.again: dict[tuple[str, str], Tensor] = {}
        module, batch = self.module, step_batch(oracle)
        self._record(module)
        self.generator = module.losses("generator", batch, self.memory)
        sum(self.generator.values()).backward()
        self.gradients = {
            name: each.grad.norm().item()
            for name, each in module.modules["generator"].named_parameters()
            if each.grad is not None
        }
        module.modules.zero_grad()
        self.judged = module.losses("discriminator", batch, self.memory)["told_apart"]

    def _record(self, module: SanTraining) -> None:
        objective, answers = module._objective, module._answers
        add, compare = objective.add, objective.compare

        def adding(name: str, weight: float, term: Tensor) -> None:
            self.terms.append((name, term.item()))
            add(name, weight, term)

        def comparing(pair: tuple[str, str], code: Tensor, again: Tensor) -> None:
            self.again[pair] = again.detach()
            compare(pair, code, again)

        def answering(names: Any, there: int, *rest: Any) -> Any:
            answered = answers(names, there, *rest)
            self.answers |= {
                (here, names[there]): each for here, each in zip(names, answered, strict=False)
            }
            return answered

        objective.add, objective.compare, module._answers = adding, comparing, answering


@pytest.fixture(scope="module")
def step(oracle):
    return Step(oracle)


def training_module(oracle: Any) -> SanTraining:
    """Two characters of each structure, with the authors' weights and statistics."""
    method = San(variant="released")
    cast = {each.name: each for name in BOTH for each in (character(oracle(name), n, name) for n in (0, 1))}
    clips = {}
    for name, each in cast.items():
        still = each.motion(np.tile([1.0, 0, 0, 0], (64, len(each.skeleton), 1)), np.zeros((64, 3)), 30.0)
        clips[name] = [ClipArrays(name, "still", single_precision(method.prepare(still)))]
    module = method.training_module(TrainingData(cast, clips), TrainingConfig(1, 4, 64, 1e-3))
    for name in BOTH:
        structure = structure_of(oracle(name))
        module._structures[name].load_state_dict(structure.state_dict())
        fill_discriminator(module.modules["discriminator"].discriminators[name], oracle(name))
    return module


def step_batch(oracle: Any) -> dict[str, Any]:
    record, sides = oracle("step"), []
    for number, name in enumerate(BOTH):
        recorded = oracle(name)
        structure = structure_of(recorded)
        own = record[f"step/{name}/character"]
        bodies = [record[f"step/{other}_{name}/target_character"] for other in BOTH] + [own]
        which = torch.from_numpy(own.astype(np.int64)) + 1
        edges = structure.plain(slots(recorded["input/motion"]), which)
        sides.append(
            {
                "structure": number,
                "edges": edges,
                **seen(recorded, own, frames=64),
                "targets": seen(recorded, np.concatenate(bodies), frames=64),
            }
        )
    return {"sides": sides}


def seen(recorded: Oracle, rows: np.ndarray, frames: int) -> dict[str, Tensor]:
    """Bodies of a batch."""
    turn = torch.zeros(len(rows), frames, 2)
    turn[..., 0] = 1.0
    return {
        "which": torch.from_numpy(rows.astype(np.int64)) + 1,
        "bones": bones(recorded, rows),
        "unit": 1.0 / recorded["structure/real_height"][rows.tolist()],
        "turn": turn,
    }


ORDER = ("0", "1")
"""How the authors call the structures in what they log."""


def test_every_term_is_the_authors(step, oracle):
    """Of each structure and pair, and their weighted sum."""
    record = oracle("step")
    expected: list[tuple[str, str]] = []
    for there in ORDER:
        expected += [
            ("edges", f"rec_loss_quater_{there}"),
            ("root", f"rec_loss_global_{there}"),
            ("positions", f"rec_loss_position_{there}"),
        ]
        for here in ORDER:
            expected += [("cycle", f"cycle_loss_{here}_{there}"), ("ends", f"ee_loss_{here}_{there}")]
            expected += [("adversarial", f"G_loss_{here}_{there}")] * (here != there)
    assert [name for name, _ in step.terms] == [name for name, _ in expected]
    for (_, value), (_, key) in zip(step.terms, expected, strict=True):
        assert value == pytest.approx(float(record[f"loss/{key}"]), rel=1e-5), key
    total = sum(term.item() for term in step.generator.values())
    assert total == pytest.approx(float(record["loss/sum/loss_G_total"]), rel=1e-5)
    assert step.judged.item() == pytest.approx(float(record["loss/sum/loss_D"]), rel=1e-5)


@pytest.mark.parametrize("here", BOTH)
@pytest.mark.parametrize("there", BOTH)
def test_answers_in_the_step_are_the_authors(step, oracle, here, there):
    record, answer, prefix = oracle("step"), step.answers[here, there], f"step/{here}_{there}"
    close(channels(answer.edges), record[f"{prefix}/retargeted"])
    close(step.again[here, there].flatten(2).transpose(1, 2), record[f"{prefix}/code_of_retargeted"])
    vectors = step.module._discriminator_inputs(there, answer)
    close(vectors, record[f"{prefix}/bone_vectors"])
    ends = answer.in_heights[:, :, oracle(there)["structure/ee_ids"].tolist()]
    # differences of positions about a height away, in single precision: in double ours differ as much
    assert (10 * ends.diff(dim=1) - record[f"{prefix}/end_velocities"]).abs().max() < 1e-5
    rests = (10 * ends.diff(dim=1)).norm(dim=-1) < 0.008
    order = [(a, b) for a in BOTH for b in BOTH].index((here, there))
    assert rests.float().mean().item() == pytest.approx(float(record["share_of_rest"][order]), rel=1e-5)


def test_gradients_of_the_generator_have_the_authors_norms(step, oracle):
    record, compared = oracle("step"), 0
    names = {authors_name: f"{own_name}.motion" for authors_name, own_name in released.LAYERS.items()}
    names |= {
        f"{authors_name}.offset_enc": own_name.replace("motion", "body")
        for authors_name, own_name in names.items()
    }
    for key in (name for name in record.names if name.startswith("grad_norm/")):
        _, structure, network, parameter = key.split("/")
        layer, kind = parameter.rsplit(".", 1)
        if network == "auto_encoder":
            own_name = f"{structure}.{names[layer]}.{kind}"
        elif network == "static_encoder":
            own_name = f"{structure}.skeleton.layers.0.{kind}"
        else:
            continue
        # what the last layer adds to all frames has a gradient that nearly cancels: theirs, in single
        # precision, is up to 6e-5 away from ours in double
        added = "dec.layers.1.2" in key and not key.endswith("1.2.weight")
        rounding = 1e-4 if added else 1e-5
        assert step.gradients[own_name] == pytest.approx(float(record[key]), rel=rounding), key
        compared += 1
    assert compared == len(step.gradients)


@pytest.mark.parametrize("name", BOTH)
def test_gradients_of_discriminators_have_the_authors_norms(step, oracle, name):
    """Through plain ones too: the authors' switch makes masks and poolings learn along with the weights."""
    record = oracle("step")
    (real, fake) = next((real, fake) for there, real, fake in step.memory["shown"] if there == name)
    lean = discriminator_of(oracle(name))
    plain = PlainDiscriminator(lean, RELEASED.levels(step.module._structures[name].layout))
    for each in plain.buffers():
        if each.dtype.is_floating_point and each.ndim > 1:
            each.requires_grad_()
    for judge in (lean, plain):
        judge(fake)  # the generator's part of the step: only statistics remain of it
        discriminator_loss(judge(real), judge(fake)).backward()
    tensors = {
        "layers.0.0.weight": lean.first.weight,
        "layers.0.1.weight": lean.norm.weight,
        "layers.0.1.bias": lean.norm.bias,
        "layers.1.0.weight": lean.last.weight,
        "layers.1.0.bias": lean.last.bias,
        "layers.0.0.mask": plain.first.mask,
        "layers.1.0.mask": plain.last.mask,
        "layers.0.2.weight": plain.pool0,
        "layers.1.1.weight": plain.pool1,
    }
    keys = {key.rsplit("/", 1)[1]: key for key in record.names if f"{name}/discriminator/layers" in key}
    keys = {key: value for key, value in keys.items() if value.startswith("grad_norm")}
    assert keys.keys() == tensors.keys()
    for key, each in tensors.items():
        assert each.grad.norm().item() == pytest.approx(float(record[keys[key]]), rel=1e-5), key
    after = f"step/{name}/discriminator_buffers_after/layers.0.1"
    norm = step.module.modules["discriminator"].discriminators[name].norm
    for buffer in ("running_mean", "running_var"):
        close(getattr(lean.norm, buffer), record[f"{after}.{buffer}"])
        close(getattr(norm, buffer), record[f"{after}.{buffer}"])


@pytest.mark.parametrize("name", BOTH)
def test_the_error_they_print_is_of_world_positions(oracle, name):
    """Mean square of coordinates in heights, by our kinematics of the channels that they wrote."""
    record, recorded = oracle("step"), oracle(name)
    kinematics, errors = kinematics_of(recorded), []
    offsets = record[f"get_error/{name}/offsets"].roll(-1, 0).unsqueeze(0)
    for number in range(2):
        places = []
        for kind in ("gt", "0"):
            plain = slots(record[f"get_error/{name}/{number}/raw_{kind}"].unsqueeze(0))
            positions = world(kinematics(plain, offsets), plain[:, :, -1], "position")[0]
            close(positions, record[f"get_error/{name}/{number}/positions_{kind}"], 1e-4)
            places.append(positions)
        apart = (places[0] - places[1]) / record[f"get_error/{name}/height"]
        errors.append(apart.square().mean().item())
    assert errors == pytest.approx(record[f"get_error/{name}/error_per_motion"].tolist(), rel=1e-4)
