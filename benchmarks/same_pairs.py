"""The sample pairs of SAME as a data set: motions, and their answers by an animator's tool, both ways.

root: a folder with ``pair.txt``, whose lines end in the paths of a source and of its answer. The first
frame of every file is its rest pose at the origin, from which the motion begins metres away; it is no part
of the motion and is left out, as SAME's own code does.
"""

import hashlib
from functools import cached_property
from pathlib import Path

from retarget_bench.api import Case, CaseInfo, DatasetCard
from retarget_bench.api.datasets import usual_splits
from retarget_bench.motion.character import Character, Motion
from retarget_bench.motion.importer import load

FOLDER = "sample/motion/bvh/"
"""What paths in ``pair.txt`` begin with."""


class SamePairs:
    """A case for each pair and direction, from the one body to the other."""

    card = DatasetCard(
        name="same_pairs",
        summary="SAME's sample pairs, retargeted by MotionBuilder",
        version="1",
        licence="CC BY-NC 4.0",
        obtain="sample/ of SAME's repository",
        splits=usual_splits("cross"),
        locations=("root",),
    )
    label = "SAME's pairs"
    notes = ()

    def __init__(self, root: str = ".") -> None:
        self.root = Path(root)

    @cached_property
    def _files(self) -> dict[str, Path]:
        """Body -> its one file."""
        files = {}
        for number, line in enumerate((self.root / "pair.txt").read_text().splitlines()):
            *_, source, answer = (part.strip().removeprefix(FOLDER) for part in line.split(","))
            files |= {f"source-{number}": self.root / source, f"answer-{number}": self.root / answer}
        return files

    @cached_property
    def content(self) -> str:
        """A hash of all files."""
        return hashlib.sha256(b"".join(path.read_bytes() for path in self._files.values())).hexdigest()[:16]

    @cached_property
    def _motions(self) -> dict[str, Motion]:
        """Body -> its motion without the rest pose."""
        motions = {name: load(path).motion for name, path in self._files.items()}
        return {name: motion.at(slice(1, None)) for name, motion in motions.items()}

    def characters(self) -> dict[str, Character]:
        return {name: motion.character for name, motion in self._motions.items()}

    def cases(self, task: str, split: str) -> list[CaseInfo]:
        sources = [name for name in self._files if name.startswith("source")] if split == "cross" else []
        pairs = [(name, name.replace("source", "answer")) for name in sources]
        return [
            CaseInfo(f"same_pairs/{a}>{b}/{clip}", task, split, a, b, clip, "", self._motions[a].frames)
            for pair in pairs
            for a, b in (pair, pair[::-1])
            for clip in [a.partition("-")[2]]
        ]

    def load(self, info: CaseInfo) -> Case:
        source, answer = self._motions[info.source], self._motions[info.target]
        return Case(info, source, answer.character, reference=answer)


plugin = SamePairs
