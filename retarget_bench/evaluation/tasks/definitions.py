"""Questions of the derived tasks: from a clean motion to a source, a target and the right answer.

Random numbers are made from the raw bits of Philox, by transforms of our own: NumPy promises to keep the
bits of its generators, but not the distributions that it makes of them.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from retarget_bench.api import Prediction
from retarget_bench.api.comparison import structure_joints
from retarget_bench.errors import BenchError, SkeletonError
from retarget_bench.motion import kinematics, rotation
from retarget_bench.motion.character import Character
from retarget_bench.motion.motion import Positions
from retarget_bench.motion.roles import SIDES
from retarget_bench.motion.skeleton import Skeleton
from retarget_bench.motion.surface_sampling import uniform
from retarget_bench.results.store import case_seed

MAJOR = "major"
MAJOR_ROLES = tuple(
    f"{side}_{part}" for part in ("foot", "leg", "up_leg", "arm", "forearm", "hand") for side in SIDES
)
"""Ankles, knees, hips, shoulders, elbows and wrists: the joints that all of HuMoT's structures share."""
FEWEST = 2
"""Joints that are given at least: one alone says nothing of where a body faces."""
LARGEST_NOISE = 100.0
"""Centimetres."""


@dataclass(frozen=True)
class Level:
    """A difficulty. word: as it is written; number: its number; suffix: what it adds to a case's id."""

    word: str = ""
    suffix: str = ""
    number: float = 0.0


class TaskQuestion:
    """A task. LEVELS: the usual ones, as text; "" where it has none.

    This one asks for the motion itself, to and from whatever a method makes of it (HuMoT, section 4.1).
    """

    LEVELS: ClassVar[str] = ""

    def __init__(self, levels: str) -> None:
        """Raises BenchError for a bad level, and where a task with levels is given none."""
        words = [word.strip() for word in levels.split(",") if word.strip()]
        if self.LEVELS and not words:
            task = type(self).__name__.lower()
            raise BenchError(f"{task}: name at least one level, such as {self.LEVELS}")
        chosen = dict.fromkeys(map(self.level, words)) or (Level(),)
        self.levels = sorted(chosen, key=lambda level: (level.word == MAJOR, level.number))

    def level(self, word: str) -> Level:
        """The level that a word stands for. Raises BenchError."""
        raise BenchError(f"{type(self).__name__.lower()} has no levels; got {word!r}")

    def conditions(self, body: Character, level: Level) -> Mapping[str, float] | None:
        """The conditions as numbers; None where this body cannot be asked this."""
        del body, level
        return {}

    def ask(self, clean: Prediction, level: Level, case_id: str) -> tuple[Prediction, Prediction]:
        """The source of a case, and the right answer of its target. clean: the right answer, all joints."""
        del level, case_id
        return clean, clean


class Denoise(TaskQuestion):
    """Positions with Gaussian noise on every coordinate of every joint in every frame, each on its own
    (HuMoT, section 4.3). Levels are standard deviations in centimetres."""

    LEVELS: ClassVar[str] = "0,1,2,3,4,5,6,8,10"

    def level(self, word: str) -> Level:
        number = _number(word)
        if not 0.0 <= number <= LARGEST_NOISE:
            allowed = f"standard deviations in centimetres, from 0 to {LARGEST_NOISE:g}"
            raise BenchError(f"denoise: levels are {allowed}; got {word}")
        return Level(f"{number:g}", f"noise-{number:g}cm", float(f"{number:g}") / 100)

    def conditions(self, body: Character, level: Level) -> Mapping[str, float]:
        del body
        return {"noise": level.number}

    def ask(self, clean: Prediction, level: Level, case_id: str) -> tuple[Prediction, Prediction]:
        noise = level.number * gaussian(case_seed(0, "denoise", case_id), clean.positions.shape)
        return Positions(clean.character, clean.positions + noise, clean.fps), clean


class JointCompletion(TaskQuestion):
    """Positions of some joints, drawn at random, all of them asked for (HuMoT, section 4.4).

    Levels are the proportion of joints that are given, or ``major``: the twelve of the paper's Figure 12,
    of bodies that have them all. Fingers, hair and props are neither given nor asked for, as in the paper.
    """

    LEVELS: ClassVar[str] = "0.1,0.2,0.3,0.4,0.5,0.6,0.7,0.8,0.9,1,major"

    def level(self, word: str) -> Level:
        if word == MAJOR:
            return Level(MAJOR, f"joints-{MAJOR}")
        number = _number(word)
        if not 0.0 < number <= 1.0:
            allowed = f"the proportion of joints that are given, above 0 and at most 1, or {MAJOR}"
            raise BenchError(f"joint-completion: levels are {allowed}; got {word}")
        return Level(f"{number:g}", f"joints-{number:g}", float(f"{number:g}"))

    def conditions(self, body: Character, level: Level) -> Mapping[str, float] | None:
        total = len(structure_joints(body))
        if total < FEWEST:
            return None
        if level.word != MAJOR:
            return {"proportion": level.number, "joints": float(_count(total, level)), "of": float(total)}
        if len(body.joints(MAJOR_ROLES)) < len(MAJOR_ROLES):
            return None
        return {MAJOR: 1.0, "joints": float(len(MAJOR_ROLES)), "of": float(total)}

    def ask(self, clean: Prediction, level: Level, case_id: str) -> tuple[Prediction, Prediction]:
        joints = structure_joints(clean.character)
        if level.word == MAJOR:
            shown = sorted(clean.character.joints(MAJOR_ROLES))
        else:
            seed = case_seed(0, "upsample", case_id)
            shown = joints[list(drawn(seed, len(joints), _count(len(joints), level)))].tolist()
        target = reduced(clean.character, joints.tolist())
        reference = Positions(target, clean.positions[:, joints], clean.fps)
        if len(shown) == len(joints):
            return reference, reference
        source = reduced(clean.character, shown)
        return Positions(source, clean.positions[:, shown], clean.fps), reference


QUESTIONS: Mapping[str, type[TaskQuestion]] = {
    "reconstruct": TaskQuestion,
    "denoise": Denoise,
    "joint-completion": JointCompletion,
}


def _number(word: str) -> float:
    """Not a number where it is none."""
    try:
        return float(word)
    except ValueError:
        return math.nan


def _count(total: int, level: Level) -> int:
    """Number of joints that are given: the nearest whole number, a half upwards, at least two."""
    return max(FEWEST, int(np.floor(level.number * total + 0.5)))


NONE = "no level"


def level_name(conditions: Mapping[str, float]) -> str:
    """``5 cm`` of noise, ``50 %`` of the joints, ``major`` joints."""
    if "noise" in conditions:
        return f"{100 * conditions['noise']:g} cm"
    if MAJOR in conditions:
        return MAJOR
    return f"{100 * conditions['proportion']:g} %" if "proportion" in conditions else NONE


def level_order(conditions: Mapping[str, float]) -> tuple[bool, float]:
    """Sorts levels: by their level_number, and those without one last."""
    number = conditions.get("noise", conditions.get("proportion"))
    return number is None, number or 0.0


def level_number(name: str) -> float | None:
    """The number of a level by its name: centimetres of noise, per cent of the joints; None without."""
    number = _number(name.partition(" ")[0])
    return None if math.isnan(number) else number


def gaussian(seed: int, shape: tuple[int, ...]) -> np.ndarray:
    """Numbers of mean 0 and standard deviation 1, by the inverse of the normal distribution."""
    from scipy.special import ndtri  # type: ignore[import-untyped]

    return np.asarray(ndtri(uniform(seed, int(np.prod(shape)))).reshape(shape))


def drawn(seed: int, total: int, count: int) -> tuple[int, ...]:
    """``count`` of ``total`` numbers from 0 on, each as likely as any other, in increasing order."""
    order = np.argsort(uniform(seed, total), kind="stable")
    return tuple(sorted(order[:count].tolist()))


def reduced(character: Character, joints: Sequence[int]) -> Character:
    """The character with these joints alone; itself where that is all of them.

    Each hangs from its nearest ancestor that is left. The first one is the root, and what has no ancestor
    left hangs from it: without hips there is no better tree, and methods that need hips say so. Names,
    roles, structure and the measures of the whole body stay. It rests in the common reference pose, with
    every joint where the whole body has it there.

    Raises SkeletonError for no joint, one that there is not, or one that is named twice.
    """
    kept = sorted(joints)
    total = len(character.skeleton)
    if not kept or len(set(kept)) < len(kept) or not 0 <= kept[0] <= kept[-1] < total:
        raise SkeletonError(
            f"{character.name} has joints 0 to {total - 1}; keep at least one, each once, not {kept}"
        )
    if len(kept) == total:
        return character
    above, number = character.skeleton.parents.tolist(), {joint: at for at, joint in enumerate(kept)}
    parents = np.full(len(kept), -1)
    for at, joint in enumerate(kept[1:], 1):
        parent = above[joint]
        while parent >= 0 and parent not in number:
            parent = above[parent]
        parents[at] = number.get(parent, 0)
    places = kinematics.forward(character.skeleton, character.reference_pose, np.zeros(3))[0][kept]
    offsets = places - places[np.maximum(parents, 0)]
    offsets[0] = places[0]
    return replace(
        character,
        name=f"{character.name} ({len(kept)} of {total} joints)",
        skeleton=Skeleton(tuple(character.skeleton.names[j] for j in kept), parents, offsets),
        roles=tuple(character.roles[j] for j in kept),
        reference_pose=rotation.identity(len(kept)),
        skin=None,
        whole=character.whole or character,
    )
