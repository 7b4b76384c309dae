"""ik on recorded motion: feet that slide less than copied ones, on two legs and on four."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from retarget_bench.api import Context
from retarget_bench.methods.copy_rotations import plugin as CopyRotations
from retarget_bench.methods.ik import plugin as InverseKinematics
from retarget_bench.motion import contact, importer
from retarget_bench.motion.character import Character
from retarget_bench.motion.motion import Motion
from retarget_bench.motion.skeleton import Skeleton

PAWS = ("left_foot", "right_foot", "left_hand", "right_hand")
FEET = ("left_foot", "left_toe", "right_foot", "right_toe")


def load(path: Path, frames: int) -> Motion:
    motion = importer.load(path).motion
    return motion.resample(30.0).at(slice(0, frames))


def slide(result: Motion, source: Motion, roles: tuple[str, ...]) -> float:
    """Body heights per second that contact joints glide over the floor while the source's are planted."""
    source_feet, result_feet = (
        each.positions[:, each.character.joints(roles)] for each in (source, result)
    )
    planted = contact.planted(source_feet, source.character.height, source.fps)[1:]
    steps = np.linalg.norm(np.diff(result_feet[..., [0, 2]], axis=0), axis=-1)
    return float((steps * planted).sum() / planted.sum() * source.fps / result.character.height)


def both(source: Motion, target: Character) -> tuple[Motion, Motion]:
    methods = (CopyRotations(), InverseKinematics())
    copied, held = (each.retarget(source, target, context=Context()) for each in methods)
    return copied, held


@pytest.mark.parametrize("clip", ["dance1_subject1", "push1_subject2", "obstacles3_subject4"])
def test_a_person_on_another_rig(real_data: Path, clip: str):
    source = load(real_data / "lafan1" / f"{clip}.bvh", 600)
    target = load(real_data / "mixamo_r2et" / "Ortiz" / "Salsa Dancing.bvh", 2).character
    copied, held = both(source, target)
    assert slide(held, source, FEET) < 0.35 * slide(copied, source, FEET)
    low = held.positions[:, target.joints(FEET), 1].min(axis=1)
    assert np.quantile(low, 0.05) > -0.02 * target.height


def test_a_dog_with_shorter_legs(real_data: Path):
    source = load(real_data / "dog" / "D1_047_KAN01_001.bvh", 400)
    target = shorter(source.character)
    copied, held = both(source, target)
    assert slide(held, source, PAWS) < 0.5 * slide(copied, source, PAWS)


def shorter(body: Character) -> Character:
    """The same body with legs of 70 and fore legs of 75 per cent, and a longer back."""
    offsets = np.array(body.skeleton.offsets)
    for joint, role in enumerate(body.roles):
        for part, share in (("leg", 0.7), ("foot", 0.7), ("forearm", 0.75), ("hand", 0.75), ("spine", 1.2)):
            if role is not None and role.split("_", 1)[-1].startswith(part):
                offsets[joint] *= share
    skeleton = Skeleton(body.skeleton.names, body.skeleton.parents, offsets, body.skeleton.end_sites)
    return Character.of("short", skeleton, roles=body.roles)
