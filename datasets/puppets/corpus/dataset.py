"""The puppets as a data set: cases on request, each motion solved when it is first asked for."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cache, cached_property
from typing import Literal

from retarget_bench.api import Case, CaseInfo, DatasetCard
from retarget_bench.api.datasets import usual_splits
from retarget_bench.errors import BenchError, NotSupported
from retarget_bench.motion.character import Character
from retarget_bench.motion.motion import Motion

from ..bodies import clothes
from ..solver.reach import ground
from . import matched, training_bodies
from .cases import between_legs, cases, family_by_body, of_structure, performers, real_motions
from .clips import SIZES, Clip, clips, unable
from .families import HELD_OUT_KINDS, Part, bodies_of, only_tested, training_manifest
from .pairs import Pairs
from .studio import SECOND, USUAL, Labels, Studio, Training, hand_rests, labels, self_touches, training

VERSION = "3"
"""Of the generator: moves when any motion or list does."""

RELEASE = "puppets-1.0"
"""Generator, lists of cases and metrics, frozen together."""

MOST_BODIES = 9999
"""That can be drawn."""


class Puppets:
    """Exactly paired motion of generated bodies, made on the spot.

    size: ``tiny`` (150 cases at most), ``default`` (106 test clips, about 2,000 cases) or ``large`` (tested
    like default, with tens of hours to train on). part: the cases of ``test`` or of ``validation``, which
    has no held-out body or kind and in every case a body that training goes without. seed: of the
    performances and of drawn bodies. bodies: so many drawn training bodies beside the cast's, in no case.
    between: ``structures``, or ``legs``: from people to dogs and back, without references. flesh: surface
    of everybody, ``bare`` skin or ``clothed``; motion and joints do not depend on it.
    """

    card = DatasetCard(
        name="puppets",
        summary="Paired performances of generated bodies of five structures, with exact contacts",
        version=VERSION,
        licence="CC0 1.0",
        obtain="nothing to download: generated on first use and kept in the cache folder",
        parameters={
            "size": "tiny (clips of 2-4 s, at most 150 cases), default (106 clips of 3-8 s and of 60 s, "
            "about 2,000 cases) or large (the cases of default, tens of hours of training motion)",
            "part": "test, or validation: other clips without the bodies and kinds that only the test has, "
            "each from or to one of four bodies that training goes without",
            "seed": "another number gives another corpus of the same make; published numbers use 0",
            "bodies": "number of training bodies drawn beside the cast's: people by published statistics, "
            "caricatures and dogs; the size's training motion is shared out among all; no case has them",
            "between": "structures, or legs: cases from people to dogs and back, without references; their "
            "answers are compared with the test's own motion as sets (FID), by kind: idle, move and sit",
            "flesh": "surface of all bodies: bare, or clothed (the same vertices moved outward, as loose "
            "cloth lies); motion, joints and cases are the same",
        },
    )

    def __init__(
        self,
        size: Literal["tiny", "default", "large"] = "tiny",
        part: Literal["test", "validation"] = "test",
        seed: int = 0,
        between: Literal["structures", "legs"] = "structures",
        bodies: int = 0,
        flesh: Literal["bare", "clothed"] = "bare",
    ) -> None:
        if size not in SIZES:
            raise BenchError(f"puppets: there is no size {size!r}; sizes are {', '.join(SIZES)}")
        if part not in ("test", "validation"):
            raise BenchError(f"puppets: there is no part {part!r}; cases are of test or validation")
        if between not in ("structures", "legs"):
            raise BenchError(f"puppets: cases are between structures or legs, and not between={between}")
        if flesh not in ("bare", "clothed"):
            raise BenchError(f"puppets: flesh is bare or clothed, and not {flesh}")
        if not 0 <= bodies <= MOST_BODIES:
            raise BenchError(f"puppets: bodies={bodies}; 0 to {MOST_BODIES} may be drawn")
        self.size, self.part, self.seed, self._legs = size, part, seed, between == "legs"
        self._drawn, self._flesh = bodies, flesh
        if self._legs:  # only these cases have no references
            self.card, self.real = replace(self.card, splits=usual_splits("cross")), self._real
        self._studio = Studio(
            f"puppets generator {VERSION}, seed {seed}",
            training_bodies.training_bodies(seed, bodies),
            f", bodies {training_bodies.VERSION}",
            flesh,
        )

    @property
    def content(self) -> str:
        made = f"puppets generator {VERSION}, size {self.size}, part {self.part}, seed {self.seed}"
        made = f"{made}, between legs" if self._legs else made
        made = f"{made}, clothed {clothes.VERSION}" if self._flesh == "clothed" else made
        return f"{made}, {self._drawn} bodies {training_bodies.VERSION}" if self._drawn else made

    @property
    def label(self) -> str:
        name = f"{RELEASE} {self.size}" if self.seed == 0 else f"puppets {self.size}, seed {self.seed}"
        name += ", between legs" if self._legs else ""
        name += ", clothed" if self._flesh == "clothed" else ""
        name += f", {self._drawn} bodies drawn" if self._drawn else ""
        return name if self.part == "test" else f"{name}, {self.part}"

    @property
    def notes(self) -> Sequence[str]:
        listed, left_out = self._clips.values(), self.exclusions()
        names = {name for short in left_out.values() for name in short}
        bodies, kinds = len(family_by_body()), len({clip.kind for clip in listed})
        made = f"puppets are generated: {bodies} bodies, {kinds} kinds of performance."
        if not left_out:
            return (made,)
        return (
            made,
            f"Left out: {sum(map(len, left_out.values()))} performances of {len(left_out)} of the "
            f"{len(listed)} clips, in which one of {len(names)} bodies cannot reach what it has to touch.",
        )

    def characters(self) -> Mapping[str, Character]:
        """Everybody, drawn training bodies too."""
        return self._studio.cast

    @cached_property
    def _clips(self) -> dict[str, Clip]:
        return {clip.name: clip for clip in clips(self.size, self.seed, self.part)}

    def cases(self, task: str, split: str) -> Sequence[CaseInfo]:
        """Raises NotSupported for a task or split that the card does not name."""
        if task not in self.card.tasks or split not in self.card.splits:
            raise NotSupported(
                f"puppets has tasks {', '.join(self.card.tasks)} and splits {', '.join(self.card.splits)}; "
                f"asked for {task} {split}"
            )
        if self._legs:
            return between_legs(self.size, self.part, self.seed)
        return _infos(self.size, self.part, self.seed, task, split)

    def load(self, info: CaseInfo) -> Case:
        """Raises BenchError for a case that is none of this corpus."""
        clip = self._clip(info)
        if info.target not in clip.family.bodies:
            return Case(info, self._studio.motion(clip, info.source), self._studio.cast[info.target])
        return Case(
            info=info,
            source=self._studio.motion(clip, info.source),
            target=self._studio.cast[info.target],
            reference=self._studio.motion(clip, info.target),
            contacts=self._studio.contacts(clip, info.target),
            ground=ground(self._studio.score(clip), clip.family.bodies[info.target]),
            alternative=self._studio.motion(clip, info.target, SECOND),
            touches=self_touches(hand_rests(self._studio.score(clip)), clip.family.bodies[info.target]),
        )

    def _clip(self, info: CaseInfo) -> Clip:
        clip = self._clips.get(info.clip)
        known = family_by_body() if self._legs else clip.family.bodies if clip else ()
        if clip is None or info.source not in clip.family.bodies or info.target not in known:
            raise BenchError(f"puppets[size={self.size},part={self.part}] has no case {info.id}")
        return clip

    def _real(self, task: str, structure: str) -> Sequence[CaseInfo]:
        """Real motion that answers on a structure are compared with: all clips, by all their performers."""
        del task
        return of_structure(real_motions(self.size, self.part, self.seed), structure)

    # ------------------------------------------------------------------------- beyond the contract
    def labels(self, info: CaseInfo) -> Labels:
        """Kind, phase, contacts and self-touches of every frame of the case's reference."""
        clip = self._clip(info)
        return labels(self._studio.score(clip), self._studio.contacts(clip, info.target))

    def unseen(self, info: CaseInfo) -> frozenset[str]:
        """Out of ``source``, ``target`` and ``kind``: what neither training nor validation has."""
        clip = self._clip(info)
        family = family_by_body()
        held = {name: only_tested(family[name].bodies[name]) for name in (info.source, info.target)}
        marks = {
            "source": held[info.source],
            "target": held[info.target],
            "kind": clip.kind in HELD_OUT_KINDS,
        }
        return frozenset(name for name, new in marks.items() if new)

    def motion(self, clip: str | Clip, name: str, manner: str = USUAL) -> Motion:
        """The motion of a body in a clip of this part or in one that is listed elsewhere (``matched``), in
        the usual manner or the second one."""
        return self._studio.motion(clip if isinstance(clip, Clip) else self._clips[clip], name, manner)

    def exclusions(self) -> Mapping[str, Mapping[str, float]]:
        """Clip -> body -> metres by which it falls short of what it would have to touch."""
        found = {
            clip.name: unable(clip, bodies_of(clip.family, self.part)) for clip in self._clips.values()
        }
        return {name: short for name, short in found.items() if short}

    def parts(self) -> Mapping[str, Puppets]:
        """The same corpus, part by part."""
        return {
            "test": Puppets(self.size, "test", self.seed, flesh=self._flesh),
            "validation": Puppets(self.size, "validation", self.seed, flesh=self._flesh),
        }

    def validation(self) -> Puppets:
        """The validation part: each of its cases has a body that ``training`` does not have."""
        return self.parts()["validation"]

    def training(self) -> Training:
        """Structure -> character -> its clips: unpaired, since no two characters perform the same clip."""
        return training(self._studio, self.size, self.seed)

    def training_pairs(self) -> Pairs:
        """The same performances by any two training bodies of a family, with the contacts and self-touches
        of both."""
        return Pairs(self._studio, self.size, self.seed)

    def matched(self, part: Literal["train", "test"] = "train") -> Mapping[matched.Pair, matched.Matches]:
        """Pair of structures -> people and dogs that go the same ways: for unpaired work on bipeds and
        quadrupeds, in equal shares of standing, walking, jogging and running. No cases."""
        return matched.matched(self._studio, self.size, self.seed, part)

    def training_manifest(self) -> Mapping[str, Sequence[str]]:
        """Characters, structures and kinds that training and its validation have: what weights carry."""
        manifest = training_manifest()
        return {**manifest, "characters": [*manifest["characters"], *self._studio.drawn]}

    def performers(self) -> Mapping[str, tuple[str, ...]]:
        """Clip -> the bodies that perform it in some case."""
        found = performers(self.size, self.part, self.seed)
        return {clip.name: names for clip, (names, _) in found.items()}


@cache
def _infos(size: str, part: Part, seed: int, task: str, split: str) -> tuple[CaseInfo, ...]:
    return tuple(
        CaseInfo(
            id=f"puppets/{source}>{target}/{clip.name}",
            task=task,
            split=split,
            source=source,
            target=target,
            clip=clip.name,
            kind=clip.kind,
            frames=clip.frames,
        )
        for clip, source, target in cases(size, part, seed, split)
    )
