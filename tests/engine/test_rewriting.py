"""A body or motion that is written differently has every joint where it was."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from probe_questions import short_questions

from retarget_bench.api import Case
from retarget_bench.motion import rotation
from retarget_bench.motion.transfer import relative
from retarget_bench.verification import rewriting


@pytest.fixture(scope="module")
def subjects() -> list[Case]:
    return short_questions()


def test_rewriting_keeps_every_joint_where_it_is(subjects: list[Case]) -> None:
    for each in subjects:
        motion = each.source
        body, places = motion.character, motion.positions
        listed = rewriting.reordered(body)
        assert (listed.place != np.arange(len(body.skeleton))).any()
        np.testing.assert_allclose(listed.positions(listed.motion(motion).positions), places, atol=1e-12)
        for reframed in (rewriting.z_up(body), rewriting.one_axis(body)):
            written = reframed.motion(motion)
            np.testing.assert_allclose(written.positions, places, atol=1e-12)
            # what a joint does relative to the reference pose is the same however its axes lie
            off = rotation.angle(relative(written), relative(motion))
            assert off.max() < 1e-6
        split = rewriting.split(body)
        assert isinstance(split, rewriting.Rewritten)
        assert len(split.body.skeleton) == len(body.skeleton) + len(body.joints(rewriting.SPLIT))
        np.testing.assert_allclose(split.positions(split.motion(motion).positions), places, atol=1e-12)


def test_every_bone_of_a_chain_rests_along_x(subjects: list[Case]) -> None:
    body = subjects[0].source.character
    offsets = rewriting.one_axis(body).body.skeleton.offsets
    for joint, children in enumerate(body.skeleton.children):
        if children and np.linalg.norm(offsets[children[0]]) > 0:
            off = offsets[children[0]] / np.linalg.norm(offsets[children[0]])
            np.testing.assert_allclose(off, [1, 0, 0], atol=1e-9, err_msg=body.skeleton.names[joint])


def test_a_stiff_joint_can_be_left_out(subjects: list[Case]) -> None:
    tried = 0
    for each in subjects:
        motion = each.source
        joint = rewriting.mergeable(motion.character)
        if joint is None:
            continue
        stiff = rewriting.stiffened(motion, joint)
        merged = rewriting.merged(motion.character, joint).motion(stiff)
        kept = [j for j in range(len(motion.skeleton)) if j != joint]
        np.testing.assert_allclose(merged.positions, stiff.positions[:, kept], atol=1e-12)
        spine = sorted(role for role in merged.character.roles if role and role.startswith("spine"))
        assert spine == [f"spine_{k + 1}" for k in range(len(spine))]
        tried += 1
    assert tried >= 3


def test_mirror_images_are_mirror_images(subjects: list[Case]) -> None:
    for each in subjects:
        motion = each.source
        partner = rewriting.partners(motion.character)
        assert partner is not None
        mirrored = rewriting.mirrored(motion.character)
        assert isinstance(mirrored, rewriting.Rewritten)
        image = mirrored.motion(motion)
        np.testing.assert_allclose(image.positions, motion.positions[:, partner] * [-1, 1, 1], atol=1e-12)
        np.testing.assert_allclose(mirrored.positions(image.positions), motion.positions, atol=1e-12)
        again = rewriting.mirrored(image.character)
        assert isinstance(again, rewriting.Rewritten)
        np.testing.assert_allclose(again.motion(image).positions, motion.positions, atol=1e-12)
        names = motion.skeleton.names
        left = motion.character.joint_of["left_up_leg"]
        assert partner[left] == motion.character.joint_of["right_up_leg"], names


def test_a_body_with_one_arm_has_no_mirror_image(subjects: list[Case]) -> None:
    body = subjects[0].source.character
    roles = [None if role == "left_hand" else role for role in body.roles]
    assert rewriting.mirrored(replace(body, roles=tuple(roles))) == (
        "the joints of the {side} are not the same on both sides"
    )


def test_another_size_is_larger_everywhere(subjects: list[Case]) -> None:
    motion = subjects[0].source
    large = rewriting.scaled(motion.character, 1.5).motion(motion)
    np.testing.assert_allclose(large.positions, 1.5 * motion.positions, atol=1e-12)
    assert large.character.height == pytest.approx(1.5 * motion.character.height)
