"""Shards as jobs of SLURM: submitit's local processes, killed and not, and arrays as a site allows them."""

from __future__ import annotations

import re
import sys
import time
from pathlib import Path

import executing
import psutil
import pytest
from executing import run

from retarget_bench.errors import BenchError
from retarget_bench.evaluation.executors import engine
from retarget_bench.evaluation.executors.local import Local
from retarget_bench.evaluation.executors.slurm_arrays import USUAL_ARRAY, array_limit

pytest.importorskip("submitit", reason="needs the extra slurm")
LOCAL = "slurm[cluster=local,shards=40]"
SLOW = ("slow_copy[seconds=0.3]",)


@pytest.fixture(autouse=True)
def _small(monkeypatch):
    executing.know_toys()
    executing.small_shards(monkeypatch)
    monkeypatch.setenv("PYTHONPATH", str(Path(__file__).parents[2]))


def test_jobs_give_the_same_bytes(tmp_path):
    assert run(tmp_path / "slurm", LOCAL) == run(tmp_path / "local")


@pytest.mark.slow
def test_killed_jobs_cost_a_sentence_and_their_own_answers(tmp_path):
    import threading

    def kill() -> None:
        while not list(tmp_path.glob("slurm/.shards/*/jobs")):
            time.sleep(0.05)
        while True:
            for each in psutil.Process().children(recursive=True):
                if "submitit.core._submit" in " ".join(each.cmdline()) and each.children():
                    each.kill()
                    return
            time.sleep(0.05)

    killer = threading.Thread(target=kill)
    killer.start()
    with pytest.raises(BenchError, match=r"shards were lost; shard 0: its job \d+ ended without a result"):
        run(tmp_path / "slurm", LOCAL, *SLOW)
    killer.join()
    assert run(tmp_path / "slurm", LOCAL, *SLOW) == run(tmp_path / "local", "local", *SLOW)


# ------------------------------------------------------------------------- a site that only takes jobs down
@pytest.fixture
def site(tmp_path, monkeypatch) -> Path:
    """A folder with commands of SLURM; the scripts that were submitted are in it as ``1.sh`` and so on."""
    folder = tmp_path / "site"
    folder.mkdir()
    submit = (
        f'n=$(ls {folder}/*.sh 2>/dev/null | wc -l); cp "$1" {folder}/$n.sh; echo "Submitted batch job 7$n"'
    )
    commands = {"sbatch": submit, "srun": "", "squeue": "", "sacct": "", "scancel": ""}
    for name, text in (commands | {"scontrol": "echo 'MaxArraySize            = 4'"}).items():
        (folder / name).write_text(f"#!/bin/sh\n{text}\n")
        (folder / name).chmod(0o755)
    monkeypatch.setenv("PATH", f"{folder}:/usr/bin:/bin")
    return folder


def test_arrays_are_as_large_as_the_site_allows(tmp_path, site):
    with engine("slurm[partition=cpu,shards=2,cpus=3,time=90,mem=4GB]", Local(1)) as arrays:
        arrays.run(tmp_path / "plan", range(13)).send(None)
    scripts = [path.read_text() for path in sorted(site.glob("*.sh"))]
    assert re.findall(r"--array=(\S+)", "".join(scripts)) == ["0-2%3", "0-2%3"]  # seven jobs of two
    for text in scripts:
        for option in ("--partition=cpu", "--cpus-per-task=3", "--time=90", "--mem=4GB"):
            assert option in text
        assert sys.executable in text


def test_an_option_that_sbatch_does_not_know_is_told(tmp_path, site):
    with (
        pytest.raises(BenchError, match=r"could not be submitted to SLURM.*partitoin"),
        engine("slurm[partitoin=cpu]", Local(1)) as arrays,
    ):
        next(arrays.run(tmp_path / "plan", range(3)))
    assert not list(site.glob("*.sh"))


def test_without_slurm_a_sentence_says_what_is_missing(monkeypatch):
    monkeypatch.setenv("PATH", "")
    assert array_limit() == USUAL_ARRAY
    with pytest.raises(BenchError, match="needs the command sbatch"):
        engine("slurm", Local(1))


@pytest.mark.parametrize(("executor", "package"), [("ray", "ray"), ("slurm", "submitit")])
def test_a_missing_extra_is_told_with_its_cure(monkeypatch, executor, package):
    monkeypatch.setattr("retarget_bench.evaluation.executors.ray_tasks.find_spec", lambda name: None)
    monkeypatch.setattr("retarget_bench.evaluation.executors.slurm_arrays.find_spec", lambda name: None)
    with pytest.raises(
        BenchError, match=rf"needs the package {package}: pip install 'retarget-bench\[{executor}"
    ):
        engine(executor, Local(1))
