"""The probes: each writes a question differently and says what the answer must then be.

A probe gives a question, and the difference of its answer from the plain answer, brought back to where that
lies. The deviation is its mean length over frames and joints, in per cent of the target's height.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from retarget_bench.motion import rotation
from retarget_bench.motion.body import UP
from retarget_bench.motion.character import Character
from retarget_bench.motion.editing import rigid
from retarget_bench.motion.motion import Motion
from retarget_bench.verification import rewriting
from retarget_bench.verification.rewriting import Rewritten

SHIFT = np.array([1.7, 0.0, -2.3])
"""Metres added to the root."""
LARGER = 1.5
"""Factor of the scaled bodies."""
CENTIMETRES = 100.0
TURN = 2.0
"""Radians by which the whole motion is turned."""

Difference = Callable[[np.ndarray, np.ndarray], np.ndarray]
"""Positions ``(frames, joints, 3)`` of the new answer and of the plain one -> what the one is off by."""


@dataclass(frozen=True)
class Question:
    """A question written differently.

    difference: of the new answer from the plain one, brought to where they must be equal.
    plain:      the source whose answer, on the plain target, is compared with.
    """

    source: Motion
    target: Character
    difference: Difference
    plain: Motion


@dataclass(frozen=True)
class Probe:
    """One way to write a question differently.

    id:       ``source_names``, ...
    meaning:  what is changed, and what must come of it.
    ask:      source and target -> the question, or a sentence that says why it cannot be asked.
    heading:  of its column; "": the id in words.
    demanded: whether every sound method passes; else the deviation is a description (a method that only
              looks back in time need not be symmetric in time).
    tolerance: deviation, in per cent of height, up to which the answer counts as it should be.
    """

    id: str
    meaning: str
    ask: Callable[[Motion, Character], Question | str]
    heading: str = ""
    demanded: bool = True
    tolerance: float = 0.01


Rewrite = Callable[[Character], Rewritten | str]
"""A body, or a sentence with ``{side}`` in it that says why it cannot be written so."""


def _rewritten(
    motion: Motion, target: Character, of_source: Rewrite = Rewritten, of_target: Rewrite = Rewritten
) -> Question | str:
    """The question with source, target or both written differently."""
    performer, body = of_source(motion.character), of_target(target)
    if isinstance(performer, str):
        return performer.format(side="source")
    if isinstance(body, str):
        return body.format(side="target")
    return Question(
        performer.motion(motion), body.body, lambda new, plain: body.positions(new) - plain, motion
    )


def _merged(motion: Motion, target: Character) -> Question | str:
    joint = rewriting.mergeable(motion.character)
    if joint is None:
        return "the source's spine has fewer than three joints"
    stiff = rewriting.stiffened(motion, joint)
    without = rewriting.merged(motion.character, joint)
    return Question(without.motion(stiff), target, np.subtract, stiff)


def _shifted(motion: Motion, target: Character) -> Question:
    """The answer must move by one constant on the floor: how far is the root rule's choice."""

    def but_for_a_constant(new: np.ndarray, plain: np.ndarray) -> np.ndarray:
        moved = (new - plain).mean(axis=(0, 1)) * np.array([1.0, 0.0, 1.0])
        return new - moved - plain

    return Question(replace(motion, root=motion.root + SHIFT), target, but_for_a_constant, motion)


def _turned(motion: Motion, target: Character) -> Question:
    source, back = rigid.moved(motion, TURN, np.zeros(3), np.zeros(3)), rotation.about(UP, -TURN)
    return Question(source, target, lambda new, plain: rotation.rotate(back, new) - plain, motion)


def _reversed(motion: Motion, target: Character) -> Question:
    source = motion.at(slice(None, None, -1))
    return Question(source, target, lambda new, plain: new[::-1] - plain, motion)


def _at_rate(motion: Motion, target: Character, rate: float) -> Question | str:
    if motion.frames < 6:
        return "the clip has fewer than six frames"
    source = motion.resample(rate)
    times = np.arange(motion.frames) / motion.fps
    frames = np.round(times * rate).astype(int)
    # only moments that both rates show: between them the source is unknown
    shared = np.flatnonzero((np.abs(frames / rate - times) < 1e-6) & (frames < source.frames))
    return Question(source, target, lambda new, plain: new[frames[shared]] - plain[shared], motion)


def _on_each_side(name: str, meaning: str, rewrite: Rewrite) -> tuple[Probe, Probe]:
    """Two probes: the source written differently, and the target. meaning: with ``{side}`` in it."""
    of_source, of_target = partial(_rewritten, of_source=rewrite), partial(_rewritten, of_target=rewrite)
    return (
        Probe(f"source_{name}", f"{meaning.format(side='source')}: the same answer", of_source),
        Probe(f"target_{name}", f"{meaning.format(side='target')}: the same answer", of_target),
    )


_LARGER, _IN_CENTIMETRES = (partial(rewriting.scaled, factor=factor) for factor in (LARGER, CENTIMETRES))
PROBES: tuple[Probe, ...] = (
    *_on_each_side("names", "the {side}'s joints get names that say nothing", rewriting.renamed),
    *_on_each_side("order", "the {side}'s joints in another order", rewriting.reordered),
    *_on_each_side("axes", "the {side} authored with Z up", rewriting.z_up),
    *_on_each_side("rest", "the {side}'s bones all rest along +X", rewriting.one_axis),
    *_on_each_side("split", "bones of the {side} split in two", rewriting.split),
    Probe(
        "source_merged",
        "a stiff spine joint of the source is left out: the same answer where a method carries "
        "spines over joint by joint",
        _merged,
        demanded=False,
    ),
    Probe(
        "source_scale",
        "the source 1.5 times as large: the same answer",
        partial(_rewritten, of_source=_LARGER),
    ),
    Probe(
        "target_scale",
        "the target 1.5 times as large: the same answer, as much larger",
        partial(_rewritten, of_target=_LARGER),
    ),
    Probe(
        "units",
        "all lengths in centimetres: the same answer in centimetres",
        partial(_rewritten, of_source=_IN_CENTIMETRES, of_target=_IN_CENTIMETRES),
        "cm for m",
    ),
    Probe(
        "shifted",
        "a constant added to the root: the answer moves by one constant",
        _shifted,
        "root shifted",
    ),
    Probe(
        "turned",
        "the whole motion turned about the vertical: the answer turns too",
        _turned,
    ),
    Probe(
        "mirrored",
        "source and target seen in a mirror: the answer's mirror image",
        partial(_rewritten, of_source=rewriting.mirrored, of_target=rewriting.mirrored),
    ),
    Probe(
        "reversed",
        "the source played backwards: the answer backwards, of methods without memory",
        _reversed,
        "time reversed",
        demanded=False,
    ),
    *(
        Probe(
            f"rate_{rate}",
            f"the source at {rate} frames per second: the same answer at the moments that both rates show",
            partial(_at_rate, rate=rate),
            f"{rate} fps",
            tolerance=0.5,
        )
        for rate in (24, 60, 120)
    ),
)
"""All of them; 30 frames per second is the plain question."""


def deviation(question: Question, new: np.ndarray, plain: np.ndarray, height: float) -> float:
    """Mean distance of two answers in per cent of the plain target's height.

    new, plain: positions ``(frames, joints, 3)``, metres.
    """
    return float(np.linalg.norm(question.difference(new, plain), axis=-1).mean() * 100.0 / height)
