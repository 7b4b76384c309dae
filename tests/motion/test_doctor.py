"""What the doctor says, and that what it proposes works."""

from __future__ import annotations

import re

import numpy as np
import pytest
from alignment_rigs import BONES, performance, t_pose
from editing_bodies import body, jump

from retarget_bench.commands import doctor
from retarget_bench.errors import NotSupported
from retarget_bench.motion import bvh
from retarget_bench.motion.character import Character
from retarget_bench.motion.files.reading import Reading
from retarget_bench.motion.importer import load


@pytest.fixture
def file(tmp_path):
    """The T-pose body in centimetres, standing 20 cm above the floor."""
    body = Character.of("t", t_pose())
    root = np.tile([0.0, 1.2, 0.0], (60, 1))
    path = tmp_path / "body.bvh"
    bvh.write(path, body.motion(performance(body, 60), root, 30.0), scale=100.0)
    return path


def test_a_file_that_is_understood(file):
    findings = load(file).findings
    assert dict(findings.joints)["LeftForeArm"] == "left_forearm"
    assert findings.missing == ()
    assert findings.not_understood == ()
    assert findings.rest_pose == "T-pose"
    assert findings.facing == pytest.approx(0.0, abs=20.0)
    assert (findings.frames, findings.still) == (60, False)
    text = findings.text()
    for part in (
        "cm = 0.01 m (guessed)",
        "up axis    y (guessed)",
        "left_forearm",
        "body.bvh[unit=cm,up=y]",
    ):
        assert part in text
    assert "reading.toml" not in text
    assert "as told" in load(file, Reading(unit="cm")).findings.text()


@pytest.mark.parametrize(("high", "low"), [(1.1, 0.0), (0.0, -1.1), (0.8, 0.8), (2.0, 0.9)])
def test_feet_on_another_floor_than_y_0_are_reported_where_they_never_are_on_this(tmp_path, high, low):
    """A jump from a ledge, on which somebody stands for longer than on the floor, or for less long."""
    for before, after in ((60, 20), (20, 60)):
        bvh.write(tmp_path / "jump.bvh", jump(body(), high, low, before=before, after=after), scale=100.0)
        warned = [each for each in load(tmp_path / "jump.bvh").findings.warnings if "the feet are" in each]
        assert len(warned) == (0.0 not in (high, low))


def test_the_saved_reading_is_the_way_out(file, tmp_path):
    """Names that say nothing, on a body whose arms are not alike: the doctor lists them, and its file,
    corrected, is all it takes."""
    text = re.sub(r"(LeftForeArm\n.*\n\s*OFFSET) (\S+)", r"\1 40", file.read_text())
    codes = {name: f"Bone_{number:02}" for number, name in enumerate(BONES)}
    for name in sorted(codes, key=len, reverse=True):
        text = text.replace(f" {name}\n", f" {codes[name]}\n")
    file.write_text(text)
    lost = load(file).findings
    assert "left_arm" in lost.missing
    assert "Bone_05" in lost.not_understood
    assert any("say which are (roles=" in warning for warning in lost.warnings)
    assert "bench doctor --save reading.toml" in lost.text()

    proposal = tmp_path / "reading.toml"
    text = doctor.reading_text(load(file))
    assert text.count('"none"  # not understood') == len(lost.not_understood)
    by_code = {codes[name]: role for name, role in own_roles().items()}
    lines = [
        f'"{name}" = "{by_code[name]}"'
        if (name := line.partition('"')[2].partition('"')[0]) in by_code
        else line
        for line in text.splitlines()
    ]
    proposal.write_text("\n".join(lines))
    cured = load(file, Reading(reading=proposal)).findings
    assert cured.missing == ()
    assert cured.not_understood == ()
    assert dict(cured.joints)[codes["LeftArm"]] == "left_arm"
    assert cured.rest_pose == "T-pose"


def own_roles() -> dict[str, str]:
    """What the roles are under the body's own names."""
    body = Character.of("t", t_pose())
    pairs = zip(body.skeleton.names, body.roles, strict=True)
    return {name: role for name, role in pairs if role is not None}


def test_names_that_toml_must_quote_survive(file, tmp_path):
    text = file.read_text()
    file.write_text(text.replace(" LeftHand\n", ' Gizmo\\"one"\n'))
    imported = load(file)
    proposal = tmp_path / "reading.toml"
    proposal.write_text(doctor.reading_text(imported))
    assert Reading(reading=proposal).overrides['Gizmo\\"one"'] == "left_hand"
    assert Reading(reading=proposal) == imported.settled


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "utf-16-le", "utf-16-be"])
def test_proposals_are_taken_back_as_any_editor_saves_them(file, tmp_path, encoding):
    """Every joint stands in it, helpers too; with a byte order mark, where UTF-16 has none of its own."""
    proposal, imported = tmp_path / "reading.toml", load(file)
    text = doctor.reading_text(imported)
    mark = "\ufeff" if encoding in ("utf-16-le", "utf-16-be") else ""
    proposal.write_bytes((mark + text.replace("\n", "\r\n")).encode(encoding))
    again = load(file, Reading(reading=proposal))
    assert again.reading.overrides.keys() == set(imported.motion.skeleton.names)
    assert again.findings.joints == imported.findings.joints
    assert again.findings.doubts == imported.findings.doubts


def test_a_single_pose_and_bones_without_length(file):
    lines = file.read_text().splitlines()
    start = next(i for i, line in enumerate(lines) if line.startswith("Frames"))
    lines[start] = "Frames: 2"
    lines[start + 2 :] = [lines[start + 2]] * 2
    text = "\n".join(lines) + "\n"
    file.write_text(text)
    assert load(file).findings.still
    assert "all the same pose" in load(file).findings.text()
    assert load(file).findings.zero_bones == ()


def test_real_files_with_traps(real_data):
    """Zero bones, a body of arbitrary size, a crawling take, a dummy root: all said."""
    cmu = load(real_data / "cmu_bvh/01_01.bvh").findings
    assert "LHipJoint" in cmu.zero_bones
    toy = load(real_data / "same_pairs/result/6.bvh").findings
    assert any("unit is a guess" in warning and "inch" in warning for warning in toy.warnings)
    crawl = load(real_data / "lafan1/ground1_subject5.bvh").findings
    assert any("up axis is a guess" in warning for warning in crawl.warnings)
    bandai = load(real_data / "bandai_namco/dataset-1_bow_giant_001.bvh").findings
    assert any("joint_Root" in note for note in bandai.notes)
    dog = load(real_data / "dog/Dog_example.bvh").findings
    assert dog.quadruped
    assert "four legs" in dog.text()
    hair = dict(load(real_data / "mixamo_san/Aj/Praying.bvh").findings.joints)
    assert hair["HairA"] == "extra"
    assert hair["Pelvis"] == "helper"


def test_a_wrong_frame_time_is_doubted_and_told_better(file):
    """The frames stay; only how fast they follow each other is said anew."""
    truth = load(file)
    assert not any("rate=" in warning for warning in truth.findings.warnings)
    file.write_text(re.sub("Frame Time: .*", "Frame Time: 1.0", file.read_text()))
    wrong = load(file)
    assert wrong.motion.fps == 1.0
    assert any("frame rate is 1 per second" in each and "rate=" in each for each in wrong.findings.warnings)
    cured = load(file, Reading(rate=30.0))
    assert (cured.motion.fps, cured.findings.fps_stated, cured.findings.rate_explicit) == (30.0, 1.0, True)
    assert not any("rate=" in warning for warning in cured.findings.warnings)
    assert "at 30 per second (as told; the file says 1)" in cured.findings.text()
    assert "rate=30" in cured.findings.text()
    np.testing.assert_array_equal(cured.motion.rotations, truth.motion.rotations)
    resampled = load(file, Reading(rate=30.0), fps=15.0)
    assert resampled.motion.frames == truth.motion.frames // 2
    np.testing.assert_allclose(resampled.motion.root, truth.motion.root[::2], atol=1e-9)


@pytest.mark.parametrize("rate", [0.0, -1.0, float("nan"), float("inf"), 1e9])
def test_what_is_no_rate_is_refused(file, rate):
    with pytest.raises(NotSupported, match="frames per second"):
        load(file, Reading(rate=rate))
