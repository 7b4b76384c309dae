"""Joints that are not given, made up from poses that the body takes in training motion."""

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from retarget_bench.errors import NotSupported, Unusable
from retarget_bench.motion import facing, transfer
from retarget_bench.motion.character import Character, Motion, Positions, Prediction

CLIPS = 240
"""The most clips that poses are taken from."""
RULE = "hip_height"


class MotionClips(Protocol):
    """Motions of one character, each made on access."""

    def __len__(self) -> int: ...
    def __getitem__(self, index: int, /) -> Motion: ...


Cast = Mapping[str, Mapping[str, MotionClips]]
"""Structure -> character -> its clips."""


def poses(cast: Cast | None, target: Character, most: int) -> np.ndarray:
    """``(poses, joints, 3)`` metres: the target copying the training motion, evenly over clips and time,
    at most so many; hips (or root) at the origin, facing +Z.

    Raises NotSupported where there is no such motion.
    """
    hips = target.joint_of.get("hips", 0)
    chunks = []
    for motion in copied(cast, target, most):
        places = motion.positions
        turn = facing.facing(places, target)[:, None]
        chunks.append(facing.seen(places - places[:, [hips]], turn))
    return np.concatenate(chunks)


def copied(cast: Cast | None, target: Character, most: int) -> list[Motion]:
    """The target copying frames of the training motion, evenly over clips and time, at most so many.

    Rotations are copied from bodies of the target's structure, or where there is none from all that stand
    on as many legs, so that bones are the target's own. Raises NotSupported where there is no such motion.
    """
    usable = _usable(cast or {}, target)
    if not usable:
        raise NotSupported(
            f"there is no motion to train on that {target.name} ({target.structure}) could copy"
        )
    chosen = [usable[index] for index in _evenly(len(usable), CLIPS).tolist()]
    share = max(1, most // len(chosen))
    motions = []
    for clips, number in chosen:
        with suppress(Unusable):
            motion = clips[number]
            motions.append(transfer.carry(motion.at(_evenly(motion.frames, share)), target, RULE))
    if not motions:
        raise NotSupported(f"no clip that {target.name} could copy can be used")
    return motions


def _evenly(count: int, most: int) -> np.ndarray:
    """Indices from 0 to before ``count``, at most so many, at even distances."""
    return np.unique(np.linspace(0, count - 1, min(most, count)).round().astype(int))


def _usable(cast: Cast, target: Character) -> list[tuple[MotionClips, int]]:
    """Clips by their number: of the target's structure, else of bodies on as many legs."""
    own = {target.structure: cast[target.structure]} if cast.get(target.structure) else cast
    usable = []
    for clips in (clips for characters in own.values() for clips in characters.values()):
        body = _body(clips)
        if body and body.four_legged == target.four_legged and transfer.reason(body, target) is None:
            usable += [(clips, number) for number in range(len(clips))]
    return usable


def _body(clips: MotionClips) -> Character | None:
    """The character of the first clip that can be used."""
    for number in range(len(clips)):
        with suppress(Unusable):
            return clips[number].character
    return None


FITS = 64
"""The most fits that are kept at a time."""
NOTHING = 1e-9


@dataclass(frozen=True, eq=False)
class Examples:
    """Poses seen from the joints that are given: their mean place is the origin, and they are turned about
    the vertical axis as the typical pose is, as well as that can be told.

    missing: joint numbers.
    typical: ``(given, 3)`` the mean pose.
    inputs:  ``(poses, given, 3)`` the given joints.
    outputs: ``(poses, missing, 3)`` the missing ones.
    """

    missing: np.ndarray
    typical: np.ndarray
    inputs: np.ndarray
    outputs: np.ndarray


Fitted = Callable[[np.ndarray], np.ndarray]
"""From given joints as they are seen ``(frames, given, 3)`` to missing ones ``(frames, missing, 3)``."""
Fit = Callable[[Examples], Fitted]


def examples(poses: np.ndarray, joints: Sequence[int]) -> Examples:
    """Poses ``(poses, joints, 3)`` facing +Z, seen from some of their joints."""
    at = np.array(joints)
    rest = np.setdiff1d(np.arange(poses.shape[1]), at)
    typical = (poses[:, at] - poses[:, at].mean(axis=1, keepdims=True)).mean(axis=0)
    inputs, origin, turn = aligned(poses[:, at], typical)
    return Examples(rest, typical, inputs, facing.seen(poses[:, rest] - origin, turn))


def aligned(places: np.ndarray, typical: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Given joints ``(frames, given, 3)`` as ``Examples`` has them; the origin ``(frames, 1, 3)``
    and the direction ``(frames, 1)`` they are seen from."""
    origin = places.mean(axis=1, keepdims=True)
    level = [each[..., 2] + 1j * each[..., 0] for each in (places - origin, typical)]
    turn = (level[0] * level[1].conj()).sum(axis=1, keepdims=True)  # the best fit of one angle
    size = np.abs(turn)
    turn = np.where(size > NOTHING, turn / np.maximum(size, NOTHING), 1.0)
    return facing.seen(places - origin, turn), origin, turn


class HasTraining(Protocol):
    """The part of a method's context that is needed here."""

    @property
    def training(self) -> Cast | None: ...


class Completer:
    """A method that makes up joints of the same body: those given stay, the others come from a fit.

    fit:  made for every body and set of joints, and kept.
    most: poses that it is made from.
    """

    def __init__(self, fit: Fit, most: int) -> None:
        self._fit, self._most = fit, most
        self._cast: Cast | None = None
        self._poses: dict[bytes, np.ndarray] = {}
        self._fits: dict[tuple[bytes, tuple[int, ...]], tuple[Examples, Fitted]] = {}

    def supports(self, source: Character, target: Character) -> str | None:
        """None, or why the source is not the target with joints left out, as a sentence."""
        unknown = [name for name in source.skeleton.names if name not in target.skeleton.names]
        if not unknown and source.measures == target.measures:
            return None
        why = f"has no joint {unknown[0]!r}" if unknown else "has other proportions"
        return f"makes up joints of the same body that are not given, and {target.name} {why}"

    def retarget(self, source: Prediction, target: Character, *, context: HasTraining) -> Positions:
        """The target's joints. Raises NotSupported where there is no motion to learn from."""
        joints = tuple(target.skeleton.index(name) for name in source.skeleton.names)
        places = np.empty((source.frames, len(target.skeleton), 3))
        places[:, joints] = source.positions
        if len(joints) < len(target.skeleton):
            examples, fitted = self._fitted(target, joints, context.training)
            inputs, origin, turn = aligned(source.positions, examples.typical)
            places[:, examples.missing] = facing.placed(fitted(inputs), turn) + origin
        return target.positions(places, source.fps)

    def _fitted(
        self, target: Character, joints: tuple[int, ...], cast: Cast | None
    ) -> tuple[Examples, Fitted]:
        if cast is not self._cast:  # other motion to learn from
            self._cast, self._poses, self._fits = cast, {}, {}
        body = target.skeleton.offsets.tobytes() + "\n".join(target.skeleton.names).encode()
        if (body, joints) not in self._fits:
            if body not in self._poses:
                self._poses[body] = poses(cast, target, self._most)
            if len(self._fits) >= FITS:
                self._fits.clear()
            training_poses = examples(self._poses[body], joints)
            self._fits[body, joints] = training_poses, self._fit(training_poses)
        return self._fits[body, joints]
