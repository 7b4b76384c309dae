"""The post-processor that exchanges root rules, against methods that have the rule themselves."""

from __future__ import annotations

import numpy as np
import pytest
from method_bodies import body, dance

from retarget_bench.api import Context
from retarget_bench.methods.bone_directions import plugin as BoneDirections
from retarget_bench.methods.copy_rotations import plugin as CopyRotations
from retarget_bench.methods.posts.root_path import plugin as RootPath
from retarget_bench.motion.root_rules import SCALING_RULES

NOTHING = Context()


@pytest.mark.parametrize("rule", SCALING_RULES)
@pytest.mark.parametrize("method", [CopyRotations, BoneDirections])
def test_it_gives_what_a_method_with_that_rule_gives(method, rule):
    source, target = dance(body()), body("other", thigh=0.6, shin=0.5, hip=0.2)
    usual, expected = (
        method(root_rule=each).retarget(source, target, context=NOTHING) for each in ("hip_height", rule)
    )
    moved = RootPath(root_rule=rule).process(usual, source, context=NOTHING)
    np.testing.assert_allclose(moved.positions, expected.positions, atol=1e-12)
    flat = target.positions(usual.positions, usual.fps)
    there = RootPath(root_rule=rule).process(flat, source, context=NOTHING)
    np.testing.assert_allclose(there.positions, expected.positions, atol=1e-12)
