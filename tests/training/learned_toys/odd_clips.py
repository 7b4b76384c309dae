"""Two characters; one has a clip on longer legs, and one in which only its rest pose differs."""

import numpy as np

from retarget_bench.api import DatasetCard
from retarget_bench.motion.character import Character
from retarget_bench.motion.skeleton import Skeleton

NAMES = ("Hips", "Spine", "Head", "LeftUpLeg", "LeftLeg", "LeftFoot", "RightUpLeg", "RightLeg", "RightFoot")
PARENTS = np.array([-1, 0, 1, 0, 3, 4, 0, 6, 7])
LEG = [[0, -0.4, 0], [0, -0.4, 0]]
OFFSETS = np.array([[0, 0.9, 0], [0, 0.3, 0], [0, 0.4, 0], [0.1, -0.05, 0], *LEG, [-0.1, -0.05, 0], *LEG])
LENGTHS = (12, 30, 7)
"""Frames of the clips, at 60 frames per second."""


def body(name: str, shin: float = 1.0, turned: bool = False) -> Character:
    offsets = OFFSETS.copy()
    offsets[[5, 8]] *= shin
    if turned:
        offsets = offsets[:, [2, 1, 0]] * [1, 1, -1]
    return Character.of(name, Skeleton(NAMES, PARENTS, offsets), structure="toy")


class Clips:
    def __init__(self, *bodies: Character) -> None:
        self.bodies = bodies
        self.names = tuple(f"{each.name}-{k}" for k, each in enumerate(bodies))

    def __len__(self):
        return len(self.bodies)

    def __getitem__(self, k):
        frames = LENGTHS[k]
        rotations = np.zeros((frames, len(NAMES), 4))
        rotations[..., 0] = 1.0
        root = np.stack([np.arange(frames), np.full(frames, 100 * k), np.zeros(frames)], axis=1)
        return self.bodies[k].motion(rotations, root / 1000, 60.0)


class OddClips:
    card = DatasetCard("odd_clips", "toys", "1", "CC0", "here")
    label, notes, content = "odd_clips", (), "1"

    def __init__(self, fails: bool = False) -> None:
        self.fails = fails

    def characters(self):
        return {"anna": body("anna")}

    def training(self):
        anna = body("anna")
        cast = {"anna": Clips(anna, body("anna", shin=1.2), body("anna", turned=True))}
        if self.fails:
            return {"toy": {"anna": Clips(anna, anna, anna, anna)}}
        return {"toy": {**cast, "bert": Clips(body("bert", 1.1), body("bert", 1.1))}, "none": {}}

    def cases(self, task, split):
        return ()

    def load(self, info): ...


plugin = OddClips
