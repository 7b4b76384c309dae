"""docs/plugins.md: the example that it names learns; its lists are the code's, and its Python runs."""

from __future__ import annotations

import re
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch

from retarget_bench.api import Context
from retarget_bench.motion import roles, rotation, transfer
from retarget_bench.motion.body22 import JOINTS
from retarget_bench.motion.character import Motion
from retarget_bench.motion.role_aliases import FINGERS
from retarget_bench.motion.structures import BODY22
from retarget_bench.plugins import registry
from retarget_bench.plugins.spec import Spec
from retarget_bench.training import weights
from retarget_bench.training.data import ClipArrays, TrainingData
from retarget_bench.training.phases import optimiser_phases, to_device
from retarget_bench.training.record import Record
from retarget_bench.verification import contract

sys.path.insert(0, str(Path(__file__).parent / "methods"))
from method_bodies import body, dance, without

ROOT = Path(__file__).parents[1]
PAGE = (ROOT / "docs" / "plugins.md").read_text(encoding="utf-8")
EXAMPLE = ROOT / "docs" / "examples" / "learned_pose.py"
STEPS = 60


def blocks(kind: str) -> list[str]:
    return re.findall(rf"^```{kind}\n(.*?)^```", PAGE, re.DOTALL | re.MULTILINE)


@pytest.fixture(autouse=True)
def _known(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(registry, "_FILES", {})
    registry.add_file(EXAMPLE)


# ------------------------------------------------------------------------------------------ the example
@pytest.fixture(scope="module")
def pair() -> tuple[Motion, Motion]:
    """A motion, and the same on a smaller body without toes and one spine joint."""
    source = dance(body("tall"), frames=50)
    small = without(body("small", scale=0.8, thigh=0.4), "Spine1", "LeftToeBase", "RightToeBase")
    return source, transfer.carry(source, small, "hip_height")


@pytest.fixture
def trained(pair: tuple[Motion, Motion]) -> tuple[Any, list[float]]:
    """The training module after a few of the engine's steps, and the loss of each."""
    method = registry.create("methods", "learned_pose")
    clips = {
        motion.character.name: [ClipArrays(motion.character.name, "dance", method.prepare(motion))]
        for motion in pair
    }
    data = TrainingData({motion.character.name: motion.character for motion in pair}, clips)
    torch.manual_seed(0)
    module = method.training_module(data, method.presets["default"])
    device, numbers, losses = torch.device("cpu"), np.random.default_rng(0), []
    (step,) = optimiser_phases(module, method.presets["default"], device)
    for _ in range(STEPS):
        measured = step(to_device(module.draw(numbers, 8), device), {}, 3e-3)
        losses.append(float(measured["network.places"]))
    return module, losses


def distance(answer: Motion, right: Motion) -> float:
    return float(np.linalg.norm(answer.positions - right.positions, axis=-1).mean())


def answered(method: Any, source: Motion, target: Motion) -> Motion:
    assert method.supports(source.character, target.character) is None
    return method.retarget(source, target.character, context=Context())


def test_it_learns_what_a_resting_pose_does_not_know(pair, trained) -> None:
    source, right = pair
    module, losses = trained
    assert np.mean(losses[-5:]) < 0.3 * losses[0]
    resting = right.character.motion(
        np.tile(right.character.reference_pose, (right.frames, 1, 1)), right.root, right.fps
    )
    assert distance(answered(module.method(), source, right), right) < 0.5 * distance(resting, right)


def test_its_weights_are_stored_and_found_by_their_path(pair, trained, tmp_path) -> None:
    source, right = pair
    module, _ = trained
    plain = registry.create("methods", "learned_pose")
    assert "bench train learned_pose" in str(plain.supports(source.character, right.character))
    facts = Record(method="learned_pose", version=plain.card.version, facts=plain.facts())
    weights.write(tmp_path, weights.BEST, module.export(), facts)
    loaded = registry.create("methods", Spec("learned_pose", {"weights": str(tmp_path)}))
    answer, exact = answered(loaded, source, right), answered(module.method(), source, right)
    assert distance(answer, exact) < 1e-3 * right.character.height  # half precision
    assert answered(loaded, source, right).rotations.tobytes() == answer.rotations.tobytes()


# -------------------------------------------------------------------------------------------- the page
def test_the_lists_of_roles_are_the_codes() -> None:
    (listed,) = blocks("text roles")
    words = listed.split()
    plain = [word for word in words if not word.endswith("_N")]
    assert len(words) == len(set(words))
    assert set(plain) == set(roles._PLAIN)
    fingers = {f"{side}_{finger}" for side in roles.SIDES for finger in FINGERS.values()}
    stems = {word.removesuffix("_N") for word in set(words) - set(plain)}
    assert stems == {"spine", "neck", "tail"} | fingers
    assert all(roles.is_role(f"{stem}_1") for stem in stems)
    (listed,) = blocks("text body22")
    assert tuple(listed.split()) == BODY22
    assert len(BODY22) == JOINTS


def test_the_examples_of_the_page_run(pair, tmp_path) -> None:
    motion, _ = pair
    names: dict[str, Any] = {"motion": motion, "character": motion.character}
    examples = blocks("python")
    assert len(examples) == 3
    for block in examples:
        exec(compile(block, "page", "exec"), names)
    joints = names["leg"].joints
    np.testing.assert_allclose(
        names["same_leg"].positions[:, joints], motion.positions[:, joints], atol=1e-9
    )
    assert names["answer"].frames == motion.frames
    walked = np.linalg.norm(np.diff(motion.root, axis=0), axis=-1)
    np.testing.assert_allclose(np.linalg.norm(names["steps"], axis=-1), walked)
    across = rotation.rotate(names["level"], np.array([1.0, 0.0, 0.0]))
    assert (across[:, 0] > 0).all()  # the left is on the left


def test_the_contract_of_an_untrained_method_ends_where_nothing_is_answered() -> None:
    *_, last = contract.check("methods", "learned_pose")
    assert "no case was answered, so the rest was not checked: learned_pose has no weights" in last.problem
