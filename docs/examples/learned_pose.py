"""A small network that turns the joints of one body as those of another are placed: an example."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import torch
from torch import nn
from torch.nn.functional import elu
from torch.utils.data import default_collate

from retarget_bench.api import MethodCard
from retarget_bench.motion import facing, rates, rotation
from retarget_bench.motion.body22 import JOINTS, SKELETON, Body22
from retarget_bench.motion.kinematics_torch import Tree, forward
from retarget_bench.training.config import TrainingConfig
from retarget_bench.training.contract import Phase
from retarget_bench.training.layers import exported
from retarget_bench.training.learned_method import LearnedMethod
from retarget_bench.training.weights import fill


def see(source):
    """Arrays ``(frames, ...)`` of a source at 30 frames per second: places ``(22, 3)`` of its joints from
    the hips, as seen from where it faces, and of the hips ``(3,)``, both in heights of the hips; the turn
    ``(4,)`` from +Z to where it faces."""
    turn = facing.facing(source.positions, source.character, smoothing=3)
    places = source.positions[:, Body22(source.character).joints] / source.character.measures.hip_height
    level = facing.seen(places - places[:, :1], turn[:, None])
    arrays = {"places": level, "hips": places[:, 0], "turn": facing.rotation(turn)}
    return {name: array.astype(np.float32) for name, array in arrays.items()}


def bones(character):
    """``(22, 3)`` float32: the bones of the reference pose in heights of the hips."""
    return (Body22(character).offsets / character.measures.hip_height).astype(np.float32)


class Network(nn.Module):
    """Rotations of the target's 22 joints from one frame of the source and the bones of both."""

    def __init__(self, width):
        super().__init__()
        self.enter = nn.Linear(3 * 3 * JOINTS + 1, width)
        self.middle = nn.Linear(width, width)
        self.leave = nn.Linear(width, 4 * JOINTS)

    def forward(self, source, target):
        """Local rotations ``(rows, frames, 22, 4)``, signs as they come. source: what ``see`` gives, and
        its ``bones``. target: the target's bones ``(rows, 22, 3)``."""
        places, turn = source["places"], source["turn"]
        bodies = torch.cat([source["bones"], target], 1).flatten(1)[:, None].expand(-1, places.shape[1], -1)
        seen = torch.cat([places.flatten(-2), source["hips"][..., 1:2], bodies], -1)
        found = self.leave(elu(self.middle(elu(self.enter(seen))))).unflatten(-1, (JOINTS, 4))
        found = rotation.normalise(found + found.new_tensor([1.0, 0.0, 0.0, 0.0]))  # begins as a T-pose
        root = rotation.multiply(turn, found[..., 0, :])  # back to where it faces
        return torch.cat([root.unsqueeze(-2), found[..., 1:, :]], -2)


class Training:
    """A ``TrainingModule``, see ``retarget_bench/training/contract.py``."""

    phases = (Phase("network", ("network",), clip=1.0),)

    def __init__(self, data, config, network, method):
        """method: makes the method from exported tensors."""
        by_name = {}
        for clip in (clip for clips in data.clips.values() for clip in clips):
            by_name.setdefault(clip.name, []).append(clip)  # clips of one name are one performance
        self._performances = [clips for clips in by_name.values() if len(clips) > 1]
        self._bones = {name: bones(data.characters[name]) for name in data.clips}
        self._window, self._method, self._tree = config.window, method, Tree.of(SKELETON)
        self.modules = nn.ModuleDict({"network": network})

    def draw(self, numbers, rows):
        """Windows of performances by two bodies; all chance comes from ``numbers``."""
        return default_collate([self._row(numbers) for _ in range(rows)])

    def _row(self, numbers):
        clips = self._performances[numbers.integers(len(self._performances))]
        pair = [clips[k] for k in numbers.choice(len(clips), 2, replace=False)]
        start = numbers.integers(max(pair[0].frames - self._window, 0) + 1)
        frames = np.minimum(start + np.arange(self._window), pair[0].frames - 1)  # stands at the end
        cut = [{name: array[frames] for name, array in clip.arrays.items()} for clip in pair]
        own = [{"bones": self._bones[clip.character]} for clip in pair]
        return {"source": cut[0] | own[0], "target": cut[1] | own[1]}

    def losses(self, phase, batch, memory):
        """Distances of joints from the truth, in heights of the hips, and a tenth of angles, radians."""
        truth, right = batch["target"], batch["target"]["rotations"]
        found = self.modules["network"](batch["source"], truth["bones"])
        body = self._tree.to(found.device), truth["bones"]
        apart = forward(*body, found, truth["hips"])[0] - forward(*body, right, truth["hips"])[0]
        return {"places": apart.norm(dim=-1).mean(), "angles": 0.1 * rotation.angle(found, right).mean()}

    def method(self):
        return self._method(self.export())

    def export(self):
        return exported(self.modules["network"])

    def load(self, tensors):
        fill(self.modules["network"], tensors)


@dataclass(frozen=True)
class Config:
    """The parameters; the lines below them are what ``bench info`` says."""

    width: int = 256
    """numbers of a layer"""
    weights: str = "none"
    """a path, as of a folder of bench train"""


class LearnedPose(LearnedMethod):
    """Rotations by a network that sees where joints are, and the source's path scaled by hip heights."""

    over_roles = True  # which every body on two legs has, or nearly
    from_pairs = True  # trained on the same performances by two bodies
    Config = Config
    card = MethodCard("learned_pose", "Rotations by a network", "1", accepts=("motion", "positions"))
    presets = {"default": TrainingConfig(steps=2000, batch=16, window=16, rate=2e-3, schedule="cosine")}

    def prepare(self, motion):
        return see(motion) | {"rotations": Body22(motion.character).see(motion)[0]}

    def training_module(self, training_data, config):
        return Training(training_data, config, Network(self.config.width), self.using)

    def retarget(self, source, target, *, context):
        seen = default_collate([see(rates.at_thirty(source)) | {"bones": bones(source.character)}])
        with torch.inference_mode():
            found = self._network(seen, torch.from_numpy(bones(target))[None])[0].double().numpy()
        hips = seen["hips"][0].double().numpy() * target.measures.hip_height
        return rates.back(Body22(target).motion(rotation.normalise(found), hips, rates.FPS), source)

    @cached_property
    def _network(self):
        network = Network(self.config.width)
        fill(network, self.tensors)
        return network.eval()


plugin = LearnedPose
