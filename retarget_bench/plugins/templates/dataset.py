"""One line that says what the data are; bench list shows it."""

from collections.abc import Mapping, Sequence
from functools import cached_property
from itertools import product

import numpy as np

from retarget_bench.api import Case, CaseInfo, Dataset, DatasetCard
from retarget_bench.api.datasets import usual_split, usual_splits
from retarget_bench.motion import rotation
from retarget_bench.motion.character import Character
from retarget_bench.motion.motion import Motion
from retarget_bench.motion.skeleton import Skeleton

SIZES = {"small": 0.8, "large": 1.25}
CLIPS = {"bow": 0.6, "deep bow": 1.0}
BONES = (
    # joint, parent, offset from the parent in metres (Y up, left is +X)
    ("Hips", -1, (0, 1, 0)),
    ("Spine", 0, (0, 0.2, 0)),
    ("Neck", 1, (0, 0.3, 0)),
    ("Head", 2, (0, 0.1, 0)),
    *(
        bone
        for side, x, first in (("Left", 1, 4), ("Right", -1, 10))
        for bone in (
            (f"{side}Arm", 1, (0.2 * x, 0.25, 0)),
            (f"{side}ForeArm", first, (0.28 * x, 0, 0)),
            (f"{side}Hand", first + 1, (0.25 * x, 0, 0)),
            (f"{side}UpLeg", 0, (0.1 * x, 0, 0)),
            (f"{side}Leg", first + 3, (0, -0.5, 0)),
            (f"{side}Foot", first + 4, (0, -0.45, 0)),
        )
    ),
)


class MyDataset(Dataset):
    """Two figures of one structure, and two bows that both perform.

    Where the motions are files, read them with ``retarget_bench.motion.importer.load`` in ``load``: a data
    set must be quick to build, and is asked for one case at a time.
    """

    card = DatasetCard(
        name="my_dataset",
        summary="Two figures that bow",
        version="1",
        licence="CC0-1.0",
        obtain="made by this file",
        splits=usual_splits("self", "intra"),
        parameters={"frames": "length of every clip, at 30 frames per second"},
    )
    notes: Sequence[str] = ()

    def __init__(self, frames: int = 60) -> None:
        self.frames = frames

    @property
    def content(self) -> str:
        """Identifies the data in result keys: a hash of files; of generated data version and parameters."""
        return f"version {self.card.version}, {self.frames} frames"

    @property
    def label(self) -> str:
        """The name of the data set in tables."""
        return "my_dataset"

    def characters(self) -> Mapping[str, Character]:
        """Every body by name."""
        return self._characters

    def cases(self, task: str, split: str) -> Sequence[CaseInfo]:
        """A fixed list in a fixed order; nothing is loaded here."""
        if task != "retarget":
            return []
        pairs = [(a, b) for a, b in product(SIZES, SIZES) if split == usual_split(a == b, alike=True)]
        return [
            CaseInfo(f"my_dataset/{a}>{b}/{clip}", task, split, a, b, clip, frames=self.frames)
            for clip in CLIPS
            for a, b in pairs
        ]

    def load(self, info: CaseInfo) -> Case:
        """The source's motion, the target's body and, where it is known, the right answer."""
        source, target = self._characters[info.source], self._characters[info.target]
        return Case(
            info=info,
            source=self._bow(source, CLIPS[info.clip]),
            target=target,
            reference=self._bow(target, CLIPS[info.clip]),
        )

    @cached_property
    def _characters(self) -> dict[str, Character]:
        names, parents, offsets = zip(*BONES, strict=True)
        return {
            name: Character.of(name, Skeleton(names, np.array(parents), size * np.array(offsets)))
            for name, size in SIZES.items()
        }

    def _bow(self, body: Character, depth: float) -> Motion:
        """Bend the spine forward and rise again, standing still; ``depth`` in radians."""
        angle = depth * np.sin(np.linspace(0.0, np.pi, self.frames))
        rotations = np.tile(rotation.identity(), (self.frames, len(body.skeleton), 1))
        rotations[:, body.joint_of["spine_1"]] = rotation.about(np.array([1.0, 0.0, 0.0]), angle)
        root = np.tile([0.0, body.measures.hip_height, 0.0], (self.frames, 1))
        return body.motion(rotations, root, fps=30.0)


plugin = MyDataset
