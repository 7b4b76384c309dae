"""The same clips by several characters, to train on: as Mixamo made them, nearly copied rotations."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from retarget_bench.api import Performed
from retarget_bench.motion.motion import Motion
from retarget_bench.training.stored_pairs import StoredPairs


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
    """Every ordered pair of different characters of every clip; contacts and touches are not known."""

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
