"""Checkpoints are whole at any moment, and folders that somebody has edited are told in a sentence."""

from __future__ import annotations

import errno
import json
from pathlib import Path

import pytest
import torch

from retarget_bench.errors import BenchError, FileError
from retarget_bench.training import checkpoint, log, request
from retarget_bench.training.checkpoint import Best, Checkpoint


def made(step: int, best: int = 0) -> Checkpoint:
    weight = torch.full((3, 2), float(step))
    state = {"modules/w": weight, "modules/tied": weight, "optimisers/g/w/step": torch.tensor(float(step))}
    if not best:
        return Checkpoint(step, 1.5 * step, state)
    validated = Best(best, 10.0 / best, {"self": {"e": 10.0 / best, "n": 3}})
    history = ({"step": best, "seconds": 1.0, "scores": validated.scores},)
    return Checkpoint(step, 1.5 * step, state, validated, {"w": torch.full((2,), float(best))}, history)


def files(folder: Path) -> set[str]:
    return {path.name for path in folder.iterdir()}


def test_what_is_read_is_what_was_written(tmp_path):
    assert checkpoint.read(tmp_path) is None
    written = made(7, best=5)
    checkpoint.write(tmp_path, written)
    stored = checkpoint.read(tmp_path)
    assert (stored.step, stored.seconds, stored.best) == (7, 10.5, written.best)
    assert stored.validation == written.validation
    for read, expected in ((stored.state, written.state), (stored.exported, written.exported)):
        assert read.keys() == expected.keys()
        assert all(torch.equal(read[name], expected[name]) for name in read)


def test_older_tensors_go_and_the_best_stay(tmp_path):
    for step, best in ((10, 0), (20, 20), (30, 20), (40, 40)):
        checkpoint.write(tmp_path, made(step, best))
        names = {f"step-{step}.safetensors", checkpoint.NAME}
        assert files(tmp_path) == names | ({f"best-{best}.safetensors"} if best else set())
        if best:
            assert checkpoint.read(tmp_path).exported["w"][0] == best


@pytest.mark.parametrize("dies_at", [1, 2, 3])
def test_a_process_that_dies_while_writing_leaves_the_one_before(tmp_path, monkeypatch, dies_at):
    """The n-th rename (state, best, checkpoint.json) does not happen any more."""
    checkpoint.write(tmp_path, made(10, best=10))
    replace, calls = Path.replace, []

    def dying(self, target):
        calls.append(target)
        if len(calls) == dies_at:
            raise SystemExit
        return replace(self, target)

    monkeypatch.setattr(Path, "replace", dying)
    with pytest.raises(SystemExit):
        checkpoint.write(tmp_path, made(20, best=20))
    monkeypatch.undo()
    stored = checkpoint.read(tmp_path)
    assert (stored.step, stored.exported["w"][0], stored.state["modules/w"][0, 0]) == (10, 10, 10)
    checkpoint.write(tmp_path, made(30, best=30))
    assert files(tmp_path) == {"step-30.safetensors", "best-30.safetensors", checkpoint.NAME}


def test_a_full_disk_is_one_sentence_and_keeps_the_one_before(tmp_path, monkeypatch):
    checkpoint.write(tmp_path, made(10))

    def full(self, data):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(Path, "write_bytes", full)
    with pytest.raises(
        FileError, match=r"step-20.safetensors: cannot be written \(No space left on device\)"
    ):
        checkpoint.write(tmp_path, made(20))
    monkeypatch.undo()
    assert checkpoint.read(tmp_path).step == 10
    assert files(tmp_path) == {"step-10.safetensors", checkpoint.NAME}


def _flip(path):
    data = bytearray(path.read_bytes())
    data[-1] ^= 1
    path.write_bytes(data)


@pytest.mark.parametrize(
    ("damage", "says"),
    [
        (lambda f: _flip(f / "step-10.safetensors"), "is not the file that checkpoint.json names"),
        (lambda f: (f / "step-10.safetensors").unlink(), "cannot be read"),
        (lambda f: (f / checkpoint.NAME).write_text('{"schema": 1'), "is not a readable checkpoint"),
        (lambda f: (f / checkpoint.NAME).write_text("[]"), "is not a readable checkpoint"),
        (lambda f: (f / checkpoint.NAME).write_text('{"schema": 99}'), "is of format 99"),
    ],
)
def test_damage_is_named_not_trained_on(tmp_path, damage, says):
    checkpoint.write(tmp_path, made(10))
    damage(tmp_path)
    with pytest.raises(FileError, match=says):
        checkpoint.read(tmp_path)


# ------------------------------------------------------------------------------------------- edited folders
@pytest.fixture
def cut(toy_run, tmp_path):
    """The folder of a run that was interrupted, and going on with it."""
    toy_run(stop=20)
    return tmp_path / "run", lambda: toy_run(resume=True)


NO_CHECKPOINT, NO_REQUEST = "is not a readable checkpoint", "does not describe a training run"


def changed(path, change, lost=""):
    """The JSON file with other facts, and without one."""
    facts = json.loads(path.read_text()) | change
    facts.pop(lost, None)
    path.write_text(json.dumps(facts))


@pytest.mark.parametrize("lost", ["step", "seconds", "state", "best", "validation"])
def test_a_checkpoint_that_lacks_something(cut, lost):
    folder, go_on = cut
    changed(folder / checkpoint.NAME, {}, lost)
    with pytest.raises(FileError, match=rf"checkpoint.json: {NO_CHECKPOINT} \(it lacks {lost}"):
        go_on()


@pytest.mark.parametrize(
    ("name", "odd", "words"),
    [
        (checkpoint.NAME, {"step": "many"}, NO_CHECKPOINT),
        (checkpoint.NAME, {"state": None}, NO_CHECKPOINT),
        (checkpoint.NAME, {"state": {"file": "step-15.safetensors"}}, NO_CHECKPOINT),
        (checkpoint.NAME, {"best": {"step": 15}}, NO_CHECKPOINT),
        (checkpoint.NAME, {"best": [1]}, NO_CHECKPOINT),
        (checkpoint.NAME, {"validation": 3}, NO_CHECKPOINT),
        (checkpoint.NAME, {"validation": [3]}, NO_CHECKPOINT),
        (request.NAME, {"seed": "0"}, NO_REQUEST),
        (request.NAME, {"seed": 1.5}, NO_REQUEST),
        (request.NAME, {"seed": True}, NO_REQUEST),
        (request.NAME, {"method": 3}, NO_REQUEST),
        (request.NAME, {"facts": []}, NO_REQUEST),
        (request.NAME, {"recipe": None}, NO_REQUEST),
        (request.NAME, {"recipe": {"steps": "40", "batch": 8, "window": 16, "rate": 0.05}}, NO_REQUEST),
        (request.NAME, {"extra": 1}, NO_REQUEST),
        (request.NAME, {"budget": "soon"}, "'soon' is no budget"),
    ],
)
def test_something_else_in_a_file(cut, name, odd, words):
    folder, go_on = cut
    changed(folder / name, odd)
    with pytest.raises(BenchError, match=words):
        go_on()


@pytest.mark.parametrize("text", ["null", "3", "[1]", '"run"', "{}"])
def test_a_request_that_is_none(cut, text):
    folder, go_on = cut
    (folder / request.NAME).write_text(text)
    with pytest.raises(FileError, match=r"run.json: does not describe a training run"):
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
