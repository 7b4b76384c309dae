"""The features of motions that networks of edges read and write."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from retarget_bench.motion import facing, root_rules
from retarget_bench.motion.character import Character
from retarget_bench.motion.motion import Motion
from retarget_bench.motion.rates import FPS
from retarget_bench.training.layers.skeletal.body import LayoutBody

CENTIMETRE = 0.01
"""Metres: the unit of the published networks."""
RULE = "hip_height"
MIDDLING = 90.0
"""Height of the hips of every body in its own unit, with ``lengths=body``."""
Root = Literal["velocity", "position", "height"]
Lengths = Literal["world", "body"]
Yaw = Literal["predicted", "source"]
Path = Literal["decoded", "relative", "steady", "carried"]


@dataclass(frozen=True)
class Features:
    """The choice of features: four channels per edge and frame, and four of the root.

    root: the root's channels. ``velocity`` (paper): left, up, ahead of every frame as seen from where the
    body faces, in units per frame, and its turn in radians per frame. ``height``: the same, but how high
    the hips are instead of how they rise, so that errors of height do not add up. ``position`` (released
    code): the root in the world, and zero; rotations are not relative to where the body faces.
    lengths: the unit, centimetres (``world``), or such that the hips of every body are as high at rest
    (``body``): a movement that is copied then is one that is scaled.
    facing: frames over which the direction that a body faces is averaged.
    path: ``decoded``: the root's channels of an answer are the decoder's output (as published);
    ``relative``: likewise, and what the path differs by from the source's fades (``root_rules.relative``);
    ``steady``: and of that, movement that differs for long adds nothing (``without_bias``);
    ``carried``: the source's channels, in the target's unit, plus that output.
    """

    root: Root
    lengths: Lengths
    facing: float
    path: Path = "decoded"

    @property
    def local(self) -> bool:
        """True if bodies are seen from where they face."""
        return self.root != "position"

    def unit(self, character: Character) -> float:
        """Metres."""
        return character.measures.hip_height / MIDDLING if self.lengths == "body" else CENTIMETRE

    def bones(self, body: LayoutBody, end_sites: Sequence[int] = (), root_bone: bool = False) -> np.ndarray:
        """``(edges + 1 + end sites, 3)`` float32, in units; zero for the root's movement.

        end_sites: joints of the layout whose ``LayoutBody.end_sites`` come last. root_bone: with
        ``LayoutBody.root_bone`` in the place of that zero."""
        last = [body.end_sites[joint][None] for joint in end_sites]
        root = body.root_bone if root_bone else np.zeros(3)
        bones = np.concatenate([body.bones, root[None], *last])
        return (bones / self.unit(body.character)).astype(np.float32)

    def see(self, motion: Motion, body: LayoutBody) -> Mapping[str, np.ndarray]:
        """A motion at 30 frames per second as arrays ``(frames, ...)``.

        edges: ``(edges + 1, 4)`` rotations, and the root's channels in the last row.
        turn:  ``(2,)`` where the body faces, the parts of a unit complex number.
        hips:  ``(3,)`` where they (or the layout's root) are, in units.
        """
        hips = body.root(motion) / self.unit(motion.character)
        if self.local:
            turn = facing.facing(motion.positions, motion.character, self.facing)
            rotations = body.see(motion, facing.rotation(turn))
        else:
            turn = np.ones(motion.frames, dtype=complex)
            rotations = body.see(motion, None)
        edges = np.concatenate([rotations, self.root_of(hips, turn)[:, None]], axis=1)
        return {"edges": edges, "turn": facing.parts(turn), "hips": hips}

    def root_of(self, hips: np.ndarray, turn: np.ndarray) -> np.ndarray:
        """``(frames, 4)``; the first frame moves as the second does."""
        if self.root == "position":
            return np.concatenate([hips, np.zeros((len(hips), 1))], axis=1)
        steps = facing.seen(np.diff(hips, axis=0, prepend=hips[:1]), turn)
        turns = np.angle(turn * np.concatenate([turn[:1], turn[:-1]]).conj())
        moves = np.concatenate([steps, turns[:, None]], axis=1)
        moves[:1] = moves[1:2] if len(moves) > 1 else moves[:1]
        if self.root == "height":
            moves[:, 1] = hips[:, 1]
        return moves

    def motion(
        self,
        body: LayoutBody,
        edges: np.ndarray,
        source: Mapping[str, np.ndarray],
        ratios: np.ndarray,
        yaw: Yaw,
        ends: np.ndarray | None,
    ) -> Motion:
        """The motion that an answer ``(frames, edges + 1, 4)`` means.

        source: what ``see`` gave of the source. ratios: ``(3,)`` what the places of its hips are scaled by,
        metres of the target per unit of the source. ends: see ``LayoutBody.motion``.
        """
        edges = np.asarray(edges, dtype=np.float64)
        root, unit = edges[:, -1], self.unit(body.character)
        lead, faced = source["hips"] * ratios, None
        hips = root[:, :3] * unit
        if self.local:
            turn = source["turn"][:, 0] + 1j * source["turn"][:, 1]
            turns, steps = root[1:, 3], root[:, :3].copy()
            if yaw == "predicted":
                turn = turn[0] * np.exp(1j * np.concatenate([[0.0], np.cumsum(turns)]))
            if self.root == "height":
                steps[:, 1] = 0.0
            steps[0] = 0.0
            hips = lead[0] + np.cumsum(facing.placed(steps, turn), axis=0) * unit
            if self.root == "height":
                hips[:, 1] = root[:, 1] * unit
            faced = facing.rotation(turn)
        if self.path == "relative":
            hips = root_rules.relative(hips, lead, FPS)
        elif self.path == "steady":
            hips = without_bias(hips, lead, FPS)
        return body.motion(edges[:, :-1], faced, hips, FPS, ends)

    def ratios(self, source: Character, target: Character) -> np.ndarray:
        """``(3,)`` metres of the target per unit of the source, for the places of hips."""
        return root_rules.ratios(RULE, source, target) * self.unit(source)


def without_bias(path: np.ndarray, lead: np.ndarray, fps: float) -> np.ndarray:
    """``root_rules.relative``, for steps that differ for long: from the difference of every step its mean
    before that step is taken, which follows within ``root_rules.MEMORY`` seconds and begins with the first.

    So a path that moves at another velocity than ``lead``, always by as much, is ``lead``. Both
    ``(frames, 3)``.
    """
    steps = np.diff(path - lead, axis=0)
    if not len(steps):
        return lead
    share = -math.expm1(-1.0 / (fps * root_rules.MEMORY))
    means = share * root_rules.fading(steps, fps, steps[0] / share)
    changes = steps - np.concatenate([steps[:1], means[:-1]])
    return lead + root_rules.fading(np.concatenate([np.zeros_like(lead[:1]), changes]), fps)


def unfit(character: Character, features: Features) -> str:
    """Reason why a body has no such features; "" where it has."""
    if features.local and (why := facing.unknown(character)):
        return why
    return root_rules.reason(RULE, character, character) or ""
