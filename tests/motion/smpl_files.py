"""Small AMASS archives and body models of random numbers, and SMPL's forward pass as loops."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from retarget_bench.motion import rotation
from retarget_bench.motion.character import Character
from retarget_bench.motion.files.smpl import skeletons
from retarget_bench.motion.files.smpl.skeletons import BODY, SMPL, SMPLH, SMPLX, Family

TYPES = {SMPL: "smpl", SMPLH: "smplh", SMPLX: "smplx"}


def parameters(random: np.random.Generator, family: Family = SMPLH, frames: int = 12) -> dict:
    """A person that stands and moves its joints by up to a radian or so, Z up as in AMASS."""
    poses = 0.25 * random.normal(size=(frames, len(family), 3))
    poses[:, 0] = [np.pi / 2, 0.0, 0.0]  # the body's own axes are Y up
    poses[:, 0] += 0.1 * random.normal(size=(frames, 3))
    return {
        "poses": poses.reshape(frames, -1),
        "trans": [1.0, 2.0, 0.95] + 0.2 * random.normal(size=(frames, 3)),
        "betas": random.normal(size=16),
        "gender": np.array("female"),
        "mocap_framerate": np.array(120.0),
        "dmpls": np.zeros((frames, 8)),
        "labels": np.array(["a", None], dtype=object),  # some releases have pickled arrays beside
    }


def danced(character: Character, frames: int = 200) -> np.ndarray:
    """``(frames, joints, 3)`` metres, Y up, of a body that walks off, turns about and bends its limbs."""
    random = np.random.default_rng(8)
    t = np.arange(frames)[:, None, None] / 20
    shape = (1, len(character.skeleton), 3)
    turns = 0.3 * np.sin(t * random.uniform(1, 2, shape) + random.uniform(0, 6, shape))
    turns[:, 0] = 0.1 * turns[:, 0] + [0.0, 1.0, 0.0] * t[:, 0]
    for joint, name in enumerate(character.skeleton.names):
        if "elbow" in name or "knee" in name:
            axis = [1.0, 0.0, 0.0] if "knee" in name else [0.0, -1.0 if "left" in name else 1.0, 0.0]
            turns[:, joint] = (0.8 + turns[:, joint, :1]) * axis
    root = np.concatenate([0.3 * t[:, 0], 0.85 + 0 * t[:, 0], np.sin(t[:, 0])], axis=1)
    return np.array(character.motion(rotation.from_rotation_vector(turns), root, 20.0).positions)


def archive(path: Path, content: dict) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("wb") as file:
        np.savez(file, **content)
    return path


def model(random: np.random.Generator, family: Family = SMPLH, vertices: int = 90, betas: int = 10) -> dict:
    """A body model with valid arrays: vertices about the joints of the average skeleton."""
    places = skeletons.average(family).rest_positions + np.array([0.01, -0.2, 0.03])
    owner = np.arange(vertices) % len(family)
    template = places[owner] + 0.03 * random.normal(size=(vertices, 3))
    regressor = np.zeros((len(family), vertices))
    for joint in range(len(family)):
        own_vertices = np.flatnonzero(owner == joint)
        regressor[joint, own_vertices] = random.dirichlet(np.ones(len(own_vertices)))
    weights = np.zeros((vertices, len(family)))
    weights[np.arange(vertices), owner] = 0.7
    weights[np.arange(vertices), np.maximum(np.array(family.parents)[owner], 0)] += 0.3
    tree = np.array([family.parents, range(len(family))], dtype=np.int64)
    tree[0, 0] = 2**32 - 1
    return {
        "v_template": template,
        "shapedirs": 0.01 * random.normal(size=(vertices, 3, betas)),
        "posedirs": random.normal(size=(vertices, 3, 9)),
        "J_regressor": regressor,
        "weights": weights,
        "f": random.integers(0, vertices, (40, 3)).astype(np.uint32),
        "kintree_table": tree.astype(np.uint32),
        "part2num": np.array({"head": 1}, dtype=object),
    }


def matrix(turn: np.ndarray) -> np.ndarray:
    """Rodrigues' formula."""
    angle = np.linalg.norm(turn)
    if angle < 1e-12:
        return np.eye(3)
    x, y, z = turn / angle
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross


def forward(body: dict, family: Family, content: dict) -> tuple[np.ndarray, np.ndarray]:
    """Joints ``(frames, joints, 3)`` and vertices ``(frames, V, 3)`` by 4 x 4 matrices, without pose blend
    shapes, as the paper's equations have them."""
    template, directions = body["v_template"], body["shapedirs"]
    betas = content["betas"][: directions.shape[2]]
    shaped = np.array(template)
    for number, beta in enumerate(betas):
        shaped = shaped + beta * directions[:, :, number]
    rest = body["J_regressor"] @ shaped
    poses = content["poses"].reshape(len(content["poses"]), -1, 3)
    joints, vertices = [], []
    for frame, pose in enumerate(poses):
        world = []
        for joint, parent in enumerate(family.parents):
            local = np.eye(4)
            local[:3, :3] = matrix(pose[joint])
            local[:3, 3] = rest[joint] - (rest[parent] if parent >= 0 else 0.0)
            world.append(local if parent < 0 else world[parent] @ local)
        moved = np.zeros_like(shaped)
        for joint, transform in enumerate(world):
            away = shaped - rest[joint]
            moved += body["weights"][:, joint, None] * (away @ transform[:3, :3].T + transform[:3, 3])
        joints.append([transform[:3, 3] + content["trans"][frame] for transform in world])
        vertices.append(moved + content["trans"][frame])
    return np.array(joints), np.array(vertices)


def turned(quaternion: np.ndarray, vector: np.ndarray) -> np.ndarray:
    """A vector turned by a quaternion, w first, by the sandwich product."""
    w, axis = quaternion[0], quaternion[1:]
    return vector + 2 * w * np.cross(axis, vector) + 2 * np.cross(axis, np.cross(axis, vector))


def features(positions: np.ndarray, headings: np.ndarray) -> np.ndarray:
    """Features ``(frames - 1, 263)`` of positions ``(frames, 22, 3)``, with the body facing ``headings``
    ``(frames,)`` radians from +Z towards +X; numbers that are not decoded are noise."""
    count = len(positions) - 1
    values = np.random.default_rng(0).normal(size=(count, 263))
    for frame in range(count):
        facing = [np.array([np.cos(h / 2), 0, -np.sin(h / 2), 0]) for h in headings[frame : frame + 2]]
        values[frame, 0] = np.arcsin(np.sin((headings[frame + 1] - headings[frame]) / -2))
        step = positions[frame + 1, 0] - positions[frame, 0]
        step = turned(facing[1], step)
        values[frame, 1:3] = step[[0, 2]]
        values[frame, 3] = positions[frame, 0, 1]
        for joint in range(1, len(BODY)):
            away = positions[frame, joint] - positions[frame, 0] * [1, 0, 1]
            values[frame, 4 + 3 * (joint - 1) : 7 + 3 * (joint - 1)] = turned(facing[0], away)
    return values
