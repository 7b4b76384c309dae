"""Flesh inside flesh: against libigl on a body whose hands are put into its belly."""

from __future__ import annotations

import numpy as np
import pytest

from retarget_bench.motion import penetration
from tests.motion.tubes import fleshed, hand_to_belly


def test_it_agrees_with_libigl_on_a_body_whatever_the_bounding_boxes_leave_out():
    igl = pytest.importorskip("igl")
    person = fleshed()
    vertices = person.mesh.skinned(motion := hand_to_belly(person))
    inside = np.zeros(vertices.shape[:2], dtype=bool)
    for each, now in zip(penetration.limbs(person), penetration.inside(person, vertices), strict=True):
        inside[:, each.tested] = now
    more = penetration.inside_mask(person, vertices)
    hands = np.isin(person.mesh.weights.argmax(axis=1), person.joints(("left_forearm", "right_forearm")))
    assert (more & hands).any(axis=1).tolist() == [False, True, True, True, True, True, False]
    strongest = person.mesh.weights.argmax(axis=1)
    roles = [str(person.roles[joint]) for joint in strongest]
    limb = np.array([f"{role.split('_')[0]} {'leg' in role or 'foot' in role}" for role in roles])
    limb[[role.startswith(("hips", "spine", "neck")) for role in roles]] = "rest"
    lower = np.array(
        [role.endswith(("_forearm", "_hand", "_leg", "_foot")) and "_up_" not in role for role in roles]
    )
    expected = np.zeros_like(inside)
    for name in set(limb) - {"rest"}:  # tubes are closed, so that no cut has to be
        others = person.mesh.faces[limb[person.mesh.faces[:, 0]] != name]
        tested = (limb == name) & lower
        for frame in range(motion.frames):
            turns = igl.winding_number(vertices[frame], others, vertices[frame][tested])
            expected[frame, tested] = turns > 0.5
    np.testing.assert_array_equal(inside, expected)
