"""ASF/AMC files: against matrices by hand, the takes of CMU, and faults."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from retarget_bench.errors import FileError, NotSupported
from retarget_bench.motion import files, importer
from retarget_bench.motion.files.acclaim.reading import beside
from retarget_bench.motion.files.reading import Reading

ASF = """# a skeleton
:version 1.10
:name test
:units
  mass 1.0
  length 0.45
  angle deg
:documentation
   a ROOT and two bones
:root
   order TX TZ TY RZ RX RY
   axis XYZ
   position 0 0 0
   orientation 0 0 0
:bonedata
  begin
     id 1
     name Spine
     direction 0 2 0
     length 5
     axis 10 20 30 YZX
     dof rx rz ry
     limits (-160.0 20.0)
            (-70.0 70.0)
            (-60.0, inf)
  end
  begin
     id 2
     name head
     direction 0.6 0.8 0
     length 2
     axis 0 0 45 XYZ
     dof ry
  end
  begin
     id 3
     name arm
     direction 1 0 0
     length 3
     axis 90 0 0 XYZ
  end
:hierarchy
  begin
    spine head arm
    root spine
  end
"""
AMC = """#!OML:ASF C:\\x\\test.ASF
:FULLY-SPECIFIED
:DEGREES
1
root 1 2 3 10 20 30
spine 5 -6 7
head 40
2
root 1.5 2 -3 -50 2e1 30
spine 15 6 70
head -4
"""


@pytest.fixture
def asf(tmp_path) -> Path:
    (tmp_path / "test.asf").write_text(ASF)
    return tmp_path / "test.asf"


@pytest.fixture
def amc(tmp_path, asf) -> Path:
    (tmp_path / "test_01.amc").write_text(AMC)
    return tmp_path / "test_01.amc"


def about(axis: str, degrees: float) -> np.ndarray:
    return Rotation.from_euler(axis, degrees, degrees=True).as_matrix()


def test_every_convention_by_hand(amc):
    """Orders of root and bones, an axis with an order of its own, a direction that is no unit vector."""
    recording = files.read(amc)
    assert recording.skeleton.names == ("root", "spine", "head", "arm")
    assert recording.skeleton.parents.tolist() == [-1, 0, 1, 1]
    np.testing.assert_allclose(recording.skeleton.offsets, [[0, 0, 0], [0, 0, 0], [0, 5, 0], [0, 5, 0]])
    np.testing.assert_allclose(recording.root, [[1, 3, 2], [1.5, -3, 2]])
    sites = {recording.skeleton.names[site.parent]: site.offset for site in recording.skeleton.end_sites}
    np.testing.assert_allclose(sites["head"], [1.2, 1.6, 0])
    np.testing.assert_allclose(sites["arm"], [3, 0, 0])
    for frame, (rz, rx, ry, sx, sz, sy, head) in enumerate(
        [(10, 20, 30, 5, -6, 7, 40), (-50, 20, 30, 15, 6, 70, -4)]
    ):
        root = about("y", ry) @ about("x", rx) @ about("z", rz)
        own = about("x", 10) @ about("z", 30) @ about("y", 20)
        spine = own @ about("y", sy) @ about("z", sz) @ about("x", sx) @ own.T
        tilt = about("z", 45)
        top = tilt @ about("y", head) @ tilt.T
        for joint, expected in enumerate((root, spine, top, np.eye(3))):
            w, x, y, z = recording.rotations[frame, joint]
            np.testing.assert_allclose(Rotation.from_quat([x, y, z, w]).as_matrix(), expected, atol=1e-12)
    assert (recording.fps, recording.rate_stated, recording.unit) == (120.0, False, "cmu")
    assert "bones from test.asf" in recording.notes


def test_radians_the_root_s_own_place_and_other_units(tmp_path, asf, amc):
    plain = files.read(amc)
    asf.write_text(ASF.replace("length 0.45", "length 1.0").replace("position 0 0 0", "position 0 9 0"))
    values = []
    for name, *words in (line.split() for line in AMC.splitlines()[3:]):
        first = 3 if name == "root" else 0
        angles = [repr(float(np.radians(float(word)))) for word in words[first:]]
        values += [" ".join([name, *words[:first], *angles])] if words else []
    rows = [":radians", "1", *values[:3], "2", *values[3:]]
    amc.write_text("\r\n".join(rows))
    recording = files.read(amc)
    assert recording.unit == ""
    np.testing.assert_allclose(recording.root - plain.root, [[0, 9, 0]] * 2, atol=1e-12)
    np.testing.assert_allclose(recording.rotations, plain.rotations, atol=1e-12)
    asf.write_text(ASF.replace("orientation 0 0 0", "orientation 90 0 0"))
    turned = files.read(asf)
    w, x, y, z = turned.rotations[0, 0]
    np.testing.assert_allclose(Rotation.from_quat([x, y, z, w]).as_matrix(), about("x", 90), atol=1e-12)


def test_bones_that_shift_and_stretch_are_positions_of_inner_joints(asf, amc):
    text = ASF.replace("dof ry", "dof ry tx l").replace("root spine", "root spine\n head tip")
    tip = "begin\nname tip\ndirection 0 1 0\nlength 1\nend\n"
    asf.write_text(text.replace(":hierarchy", f"{tip}:hierarchy"))
    amc.write_text(AMC.replace("head 40", "head 40 1 0.5").replace("head -4", "head -4 -1 0"))
    recording = files.read(amc)
    head, tip = recording.skeleton.index("head"), recording.skeleton.index("tip")
    slope = np.array([np.cos(np.pi / 4), np.sin(np.pi / 4), 0])
    shifted = recording.places[:, head] - [[0, 5, 0]]
    np.testing.assert_allclose(shifted, [slope, -slope], atol=1e-12)
    np.testing.assert_allclose(recording.places[:, tip], [[1.5, 2.0, 0], [1.2, 1.6, 0]], atol=1e-12)
    np.testing.assert_allclose(recording.skeleton.offsets[head], [0, 5, 0])


@settings(max_examples=25, deadline=None)
@given(st.data())
def test_frames_in_another_order_are_the_same_motion(tmp_path_factory, data):
    """The fast way and the slow way agree; comments, blanks and capitals change nothing."""
    folder = tmp_path_factory.mktemp("a")
    (folder / "a.asf").write_text(ASF)
    blocks = [AMC.splitlines()[4:7], AMC.splitlines()[8:11]]
    (folder / "a.amc").write_text(AMC)
    mixed = [":DEGREES"]
    for number, block in enumerate(blocks, 1):
        mixed += [str(number), *(f"  {line.upper()} " for line in data.draw(st.permutations(block))), ""]
    (folder / "b.amc").write_text(data.draw(st.sampled_from(["\n", "\r\n"])).join(mixed))
    one, other = files.read(folder / "a.amc"), files.read(folder / "b.amc")
    np.testing.assert_array_equal(one.rotations, other.rotations)
    np.testing.assert_array_equal(one.root, other.root)


def test_a_skeleton_alone_is_a_body_at_rest(asf):
    imported = importer.load(asf)
    assert imported.motion.frames == 1
    np.testing.assert_array_equal(imported.motion.rotations[0, :, 0], 1.0)
    assert any("a skeleton alone" in note for note in imported.findings.notes)


def test_the_skeleton_lies_beside_the_motion_or_is_named(tmp_path, asf, amc):
    assert beside(amc) == asf
    (tmp_path / "other.ASF").write_text(ASF.replace("length 5", "length 6"))
    assert beside(amc) == asf
    far = files.read(amc, Reading(skeleton=str(tmp_path / "other.ASF")))
    assert far.skeleton.offsets[2].tolist() == [0, 6, 0]
    asf.unlink()
    assert beside(amc) == tmp_path / "other.ASF"
    (tmp_path / "third.asf").write_text(ASF)
    with pytest.raises(FileError, match=r"other.ASF, third.asf\): say skeleton=FILE"):
        files.read(amc)
    with pytest.raises(FileError, match=r"gone\.asf: cannot be read"):
        files.read(amc, Reading(skeleton="gone.asf"))
    (tmp_path / "a.bvh").write_text("HIERARCHY\n")
    with pytest.raises(NotSupported, match="is for AMC files"):
        files.read(tmp_path / "a.bvh", Reading(skeleton="third.asf"))
    with pytest.raises(NotSupported, match="one motion of one body"):
        files.read(amc, Reading(take="2"))


def test_the_rate_is_usual_unless_told(amc):
    findings = importer.load(amc).findings
    assert (findings.fps, findings.fps_stated) == (120.0, None)
    assert "usual in this format: the file does not say" in findings.text()
    assert importer.load(amc, Reading(rate=60.0)).motion.fps == 60.0


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (":hierarchy", ":hierarchie", r"test.asf:42: :hierarchie is no section"),
        ("     direction 0 2 0", "     direction 0 2", "test.asf:19: expected 3 finite numbers"),
        ("     length 5", "     length 1_0", "test.asf:20: expected 1 finite number"),
        ("     axis 10 20 30 YZX", "     axis 10 20 30 YZZ", "test.asf:21: 'YZZ' is no order of axes"),
        ("     dof rx rz ry", "     dof rx rz rx", "test.asf:22: 'rx' is not one of"),
        ("     name head", "     name spine", "test.asf:34: a second bone is called 'spine'"),
        ("    root spine", "    root spine hat", "test.asf:45: 'hat' is no bone of :bonedata"),
        ("    root spine", "    root spine head", "test.asf:45: 'head' has a parent already, in line 44"),
        ("    root spine", "    arm spine", "nothing hangs on the root"),
        ("  angle deg", "  angle grad", "test.asf:7: angle is deg or rad"),
        ("  length 0.45", "  length 0", "test.asf:6: the unit of length must be above 0"),
        (ASF[ASF.index(":hierarchy") :], "", "has no section :hierarchy"),
        (ASF[ASF.index("  end\n:hierarchy") :], ":hierarchy\nroot spine", "has no 'end'"),
    ],
)  # fmt: skip
def test_faults_of_skeletons_are_told_with_their_line(asf, amc, old, new, message):
    assert ASF.count(old) == 1
    asf.write_text(ASF.replace(old, new))
    for file in (asf, amc):
        with pytest.raises(FileError, match=message):
            files.read(file)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("head 40", "head x", "test_01.amc:7: expected 1 finite number behind 'head', found 'x'"),
        ("head 40", "head nan", "test_01.amc:7: expected 1 finite number"),
        ("head 40", "head 1e300", "test_01.amc:7: expected 1 finite number"),
        ("head 40", "head", "test_01.amc:7: expected 1 finite number behind 'head', found ''"),
        ("head 40", "head 40 50", "test_01.amc:7: expected 1 finite number"),
        ("head 40", "arm 40", "test_01.amc:7: 'arm' is no bone of test.asf that can move"),
        ("head 40", "spine 1 2 3", "test_01.amc:7: 'spine' stands twice in frame 1"),
        ("spine 15 6 70\n", "", "test_01.amc:8: frame 2 lacks 'spine'"),
        ("spine 15 6 70\nhead -4\n", "", "frame 2 lacks 'spine' and 1 more bones: the file is cut"),
        ("spine 15 6 70", "spine 15 6", "test_01.amc:10: expected 3 finite numbers"),
        ("spine 5 -6 7\n", "", "test_01.amc:7: frame 2 has 'spine', which frame 1 lacks"),
        (AMC[AMC.index("1\n") :], "", "has no frames"),
        (AMC[AMC.index("1\n") :], "root 1", "test_01.amc:4: expected the number of the first frame"),
        (AMC, "", "is empty"),
        (AMC, ":DEGREES\n1\n", "test_01.amc:2: frame 1 is empty"),
    ],
)  # fmt: skip
def test_faults_of_motions_are_told_with_their_line(amc, old, new, message):
    assert AMC.count(old) == 1
    amc.write_text(AMC.replace(old, new))
    with pytest.raises(FileError, match=message):
        files.read(amc)


@pytest.mark.parametrize("take", ["01", "09"])
def test_takes_of_cmu_are_understood(real_data, take):
    findings = importer.load(real_data / "cmu_asfamc" / f"02_{take}.amc").findings
    assert (findings.unit[0], findings.rest_pose) == ("cmu", "T-pose")
    assert findings.missing == findings.not_understood == findings.warnings == ()
