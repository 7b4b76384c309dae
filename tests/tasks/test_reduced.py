"""Characters of which some joints are left: a proper tree, roles and measures kept, places as they were."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from retarget_bench.errors import SkeletonError
from retarget_bench.evaluation.tasks.definitions import reduced
from retarget_bench.motion import kinematics
from tests.tasks.toys.toy_people import TREE, body

BODY = body("ann", 1.0)
NAMES = tuple(TREE)


def in_reference_pose(character) -> np.ndarray:
    return kinematics.forward(character.skeleton, character.reference_pose, np.zeros(3))[0]


@given(st.sets(st.integers(0, len(NAMES) - 1), min_size=1))
def test_any_joints_make_a_body(joints):
    small = reduced(BODY, sorted(joints))
    assert small.skeleton.names == tuple(NAMES[j] for j in sorted(joints))
    assert small.roles == tuple(BODY.roles[j] for j in sorted(joints))
    assert (small.measures, small.structure) == (BODY.measures, BODY.structure)
    small_places, body_places = in_reference_pose(small), in_reference_pose(BODY)[sorted(joints)]
    assert np.allclose(small_places - small_places[0], body_places - body_places[0], atol=1e-12)
    for joint, parent in enumerate(small.skeleton.parents.tolist()):
        name, above = small.skeleton.names[joint], TREE[small.skeleton.names[joint]][0]
        while above is not None and above not in small.skeleton.names:
            above = TREE[above][0]
        if joint == 0:
            assert parent == -1
        else:
            assert small.skeleton.names[parent] == (above or small.skeleton.names[0]), name


def test_all_joints_are_the_body_itself():
    assert reduced(BODY, range(len(NAMES))) is BODY


@pytest.mark.parametrize("joints", [[], [-1, 2], [0, len(NAMES)], [3, 3]])
def test_joints_that_there_are_not_are_told(joints):
    with pytest.raises(SkeletonError, match="keep at least one, each once"):
        reduced(BODY, joints)
