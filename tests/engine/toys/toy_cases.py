"""Six cases over two tiny bodies, made from sines; references are the source shifted by a known step."""

import numpy as np

from retarget_bench.api import Case, CaseInfo, Dataset, DatasetCard
from retarget_bench.api.datasets import usual_splits
from retarget_bench.motion.character import Character
from retarget_bench.motion.skeleton import Skeleton

SHIFT = 0.01
FRAMES = 12
NAMES = ("Hips", "Spine", "Head", "LeftUpLeg", "LeftLeg", "LeftFoot", "RightUpLeg", "RightLeg", "RightFoot")
PARENTS = (-1, 0, 1, 0, 3, 4, 0, 6, 7)
OFFSETS = np.array(
    [
        [0, 0.9, 0],
        [0, 0.3, 0],
        [0, 0.4, 0],
        [0.1, -0.05, 0],
        [0, -0.4, 0],
        [0, -0.4, 0],
        [-0.1, -0.05, 0],
        [0, -0.4, 0],
        [0, -0.4, 0],
    ]
)


def body(name: str, size: float) -> Character:
    return Character.of(name, Skeleton(NAMES, np.array(PARENTS), OFFSETS * size), structure="toy")


class ToyCases(Dataset):
    """Parameters: ``clips``, how many; ``broken``, a clip that cannot be loaded."""

    card = DatasetCard(
        name="toy_cases",
        summary="toys",
        version="1",
        licence="CC0",
        obtain="here",
        splits=usual_splits("intra", "cross"),
    )
    label = "toy_cases"
    notes = ()

    def __init__(self, clips: int = 3) -> None:
        self.clips = clips
        self.content = f"toy-1-{clips}"
        self._bodies = {"small": body("small", 1.0), "tall": body("tall", 1.5)}

    def characters(self):
        return self._bodies

    def cases(self, task, split):
        return [
            CaseInfo(f"toy/{a}>{b}/clip {n}", task, split, a, b, f"clip {n}", "wiggle", FRAMES)
            for a, b in (("small", "tall"), ("tall", "small"))
            for n in range(self.clips)
        ]

    def load(self, info):
        number = int(info.clip.split()[1])
        time = np.arange(FRAMES) / 30
        angle = 0.3 * np.sin(2 * np.pi * time * (1 + number) / 2)
        rotations = np.zeros((FRAMES, len(NAMES), 4))
        rotations[..., 0] = np.cos(angle / 2)[:, None]
        rotations[..., 1] = np.sin(angle / 2)[:, None]
        root = np.stack([0 * time, 0.9 + 0 * time, time], axis=1)
        source, target = self._bodies[info.source], self._bodies[info.target]
        return Case(
            info,
            source.motion(rotations, root, 30.0),
            target,
            reference=target.motion(rotations, root + np.array([SHIFT, 0, 0]), 30.0),
        )


plugin = ToyCases
