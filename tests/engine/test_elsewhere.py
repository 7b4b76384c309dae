"""Scoring motions that somebody else produced, as .npz or .bvh."""

import zipfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from small_plans import asked

from retarget_bench.api import Case, CaseInfo
from retarget_bench.errors import BenchError, FileError
from retarget_bench.evaluation import runner, shard_work
from retarget_bench.motion import bvh, rotation, transfer
from retarget_bench.plugins import bound
from retarget_bench.plugins.spec import Spec
from retarget_bench.results import predictions, store
from retarget_bench.tables import requested
from retarget_bench.tables.rendering import text
from tests.motion import editing_bodies
from tests.motion.alignment_rigs import performance

pytestmark = pytest.mark.usefixtures("in_process", "toys")


@pytest.fixture
def cases():
    data = bound.dataset(Spec.parse("toy_cases")).built
    return [data.load(info) for info in data.cases("retarget", "intra")]


@pytest.fixture
def folder(tmp_path) -> Path:
    """An empty folder for somebody's answers."""
    (tmp_path / "theirs").mkdir()
    return tmp_path / "theirs"


def score(folder: Path, root: Path) -> store.Results:
    plan = asked(root, "theirs", stage="score", external=folder)
    return store.read_results(runner.run(plan, lambda done, total: None)[0])


def test_references_as_npz_or_bvh_score_nothing(tmp_path, folder, cases):
    for number, case in enumerate(cases):
        stem = folder / store.case_file(case.info.id)
        if number % 3 == 0:
            predictions.write_prediction(stem.with_suffix(".npz"), case.reference, "")
        elif number % 3 == 1:
            order = np.random.default_rng(number).permutation(len(case.target.skeleton))
            names = np.array(case.target.skeleton.names)[order]
            positions = case.reference.positions[:, order].astype(np.float32)
            np.savez(stem.with_suffix(".npz"), positions=positions, joints=names, fps=30)
        else:
            bvh.write(stem.with_suffix(".bvh"), case.reference, scale=100.0)
    results = score(folder, tmp_path / "runs")
    assert results.header.counts.ok == len(cases)
    assert all(entry.values["mpjpe_h.world"] < 1e-3 for entry in results.entries)


def test_a_root_above_the_hips_is_folded_away(tmp_path, cases):
    bvh.write(tmp_path / "plain.bvh", cases[0].reference, scale=100.0)
    text = (tmp_path / "plain.bvh").read_text()
    head, body = text.split("MOTION")
    inner = head.removeprefix("HIERARCHY\n").replace("ROOT", "JOINT")
    carried = "HIERARCHY\nROOT Carrier\n{\nOFFSET 0 0 0\nCHANNELS 0\n" + inner + "}\n"
    (tmp_path / "carried.bvh").write_text(carried + "MOTION" + body)
    plain, folded = (
        predictions.read_prediction(tmp_path / f"{name}.bvh", cases[0].target, 30.0)
        for name in ("plain", "carried")
    )
    assert np.abs(plain.positions - cases[0].reference.positions).max() < 1e-5
    assert np.abs(folded.positions - cases[0].reference.positions).max() < 1e-5


def test_what_does_not_fit_is_named(tmp_path, folder, cases):
    paths = [folder / f"{store.case_file(case.info.id)}.npz" for case in cases]
    paths[0].write_bytes(b"no zip")
    np.savez(paths[1], rotations=np.zeros((12, 3, 4)), root=np.zeros((12, 3)))
    np.savez(paths[2], positions=np.zeros((12, 2, 3)), joints=np.array(["Hips", "Head"]))
    np.savez(paths[3], positions=np.full((12, 9, 3), np.nan))
    predictions.write_prediction(paths[4], cases[4].reference.at(slice(0, 5)), "")
    messages = {entry.case: entry.message for entry in score(folder, tmp_path / "runs").entries}
    expected = [
        "not a readable .npz",
        "9 joints",
        "lacks the joints Spine",
        "not finite",
        "5 frames",
        "has no ",
    ]
    for case, words in zip(cases, expected, strict=True):
        assert words in messages[case.info.id], messages[case.info.id]


def test_odd_arrays_are_named_with_their_file(tmp_path, folder, cases):
    paths = [folder / f"{store.case_file(case.info.id)}.npz" for case in cases]
    rotations, root = cases[0].reference.rotations, cases[0].reference.root
    np.savez(paths[0], rotations=2 * rotations, root=root)
    np.savez(paths[1], rotations=0 * rotations, root=root)
    np.savez(paths[2], rotations=rotations[..., :3], root=root)
    np.savez(paths[3], rotations=rotations, root=root, fps="fast")
    np.savez(paths[4], rotations=rotations, root=root, joints=7)
    predictions.write_prediction(paths[5], cases[5].reference, "")
    bvh.write(paths[5].with_suffix(".bvh"), cases[5].reference)
    messages = {entry.case: entry.message for entry in score(folder, tmp_path / "runs").entries}
    expected = ["not unit", "not unit", "(12, 9, 4)", "fps is", "lacks the joints", "remove one"]
    for case, path, words in zip(cases, paths, expected, strict=True):
        assert words in messages[case.info.id], messages[case.info.id]
        assert "not unit" in words or path.name[:-4] in messages[case.info.id]


def test_changed_files_are_scored_again(tmp_path, folder, cases):
    from retarget_bench.plugins.code_hash import folder_hash

    for case in cases:
        path = folder / f"{store.case_file(case.info.id)}.npz"
        predictions.write_prediction(path, case.reference, "")
    first = score(folder, tmp_path / "runs")
    assert max(entry.values["mpjpe_h.world"] for entry in first.entries) < 1e-3
    moved = replace(cases[0].reference, root=cases[0].reference.root + np.array([1.0, 0, 0]))
    predictions.write_prediction(folder / f"{store.case_file(cases[0].info.id)}.npz", moved, "")
    folder_hash.cache_clear()
    after = score(folder, tmp_path / "runs")
    worst = max(entry.values["mpjpe_h.world"] for entry in after.entries)
    assert worst > 10


def test_an_empty_folder_is_refused(tmp_path, cases):
    with pytest.raises(BenchError, match="holds no"):
        score(tmp_path, tmp_path / "runs")


def test_another_body_is_refused(tmp_path, cases):
    small, tall = cases[0].source, cases[0].target
    bvh.write(tmp_path / "small.bvh", small)
    names = tuple(f"{name}_x" for name in tall.skeleton.names)
    renamed = replace(tall, skeleton=replace(tall.skeleton, names=names))
    with pytest.raises(FileError, match="lacks the joints"):
        predictions.read_prediction(tmp_path / "small.bvh", renamed, 30.0)
    offsets = np.array(tall.skeleton.offsets)
    offsets[4] *= 1.2
    long_leg = replace(tall, skeleton=replace(tall.skeleton, offsets=offsets))
    with pytest.raises(FileError, match="the bone of 'LeftLeg' differs"):
        predictions.read_prediction(tmp_path / "small.bvh", long_leg, 30.0)
    bvh.write(tmp_path / "tall.bvh", cases[0].reference)
    for factor in (1.3, 0.8, 2.0, 30.0):
        larger = replace(tall, skeleton=tall.skeleton.scaled(factor))
        with pytest.raises(FileError, match=r"another body than its target: .* times as large"):
            predictions.read_prediction(tmp_path / "tall.bvh", larger, 30.0)


@pytest.mark.parametrize("scale", [1.0, 100.0, 1000.0, 1 / 0.0254, 10.0, 0.45 / 0.0254, 1 / 0.3048])
def test_units_are_told_by_the_body(tmp_path, cases, scale):
    bvh.write(tmp_path / "a.bvh", cases[0].reference, scale=scale)
    prediction = predictions.read_prediction(tmp_path / "a.bvh", cases[0].target, 30.0)
    assert np.abs(prediction.positions - cases[0].reference.positions).max() < 1e-5


def mirrored(motion):
    """The motion in a mirror, its sides called as before, as of a left-handed file."""
    return {"rotations": motion.rotations * [1, 1, -1, -1], "root": motion.root * [-1, 1, 1]}


def exchanged(motion):
    """Left joints with the rotations of right ones."""
    other = {"Left": "Right", "Right": "Left"}
    names = list(motion.skeleton.names)
    swapped = [
        next((other[side] + name.removeprefix(side) for side in other if name.startswith(side)), name)
        for name in names
    ]
    order = [names.index(name) if name in names else at for at, name in enumerate(swapped)]
    return {"rotations": motion.rotations[:, order], "root": motion.root}


def z_up(motion):
    turn = np.array([np.sqrt(0.5), np.sqrt(0.5), 0.0, 0.0])
    rotations = np.array(motion.rotations)
    rotations[:, 0] = rotation.multiply(turn[None], rotations[:, 0])
    return {"rotations": rotations, "root": rotation.rotate(turn[None], motion.root)}


CONVENTIONS = {
    "lengths in centimetres": lambda motion: {
        "rotations": motion.rotations,
        "root": 100 * motion.root,
    },
    "lengths in millimetres": lambda motion: {"positions": 1000 * motion.positions},
    "quaternions x, y, z, w": lambda motion: {
        "rotations": np.roll(motion.rotations, -1, axis=-1),
        "root": motion.root,
    },
    "Z up": z_up,
    "left and right exchanged": exchanged,
    "X to the right": mirrored,
    "x, y, z, w, not w, x, y, z, Z up": lambda motion: {
        "rotations": np.roll(z_up(motion)["rotations"], -1, axis=-1),
        "root": z_up(motion)["root"],
    },
}


@pytest.mark.parametrize("sign", CONVENTIONS)
def test_other_conventions_are_named_beside_the_row(tmp_path, sign):
    """Lively answers of a person under another convention: scored, and doubted in the table."""
    body, other = (editing_bodies.body(size=size) for size in (1.0, 1.2))
    lively = body.motion(performance(body, 30), np.tile([0.1, 1.0, 0.2], (30, 1)), 30.0)
    right = transfer.carry(lively, other, "height")
    info = CaseInfo(id="c", task="retarget", split="cross", source="a", target="b", clip="clip")
    case = Case(info, lively, other, reference=right)
    np.savez(tmp_path / "c.npz", **CONVENTIONS[sign](right))
    outcome = shard_work.elsewhere(tmp_path, case)
    assert outcome.status == "ok"
    assert outcome.message.startswith("the answers look as if they had ")
    assert sign in outcome.message
    np.savez(tmp_path / "c.npz", rotations=right.rotations, root=right.root)
    assert shard_work.elsewhere(tmp_path, case).message == ""


def test_doubts_stand_in_the_header_and_below_the_table(tmp_path, folder, cases):
    for case in cases:
        path = folder / f"{store.case_file(case.info.id)}.npz"
        np.savez(path, **z_up(case.reference))
    results = score(folder, tmp_path / "runs")
    (doubt,) = results.header.doubts
    assert (results.header.problems, len(doubt.cases)) == ((), len(cases))
    assert results.header.counts.ok == len(cases)
    assert {entry.message for entry in results.entries} == {doubt.message}
    tables = requested.tables([results.paths], requested.Request(variants=True))
    short = " ".join(text(tables).split())
    assert f"theirs gave odd answers to some cases (intra {len(cases)}): {doubt.message}" in short
    assert "Z up, not Y" in doubt.message
    assert "theirs doubted on" in " ".join(text(tables, notes=True).split())


def test_an_archive_that_unpacks_to_more_than_any_motion_is_not_read(tmp_path, cases):
    path = tmp_path / "bomb.npz"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("positions.npy", b"")
        archive.infolist()[0].file_size = 5_000_000_000
    assert path.stat().st_size < 1000
    with pytest.raises(FileError, match="unpacks to 5,000,000,000 bytes, more than"):
        predictions.read_prediction(path, cases[0].target, 30.0)
