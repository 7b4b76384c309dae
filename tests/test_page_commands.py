"""The ``bench`` commands of README and docs: each is one that click takes, and runs as it is printed."""

from __future__ import annotations

import os
import re
import shlex
import shutil
from collections.abc import Iterator
from pathlib import Path

import click
import numpy as np
import pytest

import retarget_bench as rb
from retarget_bench import cli
from retarget_bench.motion.scans.writing import write_frames
from retarget_bench.plugins import registry
from retarget_bench.viewer import live
from tests.in_process import without_processes
from tests.motion import smpl_files
from tests.motion.tubes import fleshed, hand_to_belly

ROOT = Path(__file__).parents[1]
PAGES = [
    path
    for pattern in ("README.md", "CONTRIBUTING.md", "ARCHITECTURE.md", "docs/*.md", "docs/tutorials/*.md")
    for path in sorted(ROOT.glob(pattern))
    if path.name != "protocols.md"
]
ONLY_PARSED = {
    "data or weights that are not here": r"mixamo|lafan_dog|cmu|R2ET|PATH|\[weights=pan\]",
    "hours of training": r"^bench (train|ablate) (?!learned_pose|--resume -o \S+$)",
    "hours of making data": r"size=(default|large|kinds)",
    "other machines, programs or environments": r"--executor|^bench work|docker|uv run|@|\./answer",
    "it would replace the golden rows of this package": r"^bench check --accept",
    "a placeholder": r"^bench (submit|score) DIR|\bFILE\b",
    "a card that its author has filled in": r"--board",
}
"""Why commands are not run -> what they have in them."""
STAND_IN = {"METHOD": "correspondence_free", "METRIC": "position", "NAME": "ik"}
"""For words that pages leave to the reader."""
ANSWERS = {"check", "doctor", "submit", "test"}
"""Commands whose exit status 1 is an answer."""


def blocks_of(page: Path) -> list[str]:
    """The ``bench`` commands of a page's blocks, without what stands about them behind three blanks.

    Those in fences of tutorials are left to ``test_tutorials.py``.
    """
    text = page.read_text(encoding="utf-8").replace("\\\n", " ")
    fence = "" if page.parent.name == "tutorials" else "|```sh\n"
    commands = re.findall(rf"^(?: {{4}}{fence}| *- run: )(?:parallel )?(bench [^\n]+)", text, re.MULTILINE)
    return [re.split(r" {3,}", line)[0].replace("{} -j 1 ::: $(seq 0 41)", "0") for line in commands]


def mentions_of(page: Path) -> list[str]:
    """The ``bench`` commands within a page's sentences, whose arguments may be left out."""
    commands = re.findall(r"`(bench [a-z][^`]+)`", page.read_text(encoding="utf-8"))
    return [" ".join(line.split()).partition(" > ")[0] for line in commands]


def command_of(words: list[str]) -> click.Command:
    command = cli.LazyGroup("bench").get_command(click.Context(cli.group), words[1])
    assert command is not None, f"there is no bench {words[1]}"
    return command


@pytest.fixture
def _files(tmp_path, monkeypatch):
    """What click looks at in an empty folder."""
    monkeypatch.chdir(tmp_path)
    for plan in ("3f9c2a71d04e", "ID"):
        Path("runs", ".shards", plan).mkdir(parents=True)
    Path("cases").mkdir()
    for name in ("odd", "walk"):
        Path(f"{name}.toml").touch()


@pytest.mark.usefixtures("_files")
@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_click_takes_every_command_that_a_page_shows(page):
    for line in blocks_of(page):
        words = shlex.split(line, comments=True)
        command_of(words).make_context(
            line, words[2:]
        )  # raises click's error of words that it does not take


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_commands_within_sentences_have_these_options(page):
    for line in mentions_of(page):
        words = shlex.split(line)
        flags = {flag for each in command_of(words).params for flag in (*each.opts, *each.secondary_opts)}
        options = {word.partition("=")[0].rstrip(",") for word in words[2:] if word.startswith("-")}
        assert options <= flags, line


def test_every_command_is_shown_in_a_block_of_some_page():
    assert {line.split()[1] for page in PAGES for line in blocks_of(page)} == set(cli.COMMANDS)


def test_plug_ins_on_pages_take_the_parameters_that_stand_there():
    text = "".join(page.read_text(encoding="utf-8") for page in PAGES)
    specs = set(re.findall(r"\b[a-z_0-9]+\[[a-z_]+=[^\]\n|]*\]", text)) - {"mixamo[protocol=folds,fold=K]"}
    entries = [entry for kind in ("methods", "datasets", "posts") for entry in registry.names(kind)]
    kinds = {entry.name: entry.kind for entry in entries}
    plug_ins = [(kinds[name], spec) for spec in specs if (name := spec.partition("[")[0]) in kinds]
    assert len(plug_ins) > 30
    for kind, spec in plug_ins:
        registry.canonical(kind, spec)  # raises what is wrong with a name or value


# ------------------------------------------------------------------------------------------ as printed
def complete(line: str) -> bool:
    """True for a command within a sentence that lacks no argument."""
    words = shlex.split(line)
    command = command_of(words)
    try:
        command.make_context(line, words[2:])
    except (click.ClickException, rb.BenchError):
        return False
    return len(words) > 2


def printed(page: Path) -> list[str]:
    """The commands of a page that can be run here, each once."""
    lines = [*blocks_of(page), *filter(complete, mentions_of(page))]
    filled = [re.sub("|".join(STAND_IN), lambda word: STAND_IN[word[0]], line) for line in lines]
    return [
        line
        for line in dict.fromkeys(filled)
        if not any(re.search(what, line) for what in ONLY_PARSED.values())
    ]


def exit_status(words: list[str]) -> int:
    """Of a command in this process that knows no plug-in files of earlier ones."""
    registry._FILES.clear()
    with pytest.raises(SystemExit) as stop:
        cli.main(words)
    return int(stop.value.code or 0)


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Iterator[Path]:
    """A folder with stand-ins for all that pages name, and whole results in ``runs/``; no processes."""
    before, reader = Path.cwd(), tmp_path_factory.mktemp("reader")
    with without_processes(), pytest.MonkeyPatch.context() as patch:
        patch.setattr(registry, "_FILES", {})
        patch.setattr(live.Window, "serve_forever", lambda window: None)
        patch.setenv("GITHUB_STEP_SUMMARY", str(reader / "summary.md"))
        os.chdir(reader)
        Path("results").symlink_to(ROOT / "results")
        _make_plug_ins()
        _make_results()
        _make_motions()
        _make_scans()
        yield reader
        os.chdir(before)


def _make_plug_ins() -> None:
    for kind, name in (("method", "my_method"), ("post", "my_post"), ("metric", "my_metric")):
        assert exit_status(["new", kind, name]) == 0
    assert exit_status(["new", "dataset", "my_data"]) == 0
    assert exit_status(["check", "-m", "my_method.py", "-r", "golden", "--accept", "first rows"]) == 0
    shutil.copy(ROOT / "docs" / "examples" / "learned_pose.py", "learned_pose.py")


def _make_results() -> None:
    methods = ("copy_rotations", "ik", "pan", "nkn", "nkn+footlock", "my_method.py", "reference")
    assert exit_status(["run", *methods, "--metrics", "default,my_metric.py"]) == 0
    for task in ("denoise", "joint-completion"):
        assert exit_status(["run", "--task", task, "--limit", "1"]) == 0
    assert exit_status(["run", "ik", "-o", "other/runs", "--limit", "1"]) == 0
    assert exit_status(["train", "nkn", "-d", "puppets", "--preset", "quick", "--budget", "2it"]) == 0


def _make_motions() -> None:
    results = rb.load_results("runs")
    source = results.motion("boris>clara/leap", "source")
    body = results.motion("boris>clara/leap", "reference").at(slice(1))
    for name in ("walk", "run", "dance", "take", "odd", "mocap/a", "mocap/b", "my_motions/a"):
        Path(name).parent.mkdir(exist_ok=True)
        source.save(f"{name}.bvh")
    source.save("jump.glb")
    for name in ("me", "my_character", "retargeted", "characters/a"):
        Path(name).parent.mkdir(exist_ok=True)
        body.save(f"{name}.bvh")
    for name in ("me", "boris", "character"):
        body.save(f"{name}.glb")
    random = np.random.default_rng(0)
    smpl_files.archive(Path("walk_poses.npz"), smpl_files.parameters(random))
    smpl_files.archive(Path("models/SMPLH_FEMALE.npz"), smpl_files.model(random))


def _make_scans() -> None:
    trimesh = pytest.importorskip("trimesh")
    person = fleshed()
    moved = person.mesh.skinned(hand_to_belly(person, 4))
    for name in ("scan_sequence", "scans"):
        write_frames(Path(name), moved, person.mesh.faces)
    body = trimesh.Trimesh(person.mesh.vertices, person.mesh.faces, process=False)
    body.export("body.obj")
    body.export("body.glb")
    lying = 1000.0 * moved[0] @ np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]])  # millimetres, Z up
    trimesh.Trimesh(lying, person.mesh.faces, process=False).export("points.ply")


def ran(line: str, tmp_path: Path) -> int:
    """The exit status of a printed command. A run is of one clip, in a folder of its own; a plug-in is
    started, and retargeted files are written, where nothing is yet."""
    words = shlex.split(os.path.expandvars(line), comments=True)[1:]
    if words[0] == "run":
        words += () if {"--limit", "--clips"} & set(words) else ("--limit", "1")
        words += () if {"-o", "score"} & set(words) else ("-o", "short")
    for name in ("out", "result"):
        shutil.rmtree(name, ignore_errors=True)
    if words[0] == "score":  # answers of a program of the reader's
        for answer in Path("runs/puppets/retarget/cross/ik").glob("*.npz"):
            shutil.copy(answer, words[1])
        words += ["-o", "short"]
    if words[0] == "new":
        os.chdir(tmp_path)
    return exit_status(words)


@pytest.mark.slow
@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_every_command_of_a_page_runs_as_printed(page, folder, tmp_path, capsys):
    failed = []
    for number, line in enumerate(printed(page)):
        own = tmp_path / str(number)
        own.mkdir()
        status = ran(line, own)
        captured = capsys.readouterr()
        os.chdir(folder)
        if status > (line.split()[1] in ANSWERS):
            failed.append(f"{line}\n    exit {status}: {captured.err.strip() or captured.out.strip()}")
    assert not failed, "\n".join(failed)
