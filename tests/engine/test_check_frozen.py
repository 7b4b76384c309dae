"""Frozen motions: damaged, exchanged or gone they are told of, and what is packed is what is read."""

import shutil
import sys
from dataclasses import fields, replace
from pathlib import Path, PurePosixPath

import numpy as np
import pytest
from gates import FOLDER, measured, metrics, quiet

from retarget_bench.errors import BenchError, FileError
from retarget_bench.verification.gate import compare, frozen, golden, run
from retarget_bench.verification.gate.compare import Status

sys.path.insert(0, str(Path(__file__).parents[2] / "benchmarks"))
import freeze_motions


@pytest.fixture
def copied(tmp_path):
    """Our frozen motions and inputs, elsewhere."""
    for name in ("frozen", "inputs"):
        shutil.copytree(FOLDER / name, tmp_path / name)
    return tmp_path


def test_a_damaged_frozen_motion_is_named_and_cannot_be_measured(copied, tmp_path):
    path = copied / "frozen" / "stairs.npz"
    path.write_bytes(path.read_bytes()[:5000])
    measurements = run.Measured(tmp_path / "rows")
    run.measure_frozen(measurements, copied, metrics()[:1], quiet)
    assert [
        each.startswith(f"{path}: is not a file of frozen motions") for each in measurements.missing
    ] == [True]


def test_another_frozen_motion_is_told_as_such(copied):
    golden_facts = golden.read(FOLDER)
    held = frozen.read(copied / "frozen" / "stairs.npz")
    moved = {name: replace(each, root=each.root + 1.0) for name, each in held.predictions.items()}
    freeze_motions.write(copied / "frozen", replace(held, predictions=moved))
    comparison = compare.compare(golden_facts, measured(golden_facts, folder=copied))
    assert [(each.status, each.subject) for each in comparison.changes] == [
        (Status.INCOMPARABLE, "file stairs")
    ]


def test_no_frozen_motion_cannot_be_measured(copied, tmp_path):
    for path in (copied / "frozen").glob("*.npz"):
        path.unlink()
    measurements = run.Measured(tmp_path / "rows")
    run.measure_frozen(measurements, copied, metrics()[:1], quiet)
    assert measurements.missing == [f"{copied / 'frozen'} has no frozen motion"]


def test_what_is_packed_is_what_is_read(tmp_path):
    held = frozen.read(FOLDER / "frozen" / "stairs.npz")
    freeze_motions.write(tmp_path, held)
    again = frozen.read(tmp_path / "stairs.npz")
    assert again.case.info == held.case.info
    assert again.case.target is again.case.reference.character
    assert [f.name for f in fields(again.case)] == [f.name for f in fields(held.case)]
    np.testing.assert_array_equal(again.case.ground.heights, held.case.ground.heights)
    np.testing.assert_array_equal(again.case.contacts.planted, held.case.contacts.planted)
    np.testing.assert_allclose(np.linalg.norm(again.case.source.rotations, axis=-1), 1, atol=1e-15)
    for name, prediction in held.predictions.items():
        np.testing.assert_allclose(again.predictions[name].positions, prediction.positions, atol=1e-6)


def test_a_file_of_a_newer_version_or_of_something_else_is_refused(tmp_path):
    np.savez(tmp_path / "new.npz", tree=np.array('{"schema": 9, "thing": null}'))
    with pytest.raises(FileError, match=r"new\.npz: has schema 9 .* reads up to 1"):
        frozen.read(tmp_path / "new.npz")
    np.savez(tmp_path / "odd.npz", tree=np.array('{"schema": 1, "thing": {"is": "Os", "fields": {}}}'))
    with pytest.raises(FileError, match=r"odd\.npz: holds something that this version cannot build: 'Os'"):
        frozen.read(tmp_path / "odd.npz")
    np.savez(tmp_path / "none.npz", x=np.zeros(3))
    with pytest.raises(FileError, match=r"none\.npz: is not a file of frozen motions"):
        frozen.read(tmp_path / "none.npz")
    with pytest.raises(BenchError, match="a PurePosixPath cannot be stored"):
        freeze_motions.write(tmp_path, frozen.FrozenCase("path", PurePosixPath("x"), {}, ""))
