"""Greatest angular speeds of joints against plain loops and known hinges, and planted snaps."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from metric_cases import BODY, HUMAN, THUMBLESS, Sides, character, compute, index, moved, sides
from scipy.spatial.transform import Rotation

from retarget_bench.api import Prediction
from retarget_bench.api.comparison import Comparison
from retarget_bench.datasets.puppets import plugin as Puppets
from retarget_bench.evaluation.predict import context_for
from retarget_bench.methods.copy_rotations import plugin as CopyRotations
from retarget_bench.metrics.joint_speed import plugin as JointSpeed
from retarget_bench.motion.character import Character
from retarget_bench.motion.motion import Motion
from retarget_bench.motion.roles import chain
from retarget_bench.motion.skeleton import Skeleton

SPEED, ACCELERATION = "joint_speed_excess", "joint_acceleration_excess"
SLOW, SUDDEN = 60.0, 1800.0
"""Degrees per second and per squared second."""


def turns(side: Prediction, joint: int) -> list[np.ndarray]:
    """Degrees per second between frames, from the file's own local rotations."""
    local = Rotation.from_quat(side.rotations[:, joint], scalar_first=True)
    return [
        np.degrees((local[t].inv() * local[t + 1]).as_rotvec()) * side.fps for t in range(side.frames - 1)
    ]


def by_hand(case: Sides) -> dict[str, float | dict[str, float]]:
    """All values by loops over the 22 joints, whose parents are the same on both bodies."""
    values: dict[str, float | dict[str, float]] = {}
    for id_, least in ((SPEED, SLOW), (ACCELERATION, SUDDEN)):
        by_joint, far, broken = {}, set(), False
        for name in BODY:
            if "Toe" in name:
                continue
            sizes = []
            for side in (case.predicted, case.source, case.expected):
                vectors = turns(side, index(side.character, (name,))[0])
                if id_ == ACCELERATION:
                    vectors = [(b - a) * side.fps for a, b in pairwise(vectors)]
                sizes.append([float(np.linalg.norm(v)) for v in vectors])
            limit = max(least, *sizes[1])
            if max(sizes[2]) > 1.5 * limit:
                broken = True
                continue
            by_joint[name] = max(1.0, max(sizes[0]) / limit)
            far |= {t for t, size in enumerate(sizes[0]) if size > 1.5 * limit}
        worst = max(by_joint.values())
        values[id_], values[f"{id_}.clips"] = worst, 100.0 if worst > 1.5 else 0.0
        values[f"{id_}.reference"] = 100.0 * broken
        values[f"{id_}.frames"], values[f"{id_}.joint"] = 100.0 * len(far) / len(sizes[0]), by_joint
    return values


@pytest.mark.parametrize(("seed", "fps"), [(0, 30.0), (1, 60.0), (2, 24.0)])
def test_against_loops(seed: int, fps: float) -> None:
    case = sides(20, seed, fps=fps)
    values, expected = compute("joint_speed", case), by_hand(case)
    assert values[SPEED] > 1.5, "the random case must not be trivial"
    assert values[f"{SPEED}.reference"] == 100.0
    assert 2 < len(values[f"{SPEED}.joint"]) < len(BODY) - 2, "the reference breaks some joints and not all"
    assert values.keys() == expected.keys()
    for id_, number in expected.items():
        assert values[id_] == pytest.approx(number, rel=1e-9), id_


def knee(degrees: np.ndarray, fps: float = 30.0, body: Character | None = None) -> Motion:
    """A body that stands still but for its left knee, which has these angles."""
    body = body or character("Human")
    turns = np.zeros((len(degrees), len(body.skeleton), 4))
    turns[..., 0] = 1.0
    half = np.radians(degrees) / 2
    turns[:, index(body, ("LeftLeg",))[0], :2] = np.stack([np.cos(half), np.sin(half)], axis=1)
    return body.motion(turns, np.zeros((len(degrees), 3)), fps)


def knees(own: np.ndarray, source: np.ndarray, fps: float = 30.0) -> Sides:
    return Sides(knee(source, fps, character("A", rig=THUMBLESS)), knee(own, fps), None)


@pytest.mark.parametrize("fps", [30.0, 60.0])
def test_a_hinge_at_constant_speed(fps: float) -> None:
    """Degrees per second of both: the ratio, from 60 on; constant speed is no acceleration."""
    time = np.arange(20) / fps
    for own, source, excess in (
        (300.0, 100.0, 3.0),
        (100.0, 300.0, 1.0),
        (150.0, 0.0, 2.5),
        (60.0, 0.0, 1.0),
    ):
        values = compute("joint_speed", knees(own * time, source * time, fps))
        assert values[SPEED] == pytest.approx(excess)
        assert values[f"{SPEED}.joint"]["LeftLeg"] == pytest.approx(excess)
        assert values[f"{SPEED}.joint"]["RightLeg"] == 1.0
        assert (values[f"{SPEED}.clips"], values[f"{SPEED}.frames"]) == (
            (100.0,) * 2 if excess > 1.5 else (0, 0)
        )
        assert values[ACCELERATION] == 1.0


def other_rest_pose(side: Motion, seed: int) -> Motion:
    """The same motion of the same body in a file whose joints' frames lie any way."""
    body, rng = side.character, np.random.default_rng(seed)
    frames = Rotation.from_rotvec(rng.normal(size=(len(body.skeleton), 3)))
    offsets, rotations = body.skeleton.offsets.copy(), side.rotations.copy()
    for joint, parent in enumerate(body.skeleton.parents):
        if parent >= 0:
            offsets[joint] = frames[parent].inv().apply(offsets[joint])
        local = Rotation.from_quat(rotations[:, joint], scalar_first=True) * frames[joint]
        local = frames[parent].inv() * local if parent >= 0 else local
        rotations[:, joint] = local.as_quat(scalar_first=True)
    skeleton = Skeleton(body.skeleton.names, body.skeleton.parents, offsets)
    pose = body.reference_pose  # the metric must not need it
    same = replace(body, skeleton=skeleton, reference_pose=pose)
    return same.motion(rotations, side.root, side.fps)


def test_rest_poses_signs_and_where_the_body_is_do_not_matter() -> None:
    case = sides(20, 3)
    before = compute("joint_speed", case)
    rng = np.random.default_rng(0)
    again = other_rest_pose(case.predicted, 1)
    assert np.allclose(again.positions, case.predicted.positions)
    signs = rng.choice([-1.0, 1.0], size=again.rotations.shape[:2])[..., None]
    again = again.character.motion(signs * again.rotations, again.root, again.fps)
    turn = Rotation.from_rotvec([0.3, 2.0, -1.0]).as_quat(scalar_first=True)
    again = moved(again, turn, np.array([1.0, 2.0, 3.0]))
    after = compute("joint_speed", replace(case, source=other_rest_pose(case.source, 2), predicted=again))
    for id_, number in before.items():
        assert after[id_] == pytest.approx(number, rel=1e-9), id_


def test_positions_and_short_clips() -> None:
    case = sides(5, 5)
    for side in ("source", "predicted"):
        assert compute("joint_speed", replace(case, **{side: getattr(case.by_positions(), side)})) == {}
    assert compute("joint_speed", sides(1, 5)) == {}
    assert {id_.partition(".")[0] for id_ in compute("joint_speed", sides(2, 5))} == {SPEED}


SPINE = ("Spine", "Spine1", "Spine2", "Spine3", "Spine4")


def bow(body: Character, names: tuple[str, ...], per_frame: float) -> Motion:
    """The spine bends by so many degrees a frame, shared out equally."""
    still = knee(np.zeros(11), body=body)
    rotations = still.rotations.copy()
    half = np.radians(per_frame * np.arange(11)) / 2 / len(names)
    for joint in index(body, names):
        rotations[:, joint, :2] = np.stack([np.cos(half), np.sin(half)], axis=1)
    return body.motion(rotations, still.root, 30.0)


def test_a_chain_of_another_number_of_joints_turns_as_a_whole() -> None:
    longer = [(name, parent, (0.0, 7.0, 0.0)) for parent, name in pairwise(SPINE)]
    rest = [(n, SPINE[-1] if p == "Spine2" else p, o) for n, p, o in HUMAN if n not in SPINE[1:]]
    five, three = character("Five", rig=(*rest[:2], *longer, *rest[2:])), character("Three")
    assert (len(chain(five.roles, "spine")), len(chain(three.roles, "spine"))) == (5, 3)
    long, short = bow(five, SPINE, 10.0), bow(three, SPINE[:3], 10.0)
    values = compute("joint_speed", Sides(long, short, None))
    assert values[SPEED] == pytest.approx(1.0)
    assert {"Spine", "Spine1"}.isdisjoint(values[f"{SPEED}.joint"])
    twice = compute("joint_speed", Sides(short, bow(five, SPINE, 20.0), None))
    assert twice[SPEED] == twice[f"{SPEED}.joint"]["Spine4"] == pytest.approx(2.0)
    assert twice[f"{SPEED}.joint"]["LeftArm"] == 1.0


def test_copied_rotations_never_exceed_the_source() -> None:
    """Of all puppets: four legs, spines of different counts, missing shoulders and toes."""
    data, method = Puppets(), CopyRotations()
    four_legged = 0
    for split in ("self", "intra", "cross"):
        for info in data.cases("retarget", split)[::6]:
            case = data.load(info)
            four_legged += case.target.four_legged
            copied = method.retarget(case.source, case.target, context=context_for(method, data, case, 0))
            values = JointSpeed().compute(Comparison(case, copied))
            assert values[SPEED] == pytest.approx(1.0), info.id
            assert values[ACCELERATION] == pytest.approx(1.0), info.id
    assert four_legged
