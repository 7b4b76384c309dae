"""Limbs in flesh: balls that overlap by a known share, libigl's winding numbers, and bodies at rest."""

from __future__ import annotations

from dataclasses import replace
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest
from mesh_cases import as_surface, ball, body_of, sides, skin
from metric_cases import Sides, compute, motion

from retarget_bench.datasets.puppets import plugin as Puppets
from retarget_bench.metrics.self_penetration import nearest_normal
from retarget_bench.motion.character import Character
from retarget_bench.motion.mesh import Mesh
from retarget_bench.motion.penetration import distances, inside, winding
from retarget_bench.motion.skeleton import Skeleton

limb_files = import_module("retarget_bench.motion.penetration.limbs")


def standing(body: Character, frames: int = 1) -> np.ndarray:
    """``(frames, V, 3)`` the body's vertices in its reference pose."""
    pose = np.repeat(body.reference_pose[None], frames, axis=0)
    return skin(body.motion(pose, np.zeros((frames, 3)), 30.0), body)


def hand_at(apart: float, radii: tuple[float, float]) -> Sides:
    """A body of two balls, one on a hand and one on the trunk, in one frame: their middles so far apart."""
    still = {"LeftHand": (radii[0], (0.0, 0.0, 0.0)), "Spine1": (radii[1], (0.0, 0.0, 0.0))}
    body = body_of(still, rounds=4)
    places, size = standing(body), len(body.mesh.vertices) // 2
    towards = np.array([2.0, 1.0, -2.0]) / 3.0
    shift = places[0, size:].mean(axis=0) + apart * towards - places[0, :size].mean(axis=0)
    predicted = places.copy()
    predicted[:, :size] += shift
    case = Sides(motion(body, 1, 0), motion(body, 1, 1), body.surface(places, 30.0))
    return as_surface(case, predicted)


@pytest.mark.parametrize("apart", [0.05, 0.16, 0.2, 0.23, 0.26])
def test_two_balls_overlap_by_the_share_that_geometry_says(apart: float) -> None:
    r, big = 0.1, 0.15
    case = hand_at(apart, (r, big))
    values = compute("self_penetration", case)
    plane = (apart**2 + r**2 - big**2) / (2.0 * apart)
    share = 100.0 * np.clip((1.0 - plane / r) / 2.0, 0.0, 1.0)
    for id_ in ("self_penetration", "self_penetration.over_rest", "self_penetration.over_reference"):
        assert values[id_] == pytest.approx(share, abs=1.5 if share else 0.0), id_
    # the deepest point is the one nearest to the middle of the big ball, which all of the small may be in
    depth = big - max(apart - r, r - apart if apart < r else 0.0)
    metres = values["self_penetration.depth_h"] * case.predicted.character.height / 100.0
    expected = max(depth, 0.0) if apart > r else big - 0.05
    assert metres == pytest.approx(expected, abs=2e-3 if share else 0.0)


def test_what_is_inside_at_rest_or_in_the_reference_is_no_excess() -> None:
    body = body_of({"LeftHand": (0.06, (0.0, 0.0, 0.0)), "Head": (0.1, (0.0, 0.0, 0.0))})
    mesh = body.mesh
    size = len(mesh.vertices) // 2
    # a head so large that the hand is in it at rest
    vertices = mesh.vertices.copy()
    vertices[size:] = (vertices[size:] - vertices[size:].mean(axis=0)) * 20.0 + vertices[:size].mean(axis=0)
    mesh = replace(mesh, vertices=vertices)
    large = replace(body, skin=lambda: mesh)
    rest = large.motion(np.repeat(large.reference_pose[None], 4, axis=0), np.zeros((4, 3)), 30.0)
    case = Sides(rest, rest, rest)
    values = compute("self_penetration", case)
    assert values["self_penetration"] == pytest.approx(100.0)
    assert values["self_penetration.over_rest"] == values["self_penetration.over_reference"] == 0.0


def test_left_out_without_a_mesh_limbs_or_a_reference() -> None:
    case = sides(4)
    assert compute("self_penetration", case.by_positions()) == {}
    trunk = body_of({"Spine1": (0.1, (0.0, 0.0, 0.0))})
    alone = Sides(*(motion(trunk, 3, seed) for seed in range(3)))
    assert compute("self_penetration", alone) == {}
    values = compute("self_penetration", replace(case, expected=None))
    assert "self_penetration" in values
    assert "self_penetration.over_reference" not in values


def blob() -> tuple[np.ndarray, np.ndarray]:
    """Two balls that overlap."""
    points, faces = ball(3)
    both = np.concatenate([points, points * 0.8 + [0.7, 0.1, 0.0]])
    return both, np.concatenate([faces, faces + len(points)])


def test_rays_and_solid_angles_agree_with_libigl() -> None:
    igl = pytest.importorskip("igl")
    points, faces = blob()
    queries = np.random.default_rng(0).uniform(-1.5, 2.0, size=(400, 3))
    # on the planes and axes of symmetry, where rays along an axis would hit edges
    queries = np.concatenate(
        [queries, np.zeros((1, 3)), 0.5 * np.eye(3), [[0.7, 0.1, 0.0], [0.35, 0.05, 0.0]]]
    )
    true = igl.winding_number(points, faces.astype(np.int64), queries)
    assert winding.is_closed(faces)
    assert winding.winding_numbers(queries, points, faces, closed=True) == pytest.approx(true, abs=1e-9)
    assert winding.winding_numbers(queries, points, faces) == pytest.approx(true, abs=1e-9)
    assert set(np.round(true)) == {0, 1, 2}
    holes = faces[100:]
    assert not winding.is_closed(holes)
    true = igl.winding_number(points, holes.astype(np.int64), queries)
    assert winding.winding_numbers(queries, points, holes) == pytest.approx(true, abs=1e-9)
    assert np.abs(true - np.round(true)).max() > 0.1


def test_a_ray_through_edges_and_corners_is_counted_once() -> None:
    points, faces = ball(2)
    # along the ray from points inside to every vertex and to the middle of every edge
    inner = 0.3 * np.random.default_rng(0).normal(size=(3, 3)) / 3.0
    ray = winding._VIEW[:, 0]
    targets = np.concatenate([points, points[faces].mean(axis=1), points[faces[:, :2]].mean(axis=1)])
    queries = np.concatenate([targets - reach * ray for reach in (0.05, 0.4, 1.0)] + [inner])
    by_rays = winding.winding_numbers(queries, points, faces, closed=True)
    by_angles = winding.winding_numbers(queries, points, faces)
    clear = np.abs(by_angles - np.round(by_angles)) < 1e-6
    assert clear.mean() > 0.95
    assert by_rays[clear] == pytest.approx(by_angles[clear], abs=1e-6)


def puppet(name: str) -> Character:
    return Puppets().characters()[name]


@pytest.mark.parametrize("name", ["ada", "sumo", "lena", "rex"])
def test_the_rest_of_a_puppet_is_closed_and_holds_its_limbs_nowhere(name: str) -> None:
    """All four limbs; cut off and capped, the rest is a closed surface around some of the body's volume."""
    body = puppet(name)
    limbs = limb_files.limbs(body)
    assert [limb.name for limb in limbs] == ["left_arm", "left_up_leg", "right_arm", "right_up_leg"]
    places = standing(body)[0]

    def volume(vertices: np.ndarray, faces: np.ndarray) -> float:
        return float(np.linalg.det(vertices[faces]).sum() / 6.0)

    for limb in limbs:
        assert limb.sealed
        assert len(limb.rims) == 1
        part = volume(*limb.closed(places)) / volume(places, body.mesh.faces)
        assert 0.7 < part < 0.99
        assert limb.areas.sum() / limb_files.vertex_areas(body.mesh).sum() < 0.2
    assert not any(each.any() for each in inside(body, standing(body)))


def test_a_hand_put_into_the_belly_is_found_as_libigl_finds_it() -> None:
    igl = pytest.importorskip("igl")
    body = puppet("ada")
    places, names = standing(body)[0], body.joint_of
    arm = next(limb for limb in limb_files.limbs(body) if limb.name == "left_arm")
    own = limb_files.moved_vertices(body.mesh, body.skeleton, names["left_arm"])
    joints = body.motion(body.reference_pose[None], np.zeros((1, 3)), 30.0).positions[0]
    moved_arm = places.copy()
    moved_arm[own] += joints[names["hips"]] - joints[names["left_hand"]]
    inside_body = inside(body, moved_arm[None])[0][0]
    vertices, faces = arm.closed(moved_arm)
    true = igl.winding_number(vertices, faces.astype(np.int64), moved_arm[arm.tested]) > 0.5
    assert (inside_body == true).all()
    assert 0.2 < inside_body.mean() < 1.0
    depth = distances.deepest(moved_arm[arm.tested[inside_body]], moved_arm, arm.faces)
    square = igl.point_mesh_squared_distance(
        moved_arm[arm.tested[inside_body]], moved_arm, arm.faces.astype(np.int64)
    )
    assert depth == pytest.approx(float(np.sqrt(square[0].max())), rel=1e-9)


def test_distances_to_triangles_against_a_fine_grid() -> None:
    rng = np.random.default_rng(3)
    corners, points = rng.normal(size=(30, 3, 3)), 1.5 * rng.normal(size=(30, 3))
    steps = np.stack(np.meshgrid(*[np.linspace(0.0, 1.0, 201)] * 2), axis=-1).reshape(-1, 2)
    steps = steps[steps.sum(axis=1) <= 1.0]
    shares = np.column_stack([1.0 - steps.sum(axis=1), steps])
    grid = np.linalg.norm(points[:, None] - np.einsum("sk,nkc->nsc", shares, corners), axis=2).min(axis=1)
    distance = distances.to_triangles(points, corners)
    assert (distance <= grid + 1e-12).all()
    assert distance == pytest.approx(grid, abs=0.02)


def by_loops(body: Character, places: np.ndarray) -> float:
    """Per cent of vertices of limbs that the published test counts, vertex by vertex."""
    mesh, hits, total = body.mesh, 0, 0
    normals = np.zeros_like(places)
    for face in mesh.faces:
        a, b, c = places[face]
        normals[face] += np.cross(b - a, c - a)
    part = [body.roles[joint] or "" for joint in mesh.weights.argmax(axis=1)]
    for side in ("left", "right"):
        for kinds in (("arm", "forearm", "hand"), ("leg", "foot", "toe")):
            own = np.array([each in {f"{side}_{kind}" for kind in kinds} for each in part])
            rest = np.flatnonzero(~own)
            for v in places[own]:
                n = rest[np.argmin(((places[rest] - v) ** 2).sum(axis=1))]
                hits += (places[n] - v) @ normals[n] > 0
                total += 1
    return 100.0 * hits / total


def test_the_published_test_calls_a_tenth_of_a_body_at_rest_inside() -> None:
    """By normals limbs in a T-pose are in the body; by winding numbers none is."""
    body = puppet("ada")
    still = body.motion(np.repeat(body.reference_pose[None], 4, axis=0), np.zeros((4, 3)), 30.0)
    values = compute("self_penetration", Sides(still, still, still))
    assert values["star_penetration"] == pytest.approx(by_loops(body, skin(still, body)[0]), rel=1e-9)
    assert values["star_penetration"] == values["star_penetration.rest"] > 10.0
    assert values["self_penetration"] == 0.0


PARENTS = {
    **{"Spine": "Hips", "Spine1": "Spine", "Spine2": "Spine1", "Neck": "Spine2", "Head": "Neck"},
    **{
        f"{side}{joint}": parent if parent in ("Hips", "Spine2") else f"{side}{parent}"
        for side in ("Left", "Right")
        for joint, parent in (
            *(("UpLeg", "Hips"), ("Leg", "UpLeg"), ("Foot", "Leg"), ("ToeBase", "Foot")),
            *(("Shoulder", "Spine2"), ("Arm", "Shoulder"), ("ForeArm", "Arm"), ("Hand", "ForeArm")),
        )
    },
}


def shape(path: Path) -> Character:
    """A Mixamo character of the files that R2ET came with, in its T-pose, centimetres."""
    with np.load(path) as file:
        names = tuple(str(name) for name in file["joint_names"])
        parents = np.array([names.index(PARENTS[name]) if name in PARENTS else -1 for name in names])
        weights = file["skinning_weights"].astype(float)
        mesh = Mesh(file["rest_vertices"].astype(float), file["rest_faces"].astype(int), weights)
        body = Character.of(path.stem, Skeleton(names, parents, file["skeleton"].astype(float)))
    return replace(body, skin=lambda: mesh)


def test_published_penetration_of_mixamo_characters_in_their_t_pose(real_data: Path) -> None:
    folder = real_data / "mixamo_r2et" / "shapes"
    if not folder.is_dir():
        pytest.skip("no shapes of Mixamo characters in the real data")
    bodies = {name: shape(folder / f"{name}.npz") for name in ("Castle_Guard", "Ortiz")}
    posed = {name: body.mesh.vertices[None] for name, body in bodies.items()}
    rates = {name: 100.0 * nearest_normal.rate(body, posed[name]) for name, body in bodies.items()}
    assert rates == pytest.approx({"Castle_Guard": 11.8, "Ortiz": 58.1}, abs=0.1)
    assert not any(each.any() for name, body in bodies.items() for each in inside(body, posed[name]))
