"""The probes: each writes a question differently and says what the answer must then be.

A probe gives a question and a way to bring the new answer back to where the plain answer lies. The
deviation is the mean distance between the two over frames and joints, in per cent of the target's height.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from retarget_bench.motion import rotation
from retarget_bench.motion.character import Character
from retarget_bench.motion.motion import Motion
from retarget_bench.verification.probe import rewriting

SHIFT = np.array([1.7, 0.0, -2.3])
"""Metres added to the root."""
LARGER = 1.5
"""Factor of the scaled bodies."""
CENTIMETRES = 100.0
TURN = 2.0
"""Radians by which the whole motion is turned."""

Places = np.ndarray
"""``(frames, joints, 3)`` metres."""
Alignment = Callable[[Places, Places], tuple[Places, Places]]
"""(new answer, plain answer) -> both where they must be equal."""


@dataclass(frozen=True)
class ProbeCase:
    """A motion, and the body that shall perform it."""

    source: Motion
    target: Character


@dataclass(frozen=True)
class ProbeQuestion:
    """plain: the question whose answer is compared with (mostly the question itself)."""

    question: ProbeCase
    bring: Alignment
    plain: ProbeCase


@dataclass(frozen=True)
class Probe:
    """One way to write a question differently.

    id:       ``source_names``, ...
    meaning:  what is changed, and what must come of it.
    ask:      the question, or a sentence that says why it cannot be asked.
    heading:  of its column; "": the id in words.
    demanded: whether every sound method passes; else the deviation is a description (a method that only
              looks back in time need not be symmetric in time).
    tolerance: deviation, in per cent of height, up to which the answer counts as it should be.
    """

    id: str
    meaning: str
    ask: Callable[[ProbeCase], ProbeQuestion | str]
    heading: str = ""
    demanded: bool = True
    tolerance: float = 0.01

    @property
    def label(self) -> str:
        return self.heading or self.id.replace("_", " ")


def _same(new: Places, plain: Places) -> tuple[Places, Places]:
    return new, plain


def _source(
    rewritten: Callable[[Motion], Motion], bring: Alignment = _same
) -> Callable[[ProbeCase], ProbeQuestion]:
    """The question with another source."""
    return lambda q: ProbeQuestion(ProbeCase(rewritten(q.source), q.target), bring, q)


def _target(
    rewritten: Callable[[Character], Character], bring: Alignment = _same
) -> Callable[[ProbeCase], ProbeQuestion]:
    """The question with another target."""
    return lambda q: ProbeQuestion(ProbeCase(q.source, rewritten(q.target)), bring, q)


# --------------------------------------------------------------------------------------- how it is written
def _source_order(q: ProbeCase) -> ProbeQuestion:
    order = rewriting.other_order(q.source.character)
    body = rewriting.reordered(q.source.character, order)
    source = Motion(body, q.source.rotations[:, order], q.source.root, q.source.fps)
    return ProbeQuestion(ProbeCase(source, q.target), _same, q)


def _target_order(q: ProbeCase) -> ProbeQuestion:
    order = rewriting.other_order(q.target)
    asked = ProbeCase(q.source, rewriting.reordered(q.target, order))
    return ProbeQuestion(asked, lambda new, plain: (new, plain[:, order]), q)


def _source_split(q: ProbeCase) -> ProbeQuestion | str:
    if not (ends := rewriting.splittable(q.source.character)):
        return "the source has no bone that files split"
    return ProbeQuestion(ProbeCase(rewriting.split_motion(q.source, ends), q.target), _same, q)


def _target_split(q: ProbeCase) -> ProbeQuestion | str:
    if not (ends := rewriting.splittable(q.target)):
        return "the target has no bone that files split"
    body, place = rewriting.split(q.target, ends)
    return ProbeQuestion(ProbeCase(q.source, body), lambda new, plain: (new[:, place], plain), q)


def _source_merged(q: ProbeCase) -> ProbeQuestion | str:
    joint = rewriting.mergeable(q.source.character)
    if joint is None:
        return "the source's spine has fewer than three joints"
    stiff = rewriting.stiffened(q.source, joint)
    plain = ProbeCase(stiff, q.target)
    return ProbeQuestion(ProbeCase(rewriting.merged(stiff, joint), q.target), _same, plain)


# --------------------------------------------------------------------------------------- size, place, side
def _units(q: ProbeCase) -> ProbeQuestion:
    source, target = rewriting.scaled_motion(q.source, CENTIMETRES), rewriting.scaled(q.target, CENTIMETRES)
    asked = ProbeCase(source, target)
    return ProbeQuestion(asked, lambda new, plain: (new / CENTIMETRES, plain), q)


def _moved_back(new: Places, plain: Places) -> tuple[Places, Places]:
    """The answer must move by one constant on the floor: how far is the root rule's choice."""
    moved = (new - plain).mean(axis=(0, 1)) * np.array([1.0, 0.0, 1.0])
    return new - moved, plain


def _turned_back(new: Places, plain: Places) -> tuple[Places, Places]:
    return rotation.rotate(rotation.about(np.array([0.0, 1.0, 0.0]), -TURN), new), plain


def _mirrored(q: ProbeCase) -> ProbeQuestion | str:
    ours, theirs = rewriting.partners(q.source.character), rewriting.partners(q.target)
    if ours is None or theirs is None:
        return f"the joints of the {'source' if ours is None else 'target'} are not the same on both sides"
    asked = ProbeCase(rewriting.mirrored_motion(q.source, ours), rewriting.mirrored(q.target, theirs))
    return ProbeQuestion(asked, lambda new, plain: (new[:, theirs] * rewriting.MIRROR, plain), q)


# --------------------------------------------------------------------------------------- time
def _rate(q: ProbeCase, rate: float) -> ProbeQuestion | str:
    if q.source.frames < 6:
        return "the clip has fewer than six frames"
    source = q.source.resample(rate)
    times = np.arange(q.source.frames) / q.source.fps
    frames = np.round(times * rate).astype(int)
    # only moments that both rates show: between them nobody knows the source
    both = (np.abs(frames / rate - times) < 1e-6) & (frames < source.frames)
    ours = np.flatnonzero(both)
    asked = ProbeCase(source, q.target)
    return ProbeQuestion(asked, lambda new, plain: (new[frames[ours]], plain[ours]), q)


PROBES: tuple[Probe, ...] = (
    Probe(
        "source_names",
        "the source's joints get names that say nothing: the same answer",
        _source(lambda motion: replace(motion, character=rewriting.renamed(motion.character))),
    ),
    Probe(
        "target_names",
        "the target's joints get names that say nothing: the same answer",
        _target(rewriting.renamed),
    ),
    Probe("source_order", "the source's joints in another order: the same answer", _source_order),
    Probe("target_order", "the target's joints in another order: the same answer", _target_order),
    Probe(
        "source_axes",
        "the source authored with Z up: the same answer",
        _source(lambda motion: rewriting.reframed_motion(motion, rewriting.z_up(motion.character))),
    ),
    Probe(
        "target_axes",
        "the target authored with Z up: the same answer",
        _target(lambda body: rewriting.reframed(body, rewriting.z_up(body))),
    ),
    Probe(
        "source_rest",
        "the source's bones all rest along +X: the same answer",
        _source(lambda motion: rewriting.reframed_motion(motion, rewriting.one_axis(motion.character))),
    ),
    Probe(
        "target_rest",
        "the target's bones all rest along +X: the same answer",
        _target(lambda body: rewriting.reframed(body, rewriting.one_axis(body))),
    ),
    Probe("source_split", "bones of the source split in two: the same answer", _source_split),
    Probe("target_split", "bones of the target split in two: the same answer", _target_split),
    Probe(
        "source_merged",
        "a stiff spine joint of the source is left out: the same answer where a method carries "
        "spines over joint by joint",
        _source_merged,
        demanded=False,
    ),
    Probe(
        "source_scale",
        "the source 1.5 times as large: the same answer",
        _source(lambda motion: rewriting.scaled_motion(motion, LARGER)),
    ),
    Probe(
        "target_scale",
        "the target 1.5 times as large: the same answer, as much larger",
        _target(lambda body: rewriting.scaled(body, LARGER), lambda new, plain: (new / LARGER, plain)),
    ),
    Probe("units", "all lengths in centimetres: the same answer in centimetres", _units, "cm for m"),
    Probe(
        "shifted",
        "a constant added to the root: the answer moves by one constant",
        _source(lambda motion: replace(motion, root=motion.root + SHIFT), _moved_back),
        "root shifted",
    ),
    Probe(
        "turned",
        "the whole motion turned about the vertical: the answer turns too",
        _source(lambda motion: rewriting.turned_motion(motion, TURN), _turned_back),
    ),
    Probe("mirrored", "source and target seen in a mirror: the answer's mirror image", _mirrored),
    Probe(
        "reversed",
        "the source played backwards: the answer backwards, of methods without memory",
        _source(lambda motion: motion.at(slice(None, None, -1)), lambda new, plain: (new[::-1], plain)),
        "time reversed",
        demanded=False,
    ),
    *(
        Probe(
            f"rate_{rate}",
            f"the source at {rate} frames per second: the same answer at the moments that both rates show",
            partial(_rate, rate=rate),
            f"{rate} fps",
            tolerance=0.5,
        )
        for rate in (24, 60, 120)
    ),
)
"""All of them; 30 frames per second is the plain question."""


def deviation(asked: ProbeQuestion, new: Places, plain: Places) -> float:
    """Mean distance in per cent of the plain target's height."""
    a, b = asked.bring(new, plain)
    return float(np.linalg.norm(a - b, axis=-1).mean() * 100.0 / asked.plain.target.height)
