"""Clothed puppets: the bare skin's vertices, moved outward as cloth lies, and nothing else changed."""

from __future__ import annotations

import numpy as np
import pytest

from retarget_bench.datasets.puppets import plugin as Puppets
from retarget_bench.datasets.puppets.generator.bodies import clothes, rigs
from retarget_bench.datasets.puppets.generator.bodies.characters import BODIES, DOGS
from retarget_bench.datasets.puppets.generator.bodies.structures import Body
from retarget_bench.datasets.puppets.generator.bodies.volume import BodyVolume
from retarget_bench.errors import BenchError
from retarget_bench.motion.mesh import Mesh

Both = tuple[Body, Mesh, Mesh]


@pytest.fixture(params=("ada", "sumo", "moppet", "rex"))
def both(request: pytest.FixtureRequest) -> Both:
    body = (BODIES | DOGS)[request.param]
    bare, clothed = rigs.character(body).mesh, rigs.character(body, "clothed").mesh
    assert bare is not None
    assert clothed is not None
    return body, bare, clothed


def volume(mesh: Mesh) -> float:
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    return float((a * np.cross(b, c)).sum() / 6.0)


def test_triangles_weights_and_order_are_those_of_the_skin(both: Both) -> None:
    _, bare, clothed = both
    np.testing.assert_array_equal(clothed.faces, bare.faces)
    np.testing.assert_array_equal(clothed.weights, bare.weights)
    directed = np.concatenate(
        [clothed.faces[:, [0, 1]], clothed.faces[:, [1, 2]], clothed.faces[:, [2, 0]]]
    )
    assert {tuple(edge) for edge in directed.tolist()} == {(b, a) for a, b in directed.tolist()}


def test_cloth_lies_on_or_off_the_flesh_and_never_in_it(both: Both) -> None:
    body, bare, clothed = both
    off = np.linalg.norm(clothed.vertices - bare.vertices, axis=-1)
    assert BodyVolume(body, 0.0).field(clothed.vertices).min() > -1e-4
    assert off.max() < (1.0 + 0.6) * 0.5 * body.proportions.girth
    assert 0.1 < off.mean() / body.proportions.girth < 0.4
    assert volume(clothed) > 1.2 * volume(bare)


def test_no_triangle_turns_over(both: Both) -> None:
    across = []
    for mesh in both[1:]:
        a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
        across.append(np.cross(b - a, c - a))
    assert (across[0] * across[1]).sum(axis=-1).min() >= 0.0


def test_cloth_is_as_loose_as_the_joints_under_it_allow(both: Both) -> None:
    body, bare, clothed = both
    loose = clothes.looseness(body)
    off = np.linalg.norm(clothed.vertices - bare.vertices, axis=-1)
    assert (off <= 1.6 * bare.weights @ loose + 1e-9).all()
    parts = body.structure.parts[: body.structure.joints]
    uncovered = [part for part, each in zip(parts, loose, strict=True) if not each]
    assert {"head", "neck", "left_foot", "right_hand"} & set(parts) <= set(uncovered)
    assert {"hips", "left_up_leg", "right_forearm"} & set(uncovered) == set()
    if body.name == "ada":  # the skin of a hand, and of a thigh
        hand, thigh = (bare.weights[:, parts.index(part)] > 0.9 for part in ("left_hand", "left_up_leg"))
        assert off[hand].max() < 3e-3
        assert off[thigh].mean() > 1e-2


def test_the_data_set_differs_in_skin_and_name_alone() -> None:
    bare, clothed = Puppets(), Puppets(flesh="clothed")
    (info, *_) = bare.cases("retarget", "intra")
    assert clothed.cases("retarget", "intra") == bare.cases("retarget", "intra")
    one, two = bare.load(info), clothed.load(info)
    np.testing.assert_array_equal(one.reference.positions, two.reference.positions)  # type: ignore[union-attr]
    for naked, dressed in ((one.source, two.source), (one.target, two.target)):
        bodies = [getattr(each, "character", each) for each in (naked, dressed)]
        assert np.abs(bodies[0].mesh.vertices - bodies[1].mesh.vertices).max() > 0.005
    assert clothed.content != bare.content
    assert "clothed" in clothed.content
    assert clothed.label == f"{bare.label}, clothed"
    assert clothed.validation().label == f"{bare.validation().label.split(', ')[0]}, clothed, validation"
    with pytest.raises(BenchError, match="bare or clothed"):
        Puppets(flesh="naked")  # type: ignore[arg-type]
