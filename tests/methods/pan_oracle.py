"""PAN's networks with the weights that its authors' code had, and what that code saw, in our order.

Their networks have dense weights and a mask beside each; ``pan_reference`` tells which of these numbers is
which of ours, and its masks have to be theirs.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import numpy as np
import pan_material
import torch
from method_bodies import body
from pan_reference import Masked, PlainDecoder, PlainEncoder, PlainSkeletonEncoder
from torch import Tensor

from retarget_bench.methods.pan import Pan
from retarget_bench.methods.pan.structure import Structure
from retarget_bench.methods.pan.training import PanTraining
from retarget_bench.motion.character import Character
from retarget_bench.motion.skeleton import EndSite, Skeleton
from retarget_bench.training.config import TrainingConfig
from retarget_bench.training.data import ClipArrays, TrainingData

Arrays = Mapping[str, np.ndarray]
NETWORKS = {
    "encoder": {
        "tokens": "parameter_part",
        "embedding.0": "joint_pos_encoder.linear1",
        "embedding.1": "joint_pos_encoder.linear2",
        "layers": "spatialTransEncoder.layers",
        "first": "conv1",
        "second": "conv2",
        "raw": "conv_residual",
    },
    "decoder": {"inner": "layers.0.1", "outer": "layers.1.1"},
    "skeleton": {f"layers.{n}": f"linear{n + 1}" for n in range(3)},
}
"""Names of modules of the plain networks, and of theirs."""
PLAIN = {"encoder": PlainEncoder, "decoder": PlainDecoder, "skeleton": PlainSkeletonEncoder}


@cache
def arrays(path: Path) -> Arrays:
    with np.load(path, allow_pickle=False) as file:
        return {name: file[name] for name in file.files}


def below(stored: Arrays, prefix: str) -> Arrays:
    return {name.removeprefix(prefix): each for name, each in stored.items() if name.startswith(prefix)}


def tensor(array: np.ndarray) -> Tensor:
    return torch.tensor(array, dtype=torch.float32)


# ------------------------------------------------------------------------------------------ structures
@dataclass(frozen=True)
class Theirs:
    """One structure of theirs.

    state, masks: by network (of ``NETWORKS``, and ``discriminator``). bodies: the characters, by name.
    rows: the row of our bones for each joint of theirs that the skeleton encoder reads. points: which
    position of theirs each of ours is. motion: ``(rows, frames, edges + 1, 4)`` normalised. bones:
    ``(bodies, edges + 1 + end sites, 3)`` cm. heights: ``(bodies,)`` cm, or 1. mean, deviation:
    ``(statistics, edges + 1, 4)``.
    """

    arrays: Arrays
    state: Mapping[str, Arrays]
    masks: Mapping[str, Arrays]
    bodies: Mapping[str, Character]
    rows: Sequence[int]
    points: Sequence[int]
    motion: Tensor
    bones: Tensor
    heights: Tensor
    mean: Tensor
    deviation: Tensor


def people(stored: Arrays, structure: str) -> Theirs:
    """Of the files of Mixamo's structures."""
    kinds = {"decoder": "auto_encoder/dec.", "encoder": "auto_encoder/enc.", "skeleton": "static_encoder/"}
    kinds["discriminator"] = "discriminator/"
    parents, offsets = stored["structure/parents"].tolist(), stored["structure/offsets"]
    names, joints = stored["structure/names"].tolist(), len(parents)
    bodies = {
        name: Character.of(name, _as_filed(names, [-1, *parents[1:]], each / 100), structure=structure)
        for name, each in zip(stored["structure/characters"].tolist(), offsets, strict=True)
    }
    spread = stored["norm/var"][..., 0]
    return Theirs(
        arrays=stored,
        state={name: below(stored, f"state/{prefix}") for name, prefix in kinds.items()},
        masks={name: below(stored, f"mask/{prefix}") for name, prefix in kinds.items()},
        bodies=bodies,
        rows=[(joint - 1) % joints for joint in range(joints)],
        points=range(joints),
        motion=_edges(tensor(stored["input/motion"])),
        bones=torch.cat([tensor(offsets[:, 1:]), torch.zeros(2, 1, 3)], 1),
        heights=tensor(stored["structure/height"][:, 0]),
        mean=_edges(tensor(stored["norm/mean"]))[:, 0],
        deviation=_edges(tensor(spread)[..., None], 1.0)[:, 0],
    )


def _edges(motion: Tensor, fourth: float = 0.0) -> Tensor:
    """``(rows, frames, edges + 1, 4)`` of ``(rows, channels, frames)`` with three channels of the root."""
    padded = torch.nn.functional.pad(motion.transpose(1, 2), (0, 1), value=fourth)
    return padded.unflatten(2, (-1, 4))


def _as_filed(names: Sequence[str], parents: Sequence[int], offsets: np.ndarray) -> Skeleton:
    """The tree as the file has it: theirs is turned round where it begins with a pelvis."""
    if names[0] != "Pelvis":
        return Skeleton(tuple(names), np.array(parents), offsets)
    hips = names.index("Hips")
    order = [hips, *(joint for joint in range(len(names)) if joint != hips)]
    above = {joint: order.index(parents[joint]) for joint in range(1, len(names))} | {hips: -1, 0: 0}
    placed = np.array(offsets)
    placed[0], placed[hips] = -offsets[hips], 0.0
    # parents come first: the spine hangs from the hips, which lead now
    return Skeleton(tuple(names[j] for j in order), np.array([above[j] for j in order]), placed[order])


def legs(stored: Arrays, structure: str) -> Theirs:
    """``human`` or ``dog`` of the file of three parts."""
    own_arrays = below(stored, f"{structure}/")
    kinds = {"decoder": "ae/dec.", "encoder": "ae/enc.", "skeleton": "skel_enc/"}
    kinds["discriminator"] = "discriminator/"
    names, parents = own_arrays["structure/names"].tolist(), own_arrays["structure/parents"]
    every, joints = (
        own_arrays["structure/parents_with_ends"].tolist(),
        own_arrays["structure/not_end"].tolist(),
    )
    last = sorted((joints.index(every[k]), k) for k in range(len(every)) if k not in joints)
    model = body("one") if structure == "human" else pan_material.dog("rex")
    offset_of = dict(zip(model.skeleton.names, model.skeleton.offsets, strict=True))
    offset_of["LeftToe"], offset_of["RightToe"] = (
        offset_of.get("LeftToeBase"),
        offset_of.get("RightToeBase"),
    )
    offsets = np.stack([offset_of[name] for name in names])
    sites = tuple(EndSite(joint, (0.0, -0.05, 0.0)) for joint, _ in last)
    skeleton = Skeleton(tuple(names), parents, offsets, sites)
    ends = tensor(own_arrays["input/offsets_with_ends"]).unflatten(1, (-1, 3))
    zero = torch.zeros(2, 1, 3)
    bones = [zero, tensor(own_arrays["input/offsets"]).unflatten(1, (-1, 3)), zero]
    bones.append(ends[:, [k - 1 for _, k in last]])
    return Theirs(
        arrays=own_arrays,
        state={name: below(own_arrays, f"state/{prefix}") for name, prefix in kinds.items()},
        masks={name: below(own_arrays, f"mask/{prefix}") for name, prefix in kinds.items()},
        bodies={structure: Character.of(structure, skeleton, structure=structure)},
        rows=range(1, len(names)),
        points=[*joints, *(k for _, k in last)],
        motion=tensor(own_arrays["input/motion"]).transpose(1, 2).unflatten(2, (-1, 4)),
        bones=torch.cat(bones, 1),
        heights=torch.ones(2),
        mean=tensor(own_arrays["norm/mean"]).view(1, -1, 4),
        deviation=tensor(own_arrays["norm/std"]).view(1, -1, 4),
    )


# -------------------------------------------------------------------------------------------- training
def training(
    method: Pan, every: Mapping[str, Theirs], width: int, hidden: int, judging: int
) -> PanTraining:
    """Our training module with their weights and statistics. hidden: of the feed-forward blocks."""
    design = replace(
        method.settings.design,
        **{"width": width, "skeleton": width, "feedforward": hidden, "judging": judging, "dropout": 0.0},
    )
    method.settings = replace(method.settings, design=design)
    bodies = {name: each for reference in every.values() for name, each in reference.bodies.items()}
    clips = {name: [_clip(method, name, each)] for name, each in bodies.items()}
    config = TrainingConfig(steps=1, batch=4, window=64, rate=1e-3)
    module = method.training_module(TrainingData(bodies, clips), config)
    for name, reference in every.items():
        structure = module._structures[_key(module, name)]
        structure.mean[-len(reference.mean) :] = reference.mean
        structure.deviation[-len(reference.mean) :] = reference.deviation
        take_over(module, name, reference)
    return module


def _clip(method: Pan, name: str, character: Character) -> ClipArrays:
    edges = method.body(character).layout.edges + 1
    shapes = {"edges": (70, edges, 4), "turn": (70, 2), "hips": (70, 3)}
    return ClipArrays(name, "none", {k: np.ones(shape, dtype=np.float32) for k, shape in shapes.items()})


def _key(module: PanTraining, name: str) -> str:
    return next(each for each in module._names if each.startswith(name))


def take_over(module: PanTraining, name: str, reference: Theirs) -> dict[str, Tensor]:
    """Our structure and discriminator get their weights; our parameters by the names of theirs."""
    key = _key(module, name)
    structure, tensors = module._structures[key], {}
    for network, names in NETWORKS.items():
        loaded = _network(structure, network, module._settings.design, reference)
        prefixed = {_translated(plain, names): own for plain, own in loaded.items()}
        tensors |= {f"{network}/{each}": own for each, own in prefixed.items()}
    channels = [3 * point + axis for point in reference.points for axis in range(3)]
    for plain, own in module._discriminators.discriminators[key].named_parameters():
        their = plain.replace(".weight", ".0.weight").replace(".bias", ".0.bias")
        values = tensor(reference.state["discriminator"][their])
        own.data.copy_(values[:, channels] if plain == "layers.0.weight" else values)
        tensors[f"discriminator/{their}"] = own
    return tensors


def _translated(plain: str, names: Mapping[str, str]) -> str:
    module = next(each for each in names if plain == each or plain.startswith(f"{each}."))
    return names[module] + plain.removeprefix(module)


def _network(structure: Structure, network: str, design: object, reference: Theirs) -> dict[str, Tensor]:
    """Our parameters, with their weights, by their names in the plain network."""
    plain = PLAIN[network](getattr(structure, network), structure.layout, design)
    state, masks = reference.state[network], reference.masks[network]
    pairs = {id(each): (own, write) for each, own, write in plain.pairs}
    layers = {id(each.weight): each for each in plain.modules() if isinstance(each, Masked)}
    tensors: dict[str, Tensor] = {}
    for name, dense in plain.named_parameters():
        own, write = pairs[id(dense)]
        their = _translated(name, NETWORKS[network])
        values = tensor(state[their])
        if id(dense) in layers:
            mask = tensor(masks[their.removesuffix(".weight")])
            known = layers[id(dense)].mask.expand_as(dense).clone()
            if (network, name) == ("skeleton", "layers.0.weight"):
                values, mask, known = _by_row(reference.rows, values, mask, known)
            assert torch.equal(known, mask), f"{network} {name} has another mask"
        index = write(torch.arange(1.0, own.numel() + 1.0).view(own.shape)).long()
        values = values.view(index.shape)
        own.data.view(-1)[index[index > 0] - 1] = values[index > 0]
        tensors[name] = own
    used = {_translated(name, NETWORKS[network]) for name in tensors}
    assert used == {each for each in state if not each.endswith(".pe")}
    return tensors


def _by_row(
    rows: Sequence[int], values: Tensor, mask: Tensor, known: Tensor
) -> tuple[Tensor, Tensor, Tensor]:
    """The first layer on bones in our order. What ours has on bones of no length, theirs need not have."""
    columns = [3 * row + axis for row in rows for axis in range(3)]
    ordered, masked, own_mask = (torch.zeros_like(known) for _ in range(3))
    ordered[:, columns], masked[:, columns], own_mask[:, columns] = values, mask, known[:, columns]
    return ordered, masked, own_mask
