"""Two bodies of one kind, people or dogs, that move a little; and as few frames as one."""

import numpy as np

from retarget_bench.api import Case, CaseInfo, DatasetCard
from retarget_bench.api.datasets import usual_splits
from retarget_bench.motion import rotation
from retarget_bench.motion.character import Character
from retarget_bench.motion.skeleton import Skeleton

PERSON = {  # joint: parent, offset in metres
    "Hips": ("", (0, 0.9, 0)),
    "Spine": ("Hips", (0, 0.25, 0)),
    "Neck": ("Spine", (0, 0.3, 0)),
    "Head": ("Neck", (0, 0.12, 0)),
    "LeftArm": ("Spine", (0.18, 0.22, 0)),
    "LeftForeArm": ("LeftArm", (0.28, 0, 0)),
    "LeftHand": ("LeftForeArm", (0.25, 0, 0)),
    "RightArm": ("Spine", (-0.18, 0.22, 0)),
    "RightForeArm": ("RightArm", (-0.28, 0, 0)),
    "RightHand": ("RightForeArm", (-0.25, 0, 0)),
    "LeftUpLeg": ("Hips", (0.1, -0.04, 0)),
    "LeftLeg": ("LeftUpLeg", (0, -0.42, 0)),
    "LeftFoot": ("LeftLeg", (0, -0.4, 0)),
    "LeftToe": ("LeftFoot", (0, -0.04, 0.14)),
    "RightUpLeg": ("Hips", (-0.1, -0.04, 0)),
    "RightLeg": ("RightUpLeg", (0, -0.42, 0)),
    "RightFoot": ("RightLeg", (0, -0.4, 0)),
    "RightToe": ("RightFoot", (0, -0.04, 0.14)),
}
DOG = {
    "Hips": ("", (0, 0.5, 0)),
    "Spine": ("Hips", (0, 0.02, 0.25)),
    "Spine1": ("Spine", (0, 0.02, 0.25)),
    "Neck": ("Spine1", (0, 0.08, 0.08)),
    "Head": ("Neck", (0, 0.12, 0.12)),
    "LeftArm": ("Spine1", (0.08, -0.06, 0)),
    "LeftForeArm": ("LeftArm", (0, -0.2, 0)),
    "LeftHand": ("LeftForeArm", (0, -0.26, 0)),
    "RightArm": ("Spine1", (-0.08, -0.06, 0)),
    "RightForeArm": ("RightArm", (0, -0.2, 0)),
    "RightHand": ("RightForeArm", (0, -0.26, 0)),
    "LeftUpLeg": ("Hips", (0.07, -0.04, 0)),
    "LeftLeg": ("LeftUpLeg", (0, -0.2, 0)),
    "LeftFoot": ("LeftLeg", (0, -0.24, 0)),
    "RightUpLeg": ("Hips", (-0.07, -0.04, 0)),
    "RightLeg": ("RightUpLeg", (0, -0.2, 0)),
    "RightFoot": ("RightLeg", (0, -0.24, 0)),
    "Tail": ("Hips", (0, 0.02, -0.12)),
    "Tail1": ("Tail", (0, 0.02, -0.14)),
}


def body(name: str, joints: dict = PERSON, size: float = 1.0) -> Character:
    names = tuple(joints)
    parents = np.array([names.index(parent) if parent else -1 for parent, _ in joints.values()])
    offsets = np.array([offset for _, offset in joints.values()]) * size
    return Character.of(name, Skeleton(names, parents, offsets), structure="toy")


def moving(character: Character, frames: int, fps: float = 30.0):
    """All joints nod by a few degrees, while the root goes forward."""
    time = np.arange(frames) / fps
    turns = np.zeros((frames, len(character.skeleton), 3))
    turns[..., 0] = 0.25 * np.sin(2 * np.pi * time)[:, None]
    root = character.skeleton.offsets[0] + np.array([0, 0, 1.0]) * time[:, None]
    return character.motion(rotation.from_rotation_vector(turns), root, fps)


class ToyMoves:
    card = DatasetCard(
        name="toy_moves",
        summary="toys",
        version="1",
        licence="CC0",
        obtain="here",
        splits=usual_splits("intra"),
    )
    label = "toy_moves"
    notes = ()

    def __init__(self, frames: int = 12, four_legged: bool = False) -> None:
        self.frames, self.content = frames, f"moves-1-{frames}-{four_legged}"
        joints = DOG if four_legged else PERSON
        self._bodies = {"small": body("small", joints), "tall": body("tall", joints, 1.2)}

    def characters(self):
        return self._bodies

    def cases(self, task, split):
        return [
            CaseInfo(
                f"toy_moves/{a}>{b}/<b>nod</b>", task, split, a, b, "<b>nod</b>", "nodding", self.frames
            )
            for a, b in (("small", "tall"), ("tall", "small"))
        ]

    def load(self, info):
        source, target = (moving(self._bodies[name], self.frames) for name in (info.source, info.target))
        return Case(info, source, target.character, reference=target)


plugin = ToyMoves
