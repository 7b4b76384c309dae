"""Retargeting by R2ET: every frame on its own, with the changes that the two bodies ask for."""

import numpy as np
import torch

from retarget_bench.motion import rotation
from retarget_bench.motion.body22 import Body22
from retarget_bench.motion.character import Character
from retarget_bench.motion.motion import Motion

from . import features
from .network import SkeletonAwareNetwork

CHUNK = 512
"""Frames that go through the network at a time: memory does not grow with a clip's length."""


def retargeted(
    network: SkeletonAwareNetwork,
    source: Motion,
    target: Character,
    smoothing: float,
    size: features.Size,
    chunk: int = CHUNK,
) -> Motion:
    """The source on the target, by a network in evaluation mode. ``chunk`` does not change the result."""
    local, hips = Body22.of(source.character).see(source)
    changes = changed(network, features.rotations(source, smoothing), source.character, target, chunk)
    turned = rotation.multiply(local, changes.astype(np.float64))
    turned[:, list(features.LEAVES)] = local[:, list(features.LEAVES)]
    target_hips = features.path(hips, source.character, target, size)
    turned = rotation.continuous(rotation.normalise(turned))
    return Body22.of(target).motion(turned, target_hips, source.fps)


def changed(
    network: SkeletonAwareNetwork,
    rotations: np.ndarray,
    source: Character,
    target: Character,
    chunk: int = CHUNK,
) -> np.ndarray:
    """``(frames, 22, 4)`` changes of rotations ``(frames, 22, 4)``, see ``features.rotations``."""
    device = network.join.weight.device
    bones = torch.from_numpy(np.stack([features.offsets(each) for each in (source, target)])).to(device)
    with torch.inference_mode():
        codes = network.bones(bones)
        parts = [
            network(torch.from_numpy(rotations[first : first + chunk]).to(device), *codes)
            for first in range(0, len(rotations), chunk)
        ]
        return torch.cat(parts).cpu().numpy()
