"""Retargeting by PAN, many cases together, long clips in pieces; and the attention of the first layer."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import torch
from torch import Tensor

from retarget_bench.api import Context
from retarget_bench.errors import NotSupported
from retarget_bench.motion import rates
from retarget_bench.motion.character import Character, interpolated
from retarget_bench.motion.motion import Motion

from .body import Assignment, PanBody
from .network import body_parts
from .structure import Structure, arranged
from .training_data import statistics_of

if TYPE_CHECKING:
    from . import Pan

PIECE = 2048
"""Frames that go through the networks at once: memory does not grow with a clip's length."""
MARGIN = 64
"""Context frames on both sides of a piece: more than four convolutions reach."""
STEP = 4
"""What a number of frames has to be a multiple of."""
LEAST = 16
"""Frames: shorter clips are lengthened, since convolutions mirror what is beyond the ends."""


@dataclass(frozen=True, eq=False)
class _Question:
    """A case: what the features of the source's motion are, on which bodies, by whose statistics.

    seen: see ``Features.see``. statistics: of source and target, each ``(2, edges + 1, 4)``: mean and
    deviation.
    """

    source: Motion
    seen: Mapping[str, np.ndarray]
    actor: PanBody
    body: PanBody
    tips: np.ndarray | None
    statistics: tuple[Tensor, Tensor]


def retargeted(
    method: Pan, sources: Sequence[Motion], targets: Sequence[Character], contexts: Sequence[Context]
) -> list[Motion]:
    """The motions of targets that the method supports.

    Cases of one length and one pair of structures go through the networks together.
    """
    features, structures = method.settings.features, method.structures
    groups: dict[tuple[str, str, int, str], list[int]] = {}
    questions = []
    for number, (source, target, context) in enumerate(zip(sources, targets, contexts, strict=True)):
        here, there = method.assignment(source.character), method.assignment(target)
        shown = rates.at_thirty(source)
        assert isinstance(shown, Motion)
        tips = _tips(shown, here.body, there.body) if method.tips == "copied" else None
        statistics = _statistics(method, here), _statistics(method, there, context)
        seen = features.see(shown, here.body)
        questions.append(_Question(source, seen, here.body, there.body, tips, statistics))
        key = (here.structure, there.structure, shown.frames, context.device)
        groups.setdefault(key, []).append(number)
    found: dict[int, Motion] = {}
    for (first, second, _, device), rows in groups.items():
        asked = [questions[row] for row in rows]
        given, wanted = (torch.stack(each) for each in zip(*(q.statistics for q in asked), strict=True))
        edges = answered(
            structures[first].to(device),
            structures[second].to(device),
            np.stack([each.seen["edges"] for each in asked]),
            np.stack([features.bones(each.body) for each in asked]),
            (given, wanted),
            features.path == "carried",
        )
        for row, each, answer in zip(rows, asked, edges, strict=True):
            ratio = features.ratio(each.actor.character, each.body.character)
            motion = features.motion(each.body, answer, each.seen, ratio, method.settings.yaw, each.tips)
            found[row] = rates.back(motion, each.source)
    return [found[number] for number in range(len(questions))]


def _statistics(method: Pan, assignment: Assignment, context: Context | None = None) -> Tensor:
    """``(2, edges + 1, 4)``: of a character that was trained on, else of all of the structure.

    context: of a target. With ``target_stats=own`` they are those of its reference motions (the published
    leak).
    """
    structure, character = method.structures[assignment.structure], assignment.body.character
    if context is None or method.target_stats != "own":
        (row,) = structure.statistics_row([character.name])
        return torch.stack([structure.mean[row], structure.deviation[row]])
    shown = map(rates.at_thirty, context.target_motions or ())
    see = method.settings.features.see
    seen = [see(each, assignment.body)["edges"] for each in shown if isinstance(each, Motion)]
    if not seen:
        raise NotSupported(f"there is no motion of {character.name} to take statistics of")
    return torch.stack(statistics_of(np.concatenate(seen), method.settings.least_deviation))


def answered(
    source: Structure,
    target: Structure,
    edges: np.ndarray,
    bones: np.ndarray,
    statistics: tuple[Tensor, Tensor],
    carried: bool,
) -> np.ndarray:
    """Edge channels ``(rows, frames, edges + 1, 4)`` of the targets.

    edges: those of the sources. bones: ``(rows, edges + 1, 3)``. statistics: of each source and of each
    target ``(rows, 2, edges + 1, 4)``, mean and deviation. carried: see ``Features.path``.
    """
    frames = edges.shape[1]
    device = target.mean.device
    whole = torch.from_numpy(_lengthened(edges)).to(device)
    given, wanted = (each.to(device) for each in statistics)
    seen = (whole - given[:, :1]) / given[:, 1:]
    body = torch.from_numpy(bones).to(device)
    out = []
    with torch.inference_mode():
        for first in range(0, whole.shape[1], PIECE):
            start, end = max(first - MARGIN, 0), min(first + PIECE + MARGIN, whole.shape[1])
            code = arranged(source.encoder(seen[:, start:end]), source.layout, target.layout)
            answer = target.answer(code, body)
            out.append(answer[:, first - start :][:, :PIECE])
    plain = torch.cat(out, 1)[:, :frames] * wanted[:, 1:] + wanted[:, :1]
    if carried:
        plain[:, :, -1] += whole[:, :frames, -1] - wanted[:, 0, -1:]
    return np.asarray(plain.cpu().numpy())


def _lengthened(edges: np.ndarray) -> np.ndarray:
    """With the last frame repeated up to a number of frames that the networks take."""
    frames = edges.shape[1]
    wanted = max(-(-frames // STEP) * STEP, LEAST)
    return np.pad(edges, ((0, 0), (0, wanted - frames), (0, 0), (0, 0)), mode="edge").astype(np.float32)


def _tips(source: Motion, actor: PanBody, body: PanBody) -> np.ndarray:
    """Local rotations of ends of chains ``(frames, joints of the target's layout, 4)``, copied by role.

    At rest where the source has no such joint, or where it belongs to no part.
    """
    turned, place = actor.ends_of(source), {role: n for n, role in enumerate(actor.layout.roles) if role}
    found = np.zeros((len(turned), len(body.joints), 4))
    found[..., 0] = 1.0
    for joint, role in enumerate(body.layout.roles):
        there = place.get(role or "", 0)
        known = there > 0 and joint > 0 and actor.joints[there] >= 0
        if known and actor.layout.encoded[there] and body.layout.encoded[joint]:
            found[:, joint] = turned[:, there]
    return found


def attended(method: Pan, source: Motion) -> dict[str, Any]:
    """Attention weights of the first layer by joint of the source (section 6.2.2).

    The entries of ``retarget_bench.evaluation.attention.Attention``, for a source that the method supports.
    The weight of an edge is shown at the joint that it leads to, that of the root's channels at the hips.
    Edges that lead to no joint of this body are left out.
    Raises NotSupported where the networks have no attention.
    """
    assignment, settings = method.assignment(source.character), method.settings
    structure, body = method.structures[assignment.structure], assignment.body
    if not settings.design.attention:
        raise NotSupported("pan[attention=false] has an MLP in the place of attention, and no weights")
    shown = rates.at_thirty(source)
    assert isinstance(shown, Motion)
    seen = torch.from_numpy(settings.features.see(shown, body)["edges"].astype(np.float32))
    (row,) = structure.statistics_row([source.character.name])
    normalised = structure.normalised(seen.unsqueeze(0), torch.tensor([row]))
    with torch.inference_mode():
        pieces = torch.split(normalised, PIECE, 1)
        found = [structure.encoder.attention(piece)[0].numpy() for piece in pieces]
    leads, given = body.layout.leads, np.concatenate(found)
    if body.layout.slots == "joints":  # the hips' rotation and the root's movement are one joint's
        given[:, :, -1] += given[:, :, 0]
    led = [edge for edge, joint in enumerate(leads) if joint > 0 and body.joints[joint] >= 0]
    order = [body.layout.edges, *led]
    joints = [body.joints[0], *(body.joints[leads[edge]] for edge in led)]
    parts = body_parts(body.layout, settings.design)
    sees = np.array([[edge in part for edge in order] for part in parts])
    kept = sees.any(axis=0)
    low, share = rates.between(source.frames, source.fps, rates.FPS, shown.frames)
    weights = interpolated(given[:, :, order], low, share)
    return {
        "parts": body.layout.names if settings.design.by_part else ("whole body",),
        "joints": np.array(joints)[kept],
        "sees": sees[:, kept],
        "weights": weights[:, :, kept],
        "note": assignment.note,
    }
