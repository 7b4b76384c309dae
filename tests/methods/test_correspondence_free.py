"""The correspondence-free pipeline: online as offline, what it reads of the target, and remeshed bodies."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import skr_material
import torch

from retarget_bench.api import Context, PointSets
from retarget_bench.errors import NotSupported
from retarget_bench.evaluation.tasks.points import points_of
from retarget_bench.methods import correspondence_free, skr
from retarget_bench.methods.correspondence_free import CorrespondenceFree
from retarget_bench.methods.correspondence_free.online import Networks, OnlineRetargeter, estimated_body
from retarget_bench.methods.skin import SKIN
from retarget_bench.methods.skin.network import SkinningPredictor
from retarget_bench.methods.skr import SKR
from retarget_bench.methods.smrm import SMRM
from retarget_bench.motion import facing
from retarget_bench.motion.body22 import Body22
from retarget_bench.motion.mesh import Mesh
from retarget_bench.motion.skeleton import Skeleton
from retarget_bench.training.layers import exported
from retarget_bench.training.layers.skinned_body import SkinnedBody

FRAMES = 6


@pytest.fixture(autouse=True)
def _untrained(request, monkeypatch):
    """Networks that have learned nothing find joints at rest of few points, and know no pose."""
    if "shipped" not in request.fixturenames:
        monkeypatch.setattr(skr, "SPOTS", 128)
        as_it_is = lambda networks, vertices, faces: (vertices, ())  # noqa: E731
        monkeypatch.setattr(correspondence_free, "into_t_pose", as_it_is)


@pytest.fixture(scope="module")
def method():
    """Stages that have learned nothing, but for SMRM, whose weights are shipped."""
    torch.manual_seed(0)
    method = CorrespondenceFree()
    skin = SKIN().using(exported(SkinningPredictor()))
    skin.__dict__["_regressor"] = skr_material.untrained()
    method.__dict__["networks"] = Networks(skr_material.untrained(), SMRM(), skin)
    return method


@pytest.fixture(scope="module")
def source():
    return points_of(skr_material.motions()["ada"].at(slice(FRAMES)), "case")


def carried(method, source, target) -> np.ndarray:
    return method.retarget(source, target, context=Context()).vertices


def test_frame_by_frame_is_the_same_as_all_at_once(method, source):
    target = skr_material.body("boris")
    complete = carried(method, source, target)
    assert complete.shape == (FRAMES, len(target.mesh.vertices), 3)
    online = method.online(target)
    for points, expected in zip(source.points, complete, strict=True):
        np.testing.assert_allclose(online.frame(points), expected, atol=1e-5)


@pytest.mark.parametrize("path", ["relative", "integrated"])
def test_chunks_of_any_size_give_what_the_whole_gives(method, path):
    """Joints that jump about, and frames in which no direction shows."""
    joints = np.random.default_rng(0).normal(size=(12, 22, 3)) * 0.3 + [0.0, 1.0, 0.0]
    joints[[0, 5, 6]] *= [0.0, 1.0, 0.0]
    stages = replace(method.networks, smrm=SMRM(path=path))
    mesh = skr_material.body().mesh
    answers = []
    for sizes in ((12,), (1,) * 12, (5, 1, 6)):
        online, parts, first = OnlineRetargeter(stages, mesh.vertices, mesh.faces), [], 0
        for size in sizes:
            parts.append(online.motion(joints[first : first + size]).positions)
            first += size
        answers.append(np.concatenate(parts))
    np.testing.assert_allclose(answers[0], answers[1], atol=1e-5)
    np.testing.assert_allclose(answers[0], answers[2], atol=1e-5)


@pytest.mark.parametrize("path", ["relative", "integrated"])
def test_moves_as_smrm_does_where_joints_are_exact(path):
    """The same features and path as the method ``smrm`` has, once the sizes of both bodies are told."""
    torch.manual_seed(0)
    motion = skr_material.motions()["ada"].at(slice(40))
    smrm, mesh = SMRM(path=path), skr_material.body("boris").mesh
    skin = SKIN().using(exported(SkinningPredictor()))
    rest = SkinnedBody.of(skr_material.body("boris")).resting

    class Exact(SKR):
        def resting(self, vertices, faces, draws=1):
            return rest[None]

    online = OnlineRetargeter(Networks(Exact(), smrm, skin), mesh.vertices, mesh.faces)
    height = motion.character.measures.hip_height
    online._units = lambda joints: np.full(len(joints), height)
    moved = online.motion(motion.positions[:, list(Body22(motion.character).joints)])
    expected = smrm.retarget(motion, skr_material.body("boris"), context=Context())
    ranks = list(Body22(expected.character).joints)
    apart = np.abs(moved.positions - expected.positions[:, ranks]).max()
    assert apart < 2e-3 * moved.character.height  # bones of a solved motion bend by a micrometre


@pytest.mark.parametrize("angle", [0.5 * np.pi, -2.0, np.pi])
def test_a_target_may_face_anywhere(angle):
    motion, mesh = skr_material.motions()["ada"].at(slice(10)), skr_material.body("boris").mesh
    rest, turn = SkinnedBody.of(skr_material.body("boris")).resting, np.exp(1j * angle)
    skin = SKIN().using(exported(SkinningPredictor()))
    answers = []
    for vertices, joints in (
        (mesh.vertices, rest),
        (facing.placed(mesh.vertices, turn), facing.placed(rest, turn)),
    ):

        class Exact(SKR):
            def resting(self, vertices, faces, draws=1, joints=joints):
                return joints[None]

        online = OnlineRetargeter(Networks(Exact(), SMRM(), skin), vertices, mesh.faces)
        answers.append(
            online.mesh.skinned(online.motion(motion.positions[:, list(Body22(motion.character).joints)]))
        )
    np.testing.assert_allclose(answers[1], answers[0], atol=1e-5)


def test_the_target_s_skeleton_and_weights_are_not_read(method, source):
    target = skr_material.body("boris")
    mesh, skeleton = target.mesh, target.skeleton
    numbers = np.random.default_rng(0)
    weights = numbers.dirichlet(np.ones(len(skeleton)), size=len(mesh.vertices))
    scrambled = replace(
        target,
        skeleton=Skeleton(skeleton.names, skeleton.parents, numbers.normal(size=skeleton.offsets.shape)),
        skin=lambda: Mesh(mesh.vertices, mesh.faces, weights),
    )
    np.testing.assert_array_equal(carried(method, source, scrambled), carried(method, source, target))


@pytest.mark.parametrize("fps", [24.0, 60.0])
def test_other_rates_and_numbers_of_points(method, source, fps):
    thin = tuple(each[: 50 + 20 * k] for k, each in enumerate(source.points))
    answer = method.retarget(PointSets(source.character, thin, fps), skr_material.body(), context=Context())
    assert (answer.frames, answer.fps) == (FRAMES, fps)
    assert np.isfinite(answer.vertices).all()


def test_the_estimated_body_rests_in_its_t_pose():
    joints = SkinnedBody.of(skr_material.body()).resting
    body = estimated_body(joints)
    still = body.motion(np.tile([1.0, 0.0, 0.0, 0.0], (1, 22, 1)), joints[None, 0], 30.0)
    np.testing.assert_allclose(still.positions[0], joints, atol=1e-12)
    assert body.measures.hip_height == pytest.approx(skr_material.body().measures.hip_height, rel=1e-6)


def test_says_what_it_cannot_do(method, source):
    ada = skr_material.body()
    assert method.supports(source.character, ada) is None
    assert "mesh" in method.supports(source.character, replace(ada, skin=None))
    with pytest.raises(NotSupported, match="points"):
        carried(method, skr_material.motions()["ada"], ada)


# ------------------------------------------------------------------------- bodies remeshed, with weights
@pytest.fixture(scope="module")
def shipped():
    method = CorrespondenceFree()
    if reason := method.untrained:
        pytest.skip(reason)
    return method


def test_half_the_vertices_and_other_faces_change_less_than_a_centimetre(shipped):
    motion = skr_material.motions()["ada"].at(slice(0, 60))
    source, mesh = points_of(motion, "case"), skr_material.body("boris").mesh
    numbers = np.random.default_rng(0)
    joints = shipped.networks.skr.joints(source.points)
    order = numbers.permutation(len(mesh.faces))
    thin, faces, kept = skr_material.halved(mesh)
    assert len(thin) < 0.54 * len(mesh.vertices)
    surfaces = []
    for vertices, triangles in ((mesh.vertices, mesh.faces), (mesh.vertices, mesh.faces[order])):
        online = OnlineRetargeter(shipped.networks, vertices, triangles)
        surfaces.append(online.mesh.skinned(online.motion(joints)))
    assert np.linalg.norm(surfaces[0] - surfaces[1], axis=-1).mean() < 0.01
    online = OnlineRetargeter(shipped.networks, thin, faces)
    there = online.mesh.skinned(online.motion(joints))
    common = np.flatnonzero(kept >= 0)  # vertices that both meshes have
    originals = kept[common]
    np.testing.assert_array_equal(thin[common], mesh.vertices[originals])
    assert len(common) > 50
    assert np.linalg.norm(there[:, common] - surfaces[0][:, originals], axis=-1).mean() < 0.01
    other = points_of(motion, "another case")
    online = OnlineRetargeter(shipped.networks, mesh.vertices, mesh.faces)
    again = online.mesh.skinned(online.motion(shipped.networks.skr.joints(other.points)))
    assert np.linalg.norm(again - surfaces[0], axis=-1).mean() < 0.02  # other points of the same source
