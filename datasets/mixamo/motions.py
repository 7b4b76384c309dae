"""Rigs, motions and pairs of a Mixamo folder, read on access."""

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import lru_cache
from pathlib import Path

from retarget_bench.api import Performed
from retarget_bench.errors import BenchError
from retarget_bench.files import digest
from retarget_bench.motion import bvh
from retarget_bench.motion.character import Character, Motion
from retarget_bench.motion.files.catalogue import CatalogueEntry
from retarget_bench.motion.roles import is_body
from retarget_bench.motion.skeleton import Skeleton
from retarget_bench.motion.structures import Reduction, reduce
from retarget_bench.training.lazy_clips import Cast, NamedClips
from retarget_bench.training.stored_pairs import StoredPairs

STRUCTURE_A = "mixamo-A"
"""Aj, BigVegas, Kaya, SportyGranny: a ``Pelvis`` under ``Hips``, no joints at toe and head ends."""
STRUCTURE_B = "mixamo-B"
"""The characters with the suffix ``_m``: a spine joint and both shoulders split in two, ends as joints."""
PAPER = {STRUCTURE_A: "S23", STRUCTURE_B: "S28"}
"""The structures that SAN and PAN reduce these to."""
_SPLITS = {"Spine1_split", "LeftShoulder_split", "RightShoulder_split"}


@dataclass(frozen=True, eq=False)
class Rig:
    """One body of one character: as its files have it, and as cases use it.

    native:    every joint of the file; ``native.structure`` decides the splits.
    reduction: to fewer joints, or None where all are kept.
    """

    native: Character
    reduction: Reduction | None

    @property
    def character(self) -> Character:
        return self.native if self.reduction is None else self.reduction.character

    def motion(self, recording: bvh.Recording, fps: float) -> Motion:
        """A recording of this body at another rate, on the joints that cases use."""
        complete = self.native.motion(recording.rotations, recording.root, recording.fps).resample(fps)
        return complete if self.reduction is None else self.reduction.apply(complete)


def rig(name: str, skeleton: Skeleton, structure: str) -> Rig:
    """The rig of a character; ``structure`` is ``native``, ``full`` or a name of ``structures.py``.

    Raises SkeletonError where the skeleton cannot be reduced to it.
    """
    body = Character.of(name, skeleton)
    topology = structure_of(skeleton, body.roles)
    body = replace(body, structure=topology)
    if structure == "full":
        return Rig(body, None)
    return Rig(body, reduce(body, PAPER.get(topology, "body22") if structure == "native" else structure))


def structure_of(skeleton: Skeleton, roles: Sequence[str | None]) -> str:
    """``mixamo-A``, ``mixamo-B``, or for other rigs ``mixamo-`` and a hash of their tree of body joints."""
    bare = {name.rpartition(":")[2] for name in skeleton.names}
    if bare >= _SPLITS:
        return STRUCTURE_B
    if "Pelvis" in bare and "LeftToe_End" not in bare:
        return STRUCTURE_A
    parents = skeleton.parents.tolist()
    lines = []
    for joint, role in enumerate(roles):
        if role is None or not is_body(role):
            continue
        above = parents[joint]
        while above >= 0 and ((ancestor := roles[above]) is None or not is_body(ancestor)):
            above = parents[above]
        lines.append(f"{role} {roles[above] if above >= 0 else '-'}")
    return f"mixamo-{digest(chr(10).join(sorted(lines)), 6)}"


CACHED = 32
"""So many motions a process keeps."""
METRES = {"cm": 0.01, "m": 1.0}
PLAUSIBLE = (0.2, 10.0)
"""Metres: heights of characters that are taken as they are."""


@dataclass
class Motions:
    """Rigs and motions, by file.

    structure, fps, unit, multiple: as the data set's parameters and protocol say.
    """

    structure: str
    fps: float
    unit: str
    multiple: int = 1
    _rigs: dict[tuple[str, str], Rig | BenchError] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.motion = lru_cache(maxsize=CACHED)(self._motion)

    def rig(self, name: str, path: Path, entry: CatalogueEntry) -> Rig:
        """The body in a file; files with the same hierarchy share one object. Raises BenchError."""
        key = (name, entry.hierarchy)
        if key not in self._rigs:
            try:
                self._rigs[key] = self._new_rig(name, path)
            except BenchError as error:
                self._rigs[key] = error
        cached = self._rigs[key]
        if isinstance(cached, BenchError):
            raise cached
        return cached

    def _motion(self, name: str, path: Path, entry: CatalogueEntry) -> Motion:
        """A file's motion on the joints and at the rate of the cases. Raises BenchError."""
        motion = self.rig(name, path, entry).motion(self._recording(path), self.fps)
        if motion.frames % self.multiple:
            motion = motion.at(slice(0, motion.frames // self.multiple * self.multiple))
        return motion

    def _recording(self, path: Path) -> bvh.Recording:
        """Mixamo's files state the root's place in the world."""
        return bvh.read(path, root="absolute", scale=METRES[self.unit])

    def _new_rig(self, name: str, path: Path) -> Rig:
        built = rig(name, self._recording(path).skeleton, self.structure)
        height = built.native.height
        if not PLAUSIBLE[0] < height < PLAUSIBLE[1]:
            other = "m" if height < 1 else "cm"
            cure = f"; give unit={other}" if other != self.unit else ""
            raise BenchError(f"{path}: read in {self.unit}, {name} is {height:.3g} m high{cure}")
        return built


def training_clips(
    motions: Motions, files: Mapping[str, Mapping[str, Path]], entries: Mapping[Path, CatalogueEntry]
) -> Cast:
    """Every character with its readable files, under the structure that most of them have."""
    cast: dict[str, dict[str, NamedClips]] = {}
    for name, paths in files.items():
        structures: dict[str, str] = {}
        for clip, path in paths.items():
            if not entries[path].problem:
                with suppress(BenchError):  # a body that cannot be used
                    structures[clip] = motions.rig(name, path, entries[path]).character.structure
        if structures:
            usual = Counter(structures.values()).most_common(1)[0][0]
            usable = [clip for clip, each in structures.items() if each == usual]

            def read(clip: str, name: str = name, paths: Mapping[str, Path] = paths) -> Motion:
                return motions.motion(name, paths[clip], entries[paths[clip]])

            cast.setdefault(usual, {})[name] = NamedClips(usable, read)
    return cast


# ------------------------------------------------------------------------------------------------ pairs
@dataclass
class _Clip:
    """able: characters that perform it in the same number of frames."""

    clip: str
    able: Sequence[str]
    read: Callable[[str, str], Motion]
    kind: str = ""
    exact: bool = False

    def of(self, name: str) -> Performed:
        return Performed(self.read(name, self.clip))


class Pairs(StoredPairs):
    """Every ordered pair of different characters of every clip, which are nearly copied rotations; contacts
    and touches are not known."""

    def __init__(
        self, lengths: Mapping[str, Mapping[str, int]], read: Callable[[str, str], Motion]
    ) -> None:
        """lengths: clip -> character -> frames. read: the motion of a character and a clip."""
        self._clips = [_Clip(clip, performers(frames), read) for clip, frames in lengths.items()]
        self._clips = [each for each in self._clips if len(each.able) > 1]
        troupe = max((len(each.able) for each in self._clips), default=2)
        super().__init__(len(self._clips), troupe)

    def performance(self, number: int) -> _Clip:
        return self._clips[number]


def performers(frames: Mapping[str, int]) -> tuple[str, ...]:
    """The characters of a clip with the length that most of them have, the longest of equals."""
    counts = Counter(frames.values())
    usual = max(counts, key=lambda length: (counts[length], length), default=0)
    return tuple(name for name, length in frames.items() if length == usual)
