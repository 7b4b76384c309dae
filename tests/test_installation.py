"""``bench doctor`` without a file: what is wrong is found, and said with its cure."""

from __future__ import annotations

import shutil
import sys
import tomllib
import warnings
from importlib import metadata
from pathlib import Path
from types import SimpleNamespace

import pytest
import torch

from retarget_bench import __version__
from retarget_bench.commands import installation
from retarget_bench.plugins import registry
from retarget_bench.training import released

ROOT = Path(__file__).parents[1]


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "100")
    monkeypatch.setenv("RETARGET_BENCH_CACHE", str(tmp_path / "cache"))


@pytest.fixture
def looks(monkeypatch, bench):
    """``bench doctor`` that takes these looks alone."""

    def only(*names, **others):
        taken = {name: installation.LOOKS[name] for name in names} | others
        with monkeypatch.context() as patch:
            patch.setattr(installation, "LOOKS", taken)
            return bench("doctor")

    return only


@pytest.mark.parametrize(
    "left_out",
    [("plug-ins", "weights"), pytest.param((), marks=pytest.mark.slow)],
    ids=["without what imports every plug-in", "all"],
)
def test_an_installation_without_faults_fits_a_screen(looks, left_out):
    code, out, err = looks(*(name for name in installation.LOOKS if name not in left_out))
    assert (code, "Traceback" in err) == (0, False), out
    lines = out.splitlines()
    assert lines[-1] == "Nothing is wrong."
    assert len(lines) <= 24
    assert lines[0].split()[:2] == ["retarget-bench", f"{__version__},"]
    assert f"torch {metadata.version('torch')}" in out
    cards = len([*ROOT.glob("methods/*/weights/*.json")])
    checked = f"{cards} of {cards} shipped ones are as their cards say" in " ".join(out.split())
    assert checked or "weights" in left_out
    assert not [*Path().iterdir()], "nothing is left behind"


def test_extras_and_packages_are_those_of_the_project():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    extras = project["optional-dependencies"]
    assert installation.EXTRAS.keys() == extras.keys() - {"test", "docs", "release", "benchmark"}
    needed = installation._requirements()
    for extra in ("", *installation.EXTRAS):
        stated = extras[extra] if extra else project["dependencies"]
        assert [each.replace(" ", "") for each in needed[extra]] == [
            each.replace(" ", "") for each in stated
        ]


def test_what_is_not_installed_is_named(looks, monkeypatch):
    there = metadata.version

    def version(package):
        if package in ("scipy", "pyarrow", "ray"):
            raise metadata.PackageNotFoundError(package)
        return there(package)

    monkeypatch.setattr(metadata, "version", version)
    code, out, _ = looks("packages", "extras")
    assert code == 1
    assert "- scipy is not installed: pip install scipy" in out
    assert "store (Parquet, above 20,000 cases), ray (--executor ray)" in " ".join(out.split())


@pytest.mark.parametrize(
    ("requirement", "problem"),
    [
        ("numpy>=999", "is not numpy>=999: pip install 'numpy>=999'"),
        ("pillow>=1", ""),
        ("roma>=1", "): pip install --force-reinstall roma"),
    ],
)
def test_a_package_that_is_too_old_or_broken_is_a_problem(monkeypatch, tmp_path, requirement, problem):
    (tmp_path / "roma.py").write_text("raise ImportError('odd')")
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.delitem(sys.modules, "roma", raising=False)
    found = installation._lacking(requirement)
    assert found.endswith(problem)
    assert bool(found) == bool(problem)


def test_fetched_weights_are_told_from_those_to_fetch_and_damaged_ones(monkeypatch, tmp_path):
    there, place = Path.exists, ROOT / "methods" / "same" / "weights" / "puppets.safetensors"
    monkeypatch.setattr(Path, "exists", lambda path: path != place and there(path))
    text, problems = installation._weights()
    assert "; 1 more are fetched at their first use" in text
    assert not problems
    fetched = released.released(place)
    assert fetched is not None
    copy = fetched.copy
    copy.parent.mkdir(parents=True)
    copy.write_bytes(b"half")
    text, problems = installation._weights()
    assert problems == [f"{copy} is damaged: remove it, and its next use fetches it again"]


def test_a_package_that_lies_on_the_path_has_no_list_of_packages(looks, monkeypatch):
    def requires(package):
        raise metadata.PackageNotFoundError(package)

    monkeypatch.setattr(metadata, "requires", requires)
    code, out, _ = looks("packages", "extras")
    assert (code, out.count("not known: retarget-bench is not installed, but lies on the path")) == (0, 2)


@pytest.mark.parametrize(
    ("look", "broken", "cure"),
    [
        ("cache", "cache", "set RETARGET_BENCH_CACHE to another folder"),
        ("results", "runs", "name another folder by --out"),
    ],
)
def test_a_folder_that_cannot_be_written_is_a_problem(looks, look, broken, cure):
    assert looks(look)[0] == 0
    Path(broken).touch()
    code, out, _ = looks(look)
    assert code == 1
    assert "not writable" in out
    assert "cannot be written (Not a directory)" in " ".join(out.split())
    assert cure in " ".join(out.split())


def test_the_cache_is_measured_and_a_full_disk_is_a_problem(looks, monkeypatch):
    Path("cache").mkdir()
    Path("cache", "motion").write_bytes(bytes(3_000_000))
    assert "writable, 3 MB used" in " ".join(looks("cache")[1].split())
    monkeypatch.setattr(shutil, "disk_usage", lambda path: SimpleNamespace(free=5_000_000))
    code, out, _ = looks("temporary")
    assert code == 1
    assert "has 5 MB of room left; make room, or set TMPDIR to another folder" in " ".join(out.split())


def test_weights_that_are_damaged_are_a_problem(looks, monkeypatch, tmp_path):
    (card,) = (ROOT / "methods" / "skin" / "weights").glob("*.json")
    for file in (card, card.with_suffix(".safetensors")):
        shutil.copy(file, tmp_path)
    copied = tmp_path / card.name

    class Method:
        @classmethod
        def shipped(cls):
            return {"puppets": copied}

    monkeypatch.setattr(registry, "working", lambda kind: ({"m": Method()}, []))
    assert looks("weights")[0] == 0
    tensors = copied.with_suffix(".safetensors")
    content = bytearray(tensors.read_bytes())
    content[-1] ^= 1
    tensors.write_bytes(content)
    code, out, _ = looks("weights")
    assert code == 1
    assert "0 of 1 shipped ones" in out
    assert f"is not what {card.name} describes" in " ".join(out.split())


def test_plug_ins_that_do_not_work_are_a_problem(looks, monkeypatch):
    monkeypatch.setattr(registry, "working", lambda kind: ({}, ["method odd could not be imported"]))
    code, out, _ = looks("plug-ins")
    assert code == 1
    assert "- method odd could not be imported; mend or uninstall it, or what it needs" in out


def test_a_look_that_breaks_is_a_problem_and_the_others_are_there(looks):
    def breaks():
        raise ImportError("libgomp is missing")

    code, out, _ = looks("Python", GPU=breaks)
    assert code == 1
    assert out.startswith("Python  ")
    assert "- GPU: ImportError: libgomp is missing" in out


def test_processes_are_started_in_earnest(looks, monkeypatch):
    assert looks("processes")[0] == 0
    monkeypatch.setattr("sys.executable", "/no/python")
    code, out, _ = looks("processes")
    assert code == 1
    assert "processes of methods cannot be started: FileNotFoundError" in " ".join(out.split())


def test_a_bubblewrap_that_cannot_start_is_told_and_no_problem(looks, monkeypatch, tmp_path):
    program = tmp_path / "bwrap"
    program.write_text("#!/bin/sh\necho no permissions >&2\nexit 1\n")
    program.chmod(0o755)
    monkeypatch.setenv("PATH", f"{tmp_path}:/usr/bin:/bin")
    code, out, _ = looks("processes")
    assert code == 0
    assert "bwrap (--isolate): does not start (no permissions)" in " ".join(out.split())


def test_threads_and_processes_that_fight_are_told(looks, monkeypatch):
    monkeypatch.setattr(torch, "get_num_threads", lambda: 999)
    monkeypatch.setattr(Path, "read_text", lambda path, **_: "50000 100000\n")
    said = " ".join(looks("threads")[1].split())
    assert "threads beyond the cores wait for each other" in said
    assert "this container may use 0.5 cores: give --jobs 1" in said
    monkeypatch.setattr(Path, "read_text", lambda path, **_: "max 100000\n")
    assert "container" not in looks("threads")[1]


# --------------------------------------------------------------------------------------------------- GPU
def graphics(monkeypatch, **functions):
    for name, value in functions.items():
        monkeypatch.setattr(torch.cuda, name, value)


def test_no_gpu_is_no_problem_and_one_that_torch_does_not_see_is(looks, monkeypatch):
    graphics(monkeypatch, is_available=lambda: False)
    monkeypatch.setattr(torch.version, "cuda", "12.8")
    monkeypatch.setattr(Path, "glob", lambda path, pattern: iter(()))
    code, out, _ = looks("GPU")
    assert (code, "none that torch sees, which is built for CUDA 12.8" in out) == (0, True)
    monkeypatch.setattr(Path, "glob", lambda path, pattern: iter([Path("/dev/nvidia0")]))
    monkeypatch.setattr(torch.version, "cuda", None)
    code, out, _ = looks("GPU")
    assert code == 1
    assert "a GPU is there; torch, built for CPUs alone, does not see it" in " ".join(out.split())


def test_a_driver_that_is_too_old_is_told_in_torchs_words(looks, monkeypatch):
    def warns():
        warnings.warn("The NVIDIA driver on your system is too old", stacklevel=1)
        return False

    graphics(monkeypatch, is_available=warns)
    code, out, err = looks("GPU")
    assert (code, err) == (1, "")
    assert "- The NVIDIA driver on your system is too old" in out


def test_a_gpu_is_named_and_has_to_compute(looks, monkeypatch):
    card = SimpleNamespace(name="H200", total_memory=141e9)
    graphics(
        monkeypatch,
        is_available=lambda: True,
        device_count=lambda: 1,
        get_device_properties=lambda number: card,
    )
    monkeypatch.setattr(torch, "ones", lambda *_, device: torch.zeros(8))
    code, out, _ = looks("GPU")
    assert (code, "H200 (141 GB)" in out) == (0, True)

    def fails(*_, device):
        raise RuntimeError("no kernel image is available")

    monkeypatch.setattr(torch, "ones", fails)
    code, out, _ = looks("GPU")
    assert code == 1
    assert "the GPU does not compute: RuntimeError: no kernel image is available" in " ".join(out.split())


def test_what_is_written_is_of_a_file(bench):
    code, _, err = bench("doctor", "--save", "reading.toml")
    assert code == 2
    assert "what is written is of one file" in err
