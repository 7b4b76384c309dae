"""The puppets as a data set: cases on request, each clip solved when it is first asked for."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property, lru_cache
from typing import Literal

import numpy as np

from retarget_bench.api import Case, CaseInfo, Contacts, DatasetCard, Ground
from retarget_bench.errors import BenchError, NotSupported
from retarget_bench.motion.character import Character
from retarget_bench.motion.contact import CONTACT_ROLES
from retarget_bench.motion.motion import Motion

from . import rigs
from .cache import Arrays, kept
from .characters import BODIES
from .clips import SIZES, Clip, cases, clips
from .solver import solve

VERSION = "1"
"""Of the generator: moves when any motion does."""


class Puppets:
    """Exactly paired motion of six bodies, made on the spot.

    size: ``tiny`` (15 clips, 150 cases) or ``default`` (54 clips, all pairs). seed: of the performances.
    """

    card = DatasetCard(
        name="puppets",
        summary="Paired performances of six generated bodies, with exact contacts",
        version=VERSION,
        licence="CC0 1.0",
        obtain="nothing to download: generated on first use and kept in the cache folder",
        parameters={
            "size": "tiny (15 clips of 2-4 s, 150 cases) or default (54 clips of 3-8 s, 1944 cases)",
            "seed": "another number gives another corpus of the same make; published numbers use 0",
        },
    )

    def __init__(self, size: Literal["tiny", "default"] = "tiny", seed: int = 0) -> None:
        if size not in SIZES:
            raise BenchError(f"puppets: there is no size {size!r}; sizes are {', '.join(SIZES)}")
        self.size, self.seed = size, seed
        self._solved = lru_cache(maxsize=64)(self._solve)

    @property
    def content(self) -> str:
        return f"puppets generator {VERSION}, size {self.size}, seed {self.seed}"

    @property
    def label(self) -> str:
        other = f", seed {self.seed}" if self.seed else ""
        return f"puppets {self.size}{other}"

    @property
    def notes(self) -> Sequence[str]:
        kinds = dict.fromkeys(clip.kind for clip in clips(self.size, self.seed))
        return (f"puppets are generated; so far two structures of three bodies each {', '.join(kinds)}.",)

    def characters(self) -> Mapping[str, Character]:
        return self._cast

    @cached_property
    def _cast(self) -> dict[str, Character]:
        return {name: rigs.character(body) for name, body in BODIES.items()}

    @cached_property
    def _clips(self) -> dict[str, Clip]:
        return {clip.name: clip for clip in clips(self.size, self.seed)}

    def cases(self, task: str, split: str) -> Sequence[CaseInfo]:
        """Raises NotSupported for a task or split that the card does not name."""
        if task not in self.card.tasks or split not in self.card.splits:
            raise NotSupported(
                f"puppets has tasks {', '.join(self.card.tasks)} and splits {', '.join(self.card.splits)}; "
                f"asked for {task} {split}"
            )
        return [
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
            for clip, source, target in cases(self.size, self.seed, split)
        ]

    def load(self, info: CaseInfo) -> Case:
        """Raises BenchError for a case that is none of this corpus."""
        if info.clip not in self._clips or {info.source, info.target} - set(self._cast):
            raise BenchError(f"puppets[size={self.size}] has no case {info.id}")
        reference, planted = self._motion(info.clip, info.target)
        source, _ = self._motion(info.clip, info.source)
        return Case(
            info=info,
            source=source,
            target=self._cast[info.target],
            reference=reference,
            contacts=Contacts(CONTACT_ROLES, planted),
            ground=Ground(0.0),
        )

    def _motion(self, clip: str, name: str) -> tuple[Motion, np.ndarray]:
        arrays = self._solved(clip)
        local, root = arrays[f"{name}.rotations"], arrays[f"{name}.root"]
        return rigs.motion(local, root, self._cast[name]), arrays[f"{name}.planted"]

    def _solve(self, clip: str) -> Arrays:
        names = frozenset(
            f"{body}.{array}" for body in BODIES for array in ("rotations", "root", "planted")
        )
        return kept(self.content, clip, names, lambda: self._build(self._clips[clip]))

    def _build(self, clip: Clip) -> Arrays:
        score, arrays = clip.score(), {}
        for name, body in BODIES.items():
            solution = solve(score, body)
            arrays[f"{name}.rotations"] = rigs.rotations(solution, body, self._cast[name])
            arrays[f"{name}.root"] = solution.root
            arrays[f"{name}.planted"] = solution.planted
        return arrays
