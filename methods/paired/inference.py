"""Retargeting: the copy of a motion, corrected by the network, with feet held where the source's rest."""

from dataclasses import replace
from typing import Literal

import numpy as np
import torch
from torch import Tensor

from retarget_bench.motion import rates, root_rules, transfer
from retarget_bench.motion.character import Character, interpolated
from retarget_bench.motion.motion import Motion
from retarget_bench.motion.planting.cuts import joined, takes
from retarget_bench.motion.planting.feet import Exchange
from retarget_bench.motion.planting.plant import plant
from retarget_bench.motion.planting.two_bone import Pose, rig_of

from .features import FPS, RoleBody
from .network import Correction, Corrector, copy_of, goals_of, inputs_of
from .pose import copied, posed

RootRule = root_rules.ScalingRule | Literal["learned"]
CHUNK = 1024
"""Frames that go through the network at once."""


def retargeted(
    network: Corrector, source: Motion, target: Character, root_rule: RootRule = "hip_height"
) -> Motion:
    """The source's pose on the target with the network's correction and feet held where the source's rest,
    at the source's own rate. Nothing is eased over the source's cuts."""
    cuts = takes(replace(source))  # a copy's, so that its places are let go
    rotations, root = joined(_piece(network, source.at(piece), target, root_rule) for piece in cuts)
    return target.motion(rotations, root, source.fps)


def path_rule(root_rule: RootRule) -> root_rules.ScalingRule:
    """The rule of the copy that is corrected."""
    return "hip_height" if root_rule == "learned" else root_rule


def _piece(
    network: Corrector, source: Motion, target: Character, root_rule: RootRule
) -> tuple[np.ndarray, np.ndarray]:
    """Rotations and root path for a source without cuts."""
    source_body, target_body = RoleBody(source.character), RoleBody(target)
    bodies = [_sizes(source_body, torch.float32), _sizes(target_body, torch.float32)]
    thirty = rates.at_thirty(source)
    assert isinstance(thirty, Motion)
    seen_at_thirty = _arrays(source_body, thirty)
    corrections = at_rate(correction(network, seen_at_thirty, bodies), source, thirty.frames)
    arrays = seen_at_thirty if thirty is source else _arrays(source_body, source)
    motion = {name: each.double() for name, each in arrays.items()}
    corrections = corrections.where_near(motion["near"])
    rule = path_rule(root_rule)
    copy = transfer.carry(source, target, rule)
    seen = target_body.body.see(copy)
    motion["rotations"] = torch.from_numpy(seen[0])[None].double()
    sizes = [_sizes(body, torch.float64) for body in (source_body, target_body)]
    if root_rule == rule:
        corrections = corrections.on_the_path()
        path = torch.from_numpy(seen[1])[None].double()
        start = copied(network.tree, motion["rotations"], path, sizes[1]["offsets"])
    else:
        start = copy_of(network, corrections.scale, motion, *sizes)
    goals = goals_of(corrections, start, motion["turn"], sizes[1])
    answer = posed(network.tree, motion["rotations"], sizes[1]["offsets"], goals)
    rotations = target_body.turned(copy, answer.turned[0].numpy())
    root = transfer.root_from_hips(target, rotations, answer.positions[0, :, 0].numpy())
    pose = Pose.of(target.motion(rotations, root, source.fps))
    longer = corrections.scale.item()
    ratios = root_rules.ratios(rule, source.character, target) * [longer, 1.0, longer]
    plant(Exchange(source, rig_of(source.character), rig_of(target), pose, ratios))
    return pose.rotations, pose.root


def _arrays(body: RoleBody, motion: Motion) -> dict[str, Tensor]:
    return {name: torch.from_numpy(array)[None] for name, array in body.see(motion).items()}


def _sizes(body: RoleBody, dtype: torch.dtype) -> dict[str, Tensor]:
    return {
        "offsets": torch.from_numpy(body.offsets)[None].to(dtype),
        "lengths": torch.from_numpy(body.lengths)[None].to(dtype),
    }


def correction(
    network: Corrector, arrays: dict[str, Tensor], bodies: list[dict[str, Tensor]]
) -> Correction:
    """The correction of a source at 30 fps."""
    pieces: list[Correction] = []
    frames = arrays["hips"].shape[1]
    with torch.inference_mode():
        for first in range(0, frames, CHUNK):
            last = min(first + CHUNK, frames)
            start, end = max(first - network.reach - 1, 0), min(last + network.reach, frames)
            channels, sizes = inputs_of(
                network, {k: each[:, start:end] for k, each in arrays.items()}, *bodies
            )
            answer = network(channels, sizes, torch.ones(channels.shape[:2], dtype=torch.bool))
            inside = slice(first - start, last - start)
            pieces.append(Correction._make([*(each[:, inside] for each in answer[:-1]), answer.scale]))
    parts = [torch.cat(each, 1) for each in zip(*(part[:-1] for part in pieces), strict=True)]
    return Correction._make([*parts, pieces[0].scale])


def at_rate(corrections: Correction, source: Motion, frames: int) -> Correction:
    """A correction at 30 fps at the source's own rate, in double precision."""
    low, share = rates.between(source.frames, source.fps, FPS, frames)
    parts = [
        torch.from_numpy(interpolated(each[0].double().numpy(), low, share))[None]
        for each in corrections[:-1]
    ]
    return Correction._make([*parts, corrections.scale.double()])
