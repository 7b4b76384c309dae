"""Folders of runs that somebody has edited: each is one sentence that names the file."""

import json

import pytest

from retarget_bench.errors import BenchError, FileError
from retarget_bench.training import checkpoint, log, request


@pytest.fixture
def cut(toy_run, tmp_path):
    """The folder of a run that was interrupted, and going on with it."""
    toy_run(stop=20)
    return tmp_path / "run", lambda: toy_run(resume=True)


@pytest.mark.parametrize("lost", ["step", "seconds", "state", "best", "validation"])
def test_a_checkpoint_that_lacks_something(cut, lost):
    folder, go_on = cut
    facts = json.loads((folder / checkpoint.NAME).read_text())
    del facts[lost]
    (folder / checkpoint.NAME).write_text(json.dumps(facts))
    with pytest.raises(
        FileError, match=rf"checkpoint.json: is not a readable checkpoint \(it lacks {lost}"
    ):
        go_on()


@pytest.mark.parametrize(
    "odd",
    [
        {"step": "many"},
        {"state": None},
        {"state": {"file": "step-15.safetensors"}},
        {"best": {"step": 15}},
        {"best": [1]},
        {"validation": 3},
        {"validation": [3]},
    ],
)
def test_a_checkpoint_with_something_else_in_it(cut, odd):
    folder, go_on = cut
    facts = json.loads((folder / checkpoint.NAME).read_text())
    (folder / checkpoint.NAME).write_text(json.dumps(facts | odd))
    with pytest.raises(FileError, match=r"checkpoint.json: is not a readable checkpoint"):
        go_on()


@pytest.mark.parametrize(
    "odd",
    [
        {"seed": "0"},
        {"seed": None},
        {"seed": 1.5},
        {"seed": True},
        {"method": 3},
        {"facts": []},
        {"recipe": None},
        {"recipe": {"steps": "40", "batch": 8, "window": 16, "rate": 0.05}},
        {"extra": 1},
    ],
)
def test_a_request_with_something_else_in_it(cut, odd):
    folder, go_on = cut
    facts = json.loads((folder / request.NAME).read_text())
    (folder / request.NAME).write_text(json.dumps(facts | odd))
    with pytest.raises(FileError, match=r"run.json: does not describe a training run"):
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


def test_a_budget_in_a_request_is_read_as_one_that_is_typed(cut):
    folder, go_on = cut
    facts = json.loads((folder / request.NAME).read_text())
    (folder / request.NAME).write_text(json.dumps(facts | {"budget": "soon"}))
    with pytest.raises(BenchError, match="'soon' is no budget"):
        go_on()
