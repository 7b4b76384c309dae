"""Standing, turning on the spot, sitting down, lying down and shaking a paw.

Getting up is sitting down played backwards.
"""

from dataclasses import replace
from typing import Any

import numpy as np

from ...conventions import FPS, SIDES, seconds, sign
from ...curves import plateau, ramp, wander
from ...randomness import Stream
from ..score import EVER, LIMBS, DogScore, Paw, PawAir, PawContact, Trunk
from .gaits import WALK, Habit, head_and_tail

CHANNELS = (
    *("heading", "path", "sway", "height", "balance", "support"),
    *("fore", "anchor", "neck", "tail", "spread"),
)
"""Channels of a dog's score beside trunk and paws."""


def backwards(score: DogScore) -> DogScore:
    """The same performance run backwards; paws that have nothing in the air only."""
    trunk, last = score.trunk, score.frames - 1
    channels: dict[str, Any] = {name: _turned(getattr(score, name)) for name in CHANNELS}
    return replace(
        score,
        **channels,
        trunk=Trunk(_turned(trunk.pelvis), _turned(trunk.chest), _turned(trunk.gaze)),
        paws={limb: _backwards(paw, last) for limb, paw in score.paws.items()},
    )


def _turned(channel: np.ndarray) -> np.ndarray:
    return np.ascontiguousarray(channel[::-1])


def _backwards(paw: Paw, last: int) -> Paw:
    """Every swing keeps its height, but paws still land flat and leave over their tips."""
    contacts: list[PawContact] = []
    for number, contact in enumerate(reversed(paw.contacts)):
        before = paw.contacts[len(paw.contacts) - 2 - number] if number + 1 < len(paw.contacts) else contact
        contacts.append(
            replace(
                contact,
                moment=last - contact.moment,
                strike=last - contact.off,
                flat=last - contact.off,
                lift=last - contact.flat,
                off=last - contact.strike,
                strike_pitch=0.0,
                off_pitch=0.3,
                lift_height=before.lift_height,
                curl=before.curl,
            )
        )
    return Paw(tuple(contacts), _turned(paw.flat))


def _score(
    stream: Stream,
    frames: int,
    kind: str,
    habit: Habit,
    paws: dict[str, Paw],
    *,
    heading: np.ndarray | None = None,
    rump: np.ndarray | float = 0.97,
    shoulders: np.ndarray | float = 0.98,
    anchor: np.ndarray | float = 0.5,
    arch: np.ndarray | float = 0.0,
    bend: np.ndarray | float = 0.0,
    spread: np.ndarray | float = 0.0,
    neck: np.ndarray | float = 0.0,
) -> DogScore:
    """A dog about one spot, breathing and looking about."""
    t, still = seconds(frames), np.zeros(frames)
    carried, gaze, tail = head_and_tail(stream, frames, habit)
    breath = 0.004 * np.sin(2.0 * np.pi * (0.4 * t + stream.uniform(0.0, 1.0)))
    sway = [wander(stream, t, 0.012 * habit.loose, 0.1, 0.5) for _ in range(2)]
    small = [wander(stream, t, 0.015 * habit.loose) for _ in range(3)]
    chest = np.stack([bend + small[0], arch + small[1], small[2]], axis=-1)
    up = np.clip(rump + still, 0.0, 1.0)
    return DogScore(
        kind=kind,
        heading=still + stream.uniform(-np.pi, np.pi) if heading is None else heading,
        path=np.zeros((frames, 2)),
        # who lies or sits sways less
        sway=np.stack(sway, axis=-1) * up[:, None],
        height=rump + breath,
        balance=still,
        support=still + 0.5,
        trunk=Trunk(np.zeros((frames, 3)), chest, gaze + np.stack([bend + still, still, still], axis=-1)),
        feet={},
        hands={},
        fore=shoulders + breath,
        anchor=anchor + still,
        neck=carried + neck,
        tail=tail,
        spread=np.stack([spread + still, 0.3 * (spread + still)], axis=-1),
        paws=paws,
    )


def _standing(habit: Habit, limb: str, stream: Stream) -> PawContact:
    """A stay from always to ever, where a dog at ease puts its paw."""
    ahead = stream.uniform(-0.06, 0.06)
    return PawContact(0.0, habit.stance, ahead + 0.02 * ("fore" in limb), -EVER, -EVER, EVER, EVER)


def _until(contact: PawContact, off: int, curl: float) -> PawContact:
    """The same, but left at a frame."""
    return replace(contact, lift=off - 5, off=off, off_pitch=0.3, lift_height=0.08, curl=curl)


def stand(stream: Stream, frames: int) -> DogScore:
    """Standing at ease, looking about."""
    return stood(stream, np.full(frames, stream.uniform(-np.pi, np.pi)))


def stood(stream: Stream, heading: np.ndarray) -> DogScore:
    """Standing at ease, facing as given ``(frames,)``."""
    habit, frames = Habit.draw(stream), len(heading)
    paws = {limb: Paw((_standing(habit, limb, stream),), np.zeros(frames)) for limb in LIMBS}
    turned = stream.sign() * stream.uniform(0.2, 0.6)
    t = np.arange(frames, dtype=float)
    bend = turned * 0.5 * plateau(t, 0.15 * frames, 0.4 * frames, 0.6 * frames, 0.9 * frames)
    return _score(stream, frames, "dog_stand", habit, paws, heading=heading, bend=0.5 * bend)


def turn(stream: Stream, frames: int) -> DogScore:
    """Stepping round on the spot."""
    rate = stream.uniform(0.6, 1.05)
    begin, end = round(0.08 * frames), round(0.92 * frames)
    t = np.arange(frames, dtype=float)
    # even in the middle, with soft ends
    soft = min(0.2 * (end - begin), 18.0)
    progress = np.cumsum(plateau(t, begin, begin + soft, end - soft, end))
    angle = stream.sign() * rate * (end - begin) / FPS
    heading = stream.uniform(-np.pi, np.pi) + angle * progress / progress[-1]
    return turned(stream, heading, (begin, end))


def turned(stream: Stream, heading: np.ndarray, over: tuple[int, int]) -> DogScore:
    """Stepping round on the spot with the heading as given, which changes between two frames."""
    habit, frames = Habit.draw(stream), len(heading)
    period = FPS * stream.uniform(0.62, 0.78)
    paws = {limb: _round(number, habit, over, period, frames) for number, limb in enumerate(LIMBS)}
    return _score(
        stream,
        frames,
        "dog_turn",
        habit,
        paws,
        heading=heading,
        rump=0.95,
        shoulders=0.96,
        bend=0.45 * np.tanh(0.3 / 0.45 * np.gradient(heading) * FPS),
        neck=0.1,
    )


def _round(number: int, habit: Habit, over: tuple[int, int], period: float, frames: int) -> Paw:
    """Steps on the spot in the order of a walk."""
    swing = round(0.27 * period)
    offs = []
    first = over[0] + period * (WALK.phases[number] - 0.1)
    while first < over[1] - 0.2 * period:
        offs.append(max(round(first), 3))
        first += period
    contacts = []
    strikes = [-EVER, *(off + swing for off in offs)]
    for strike, off in zip(strikes, [*offs, EVER], strict=True):
        landed, leaves = strike > -EVER, off < EVER
        moment = 0.5 * (strike + off) if landed and leaves else 0.0 if leaves else frames - 1.0
        contact = PawContact(moment, habit.stance, 0.0, strike, strike + 2 * landed, off - 5 * leaves, off)
        contacts.append(replace(contact, off_pitch=0.3, lift_height=0.12 * habit.lift, curl=0.25))
    return Paw(tuple(contacts), np.zeros(frames))


def _tucked(habit: Habit, limb: str, stream: Stream, off: int, swing: int, frames: int) -> Paw:
    """The paw from standing to where the paw of a lying body is, by one step."""
    before = _until(_standing(habit, limb, stream), off, curl=0.1)
    strike = off + swing
    after = PawContact(frames - 1.0, habit.stance + 0.25, 0.0, strike, strike + 2, EVER, EVER, lain=1.0)
    t = np.arange(frames, dtype=float)
    return Paw((before, replace(after, strike_pitch=0.0)), ramp(t, off, strike + 3.0))


def settling(stream: Stream, frames: int, kind: str) -> DogScore:
    """From standing to sitting or lying, and a while there. kind: ``dog_sit`` or ``dog_lie``."""
    habit, down = Habit.draw(stream), kind == "dog_lie"
    pace = stream.uniform(0.85, 1.2) * min(1.0, frames / 70.0)
    begin = round(stream.uniform(0.06, 0.14) * frames) + 5
    t = np.arange(frames, dtype=float)
    first = stream.choice(SIDES)
    level = ramp(t, begin + 4.0, begin + 37.0 * pace)
    # when the first and the second paw of an end step
    steps = {"hind": (0.0, 13.0 if down else 8.0), "fore": (6.5, 19.5)}
    paws = {}
    for limb in LIMBS:
        side, end = limb.split("_")
        off = begin + round(steps[end][side != first] * pace) + 4
        if end == "hind" or down:
            paws[limb] = _tucked(habit, limb, stream, off, round(10 * pace), frames)
        else:
            paws[limb] = Paw((_standing(habit, limb, stream),), np.zeros(frames))
    delayed = begin + 5.0 * pace
    return _score(
        stream,
        frames,
        kind,
        habit,
        paws,
        rump=0.97 - 0.97 * level,
        shoulders=0.98 - (0.98 * ramp(t, delayed, delayed + 36.0 * pace) if down else 0.10 * level),
        anchor=0.5 if down else level,
        arch=(0.15 if down else 0.25) * level,
        spread=0.35 * level,
        neck=-0.15 * level,
    )


def sit_or_lie(stream: Stream, frames: int, kind: str) -> DogScore:
    """From standing to sitting, or to lying on the belly with the fore legs ahead; one of three gets up."""
    score = settling(stream, frames, kind)
    way = stream.choice(("down", "down", "up"))
    return backwards(score) if way == "up" else score


def shake_paw(stream: Stream, frames: int) -> DogScore:
    """Sitting, and giving a paw."""
    habit = Habit.draw(stream)
    t = np.arange(frames, dtype=float)
    side = stream.choice(SIDES)
    paws = {}
    for limb in LIMBS:
        hind = "hind" in limb
        where = PawContact(0.0, habit.stance + 0.25 * hind, 0.0, -EVER, -EVER, EVER, EVER, lain=float(hind))
        paws[limb] = Paw((where,), np.full(frames, float(hind)))
    up, down = round(stream.uniform(0.10, 0.20) * frames), round(stream.uniform(0.80, 0.90) * frames)
    top = (up + min(18.0, 0.2 * frames), down - min(18.0, 0.2 * frames))
    weight = plateau(t, up + 1.0, top[0], top[1], down - 1.0)
    rate, height = stream.uniform(1.2, 2.2), stream.uniform(-0.40, -0.15)
    shaken = 0.07 * habit.bounce * np.sin(2.0 * np.pi * rate * t / FPS) * plateau(t, up, *top, down)
    still = np.zeros(frames)
    reach = np.stack([still + 0.03, height + shaken, still + stream.uniform(0.55, 0.68)], axis=-1)
    stay = paws[f"{side}_fore"].contacts[0]
    before = _until(stay, up, curl=0.2)
    after = replace(stay, strike=down, flat=down + 3, strike_pitch=0.2)
    paws[f"{side}_fore"] = Paw((before, after), still, PawAir(reach, weight))
    score = _score(
        stream,
        frames,
        "shake_paw",
        habit,
        paws,
        rump=0.0,
        shoulders=0.88,
        anchor=1.0,
        arch=0.25,
        spread=0.35,
        neck=-0.2,
    )
    score.sway[:, 0] -= sign(side) * 0.05 * weight
    return score
