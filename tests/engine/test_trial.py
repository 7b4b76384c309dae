"""The first import of a plug-in file: what hangs or ends the process costs a sentence."""

from __future__ import annotations

import time

import pytest

from retarget_bench.errors import BenchError
from retarget_bench.plugins import named


@pytest.fixture(autouse=True)
def own_cache(tmp_path, monkeypatch):
    monkeypatch.setenv("RETARGET_BENCH_CACHE", str(tmp_path / "cache"))


@pytest.mark.parametrize(
    ("code", "message"),
    [
        ("import os\nos._exit(3)\n", r"ends the process that does \(exit code 3\); nothing was run"),
        ("import os\nos.kill(os.getpid(), 9)\n", r"exit code -9"),
        ("import os\nos._exit(0)\n", r"exit code 0"),
    ],
)
def test_code_that_ends_the_process_is_a_sentence(tmp_path, code, message):
    (tmp_path / "bad.py").write_text(code)
    with pytest.raises(BenchError, match=message):
        named.try_import(tmp_path / "bad.py")


def test_code_that_hangs_is_a_sentence_and_leaves_no_process(tmp_path, monkeypatch):
    monkeypatch.setattr(named, "LONGEST", 4.0)
    (tmp_path / "bad.py").write_text(
        "import os, time\n"
        f"open({str(tmp_path / 'pid')!r}, 'w').write(str(os.getpid()))\n"
        "while True: time.sleep(1)\n"
    )
    with pytest.raises(BenchError, match="takes more than 4 s"):
        named.try_import(tmp_path / "bad.py")
    pid = int((tmp_path / "pid").read_text())
    assert not _lives(pid)


def _lives(pid: int) -> bool:
    import psutil

    for _ in range(50):
        if not psutil.pid_exists(pid) or psutil.Process(pid).status() == psutil.STATUS_ZOMBIE:
            return False
        time.sleep(0.1)
    return True


def test_what_raises_is_left_to_the_import_that_tells_it_and_files_are_tried_once(tmp_path):
    bad = tmp_path / "raises.py"
    bad.write_text(f"open({str(tmp_path / 'count')!r}, 'a').write('.')\nraise RuntimeError\n")
    named.try_import(bad)
    named.try_import(bad)
    assert (tmp_path / "count").read_text() == "."
    bad.write_text(bad.read_text() + "# another state\n1 / 0\n")
    named.try_import(bad)
    assert (tmp_path / "count").read_text() == ".."
    named.try_import(tmp_path / "none.py")  # is told by what reads it
