"""Two toy people who swing their limbs, one clip to be tested and two to train on."""

import numpy as np

from retarget_bench.api import Case, CaseInfo, DatasetCard
from retarget_bench.api.datasets import usual_splits
from retarget_bench.motion import rotation
from retarget_bench.motion.character import Character
from retarget_bench.motion.skeleton import Skeleton

TREE = {
    "Hips": (None, (0.0, 0.95, 0.0)),
    "Spine": ("Hips", (0.0, 0.25, 0.0)),
    "Neck": ("Spine", (0.0, 0.25, 0.0)),
    "Head": ("Neck", (0.0, 0.15, 0.0)),
    "LeftArm": ("Spine", (0.18, 0.2, 0.0)),
    "LeftForeArm": ("LeftArm", (0.28, 0.0, 0.0)),
    "LeftHand": ("LeftForeArm", (0.25, 0.0, 0.0)),
    "LeftHandIndex1": ("LeftHand", (0.08, 0.0, 0.0)),
    "RightArm": ("Spine", (-0.18, 0.2, 0.0)),
    "RightForeArm": ("RightArm", (-0.28, 0.0, 0.0)),
    "RightHand": ("RightForeArm", (-0.25, 0.0, 0.0)),
    "LeftUpLeg": ("Hips", (0.1, -0.05, 0.0)),
    "LeftLeg": ("LeftUpLeg", (0.0, -0.42, 0.0)),
    "LeftFoot": ("LeftLeg", (0.0, -0.4, 0.0)),
    "RightUpLeg": ("Hips", (-0.1, -0.05, 0.0)),
    "RightLeg": ("RightUpLeg", (0.0, -0.42, 0.0)),
    "RightFoot": ("RightLeg", (0.0, -0.4, 0.0)),
}
FRAMES = 40


def body(name: str, size: float) -> Character:
    names = tuple(TREE)
    parents = np.array([-1 if parent is None else names.index(parent) for parent, _ in TREE.values()])
    offsets = size * np.array([offset for _, offset in TREE.values()])
    return Character.of(name, Skeleton(names, parents, offsets), structure="toy17")


def swing(character: Character, number: int, frames: int = FRAMES):
    """Every limb swings about its own axis at a speed of its own; the body turns and walks on."""
    time = np.arange(frames) / 30
    joints = len(character.skeleton)
    phase = np.arange(joints) * 1.3 + number
    angle = 0.4 * np.sin(2 * np.pi * 0.8 * time[:, None] + phase)
    angle[:, 0] = 0.5 * number + 0.3 * time
    axes = np.tile([1.0, 0.0, 0.0], (joints, 1))
    axes[0] = [0.0, 1.0, 0.0]
    rotations = rotation.about(np.broadcast_to(axes, (frames, joints, 3)), angle)
    root = np.stack([0.1 * number + 0 * time, 0.95 + 0 * time, 0.5 * time], axis=1)
    return character.motion(rotations, root, 30.0)


class Clips:
    def __init__(self, character, numbers):
        self.character, self.numbers = character, numbers

    names = property(lambda self: [f"clip {n}" for n in self.numbers])

    def __len__(self):
        return len(self.numbers)

    def __getitem__(self, index):
        return swing(self.character, self.numbers[index])


class ToyPeople:
    card = DatasetCard(
        name="toy_people",
        summary="toys",
        version="1",
        licence="CC0",
        obtain="here",
        splits=usual_splits("self", "intra"),
    )
    notes = ()

    def __init__(self, clips: int = 2, train: bool = True) -> None:
        self.clips, self.train = clips, train
        self.content = f"people-1-{clips}-{train}"
        self.label = "toy_people" if train else "toy_people, nothing to train on"
        self._bodies = {"ann": body("ann", 1.0), "bob": body("bob", 1.1)}

    def characters(self):
        return self._bodies

    def cases(self, task, split):
        assert task == "retarget", "a data set hears of no other task"
        return [
            CaseInfo(f"people/{a}>{b}/clip {n}", task, split, a, b, f"clip {n}", "swing", FRAMES)
            for a in self._bodies
            for b in self._bodies
            if (a == b) == (split == "self")
            for n in range(self.clips)
        ]

    def load(self, info):
        number = int(info.clip.split()[1])
        source, target = (self._bodies[name] for name in (info.source, info.target))
        return Case(info, swing(source, number), target, reference=swing(target, number))

    def training(self):
        if not self.train:
            return {}
        return {"toy17": {name: Clips(each, (7, 8)) for name, each in self._bodies.items()}}


plugin = ToyPeople
