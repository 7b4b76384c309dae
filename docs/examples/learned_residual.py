"""Copied rotations, corrected in every frame by a small network: the example of a learned method."""

from functools import cached_property, partial

import numpy as np
import torch
from torch import nn
from torch.utils.data import default_collate

from retarget_bench.api import MethodCard
from retarget_bench.motion import facing, rates, root_rules, rotation
from retarget_bench.motion.body22 import JOINTS, SKELETON, Body22, unfit
from retarget_bench.motion.kinematics_torch import Tree, forward
from retarget_bench.training.config import TrainingConfig
from retarget_bench.training.contract import Phase
from retarget_bench.training.layers import exported
from retarget_bench.training.learned_method import LearnedMethod
from retarget_bench.training.weights import fill


def see(motion):
    """Arrays ``(frames, ...)`` float32 of a motion at 30 frames per second: local rotations ``(22, 4)``,
    hips ``(3,)`` metres, and the turn ``(4,)`` from +Z to where the body faces."""
    rotations, hips = Body22(motion.character).see(motion)
    turn = facing.rotation(facing.facing(motion.positions, motion.character, smoothing=3))
    arrays = {"rotations": rotations, "hips": hips, "turn": turn}
    return {name: array.astype(np.float32) for name, array in arrays.items()}


def body(character):
    """``(67,)`` float32: the bones of the 22 joints in heights of the hips, and that height in metres."""
    height = character.measures.hip_height
    return np.append(Body22(character).offsets / height, height).astype(np.float32)


class Network(nn.Module):
    """Turns of the 22 joints and a shift of the hips, from one frame of the source and both bodies."""

    def __init__(self, width):
        super().__init__()
        self.enter = nn.Linear(9 * JOINTS + 1 + 2 * (3 * JOINTS + 1), width)
        self.leave = nn.Linear(width, 3 * JOINTS + 3)
        nn.init.zeros_(self.leave.weight)  # so that an untrained network copies
        nn.init.zeros_(self.leave.bias)

    def forward(self, source, target):
        """The target's rotations ``(rows, frames, 22, 4)`` and hips ``(rows, frames, 3)`` metres.

        source: what ``see`` gives, and ``body``. target: the target's ``body`` ``(rows, 67)``.
        """
        rotations, hips, turn = source["rotations"], source["hips"], source["turn"]
        ours, theirs = (x.unsqueeze(1).expand(*hips.shape[:2], -1) for x in (target, source["body"]))
        root = rotation.multiply(rotation.conjugate(turn), rotations[..., 0, :])  # as if it faced +Z
        pose = rotation.to_matrix(torch.cat([root.unsqueeze(-2), rotations[..., 1:, :]], -2)).flatten(-3)
        seen = torch.cat([pose, hips[..., 1:2] / theirs[..., -1:], theirs, ours], -1)
        turns, shift = self.leave(self.enter(seen).relu()).split([3 * JOINTS, 3], -1)
        turns = rotation.from_rotation_vector(turns.unflatten(-1, (JOINTS, 3)))
        copied = hips * ours[..., -1:] / theirs[..., -1:]
        shifted = copied + rotation.rotate(turn, ours[..., -1:] * shift)
        return rotation.multiply(rotations, turns), shifted


class Training:
    """A ``TrainingModule``, see ``retarget_bench/training/contract.py``."""

    phases = (Phase("network", ("network",), clip=1.0),)

    def __init__(self, data, config, network, method):
        """method: makes the method from exported tensors."""
        by_name = {}
        for clip in (clip for clips in data.clips.values() for clip in clips):
            by_name.setdefault(clip.name, []).append(clip)  # clips of one name are one performance
        self._performances = [clips for clips in by_name.values() if len(clips) > 1]
        self._bodies = {name: body(data.characters[name]) for name in data.clips}
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
        bodies = [{"body": self._bodies[clip.character]} for clip in pair]
        return {"source": cut[0] | bodies[0], "target": cut[1] | bodies[1]}

    def losses(self, phase, batch, memory):
        """Distances of joints, and of their steps from frame to frame, in heights of the target's hips."""
        truth = batch["target"]
        rotations, hips = self.modules["network"](batch["source"], truth["body"])
        bones, height = truth["body"][:, :-1].unflatten(-1, (JOINTS, 3)), truth["body"][:, None, -1:]
        places = partial(forward, self._tree.to(hips.device), bones)
        apart = places(rotations, hips / height)[0] - places(truth["rotations"], truth["hips"] / height)[0]
        return {"places": apart.norm(dim=-1).mean(), "steps": apart.diff(dim=1).norm(dim=-1).mean()}

    def method(self):
        return self._method(self.export())

    def export(self):
        return exported(self.modules["network"])

    def load(self, tensors):
        fill(self.modules["network"], tensors)


class LearnedResidual(LearnedMethod):
    """Copied rotations and a scaled path, corrected by a network that sees one frame and both bodies."""

    from_pairs = True  # trained on the same performances by two bodies
    card = MethodCard("learned_residual", "Copied rotations, corrected by a small network", version="1")
    presets = {"default": TrainingConfig(steps=600, batch=16, window=32, rate=1e-3, schedule="cosine")}
    prepare = staticmethod(see)

    def __init__(self, width: int = 256, weights: str = "none"):
        super().__init__(weights)
        self.width = width

    def facts(self):
        return {"width": self.width}

    def unfit(self, character):
        return unfit(character, "learned_residual")

    def training_module(self, training_data, config):
        return Training(training_data, config, Network(self.width), LearnedResidual(self.width).using)

    def supports(self, source, target):
        unsized = root_rules.reason("hip_height", source, target)
        return self.untrained or self.unfit(source) or self.unfit(target) or unsized

    def retarget(self, source, target, *, context):
        seen = default_collate([see(rates.at_thirty(source)) | {"body": body(source.character)}])
        with torch.inference_mode():
            answer = self._network(seen, torch.from_numpy(body(target))[None])
        rotations, hips = (each[0].double().numpy() for each in answer)
        return rates.back(Body22(target).motion(rotation.normalise(rotations), hips, rates.FPS), source)

    @cached_property
    def _network(self):
        network = Network(self.width)
        fill(network, self.tensors)
        return network.eval()


plugin = LearnedResidual
