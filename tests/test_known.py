"""Warnings of methods that shipped results show to be worse than the default one."""

from __future__ import annotations

import csv
import importlib.util
import warnings
from dataclasses import astuple, replace
from pathlib import Path

import numpy as np
import pytest

import retarget_bench as rb
from retarget_bench import cli, defaults
from retarget_bench.motion import bvh
from retarget_bench.plugins import registry
from retarget_bench.python import known
from retarget_bench.python.known import GENERATED, REAL, Comparison
from tests.engine import stored

PUPPETS = registry.create("datasets", defaults.DATASET)
BODIES = PUPPETS.characters()
SCRIPT = Path(__file__).parents[1] / "benchmarks" / "learned_methods.py"


def comparison(method: str, bodies: str, split: str, **others: str) -> Comparison:
    facts = (*known.identity(method), *known.identity(defaults.METHOD)[:2], bodies, split)
    numbers = ("6.414", "4.77", "1.2", "2.1", "0.0001")
    return replace(Comparison(*facts, "mixamo", "628", "53", *numbers, better="ik"), **others)


@pytest.fixture
def written(tmp_path, monkeypatch):
    """Writes comparisons in place of those that are shipped."""
    shipped = known.shipped
    monkeypatch.setattr(
        known, "shipped", lambda name="known.csv": tmp_path / name if name == "known.csv" else shipped(name)
    )

    def write(*rows: Comparison) -> None:
        with known.shipped().open("w", newline="") as file:
            csv.writer(file).writerows([known.FIELDS, *map(astuple, rows)])

    return write


@pytest.fixture
def files(tmp_path, monkeypatch) -> tuple[Path, Path]:
    """A motion of one puppet, and a body that no data set has: another one with longer shanks."""
    monkeypatch.chdir(tmp_path)
    (info, *_) = (each for each in PUPPETS.cases("retarget", "intra") if each.source == "ada")
    motion = PUPPETS.load(info).source.at(slice(0, 12))
    bvh.write(tmp_path / "puppet.bvh", motion, scale=100)
    skeleton = motion.skeleton
    longer = np.where([["Foot" in name] for name in skeleton.names], 1.2, 1.0) * skeleton.offsets
    real = type(motion.character).of("real", replace(skeleton, offsets=longer))
    bvh.write(tmp_path / "real.bvh", real.motion(motion.rotations, motion.root, motion.fps), scale=100)
    return tmp_path / "puppet.bvh", tmp_path / "real.bvh"


def retarget(capsys, *arguments: object) -> tuple[str, str]:
    with pytest.raises(SystemExit) as stop:
        cli.main([str(each) for each in ("retarget", *arguments, "-o", "out.bvh")])
    assert not stop.value.code
    return capsys.readouterr()


def test_the_command_warns_in_one_line_and_python_likewise(capsys, written, files):
    written(comparison("copy_rotations", REAL, "intra"))
    puppet, real = files
    source, target = f"{puppet}[unit=cm]", f"{real}[unit=cm]"
    message = (
        "copy_rotations is worse than ik, the default, on real rigs with the same joints: MPJPE 6.41 "
        "against 4.77 % of height (628 cases of 53 clips of mixamo, p < 0.001)"
    )
    arguments = (source, "--target", target, "-m", "copy_rotations")
    out, err = retarget(capsys, *arguments)
    assert [line for line in err.splitlines() if "worse" in line] == [f"bench: {message}"]
    assert "worse" not in out
    assert retarget(capsys, *arguments, "--quiet") == ("", "")
    assert "worse" not in "".join(retarget(capsys, source, "--target", target))
    walk, body = rb.load_motion(puppet, unit="cm"), rb.load_character(real, unit="cm")
    with pytest.warns(UserWarning, match="is worse") as caught:
        rb.retarget(walk, body, "copy_rotations")
    assert [str(each.message) for each in caught] == [message]
    assert caught[0].filename == __file__
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        rb.retarget(walk, body)


def test_what_is_known_of_other_bodies_is_not_said(written, files):
    written(
        *(comparison("copy_rotations", GENERATED, split, dataset=split) for split in ("self", "cross")),
        comparison("copy_rotations", REAL, "intra", dataset="real intra"),
        comparison("copy_rotations", REAL, "cross", dataset="real cross"),
        comparison("copy_rotations", GENERATED, "intra", better="copy_rotations"),
    )
    real = rb.load_character(files[1], unit="cm")
    puppet = rb.load_character(files[0], unit="m")  # in whatever unit

    def dataset(source: str | rb.Character, target: str | rb.Character) -> str:
        bodies = [BODIES[each] if isinstance(each, str) else each for each in (source, target)]
        text = known.caution("copy_rotations", *bodies)
        return text.partition(" clips of ")[2].partition(", p")[0]

    assert dataset("ada", "ada") == dataset("ada", puppet) == "self"
    assert dataset("ada", "boris") == ""  # better there
    assert dataset("ada", "hugo") == dataset(puppet, "clara") == "cross"
    assert dataset("ada", real) == "real intra"
    assert dataset(real, "hugo") == "real cross"
    assert dataset(real, real) == ""  # no such rigs were tried each to itself
    assert dataset("rex", "rex") == dataset("ada", "rex") == ""  # the results are people's


def test_the_bodies_of_the_default_data_set_are_shipped(script):
    with known.shipped("known_bodies.csv").open(newline="") as file:
        assert [*csv.reader(file)] == [
            list(known.BUILD_FIELDS),
            *map(list, map(script.built, BODIES.values())),
        ]


@pytest.mark.parametrize("stale", ["version", "weights", "default", "default_version"])
def test_results_of_other_weights_or_versions_are_not_said(written, stale):
    row = comparison("smrm", REAL, "cross")
    assert len(row.weights) >= 8
    written(row)
    assert known.worse("smrm") == [row]
    assert known.worse("smrm[weights=puppets]") == [row]
    assert known.worse("smrm+footfix") == []
    written(replace(row, **{stale: "other"}))
    assert known.worse("smrm") == []


def test_the_card_says_it(capsys, written):
    written(comparison("smrm", REAL, "cross"), comparison("smrm", GENERATED, "intra"))
    with pytest.raises(SystemExit):
        cli.main(["info", "smrm"])
    text = " ".join(capsys.readouterr().out.split())
    for row in known.worse("smrm"):
        assert row.sentence in text


def test_what_is_shipped_says_what_its_numbers_say():
    with known.shipped().open(newline="") as file:
        head, *rows = csv.reader(file)
    assert tuple(head) == known.FIELDS
    keys = [(each.method, each.bodies, each.split) for each in (Comparison(*row) for row in rows)]
    assert len(set(keys)) == len(keys)
    assert {(GENERATED, "cross"), (REAL, "cross")} <= {key[1:] for key in keys}
    for each in (Comparison(*row) for row in rows):
        registry.canonical("methods", each.method)
        different, more = float(each.p) < 0.05, float(each.mean) > float(each.default_mean)
        assert each.better == ("" if not different else each.default if more else each.method)


@pytest.fixture
def script(monkeypatch):
    monkeypatch.syspath_prepend(str(SCRIPT.parent))  # where what it imports lies
    spec = importlib.util.spec_from_file_location("learned_methods", SCRIPT)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_file_is_made_of_paired_tests_over_clips(tmp_path, script):
    """Twelve clips that are all worse by one: of 4,096 flips of their signs two are as far from 0."""
    for method, error in (("ik", 1.0), ("copy_rotations", 2.0), ("rest_pose", 20.0)):
        cases = [("a>b", f"c{k}", {"mpjpe_h.world": error + k / 8}) for k in range(12)]
        stored.store(tmp_path, "cross", method, cases)
    (row,) = script.comparisons(rb.load_results(tmp_path), REAL)
    copy_identity = known.identity("copy_rotations")
    assert astuple(row)[:7] == (*copy_identity, *known.identity("ik")[:2], REAL, "cross")
    assert (row.dataset, row.cases, row.clips, row.better) == ("data", "12", "12", "ik")
    assert (float(row.mean), float(row.default_mean)) == (2.688, 1.688)  # 1 + 11 / 16, in four digits
    assert float(row.p) == pytest.approx(2 / 2**12, rel=1e-3)
    assert float(row.low) <= 1 <= float(row.high)
