"""Retargeting by NPT: frame by frame, with the path that the network does not answer."""

import numpy as np
import torch

from retarget_bench.motion import scan_path
from retarget_bench.motion.character import Character
from retarget_bench.motion.motion import PointSets, Surface

from .network import PoseTransfer
from .surfaces import Identity, drawn

CHUNK = 8
"""Frames that go through the network at once."""


def retargeted(
    network: PoseTransfer, source: PointSets, target: Character, numbers: np.random.Generator
) -> Surface:
    """The target's vertices in the pose of each frame's points, on the source's path.

    The network puts every pose in the middle of the world; ``scan_path.along`` moves it from there.
    """
    identity = Identity.of(target)
    count, device = len(identity.vertices), network.answer.weight.device
    scaled = [identity.scale * (points - scan_path.centre(points)) for points in source.points]
    resting = torch.as_tensor(identity.scale * identity.vertices, dtype=torch.float32, device=device)
    vertices = np.empty((source.frames, count, 3))
    for first in range(0, source.frames, CHUNK):
        part = slice(first, first + CHUNK)
        points = torch.as_tensor(drawn(numbers, scaled[part], count), dtype=torch.float32, device=device)
        with torch.inference_mode():
            answer = network(points, resting.expand(len(points), -1, -1))
        vertices[part] = answer.cpu().numpy() / identity.scale
    ratio = scan_path.ratio(source.points, target)
    return target.surface(scan_path.along(vertices, source.points, ratio), source.fps)
