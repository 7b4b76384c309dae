"""nkn and smrm on bodies that lack some of the 22 joints."""

from __future__ import annotations

from functools import cache
from typing import Any

import nkn_toys
import numpy as np
import pytest
import smrm_material
import torch
import training_material
from method_bodies import SHORT, body, dance, without

from retarget_bench.api import Context
from retarget_bench.methods.nkn import plugin as Nkn
from retarget_bench.methods.nkn.network.bodies import Bodies
from retarget_bench.motion.body22 import BODY22, Body22
from retarget_bench.motion.character import Character, Motion
from retarget_bench.motion.kinematics_torch import Tree
from retarget_bench.motion.skeleton import Skeleton
from retarget_bench.training.config import TrainingConfig
from retarget_bench.training.data import ClipArrays, TrainingData
from retarget_bench.training.layers.kinematic.pose import Scale, quaternions

TOES = ("LeftToeBase", "RightToeBase")
FULL, TOELESS = body(), without(body(), *TOES)
METHODS = ("nkn", "smrm")


@cache
def method(name: str) -> Any:
    """One whose answers differ from frame to frame."""
    if name == "nkn":
        module = nkn_toys.training_module(Nkn(hidden=16, facing=3.0))
        for each in module.modules["generator"].parameters():
            each.data += 0.1 * torch.randn_like(each)
    else:
        module = smrm_material.training_module()
        with torch.no_grad():
            module.generator.turns.weight.mul_(10.0)
    return module.method()


def answer(name: str, source: Any, target: Character) -> Motion:
    return method(name).retarget(source, target, context=Context())


def with_toes_of_no_length() -> Character:
    """``TOELESS`` with toes again, where the feet are."""
    full = FULL.skeleton
    offsets = full.offsets.copy()
    offsets[[full.names.index(name) for name in TOES]] = 0.0
    tips = ()
    return Character.of("twin", Skeleton(full.names, full.parents, offsets, tips))


@pytest.mark.parametrize("name", METHODS)
def test_toes_of_no_length_change_nothing(name):
    """As source and as target: a body without toes is answered as one whose toes have no length."""
    twin, motion = with_toes_of_no_length(), dance(TOELESS)
    kept = [twin.skeleton.names.index(joint) for joint in TOELESS.skeleton.names]
    rotations = np.zeros((motion.frames, len(twin.skeleton), 4))
    rotations[..., 0] = 1.0
    rotations[:, kept] = motion.rotations
    twin_motion = twin.motion(rotations, motion.root, motion.fps)
    np.testing.assert_allclose(
        answer(name, twin_motion, FULL).positions, answer(name, motion, FULL).positions, atol=1e-6
    )
    toeless, other = (answer(name, dance(FULL), target).positions for target in (TOELESS, twin))
    np.testing.assert_allclose(other[:, kept], toeless, atol=1e-6)


def test_nkn_sees_of_its_own_answer_where_the_body_is():
    """What the decoder is fed with are the places of the body's joints, in centimetres."""
    body22 = Body22(SHORT)
    raw = torch.randn(1, 4 * len(BODY22) + 4, generator=torch.Generator().manual_seed(0))
    offsets = torch.tensor(100.0 * body22.offsets[None], dtype=torch.float32)
    bodies = Bodies(
        Tree.of(body22.skeleton), offsets, Scale(len(BODY22)), torch.from_numpy(body22.lacks[None])
    )
    pose, _ = bodies.express(raw, torch.zeros(1, 1), True)
    turned = body22.motion(quaternions(raw[:, :-4]).double().numpy(), np.zeros((1, 3)), 30.0)
    places = 100.0 * (turned.positions[0] - turned.positions[0, body22.joints[0]])[list(body22.joints)]
    np.testing.assert_allclose(bodies.scale.plain(pose)[0, :-4].view(-1, 3)[1:], places[1:], atol=1e-3)


@pytest.mark.parametrize("name", METHODS)
def test_both_train_on_bodies_that_lack_joints(name):
    method = Nkn(hidden=16, facing=3.0) if name == "nkn" else smrm_material.SMRM(hidden=16)
    cast = {"full": FULL, "short": SHORT}
    clips = {
        who: [ClipArrays(who, "dance", {k: np.float32(a) for k, a in method.prepare(dance(each)).items()})]
        for who, each in cast.items()
    }
    module = method.training_module(
        TrainingData(cast, clips), TrainingConfig(steps=1, batch=4, window=12, rate=1e-3)
    )
    memory: dict[str, Any] = {}
    for phase in module.phases:
        terms = module.losses(phase.name, training_material.batch(module), memory)
        assert all(bool(torch.isfinite(term)) for term in terms.values())


def test_smrm_places_what_it_answers_where_the_body_has_it():
    module = smrm_material.training_module()
    shape = module.features.body(SHORT)
    lacks = torch.from_numpy(shape.aligned.lacks[None])
    body_of = [torch.from_numpy(each[None]) for each in (shape.offsets, shape.resting)]
    codes = torch.randn(1, 5, 16, generator=torch.Generator().manual_seed(0))
    poses, _ = module.generator.decode(codes, *body_of, lacks=lacks)
    rotations = poses.rotations.detach().double().numpy()
    places = shape.aligned.motion(rotations[0], np.zeros((5, 3)), 30.0).positions
    places = (places - places[:, [shape.aligned.joints[0]]])[:, list(shape.aligned.joints)]
    np.testing.assert_allclose(poses.positions[0].detach() * shape.unit, places, atol=1e-5)
