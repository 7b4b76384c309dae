"""The puppets as a data set: size ``tiny`` is read from its files, every other corpus is generated."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cached_property, partial
from pathlib import Path
from typing import TYPE_CHECKING, Literal, get_args

from retarget_bench.api import Case, CaseInfo, Dataset, DatasetCard
from retarget_bench.api.datasets import usual_splits
from retarget_bench.errors import BenchError, FileError, NotSupported
from retarget_bench.motion.character import Character
from retarget_bench.motion.motion import Motion

from .contract import (
    USUAL,
    VERSION,
    Corpus,
    Labels,
    Manner,
    Part,
    Size,
    Source,
    Surface,
    Training,
    Version,
    absent,
)
from .frozen import Frozen

if TYPE_CHECKING:  # the generator is imported where it is needed alone
    from .generator.corpus.clips import Clip
    from .generator.corpus.generated import Generated
    from .generator.corpus.matched import Matches, Pair
    from .generator.corpus.pairs import Pairs

RELEASE = "puppets-1.0"
"""Generator, lists of cases and metrics, frozen together."""

MOST_BODIES = 9999
"""That can be drawn."""


class Puppets(Dataset):
    """Exactly paired motion of generated bodies; that of size ``tiny`` comes with the package.

    size: ``tiny`` (150 cases at most), ``default`` (106 test clips, about 2,000 cases), ``large`` (tested
    like default, with tens of hours to train on) or ``kinds`` (four clips of each kind by one pair of
    bodies a split). part: the cases of ``test`` or of ``validation``, which has no held-out body or kind
    and in every case a body that training goes without. seed: of the performances and of drawn bodies.
    bodies: so many drawn training bodies beside the cast's, in no case. between: ``structures``, or
    ``legs``: from people to dogs and back, without references. flesh: surface of everybody, ``bare`` skin
    or ``clothed``; motion and joints do not depend on it. version: 1.1 has in addition limbs that
    straighten, feet that are never quite still and unsteady hands. source: ``captured`` puts the noise of
    motion capture on the sources of cases.
    """

    card = DatasetCard(
        name="puppets",
        summary="Paired performances of generated bodies of five structures, with exact contacts",
        version=VERSION,
        licence="CC0 1.0",
        obtain="nothing to download: size tiny comes with the package, the others are generated on first "
        "use and kept in the cache folder",
        parameters={
            "size": "tiny (clips of 2-4 s, at most 150 cases), default (106 clips of 3-8 s and of 60 s, "
            "about 2,000 cases), large (the cases of default, tens of hours of training motion) or kinds "
            "(four clips of each kind by one pair of bodies in each split; trained as tiny)",
            "part": "test, or validation: other clips without the bodies and kinds that only the test has, "
            "each from or to one of four bodies that training goes without",
            "seed": "another number gives another corpus of the same make; published numbers use 0",
            "bodies": "number of training bodies drawn beside the cast's: people by published statistics, "
            "caricatures and dogs; the size's training motion is shared out among all; no case has them",
            "between": "structures, or legs: cases from people to dogs and back, without references; their "
            "answers are compared with the test's own motion as sets (FID), by kind: idle, move and sit",
            "flesh": "surface of all bodies: bare, or clothed (the same vertices moved outward, as loose "
            "cloth lies); motion, joints and cases are the same",
            "version": "1.0, or 1.1: the same cases of the same performances, with limbs that straighten, "
            "feet that are never quite still, and hands that are never quite steady",
            "source": "exact, or captured: sources of cases have the noise of motion capture (jitter, a "
            "foot that sinks, a leg measured too long); references, training and other tasks have none",
        },
    )

    def __init__(
        self,
        size: Size = "tiny",
        part: Part = "test",
        seed: int = 0,
        between: Literal["structures", "legs"] = "structures",
        bodies: int = 0,
        flesh: Surface = "bare",
        version: Version = "1.0",
        source: Source = "exact",
    ) -> None:
        if size not in get_args(Size):
            raise BenchError(f"puppets: there is no size {size!r}; sizes are {', '.join(get_args(Size))}")
        if part not in get_args(Part):
            raise BenchError(f"puppets: there is no part {part!r}; cases are of test or validation")
        if between not in ("structures", "legs"):
            raise BenchError(f"puppets: cases are between structures or legs, and not between={between}")
        if flesh not in get_args(Surface):
            raise BenchError(f"puppets: flesh is bare or clothed, and not {flesh}")
        if version not in get_args(Version):
            raise BenchError(
                f"puppets: there is no version {version!r}; versions are {', '.join(get_args(Version))}"
            )
        if source not in get_args(Source):
            raise BenchError(f"puppets: source is exact or captured, and not {source}")
        if source == "captured" and between == "legs":
            raise BenchError(
                "puppets: source=captured goes with between=structures; cases between legs have no "
                "references, which would stay exact"
            )
        if not 0 <= bodies <= MOST_BODIES:
            raise BenchError(f"puppets: bodies={bodies}; 0 to {MOST_BODIES} may be drawn")
        self.size, self.part, self.seed, self._legs = size, part, seed, between == "legs"
        self._drawn, self._flesh = bodies, flesh
        self._version, self._source = version, source
        if self._legs:  # only these cases have no references
            self.card, self.real = replace(self.card, splits=usual_splits("cross")), self._real

    @cached_property
    def _corpus(self) -> Corpus:
        make = (self.size, self.seed, self._drawn, self._flesh, self._version)
        return Frozen(self.part) if make == ("tiny", 0, 0, "bare", "1.0") else self._generated

    @cached_property
    def _generated(self) -> Generated:
        try:
            from .generator.corpus.generated import Generated
        except ModuleNotFoundError as error:
            if not str(error.name).startswith(f"{__package__}.generator"):
                raise
            raise FileError(
                Path(__file__).with_name("generator"),
                "is missing, and makes all but the cases and training clips of puppets[size=tiny]; "
                "use these, or install the package again",
            ) from error
        return Generated(self.size, self.part, self.seed, self._drawn, self._flesh, self._version)

    @property
    def content(self) -> str:
        text = f"puppets generator {VERSION}, size {self.size}, part {self.part}, seed {self.seed}"
        text = f"{text}, between legs" if self._legs else text
        text = f"{text}{self._corpus.variant}"
        return text if self._source == "exact" else f"{text}, source {self._source}"

    @property
    def label(self) -> str:
        release = RELEASE if self._version == "1.0" else f"puppets-{self._version}"
        name = f"{release} {self.size}" if self.seed == 0 else f"puppets {self.size}, seed {self.seed}"
        name += f", version {self._version}" if self.seed and self._version != "1.0" else ""
        name += ", between legs" if self._legs else ""
        name += ", clothed" if self._flesh == "clothed" else ""
        name += f", {self._drawn} bodies drawn" if self._drawn else ""
        name += ", sources captured" if self._source == "captured" else ""
        return name if self.part == "test" else f"{name}, {self.part}"

    @property
    def notes(self) -> Sequence[str]:
        clips, left_out = self._corpus.clips, self.exclusions()
        names = {name for short in left_out.values() for name in short}
        bodies, kinds = self._corpus.bodies, len(set(clips.values()))
        summary = f"puppets are generated: {bodies} bodies, {kinds} kinds of performance."
        if not left_out:
            return (summary,)
        return (
            summary,
            f"Left out: {sum(map(len, left_out.values()))} performances of {len(left_out)} of the "
            f"{len(clips)} clips, in which one of {len(names)} bodies cannot reach what it has to touch.",
        )

    def characters(self) -> Mapping[str, Character]:
        """Everybody, drawn training bodies too."""
        return self._corpus.cast

    def cases(self, task: str, split: str) -> Sequence[CaseInfo]:
        """Raises NotSupported for a task or split that the card does not name."""
        if task not in self.card.tasks or split not in self.card.splits:
            raise NotSupported(
                f"puppets has tasks {', '.join(self.card.tasks)} and splits {', '.join(self.card.splits)}; "
                f"asked for {task} {split}"
            )
        return self._corpus.between_legs() if self._legs else self._corpus.cases(split)

    def load(self, info: CaseInfo) -> Case:
        """Raises BenchError for a case that is none of this corpus."""
        case = self._corpus.load(info)
        if case.reference is None and not self._legs:
            raise absent(info, self.size, self.part)
        if self._source == "captured":
            assert isinstance(case.source, Motion)
            return replace(case, source=self._generated.captured(info, case.source))
        return case

    def _real(self, task: str, structure: str) -> Sequence[CaseInfo]:
        """Real motion that answers on a structure are compared with: all clips, by all their performers."""
        del task
        return self._corpus.real(structure)

    # ------------------------------------------------------------------------- beyond the contract
    def labels(self, info: CaseInfo) -> Labels:
        """Kind, phase, contacts and self-touches of every frame of the case's reference."""
        return self._corpus.labels(info)

    def unseen(self, info: CaseInfo) -> frozenset[str]:
        """Out of ``source``, ``target`` and ``kind``: what neither training nor validation has."""
        return self._corpus.unseen(info)

    def motion(self, clip: str | Clip, name: str, manner: Manner = USUAL) -> Motion:
        """The motion of a body in a clip of this part or in one that is listed elsewhere (``matched``), in
        the usual manner or the second one."""
        frozen = self._corpus.motion(clip, name, manner) if isinstance(clip, str) else None
        return self._generated.motion(clip, name, manner) if frozen is None else frozen

    def exclusions(self) -> Mapping[str, Mapping[str, float]]:
        """Clip -> body -> metres by which it falls short of what it would have to touch."""
        return self._corpus.exclusions()

    def parts(self) -> Mapping[str, Puppets]:
        """The same corpus, part by part."""
        make = partial(
            Puppets,
            self.size,
            seed=self.seed,
            flesh=self._flesh,
            version=self._version,
            source=self._source,
        )
        return {part: make(part=part) for part in get_args(Part)}

    def validation(self) -> Puppets:
        """The validation part: each of its cases has a body that ``training`` does not have."""
        return self.parts()["validation"]

    def training(self) -> Training:
        """Structure -> character -> its clips: unpaired, since no two characters perform the same clip."""
        return self._corpus.training()

    def training_pairs(self) -> Pairs:
        """The same performances by any two training bodies of a family, with the contacts and self-touches
        of both."""
        return self._generated.training_pairs()

    def matched(self, part: Literal["train", "test"] = "train") -> Mapping[Pair, Matches]:
        """Pair of structures -> people and dogs that go the same ways: for unpaired work on bipeds and
        quadrupeds, in equal shares of standing, walking, jogging and running. No cases."""
        return self._generated.matched(part)

    def training_manifest(self) -> Mapping[str, Sequence[str]]:
        """Characters, structures and kinds that training and its validation have: what weights carry."""
        return self._corpus.training_manifest()

    def performers(self) -> Mapping[str, tuple[str, ...]]:
        """Clip -> the bodies that perform it in some case."""
        return self._corpus.performers()
