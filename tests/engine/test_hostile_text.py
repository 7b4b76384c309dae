"""Named faults of suite files, role files, cards and headers: one sentence with the file and the field."""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from stored import store as made_up

from retarget_bench.analysis.summary import split_summaries
from retarget_bench.commands.run import read_suite
from retarget_bench.errors import FileError
from retarget_bench.exchange import card as submission_card
from retarget_bench.motion.files.reading import Reading
from retarget_bench.results import predictions, store
from retarget_bench.results.header import STATUSES
from retarget_bench.training import tensor_files
from retarget_bench.training.record import Record

DEEP = 50_000


def card(path: Path) -> object:
    return tensor_files.read_record(path, Record, "the card of weights")


def of_submission(path: Path) -> object:
    shutil.move(path, path.parent / submission_card.CARD)
    try:
        return submission_card.read(path.parent)
    finally:
        shutil.move(path.parent / submission_card.CARD, path)


def roles(path: Path) -> object:
    return Reading(roles=path).overrides


def reading(path: Path) -> object:
    return Reading(reading=path).stated


READERS = [
    *((read_suite, "a.toml"), (roles, "a.toml"), (reading, "a.toml")),
    *((of_submission, "a.toml"),),
    *((card, "a.json"), (store.read_header, "a.json")),
]


def toml_lists(depth: int) -> str:
    return "a = " + "[" * depth + "]" * depth


def toml_tables(depth: int) -> str:
    return "[" + "a." * depth + "a]\nb = 1"


def json_lists(depth: int) -> str:
    return '{"schema": 1, "hash": ' + "[" * depth + "]" * depth + "}"


def json_objects(depth: int) -> str:
    return '{"schema": 1, "hash": ' + '{"a": ' * depth + "1" + "}" * depth + "}"


@pytest.mark.parametrize("depth", [40, 900, DEEP])
@pytest.mark.parametrize(("read", "name"), READERS, ids=lambda each: getattr(each, "__name__", each))
def test_deep_nesting_is_a_sentence(tmp_path: Path, read: Callable, name: str, depth: int):
    path = tmp_path / name
    forms = (toml_lists, toml_tables) if name.endswith("toml") else (json_lists, json_objects)
    for form in forms:
        path.write_text(form(min(depth, 5_000) if form is toml_tables else depth), encoding="utf-8")
        with pytest.raises(FileError) as error:
            read(path)
        assert str(tmp_path) in str(error.value)
        assert "nested too deeply" in str(error.value)
        assert "\n" not in str(error.value)


@pytest.mark.parametrize(("read", "name"), READERS, ids=lambda each: getattr(each, "__name__", each))
@pytest.mark.parametrize(
    ("content", "sentence"),
    [
        (b"", ""),
        (b"\xff\xfe\x00", "can't decode"),
        (b'a = {"b', "is not"),
        (b'a = {"schema": ' + b"9" * 5000 + b"}", "is not"),
    ],
)
def test_other_text_is_a_sentence(tmp_path: Path, read: Callable, name: str, content: bytes, sentence: str):
    path = tmp_path / name
    path.write_bytes(content)
    if content or name.endswith("json") or read is of_submission:
        with pytest.raises(FileError) as error:
            read(path)
        assert sentence in str(error.value)
    else:
        assert read(path) == {}


def device(path: Path) -> None:
    path.symlink_to("/dev/zero")


def sparse(path: Path) -> None:
    path.touch()
    os.truncate(path, 1 << 40)


NO_FILES = [
    (device, "is not an ordinary file but a device"),
    (os.mkfifo, "is not an ordinary file but a pipe"),
    (Path.mkdir, "is a folder"),
]


@pytest.mark.parametrize(
    ("make", "sentence"),
    [*NO_FILES, (sparse, "has 1,100 GB")],
    ids=lambda each: getattr(each, "__name__", ""),
)
@pytest.mark.parametrize(("read", "name"), READERS, ids=lambda each: getattr(each, "__name__", each))
def test_what_is_no_file_is_never_opened(
    tmp_path: Path, read: Callable, name: str, make: Callable, sentence: str
):
    make(tmp_path / name)
    with pytest.raises(FileError, match=sentence):
        read(tmp_path / name)


@pytest.mark.parametrize(("make", "sentence"), NO_FILES, ids=lambda each: getattr(each, "__name__", ""))
@pytest.mark.parametrize("end", ["csv", "npz", "json", "cases.csv"])
def test_nor_are_results_and_predictions(tmp_path: Path, make: Callable, sentence: str, end: str):
    place = made_up(tmp_path, "intra", "m", [("a>b", "c", {"mpjpe_h.world": 1.0})])
    path = place.file(end) if end != "json" else place.header
    path.unlink(missing_ok=True)
    make(path)
    with pytest.raises(FileError, match=sentence):
        store.read_results(place, arrays=True) if end == "npz" else split_summaries([place])
    for name in ("a.npz", "a.bvh"):
        make(tmp_path / name)
        with pytest.raises(FileError, match=sentence):
            predictions.read_prediction(tmp_path / name, None, 30.0)
        assert predictions.stored_key(tmp_path / name) is None


# ------------------------------------------------------------------------------------- fields of headers
def changed(facts: dict[str, Any], place: str, value: object) -> dict[str, Any]:
    facts = json.loads(json.dumps(facts))
    inner, (*way, last) = facts, place.split("/")
    for step in way:
        inner = inner[step]
    inner[last] = value
    return facts


@pytest.mark.parametrize(
    ("place", "value", "sentence"),
    [
        ("counts/asked", "4", "counts.asked: Input should be a valid integer"),
        ("seeds", ["a"], "seeds.0: Input should be a valid integer"),
        ("method/label", ["m"], "method.label: Input should be a valid string"),
        ("method/trained_on", {"clips": "abc"}, "method.trained_on.clips: Input should be a valid"),
        ("values/mpjpe_h.world/better", "up", "values.mpjpe_h.world.better: Input should be 'lower'"),
        ("values/mpjpe_h.world", [], "values.mpjpe_h.world: Input should be an object"),
        ("problems", [{"status": STATUSES[1], "message": 3, "cases": []}], "problems.0.message: Input"),
        ("schema", "2", "has result schema 2"),
    ],
)
def test_a_field_of_another_type_is_named(tmp_path: Path, place: str, value: object, sentence: str):
    paths = made_up(tmp_path, "intra", "m", [("a>b", "c", {"mpjpe_h.world": 1.0})])
    facts = json.loads(paths.header.read_text(encoding="utf-8"))
    assert split_summaries([paths])
    paths.header.write_text(json.dumps(changed(facts, place, value)), encoding="utf-8")
    for read in (lambda: store.read_header(paths.header), lambda: split_summaries([paths])):
        with pytest.raises(FileError) as error:
            read()
        assert str(error.value).startswith(str(paths.header))
        assert sentence in str(error.value)
