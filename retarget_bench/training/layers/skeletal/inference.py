"""Retargeting by networks of structures, many cases together, long clips in pieces."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
import torch
from torch import Tensor

from retarget_bench.api import Context
from retarget_bench.errors import NotSupported
from retarget_bench.motion import rates, rotation
from retarget_bench.motion.character import Character
from retarget_bench.motion.motion import Motion
from retarget_bench.training.layers.skeletal.body import LayoutBody
from retarget_bench.training.layers.skeletal.features import Yaw
from retarget_bench.training.layers.skeletal.structure import StructureNetworks
from retarget_bench.training.layers.skeletal.windows import statistics_of

PIECE = 2048
"""Frames that go through the networks at once: memory does not grow with a clip's length."""
MARGIN = 64
"""Context frames on both sides of a piece: more than four convolutions reach."""
STEP = 4
"""The number of frames is a multiple of this."""
LEAST = 16
"""Frames: shorter clips are lengthened, since convolutions mirror what is beyond the ends."""


Assigned = tuple[str, LayoutBody]
"""The key of a structure, and a body in its layout."""


class Retargeter(Protocol):
    """The part of a method that retargeting reads; see ``SkeletalMethod``."""

    settings: Any
    config: Any
    yaw: Yaw

    @property
    def root_bone(self) -> bool: ...
    @property
    def structures(self) -> Mapping[str, StructureNetworks]: ...

    def assigned(self, character: Character) -> Assigned: ...


@dataclass(frozen=True, eq=False)
class Question:
    """A case: what the features of the source's motion are, on which bodies, by whose statistics.

    structures: of source and target. inputs: see ``Features.see``, at 30 frames per second. tips: see
    ``tips``; None: at rest. statistics: of source and target, each ``(2, edges + 1, 4)``: mean and
    deviation.
    """

    source: Motion
    structures: tuple[str, str]
    inputs: Mapping[str, np.ndarray]
    actor: LayoutBody
    body: LayoutBody
    tips: np.ndarray | None
    statistics: tuple[Tensor, Tensor]


def retargeted(
    method: Retargeter,
    sources: Sequence[Motion],
    bodies: Sequence[Assigned],
    contexts: Sequence[Context],
) -> list[Motion]:
    """The motions of the bodies, each by the networks of the structure that stands before it.

    Cases of one length and one pair of structures go through the networks together.
    """
    features, structures = method.settings.features, method.structures
    groups: dict[tuple[str, str, int, str], list[int]] = {}
    questions = []
    for number, (source, body, context) in enumerate(zip(sources, bodies, contexts, strict=True)):
        question = _question(method, source, body, context)
        questions.append(question)
        key = (*question.structures, len(question.inputs["edges"]), context.device)
        groups.setdefault(key, []).append(number)
    motions: dict[int, Motion] = {}
    for (first, second, _, device), rows in groups.items():
        group = [questions[row] for row in rows]
        source_statistics, target_statistics = (
            torch.stack(each) for each in zip(*(q.statistics for q in group), strict=True)
        )
        edges = answered(
            structures[first].to(device),
            structures[second].to(device),
            np.stack([each.inputs["edges"] for each in group]),
            (
                np.stack([features.bones(each.actor, root_bone=method.root_bone) for each in group]),
                np.stack([features.bones(each.body, root_bone=method.root_bone) for each in group]),
            ),
            (source_statistics, target_statistics),
            features.path == "carried",
        )
        for row, each, answer in zip(rows, group, edges, strict=True):
            ratios = features.ratios(each.actor.character, each.body.character)
            motion = features.motion(each.body, answer, each.inputs, ratios, method.yaw, each.tips)
            motions[row] = rates.back(motion, each.source)
    return [motions[number] for number in range(len(questions))]


def _question(method: Retargeter, source: Motion, target: Assigned, context: Context) -> Question:
    (here, actor), (there, body) = method.assigned(source.character), target
    shown = rates.at_thirty(source)
    assert isinstance(shown, Motion)
    ends = tips(shown, actor, body) if method.config.tips == "copied" else None
    statistics = _statistics(method, here, actor), _statistics(method, there, body, context)
    inputs = method.settings.features.see(shown, actor)
    return Question(source, (here, there), inputs, actor, body, ends, statistics)


def _statistics(method: Retargeter, name: str, body: LayoutBody, context: Context | None = None) -> Tensor:
    """``(2, edges + 1, 4)``: of a character that was trained on, else of all of the structure.

    context: of a target. With ``target_stats=own`` they are those of its reference motions (the published
    leak).
    """
    structure, character = method.structures[name], body.character
    if context is None or method.config.target_stats != "own":
        (row,) = structure.statistics_row([character.name])
        return torch.stack([structure.mean[row], structure.deviation[row]]).cpu()
    shown = map(rates.at_thirty, context.target_motions or ())
    see = method.settings.features.see
    edges = [see(each, body)["edges"] for each in shown if isinstance(each, Motion)]
    if not edges:
        raise NotSupported(f"there is no motion of {character.name} to take statistics of")
    return torch.stack(statistics_of(np.concatenate(edges), method.settings.least_deviation))


def answered(
    source: StructureNetworks,
    target: StructureNetworks,
    edges: np.ndarray,
    bones: tuple[np.ndarray, np.ndarray],
    statistics: tuple[Tensor, Tensor],
    carried: bool,
) -> np.ndarray:
    """Edge channels ``(rows, frames, edges + 1, 4)`` of the targets.

    edges: those of the sources. bones: of sources and of targets ``(rows, edges + 1, 3)``. statistics: of
    each source and of each target ``(rows, 2, edges + 1, 4)``, mean and deviation. carried: see
    ``Features.path``.
    """
    frames = edges.shape[1]
    device = target.mean.device
    padded = torch.from_numpy(_lengthened(edges)).to(device)
    source_statistics, target_statistics = (each.to(device) for each in statistics)
    actors, bodies = (torch.from_numpy(each).to(device) for each in bones)
    out = []
    with torch.inference_mode():
        normalised = (padded - source_statistics[:, :1]) / source_statistics[:, 1:]
        for first in range(0, padded.shape[1], PIECE):
            start, end = max(first - MARGIN, 0), min(first + PIECE + MARGIN, padded.shape[1])
            code = target.rearranged(source.code(normalised[:, start:end], actors), source.layout)
            out.append(target.answer(code, bodies)[:, first - start :][:, :PIECE])
        plain = torch.cat(out, 1)[:, :frames] * target_statistics[:, 1:] + target_statistics[:, :1]
        if carried:
            plain[:, :, -1] += padded[:, :frames, -1] - target_statistics[:, 0, -1:]
    return np.asarray(plain.cpu().numpy())


def _lengthened(edges: np.ndarray) -> np.ndarray:
    """With the last frame repeated up to a number of frames that the networks take."""
    frames = edges.shape[1]
    length = max(-(-frames // STEP) * STEP, LEAST)
    return np.pad(edges, ((0, 0), (0, length - frames), (0, 0), (0, 0)), mode="edge").astype(np.float32)


def tips(source: Motion, actor: LayoutBody, body: LayoutBody) -> np.ndarray:
    """Local rotations of ends of chains ``(frames, joints of the target's layout, 4)``, copied by role.

    At rest where the source has no such joint, or where it belongs to no part.
    """
    turned, place = actor.ends_of(source), {role: n for n, role in enumerate(actor.layout.roles) if role}
    rotations = rotation.identity(len(turned), len(body.joints))
    for joint, role in enumerate(body.layout.roles):
        there = place.get(role or "", 0)
        shared = there > 0 and joint > 0 and actor.joints[there] >= 0
        if shared and actor.layout.encoded[there] and body.layout.encoded[joint]:
            rotations[:, joint] = turned[:, there]
    return rotations
