"""Small files from public bug reports: how they are written, and what they hold."""

from __future__ import annotations

import numpy as np
import pytest

from retarget_bench.commands.run import read_suite
from retarget_bench.datasets.folder import Folder
from retarget_bench.errors import FileError
from retarget_bench.motion.files.reading import Reading
from retarget_bench.motion.importer import load


def same_motion(one, other):
    """Whether two imported files hold one motion of one body."""
    assert one.motion.skeleton.same_as(other.motion.skeleton)
    assert one.motion.fps == other.motion.fps
    np.testing.assert_allclose(one.motion.rotations, other.motion.rotations, atol=1e-6)
    np.testing.assert_allclose(one.motion.root, other.motion.root, atol=1e-6)


@pytest.mark.parametrize(
    "name", ["01_comma", "10_comment", "11_wrapped", "11b_one_line", "28_trailing_blank_frames"]
)
def test_dress_of_numbers(real_data, name):
    base = load(real_data / "cases/07_mirrored_left_handed/00_base.bvh")
    same_motion(load(real_data / f"cases/19_number_dress/{name}.bvh"), base)


def test_no_frame_time(real_data):
    base = load(real_data / "cases/07_mirrored_left_handed/00_base.bvh", Reading(rate=30.0))
    path = real_data / "cases/18_frame_time_zero_with_rate/06_ft0.bvh"
    same_motion(load(path, Reading(rate=30.0)), base)


@pytest.mark.parametrize(
    ("name", "words"),
    [
        *((f"lfs.{ending}", "is a Git LFS pointer: run") for ending in ("amc", "fbx", "glb", "npz")),
        *((f"page.{ending}", "is a web page: ") for ending in ("fbx", "glb")),
    ],
)
def test_pointers_and_pages(real_data, name, words):
    with pytest.raises(FileError, match=words):
        load(real_data / "cases/17_pointer_or_page_not_fbx_glb" / name)


@pytest.mark.parametrize(
    ("name", "fps"), [("06_fps_key", 60.0), ("15b_rotmat", 60.0), ("17_smpl_keys", 30.0)]
)
def test_dialects_of_smpl(real_data, name, fps):
    imported = load(real_data / f"cases/22_smpl_dialects/{name}.npz")
    assert (imported.motion.frames, imported.motion.fps) == (50, fps)
    assert imported.findings.missing == ()
    doubts = [each for each in imported.findings.doubts if "average skeleton" not in each]
    assert [*doubts] == [each for each in doubts if fps == 30.0 and "states no mocap_framerate" in each]


def test_names_of_two_forms_are_one_clip(real_data):
    data = Folder(str(real_data / "cases/15_nfc_nfd"))
    assert {info.clip for info in data.cases("retarget", "intra")} == {"café"}
    assert all(data.load(info).reference is not None for info in data.cases("retarget", "intra"))


def test_files_that_cannot_be_read(real_data):
    data = Folder(str(real_data / "cases/20_unreadable_files_untold"))
    assert data.unreadable.sentence.startswith("2 of 4 files cannot be read: ")
    assert set(data.unreadable.problems) == {"A/cut.bvh", "A/empty.bvh"}


def test_marks_of_byte_order(real_data):
    folder = real_data / "cases/16_toml_with_bom"
    for name in ("roles16", "roles_bom"):
        assert Reading(roles=folder / f"{name}.toml").overrides == {"Hips": "hips"}
    assert read_suite(folder / "s.toml") == {"methods": ["ik"]}


@pytest.mark.parametrize("name", ["01_noskin", "02_noskin_arms_only"])
def test_bodies_without_skin(real_data, name):
    imported = load(real_data / f"cases/05_noskin_glb_part_animated/{name}.glb")
    assert len(imported.motion.skeleton) == 21
    assert imported.findings.missing == ()
    assert imported.findings.warnings == ()
