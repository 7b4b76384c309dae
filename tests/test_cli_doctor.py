"""Readings: in brackets behind a file's name, and as the TOML that ``bench doctor --save`` writes."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import retarget_bench as rb
from retarget_bench.commands import doctor
from retarget_bench.commands.motion_files import MotionFile
from retarget_bench.errors import BenchError
from retarget_bench.motion import bvh, importer
from retarget_bench.motion.files.reading import Reading
from retarget_bench.plugins import registry
from tests.bench_command import bowing
from tests.motion import smpl_files
from tests.motion.gltf_files import person


@pytest.fixture(autouse=True)
def files(tmp_path, monkeypatch) -> None:
    """``bow.bvh`` in a unit of its own, ``anna.glb`` with two takes, ``amass.npz``."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(registry, "_FILES", {})
    bvh.write(Path("bow.bvh"), bowing(tmp_path)["large"], scale=17.0)
    figure = person(np.random.default_rng(0), frames=4, size=100.0)
    figure.animate("nod", {(3, "rotation"): ([0.0, 1.0], [[0, 0, 0, 1], [0, 1, 0, 0]])})
    figure.save(Path("anna.glb"))
    smpl_files.archive(Path("amass.npz"), smpl_files.parameters(np.random.default_rng(0)))


def same(actual: importer.Imported, expected: importer.Imported) -> None:
    np.testing.assert_array_equal(actual.motion.positions, expected.motion.positions)
    np.testing.assert_array_equal(actual.motion.rotations, expected.motion.rotations)
    assert actual.motion.character.roles == expected.motion.character.roles
    assert actual.motion.fps == expected.motion.fps


@pytest.mark.parametrize(
    "name",
    ["bow.bvh", "bow.bvh[unit=0.0588235]", "anna.glb#nod", "anna.glb[take=2,up=z,rate=12]", "amass.npz"],
)
def test_a_saved_reading_gives_the_same_motion_whatever_is_guessed(bench, name):
    code, out, err = bench("doctor", name, "--save", "kept/reading.toml")
    assert code == 0, err
    assert "wrote kept/reading.toml" in out
    file, plain = MotionFile.parse(name), re.split(r"[#\[]", name)[0]
    again = MotionFile.parse(f"{plain}[reading=kept/reading.toml]")
    expected, actual = (importer.load(each.path, each.reading) for each in (file, again))
    same(actual, expected)
    assert again.reading == expected.settled
    findings = actual.findings
    assert (findings.unit_explicit, findings.up_explicit) == (True, True)
    assert importer.load(plain, Reading(reading="kept/reading.toml")).findings == findings
    np.testing.assert_array_equal(
        rb.load_motion(plain, reading="kept/reading.toml").positions, expected.motion.positions
    )


def test_what_is_said_beside_a_saved_reading_wins():
    Path("r.toml").write_text('unit = "mm"\nup = "z"\n\n[roles]\nHead = "none"\n')
    reading = MotionFile.parse("bow.bvh[reading=r.toml,unit=cm]").reading
    assert (reading.unit, reading.up, reading.overrides, reading.reading) == (
        "cm",
        "z",
        {"Head": None},
        None,
    )
    Path("roles.toml").write_text('Head = "head"\n')
    assert Reading(reading="r.toml", roles="roles.toml").overrides == {"Head": "head"}
    assert Reading(roles="r.toml").overrides == {"Head": None}, "the table of a reading alone"


@pytest.mark.parametrize(
    ("text", "path", "expected"),
    [
        ("bow.bvh", "bow.bvh", {}),
        ("bow.bvh[]", "bow.bvh[]", {}),
        ("bow.bvh[unit=cm, up=-z]", "bow.bvh", {"unit": "cm", "up": "-z"}),
        ("bow.bvh[unit=0.01,rate=24]", "bow.bvh", {"unit": 0.01, "rate": 24}),
        ("anna.glb#2[unit=m]", "anna.glb#2", {"unit": "m"}),
        ("anna.glb[take=2]", "anna.glb", {"take": "2"}),
        ("anna.glb[take='a[1], b=2']", "anna.glb", {"take": "a[1], b=2"}),
        ("odd[a=1].bvh[unit=cm]", "odd[a=1].bvh", {"unit": "cm"}),
        ("odd[unit=m]", "odd[unit=m]", {}),
        ("gone.bvh[unit=cm]", "gone.bvh", {"unit": "cm"}),
    ],
)
def test_brackets_behind_a_name(text, path, expected):
    for name in ("odd[a=1].bvh", "odd[unit=m]"):
        Path(name).touch()
    assert MotionFile.parse(text) == MotionFile(Path(path), Reading(**expected))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[uint=cm]", "bow.bvh: 'uint' is nothing that a file is read by; try unit"),
        ("[unit=cm", "found the end; a file is written FILE"),
        ("[unit=ell]", "unit='ell' is not known"),
        ("[unit=0]", "unit=0 is not known"),
        ("[up=w]", "up='w' is not known"),
        ("[rate=fast]", "rate is 'fast', of type str; it takes a number or None"),
        ("[rate=0]", "rate=0 is no frame rate"),
        ("[inner_positions=melt]", "inner_positions: 'melt' is not known; it is one of auto, drop"),
        ("[root_place=both]", "root_place: 'both' is not known"),
        ("[reading=none.toml]", "none.toml: cannot be read"),
        ("[reading=wrong.toml]", "wrong.toml: 'uint' is nothing"),
        ("[reading=loop.toml]", "loop.toml: has a line 'reading'"),
        ("[roles=wrong.toml]", "wrong.toml: 'uint': \"cm\"|wrong.toml: 'uint': 'cm' is no role"),
    ],
)
def test_what_cannot_be_said_of_a_file_is_a_sentence(bench, text, message):
    Path("wrong.toml").write_text('uint = "cm"\n')
    Path("loop.toml").write_text('reading = "loop.toml"\n')
    with pytest.raises(BenchError, match=message):
        MotionFile.parse(f"bow.bvh{text}")
    code, out, err = bench("doctor", f"bow.bvh{text}")
    assert (code, out, "Traceback" in err) == (2, "", False)


MEANINGS = st.sampled_from(["hips", "left_hand", "helper", "extra", "not understood", "above the hips"])


@given(st.dictionaries(st.text(st.characters(exclude_categories=["Cs"]), min_size=1), MEANINGS, max_size=6))
def test_any_name_of_a_joint_is_quoted_so_that_it_is_read_again(tmp_path_factory, joints):
    loaded = importer.load("bow.bvh")
    text = doctor.reading_text(
        replace(loaded, findings=replace(loaded.findings, joints=tuple(joints.items())))
    )
    path = tmp_path_factory.mktemp("readings") / "reading.toml"
    path.write_text(text, encoding="utf-8", newline="\n")
    roles = {"hips", "left_hand"}
    expected = {name: meaning if meaning in roles else None for name, meaning in joints.items()}
    assert Reading(reading=path).overrides == expected
    assert text.count('"none"  # ') == sum(meaning not in roles for meaning in joints.values())


def test_a_saved_reading_is_replaced_where_it_is_ones_own_and_unchanged(bench):
    saving = ("doctor", "bow.bvh", "--save", "r.toml")
    assert bench(*saving)[0] == 0
    written = Path("r.toml").read_text()
    assert bench("doctor", "bow.bvh[unit=cm]", "--save", "r.toml")[0] == 0, "nobody has changed it"
    assert 'unit = "cm"' in Path("r.toml").read_text()
    for other in (
        'Head = "head"\n',
        written.replace('"head"', '"none"'),
        written.replace("bow", "box"),
        "",
    ):
        Path("r.toml").write_text(other)
        code, _, err = bench(*saving)
        assert code == 2
        assert "--save would overwrite r.toml, which was changed since or is not of bow.bvh" in err
        assert Path("r.toml").read_text() == other


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("bow.bvh", "anna.glb", "--save", "r.toml"), "what is written is of one file"),
        (("bow.bvh", "--save", "r.txt"), "what is written is a .toml file"),
        (("bow.bvh", "--save", "bow.bvh/r.toml"), "cannot be written"),
        (("bow.bvh", "--sheet", "r.jpg"), "what is written is a .png file"),
    ],
)
def test_where_a_reading_cannot_be_saved_is_said_before_it_is_read(bench, words, message):
    code, out, err = bench("doctor", *words)
    assert (code, out) == (2, "")
    assert message in err
