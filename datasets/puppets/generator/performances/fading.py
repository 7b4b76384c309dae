"""Cross-fades: channels of two performances joined over a bridge of frames without a jump."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ..curves import bump, smooth
from .score import Act, Air, Hand, Score, Touch, Trunk

TRANSITION = "transition"
"""The act on a bridge."""

_FADE = 5.0
"""Frames in which a speed dies away."""


def bridged(
    a: np.ndarray, b: np.ndarray, length: int, low: float | None = None, high: float | None = None
) -> np.ndarray:
    """``(frames a + length + frames b, ...)``: both run on into the bridge, ever more slowly, and are
    cross-faded there. low, high: limits that the channel keeps."""
    after = np.arange(1, length + 1, dtype=float).reshape(-1, *[1] * (a.ndim - 1))
    before = length + 1.0 - after
    on = a[-1] + (a[-1] - a[-2]) * _FADE * (1.0 - np.exp(-after / _FADE))
    back = b[0] - (b[1] - b[0]) * _FADE * (1.0 - np.exp(-before / _FADE))
    if low is not None:
        on, back = np.clip(on, low, high), np.clip(back, low, high)
    return np.concatenate([a, on + smooth(after / (length + 1.0)) * (back - on), b])


def followed(
    a: np.ndarray | None, b: np.ndarray | None, frames_a: int, frames_b: int, length: int
) -> np.ndarray:
    """A channel that is 0 on the bridge, and in a performance that has none."""
    shape = next(x.shape[1:] for x in (a, b) if x is not None)
    parts = ((a, frames_a), (None, length), (b, frames_b))
    return np.concatenate([np.zeros((frames, *shape)) if x is None else x for x, frames in parts])


def either(
    a: np.ndarray | None, b: np.ndarray | None, frames_a: int, frames_b: int, length: int
) -> np.ndarray | None:
    """The same, or nothing where neither performance has the channel."""
    return None if a is None and b is None else followed(a, b, frames_a, frames_b, length)


def in_a_row(
    a: Score, b: Score, channels: Sequence[str], length: int, between: str = TRANSITION
) -> dict[str, Any]:
    """The named channels, trunk, acts and phase of ``a``, a bridge and ``b``. between: the bridge's act."""
    start = a.frames + length
    acts = (replace(act, first=act.first + start, end=act.end + start) for act in b.stretches())
    return {
        **{name: bridged(getattr(a, name), getattr(b, name), length) for name in channels},
        "trunk": joined_trunk(a.trunk, b.trunk, a.frames, b.frames, length),
        "acts": (*a.stretches(), Act(between, a.frames, start), *acts),
        "phase": np.concatenate([a.phases(), np.arange(length) / length, b.phases()]),
    }


def joined_trunk(a: Trunk, b: Trunk, frames_a: int, frames_b: int, length: int) -> Trunk:
    follow = [np.full(n, 1.0) * each.follow for each, n in ((a, frames_a), (b, frames_b))]
    return Trunk(
        pelvis=bridged(a.pelvis, b.pelvis, length),
        chest=bridged(a.chest, b.chest, length),
        gaze=bridged(a.gaze, b.gaze, length),
        follow=bridged(follow[0], follow[1], length),
    )


def joined_hand(a: Hand, b: Hand, length: int) -> Hand:
    """A hand that leaves one place and settles on another one, or stays on the same."""
    start = len(a.swivel) + length
    aim, aimed = _joined_aim(a, b, length)
    channels = ("upright", "middle", "swivel", "wrist")
    return Hand(
        reach=_round_the_shoulder(bridged(a.reach, b.reach, length), len(a.swivel), length),
        **{name: bridged(getattr(a, name), getattr(b, name), length) for name in channels},
        touches=_joined_touches(a, b, length),
        aim=aim,
        aimed=aimed,
        contacts=(*a.contacts, *(contact.later(start) for contact in b.contacts)),
    )


def _round_the_shoulder(reach: np.ndarray, start: int, length: int) -> np.ndarray:
    """A way on the bridge that would lead close by the shoulder bows out to the front and the side."""
    middle = reach[start + length // 2]
    close = smooth((0.75 - float(np.sqrt((middle**2).sum()))) / 0.35)
    bow = np.zeros_like(reach)
    share = np.arange(1, length + 1) / (length + 1.0)
    bow[start : start + length] = bump(share)[:, None] * (close * np.array([0.20, 0.0, 0.35]))
    return reach + bow


def _joined_touches(a: Hand, b: Hand, length: int) -> tuple[Touch, ...]:
    zeros = [np.zeros(len(hand.swivel)) for hand in (a, b)]
    one, two = ({touch.place: touch.weight for touch in hand.touches} for hand in (a, b))
    return tuple(
        Touch(name, bridged(one.get(name, zeros[0]), two.get(name, zeros[1]), length, 0.0, 1.0))
        for name in dict.fromkeys((*one, *two))
    )


def _joined_aim(a: Hand, b: Hand, length: int) -> tuple[np.ndarray | None, np.ndarray]:
    """Aims of both hands in turn; where only one is aimed the other keeps its aim, unfollowed."""
    aimed = [np.zeros(len(hand.swivel)) + hand.aimed for hand in (a, b)]
    share = bridged(aimed[0], aimed[1], length, 0.0, 1.0)
    if a.aim is None and b.aim is None:
        return None, share
    one = a.aim if a.aim is not None else np.tile(b.aim[0], (len(a.swivel), 1))  # type: ignore[index]
    two = b.aim if b.aim is not None else np.tile(one[-1], (len(b.swivel), 1))
    return bridged(one, two, length), share


def joined_air(a: Air | None, b: Air | None, frames_a: int, frames_b: int, length: int) -> Air | None:
    """Ways through the air; on the bridge both feet are on the floor."""
    if a is None and b is None:
        return None
    names = ("reach", "weight", "swivel", "point")
    each = ((getattr(a, name, None), getattr(b, name, None)) for name in names)
    return Air(*(followed(one, two, frames_a, frames_b, length) for one, two in each))
