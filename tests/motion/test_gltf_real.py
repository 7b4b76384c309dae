"""The six glTF files of others: sizes, roles and units."""

from __future__ import annotations

import pytest

from retarget_bench.motion import files, importer

OTHERS = {
    "BrainStem": (18, 1309, 37.5, 34159),
    "CesiumMan": (19, 49, 24.0, 3273),
    "Fox": (22, 83, 24.0, 1728),
    "RobotExpressive": (38, 81, 24.0, 7086),
    "Soldier": (49, 60, 30.0, 7434),
    "Xbot": (67, 56, 30.0, 28374),
}


@pytest.mark.parametrize("name", OTHERS)
def test_files_of_others(real_data, name):
    path = real_data / "gltf" / f"{name}.glb"
    recording = files.read(path)
    joints, frames, fps, vertices = OTHERS[name]
    assert (len(recording.skeleton), len(recording.root), recording.fps) == (joints, frames, fps)
    assert len(recording.skin().vertices) == vertices


def test_roles_units_and_legs_of_files_of_others(real_data):
    findings = {name: importer.load(real_data / "gltf" / f"{name}.glb").findings for name in OTHERS}
    assert not findings["Xbot"].missing
    assert not findings["Soldier"].missing
    assert findings["Fox"].quadruped
    assert (findings["Fox"].unit[0], findings["Fox"].unit_prescribed) == ("cm", False)
    assert findings["Xbot"].unit_prescribed
    assert 1.6 < findings["Soldier"].height < 2.0
    assert all(abs(findings[name].floor) < 0.03 for name in ("Xbot", "Soldier", "Fox"))
