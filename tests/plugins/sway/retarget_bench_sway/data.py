"""Two figures, tall and short, that walk on a beam with arms stretched out."""

import numpy as np

from retarget_bench.api import Case, CaseInfo, DatasetCard
from retarget_bench.api.datasets import usual_splits
from retarget_bench.motion import rotation
from retarget_bench.motion.character import Character
from retarget_bench.motion.skeleton import Skeleton

JOINTS = [("Hips", -1, (0, 1, 0)), ("Spine", 0, (0, 0.3, 0)), ("Head", 1, (0, 0.3, 0))]
for _side, _x in (("Left", 1), ("Right", -1)):
    _at = len(JOINTS)
    JOINTS += [
        (f"{_side}Arm", 1, (0.2 * _x, 0.2, 0)),
        (f"{_side}ForeArm", _at, (0.3 * _x, 0, 0)),
        (f"{_side}Hand", _at + 1, (0.3 * _x, 0, 0)),
        (f"{_side}UpLeg", 0, (0.1 * _x, 0, 0)),
        (f"{_side}Leg", _at + 3, (0, -0.5, 0)),
        (f"{_side}Foot", _at + 4, (0, -0.4, 0)),
    ]


class plugin:
    card = DatasetCard(
        name="beam",
        summary="Two figures on a beam",
        version="1",
        licence="CC0-1.0",
        obtain="part of this package",
        splits=usual_splits("intra"),
        parameters={"frames": "length of the clip"},
    )
    content, label, notes = "beam 1", "beam", ()

    def __init__(self, frames=24):
        self.frames = frames
        names, parents, offsets = zip(*JOINTS, strict=True)
        self._characters = {
            name: Character.of(name, Skeleton(names, np.array(parents), size * np.array(offsets)))
            for name, size in (("tall", 1.1), ("short", 0.7))
        }

    def characters(self):
        return self._characters

    def cases(self, task, split):
        if (task, split) != ("retarget", "intra"):
            return []
        pairs = (("tall", "short"), ("short", "tall"))
        return [
            CaseInfo(f"beam/{a}>{b}/walk", task, split, a, b, "walk", frames=self.frames) for a, b in pairs
        ]

    def load(self, info):
        walks = {name: self._walk(body) for name, body in self._characters.items()}
        return Case(info, walks[info.source], self._characters[info.target], walks[info.target])

    def _walk(self, body):
        phase = np.linspace(0, 4 * np.pi, self.frames)
        rotations = np.tile(rotation.identity(), (self.frames, len(body.skeleton), 1))
        for side, sign in (("left", 1), ("right", -1)):
            swing = rotation.about(np.array([1.0, 0, 0]), 0.4 * sign * np.sin(phase))
            rotations[:, body.joint_of[f"{side}_up_leg"]] = swing
        height = body.measures.hip_height
        root = np.stack([0 * phase, height + 0 * phase, 0.1 * height * phase], axis=1)
        return body.motion(rotations, root, 30.0)
