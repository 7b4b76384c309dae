"""``bench retarget`` and ``rb.retarget`` with edits: starts, paths, hands and loops."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

import retarget_bench as rb
from retarget_bench.motion import bvh
from tests.motion.editing_bodies import body, fingers, gait


@pytest.fixture
def files(tmp_path, monkeypatch) -> dict[str, Path]:
    """A walk after a T-pose five metres away, a walk that is a loop, and a body with fingers."""
    monkeypatch.chdir(tmp_path)
    character = body()
    walk = gait(character, 40)
    pose, place = character.reference_pose[None], np.array([[5.0, 1.0, 0.0]])
    late = character.motion(
        np.concatenate([pose, walk.rotations]), np.concatenate([place, walk.root]), walk.fps
    )
    full = gait(body(fingers(), size=1.1), 3)
    written = {name: tmp_path / f"{name}.bvh" for name in ("late", "walk", "full")}
    for name, motion in (("late", late), ("walk", walk), ("full", full)):
        bvh.write(written[name], motion)
    return written


def metres(file: Path) -> str:
    return f"{file}[unit=m]"


def test_a_start_is_said_and_kept_cut_or_eased(bench, files):
    arguments = (
        "retarget",
        metres(files["late"]),
        "--target",
        metres(files["full"]),
        "-m",
        "copy_rotations",
    )
    code, out, err = bench(*arguments, "-o", "kept.bvh")
    assert code == 0, err
    pattern = (
        r"late: the first frame is in a T-pose, and joints are 5\.0\d m away a frame later: say start=cut"
    )
    assert re.search(pattern, err), err
    assert "41 frames of late" in out
    for option, frames in (("cut", 40), ("ease", 41)):
        code, out, err = bench(*arguments, "-o", f"{option}.bvh", "--start", option)
        assert code == 0, err
        assert "T-pose" not in err
        assert f"{frames} frames of late" in out
        edited = rb.load_motion(f"{option}.bvh", unit="m")
        assert edited.frames == frames
        assert np.linalg.norm(np.diff(edited.root, axis=0), axis=1).max() < 0.2
    kept, cut = (rb.load_motion(f"{name}.bvh", unit="m") for name in ("kept", "cut"))
    np.testing.assert_allclose(cut.positions, kept.positions[1:], atol=2e-5)


def test_the_doctor_says_it_too(bench, files):
    _, out, _ = bench("doctor", metres(files["late"]))
    assert "In front of the motion the first frame is in a T-pose, and joints are 5." in out
    assert "--start cut, or --start ease" in out
    assert "--start" not in bench("doctor", metres(files["walk"]))[1]


def test_paths_of_results(bench, files):
    arguments = ("retarget", metres(files["walk"]), "--target", metres(files["full"]))
    for option in ("keep", "in-place", "-x"):
        code, _, err = bench(*arguments, "-o", f"{option}.bvh", "--root-motion", option)
        assert code == 0, err
    kept, placed, turned = (rb.load_motion(f"{name}.bvh", unit="m") for name in ("keep", "in-place", "-x"))
    assert np.ptp(placed.root[:, [0, 2]], axis=0).max() < 1e-5
    np.testing.assert_allclose(placed.root[:, 1], kept.root[:, 1], atol=1e-5)
    way = turned.root[-1] - turned.root[0]
    assert way[0] < -0.5
    assert abs(way[2]) < 1e-3
    code, _, err = bench(*arguments, "-o", "out.bvh", "--root-motion", "up")
    assert code == 2
    assert "'up' is not one of" in err
    assert not Path("out.bvh").exists()


def test_hands_are_relaxed_unless_told(bench, files):
    arguments = ("retarget", metres(files["walk"]), "--target", metres(files["full"]))
    _, out, _ = bench(*arguments, "-o", "relaxed.bvh")
    assert "walk shows no fingers: the hands of full are relaxed" in out
    _, out, _ = bench(*arguments, "-o", "open.bvh", "--hands", "open")
    assert "relaxed" not in out
    relaxed, flat = (rb.load_motion(f"{name}.bvh", unit="m") for name in ("relaxed", "open"))
    tip = relaxed.skeleton.index("LeftHandMiddle3")
    assert np.linalg.norm(relaxed.positions[:, tip] - flat.positions[:, tip], axis=-1).min() > 0.02
