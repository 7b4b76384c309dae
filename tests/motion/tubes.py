"""People made of closed tubes, one around every bone, whose flesh is where a test puts it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from retarget_bench.motion import rotation
from retarget_bench.motion.character import Character
from retarget_bench.motion.mesh import Mesh
from retarget_bench.motion.motion import Motion
from tests.viewing.viewing_toys.toy_moves import body


def lathe(
    bottom: np.ndarray, top: np.ndarray, radius: float, rings: int = 6, around: int = 8
) -> tuple[np.ndarray, np.ndarray]:
    """A closed tube of ``rings`` rings and two poles."""
    way = (top - bottom) / np.linalg.norm(top - bottom)
    side = np.cross(way, [0.3, 0.5, 0.8])
    side /= np.linalg.norm(side)
    turn = 2 * np.pi * np.arange(around) / around
    circle = np.cos(turn)[:, None] * side + np.sin(turn)[:, None] * np.cross(way, side)
    vertices = [
        bottom + share * (top - bottom) + radius * circle for share in np.linspace(0.04, 0.96, rings)
    ]
    vertices = np.concatenate([*vertices, [bottom, top]])

    def at(ring: int, k: int) -> int:
        return ring * around + k % around

    faces = [
        face
        for ring in range(rings - 1)
        for k in range(around)
        for face in (
            (at(ring, k), at(ring, k + 1), at(ring + 1, k + 1)),
            (at(ring, k), at(ring + 1, k + 1), at(ring + 1, k)),
        )
    ]
    last = rings * around
    faces += [(at(0, k + 1), at(0, k), last) for k in range(around)]
    faces += [(at(rings - 1, k), at(rings - 1, k + 1), last + 1) for k in range(around)]
    return vertices, np.array(faces)


def fleshed(radius: float = 0.05) -> Character:
    """A person of one tube around every bone, each of which follows the bone's upper joint."""
    bare = body("tubes")
    places, vertices, faces, follows = bare.skeleton.rest_positions, [], [], []
    for joint, parent in enumerate(bare.skeleton.parents.tolist()):
        if parent < 0 or np.linalg.norm(places[joint] - places[parent]) < 0.02:
            continue
        thick = radius * (2.2 if (bare.roles[parent] or "").startswith(("hips", "spine")) else 1.0)
        tube, of = lathe(places[parent], places[joint], thick)
        faces.append(of + sum(map(len, vertices)))
        vertices.append(tube)
        follows += [parent] * len(tube)
    weights = np.eye(len(bare.skeleton))[follows]
    mesh = Mesh(np.concatenate(vertices), np.concatenate(faces), weights)
    return replace(bare, skin=lambda: mesh)


def hand_to_belly(person: Character, frames: int = 7) -> Motion:
    """Both forearms go into the trunk and out again."""
    turns = np.zeros((frames, len(person.skeleton), 3))
    share = np.sin(np.linspace(0, np.pi, frames))
    turns[:, person.joint_of["left_arm"], 2] = -1.35
    turns[:, person.joint_of["right_arm"], 2] = 1.35
    turns[:, person.joint_of["left_forearm"], 2] = -1.9 * share
    turns[:, person.joint_of["right_forearm"], 2] = 1.9 * share
    root = np.repeat(person.skeleton.offsets[:1], frames, axis=0)
    return person.motion(rotation.from_rotation_vector(turns), root, 30.0)
