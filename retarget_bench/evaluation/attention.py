"""Attention weights of learned methods: read from a method, checked, and written as a table."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from retarget_bench.api import Method
from retarget_bench.errors import BenchError, NotSupported
from retarget_bench.files import spreadsheet, write_text
from retarget_bench.motion.motion import Motion

SLACK = 1e-4
"""By how much rounding may bring weights beyond 0 and 1."""
COLUMNS = ("frame", "seconds", "part", "joint", "weight")


@dataclass(frozen=True, eq=False)
class Attention:
    """Attention of each body part to each joint, frame by frame.

    parts:   names of body parts.
    joints:  ``(n,)`` the joints of the source's character that any part attends to.
    sees:    ``(parts, n)`` bool: the part can attend to the joint.
    weights: ``(frames, parts, n)`` from 0 to 1, at the source's frames; 0 where the part does not see.
             Those of a part add up to at most 1: the rest goes to what is no joint of this body.
    note:    a sentence on how the body was understood, or "".
    """

    parts: tuple[str, ...]
    joints: np.ndarray
    sees: np.ndarray
    weights: np.ndarray
    note: str = ""

    @property
    def largest(self) -> np.ndarray:
        """``(frames, n)`` the largest weight of any part."""
        return np.max(self.weights, axis=1)


def ask(method: Method, source: Motion, name: str) -> Attention:
    """The attention of a method to a motion; name: of the method, for messages.

    Raises NotSupported where it does not say, and BenchError where what it says is none of that."""
    if method.attention is None:
        raise NotSupported(f"{name} does not say what it attends to; pan does")
    if why := method.supports(source.character, source.character):
        raise NotSupported(f"{name}: {why}")
    if not source.frames:
        raise BenchError(f"there is no frame in the motion of {source.character.name}")
    answer = method.attention(source.copy())
    try:
        attention = Attention(
            tuple(answer["parts"]),
            np.asarray(answer["joints"], dtype=np.int64),
            np.asarray(answer["sees"], dtype=bool),
            np.asarray(answer["weights"], dtype=np.float64),
            str(answer.get("note", "")),
        )
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise BenchError(f"{name} does not say its attention as Attention wants it: {error!r}") from None
    if wrong := _wrong(attention, source):
        raise BenchError(f"{name} says something else than attention: {wrong}")
    return attention


def _wrong(attention: Attention, source: Motion) -> str:
    """The first way in which a value breaks the rules of ``Attention``; "" for none."""
    parts, joints, weights = len(attention.parts), len(attention.joints), attention.weights
    if weights.shape != (source.frames, parts, joints) or attention.sees.shape != (parts, joints):
        sizes = f"{source.frames} frames, {parts} parts and {joints} joints"
        return f"weights of shape {weights.shape} and sees of {attention.sees.shape} for {sizes}"
    if not parts or not joints or np.unique(attention.joints).size < joints:
        return "there is no part, no joint, or one joint twice"
    if attention.joints.min() < 0 or attention.joints.max() >= len(source.skeleton):
        return f"joints from {attention.joints.min()} to {attention.joints.max()} of {len(source.skeleton)}"
    if not np.isfinite(weights).all() or weights.min() < -SLACK or weights.sum(-1).max() > 1.0 + SLACK:
        return "weights that are not finite, are below 0, or add up to more than 1"
    return "" if not weights[:, ~attention.sees].any() else "a part attends to a joint that it does not see"


def frames_at(seconds: Sequence[float], source: Motion) -> list[int]:
    """The frames nearest to these times. Raises BenchError for a time beyond the motion's end."""
    last = (source.frames - 1) / source.fps
    for time in seconds:
        if not 0.0 <= time <= last + 0.5 / source.fps:
            raise BenchError(f"{time:g} s is no time of this motion, which goes from 0 to {last:.2f} s")
    return [min(round(time * source.fps), source.frames - 1) for time in seconds]


def write(path: Path, attention: Attention, source: Motion, frames: Sequence[int]) -> None:
    """A row of ``COLUMNS`` per frame asked for, part, and joint that the part sees. Raises FileError."""
    rows: list[tuple[object, ...]] = [COLUMNS]
    for frame in frames:
        for part, at in np.argwhere(attention.sees):
            names = attention.parts[part], source.skeleton.names[attention.joints[at]]
            weight = attention.weights[frame, part, at]
            rows.append((frame, f"{frame / source.fps:.6g}", *names, f"{weight:.6g}"))
    write_text(path, spreadsheet(rows))
