"""Real files of many origins, against a plain loop and against other libraries."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from retarget_bench.motion import bvh, kinematics, rotation

RATES = {
    "mixamo_san": 60,
    "mixamo_r2et": 60,
    "lafan1": 30,
    "dog": 60,
    "same_pairs": 30,
    "cmu_iclone": 60,
    "cmu_bvh": 120,
    "bandai_namco": 30,
    "makehuman": 24,
}
RELATIVE = {"Lafan1_example", "walk1", "002_04", "002_05", "002_09", "005_03", "005_08"}
CARRIERS = {"joint_Root", "RL_BoneRoot"}
OWN_RATES = {"Dog_example": 30, "pfnn_hierarchy": 30}


@pytest.fixture(scope="module")
def files(real_data: Path) -> list[Path]:
    """All files of the folders named above, of each Mixamo character's 53 clips every sixth."""
    paths = sorted(path for folder in RATES for path in (real_data / folder).rglob("*.bvh"))
    few = [path for path in paths if path.parent.parent.name != "mixamo_san"]
    return few + [path for path in paths if path.parent.parent.name == "mixamo_san"][::6]


def plain_places(path: Path, frames: list[int]) -> tuple[dict[str, np.ndarray], int]:
    """Joint places ``(frames, 3)`` by name, and the number of frames: one line at a time, 3 x 3 matrices.

    Position channels are taken as places in the parent's frame.
    """
    head, numbers = path.read_bytes().decode("utf-8").split("MOTION", 1)
    rows = [line.split() for line in numbers.splitlines() if line.strip()][2:]
    places: dict[str, np.ndarray] = {}
    for shown, frame in enumerate(frames):
        values = iter(map(float, rows[frame]))
        stack: list[tuple[np.ndarray, np.ndarray]] = []
        name, offset = "", np.zeros(3)
        for line in head.splitlines():
            words = line.split()
            if not words:
                continue
            if words[0] in ("ROOT", "JOINT", "End"):
                name = " ".join(words[1:]) if words[0] != "End" else ""
            elif words[0] == "OFFSET":
                offset = np.array(list(map(float, words[1:])))
                if not name:
                    stack.append((np.zeros(3), np.eye(3)))
            elif words[0] == "CHANNELS":
                step, turn = offset.copy(), np.eye(3)
                for channel in words[2:]:
                    axis = "XYZ".index(channel[0])
                    if channel.endswith("position"):
                        step[axis] = next(values)
                    else:
                        turn = turn @ about(axis, next(values))
                at, to = stack[-1] if stack else (np.zeros(3), np.eye(3))
                stack.append((at + to @ step, to @ turn))
                places.setdefault(name, np.zeros((len(frames), 3)))[shown] = stack[-1][0]
            elif words[0] == "}":
                stack.pop()
    return places, len(rows)


def about(axis: int, degrees: float) -> np.ndarray:
    cos, sin = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    matrix = np.eye(3)
    a, b = (axis + 1) % 3, (axis + 2) % 3
    matrix[a, a] = matrix[b, b] = cos
    matrix[a, b], matrix[b, a] = -sin, sin
    return matrix


def test_places_agree_with_a_plain_loop(files: list[Path]) -> None:
    for path in files:
        if "poses" in path.parts:
            continue  # their position channels below the root are relative, which the loop does not know
        recording = bvh.read(path, root="absolute")
        frames = sorted({0, len(recording.root) // 2, len(recording.root) - 1})
        expected, count = plain_places(path, frames)
        assert len(recording.root) == count, path
        places, _ = kinematics.forward(
            recording.skeleton, recording.rotations[frames], recording.root[frames]
        )
        expected_positions = np.stack([expected[name] for name in recording.skeleton.names], axis=1)
        size = np.ptp(expected_positions, axis=1).max()
        # constant position channels may differ from OFFSET in the last printed digits
        np.testing.assert_allclose(
            places, expected_positions, atol=3e-5 if "bandai" in str(path) else 1e-10 * size + 1e-9
        )
        assert set(expected) - set(recording.skeleton.names) <= CARRIERS, path


def test_rates(files: list[Path], real_data: Path) -> None:
    for path in files:
        expected = RATES[path.relative_to(real_data).parts[0]]
        assert bvh.parse_header(path).fps == OWN_RATES.get(path.stem, expected), path


def test_how_root_places_are_meant(files: list[Path]) -> None:
    for path in files:
        readings = [note for note in bvh.read(path).notes if "root places read as" in note]
        expected = "relative" if path.stem in RELATIVE else "absolute"
        assert all(f"read as {expected}" in note for note in readings), path
        assert readings or path.stem not in RELATIVE, path


def test_agreement_with_pymotion(real_data: Path) -> None:
    pymotion = pytest.importorskip("pymotion.io.bvh")
    for name in ("lafan1/push1_subject2", "dog/D1_003_KAN01_001", "cmu_bvh/131_02", "cmu_bvh/01_01"):
        path = real_data / f"{name}.bvh"
        other = pymotion.BVH()
        other.load(str(path))
        rotations, places, *_ = other.get_data()
        recording = bvh.read(path)
        assert rotation.angle(recording.rotations, np.asarray(rotations, dtype=float)).max() < 1e-5
        np.testing.assert_allclose(recording.root, places[:, 0], atol=1e-3)


@pytest.mark.filterwarnings("ignore:Rest pose suggests")
def test_agreement_with_pybvh(real_data: Path) -> None:
    pybvh = pytest.importorskip("pybvh")
    for name in (
        "mixamo_san/Kaya/Box Turn",
        "dog/D1_003_KAN01_001",
        "cmu_bvh/131_02",
        "lafan1/push1_subject2",
    ):
        path = real_data / f"{name}.bvh"
        other = pybvh.read_bvh_file(path)
        recording = bvh.read(path, root="absolute")
        assert list(recording.skeleton.names) == other.joint_names
        places, _ = kinematics.forward(recording.skeleton, recording.rotations[:50], recording.root[:50])
        np.testing.assert_allclose(places, other.joint_positions()[:50], atol=1e-6)
