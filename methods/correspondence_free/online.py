"""The pipeline frame by frame: points of a source come in, vertices of the target go out."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Protocol

import numpy as np
import torch
from torch import Tensor

from retarget_bench.motion import facing, root_rules, rotation
from retarget_bench.motion.body22 import JOINTS, PARENTS
from retarget_bench.motion.character import Character, Motion
from retarget_bench.motion.measures import measure
from retarget_bench.motion.mesh import Mesh
from retarget_bench.motion.rates import FPS
from retarget_bench.motion.skeleton import Skeleton
from retarget_bench.motion.structures import BODY22

LEG_TO_HIPS = 1.10
"""How high the hips are above the toes, in lengths of thigh and shank: 1.06 to 1.17 among puppets (of two
hundred, deviation 1.5 %). Of a source in motion nothing shows it directly."""
_LEGS = tuple(
    tuple(BODY22.index(f"{side}_{part}") for part in ("up_leg", "leg", "foot"))
    for side in ("left", "right")
)
_ACROSS = tuple(
    tuple(BODY22.index(f"{side}_{part}") for side in ("left", "right")) for part in ("up_leg", "arm")
)
_STRAIGHT = 0.35
"""Radians: a target that faces nearer to +Z than this is taken to face +Z."""
_DEFINED = 1e-3
"""Hip heights: where hips and shoulders seen from above are closer than this, they show no direction."""


class FindsJoints(Protocol):
    """The part of the method ``skr`` that is used."""

    def joints(self, points: Sequence[np.ndarray]) -> np.ndarray: ...
    def resting(self, vertices: np.ndarray, faces: np.ndarray) -> np.ndarray: ...


class MovesJoints(Protocol):
    """The part of the method ``smrm`` that is used; of its parameters ``path``."""

    config: Any
    features: Any

    @property
    def generator(self) -> Any: ...


class GivesWeights(Protocol):
    """The part of the method ``skin`` that is used."""

    def shares(self, points: np.ndarray, joints: np.ndarray) -> np.ndarray: ...


@dataclass(frozen=True)
class Networks:
    """The three trained stages, each a method of its own."""

    skr: FindsJoints
    smrm: MovesJoints
    skin: GivesWeights


@dataclass(eq=False)
class Memory:
    """The state after a frame.

    states: of the encoder and of the decoder. legs, frames: sum of leg lengths, metres, and of how many
    frames. joints: ``(1, 22, 3)`` of the last frame. turn, moves: ``(1, 2)`` and ``(1, 3)`` of the last
    frame, the direction that the source faces and the answer's move. lead, path, faded: ``(1, 3)`` metres,
    the source's hips scaled to the target, the summed moves, and what of their difference has not faded.
    """

    states: tuple[Tensor | None, Tensor | None] = (None, None)
    legs: float = 0.0
    frames: int = 0
    joints: np.ndarray | None = None
    turn: np.ndarray | None = None
    moves: np.ndarray | None = None
    lead: np.ndarray | None = None
    path: np.ndarray | None = None
    faded: np.ndarray | None = None


class OnlineRetargeter:
    """One source carried to one target, as its frames come, 30 a second.

    Of the target the surface in T-pose is known and nothing else: SKR finds its joints, SKIN its weights.
    """

    def __init__(
        self, networks: Networks, vertices: np.ndarray, faces: np.ndarray, notes: tuple[str, ...] = ()
    ) -> None:
        """vertices, faces: ``(V, 3)`` metres and ``(F, 3)`` of the target in T-pose, wherever it faces.
        notes: on how it came into that pose."""
        self.networks, self.memory, self.notes = networks, Memory(), notes
        joints = networks.skr.resting(vertices, faces).mean(axis=0)
        vertices, joints = _ahead(joints, vertices, joints)
        self.body = estimated_body(joints)
        self.mesh = Mesh(vertices, faces, networks.skin.shares(vertices, joints))
        self._generator, self._features = networks.smrm.generator, networks.smrm.features

    def frame(self, points: np.ndarray) -> np.ndarray:
        """``(V, 3)`` metres: the target's vertices, for points ``(n, 3)`` of the source's next frame."""
        joints = self.networks.skr.joints([points])
        return self.mesh.skinned(self.motion(joints))[0]

    def motion(self, joints: np.ndarray) -> Motion:
        """The target's skeleton in the next frames, for the source's joints ``(frames, 22, 3)`` metres.

        However the frames are cut into calls, together they give the same.
        """
        first, memory = self.memory.joints is None, self.memory
        units = self._units(joints)[:, None]
        turn = self._facing(joints, units[:, 0])
        hips = joints[:, 0]
        before = np.concatenate([hips[:1] if memory.joints is None else memory.joints[:, 0], hips[:-1]])
        direction = np.stack([turn.real, turn.imag], axis=-1)
        places = facing.seen(joints - hips[:, None], turn[:, None]) / units[..., None]
        moves = self._features.moves(hips / units, before / units, direction)
        rotations, answered = self._answer(places, moves)
        lead = self._lead(hips, before, self._unit / units)
        root = self._path(answered, direction, lead, first)
        rotations[:, 0] = rotation.multiply(facing.rotation(turn), rotations[:, 0])
        memory.joints = joints[-1:]
        return self.body.motion(rotation.normalise(rotations), root, FPS)

    @cached_property
    def _unit(self) -> float:
        return self.body.measures.hip_height

    def _units(self, joints: np.ndarray) -> np.ndarray:
        """``(frames,)`` metres: how high the source's hips are when it stands, by all frames so far."""
        legs = np.zeros(len(joints))
        for upper, knee, foot in _LEGS:
            thigh, shank = joints[:, knee] - joints[:, upper], joints[:, foot] - joints[:, knee]
            legs += 0.5 * (np.linalg.norm(thigh, axis=-1) + np.linalg.norm(shank, axis=-1))
        total = self.memory.legs + np.cumsum(legs)
        counts = self.memory.frames + np.arange(1, len(legs) + 1)
        self.memory.legs, self.memory.frames = float(total[-1]), int(counts[-1])
        return np.asarray(LEG_TO_HIPS * total / counts)

    def _facing(self, joints: np.ndarray, units: np.ndarray) -> np.ndarray:
        """``(frames,)`` unit complex numbers; where it is undefined, the last defined one."""
        forward = _forward(joints)
        size = np.abs(forward)
        defined = size > _DEFINED * units
        last = np.maximum.accumulate(np.where(defined, np.arange(len(joints)), -1))
        directions = forward / np.where(defined, size, 1.0)
        before = 1.0 + 0.0j if self.memory.turn is None else complex(*self.memory.turn[0])
        return np.asarray(np.where(last < 0, before, directions[last]))

    def _answer(self, places: np.ndarray, moves: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """SMRM: rotations ``(frames, 22, 4)`` and moves ``(frames, 3)`` of the target."""
        generator = self._generator
        inputs = [torch.from_numpy(each.astype(np.float32))[None] for each in (places, moves)]
        with torch.inference_mode():
            codes, encoding = generator.encode(inputs[0], inputs[1], self.memory.states[0])
            rotations, answered, decoding = generator.decode_rotations(
                codes, self._resting, self.memory.states[1]
            )
        self.memory.states = (encoding, decoding)
        return rotations[0].double().numpy(), answered[0].double().numpy()

    @cached_property
    def _resting(self) -> Tensor:
        """Places of the target's joints relative to the hips ``(1, 22, 3)``, in hip heights."""
        places = self.body.reference_places - self.body.reference_places[0]
        return torch.from_numpy((places / self._unit).astype(np.float32))[None]

    def _lead(self, hips: np.ndarray, before: np.ndarray, ratios: np.ndarray) -> np.ndarray:
        """``(frames, 3)`` metres: the source's path scaled to the target, level step by step, so that a
        better estimate of its size moves nothing that has been gone."""
        start = hips[:1] * ratios[:1] if self.memory.lead is None else self.memory.lead
        lead = start + np.cumsum((hips - before) * ratios, axis=0)
        lead[:, 1] = (hips * ratios)[:, 1]
        self.memory.lead = lead[-1:]
        return np.asarray(lead)

    def _path(self, moves: np.ndarray, turn: np.ndarray, lead: np.ndarray, first: bool) -> np.ndarray:
        """``(frames, 3)`` metres: the target's hips; see ``SMRM`` (``path``)."""
        memory = self.memory
        earlier = [] if first else [(memory.moves, memory.turn)]
        rows = [np.concatenate(each) for each in zip(*earlier, (moves, turn), strict=True)]
        way = self._features.path(*(torch.from_numpy(row) for row in rows)).numpy() * self._unit
        start = lead[:1] if memory.path is None else memory.path
        path = start * [1.0, 0.0, 1.0] + way[len(earlier) :]
        lag = lead - path
        before = lag[:1] if memory.faded is None else memory.faded[:1]
        faded = root_rules.fading(
            np.diff(-lag, axis=0, prepend=-before), FPS, 0.0 if memory.faded is None else memory.faded[1]
        )
        memory.moves, memory.turn, memory.path = moves[-1:], turn[-1:], path[-1:]
        memory.faded = np.stack([lag[-1], faded[-1]])
        return path if self.networks.smrm.config.path == "integrated" else lead + faded


def _forward(joints: np.ndarray) -> np.ndarray:
    """``(...)`` complex numbers: the direction ahead of joints ``(..., 22, 3)``, see ``motion/facing.py``;
    the farther hips and shoulders are apart on the level, the larger."""
    across = sum(joints[..., left, :] - joints[..., right, :] for left, right in _ACROSS)
    return np.asarray(across[..., 0] - 1j * across[..., 2])


def _ahead(resting: np.ndarray, *places: np.ndarray) -> list[np.ndarray]:
    """Places ``(n, 3)`` of a body, turned so that it faces +Z, where its joints at rest say that it does
    not. Where it does, as far as they can tell, nothing is turned: they are found to a degree or two."""
    forward = complex(_forward(resting))
    if abs(np.angle(forward)) < _STRAIGHT:
        return list(places)
    return [facing.seen(each, np.asarray(forward / abs(forward))) for each in places]


def estimated_body(joints: np.ndarray) -> Character:
    """A body of the 22 joints ``(22, 3)`` metres as they are in T-pose, which it rests in."""
    offsets = joints - joints[np.maximum(PARENTS, 0)]
    offsets[0] = joints[0]
    skeleton = Skeleton(BODY22, np.array(PARENTS), offsets)
    still = rotation.identity(JOINTS)
    sizes = measure(skeleton, BODY22, still)
    return Character("estimated", skeleton, "body22", BODY22, still, sizes)
