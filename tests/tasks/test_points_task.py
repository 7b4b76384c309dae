"""The task ``points``: where its points lie, what methods are told, and a run from end to end."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from retarget_bench.api import Case, Context
from retarget_bench.api.comparison import Comparison
from retarget_bench.errors import BenchError, NotSupported
from retarget_bench.evaluation import predict, runner
from retarget_bench.evaluation.plan import data_of
from retarget_bench.evaluation.prediction import question_files as files
from retarget_bench.evaluation.prediction.limits import Limits, check_file
from retarget_bench.evaluation.prediction.workers import WorkerPool
from retarget_bench.evaluation.tasks import derive
from retarget_bench.evaluation.tasks.points import COUNT
from retarget_bench.motion.character import Surface
from retarget_bench.motion.motion import PointSets
from retarget_bench.motion.point_sets import unknown_body
from retarget_bench.motion.surface_sampling import sampled
from retarget_bench.plugins import bound, registry
from retarget_bench.plugins.prediction_check import Invalid, verified
from retarget_bench.plugins.spec import Spec
from retarget_bench.python.plans import default_methods, default_metrics
from retarget_bench.results import predictions, store
from tests.engine.small_plans import asked

TOYS = Path(__file__).parent / "toys"
PUPPETS = Spec.parse("puppets[size=tiny]")
pytestmark = pytest.mark.usefixtures("in_process")


@pytest.fixture(scope="module", autouse=True)
def _plugins():
    for name in ("rest_skin", "carried_skin", "toy_people", "few_puppets"):
        registry.add_file(TOYS / f"{name}.py")


@pytest.fixture(scope="module")
def case() -> Case:
    data = data_of(bound.dataset(PUPPETS), "points")
    return data.load(data.cases("points", "cross")[0])


def short(case: Case, frames: int = 4) -> Case:
    part = slice(0, frames)
    moved = case.source_motion
    return replace(
        case, source=case.source.at(part), reference=case.reference.at(part), source_motion=moved.at(part)
    )


# ------------------------------------------------------------------------------------------------- points
def test_points_are_uniform_by_area():
    # two triangles, of areas 1 and 3, in two frames; the second is twice as large
    corners = np.array([[0, 0, 0], [2, 0, 0], [0, 1, 0], [9, 0, 0], [12, 0, 0], [9, 2, 0]], dtype=float)
    vertices = np.stack([corners, 2 * corners])
    numbers = np.random.default_rng(0).random((2, 3, 20_000))
    points = sampled(vertices, np.array([[0, 1, 2], [3, 4, 5]]), numbers)
    points[1] /= 2
    second = points[..., 0] > 5
    assert second.mean() == pytest.approx(0.75, abs=4 * np.sqrt(0.75 * 0.25 / 40_000))
    inside = points[second] - (9.0, 0.0, 0.0)
    assert inside.min() >= 0
    assert (inside[:, 0] / 3 + inside[:, 1] / 2).max() <= 1 + 1e-12
    # the mean of a triangle is its centroid, and its x has the variance a^2 / 18
    assert inside[:, 0].mean() == pytest.approx(1.0, abs=0.02)
    assert inside[:, 0].var() == pytest.approx(9 / 18, rel=0.03)


def test_points_lie_on_the_sources_skin_and_are_fresh_in_each_frame(case):
    mesh, motion = case.source_motion.character.mesh, case.source_motion
    assert case.source.frames == motion.frames
    assert set(case.source.counts.tolist()) == {COUNT}
    skin = mesh.skinned(motion)
    for frame in (0, motion.frames - 1):
        points = case.source.points[frame][::64].astype(np.float64)
        a, b, c = (skin[frame][mesh.faces[:, corner]] for corner in range(3))
        normal = np.cross(b - a, c - a)
        # coordinates of every point in every triangle; some triangle holds it, and its plane is near
        off = points[:, None] - a
        area = (normal**2).sum(axis=1)
        v = (np.cross(b - a, off) * normal).sum(axis=2) / area
        w = (np.cross(off, c - a) * normal).sum(axis=2) / area
        height = np.abs((off * normal).sum(axis=2)) / np.sqrt(area)
        held = (v > -1e-3) & (w > -1e-3) & (v + w < 1 + 1e-3)
        assert np.where(held, height, np.inf).min(axis=1).max() < 1e-5
    assert not np.array_equal(case.source.points[0], case.source.points[1])


def test_a_case_is_the_same_whenever_it_is_loaded(case):
    data = derive(registry.create("datasets", PUPPETS), Spec("points"))
    again = data.load(data.cases("points", "cross")[0])
    assert again.info == case.info
    for one, two in zip(case.source.points, again.source.points, strict=True):
        assert np.array_equal(one, two)
    other = data.load(data.cases("points", "cross")[1])
    assert not np.array_equal(other.source.points[0], case.source.points[0])


def test_nothing_of_the_sources_body_is_told(case):
    body = case.source.character
    assert (len(body.skeleton), body.roles, body.structure) == (1, (None,), "points")
    assert body.mesh is None
    assert not body.joint_of
    plain = bound.dataset(PUPPETS).built.cases("retarget", "cross")[0]
    assert replace(case.info, task="retarget") == plain


def test_bodies_without_meshes_have_no_case():
    data = derive(registry.create("datasets", Spec.parse("toy_people[clips=6]")), Spec("points"))
    assert data.cases("points", "self") == []
    assert "of bodies without meshes" in data.notes[-1]
    with pytest.raises(NotSupported, match="has the task points"):
        data.cases("retarget", "self")
    with pytest.raises(BenchError, match="points has no parameter 'levels'; it has none"):
        derive(registry.create("datasets", PUPPETS), Spec("points", {"levels": "3"}))


# ------------------------------------------------------------------------------------------------- files
def test_points_and_skins_arrive_to_the_last_bit(tmp_path, case):
    ragged = PointSets(
        unknown_body("who"), (np.random.default_rng(0).random((5, 3)), np.ones((2, 3)), np.eye(3)), 25.0
    )
    for source in (ragged, short(case).source, ragged.at(slice(0, 0))):
        again = files.read_source(files.write_motion(tmp_path, "a", source), source.character)
        assert isinstance(again, PointSets)
        assert (again.fps, again.frames) == (source.fps, source.frames)
        for one, two in zip(source.points, again.points, strict=True):
            assert np.array_equal(one, two)
            assert one.dtype == two.dtype
    skin = Surface(
        case.target, np.random.default_rng(1).random((2, len(case.target.mesh.vertices), 3)), 30.0
    )
    again = files.read_motion(files.write_motion(tmp_path, "b", skin), case.target)
    assert np.array_equal(again.vertices, skin.vertices)


def test_a_stored_skin_is_what_was_scored(tmp_path, case):
    skin = predict.as_scored(
        case.target.surface(case.target.mesh.skinned(case.reference), case.reference.fps)
    )
    predictions.write_prediction(tmp_path / "p.npz", skin, "key")
    check_file(tmp_path / "p.npz", case)
    again = predictions.read_prediction(tmp_path / "p.npz", case.target, 1.0)
    assert np.array_equal(again.vertices, skin.vertices)
    assert np.array_equal(again.positions, skin.positions)


# ------------------------------------------------------------------------------------------------ answers
def test_skins_that_are_not_the_targets_are_refused(case):
    case = short(case)
    good = case.target.surface(case.target.mesh.skinned(case.reference), case.reference.fps)
    assert isinstance(verified(good, case), Surface)
    for wrong, why in (
        (np.full_like(good.vertices, np.nan), "4 frames with a vertex that is not finite"),
        (good.vertices + 1e6, "m away; lengths are in metres"),
    ):
        with pytest.raises(Invalid, match=why):
            verified(replace(good, vertices=wrong), case)
    other = replace(
        case.target.mesh, vertices=np.ones((5, 3)), weights=np.ones((5, 22)), faces=np.zeros((0, 3), int)
    )
    body = replace(
        case.target, skin=lambda: replace(other, weights=np.ones((5, len(case.target.skeleton))))
    )
    with pytest.raises(Invalid, match="returned 5 vertices; the mesh of"):
        verified(body.surface(np.zeros((4, 5, 3)), good.fps), case)
    with pytest.raises(Invalid, match="has no mesh"):
        verified(good, replace(case, target=replace(case.target, skin=None)))


def test_skins_are_compared_with_the_references(case):
    case = short(case)
    expected = case.target.mesh.skinned(case.reference)
    by_skin = Comparison(case, case.target.surface(expected + 0.01, case.reference.fps))
    np.testing.assert_allclose(by_skin.predicted_vertices - by_skin.expected_vertices, 0.01, atol=1e-12)
    by_rotations = Comparison(case, case.reference)
    assert np.array_equal(by_rotations.predicted_vertices, by_rotations.expected_vertices)
    by_joints = Comparison(case, case.target.positions(case.reference.positions, case.reference.fps))
    assert by_joints.predicted_vertices is None
    naked = replace(case, target=replace(case.target, skin=None))
    assert Comparison(naked, case.reference).expected_vertices is None


def test_privileged_methods_alone_see_the_motion(case):
    plain, privileged = (registry.create("methods", name) for name in ("rest_skin", "carried_skin"))
    data = data_of(bound.dataset(PUPPETS), "points")
    assert predict.context_for(plain, data, case, 0).source_motion is None
    motion = predict.context_for(privileged, data, case, 0).source_motion
    assert np.array_equal(motion.rotations, case.source_motion.rotations)
    refused = predict.predict(privileged, replace(case, source_motion=None), Context())
    assert refused.status == "unsupported"
    assert "needs the motion that the source is made of" in refused.message


# --------------------------------------------------------------------------------------------------- runs
def carried_out(root: Path, **changes) -> dict[tuple[str, str], store.Results]:
    usual = {"data": "few_puppets", "splits": ("self", "cross"), "metrics": ("position", "joint_speed")}
    plan = asked(root, "rest_skin", "carried_skin", "ik", task="points", **usual, **changes)
    places = runner.run(plan, lambda done, total: None)
    results = [] if plan.stage == "predict" else list(map(store.read_results, places))
    return {(each.header.method.name, each.header.split): each for each in results}


def bytes_of(root: Path) -> dict[str, bytes]:
    """Of all files of results but headers, which have the date."""
    paths = (path for path in root.rglob("*") if path.suffix in (".csv", ".npz"))
    return {str(path.relative_to(root)): path.read_bytes() for path in paths}


def test_a_run_from_end_to_end_and_resumed(tmp_path):
    results = carried_out(tmp_path / "a")
    for split in ("self", "cross"):
        rest, carried, copied = (results[name, split] for name in ("rest_skin", "carried_skin", "ik"))
        assert {entry.status for entry in copied.entries} == {"unsupported"}
        assert "this source is known by points only" in copied.header.problems[0].message
        for one, other in zip(rest.entries, carried.entries, strict=True):
            assert one.status == other.status == "ok"
            assert other.values["mpjpe_h.world"] < 3.0 < one.values["mpjpe_h.world"]
            assert not [name for name in one.values if name.startswith("joint_speed")]
    assert results["carried_skin", "self"].entries[0].values["mpjpe_h.world"] < 0.1
    first = bytes_of(tmp_path / "a")
    assert len([name for name in first if "--" in name]) == 4, "a prediction of each answer"
    # killed before a method's rows were written, and after predictions were
    (tmp_path / "a" / "few_puppets" / "points" / "cross" / "rest_skin.csv").unlink()
    carried_out(tmp_path / "a")
    assert bytes_of(tmp_path / "a") == first
    carried_out(tmp_path / "b", stage="predict")
    carried_out(tmp_path / "b")
    assert bytes_of(tmp_path / "b") == first


@pytest.mark.processes
def test_a_worker_is_sent_points_and_meshes_and_sends_a_skin(tmp_path, case):
    case = short(case)
    folder = tmp_path / "workers"
    pool = WorkerPool(folder, folder, registry.files(), Limits(timeout=60.0))
    data = data_of(bound.dataset(PUPPETS), "points")
    try:
        for name in ("rest_skin", "carried_skin"):
            method = registry.create("methods", name)
            context = predict.context_for(method, data, case, 0)
            (outcome,) = pool.worker(Spec(name)).ask([(case, context)])
            assert (outcome.status, outcome.message) == ("ok", "")
            here = predict.predict(method, case, context).prediction
            assert np.array_equal(outcome.prediction.vertices, here.vertices.astype(np.float32))
    finally:
        pool.close()


def test_controls_take_part_and_methods_for_skeletons_do_not(tmp_path, case):
    names = {spec.name for spec in default_methods("points", print)}
    assert {"reference", "other_clip", "rest_skin", "carried_skin"} <= names
    assert not names & {"ik", "copy_rotations", "humot", "rest_pose"}
    assert {"position", "joint_speed"} <= set(default_metrics("points", print))
    method = registry.create("methods", "reference")
    answer = predict.predict(
        method, case, predict.context_for(method, data_of(bound.dataset(PUPPETS), "points"), case, 0)
    )
    assert np.array_equal(answer.prediction.rotations, case.reference.rotations)


def test_point_sets_are_looked_at():
    body = unknown_body("who")
    with pytest.raises(BenchError, match="frame 1: points must be"):
        PointSets(body, (np.zeros((4, 3)), np.zeros((0, 3))), 30.0)
    with pytest.raises(BenchError, match="frame 0: points are not finite"):
        PointSets(body, (np.full((4, 3), np.nan),), 30.0)
    with pytest.raises(BenchError, match="no skeleton"):
        PointSets(bound.dataset(PUPPETS).built.characters()["ada"], (np.zeros((4, 3)),), 30.0)


def test_a_mesh_arrives_as_it_is(tmp_path, case):
    mesh = case.target.mesh
    again = files.read_mesh(files.write_mesh(tmp_path, "mesh", mesh))
    for name in ("vertices", "faces", "weights", "pose"):
        assert np.array_equal(getattr(again, name), getattr(mesh, name))
