"""Bodies of many kinds and motions of theirs, for the tests of the fit."""

from __future__ import annotations

import numpy as np
from alignment_rigs import reframed, t_pose

from retarget_bench.motion import rotation
from retarget_bench.motion.character import Character
from retarget_bench.motion.motion import Motion
from retarget_bench.motion.skeleton import Skeleton
from retarget_bench.plugins import registry


def along_x() -> Character:
    """A body written as LAFAN's are: every bone along +X of its joint where there is one bone."""
    plain = t_pose()
    frames = rotation.identity(len(plain))
    for joint, below in enumerate(plain.children):
        if len(below) == 1:
            frames[joint] = rotation.between(np.array([1.0, 0.0, 0.0]), plain.offsets[below[0]])
    written = reframed(plain, frames)
    return Character.of("along_x", written, sample=rotation.conjugate(frames)[None])


def puppets() -> dict[str, Character]:
    """One body of each of the puppets' structures, a dog among them."""
    cast = registry.create("datasets", "puppets[size=tiny]").characters()
    return {body.structure: body for body in reversed(list(cast.values()))}


def random_tree(seed: int, joints: int) -> Character:
    """A tree in which some bones have no length, some lie in line, and some joints coincide."""
    draw = np.random.default_rng(seed)
    parents = [-1, *(int(draw.integers(max(0, joint - 4), joint)) for joint in range(1, joints))]
    offsets = 0.2 * draw.normal(size=(joints, 3))
    offsets[draw.random(joints) < 0.2] = 0.0
    in_line = draw.random(joints) < 0.3
    offsets[in_line] = offsets[in_line, :1] * np.array([1.0, 0.0, 0.0])
    names = tuple(f"joint {k}" for k in range(joints))
    return Character.of("tree", Skeleton(names, np.array(parents), offsets))


def wiggle(body: Character, frames: int, seed: int = 0, size: float = 0.5) -> Motion:
    """Every joint turns smoothly about an axis of its own from the reference pose; the body travels."""
    draw, joints = np.random.default_rng(seed), len(body.skeleton)
    t = np.arange(frames)[:, None, None] / 30.0
    vectors = size * draw.normal(size=(1, joints, 3)) * np.sin(2 * t + draw.uniform(0, 6, (1, joints, 1)))
    local = rotation.multiply(body.reference_pose[None], rotation.from_rotation_vector(vectors))
    return body.motion(local, np.array([0.3, 1.0, 0.5]) + t[:, 0] * draw.normal(size=3), 30.0)


def noisy(motion: Motion, metres: float, seed: int = 0) -> np.ndarray:
    """``(frames, joints, 3)`` its positions, every coordinate off by so much."""
    return motion.positions + metres * np.random.default_rng(seed).normal(size=motion.positions.shape)
