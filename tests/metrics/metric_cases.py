"""Small bodies and random cases for metric tests, built without any file."""

from __future__ import annotations

import importlib
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from retarget_bench.api import Case, CaseInfo, Contacts, Ground, Metric, Prediction, Touch
from retarget_bench.api.comparison import Comparison
from retarget_bench.evaluation.pairs import of_case
from retarget_bench.motion import kinematics, rotation
from retarget_bench.motion.character import Character
from retarget_bench.motion.contact import CONTACT_ROLES, planted
from retarget_bench.motion.motion import Motion
from retarget_bench.motion.skeleton import Skeleton

METRICS = (
    *("contact_speed", "ground", "growth", "joint_speed", "nkn", "pan_contact", "papers"),
    *("contact", "path_fitted", "position", "procrustes", "rotation", "slide", "smoothness", "touch"),
)
SET_METRICS = ("fid_structure", "fid")
"""Of sets of cases, tested in ``test_fid_*.py``."""
GROUP_METRICS = ("sif",)
"""Of groups of clips, tested in ``test_metric_sif.py``."""
TASK_METRICS = ("restoration",)
"""Of derived tasks, tested in ``tests/tasks``."""
MESH_METRICS = ("mesh_contact", "self_penetration", "vertex_error")
"""Of bodies with meshes, tested with ``mesh_cases.py``."""

Rig = tuple[tuple[str, str, tuple[float, float, float]], ...]
"""(joint, parent, offset in centimetres); the parent of the root is ""."""


def _limbs(side: str, x: float) -> Rig:
    return (
        (f"{side}UpLeg", "Hips", (9.0 * x, -5.0, 0.0)),
        (f"{side}Leg", f"{side}UpLeg", (0.0, -42.0, 0.0)),
        (f"{side}Foot", f"{side}Leg", (0.0, -40.0, 0.0)),
        (f"{side}ToeBase", f"{side}Foot", (0.0, -8.0, 13.0)),
        (f"{side}Toe_End", f"{side}ToeBase", (0.0, 0.0, 8.0)),
        (f"{side}Shoulder", "Spine2", (6.0 * x, 10.0, 0.0)),
        (f"{side}Arm", f"{side}Shoulder", (12.0 * x, 0.0, 0.0)),
        (f"{side}ForeArm", f"{side}Arm", (27.0 * x, 0.0, 0.0)),
        (f"{side}Hand", f"{side}ForeArm", (26.0 * x, 0.0, 0.0)),
        (f"{side}HandThumb1", f"{side}Hand", (4.0 * x, 0.0, 3.0)),
    )


HUMAN: Rig = (
    ("Hips", "", (0.0, 97.0, 0.0)),
    ("Spine", "Hips", (0.0, 10.0, 0.0)),
    ("Spine1", "Spine", (0.0, 12.0, -1.0)),
    ("Spine2", "Spine1", (0.0, 13.0, 0.0)),
    ("Neck", "Spine2", (0.0, 15.0, 1.0)),
    ("Head", "Neck", (0.0, 9.0, 2.0)),
    ("HeadTop_End", "Head", (0.0, 18.0, 0.0)),
    ("Hat", "Head", (0.0, 20.0, 0.0)),
    *_limbs("Left", 1.0),
    *_limbs("Right", -1.0),
)
"""The 22-joint body of the papers, with tips, thumbs and a hat."""


THUMBLESS: Rig = tuple(row for row in HUMAN if "Thumb" not in row[0] and row[0] != "Hat")
"""Neither thumbs nor a hat."""

BODY = (
    *("Hips", "Spine", "Spine1", "Spine2", "Neck", "Head"),
    *(
        "LeftUpLeg",
        "LeftLeg",
        "LeftFoot",
        "LeftToeBase",
        "RightUpLeg",
        "RightLeg",
        "RightFoot",
        "RightToeBase",
    ),
    *("LeftShoulder", "LeftArm", "LeftForeArm", "LeftHand"),
    *("RightShoulder", "RightArm", "RightForeArm", "RightHand"),
)
"""The 22 joints, in the papers' order."""
FEET = ("LeftFoot", "LeftToeBase", "RightFoot", "RightToeBase")
TIPS = ("HeadTop_End", "LeftToe_End", "RightToe_End")
SCORED = (*BODY, *TIPS)
"""What is scored when the source has neither thumbs nor a hat."""


def metric(name: str) -> Metric:
    """A built-in metric; for one of pairs, a case is all clips of its pair."""
    return of_case(importlib.import_module(f"retarget_bench.metrics.{name}").plugin())


def compute(name: str, sides: Sides) -> Mapping[str, float | Mapping[str, float]]:
    """What one metric says of a case."""
    return metric(name).compute(sides.comparison())


def everything(sides: Sides) -> dict[str, float | Mapping[str, float]]:
    """What all metrics say of a case."""
    comparison = sides.comparison()
    return {id_: value for name in METRICS for id_, value in metric(name).compute(comparison).items()}


def index(body: Character, names: tuple[str, ...]) -> list[int]:
    """Joints by name."""
    return [body.skeleton.names.index(name) for name in names]


def moved(side: Prediction, turn: np.ndarray, shift: np.ndarray) -> Prediction:
    """A motion turned about the world's origin, then shifted; turn (4,), shift (3,), or one per frame."""
    if isinstance(side, Motion):
        turns = side.rotations.copy()
        turns[:, 0] = rotation.multiply(np.broadcast_to(turn, turns[:, 0].shape), turns[:, 0])
        root = rotation.rotate(np.broadcast_to(turn, turns[:, 0].shape), side.root) + shift
        return side.character.motion(turns, root, side.fps)
    turn = np.broadcast_to(turn, (side.frames, 4))[:, None]
    shift = np.broadcast_to(shift, (side.frames, 3))[:, None]
    return side.character.positions(rotation.rotate(turn, side.positions) + shift, side.fps)


def character(
    name: str = "Human", *, rig: Rig = HUMAN, scale: float = 0.01, seed: int | None = None
) -> Character:
    """A character of a rig; with a seed its bones are up to 20 % shorter or longer."""
    rng = np.random.default_rng(seed)
    names = [joint for joint, _, _ in rig]
    offsets = np.array([offset for _, _, offset in rig]) * scale
    if seed is not None:
        offsets = offsets * rng.uniform(0.8, 1.2, size=(len(rig), 1))
    parents = np.array([names.index(parent) if parent else -1 for _, parent, _ in rig])
    return Character.of(name, Skeleton(tuple(names), parents, offsets))


def smooth(rng: np.random.Generator, time: np.ndarray, *shape: int) -> np.ndarray:
    """``(times, *shape)`` random sums of waves."""
    out = np.zeros((len(time), *shape))
    for _ in range(3):
        phase = rng.uniform(0.0, 6.0, size=shape)
        out += rng.normal(size=shape) * np.sin(
            np.multiply.outer(time * rng.uniform(0.02, 0.5), np.ones(shape)) + phase
        )
    return out


def motion(body: Character, frames: int, seed: int, *, fps: float = 30.0, size: float = 0.3) -> Prediction:
    """A random motion by rotations that stands still, creeps and hurries in turn."""
    rng = np.random.default_rng(seed)
    time = np.cumsum(rng.choice([0.0, 0.01, 0.03, 0.1, 1.0], size=frames))
    turns = size * smooth(rng, time, len(body.skeleton), 4)
    turns[..., 0] += 2.0
    root = body.height * (0.1 * smooth(rng, time, 3) + [0.0, 0.5, 0.0])
    return body.motion(turns / np.linalg.norm(turns, axis=-1, keepdims=True), root, fps)


@dataclass
class Sides:
    """What a case is made of, to be changed and put together again."""

    source: Prediction
    predicted: Prediction
    expected: Prediction | None
    contacts: Contacts | None = None
    ground: Ground = field(default_factory=Ground)
    touches: tuple[Touch, ...] | None = None

    def comparison(self) -> Comparison:
        target = self.predicted.character
        info = CaseInfo("toy/A>B/clip", "retarget", "intra", "A", "B", "clip")
        case = Case(
            *(info, self.source, target, self.expected, self.contacts, self.ground), touches=self.touches
        )
        return Comparison(case, self.predicted)

    def by_positions(self) -> Sides:
        """The same, known by positions only."""

        def bare(side: Prediction) -> Prediction:
            return side.character.positions(side.positions, side.fps)

        return replace(
            self,
            source=bare(self.source),
            predicted=bare(self.predicted),
            expected=None if self.expected is None else bare(self.expected),
        )


def sides(frames: int = 40, seed: int = 0, *, fps: float = 30.0, scale: float = 0.01) -> Sides:
    """A random source without thumbs, and a prediction and a reference of another body."""
    source = character("A", rig=THUMBLESS, seed=seed, scale=scale)
    target = character("B", seed=seed + 1, scale=scale)
    expected = motion(target, frames, seed + 2, fps=fps)
    return Sides(
        motion(source, frames, seed + 2, fps=fps), motion(target, frames, seed + 3, fps=fps), expected
    )


def labelled(case: Sides, seed: int = 0) -> Sides:
    """The case with true labels: contacts as the reference's speed tells them, random pivots, and two
    touches: of a wrist half a per cent of the height beside itself, as its forearm carries it, and of a
    hand far from the other thigh."""
    body, rng = case.predicted.character, np.random.default_rng(seed)
    assert case.expected is not None
    feet = body.joints(CONTACT_ROLES)
    rests = planted(case.expected.positions[:, feet], body.height, case.expected.fps)
    pivots = ~rests & (rng.random(rests.shape) < 0.3)
    frames = rng.random((2, case.predicted.frames)) < 0.6
    frames[:, 0] = True
    still = np.zeros((1, 3))
    stand = kinematics.forward(body.skeleton, body.reference_pose[None], still)[0][0]
    forearm, hand = body.joints(("left_forearm", "left_hand"))
    beside = stand[hand] - stand[forearm] + 0.005 * body.height * np.array([0.0, 0.6, 0.8])
    touches = (
        Touch("left_hand", np.zeros(3), "left_forearm", beside, frames[0]),
        Touch("left_hand", 0.05 * body.height * np.ones(3), "right_up_leg", np.zeros(3), frames[1]),
    )
    return replace(case, contacts=Contacts(CONTACT_ROLES, rests, pivots), touches=touches)
