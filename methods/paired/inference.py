"""Retargeting: the copy of a motion, corrected by the network, with feet held where the source's rest."""

import torch
from torch import Tensor

from retarget_bench.motion import rates, transfer
from retarget_bench.motion.character import Character, interpolated
from retarget_bench.motion.motion import Motion

from .features import FPS, RoleBody
from .feet import planted_goals
from .network import Correction, Corrector, copy_of, goals_of, inputs_of
from .pose import posed

CHUNK = 1024
"""Frames that go through the network at once."""


def retargeted(network: Corrector, source: Motion, target: Character, feet: bool = True) -> Motion:
    """The source's pose on the target with the network's correction, at the source's own rate.

    feet: hold them where the source's feet rest.
    """
    source_body, target_body = RoleBody(source.character), RoleBody(target)
    bodies = [_sizes(source_body, torch.float32), _sizes(target_body, torch.float32)]
    thirty = rates.at_thirty(source)
    assert isinstance(thirty, Motion)
    seen_at_thirty = _arrays(source_body, thirty)
    corrections = at_rate(correction(network, seen_at_thirty, bodies), source, thirty.frames)
    copied = transfer.carry(source, target, "hip_height")
    arrays = seen_at_thirty if thirty is source else _arrays(source_body, source)
    motion = {**arrays, "rotations": torch.from_numpy(target_body.see(copied)["rotations"])[None]}
    motion = {name: each.double() for name, each in motion.items()}
    start = copy_of(
        network,
        corrections.scale,
        motion,
        *(_sizes(body, torch.float64) for body in (source_body, target_body)),
    )
    sizes = _sizes(target_body, torch.float64)
    goals = goals_of(corrections, start, motion["turn"], sizes)
    if feet:
        goals = planted_goals(goals, source, copied, target_body.offsets)
    answer = posed(network.tree, motion["rotations"], sizes["offsets"], goals)
    rotations = target_body.turned(copied, answer.turned[0].numpy())
    root = transfer.root_from_hips(target, rotations, answer.positions[0, :, 0].numpy())
    return target.motion(rotations, root, source.fps)


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
