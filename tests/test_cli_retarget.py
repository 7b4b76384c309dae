"""``bench retarget`` and ``bench doctor`` on files."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from retarget_bench.motion import bvh, files, importer
from retarget_bench.motion.character import Character
from retarget_bench.motion.files.reading import Reading
from retarget_bench.motion.files.smpl import skeletons
from retarget_bench.motion.files.smpl.skeletons import BODY
from retarget_bench.plugins import registry
from tests.bench_command import bowing, method_file
from tests.datasets.test_folder import ASF
from tests.motion import fbx_files, smpl_files
from tests.motion.gltf_files import person


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(registry, "_FILES", {})


@pytest.fixture
def figures(tmp_path) -> dict[str, Path]:
    """Two figures that bow, as files: the small one in metres, the large one in centimetres."""
    written = {}
    for name, motion in bowing(tmp_path).items():
        written[name] = tmp_path / f"{name}.bvh"
        bvh.write(written[name], motion, scale={"small": 1, "large": 100}[name])
    return written


def test_the_small_figures_bow_is_bowed_by_the_large_one(bench, figures):
    result = bench(
        "retarget", f"{figures['small']}[unit=m]", "--target", f"{figures['large']}[unit=cm]",
        "-o", "out.bvh", "-m", "copy_rotations",
    )  # fmt: skip
    assert result[0] == 0, result[2]
    assert result[1].splitlines()[1:] == ["nothing to look at"]
    assert "20 frames of small at 30 per second on the body of large, by copy_rotations" in result[1]
    assert "unit cm, y up" in result[1]
    # both figures bow alike, so the answer is what the large one does itself, in its own unit
    expected, actual = bvh.parse(figures["large"]), bvh.parse("out.bvh")
    assert actual.hierarchy.names == expected.hierarchy.names
    np.testing.assert_allclose(actual.values, expected.values, atol=1e-4)


def test_a_wrong_rate_is_doubted_and_told_better(bench, figures):
    for file in figures.values():
        file.write_text(re.sub("Frame Time: .*", "Frame Time: 1.0", file.read_text()))
    small, large = figures["small"], figures["large"]
    arguments = ("-o", "out.bvh", "-m", "copy_rotations")
    code, out, err = bench("retarget", small, "--target", large, *arguments)
    assert code == 0, err
    for file in (small, large):
        assert re.search(f"{file}: the frame rate is 1 per second, .* say the true rate", err)
    code, out, err = bench("retarget", f"{small}[rate=30]", "--target", f"{large}[rate=30]", *arguments)
    assert (code, "rate" in err) == (0, False), err
    assert "20 frames of small at 30 per second" in out
    assert importer.load("out.bvh", Reading(unit="cm")).motion.fps == 30
    assert "rate=24]" in bench("doctor", f"{small}[rate=24]")[1]
    code, out, err = bench("retarget", f"{small}[rate=1e6]", "--target", large, *arguments)
    assert (code, "rate=1e+06 is no frame rate" in err) == (2, True), err


def test_an_acclaim_skeleton_lies_beside_its_motion_or_is_named(bench, figures, tmp_path):
    (tmp_path / "far").mkdir()
    (tmp_path / "far/bones.asf").write_text(ASF)
    (tmp_path / "01_02.amc").write_text(":DEGREES\n1\nroot 0 16 0 0 0 0\n2\nroot 0 16 1 0 0 0\n")
    arguments = (
        "retarget",
        "01_02.amc",
        "--target",
        figures["small"],
        "-o",
        "out.bvh",
        "-m",
        "copy_rotations",
    )
    code, out, err = bench(*arguments)
    assert code == 2
    assert "needs its skeleton, 01_02.asf or 01.asf" in err
    code, out, err = bench("retarget", "01_02.amc[skeleton=far/bones.asf]", *arguments[2:])
    assert code == 0, err
    assert "2 frames of 01_02 at 120 per second" in out
    onto = ("--target", "01_02.amc[skeleton=far/bones.asf]", *arguments[4:])
    code, out, err = bench("retarget", figures["small"], *onto)
    assert code == 0, err
    assert "on the body of 01_02" in out
    assert bench("doctor", "far/bones.asf")[0] == 0
    code, out, err = bench("retarget", f"{figures['small']}[skeleton=far/bones.asf]", *onto)
    assert (code, "is for AMC files" in err) == (2, True), err


def test_a_method_that_gives_positions_writes_what_was_fitted_to_them(bench, figures):
    method_file(Path(), "places", "return target.positions(copied.positions, source.fps)")
    source, target = f"{figures['small']}[unit=m]", f"{figures['large']}[unit=cm]"
    code, out, err = bench("retarget", source, "--target", target, "-o", "fitted.bvh", "-m", "places.py")
    assert code == 0, err
    note, summary, *_ = out.splitlines()
    assert note.startswith("rotations were fitted to positions: 0.0 cm mean, 0.0 cm worst (")
    assert "20 frames of small at 30 per second on the body of large, by places" in summary
    expected, actual = (
        importer.load(file, Reading(unit="cm")).motion for file in (figures["large"], "fitted.bvh")
    )
    assert np.abs(actual.positions - expected.positions).max() < 1e-4
    assert bvh.parse("fitted.bvh").hierarchy.names == bvh.parse(figures["large"]).hierarchy.names


def test_what_is_understood_is_said_with_what_to_override(bench, figures):
    code, out, _ = bench("doctor", figures["small"], figures["large"])
    assert code == 0
    assert out.count("Joints and their roles:") == 2
    for text in ("left_forearm", "cm = 0.01 m", "up axis", "rest pose", "30 per second", "floor"):
        assert text in out
    text = bench("doctor", f"{figures['large']}[unit=m]")[1]
    assert "m = 1 m (as told)" in text


def test_files_of_both_formats_mix_and_results_keep_the_target_s_format(bench, figures):
    figure = person(np.random.default_rng(0), frames=10, size=100.0)
    figure.animate("nod", {(3, "rotation"): ([0.0, 1.0], [[0, 0, 0, 1], [0, 1, 0, 0]])})
    figure.save(Path("person.glb"))
    units = ("-m", "copy_rotations", "--quiet")
    small, glb = figures["small"], "person.glb"
    for source, target, out in (
        (small, glb, "into.glb"),
        (glb, small, "text.bvh"),
        (glb, small, "new.glb"),
        (glb, glb, "own.glb"),
        (glb, glb, "own.bvh"),
        ("person.glb#act", "into.glb", "again.glb"),
    ):
        code, printed, err = bench("retarget", source, "--target", target, "-o", out, *units)
        assert (code, printed) == (0, ""), err
    assert files.takes("into.glb") == ("into", "act", "nod")
    assert files.takes("again.glb") == ("again", "into", "act", "nod")
    assert importer.load("into.glb").findings.unit[0] == "cm"
    assert importer.load("into.glb").motion.character.mesh is not None
    assert bvh.parse("text.bvh").hierarchy.names == bvh.parse(small).hierarchy.names
    own = importer.load(glb).motion
    for out in ("own.glb", "own.bvh"):
        loaded = importer.load(out).motion
        np.testing.assert_allclose(loaded.positions, own.positions, atol=2e-5)
    result = bench("retarget", f"{glb}[take=nod]", "--target", glb, "-o", "nod.glb", "-m", "copy_rotations")
    assert "31 frames of person" in result[1]
    assert "unit cm, y up" in result[1]
    result = bench("retarget", glb, "--target", glb, "-o", "nod.bvh", "-m", "copy_rotations")
    assert "unit m, y up" in result[1]


def test_files_of_smpl_go_in_and_out(bench, figures):
    random = np.random.default_rng(0)
    smpl_files.archive(Path("amass.npz"), smpl_files.parameters(random))
    smpl_files.archive(Path("models/smplh/female/model.npz"), smpl_files.model(random))
    np.save("joints.npy", smpl_files.danced(Character.of("body", skeletons.average(BODY)), 30))
    code, out, err = bench("retarget", "joints.npy", "--target", "amass.npz", "-o", "out.npz")
    assert code == 0, err
    assert "22 of 52 joints follow it; unit m, z up" in out
    assert "joints.npy: the rate is not stated: 20 frames per second" in err
    assert "amass.npz: an average skeleton: say body_model=FILE for" in err
    modelled = ("--target", "amass.npz[body_model=models]", "--quiet")
    code, out, err = bench("retarget", "joints.npy[rate=30]", *modelled, "-o", "out.glb")
    assert (code, out, err) == (0, "", "")
    loaded = importer.load("out.glb").motion
    assert (loaded.fps, len(loaded.character.mesh.vertices)) == (30.0, 90)
    code, out, _ = bench("doctor", "amass.npz[body_model=models]")
    assert code == 0
    for phrase in (
        "SMPL-H, female, 16 betas",
        "joints and skin of model.npz",
        "6 of the 16 betas",
        "left_thumb_3",
    ):
        assert phrase in out
    code, _, err = bench("retarget", "joints.npy", "--target", figures["small"], "-o", "no.npz")
    assert code == 2
    assert "no.npz: not written: an AMASS file states the joints of SMPL bodies alone, and" in err
    assert not Path("no.npz").exists()
    assert "a body model is for AMASS files" in bench("doctor", "joints.npy[body_model=models]")[2]


def bare(name: str = "Hips", root: str = "0 0 0", tip: str = "0 0 0", row: str = "0 1 0 0 0 0") -> str:
    """A body of one joint, as a file of two frames."""
    channels = "CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation"
    head = f"HIERARCHY\nROOT {name}\n{{\nOFFSET {root}\n{channels}\nEnd Site\n{{\nOFFSET {tip}\n}}\n}}\n"
    return f"{head}MOTION\nFrames: 2\nFrame Time: 0.04\n{row}\n0 2 0 0 0 0\n"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (bare("9" * 5000), "has a name of 5,000 characters"),
        (bare("9" * 1000), "Joints and their roles"),
        (bare(root="0 0 5e-324"), "Joints and their roles"),
        (bare(root="0 0 1"), "Joints and their roles"),
        (bare(tip="0 1e300 0"), "holds numbers above 1e+09"),
        (bare(row="1.7e308 1.7e308 -1.7e308 -1.7e308 0 0"), "holds numbers above 1e+09"),
        (bare().replace("Frames: 2", f"Frames: {'9' * 5000}"), "and a whole number"),
    ],
)
@pytest.mark.filterwarnings("error")
def test_odd_bodies_are_told_without_a_warning_of_numpy(bench, tmp_path, text, message):
    (tmp_path / "odd.bvh").write_text(text)
    code, out, err = bench("doctor", "odd.bvh")
    assert message in out + err
    assert "Warning" not in out + err
    assert code in (0, 2)


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize(
    ("zeroed", "message"),
    [("", "has no height"), ("arm hand", "joints follow"), ("leg foot toe", "")],
    ids=["all", "arms", "legs"],
)
def test_bones_of_no_length_are_retargeted_or_refused_in_a_sentence(bench, figures, zeroed, message):
    lines = figures["small"].read_text().splitlines()
    joint = ""
    for number, line in enumerate(lines):
        words = line.split()
        joint = words[1].lower() if words[0] in ("ROOT", "JOINT") else joint
        if words[0] == "OFFSET" and any(part in joint for part in (zeroed.split() or [""])):
            lines[number] = line[: line.index("OFFSET")] + "OFFSET 0 0 0"
    Path("odd.bvh").write_text("\n".join(lines) + "\n")
    for method in ("copy_rotations", "ik"):
        code, out, err = bench(
            "retarget", "odd.bvh", "--target", figures["large"], "-o", "out.bvh", "-m", method
        )
        assert message in out + err
        assert code in (0, 2)
        assert "Error" not in err


def test_an_unreadable_file_is_one_line_and_the_others_are_examined(bench, figures):
    Path("broken.bvh").write_text("HIERARCHY\nROOT Hips\n{\n")
    code, out, err = bench("doctor", "broken.bvh", figures["small"], "missing.bvh")
    assert code == 2
    assert "small.bvh" in out
    assert [line.split(":")[1].strip() for line in err.splitlines()] == ["broken.bvh", "missing.bvh"]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"source": "missing.bvh"}, "missing.bvh: cannot be read"),
        ({"out": "small.bvh"}, "small.bvh would overwrite"),
        ({"out": "large.bvh"}, "large.bvh would overwrite"),
        ({"method": "pan[weights=/no/such]"}, "bench: /no/such: there are no weights of this name; give"),
        ({"method": "reference"}, "reference gave no motion (unsupported)"),
        ({"method": "copy"}, "did you mean copy_rotations"),
        ({"unit": "parsec"}, "unit='parsec' is not known"),
        ({"out": "small.py/out.bvh"}, "cannot be written"),
    ],
)
def test_failures_are_sentences_and_leave_the_files_alone(bench, figures, change, message):
    Path("small.py").write_text("")
    before = {path.name: path.read_bytes() for path in Path().iterdir() if path.is_file()}
    arguments = {
        "source": "small.bvh",
        "target": "large.bvh",
        "out": "out.bvh",
        "method": "ik",
        "unit": "m",
    } | change
    code, out, err = bench(
        "retarget", f"{arguments['source']}[unit={arguments['unit']}]", "--target", arguments["target"],
        "-o", arguments["out"], "-m", arguments["method"],
    )  # fmt: skip
    assert code == 2
    assert out == ""
    assert message in err
    assert "Traceback" not in err
    assert {path.name: path.read_bytes() for path in Path().iterdir() if path.is_file()} == before


def test_fbx_files_are_sources_and_targets_and_are_not_written(bench, figures):
    pytest.importorskip("ufbx")
    fbx_files.person(np.random.default_rng(0), frames=6).save(Path("person.fbx"))
    code, out, _ = bench("doctor", "person.fbx")
    assert code == 0
    for phrase in ("cm = 0.01 m (as stated)", "take 1 of 1 'act'", "left_forearm", "T-pose"):
        assert phrase in out
    arguments = ("--target", "person.fbx", "-m", "copy_rotations", "-o")
    code, out, err = bench("retarget", "person.fbx", *arguments, "new.glb")
    assert code == 0, err
    own, new = importer.load("person.fbx").motion, importer.load("new.glb").motion
    np.testing.assert_allclose(new.positions, own.positions, atol=1e-5)
    mesh, written = own.character.mesh, new.character.mesh
    np.testing.assert_allclose(written.vertices[written.faces], mesh.vertices[mesh.faces], atol=1e-5)
    assert bench("retarget", "person.fbx#act", *arguments, "new.bvh")[0] == 0
    code, _, err = bench("retarget", figures["small"], *arguments, "new.fbx")
    assert code == 2
    assert "FBX is read and not written; programs that import FBX import GLB as well" in err
    assert "ends in .bvh or .glb" in err
    Path("person.fbx").write_bytes(Path("person.fbx").read_bytes()[:999])
    code, out, err = bench("doctor", "person.fbx")
    assert (code, out) == (2, "")
    assert "person.fbx: is" in err
