"""Retargeting by SAME: a code of every frame by the source's graph, and its pose on the target's."""

import numpy as np
import torch

from retarget_bench.motion import rates, root_rules, rotation, transfer
from retarget_bench.motion.character import Character
from retarget_bench.motion.motion import Motion
from retarget_bench.training.phases import to_device

from .bodies import CM, RATIO, body
from .features import FPS, see, twist
from .graph import Graphs, Nodes, matrices
from .network import Answer, Autoencoder

CHUNK = 1024
"""Frames that go through the network at once."""


def retargeted(
    network: Autoencoder, source: Motion, target: Character, path: root_rules.PathKind = "integrated"
) -> Motion:
    """The source on the target, at its own rate, by a network in evaluation mode."""
    shown = rates.at_thirty(source)
    assert isinstance(shown, Motion)
    answer = answered(network, shown, target)
    target_body = body(target)
    joints = len(target_body.aligned.joints)
    rotations = rotation.from_matrix(matrices(answer.columns[:joints].double()).transpose(0, 1).numpy())
    turn, hips = travelled(answer.root[0].double().numpy(), shown, target, path)
    rotations[:, 0] = rotation.multiply(turn, rotations[:, 0])
    motion = target_body.aligned.motion(rotation.continuous(rotations), hips, FPS)
    return rates.back(motion, source)


def answered(network: Autoencoder, source: Motion, target: Character) -> Answer:
    """The network's answer to a source at 30 fps, for the nodes of the target's graph; on the CPU."""
    device = next(network.parameters()).device
    inputs = torch.from_numpy(see(body(source.character), source)).transpose(0, 1)
    graphs = [to_device(Graphs.of([Nodes.of(body(each))]), device) for each in (source.character, target)]
    chunks = []
    with torch.inference_mode():
        for first in range(0, source.frames, CHUNK):
            codes = network.encode(inputs[:, first : first + CHUNK].to(device), graphs[0])
            chunks.append([each.cpu() for each in network.decode(codes, graphs[1])])
    return Answer(*(torch.cat(each, 1) for each in zip(*chunks, strict=True)))


def travelled(
    moves: np.ndarray, source: Motion, target: Character, path: root_rules.PathKind
) -> tuple[np.ndarray, np.ndarray]:
    """The hips' facing ``(frames, 4)`` and positions ``(frames, 3)`` metres, by moves ``(frames, 4)`` of an
    answer. They begin where the source's, scaled to the target, are."""
    orientations = transfer.relative(source)[:, source.character.joint_of["hips"]]
    facing = twist(orientations)
    lead = np.unwrap(2.0 * np.arctan2(facing[:, 2], facing[:, 0]))
    ahead = transfer.hips(source) * root_rules.ratios(RATIO, source.character, target)
    turned, hips = integrated(moves, float(lead[0]), ahead[0])
    if path == "relative":
        turned, hips = (root_rules.relative(each, to, FPS) for each, to in ((turned, lead), (hips, ahead)))
    return rotation.about(np.array([0.0, 1.0, 0.0]), turned), hips


def integrated(moves: np.ndarray, turn: float, start: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Angles ``(frames,)`` and places ``(frames, 3)`` metres that moves ``(frames, 4)`` add up to.

    turn, start: ``(3,)`` of the first frame, whose own moves do not count; of places, level only.
    """
    angles = turn + np.concatenate([[0.0], np.cumsum(moves[1:, 0])])
    left, ahead = moves[1:, 1] / CM, moves[1:, 2] / CM
    cos, sin = np.cos(angles[:-1]), np.sin(angles[:-1])
    steps = np.stack([left * cos + ahead * sin, ahead * cos - left * sin], -1)
    level = start[[0, 2]] + np.concatenate([np.zeros((1, 2)), np.cumsum(steps, axis=0)])
    return angles, np.stack([level[:, 0], moves[:, 3] / CM, level[:, 1]], -1)
