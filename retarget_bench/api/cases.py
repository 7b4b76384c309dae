"""Cases: a source motion, a target body, and what is known of the right answer."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from retarget_bench.motion.character import Character
from retarget_bench.motion.ground import FLAT, Ground
from retarget_bench.motion.motion import Motion, Prediction, Source

TASKS = ("retarget", "reconstruct", "denoise", "joint-completion", "points")
"""All but the first are derived from any data set's own motion (``retarget_bench/evaluation/tasks``)."""
PAIRED = ("retarget", "points")
"""Those of pairs of bodies, in all splits of a data set."""


@dataclass(frozen=True, eq=False)
class Contacts:
    """Planted contact joints, by frame.

    roles: the roles of the contact joints (``left_foot``, ``left_toe``, ...).
    planted: ``(frames, len(roles))`` bool: rests, and has rested since the frame before.
    pivoting: likewise bool, where it is known: turns about a point of the foot that rests on the ground.
            What is neither planted nor pivoting is free.
    """

    roles: tuple[str, ...]
    planted: np.ndarray
    pivoting: np.ndarray | None = None


@dataclass(frozen=True, eq=False)
class Touch:
    """A place of a body that one of its own joints should rest on for a while.

    end:     the role of the joint that goes there (``left_hand``).
    point:   ``(3,)`` metres, in that joint's frame: what of it rests on the place (the palm).
    bearing: the role of the joint that carries the place (``right_up_leg``).
    place:   ``(3,)`` metres, in that joint's frame.
    rests:   ``(frames,)`` bool: the point should be on the place, in full, not on its way.

    A joint's frame is at the joint, turned by its orientation relative to the common reference pose
    (``relative`` in ``motion/transfer.py``): along the world's axes while the body is in that pose.
    """

    end: str
    point: np.ndarray
    bearing: str
    place: np.ndarray
    rests: np.ndarray


@dataclass(frozen=True)
class CaseInfo:
    """Facts about a case that need no loading. Only this travels between processes.

    id:     ``dataset/source>target/clip``, stable for ever.
    clip:   the source clip: the cluster of the statistics.
    kind:   kind of performance (``walk``), or "" where the data set does not know.
    frames: length, or 0 where it is known only after loading.
    """

    id: str
    task: str
    split: str
    source: str
    target: str
    clip: str
    kind: str = ""
    frames: int = 0

    @property
    def pair(self) -> str:
        return f"{self.source}>{self.target}"


@dataclass(frozen=True, eq=False)
class Case:
    """One question put to a method, and what is known of the right answer.

    source:     the motion to be retargeted (its ``character`` is the source body; of ``PointSets`` nothing
                is known of it).
    target:     the body that shall perform it.
    reference:  the right answer, or None (then only reference-free metrics apply).
    contacts:   true contact labels of the *target*, or None (then metrics find them in the reference).
    alternative: a second answer that is as right as the reference, where one is known.
    conditions: of tasks such as denoising: noise level, proportion of joints.
    touches:    where the *target* should touch itself, or None where that is not known. Empty: nowhere.
    source_motion: the motion that the points of the source are of, where it is known; privileged.
    """

    info: CaseInfo
    source: Source
    target: Character
    reference: Prediction | None = None
    contacts: Contacts | None = None
    ground: Ground = FLAT
    conditions: Mapping[str, float] = field(default_factory=dict)
    alternative: Prediction | None = None
    touches: tuple[Touch, ...] | None = None
    source_motion: Motion | None = None


@dataclass(frozen=True, eq=False)
class Performed:
    """One body's motion, with what is known of it.

    contacts, touches: as in ``Case``, of this body; None where they are not known.
    """

    motion: Motion
    contacts: Contacts | None = None
    touches: tuple[Touch, ...] | None = None


@dataclass(frozen=True, eq=False)
class TrainingPair:
    """The same performance by two training bodies, on flat ground, frame by frame.

    clip, kind: as in ``CaseInfo``. exact: both are known; else the target's motion was made from the
    source's by a retargeting method.
    """

    clip: str
    kind: str
    source: Performed
    target: Performed
    exact: bool = True
