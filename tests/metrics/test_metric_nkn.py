"""The 22-joint protocols against the papers' own procedure: extract velocities, integrate them back."""

from __future__ import annotations

import numpy as np
import pytest
from metric_cases import BODY, HUMAN, Sides, character, compute, index, motion, sides
from scipy.ndimage import gaussian_filter1d
from scipy.spatial.transform import Rotation

UP = np.array([0.0, 1.0, 0.0])
L_LEG, R_LEG, L_SHOULDER, R_SHOULDER = (
    BODY.index(name) for name in ("LeftUpLeg", "RightUpLeg", "LeftShoulder", "RightShoulder")
)


def represent(world: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Local positions (frames, 22, 3) in the facing frame, and per frame velocity and turn (frames, 4)."""
    world = np.concatenate([world, world[-1:]])
    across = world[:, L_LEG] - world[:, R_LEG] + world[:, L_SHOULDER] - world[:, R_SHOULDER]
    across /= np.linalg.norm(across, axis=1)[:, None]
    forward = gaussian_filter1d(np.cross(across, UP), 20, axis=0, mode="nearest")
    yaw = [np.arctan2(x, z) for x, _, z in forward]
    local, globals_ = [], []
    for t in range(len(world) - 1):
        hips = world[t, 0]
        facing = Rotation.from_rotvec(-yaw[t] * UP)
        moved = world[t] - [hips[0], hips[1] - world[0, 0, 1], hips[2]]
        local.append(facing.apply(moved))
        velocity = Rotation.from_rotvec(-yaw[t + 1] * UP).apply(world[t + 1, 0] - hips)
        globals_.append([*velocity, yaw[t + 1] - yaw[t]])
    return np.array(local), np.array(globals_)


def integrate(local: np.ndarray, globals_: np.ndarray) -> np.ndarray:
    """Back to the world, from zero translation and zero turn."""
    turn, place, out = Rotation.identity(), np.zeros(3), []
    for pose, (*velocity, yaw) in zip(local, globals_, strict=True):
        out.append(turn.apply(pose) + place)
        turn = Rotation.from_rotvec(yaw * UP) * turn
        place = place + turn.apply(velocity)
    return np.array(out)


def windows(frames: int) -> list[int]:
    starts = [120 * k for k in range(frames // 120)]
    return starts + ([frames - 120] if frames % 120 else [])


def loop(case: Sides) -> tuple[float, float]:
    """Both windowed values in centimetres, step by step as the papers' code does it."""
    body = case.predicted.character
    joints = index(body, BODY)
    source = 100 * case.source.positions[:, index(case.source.character, BODY)]
    predicted, expected = (100 * side.positions[:, joints] for side in (case.predicted, case.expected))
    expected = expected + UP * (source[0, :, 1].min() - expected[0, :, 1].min())
    bones = 100 * np.linalg.norm(body.skeleton.offsets, axis=1)
    head = ("Spine", "Spine1", "Spine2", "Neck", "Head", "LeftLeg", "LeftFoot", "LeftToeBase")
    height = bones[index(body, head)].sum()
    (own, moves), (true, true_moves) = represent(predicted), represent(expected)
    world, local = [], []
    for start in windows(len(predicted)):
        w = slice(start, start + 120)
        world.append(
            ((integrate(own[w], moves[w]) - integrate(true[w], true_moves[w])) ** 2).sum(-1) / height
        )
        local.append(((own[w] - true[w]) ** 2).sum(-1) / height)
    return float(np.mean(world)), float(np.mean(local))


@pytest.mark.parametrize("frames", [121, 240, 275])
def test_windows_against_integration(frames: int) -> None:
    case = sides(frames, frames)
    world, local = loop(case)
    values = compute("nkn", case)
    assert values["nkn_mse_h"] == pytest.approx(world, rel=1e-9)
    assert values["nkn_mse_local"] == pytest.approx(local, rel=1e-9)


def test_star_is_an_unsquared_distance() -> None:
    case = sides(7, 3)
    body = case.predicted.character
    bones = np.linalg.norm(body.skeleton.offsets, axis=1)
    head = ("Spine", "Spine1", "Spine2", "Neck", "Head", "LeftLeg", "LeftFoot", "LeftToeBase")
    total = 0.0
    for p, g in zip(case.predicted.positions, case.expected.positions, strict=True):
        total += sum(float(np.linalg.norm(p[j] - g[j])) for j in index(body, BODY))
    assert compute("nkn", case)["star"] == pytest.approx(
        total / 7 / 22 / bones[index(body, head)].sum(), rel=1e-9
    )


def test_short_clips_have_no_windows() -> None:
    assert set(compute("nkn", sides(120, 0))) == {"star"}


def test_bodies_without_the_22_joints_have_no_value() -> None:
    rig = tuple(
        (name, "Spine" if parent == "Spine1" else parent, offset)
        for name, parent, offset in HUMAN
        if name != "Spine1"
    )
    body = character("Two spines", rig=rig)
    case = Sides(*(motion(body, 130, seed) for seed in range(3)))
    assert compute("nkn", case) == {}
    assert "mpjpe_h.world" in compute("position", case)
