"""Damaged files of binary formats, read in a process with limits: a sentence each, or a motion."""

from __future__ import annotations

import pytest
from mutated_files import CRASH, FINE, HANG, TRACEBACK, Reader, count

FEW, MANY = 80, 20_000


@pytest.mark.parametrize("name", ["FBX", "glTF"])
def test_damaged_files_are_read_or_refused_in_a_sentence(name):
    if name == "FBX":
        pytest.importorskip("ufbx")
    found = count(name, FEW, seed=1)
    assert {kind for kind in found if found[kind]} == set(FINE)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["FBX", "glTF"])
def test_many_damaged_files(name):
    found = count(name, MANY, seed=2)
    assert {kind for kind in found if found[kind]} == set(FINE)


def test_tracebacks_crashes_and_hangs_are_noticed(tmp_path, monkeypatch):
    faults = tmp_path / "faults.py"
    faults.write_text(
        "import os, time\n"
        "def fail(path): raise KeyError('lost')\n"
        "def crash(path): os.kill(os.getpid(), 9)\n"
        "def hang(path): time.sleep(60)\n"
    )
    monkeypatch.syspath_prepend(str(tmp_path))
    import faults as module

    for does, kind in ((module.fail, TRACEBACK), (module.crash, CRASH), (module.hang, HANG)):
        if kind == HANG:
            monkeypatch.setattr("mutated_files.HANGS", 1.0)
        reader = Reader(load=does)
        assert reader.read(tmp_path / "any")[0] == kind
        reader.close()
