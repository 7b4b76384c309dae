"""Two small bodies that walk along sines: motion to train on, and held-out cases to validate with.

kind: ``all``; ``unwatched``, without validation; ``empty``, without motion; ``few``, with half as many
cases; ``near``, without cross cases; ``apart``, with cross cases that have no reference.
content: a name for it.
"""

import numpy as np

from retarget_bench.api import Case, CaseInfo, Dataset, DatasetCard
from retarget_bench.api.datasets import usual_splits
from retarget_bench.motion.character import Character
from retarget_bench.motion.skeleton import Skeleton

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
SIZES = {"small": 1.0, "tall": 1.3, "held": 1.1}


class Clips:
    def __init__(self, body: Character, count: int) -> None:
        self._body = body
        self.names = tuple(f"walk-{body.name}-{number}" for number in range(count))

    def __len__(self) -> int:
        return len(self.names)

    def __getitem__(self, number: int):
        return walk(self._body, number, 40)


def walk(body: Character, number: int, frames: int):
    time = np.arange(frames) / 30
    angle = 0.3 * np.sin(2 * np.pi * time * (1 + 0.3 * number))
    rotations = np.zeros((frames, len(NAMES), 4))
    rotations[..., 0], rotations[..., 1] = np.cos(angle / 2)[:, None], np.sin(angle / 2)[:, None]
    root = np.stack([0.2 * np.sin(time + number), 0.9 + 0 * time, time], axis=1)
    return body.motion(rotations, root, 30.0)


class ToyWalks(Dataset):
    card = DatasetCard(
        name="toy_walks",
        summary="toys",
        version="1",
        licence="CC0",
        obtain="here",
        splits=usual_splits("intra", "cross"),
    )
    label = "toy_walks"
    notes = ()

    def __init__(self, kind: str = "all", content: str = "one", root: str = "") -> None:
        self.kind, self.content = kind, content
        if kind in ("few", "near"):
            self.label = f"toy_walks {kind}"
        self._bodies = {
            name: Character.of(name, Skeleton(NAMES, np.array(PARENTS), OFFSETS * size), structure="toy")
            for name, size in SIZES.items()
        }

    def characters(self):
        return self._bodies

    def training(self):
        if self.kind == "empty":
            return {}
        return {"toy": {name: Clips(self._bodies[name], 3) for name in ("small", "tall")}}

    def validation(self):
        return None if self.kind == "unwatched" else self

    def cases(self, task, split):
        pairs = (("held", "tall"), ("small", "held")) if split == "intra" else (("tall", "held"),)
        if split == "cross" and self.kind == "near":
            return []
        return [
            CaseInfo(f"toys/{a}>{b}/clip {n}", task, split, a, b, f"clip {n}", ("walk", "run")[n % 2], 20)
            for a, b in pairs
            for n in range(2 if self.kind == "few" else 4)
        ]

    def load(self, info):
        number = int(info.clip.split()[1])
        source, target = (self._bodies[name] for name in (info.source, info.target))
        has_reference = info.split != "cross" or self.kind != "apart"
        return Case(
            info, walk(source, number, 20), target, walk(target, number, 20) if has_reference else None
        )


plugin = ToyWalks
