"""Real files of many origins: rates, how root places are meant, and other libraries."""

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
OWN_RATES = {"Dog_example": 30, "pfnn_hierarchy": 30}


@pytest.fixture(scope="module")
def files(real_data: Path) -> list[Path]:
    """All files of the folders named above, of each Mixamo character's 53 clips every sixth."""
    paths = sorted(path for folder in RATES for path in (real_data / folder).rglob("*.bvh"))
    few = [path for path in paths if path.parent.parent.name != "mixamo_san"]
    return few + [path for path in paths if path.parent.parent.name == "mixamo_san"][::6]


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
