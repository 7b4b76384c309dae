"""Performances of puppets as the engine plays them, and what is measured on them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from retarget_bench.api import Contacts, Touch
from retarget_bench.datasets.puppets.generator.bodies import rigs
from retarget_bench.datasets.puppets.generator.bodies.structures import Body
from retarget_bench.datasets.puppets.generator.conventions import FPS
from retarget_bench.datasets.puppets.generator.solver.solve import Solution
from retarget_bench.motion import rotation
from retarget_bench.motion.character import Character
from retarget_bench.motion.motion import Motion
from retarget_bench.motion.transfer import relative


@dataclass(frozen=True, eq=False)
class Take:
    """One clip by one body, as the engine plays it."""

    name: str
    body: Body
    score: Any
    solution: Solution
    motion: Motion

    @cached_property
    def places(self) -> np.ndarray:
        """``(frames, parts, 3)`` metres: of the rig as the engine plays it, then of the hidden parts."""
        solved = self.body.positions(self.solution.orientations, self.solution.root)
        return np.concatenate([self.motion.positions, solved[:, self.body.structure.joints :]], axis=1)

    @cached_property
    def turned(self) -> np.ndarray:
        """``(frames, parts, 4)`` likewise: world orientations against the T-pose."""
        hidden = self.solution.orientations[:, self.body.structure.joints :]
        return np.concatenate([relative(self.motion), rotation.from_matrix(hidden)], axis=1)

    def at(self, part: str) -> np.ndarray:
        """``(frames, 3)`` metres."""
        return self.places[:, self.body.part[part]]

    def joints(self, parts: Sequence[str]) -> np.ndarray:
        """``(frames, parts, 3)`` metres."""
        return self.places[:, [self.body.part[part] for part in parts]]

    def point(self, part: str, offset: np.ndarray) -> np.ndarray:
        """``(frames, 3)``: a point of a joint's bone, given in the T-pose's axes."""
        return self.at(part) + rotation.rotate(self.turned[:, self.body.part[part]], offset)

    def relative_angle(self, inner: str, outer: str) -> np.ndarray:
        """``(frames,)`` degrees between two joints' orientations."""
        a, b = (self.turned[:, self.body.part[part]] for part in (inner, outer))
        return np.degrees(rotation.angle(a, b))

    def bend(self, top: str, middle: str, end: str) -> np.ndarray:
        """``(frames,)`` degrees between two bones; 0 is straight."""
        upper, lower = self.at(middle) - self.at(top), self.at(end) - self.at(middle)
        across = np.linalg.norm(np.cross(upper, lower), axis=-1)
        return np.degrees(np.arctan2(across, (upper * lower).sum(axis=-1)))


def played(name: str, body: Body, who: Character, score: Any, solution: Solution) -> Take:
    """A solved performance of a score, on the rig of its body."""
    motion = who.motion(rigs.rotations(solution.orientations, body, who), solution.root, FPS)
    return Take(name, body, score, solution, motion)


def touch_gap(motion: Motion, touch: Touch) -> np.ndarray:
    """Metres between a point of a body and its place on the body, in the frames in which it rests there."""
    turned, ends = relative(motion), []
    for role, offset in ((touch.end, touch.point), (touch.bearing, touch.place)):
        joint = motion.character.joint_of[role]
        ends.append(motion.positions[:, joint] + rotation.rotate(turned[:, joint], offset))
    return np.linalg.norm(ends[0] - ends[1], axis=-1)[touch.rests]


def restlessness(motion: Motion, contacts: Contacts) -> float:
    """The longest way, in metres, of a planted joint in a frame."""
    joints = [motion.character.joint_of[role] for role in contacts.roles]
    steps = np.linalg.norm(np.diff(motion.positions[:, joints], axis=0), axis=-1)
    return float(steps[contacts.planted[1:]].max(initial=0.0))
