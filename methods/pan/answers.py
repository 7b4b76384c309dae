"""Cases of one length and one pair of structures, answered together."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import torch
from torch import Tensor

from retarget_bench.api import Context
from retarget_bench.errors import NotSupported
from retarget_bench.motion import rates
from retarget_bench.motion.character import Character
from retarget_bench.motion.motion import Motion

from .body import Body
from .inference import answered
from .windows import moments

if TYPE_CHECKING:
    from . import Pan


@dataclass(frozen=True, eq=False)
class _Question:
    source: Motion
    seen: dict[str, Any]
    body: Body
    actor: Body
    statistics: tuple[Tensor, Tensor]


class Answers:
    """Ask all questions, then take all answers, which come in the same order."""

    def __init__(self, method: Pan) -> None:
        self._method = method
        self._questions: list[_Question] = []
        self._groups: dict[tuple[str, str, int, str], list[int]] = {}

    def ask(self, source: Motion, target: Character, context: Context) -> None:
        """supports has been asked."""
        here, there = self._method.seat(source.character), self._method.seat(target)
        actor, body = here.taken, there.taken
        shown = rates.at_thirty(source)
        assert isinstance(shown, Motion)
        seen = dict(self._method.settings.form.see(shown, actor))
        if self._method.tips == "copied":
            seen["tips"] = _tips(shown, actor, body)
        key = (here.structure, there.structure, shown.frames, context.device)
        self._groups.setdefault(key, []).append(len(self._questions))
        statistics = (
            self._of(here.structure, source.character),
            self._target(there.structure, body, context),
        )
        self._questions.append(_Question(source, seen, body, actor, statistics))

    def given(self) -> list[Motion]:
        found: dict[int, Motion] = {}
        for (here, there, _, device), rows in self._groups.items():
            asked = [self._questions[row] for row in rows]
            form, structures = self._method.settings.form, self._method.structures
            slots = answered(
                structures[here].to(device),
                structures[there].to(device),
                np.stack([each.seen["slots"] for each in asked]),
                np.stack([form.bones(each.body) for each in asked]),
                (
                    torch.stack([each.statistics[0] for each in asked]),
                    torch.stack([each.statistics[1] for each in asked]),
                ),
                form.path == "carried",
            )
            for row, each, answer in zip(rows, asked, slots, strict=True):
                found[row] = self._motion(each, answer)
        return [found[number] for number in range(len(self._questions))]

    def _motion(self, asked: _Question, slots: np.ndarray) -> Motion:
        form, actor, body = self._method.settings.form, asked.actor.character, asked.body
        ratio = form.ratio(actor, body.character)
        yaw = self._method.settings.yaw
        motion = form.motion(body, slots, asked.seen, ratio, yaw, asked.seen.get("tips"))
        return rates.back(motion, asked.source)

    def _of(self, name: str, character: Character) -> Tensor:
        """``(2, slots + 1, 4)``: of a character that was trained on, else of all of the structure."""
        structure = self._method.structures[name]
        (row,) = structure.which([character.name])
        return torch.stack([structure.mean[row], structure.deviation[row]])

    def _target(self, name: str, body: Body, context: Context) -> Tensor:
        """Those of its reference motions where the method is given them (the published leak)."""
        method = self._method
        if method.target_stats != "own":
            return self._of(name, body.character)
        shown = map(rates.at_thirty, context.target_motions or ())
        seen = [method.settings.form.see(each, body)["slots"] for each in shown if isinstance(each, Motion)]
        if not seen:
            raise NotSupported(f"there is no motion of {body.character.name} to take statistics of")
        return torch.stack(moments(np.concatenate(seen), method.settings.still))


def _tips(source: Motion, actor: Body, body: Body) -> np.ndarray:
    """``(frames, joints of the target's layout, 4)``: how ends of chains are turned relative to their
    parents, by role; at rest where the source has none, or where they belong to no part."""
    turned, place = actor.ends_of(source), {role: n for n, role in enumerate(actor.layout.roles) if role}
    found = np.zeros((len(turned), len(body.joints), 4))
    found[..., 0] = 1.0
    for joint, role in enumerate(body.layout.roles):
        there = place.get(role or "", 0)
        known = there > 0 and joint > 0 and actor.joints[there] >= 0
        if known and actor.layout.encoded[there - 1] and body.layout.encoded[joint - 1]:
            found[:, joint] = turned[:, there]
    return found
