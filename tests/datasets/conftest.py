"""Small rigs in the manner of Mixamo's two structures, and folders of their clips, written on the spot."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
import pytest

from retarget_bench.motion import bvh, rotation
from retarget_bench.motion.character import Character
from retarget_bench.motion.skeleton import EndSite, Skeleton

Rig = tuple[tuple[str, str, tuple[float, float, float]], ...]
"""(joint, parent, offset in centimetres); the parent of the root is ""."""


def _limb(side: str, x: float, toe_ends: bool) -> Rig:
    rows = [
        (f"{side}UpLeg", "HIPS", (9.0 * x, -5.0, 0.0)),
        (f"{side}Leg", f"{side}UpLeg", (0.0, -42.0, 0.0)),
        (f"{side}Foot", f"{side}Leg", (0.0, -40.0, 0.0)),
        (f"{side}ToeBase", f"{side}Foot", (0.0, -8.0, 13.0)),
    ]
    return (*rows, *([(f"{side}Toe_End", f"{side}ToeBase", (0.0, 0.0, 8.0))] if toe_ends else []))


def _arm(side: str, x: float, split: bool) -> Rig:
    last = f"{side}Shoulder_split" if split else f"{side}Shoulder"
    middle = [(last, f"{side}Shoulder", (6.0 * x, 0.0, 0.0))] if split else []
    return (
        (f"{side}Shoulder", "Spine2", (6.0 * x, 10.0, 0.0)),
        *middle,
        (f"{side}Arm", last, (6.0 * x, 0.0, 0.0)),
        (f"{side}ForeArm", f"{side}Arm", (28.0 * x, 0.0, 0.0)),
        (f"{side}Hand", f"{side}ForeArm", (26.0 * x, 0.0, 0.0)),
        (f"{side}HandThumb1", f"{side}Hand", (3.0 * x, 0.0, 3.0)),
    )


def structure_a() -> Rig:
    """A ``Pelvis`` under the hips, no joints at the ends, and a prop."""
    legs = [*_limb("Left", 1.0, False), *_limb("Right", -1.0, False)]
    return (
        ("Hips", "", (0.0, 98.0, 0.0)),
        ("Pelvis", "Hips", (0.0, 0.0, 0.0)),
        *((name, "Pelvis" if parent == "HIPS" else parent, place) for name, parent, place in legs),
        ("Spine", "Hips", (0.0, 10.0, 0.0)),
        ("Spine1", "Spine", (0.0, 12.0, 0.0)),
        ("Spine2", "Spine1", (0.0, 12.0, 0.0)),
        ("Neck", "Spine2", (0.0, 15.0, 0.0)),
        ("Head", "Neck", (0.0, 9.0, 2.0)),
        ("Hat", "Head", (0.0, 15.0, 0.0)),
        *_arm("Left", 1.0, False),
        *_arm("Right", -1.0, False),
    )


def structure_b() -> Rig:
    """One spine joint and both shoulders split, ends as joints."""
    legs = [*_limb("Left", 1.0, True), *_limb("Right", -1.0, True)]
    return (
        ("Hips", "", (0.0, 98.0, 0.0)),
        ("Spine", "Hips", (0.0, 10.0, 0.0)),
        ("Spine1", "Spine", (0.0, 8.0, 0.0)),
        ("Spine1_split", "Spine1", (0.0, 8.0, 0.0)),
        ("Spine2", "Spine1_split", (0.0, 8.0, 0.0)),
        ("Neck", "Spine2", (0.0, 15.0, 0.0)),
        ("Head", "Neck", (0.0, 9.0, 2.0)),
        ("HeadTop_End", "Head", (0.0, 18.0, 0.0)),
        *_arm("Left", 1.0, True),
        *_arm("Right", -1.0, True),
        *((name, "Hips" if parent == "HIPS" else parent, place) for name, parent, place in legs),
    )


def skeleton(rig: Rig, size: float = 1.0) -> Skeleton:
    """The rig in metres, all lengths times ``size``."""
    names = [name for name, _, _ in rig]
    parents = [names.index(parent) if parent else -1 for _, parent, _ in rig]
    offsets = np.array([place for _, _, place in rig]) * size / 100.0
    leaves = sorted(set(range(len(names))) - set(parents))
    ends = tuple(EndSite(joint, (0.0, 0.05 * size, 0.0)) for joint in leaves)
    return Skeleton(tuple(names), np.array(parents), offsets, ends)


def write_clip(path: Path, body: Skeleton, *, frames: int, seed: int, fps: float = 60.0) -> None:
    """A swaying motion of the body, in centimetres; equal seeds give equal rotations by joint name."""
    time = np.arange(frames)[:, None] / 60.0
    rotations = rotation.identity(frames, len(body))
    for joint, name in enumerate(body.names):
        if name == "Pelvis" or name.endswith(("_split", "_End")):
            continue
        chance = np.random.default_rng([seed, *name.encode()])
        axis, speed = chance.normal(size=3), chance.uniform(1.0, 4.0)
        rotations[:, joint] = rotation.from_rotation_vector(0.3 * np.sin(speed * time) * axis / 3.0)
    height = float(body.offsets[0, 1])
    root = np.array([0.0, height, 0.0]) + height * np.hstack([0.2 * time, 0.02 * np.sin(3.0 * time), time])
    path.parent.mkdir(parents=True, exist_ok=True)
    bvh.write(path, Character.of("mini", body).motion(rotations, root, fps), scale=100.0)


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A cache of this test's own."""
    folder = tmp_path / "cache"
    monkeypatch.setenv("RETARGET_BENCH_CACHE", str(folder))
    return folder


@pytest.fixture
def mini(tmp_path: Path, cache: Path) -> Callable[..., Path]:
    """Writes a folder ``Character/clip.bvh`` and gives it: ``mini({"Aj": ["Walk"]}, frames=20)``."""
    bodies = {
        "Aj": skeleton(structure_a()),
        "BigVegas": skeleton(structure_a(), 1.2),
        "Mousey_m": skeleton(structure_b(), 0.5),
        "Goblin_m": skeleton(structure_b(), 1.1),
        "Mremireh_m": skeleton(structure_b(), 0.9),
        "Vampire_m": skeleton(structure_b(), 1.05),
    }

    def write(clips: Mapping[str, list[str]], frames: int = 20, folder: str = "mini") -> Path:
        assert cache
        for character, names in clips.items():
            for name in names:
                seed = sum(name.encode())
                place = tmp_path / folder / character / f"{name}.bvh"
                write_clip(place, bodies[character], frames=frames, seed=seed)
        return tmp_path / folder

    return write


def plain_rig() -> Rig:
    """An ordinary Mixamo rig: neither split nor with a ``Pelvis``, ends as joints."""
    skip = {"Spine1_split", "LeftShoulder_split", "RightShoulder_split"}
    above = {
        "Spine1_split": "Spine1",
        "LeftShoulder_split": "LeftShoulder",
        "RightShoulder_split": "RightShoulder",
    }
    return tuple((n, above.get(p, p), place) for n, p, place in structure_b() if n not in skip)


class Rigs:
    """Single clips."""

    @staticmethod
    def a(path: Path, rename: Mapping[str, str] | None = None) -> None:
        """A clip of structure A, with joints renamed."""
        new = rename or {}
        rig = tuple(
            (new.get(name, name), new.get(above, above), place) for name, above, place in structure_a()
        )
        write_clip(path, skeleton(rig), frames=20, seed=sum(path.stem.encode()))

    @staticmethod
    def plain(path: Path, size: float = 1.0, frames: int = 20) -> None:
        write_clip(path, skeleton(plain_rig(), size), frames=frames, seed=sum(path.stem.encode()))


@pytest.fixture
def rigs(cache: Path) -> Rigs:
    assert cache
    return Rigs()
