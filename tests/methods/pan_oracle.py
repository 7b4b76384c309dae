"""PAN's networks with the weights that its authors' code had, and what that code saw, in our order.

The method's own reader of their files tells which of their numbers is which of ours.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import authors_files
import numpy as np
import pan_material
import torch
from method_bodies import body
from torch import Tensor

from retarget_bench.methods.pan import Pan
from retarget_bench.methods.pan.released import parameters
from retarget_bench.methods.pan.training import PanTraining
from retarget_bench.motion.character import Character
from retarget_bench.motion.skeleton import EndSite, Skeleton
from retarget_bench.training.config import TrainingConfig
from retarget_bench.training.data import ClipArrays, TrainingData
from retarget_bench.training.layers.skeletal.released import SavedNetwork

Arrays = Mapping[str, np.ndarray]


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

    networks: their names of the auto-encoder and the encoder of skeletons. bodies: the characters, by name.
    points: which position of theirs each of ours is. motion: ``(rows, frames, edges + 1, 4)`` normalised.
    bones: ``(bodies, edges + 1 + end sites, 3)`` cm. heights: ``(bodies,)`` cm, or 1. mean, deviation:
    ``(statistics, edges + 1, 4)``.
    """

    arrays: Arrays
    networks: tuple[str, str]
    bodies: Mapping[str, Character]
    points: Sequence[int]
    motion: Tensor
    bones: Tensor
    heights: Tensor
    mean: Tensor
    deviation: Tensor


def people(stored: Arrays, structure: str) -> Theirs:
    """Of the files of Mixamo's structures."""
    parents, offsets = stored["structure/parents"].tolist(), stored["structure/offsets"]
    names, joints = stored["structure/names"].tolist(), len(parents)
    bodies = {
        name: Character.of(name, _as_filed(names, [-1, *parents[1:]], each / 100), structure=structure)
        for name, each in zip(stored["structure/characters"].tolist(), offsets, strict=True)
    }
    spread = stored["norm/var"][..., 0]
    return Theirs(
        arrays=stored,
        networks=("auto_encoder", "static_encoder"),
        bodies=bodies,
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
        networks=("ae", "skel_enc"),
        bodies={structure: Character.of(structure, skeleton, structure=structure)},
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
        root_bone=method.parts == "six",
        width=width,
        skeleton=width,
        feedforward=hidden,
        judging=judging,
        dropout=0.0,
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


class Recorded(SavedNetwork):
    """A network that tells the name of the last tensor that was taken."""

    name = ""

    def take(self, name: str) -> Tensor:
        if not name.endswith(".mask"):
            self.name = name
        return super().take(name)


def take_over(module: PanTraining, name: str, reference: Theirs) -> dict[str, Tensor]:
    """Our structure and discriminator get their weights; our parameters by the names of theirs."""
    key = _key(module, name)
    structure, tensors = module._structures[key], {}
    networks = [
        Recorded(Path(network), authors_files.state(reference.arrays, network))
        for network in reference.networks
    ]
    for own, values in parameters(structure, module._settings.design, *networks):
        parameter = structure.get_parameter(own)
        parameter.data.copy_(values)
        network = networks[own.startswith("skeleton.")]
        tensors[f"{network.path}/{network.name}"] = parameter
    channels = [3 * point + axis for point in reference.points for axis in range(3)]
    for plain, own in module._discriminators.discriminators[key].named_parameters():
        their = f"discriminator/{plain}".replace(".weight", ".0.weight").replace(".bias", ".0.bias")
        values = tensor(reference.arrays[f"state/{their}"])
        own.data.copy_(values[:, channels] if plain == "layers.0.weight" else values)
        tensors[their] = own
    return tensors
