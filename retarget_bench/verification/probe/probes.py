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
from retarget_bench.verification import rewriting
from retarget_bench.verification.rewriting import Rewritten

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


Rewrite = Callable[[Character], Rewritten | str]
"""A body, or a sentence with ``{side}`` in it that says why it cannot be written so."""


def _rewritten(
    q: ProbeCase, source: Rewrite = Rewritten, target: Rewrite = Rewritten
) -> ProbeQuestion | str:
    """The question with source, target or both written differently."""
    performer, body = source(q.source.character), target(q.target)
    if isinstance(performer, str):
        return performer.format(side="source")
    if isinstance(body, str):
        return body.format(side="target")
    asked = ProbeCase(performer.motion(q.source), body.body)
    return ProbeQuestion(asked, lambda new, plain: (body.positions(new), plain), q)


def _moved_source(
    rewritten: Callable[[Motion], Motion], bring: Alignment
) -> Callable[[ProbeCase], ProbeQuestion]:
    """The question with another source of the same body."""
    return lambda q: ProbeQuestion(ProbeCase(rewritten(q.source), q.target), bring, q)


def _source_merged(q: ProbeCase) -> ProbeQuestion | str:
    joint = rewriting.mergeable(q.source.character)
    if joint is None:
        return "the source's spine has fewer than three joints"
    stiff = rewriting.stiffened(q.source, joint)
    plain = ProbeCase(stiff, q.target)
    return ProbeQuestion(ProbeCase(rewriting.merged(stiff, joint), q.target), _same, plain)


def _moved_back(new: Places, plain: Places) -> tuple[Places, Places]:
    """The answer must move by one constant on the floor: how far is the root rule's choice."""
    moved = (new - plain).mean(axis=(0, 1)) * np.array([1.0, 0.0, 1.0])
    return new - moved, plain


def _turned_back(new: Places, plain: Places) -> tuple[Places, Places]:
    return rotation.rotate(rotation.about(np.array([0.0, 1.0, 0.0]), -TURN), new), plain


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


def _on_each_side(name: str, meaning: str, rewrite: Rewrite) -> tuple[Probe, Probe]:
    """Two probes: the source written differently, and the target. meaning: with ``{side}`` in it."""
    of_source, of_target = partial(_rewritten, source=rewrite), partial(_rewritten, target=rewrite)
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
        _source_merged,
        demanded=False,
    ),
    Probe(
        "source_scale",
        "the source 1.5 times as large: the same answer",
        partial(_rewritten, source=_LARGER),
    ),
    Probe(
        "target_scale",
        "the target 1.5 times as large: the same answer, as much larger",
        partial(_rewritten, target=_LARGER),
    ),
    Probe(
        "units",
        "all lengths in centimetres: the same answer in centimetres",
        partial(_rewritten, source=_IN_CENTIMETRES, target=_IN_CENTIMETRES),
        "cm for m",
    ),
    Probe(
        "shifted",
        "a constant added to the root: the answer moves by one constant",
        _moved_source(lambda motion: replace(motion, root=motion.root + SHIFT), _moved_back),
        "root shifted",
    ),
    Probe(
        "turned",
        "the whole motion turned about the vertical: the answer turns too",
        _moved_source(lambda motion: rewriting.turned_motion(motion, TURN), _turned_back),
    ),
    Probe(
        "mirrored",
        "source and target seen in a mirror: the answer's mirror image",
        partial(_rewritten, source=rewriting.mirrored, target=rewriting.mirrored),
    ),
    Probe(
        "reversed",
        "the source played backwards: the answer backwards, of methods without memory",
        _moved_source(
            lambda motion: motion.at(slice(None, None, -1)), lambda new, plain: (new[::-1], plain)
        ),
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
