"""Submissions that are broken or hostile are findings, and stop no leaderboard."""

from __future__ import annotations

import json
import os
import shutil
import socket
import zipfile
from collections.abc import Callable
from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest
from submitted import errors, filled_in, make, predictions, rewrite, some

from retarget_bench.exchange import checking
from retarget_bench.exchange.card import CARD
from retarget_bench.exchange.checking import check
from retarget_bench.exchange.leaderboard import leaderboard
from retarget_bench.results import case_metadata, store
from retarget_bench.results.header import ResultHeader

pytestmark = pytest.mark.usefixtures("in_process")


# ------------------------------------------------------------------------------------ hostile and broken
def link(sound: Path) -> None:
    (sound / "secret.txt").symlink_to("/etc/hostname")


def fifo(sound: Path) -> None:
    (sound / CARD).unlink()
    os.mkfifo(sound / CARD)


def listening(sound: Path) -> None:
    where = Path.cwd()
    os.chdir(sound)  # the path of a socket has to be short
    with socket.socket(socket.AF_UNIX) as one:
        one.bind("a.json")
    os.chdir(where)


def large_file(sound: Path) -> None:
    path = some(sound, "intra", ".csv").with_name("ik.parquet")
    path.touch()
    os.truncate(path, 2_000_000_000)


def bomb(sound: Path) -> None:
    """An archive of few bytes that unpacks to five thousand million."""
    path = some(sound, "intra", ".npz")
    with zipfile.ZipFile(path, "a") as archive:
        archive.writestr("bomb.npy", b"")
        archive.infolist()[-1].file_size = 5_000_000_000


def pickled(sound: Path) -> None:
    """An array whose reading would run what somebody wrote."""
    path = some(sound, "intra", ".npz")
    arrays = store.read_npz(path, "")
    np.savez(path, **arrays | {"mpjpe_h.joint": np.array([Exploding()], dtype=object)})


class Exploding:
    def __reduce__(self) -> tuple[Callable[..., int], tuple[str]]:
        return os.system, ("touch exploded",)


def deep_folders(sound: Path) -> None:
    (sound / Path(*"abcdefg", "h")).mkdir(parents=True)


def endless(sound: Path) -> None:
    rewrite(sound / CARD, "training_hours = 0", "training_hours = inf")


def deep_header(sound: Path) -> None:
    rewrite(some(sound, "intra", ".json"), '"notes": []', '"notes": ' + "[" * 99999 + "]" * 99999)


def other_root(sound: Path) -> None:
    """Results on files that lie where the submission says."""
    for path in sound.glob("*/retarget/*/*.json"):
        facts = json.loads(path.read_text(encoding="utf-8"))
        facts["dataset"] |= {"name": "folder", "parameters": {"root": str(sound)}}
        path.write_text(json.dumps(facts), encoding="utf-8")


def own_table(sound: Path) -> None:
    """A label of its own, under which nobody else stands."""
    for path in sound.glob("*/retarget/*/*.json"):
        rewrite(path, '"label": "toy_cases"', '"label": "toy_cases, corrected"')


def own_folder(sound: Path) -> None:
    some(sound, "intra", ".json").parents[2].rename(sound / "corrected")


def newest_of_all(sound: Path) -> None:
    """A version of a metric beside which the numbers of all others are outdated."""
    for path in sound.glob("*/retarget/*/*.json"):
        facts = json.loads(path.read_text(encoding="utf-8"))
        facts["metrics"]["position"] = "99+0"
        path.write_text(json.dumps(facts), encoding="utf-8")


def direction(sound: Path) -> None:
    rewrite(some(sound, "intra", ".json"), '"better": "lower"', '"better": "higher"')


def other_split(sound: Path) -> None:
    rewrite(some(sound, "intra", ".json"), '"split": "intra"', '"split": "self"')


def huge_cell(sound: Path) -> None:
    rewrite(some(sound, "intra", ".csv"), "\n", "\n" + "x" * 200_000 + ",a,,1\n")


def first_row(sound: Path, value_id: str) -> tuple[Path, list[str], int]:
    path = some(sound, "intra", ".csv")
    lines = path.read_text().splitlines()
    return path, lines, next(n for n, line in enumerate(lines) if f",{value_id}," in line)


def row_twice(sound: Path) -> None:
    path, lines, at = first_row(sound, "mpjpe_h.world")
    path.write_text("\n".join([*lines[: at + 1], *lines[at:], ""]))


def row_gone(sound: Path) -> None:
    path, lines, at = first_row(sound, "mpjpe_h.world")
    path.write_text("\n".join([*lines[:at], *lines[at + 1 :], ""]))


def value_gone(sound: Path) -> None:
    path, lines, _ = first_row(sound, "ee_h.world")
    path.write_text("\n".join([line for line in lines if ",ee_h.world," not in line] + [""]))


def metric_gone(sound: Path) -> None:
    header = some(sound, "intra", ".json")
    facts = json.loads(header.read_text(encoding="utf-8"))
    del facts["metrics"]["ground"]
    header.write_text(json.dumps(facts), encoding="utf-8")


def number(value_id: str, text: str) -> Callable[[Path], None]:
    def change(sound: Path) -> None:
        path, lines, at = first_row(sound, value_id)
        lines[at] = f"{lines[at].rpartition(',')[0]},{text}"
        path.write_text("\n".join([*lines, ""]))

    change.__name__ = f"{value_id} {text}"
    return change


def case_twice(sound: Path) -> None:
    path = some(sound, "intra", ".csv").with_name("cases.csv")
    path.write_text(path.read_text() + path.read_text().splitlines()[1] + "\n")


def other_parts(sound: Path) -> None:
    (place,) = (each for each in store.find_results(sound) if each.split == "intra")
    facts = store.read_csv(case_metadata.path_of(place), case_metadata.FIELDS)[:-1]
    case_metadata.write_facts(place, [[*row[:3], "other"] for row in facts])


def no_sets(sound: Path) -> None:
    path = some(sound, "intra", ".sets.csv")
    path.write_text(path.read_text().splitlines(keepends=True)[0])


def no_checksums(sound: Path) -> None:
    header = some(sound, "intra", ".json")
    facts = json.loads(header.read_text(encoding="utf-8")) | {"files": {}}
    header.write_text(json.dumps(facts), encoding="utf-8")


def all_zero(sound: Path) -> None:
    """No error of joints, beside the path of the root as it was."""
    path, lines, _ = first_row(sound, "mpjpe_h.world")
    cells = [line.split(",") for line in lines]
    path.write_text(
        "\n".join([",".join([*c[:3], "0"] if c[1] == "mpjpe_h.world" else c) for c in cells] + [""])
    )


HOSTILE = [
    (link, "secret.txt is a link"),
    *((fifo, "is not an ordinary file"), (listening, "is not an ordinary file")),
    (large_file, "more than the 1,000,000,000"),
    *((bomb, "it unpacks to 5,000,"), (pickled, "allow_pickle=False"), (deep_folders, "folders deep")),
    (endless, "training_hours: "),
    (deep_header, "is not a result header"),
    (other_root, "folder needs your files: give --root DIR"),
    *(
        (own_table, "is called toy_cases, corrected in toy_cases/"),
        (own_folder, "is called toy_cases in corrected/"),
    ),
    (newest_of_all, "a newer version of position than is installed"),
    *((direction, "declares another better"), (other_split, "the rows are of retarget self")),
    *(
        (huge_cell, "field larger than"),
        (row_twice, "is listed twice"),
        (case_twice, "cases.csv is not what"),
    ),
    *((metric_gone, "no values of ground"), (no_sets, "are left out")),
    (other_parts, "cases.metadata.csv is not what"),
    *((number("mpjpe_h.world", "-3"), "is -3"), (number("contact_recall", "7"), "is 7, which is not")),
    (number("mpjpe_h.world", "1e308"), "is 1e+308"),
    (no_checksums, "its header has no checksum of ik.csv, ik.npz"),
]
UNLIKE_THE_PREDICTIONS = [
    (row_gone, "as mpjpe_h.world, and the rows say nothing"),
    (value_gone, "as ee_h.world, and the rows say nothing"),
    (all_zero, "as mpjpe_h.world, and the rows say 0"),
    (number("mpjpe_h.root", "0.001"), "as mpjpe_h.root, and the rows say 0.001"),
    (number("ee_h.world", "5000"), "as ee_h.world, and the rows say 5000"),
]


def sealed(sound: Path) -> None:
    """Checksums that fit again, as whoever changes a file on purpose makes them."""
    for path in sound.rglob("retarget/*/*.json"):
        try:
            facts = json.loads(path.read_text(encoding="utf-8"))
        except RecursionError:
            continue
        paths = store.ResultPaths(path.parents[3], *path.relative_to(path.parents[3]).parts[:3], path.stem)
        there = [end for end in facts["files"] if paths.file(end).is_file()]
        facts["files"] |= {end: store.checksum(paths.file(end)) for end in there}
        path.write_text(json.dumps(facts), encoding="utf-8")


@pytest.mark.parametrize(("change", "message"), HOSTILE, ids=lambda each: getattr(each, "__name__", ""))
def test_hostile_files_are_findings(sound: Path, change: Callable[[Path], None], message: str) -> None:
    change(sound)
    sealed(sound)
    mistakes, warnings = check(sound)
    assert any(message in error for error in mistakes), mistakes
    assert all(sentence.isprintable() and "root:" not in sentence for sentence in (*mistakes, *warnings))
    assert not Path("exploded").exists()


@pytest.mark.parametrize(
    ("change", "message"), UNLIKE_THE_PREDICTIONS, ids=lambda e: getattr(e, "__name__", "")
)
def test_what_predictions_do_not_give_is_found(
    sound: Path, runs: Path, change: Callable[[Path], None], message: str
) -> None:
    predictions(runs, sound)
    assert check(sound) == ([], [])
    change(sound)
    sealed(sound)
    assert any(message in error for error in errors(sound)), errors(sound)


def test_more_files_than_anybody_needs_are_not_gone_through(sound: Path, monkeypatch) -> None:
    monkeypatch.setattr(checking, "MOST", 5)
    (error,) = errors(sound)
    assert "holds more than 5 files" in error


def twin(sound: Path) -> Path:
    """The same submission under another name, with the rows of its table in another order."""
    other = filled_in(shutil.copytree(sound, sound.with_name("twin")))
    for header in other.glob("*/retarget/*/ik.json"):
        rewrite(header, '"label": "ik"', '"label": "mine"')
        rows = header.with_suffix(".csv")
        head, *lines = rows.read_text().splitlines()
        rows.write_text("\n".join([head, *reversed(lines), ""]))
        for path in header.parent.glob("ik.*"):
            path.rename(path.with_name(path.name.replace("ik.", "mine.", 1)))
    sealed(other)
    return other


@pytest.mark.parametrize(("year", "shown"), [("1999", "mine"), ("2999", "ik")])
def test_of_two_equal_submissions_the_older_is_shown(sound: Path, year: str, shown: str) -> None:
    for header in twin(sound).glob("*/retarget/*/mine.json"):
        facts = json.loads(header.read_text(encoding="utf-8"))
        header.write_text(json.dumps(facts | {"date": year + facts["date"][4:]}), encoding="utf-8")
    (table, _), left_out = leaderboard(sound.parent)
    assert {row.label for group in table.groups for row in group.rows} == {shown}
    assert len(left_out) == 1


def test_a_bad_submission_never_stops_the_leaderboard(sound: Path, runs: Path, monkeypatch) -> None:
    root = sound.parent
    for change in (fifo, deep_header, row_twice):
        change(shutil.copytree(sound, root / change.__name__))
    (root / "linked").symlink_to(sound, target_is_directory=True)
    twin(sound)
    (table, _), left_out = leaderboard(root)
    assert {row.label for group in table.groups for row in group.rows} == {"ik"}
    assert [text.partition(" is left out: ")[0] for text in left_out] == [
        "deep_header", "fifo", "linked", "row_twice", "twin",
    ]  # fmt: skip
    assert "its rows are those of ik" in left_out[-1]
    filled_in(make(root / "zz", runs, "copy_rotations"))
    drawn = checking.split_summaries

    def breaks(places):
        if "zz" in str(places[0].root):
            raise ZeroDivisionError
        return drawn(places)

    monkeypatch.setattr("retarget_bench.exchange.checking.split_summaries", breaks)
    (table, _), left_out = leaderboard(root)
    assert left_out[-1].startswith("zz is left out: no table can be made of it: ZeroDivisionError")


FIELDS = [each.name for each in fields(ResultHeader)]
WRONG = (None, [], {}, "x", 3, [{}], {"a": 1})
FEW = (None, "x", {"a": 1})


@pytest.mark.parametrize("shapes", [FEW, pytest.param(WRONG, marks=pytest.mark.slow)], ids=["few", "all"])
def test_a_header_of_any_shape_is_a_finding_and_no_traceback(sound: Path, shapes: tuple) -> None:
    """What the check lets through, the leaderboard can draw."""
    header = some(sound, "intra", ".json")
    facts = json.loads(header.read_text(encoding="utf-8"))
    learned = {**facts["method"], "trained_on": {"characters": ["small"]}, "stochastic": True}
    header.write_text(json.dumps({**facts, "method": learned}), encoding="utf-8")
    assert errors(sound) == []
    drawn = 0
    for name in FIELDS:
        for wrong in shapes:
            header.write_text(json.dumps({**facts, name: wrong}), encoding="utf-8")
            if not errors(sound):
                leaderboard(sound.parent)
                drawn += 1
    assert 0 < drawn < 0.5 * len(FIELDS) * len(shapes)
    header.write_text(json.dumps({**facts, "counts": None}), encoding="utf-8")
    assert any("is not a result header (counts" in text for text in errors(sound))
