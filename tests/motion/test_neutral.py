"""Neutral poses of any body: arms down, hips at the origin, bones as long as they are."""

from __future__ import annotations

import numpy as np
import pytest

from retarget_bench.errors import SkeletonError
from retarget_bench.evaluation.tasks.definitions import reduced
from retarget_bench.motion.aligned import neutral_pose, template
from retarget_bench.motion.character import Character
from retarget_bench.motion.skeleton import Skeleton
from retarget_bench.plugins import bound
from retarget_bench.plugins.spec import Spec


def puppets() -> dict[str, Character]:
    """One body of each structure."""
    bodies = bound.dataset(Spec.parse("puppets[size=tiny]")).built.characters().values()
    return {body.structure: body for body in bodies}


PUPPETS = puppets()


@pytest.mark.parametrize("structure", sorted(PUPPETS))
def test_templates_of_all_structures(structure):
    body = PUPPETS[structure]
    places, joint = template(body), body.joint_of
    assert np.abs(places[joint["hips"]]).max() < 1e-12
    parents = body.skeleton.parents
    bones = np.linalg.norm(places[1:] - places[parents[1:]], axis=1)
    np.testing.assert_allclose(bones, body.skeleton.bone_lengths[1:], atol=1e-9)
    if body.four_legged:
        np.testing.assert_array_equal(neutral_pose(body), body.reference_pose)
        return
    for side, sign in (("left", 1.0), ("right", -1.0)):
        arm = places[[joint[f"{side}_{part}"] for part in ("arm", "forearm", "hand")]]
        np.testing.assert_allclose(arm[:, [0, 2]], np.broadcast_to(arm[0, [0, 2]], (3, 2)), atol=1e-6)
        assert (np.diff(arm[:, 1]) < -0.1).all()
        assert sign * arm[0, 0] > 0.0
        assert places[joint[f"{side}_foot"], 1] < places[joint[f"{side}_leg"], 1] < 0.0
    assert places[joint["head"], 1] > places[joint["left_arm"], 1] > 0.0


def test_rigs_of_one_body_have_one_template():
    """The same bones at rest in a T-pose and with their arms already down."""
    body = PUPPETS["body22"]
    down = neutral_pose(body)
    places = template(body)
    offsets = places - np.where(
        body.skeleton.parents[:, None] >= 0, places[body.skeleton.parents], np.zeros(3)
    )
    rested = Character.of(
        "rested", Skeleton(body.skeleton.names, body.skeleton.parents, offsets), roles=body.roles
    )
    np.testing.assert_allclose(template(rested), places, atol=1e-6)
    assert not np.allclose(down, body.reference_pose)


def test_parts_of_a_body_keep_their_places():
    """Limbs alone, the hips and the trunk left out: the whole body's template at these joints."""
    body = PUPPETS["body22"]
    roles = [f"{side}_{part}" for side in ("left", "right") for part in ("up_leg", "leg", "foot")]
    roles += [f"{side}_{part}" for side in ("left", "right") for part in ("arm", "forearm", "hand")]
    joints = sorted(body.joint_of[role] for role in roles)
    part = reduced(body, joints)
    assert "hips" not in part.joint_of
    np.testing.assert_allclose(template(part), template(body)[joints], atol=1e-9)


def test_a_body_without_hips_has_no_template():
    skeleton = Skeleton(("a", "b"), np.array([-1, 0]), np.array([[0.0, 0.0, 0.0], [0.0, 1.0, 0.0]]))
    with pytest.raises(SkeletonError, match="no joint of nobody is known as hips"):
        template(Character.of("nobody", skeleton))
