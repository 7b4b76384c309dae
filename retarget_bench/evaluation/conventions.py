"""Answers from elsewhere that look as if they were written under other conventions than ours."""

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from itertools import combinations
from typing import Any

import numpy as np

from retarget_bench.api import Case, Prediction
from retarget_bench.motion import rotation, transfer
from retarget_bench.motion.character import Character, Motion, Positions
from retarget_bench.motion.recording import MIRROR
from retarget_bench.motion.up_axis import UP_AXES

_SAMPLE = 40
"""Frames by which conventions are told."""
_FAR, _NEAR, _NEARER = 0.04, 0.1, 0.5
"""Shares of the height: how far from its source's pose an answer is that is doubted, how near another
convention has to bring it, and to which share of the distance."""
_LARGE = 20.0
"""How many times as far from the origin as its source an answer is that is in a smaller unit."""
_SMALLER = {100.0: "centimetres", 1000.0: "millimetres", 1.0 / 0.0254: "inches"}


def doubt(prediction: Prediction, case: Case) -> str:
    """A sentence on an answer that fits its source far better if it was written under another convention
    than ours: metres, w first in quaternions, Y up, X to the left; "" for others.

    It is compared with the source's pose on the target, about the hips.
    """
    source, target = case.source, case.target
    if not isinstance(source, Motion) or not isinstance(prediction, Motion | Positions):
        return ""
    if transfer.reason(source.character, target) or prediction.frames != source.frames:
        return ""
    sample = np.unique(np.linspace(0, source.frames - 1, _SAMPLE).astype(int))
    answer, expected = prediction.at(sample), transfer.carry(source.at(sample), target, "height")
    signs = []
    if (ratio := _extent(answer) / max(_extent(expected), 1e-9)) > _LARGE:
        factor = min(_SMALLER, key=lambda each: abs(math.log(each / ratio)))
        signs.append(f"lengths in {_SMALLER[factor]}, not metres")
        if isinstance(answer, Positions):
            answer = replace(answer, positions=answer.positions / factor)
    off = _distance(answer, expected)
    if off > _FAR:
        signs += _convention(answer, expected, min(_NEAR, _NEARER * off))
    return f"the answers look as if they had {', '.join(signs)}" if signs else ""


def _extent(prediction: Motion | Positions) -> float:
    """How far the hips are from the origin."""
    return float(np.median(np.linalg.norm(transfer.hips(prediction), axis=-1)))


def _distance(answer: Motion | Positions, expected: Motion) -> float:
    """Share of the height that joints are apart, about the hips, on average."""
    hips = expected.character.joint_of["hips"]
    one, other = (each.positions - each.positions[:, hips, None] for each in (answer, expected))
    return float(np.linalg.norm(one - other, axis=-1).mean()) / expected.character.height


def _convention(answer: Motion | Positions, expected: Motion, within: float) -> tuple[str, ...]:
    """The fewest other conventions, at most two, under which an answer is so near; () where none is."""
    changes = _CHANGES if isinstance(answer, Motion) else _CHANGES_OF_POSITIONS
    for count in (1, 2):
        distances = {}
        for signs in combinations(changes, count):
            changed = answer
            for sign in signs:
                changed = changes[sign](changed)
            distances[signs] = _distance(changed, expected)
        best = min(distances, key=distances.__getitem__)
        if distances[best] < within:
            return best
    return ()


def _w_first(answer: Motion) -> Motion:
    return replace(answer, rotations=np.roll(answer.rotations, 1, axis=-1))


_Z_UP = rotation.from_rotation_vector(np.array(UP_AXES["z"]))


def _y_up(answer: Motion) -> Motion:
    turned = np.array(answer.rotations)
    turned[:, 0] = rotation.multiply(_Z_UP[None], turned[:, 0])
    return replace(answer, rotations=turned, root=rotation.rotate(_Z_UP[None], answer.root))


def _other_sides(character: Character) -> list[int]:
    """The joint of the other side for each joint, itself where there is none."""
    other = {"left": "right", "right": "left"}
    sides = [(role or "").partition("_") for role in character.roles]
    opposite = [f"{other.get(side, side)}_{part}" for side, _, part in sides]
    return [character.joint_of.get(role, joint) for joint, role in enumerate(opposite)]


_SIDES = "left and right exchanged"
_CHANGES: Mapping[str, Callable[[Any], Motion | Positions]] = {
    "quaternions x, y, z, w, not w, x, y, z": _w_first,
    "Z up, not Y": _y_up,
    _SIDES: lambda answer: replace(answer, rotations=answer.rotations[:, _other_sides(answer.character)]),
    "X to the right, not to the left": lambda answer: replace(
        answer, rotations=rotation.mirrored(answer.rotations), root=answer.root * MIRROR
    ),
}
"""Signs of another convention -> the answer as it would be written here."""
_CHANGES_OF_POSITIONS: Mapping[str, Callable[[Any], Motion | Positions]] = {
    "Z up, not Y": lambda answer: replace(answer, positions=rotation.rotate(_Z_UP, answer.positions)),
    _SIDES: lambda answer: replace(answer, positions=answer.positions[:, _other_sides(answer.character)]),
    "X to the right, not to the left": lambda answer: replace(answer, positions=answer.positions * MIRROR),
}
