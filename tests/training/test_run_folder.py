"""Checkpoints are whole at any moment, and folders that somebody has edited are told in a sentence."""

from __future__ import annotations

import errno
import json
from dataclasses import replace
from pathlib import Path

import pytest
import torch

from retarget_bench.errors import BenchError, FileError
from retarget_bench.training import log, run_folder
from retarget_bench.training.config import TrainingConfig
from retarget_bench.training.record import Run, Validation

RECIPE = TrainingConfig(steps=40, batch=1, window=1, rate=0.1)
BEGUN = Run(method="mine", version="1", facts={"wide": True}, recipe=RECIPE, dataset="walks[root=/here]")


def saved(folder: Path, step: int) -> Run:
    """A run whose checkpoint is of this step."""
    weight = torch.full((3, 2), float(step))
    tensors = {"modules/w": weight, "modules/tied": weight, "best/w": weight.to(torch.bfloat16)}
    history = [Validation(step, 1.0, {"self": {"e": 10.0 / step, "n": 3}})]
    run = replace(BEGUN, steps=step, step=step, seconds=1.5 * step, validation=history)
    return run_folder.save(folder, run, tensors)


def numbers(folder: Path) -> list[float]:
    """The step of the record that is there, and what its tensors hold."""
    run = run_folder.read(folder)
    return [run.steps, *(float(each.mean()) for each in run_folder.tensors(folder, run).values())]


def files(folder: Path) -> set[str]:
    return {path.name for path in folder.iterdir()}


def test_what_is_read_is_what_was_written(tmp_path):
    assert run_folder.read(tmp_path) is None
    run_folder.write(tmp_path, BEGUN)
    assert replace(run_folder.read(tmp_path), curve=(), validation=(), notes=(), plugin_files=()) == BEGUN
    assert run_folder.tensors(tmp_path, BEGUN) == {}
    written = saved(tmp_path, 7)
    read = run_folder.read(tmp_path)
    assert (read.best, read.seconds, read.hash) == (written.best, 10.5, written.hash)
    assert numbers(tmp_path) == [7] * 4


def test_nothing_of_this_machine_s_places_is_on_a_card():
    assert "/here" not in repr(BEGUN.record)


def test_older_tensors_go(tmp_path):
    for step in (10, 20):
        saved(tmp_path, step)
        assert files(tmp_path) == {f"step-{step}.safetensors", run_folder.NAME}


@pytest.mark.parametrize("dies_at", [1, 2])
def test_a_process_that_dies_while_writing_leaves_the_one_before(tmp_path, monkeypatch, dies_at):
    """The n-th rename (tensors, record) does not happen any more."""
    saved(tmp_path, 10)
    rename, calls = Path.replace, []

    def dying(self, target):
        calls.append(target)
        if len(calls) == dies_at:
            raise SystemExit
        return rename(self, target)

    monkeypatch.setattr(Path, "replace", dying)
    with pytest.raises(SystemExit):
        saved(tmp_path, 20)
    monkeypatch.undo()
    assert numbers(tmp_path) == [10] * 4
    saved(tmp_path, 30)
    assert files(tmp_path) == {"step-30.safetensors", run_folder.NAME}


def test_a_full_disk_is_one_sentence_and_keeps_the_one_before(tmp_path, monkeypatch):
    saved(tmp_path, 10)

    def full(self, data):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(Path, "write_bytes", full)
    with pytest.raises(
        FileError, match=r"step-20.safetensors: cannot be written \(No space left on device\)"
    ):
        saved(tmp_path, 20)
    monkeypatch.undo()
    assert numbers(tmp_path) == [10] * 4
    assert files(tmp_path) == {"step-10.safetensors", run_folder.NAME}


# ------------------------------------------------------------------------------------------- edited folders
@pytest.fixture
def cut(toy_run, tmp_path):
    """The folder of a run that was interrupted, and going on with it."""
    toy_run(stop=20)
    return tmp_path / "run", lambda: toy_run(resume=True)


NO_RUN = "is not the record of a training run"


def changed(path, change, lost=""):
    """The JSON file with other facts, and without one."""
    facts = json.loads(path.read_text()) | change
    facts.pop(lost, None)
    path.write_text(json.dumps(facts))


@pytest.mark.parametrize("lost", ["dataset", "recipe", "facts", "schema"])
def test_a_record_that_lacks_something(cut, lost):
    folder, go_on = cut
    changed(folder / run_folder.NAME, {}, lost)
    with pytest.raises(FileError, match=rf"{NO_RUN} .*(no )?{lost}"):
        go_on()


@pytest.mark.parametrize(
    ("odd", "words"),
    [
        ({"steps": "many"}, NO_RUN),
        ({"steps": 16}, r"step-16.safetensors: cannot be read"),
        ({"hash": ""}, r"step-15.safetensors: is not what run.json describes"),
        ({"validation": 3}, NO_RUN),
        ({"validation": [3]}, NO_RUN),
        ({"seed": "0"}, NO_RUN),
        ({"seed": 1.5}, NO_RUN),
        ({"seed": True}, NO_RUN),
        ({"method": 3}, NO_RUN),
        ({"facts": []}, NO_RUN),
        ({"recipe": None}, NO_RUN),
        ({"recipe": {"steps": 30, "batch": 0, "window": 8, "rate": 0.1}}, f"{NO_RUN} .*below zero"),
        ({"steps": -15}, f"{NO_RUN} .*below zero"),
        ({"method": "other"}, f"{NO_RUN} .*of other and of toy_trainee"),
        ({"schema": 99}, "has schema 99"),
        ({"budget": "soon"}, "'soon' is no budget"),
    ],
)
def test_something_else_in_a_record(cut, odd, words):
    folder, go_on = cut
    changed(folder / run_folder.NAME, odd)
    with pytest.raises(BenchError, match=words):
        go_on()


@pytest.mark.parametrize("text", ["null", "3", "[1]", '"run"', "{}", '{"schema": 1'])
def test_a_record_that_is_none(cut, text):
    folder, go_on = cut
    (folder / run_folder.NAME).write_text(text)
    with pytest.raises(FileError, match=rf"run.json: {NO_RUN}"):
        go_on()


def test_tensors_that_are_damaged_are_not_trained_on(cut):
    folder, go_on = cut
    path = folder / "step-15.safetensors"
    data = bytearray(path.read_bytes())
    data[-1] ^= 1
    path.write_bytes(data)
    with pytest.raises(FileError, match=r"step-15.safetensors: is not what run.json describes"):
        go_on()


@pytest.mark.parametrize(
    "data",
    [
        b"\xff\xfe\x00\n\x80\n",
        b"rubbish\nmore\n",
        b"step,seconds,rate\nten,1,1\n",
        b"step,seconds,rate\n10\n",
        b"step,seconds,rate\n10,1,1,7,8\n",
        b"step,seconds,rate,a.x\n10,1,1,much\n",
        b"step,a.x\n10,1\n",
    ],
)
def test_a_log_that_is_none(cut, data):
    folder, go_on = cut
    (folder / log.NAME).write_bytes(data)
    with pytest.raises(FileError, match=r"log.csv: is not the log of a training run"):
        go_on()


def test_without_its_log_a_run_begins_a_new_one(cut):
    folder, go_on = cut
    (folder / log.NAME).unlink()
    go_on()
    assert [row["step"] for row in log.read(folder)] == ["20", "30", "40"]
