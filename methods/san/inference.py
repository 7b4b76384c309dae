"""Retargeting by SAN, many cases together, long clips in pieces."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import torch
from torch import Tensor

from retarget_bench.api import Context
from retarget_bench.errors import NotSupported
from retarget_bench.motion import rates, rotation
from retarget_bench.motion.character import Character
from retarget_bench.motion.motion import Motion

from ..pan.body import PanBody
from ..pan.training_data import statistics_of
from .losses import carried
from .structure import Structure

if TYPE_CHECKING:
    from . import San

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
    """A case: source and target in their layouts, and the source's features (``Features.see``).

    statistics: of source and target, each ``(2, slots, 4)``: mean and deviation."""

    source: Motion
    seen: Mapping[str, np.ndarray]
    actor: PanBody
    body: PanBody
    tips: np.ndarray | None
    statistics: tuple[Tensor, Tensor]


def retargeted(
    method: San, sources: Sequence[Motion], targets: Sequence[Character], contexts: Sequence[Context]
) -> list[Motion]:
    """The motions of targets that the method supports.

    Cases of one length and one pair of structures go through the networks together.
    """
    features = method.settings.features
    groups: dict[tuple[str, str, int, str], list[int]] = {}
    questions = []
    for number, (source, target, context) in enumerate(zip(sources, targets, contexts, strict=True)):
        question = _question(method, source, target, context)
        questions.append(question)
        names = method.structure(source.character), method.structure(target)
        groups.setdefault((*names, len(question.seen["edges"]), context.device), []).append(number)
    found: dict[int, Motion] = {}
    for (first, second, _, device), rows in groups.items():
        asked = [questions[row] for row in rows]
        structures = tuple(method.structures[name].to(device) for name in (first, second))
        for row, each, edges in zip(rows, asked, _answered(method, structures, asked), strict=True):
            ratio = features.ratio(each.actor.character, each.body.character)
            motion = features.motion(each.body, edges, each.seen, ratio, "source", each.tips)
            found[row] = rates.back(motion, each.source)
    return [found[number] for number in range(len(questions))]


def _question(method: San, source: Motion, target: Character, context: Context) -> _Question:
    shown = rates.at_thirty(source)
    assert isinstance(shown, Motion)
    actor, body = method.body(source.character), method.body(target)
    tips = _tips(shown, actor, body) if method.tips == "copied" else None
    statistics = _statistics(method, actor), _statistics(method, body, context)
    return _Question(source, method.settings.features.see(shown, actor), actor, body, tips, statistics)


def _statistics(method: San, body: PanBody, context: Context | None = None) -> Tensor:
    """``(2, slots, 4)``: of a character that was trained on, else of all of the structure.

    context: of a target. With ``target_stats=own`` they are those of its reference motions (the published
    leak)."""
    character, see = body.character, method.settings.features.see
    if context is None or method.target_stats != "own":
        structure = method.structures[method.structure(character)]
        (row,) = structure.statistics_row([character.name])
        return torch.stack([structure.mean[row], structure.deviation[row]]).cpu()
    shown = map(rates.at_thirty, context.target_motions or ())
    seen = [see(each, body)["edges"] for each in shown if isinstance(each, Motion)]
    if not seen:
        raise NotSupported(f"there is no motion of {character.name} to take statistics of")
    return torch.stack(statistics_of(np.concatenate(seen), method.settings.least_deviation))


def _answered(
    method: San, structures: tuple[Structure, ...], asked: Sequence[_Question]
) -> Sequence[np.ndarray]:
    """Channels ``(frames, slots, 4)`` of each target."""
    features, (source, target) = method.settings.features, structures
    device, frames = target.mean.device, len(asked[0].seen["edges"])
    whole = torch.from_numpy(_lengthened(np.stack([each.seen["edges"] for each in asked]))).to(device)
    given, wanted = (
        torch.stack(each).to(device) for each in zip(*(one.statistics for one in asked), strict=True)
    )
    actors, bodies = (
        torch.from_numpy(np.stack([features.bones(body) for body in cast])).to(device)
        for cast in zip(*((each.actor, each.body) for each in asked), strict=True)
    )
    with torch.inference_mode():
        seen, own = (whole - given[:, :1]) / given[:, 1:], source.codes(actors)
        out = []
        for first in range(0, whole.shape[1], PIECE):
            start, end = max(first - MARGIN, 0), min(first + PIECE + MARGIN, whole.shape[1])
            code = carried(source.encoder(seen[:, start:end], own), source.layout, target.layout)
            out.append(target.answer(code, bodies)[:, first - start :][:, :PIECE])
        plain = torch.cat(out, 1)[:, :frames] * wanted[:, 1:] + wanted[:, :1]
        if features.path == "carried":
            plain[:, :, -1] += whole[:, :frames, -1] - wanted[:, 0, -1:]
    return list(plain.cpu().numpy())


def _lengthened(edges: np.ndarray) -> np.ndarray:
    """With the last frame repeated up to a number of frames that the networks take."""
    frames = edges.shape[1]
    wanted = max(-(-frames // STEP) * STEP, LEAST)
    return np.pad(edges, ((0, 0), (0, wanted - frames), (0, 0), (0, 0)), mode="edge").astype(np.float32)


def _tips(source: Motion, actor: PanBody, body: PanBody) -> np.ndarray:
    """Local rotations of ends of chains ``(frames, joints of the target's layout, 4)``, copied by role; at
    rest where the source has no such joint."""
    turned, place = actor.ends_of(source), {role: n for n, role in enumerate(actor.layout.roles) if role}
    found = rotation.identity(len(turned), len(body.joints))
    for joint, role in enumerate(body.layout.roles):
        if joint and (there := place.get(role or "", 0)):
            found[:, joint] = turned[:, there]
    return found
