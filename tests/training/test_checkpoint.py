"""Checkpoints: whole at any moment, and nothing is believed that is not what was written."""

import errno
import json
from pathlib import Path

import pytest
import torch

from retarget_bench.errors import FileError
from retarget_bench.training import checkpoint
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


def test_nothing_is_pickled(tmp_path):
    """The JSON is JSON, and tensors are in the format whose header is JSON too."""
    checkpoint.write(tmp_path, made(10, best=10))
    json.loads((tmp_path / checkpoint.NAME).read_text())
    for path in tmp_path.glob("*.safetensors"):
        data = path.read_bytes()
        size = int.from_bytes(data[:8], "little")
        assert {"dtype", "shape", "data_offsets"} <= set(
            next(iter(json.loads(data[8 : 8 + size]).values()))
        )
