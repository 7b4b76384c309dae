"""The puppets' skins: closed, outward, on the bones, and the same everywhere."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from retarget_bench.datasets.puppets.generator.bodies import meshes, rigs
from retarget_bench.datasets.puppets.generator.bodies.characters import BODIES, DOGS
from retarget_bench.datasets.puppets.generator.bodies.meshes import surface
from retarget_bench.datasets.puppets.generator.bodies.structures import Body
from retarget_bench.datasets.puppets.generator.bodies.volume import BodyVolume
from retarget_bench.datasets.puppets.generator.conventions import SIDES
from retarget_bench.motion import rotation
from retarget_bench.motion.mesh import Mesh

pytestmark = pytest.mark.slow


@pytest.fixture(params=(*BODIES.values(), *DOGS.values()), ids=lambda body: body.name)
def skinned(request: pytest.FixtureRequest) -> tuple[Body, Mesh]:
    mesh = rigs.character(request.param).mesh
    assert mesh is not None
    return request.param, mesh


def edges(mesh: Mesh) -> np.ndarray:
    """Of every triangle, as it goes round."""
    return np.concatenate([mesh.faces[:, [0, 1]], mesh.faces[:, [1, 2]], mesh.faces[:, [2, 0]]])


def volume(vertices: np.ndarray, faces: np.ndarray) -> float:
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    return float((a * np.cross(b, c)).sum() / 6.0)


def test_the_skin_is_one_closed_surface_facing_outward(skinned: tuple[Body, Mesh]) -> None:
    mesh = skinned[1]
    directed = edges(mesh)
    # each edge once in either direction: two faces meet in it, and they agree on what is outside
    assert len(np.unique(directed, axis=0)) == len(directed)
    assert {tuple(edge) for edge in directed.tolist()} == {(b, a) for a, b in directed.tolist()}
    assert len(mesh.vertices) - len(directed) // 2 + len(mesh.faces) == 2
    # a litre of body weighs about a kilogram
    mass, body = 1000.0 * volume(mesh.vertices, mesh.faces), skinned[0]
    if body.name in DOGS:
        # greyhounds of 30 kg and mastiffs of 75 are about 120 and 250 kg over length and height
        sizes = body.proportions
        assert 80.0 < mass / (sizes.trunk**2 * (sizes.leg + sizes.pelvis)) < 320.0
    else:
        # body mass indices from very thin to very heavy
        assert 8.0 < mass / np.ptp(mesh.vertices[:, 1]) ** 2 < 70.0
    assert 1700 < len(mesh.vertices) < 2300
    assert np.array_equal(np.unique(mesh.faces), np.arange(len(mesh.vertices)))


def test_it_stands_on_the_floor_and_holds_the_bones(skinned: tuple[Body, Mesh]) -> None:
    body, mesh = skinned
    p = body.proportions
    places = body.positions(np.tile(np.eye(3), (1, len(body.offsets), 1, 1)), body.offsets[:1])[0]
    height = p.leg + p.pelvis + p.trunk + p.neck + p.head
    if body.name in DOGS:  # the skull is highest, a third of the head's length wide
        height = float(places[body.part["head"], 1]) + 0.24 * p.head
    assert abs(mesh.vertices[:, 1].min()) < 0.002
    assert abs(mesh.vertices[:, 1].max() - height) < 0.03 * height
    solid = BodyVolume(body, 0.0)
    inner = [j for part, j in body.part.items() if not part.endswith(("_end", "_top"))]
    assert solid.field(places[inner]).max() < 0.0


def test_weights_are_shares_and_every_bone_moves_its_own_skin(skinned: tuple[Body, Mesh]) -> None:
    body, mesh = skinned
    np.testing.assert_allclose(mesh.weights.sum(axis=1), 1.0, atol=1e-12)
    assert mesh.weights.min() >= 0.0
    joints = body.structure.joints
    moving = [body.part[f"{side}_{part}"] for side in SIDES for part in ("leg", "forearm", "hand")]
    assert mesh.weights.shape == (len(mesh.vertices), joints)
    assert (mesh.weights[:, [*moving, body.part["head"]]].max(axis=0) > 0.75).all()
    # a limb has no say in the other side's skin
    far = mesh.vertices[:, 0] > body.proportions.hip_half
    right = [j for part, j in body.part.items() if part.startswith("right") and j < joints]
    assert mesh.weights[far][:, right].max() < 0.1


def test_the_rigs_t_pose_shows_the_skin_as_drawn_and_turns_it_whole(skinned: tuple[Body, Mesh]) -> None:
    body, mesh = skinned
    who = rigs.character(body)
    pose = np.stack([who.reference_pose] * 2)
    turn = rotation.from_rotation_vector(np.array([0.3, 1.0, -0.4]))
    pose[1, 0] = rotation.multiply(turn, pose[1, 0])
    root = np.stack([who.skeleton.offsets[0], np.array([1.0, 2.0, 3.0])])
    still, turned = mesh.skinned(who.motion(pose, root, 30.0))
    np.testing.assert_allclose(still, mesh.vertices, atol=1e-9)
    expected = rotation.rotate(turn, mesh.vertices - root[0]) + root[1]
    np.testing.assert_allclose(turned, expected, atol=1e-9)


def test_no_node_of_the_grid_is_so_near_the_skin_that_rounding_could_decide(monkeypatch) -> None:
    """What side a node lies on decides triangles; it must not hang on a last digit."""
    closest = []

    def watched(field, low, high, step):
        def nodes(points: np.ndarray) -> np.ndarray:
            values = field(points)
            if not first:
                first.append(float(np.abs(values).min()))
            return values

        first: list[float] = []  # the grid is asked for before anything else
        drawn = surface(nodes, low, high, step)
        closest.extend(first)
        return drawn

    monkeypatch.setattr(meshes, "surface", watched)
    for body in (*list(BODIES.values())[::4], *list(DOGS.values())[::3]):
        meshes._built(body)
    assert len(closest) == 2 * (len(list(BODIES)[::4]) + len(list(DOGS)[::3]))
    assert min(closest) > 1e-9


def test_a_mesh_is_kept_on_disk_and_drawn_again_when_damaged(cache: Path) -> None:
    first = rigs.character(BODIES["pip"]).mesh
    (file,) = cache.rglob("pip-*.npz")
    before = file.stat().st_mtime_ns
    again = rigs.character(BODIES["pip"]).mesh
    assert file.stat().st_mtime_ns == before
    file.write_bytes(file.read_bytes()[:-200])
    rebuilt = rigs.character(BODIES["pip"]).mesh
    for other in (again, rebuilt):
        np.testing.assert_array_equal(other.vertices, first.vertices)
        np.testing.assert_array_equal(other.faces, first.faces)


def ball(points: np.ndarray) -> np.ndarray:
    return np.linalg.norm(points - np.array([0.01, 0.02, 0.03]), axis=-1) - 0.5


def test_a_ball_has_its_area_and_volume() -> None:
    vertices, faces = surface(ball, -np.ones(3), np.ones(3), 0.04)
    np.testing.assert_allclose(ball(vertices), 0.0, atol=1e-9)
    assert volume(vertices, faces) == pytest.approx(4.0 / 3.0 * np.pi * 0.125, rel=0.01)
    assert len(vertices) == pytest.approx(1.5 * np.pi / 0.04**2, rel=0.05)
