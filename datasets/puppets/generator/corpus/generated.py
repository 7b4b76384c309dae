"""A corpus whose motions are solved on first access, and kept in the cache folder."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Literal

from retarget_bench.api import Case, CaseInfo
from retarget_bench.motion.character import Character
from retarget_bench.motion.motion import Motion

from ...contract import (
    SECOND,
    USUAL,
    VERSION,
    Labels,
    Manner,
    Part,
    Size,
    Surface,
    Training,
    Version,
    absent,
)
from ..bodies import clothes
from ..randomness import Stream
from ..solver.reach import ground
from . import matched, training_bodies
from .capture import captured
from .cases import between_legs, case_infos, performers, real_motions
from .clip_solver import ClipSolver, labels, own_rests, self_touches, training
from .clips import Clip, clips, unable
from .families import HELD_OUT_KINDS, bodies_of, everybody, only_tested, training_manifest
from .pairs import Pairs


class Generated:
    """One part of a corpus (``contract.py``) of any size, seed and make.

    Lists of clips and cases, and who is left out of them, are the same in both versions.
    """

    def __init__(
        self,
        size: Size,
        part: Part = "test",
        seed: int = 0,
        drawn: int = 0,
        surface: Surface = "bare",
        version: Version = "1.0",
    ) -> None:
        self.size, self.part, self.seed = size, part, seed
        self._drawn, self._surface, self._version = drawn, surface, version
        self.solver = ClipSolver(
            f"puppets generator {VERSION}, seed {seed}{self._release}",
            training_bodies.training_bodies(seed, drawn),
            f", bodies {training_bodies.VERSION}",
            surface,
            version,
        )

    @property
    def _release(self) -> str:
        return "" if self._version == "1.0" else f", release {self._version}"

    @property
    def variant(self) -> str:
        clothed = f", clothed {clothes.VERSION}" if self._surface == "clothed" else ""
        drawn = f", {self._drawn} bodies {training_bodies.VERSION}" if self._drawn else ""
        return f"{self._release}{clothed}{drawn}"

    @property
    def bodies(self) -> int:
        return len(everybody())

    @property
    def clips(self) -> Mapping[str, str]:
        return {name: clip.kind for name, clip in self._clips.items()}

    @property
    def cast(self) -> Mapping[str, Character]:
        return self.solver.cast

    @cached_property
    def _clips(self) -> dict[str, Clip]:
        return {clip.name: clip for clip in clips(self.size, self.seed, self.part)}

    def cases(self, split: str) -> Sequence[CaseInfo]:
        return case_infos(self.size, self.part, self.seed, split)

    def between_legs(self) -> Sequence[CaseInfo]:
        return between_legs(self.size, self.part, self.seed)

    def real(self, structure: str) -> Sequence[CaseInfo]:
        return real_motions(self.size, self.part, self.seed, structure)

    def load(self, info: CaseInfo) -> Case:
        """Raises BenchError for a case that is none of this corpus."""
        clip = self._clip(info)
        if info.target not in clip.family.bodies:
            return Case(info, self.solver.motion(clip, info.source), self.solver.cast[info.target])
        return Case(
            info=info,
            source=self.solver.motion(clip, info.source),
            target=self.solver.cast[info.target],
            reference=self.solver.motion(clip, info.target),
            contacts=self.solver.contacts(clip, info.target),
            ground=ground(self.solver.score(clip), clip.family.bodies[info.target]),
            alternative=self.solver.motion(clip, info.target, SECOND),
            touches=self_touches(own_rests(self.solver.score(clip)), clip.family.bodies[info.target]),
        )

    def captured(self, info: CaseInfo, source: Motion) -> Motion:
        """The source of a case as a recording would have it (``capture.py``)."""
        return captured(source, Stream("puppets", self.seed, info.clip, info.source, "captured"))

    def _clip(self, info: CaseInfo) -> Clip:
        clip = self._clips.get(info.clip)
        if clip is None or info.source not in clip.family.bodies or info.target not in everybody():
            raise absent(info, self.size, self.part)
        return clip

    def motion(self, clip: str | Clip, name: str, manner: Manner = USUAL) -> Motion:
        return self.solver.motion(clip if isinstance(clip, Clip) else self._clips[clip], name, manner)

    def labels(self, info: CaseInfo) -> Labels:
        clip = self._clip(info)
        return labels(self.solver.score(clip), self.solver.contacts(clip, info.target))

    def unseen(self, info: CaseInfo) -> frozenset[str]:
        clip = self._clip(info)
        marks = {
            "source": only_tested(everybody()[info.source]),
            "target": only_tested(everybody()[info.target]),
            "kind": clip.kind in HELD_OUT_KINDS,
        }
        return frozenset(name for name, new in marks.items() if new)

    def exclusions(self) -> Mapping[str, Mapping[str, float]]:
        gaps = {clip.name: unable(clip, bodies_of(clip.family, self.part)) for clip in self._clips.values()}
        return {name: short for name, short in gaps.items() if short}

    def performers(self) -> Mapping[str, tuple[str, ...]]:
        by_clip = performers(self.size, self.part, self.seed)
        return {clip.name: tuple(bodies) for clip, bodies in by_clip.items()}

    def training(self) -> Training:
        return training(self.solver, self.size, self.seed)

    def training_manifest(self) -> Mapping[str, Sequence[str]]:
        manifest = training_manifest()
        return {**manifest, "characters": [*manifest["characters"], *self.solver.drawn]}

    # ------------------------------------------------------------------------- beyond the contract
    def training_pairs(self) -> Pairs:
        return Pairs(self.solver, self.size, self.seed)

    def matched(self, part: Literal["train", "test"]) -> Mapping[matched.Pair, matched.Matches]:
        return matched.matched(self.solver, self.size, self.seed, part)
