"""``bench retarget`` of folders and several targets, and what it writes beside results."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from retarget_bench.commands import retarget
from retarget_bench.commands.retargeting import batch
from retarget_bench.motion import bvh, importer
from retarget_bench.parallel import Done
from retarget_bench.plugins import registry
from tests.bench_command import bowing
from tests.in_process import carried_out_here
from tests.motion.editing_bodies import body, gait
from tests.motion.gltf_files import person


@pytest.fixture(autouse=True)
def _elsewhere(request, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(registry, "_FILES", {})
    if not request.node.get_closest_marker("processes"):
        monkeypatch.setattr(batch, "carried_out", carried_out_here)


@pytest.fixture
def folders(tmp_path) -> None:
    """``mocap/`` with clips of 20 and 10 frames, ``bodies/`` with a figure in BVH and a person in GLB."""
    motions = bowing(tmp_path)
    for folder in ("mocap", "bodies"):
        Path(folder).mkdir()
    bvh.write(Path("mocap/bow.bvh"), motions["small"])
    bvh.write(Path("mocap/back.bvh"), motions["small"].at(slice(10)))
    bvh.write(Path("bodies/large.bvh"), motions["large"], scale=100)
    person(np.random.default_rng(0), frames=4).save(Path("bodies/person.glb"))


COPY = ("-m", "copy_rotations")
MOCAP, BOW = "mocap[unit=m]", "mocap/bow.bvh[unit=m]"


def results(folder: str = "out") -> dict[str, int]:
    """Results by their path, with the time of their last change."""
    paths = (path for path in Path(folder).rglob("*") if path.is_file() and path.name != batch.RECORDS)
    return {path.relative_to(folder).as_posix(): path.stat().st_mtime_ns for path in paths}


def test_every_source_goes_to_every_target_as_one_by_one(bench, folders):
    code, out, err = bench("retarget", MOCAP, "--target", "bodies", "-o", "out", *COPY)
    assert code == 0, err
    assert results().keys() == {"large/back.bvh", "large/bow.bvh", "person/back.glb", "person/bow.glb"}
    assert out.count("nothing to look at\n") == 5
    assert out.endswith("4 retargeted, 0 up to date, 0 failed; nothing to look at\n")
    for target, result in (("large.bvh", "large/bow.bvh"), ("person.glb", "person/bow.glb")):
        alone = f"alone{Path(result).suffix}"
        assert bench("retarget", BOW, "--target", f"bodies/{target}", "-o", alone, *COPY)[0] == 0
        one, many = importer.load(alone), importer.load(f"out/{result}")
        np.testing.assert_array_equal(one.motion.positions, many.motion.positions)


def test_one_target_has_no_folder_of_its_own_and_a_format_can_be_chosen(bench, folders):
    Path("flat").mkdir()
    arguments = ("retarget", BOW, "--target", "bodies/large.bvh", "-o", "flat", *COPY)
    assert bench(*arguments)[0] == 0
    assert bench(*arguments, "--format", "glb", "--quiet") == (0, "", "")
    assert results("flat").keys() == {"bow.bvh", "bow.glb"}


def test_what_is_up_to_date_is_left_and_what_changed_is_done_again(bench, folders):
    arguments = ("retarget", MOCAP, "--target", "bodies/large.bvh", "-o", "out", *COPY)
    assert bench(*arguments)[0] == 0
    first = results()
    _, out, _ = bench(*arguments)
    assert out == "0 retargeted, 2 up to date, 0 failed; nothing to look at\n"
    assert results() == first

    changed = bvh.parse("mocap/bow.bvh")
    Path("mocap/bow.bvh").write_text(Path("mocap/back.bvh").read_text())
    assert bench(*arguments)[1].endswith("1 retargeted, 1 up to date, 0 failed; nothing to look at\n")
    second = results()
    assert second["back.bvh"] == first["back.bvh"]
    assert second["bow.bvh"] != first["bow.bvh"]
    assert not np.array_equal(bvh.parse("out/bow.bvh").values, changed.values)

    Path("out/back.bvh").unlink()
    assert "1 retargeted, 1 up to date" in bench(*arguments)[1]
    for again in (("--fps", 15), ("--seed", 1)):
        assert "2 retargeted, 0 up to date" in bench(*arguments, *again)[1]
        assert "0 retargeted, 2 up to date" in bench(*arguments, *again)[1]
    assert "2 retargeted" in bench(*arguments, *again, "--overwrite")[1]
    Path("reading.toml").write_text('unit = "cm"\n')
    for brackets in ("unit=cm", "up=y", "unit=cm,up=y", "reading=reading.toml"):
        arguments = ("retarget", MOCAP, "--target", f"bodies/large.bvh[{brackets}]", "-o", "out", *COPY)
        assert "2 retargeted, 0 up to date" in bench(*arguments)[1]
        assert "0 retargeted, 2 up to date" in bench(*arguments)[1]
    Path("reading.toml").write_text('unit = "m"\n')
    assert "2 retargeted" in bench(*arguments)[1]
    Path("reading.toml").write_text('# the same once more\nunit = "m"\n')
    assert "0 retargeted, 2 up to date" in bench(*arguments)[1]
    assert "2 retargeted" in bench(*arguments[:-2], "-m", "ik")[1]


def test_a_bad_file_costs_its_own_line_and_the_exit_code(bench, folders):
    Path("mocap/aaa.bvh").write_text("HIERARCHY\nROOT Hips\n{\n")
    code, out, err = bench(
        "retarget", MOCAP, "--target", "bodies/large.bvh", "-o", "out", "--report", "report.json", *COPY
    )
    assert code == 2
    assert results().keys() == {"back.bvh", "bow.bvh"}
    assert "2 retargeted, 0 up to date, 1 failed" in out
    assert "3 of 3 files tried" in err
    (message,) = [line for line in err.splitlines() if "was not made" in line]
    assert message.startswith("bench: out/aaa.bvh was not made: mocap/aaa.bvh:")
    entries = json.loads(Path("report.json").read_text())["results"]
    assert [each["status"] for each in entries] == ["failed", "done", "done"]
    assert entries[0]["error"].startswith("mocap/aaa.bvh:")
    assert (entries[1]["verdict"], entries[1]["frames"], entries[1]["places"]) == (
        "nothing to look at",
        10,
        [],
    )


def test_a_run_that_was_interrupted_goes_on(bench, folders, monkeypatch):
    def interrupted(function, payloads, jobs):
        for number, answer in enumerate(carried_out_here(function, payloads, jobs)):
            if number == 1:
                raise KeyboardInterrupt
            yield answer

    arguments = ("retarget", MOCAP, "--target", "bodies/large.bvh", "-o", "out", *COPY)
    monkeypatch.setattr(batch, "carried_out", interrupted)
    assert bench(*arguments)[0] == 130
    with Path("out", batch.RECORDS).open("a") as file:
        file.write('{"result": "bow.bvh", "ke')  # cut off while it was written
    left = Path("out/.0123456789ab.bow.bvh")
    left.write_text("half")
    other = Path("out/.0123456789ab.notes.txt")
    other.write_text("whose?")
    monkeypatch.setattr(batch, "carried_out", carried_out_here)
    assert "1 retargeted, 1 up to date" in bench(*arguments)[1]
    assert not left.exists()
    assert other.exists()
    assert len(Path("out", batch.RECORDS).read_text().splitlines()) == 2


def test_names_that_meet_are_kept_apart_by_their_folders(bench, folders):
    Path("more").mkdir()
    Path("more/bow.bvh").write_text(Path("mocap/bow.bvh").read_text())
    arguments = (
        "retarget",
        MOCAP,
        "more[unit=m]",
        "--target",
        "bodies/large.bvh",
        "-o",
        "out",
        "--quiet",
        *COPY,
    )
    assert bench(*arguments)[0] == 0
    assert results().keys() == {"back.bvh", "mocap-bow.bvh", "more-bow.bvh"}


def test_takes_of_files_in_folders_are_results_of_their_own(bench, folders):
    Path("rigs").mkdir()
    figure = person(np.random.default_rng(0), frames=4)
    figure.animate("nod", {(3, "rotation"): ([0.0, 1.0], [[0, 0, 0, 1], [0, 1, 0, 0]])})
    figure.save(Path("rigs/anna.glb"))
    arguments = ("--target", "bodies/large.bvh", "--quiet", "-m", "copy_rotations")
    assert bench("retarget", "rigs", *arguments, "-o", "out")[0] == 0
    assert results().keys() == {"anna-act.bvh", "anna-nod.bvh"}
    assert bench("retarget", "rigs[take=nod]", *arguments, "-o", "one")[0] == 0
    assert results("one").keys() == {"anna.bvh"}
    assert len(bvh.parse("one/anna.bvh").values) == len(bvh.parse("out/anna-nod.bvh").values)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ("mocap --target bodies -o out.bvh", "out.bvh: several results go into a folder"),
        ("mocap --target bodies -o mocap", "mocap holds the sources; choose another folder"),
        ("mocap --target bodies -o out --format fbx2", "--format fbx2: results are written as bvh, glb"),
        ("mocap/bow.bvh --target bodies/large.bvh -o a.bvh --format bvh", "is for results in a folder"),
        ("mocap --target bodies -o out --preview all.mp4", "a preview each, beside them; say what it is"),
        ("mocap/bow.bvh --target bodies/large.bvh -o a.bvh --preview a.txt", "clips are .mp4"),
        ("mocap/bow.bvh[unit=m --target bodies/large.bvh -o a.bvh", "expected ',' or ']' at character 8"),
        (
            "mocap/bow.bvh[uint=m] --target bodies/large.bvh -o a.bvh",
            "mocap/bow.bvh: 'uint' is nothing that",
        ),
        ("mocap --target bodies/large.bvh[take=x] -o out", "leave out take='x'"),
        ("mocap none --target bodies/large.bvh -o out --format bvh", "none: has no motion files"),
        ("mocap mocap --target bodies/large.bvh -o out", "would give results of one name"),
        ("mocap --target missing.bvh -o out", "missing.bvh: cannot be read"),
        ("none --target bodies/large.bvh -o a.bvh", "has no frames of a scan"),
        ("bodies/person.glb#1[take=2] --target bodies/large.bvh -o a.bvh", "give one of them"),
        ("mocap --target bodies/large.bvh -o out -m nobody", "nobody"),
    ],
)
def test_what_cannot_be_is_a_sentence(bench, folders, arguments, message):
    Path("none").mkdir()
    before = results(".")
    code, _, err = bench("retarget", *arguments.split())
    assert code == 2
    assert message in err
    assert "Traceback" not in err
    assert results(".") == before


def test_a_folder_that_another_run_writes_into_is_left_alone(bench, folders):
    from filelock import FileLock

    Path("out").mkdir()
    with FileLock("out/.lock"):
        code, _, err = bench("retarget", MOCAP, "--target", "bodies/large.bvh", "-o", "out", *COPY)
    assert code == 2
    assert "another bench retarget is writing into this folder" in err


def test_previews_show_source_and_result(bench, folders):
    arguments = ("retarget", BOW, "--target", "bodies/person.glb", *COPY)
    code, out, err = bench(*arguments, "-o", "a.glb", "--preview", "look.png")
    assert code == 0, err
    assert "look.png: source and result side by side" in out
    assert Image.open("look.png").size[0] > 500
    result = bench(*arguments, "-o", "a.glb", "--preview", "gif", "--fps", 15, "--quiet")
    assert result == (0, "", ""), result[2]
    clip = Image.open("a.preview.gif")
    assert clip.n_frames == 10
    Path("out").mkdir()
    assert bench(*arguments, "-o", "out", "--preview", "png")[0] == 0
    assert results().keys() == {"bow.glb", "bow.preview.png"}
    Path("out/bow.preview.png").unlink()
    assert "1 retargeted" in bench(*arguments, "-o", "out", "--preview", "png")[1]


def test_a_damaged_result_is_made_anew(bench, folders):
    arguments = ("retarget", MOCAP, "--target", "bodies/large.bvh", "-o", "out", *COPY)
    assert bench(*arguments)[0] == 0
    contents = {path: path.read_bytes() for path in Path("out").glob("*.bvh")}
    Path("out/bow.bvh").write_text("GARBAGE")
    code, out, _ = bench(*arguments)
    assert code == 0
    assert "1 retargeted, 1 up to date" in out
    assert {path: path.read_bytes() for path in Path("out").glob("*.bvh")} == contents


@pytest.mark.parametrize(
    ("option", "path", "what"),
    [
        ("--report", "mocap/bow.bvh", "a source"),
        ("--report", "bodies/large.bvh", "a target"),
        ("--report", "out.bvh", "a result"),
        ("--preview", "roles.png", "which --report writes"),
    ],
)
def test_nothing_beside_a_result_takes_the_place_of_another_file(bench, folders, option, path, what):
    before = {each: each.read_bytes() for each in Path().rglob("*.bvh")}
    more = ("--report", "roles.png") if option == "--preview" else ()
    arguments = (BOW, "--target", "bodies/large.bvh", "-o", "out.bvh", *COPY, option, path, *more)
    code, _, err = bench("retarget", *arguments)
    assert code == 2
    assert f"would overwrite {path}, {what}" in err
    assert {each: each.read_bytes() for each in Path().rglob("*.bvh")} == before


def test_a_report_takes_the_place_of_reports_alone(bench, folders):
    line = ("retarget", BOW, "--target", "bodies/large.bvh", "-o", "out.bvh", *COPY)
    Path("notes.json").write_text('{"mine": true}')
    code, _, err = bench(*line, "--report", "notes.json")
    assert code == 2
    assert "notes.json, which is no report" in err
    assert Path("notes.json").read_text() == '{"mine": true}'
    assert not Path("out.bvh").exists()
    assert bench(*line, "--report", "notes.json", "--overwrite")[0] == 0
    first = Path("notes.json").read_text()
    assert bench(*line, "--report", "notes.json")[0] == 0
    assert Path("notes.json").read_text() == first


@pytest.mark.parametrize("option", ["-o", "--report", "--preview"])
@pytest.mark.parametrize("place", ["mocap/bow.bvh/x", "/proc/no/x", "folder", "n" * 300])
def test_what_cannot_be_written_is_said_before_any_work(bench, folders, monkeypatch, option, place):
    ending = {"-o": ".bvh", "--report": ".json", "--preview": ".png"}[option]
    Path(f"folder{ending}").mkdir()
    monkeypatch.setattr(retarget, "retarget", lambda *_: pytest.fail("work was begun"))
    options = {"-o": "out.bvh"} | {option: f"{place}{ending}"}
    words = [word for pair in options.items() for word in pair]
    code, _, err = bench("retarget", BOW, "--target", "bodies/large.bvh", *COPY, *words)
    assert code == 2
    messages = [line for line in err.splitlines() if f"{place}{ending}" in line]
    if place == "folder" and option != "-o":  # the parser of options tells a folder from a file
        messages = messages or [line for line in err.splitlines() if "is a directory" in line]
    assert len(messages) == 1
    assert not Path("out.bvh").exists()
    assert not list(Path().glob(".*")), "nothing is left behind"


def test_one_result_goes_into_a_folder_that_is_named_as_one(bench, folders):
    arguments = ("retarget", BOW, "--target", "bodies/large.bvh", *COPY, "-o")
    code, _, err = bench(*arguments, "d11/")
    assert code == 0, err
    assert importer.load("d11/bow.bvh").findings.frames == 20
    assert "1 up to date" in bench(*arguments, "d11/")[1]
    code, _, err = bench(*arguments, "d12")
    assert code == 2
    assert "give it a name that ends in" in err


def test_results_without_an_all_clear_are_counted(bench, tmp_path):
    """Joints of names that say nothing: their roles are a guess."""
    walk = gait(body(), 30)
    Path("mocap").mkdir()
    bvh.write(Path("mocap/walk.bvh"), walk, scale=100)
    bvh.write(Path("me.bvh"), walk, scale=100)
    text = Path("mocap/walk.bvh").read_text()
    for number, name in enumerate(walk.skeleton.names):
        text = re.sub(rf"\b{name}\n", f"b{number:02d}\n", text)
    Path("mocap/odd.bvh").write_text(text)
    code, out, err = bench("retarget", "mocap", "--target", "me.bvh", "-o", "out", "--report", "r.json")
    assert code == 0, err
    assert len(re.findall(r"\nlook at all of it: \d+ roles of odd are a guess", out)) == 1
    assert "0 failed; all to look at in 1 of 2 results" in out
    doubts = [each["doubts"] for each in json.loads(Path("r.json").read_text())["results"]]
    assert sorted(map(len, doubts)) == [0, 1]
    again = bench("retarget", "mocap", "--target", "me.bvh", "-o", "out")[1]
    assert again == "0 retargeted, 2 up to date, 0 failed; all to look at in 1 of 2 results\n"


def test_a_job_that_no_process_answers_costs_its_own_line(bench, folders, monkeypatch):
    def died(function, payloads, jobs):
        for answer in carried_out_here(function, payloads, jobs):
            yield answer if answer.number else Done(0, error="the worker process died")

    monkeypatch.setattr(batch, "carried_out", died)
    code, out, err = bench("retarget", MOCAP, "--target", "bodies/large.bvh", "-o", "out", *COPY)
    assert code == 2
    assert "out/back.bvh was not made: the worker process died" in err
    assert "1 retargeted, 0 up to date, 1 failed" in out
