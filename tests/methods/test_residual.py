"""``+residual``: the copied source, and what a method changes between two bodies."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pan_material
import pytest
from scipy.ndimage import gaussian_filter1d

from retarget_bench.api import Context, Method, MethodCard
from retarget_bench.errors import BenchError, NotSupported
from retarget_bench.motion import root_rules, rotation, transfer
from retarget_bench.motion.character import Character
from retarget_bench.motion.motion import Motion
from retarget_bench.motion.skeleton import Skeleton
from retarget_bench.plugins import registry
from retarget_bench.plugins.post_processors import Composed, Post
from retarget_bench.plugins.prediction_check import Invalid
from tests.methods.method_bodies import about, body, dance, without

SMALL = body("small", scale=0.6)
ODD = body("odd", thigh=0.6, shin=0.3, hip=0.2, arm=0.35, shoulder=0.3)
OTHER = body("other", thigh=0.55, arm=0.33, spines=5)


class Lossy(Method):
    """Copies rotations, then turns joints: all by a random walk that is the same on every body, and on
    bodies other than the source the left elbow by ``changes`` degrees, a number for every frame."""

    card = MethodCard("lossy", "loses the same on every body", "1", accepts=("motion", "positions"))

    def __init__(self, changes: np.ndarray | float = 0.0, rise: float = 0.0, flat: bool = False) -> None:
        self.changes, self.rise, self.flat = changes, rise, flat

    def supports(self, source: Character, target: Character) -> str | None:
        return None

    def retarget(self, source, target, *, context):
        carried = transfer.carry(source, target, "hip_height")
        turned = transfer.relative(carried)
        for joint, role in enumerate(target.roles):
            seed = sum(map(ord, "spine" if role is None or role.startswith("spine") else role))
            walk = np.random.default_rng(seed).normal(0.0, 2.0, (carried.frames, 3)).cumsum(0)
            lost = rotation.from_rotation_vector(np.radians(walk))
            turned[:, joint] = rotation.multiply(turned[:, joint], lost)
        if target is not source.character:
            elbow = target.joint_of["left_forearm"]
            bend = about("Y", np.broadcast_to(self.changes, carried.frames))
            for joint in (elbow, target.joint_of["left_hand"]):
                turned[:, joint] = rotation.multiply(turned[:, joint], bend)
        local = transfer.from_relative(target, turned)
        shift = np.random.default_rng(3).normal(0.0, 0.01, (carried.frames, 3)).cumsum(0)
        hips = transfer.hips(carried) + target.measures.hip_height * shift
        if target is not source.character:
            hips[:, 1] += self.rise
        answer = target.motion(local, transfer.root_from_hips(target, local, hips), source.fps)
        return target.positions(answer.positions, answer.fps) if self.flat else answer


def answered(method, source, target, posts=("residual",)):
    composed = Composed(method, [registry.create("posts", each) for each in posts])
    assert composed.supports(source.character, target) is None
    return composed.retarget(source, target, context=Context())


def far(one, other, frames=slice(None)):
    """Metres: the largest distance of a joint."""
    return np.linalg.norm(one.positions - other.positions, axis=-1)[frames].max()


# ------------------------------------------------------------------------------------- what is given back
@pytest.mark.parametrize("flat", [False, True])
def test_onto_its_own_body_nothing_is_changed_at_all(flat):
    source = dance(body())
    lossy = Lossy(flat=flat)
    assert far(lossy.retarget(source, source.character, context=Context()), source) > 0.1
    assert far(answered(lossy, source, source.character), source) < 1e-9


@pytest.mark.parametrize("target", [SMALL, OTHER])
def test_what_is_lost_on_every_body_alike_is_given_back(target):
    source = dance(body())
    copied = transfer.carry(source, target, "hip_height")
    assert far(Lossy().retarget(source, target, context=Context()), copied) > 0.05
    assert far(answered(Lossy(), source, target), copied) < 1e-6


@pytest.mark.parametrize("target", [SMALL, ODD])
def test_positions_are_given_back_what_was_lost_bone_by_bone(target):
    """Bones of other lengths point where those of the source do, so that what each lost is as long."""
    source = dance(body())
    copied = transfer.carry(source, target, "hip_height")
    assert far(answered(Lossy(flat=True), source, target), copied) < 1e-9


def test_joints_above_the_hips_move_with_them():
    below = body()
    names = ("Dummy", *below.skeleton.names)
    parents = np.concatenate([[-1], below.skeleton.parents + 1])
    offsets = np.concatenate([np.zeros((1, 3)), below.skeleton.offsets])
    target = Character.of("dummy", Skeleton(names, parents, offsets))
    source = dance(body())
    alone = Lossy(flat=True).retarget(source, target, context=Context())
    answer = answered(Lossy(flat=True), source, target)
    for each, other in ((alone, answer), (answer, alone)):
        assert each.positions[:, 1] - each.positions[:, 0] == pytest.approx(
            other.positions[:, 1] - other.positions[:, 0], abs=1e-9
        )
    same = dance(target)
    assert far(answered(Lossy(flat=True), same, target), same) < 1e-9


def test_what_the_method_changes_between_the_bodies_stays():
    source = dance(body())
    answer = answered(Lossy(30.0, 0.05), source, OTHER)
    copied = transfer.carry(source, OTHER, "hip_height")
    elbow = OTHER.joint_of["left_forearm"]
    turn = rotation.multiply(
        rotation.conjugate(transfer.relative(copied)[:, elbow]), transfer.relative(answer)[:, elbow]
    )
    assert np.degrees(2 * np.arccos(np.abs(turn[:, 0]))) == pytest.approx(30.0)
    assert transfer.hips(answer) == pytest.approx(transfer.hips(copied) + np.array([0.0, 0.05, 0.0]))


# ------------------------------------------------------------------------------------------- over time


def test_the_weights_are_gaussian():
    """Turns about one axis, small enough for their quaternions to be linear."""
    source = dance(body(), 80)
    changes = 0.02 * np.random.default_rng(0).normal(size=80).cumsum()
    answer = answered(Lossy(changes), source, OTHER, ["residual[sigma=0.1]"])
    elbow = OTHER.joint_of["left_forearm"]
    copied = transfer.carry(source, OTHER, "hip_height")
    turn = rotation.multiply(
        rotation.conjugate(transfer.relative(copied)[:, elbow]), transfer.relative(answer)[:, elbow]
    )
    angles = np.degrees(2 * turn[:, 2] * np.sign(turn[:, 0]))
    expected = gaussian_filter1d(changes, 0.1 * source.fps, truncate=4.0)
    assert angles[20:60] == pytest.approx(expected[20:60], abs=1e-5)


def test_nothing_is_averaged_over_a_cut_of_the_source():
    one, other = dance(body(), 40), dance(body(), 40, seed=5)
    cut = one.character.motion(
        np.concatenate([one.rotations, other.rotations]),
        np.concatenate([one.root, other.root + np.array([5.0, 0.0, 3.0])]),
        one.fps,
    )
    changes = np.concatenate([np.zeros(40), np.full(40, 40.0)])
    averaged, copied = (
        answered(Lossy(changes), cut, OTHER),
        transfer.carry(cut, OTHER, "hip_height"),
    )
    hand = OTHER.joint_of["left_hand"]
    off = np.linalg.norm(averaged.positions[:, hand] - copied.positions[:, hand], axis=-1)
    assert off[:40].max() < 1e-6
    assert np.ptp(off[40:]) < 1e-6
    assert off[40] > 0.1


def test_changes_are_averaged_over_time_and_the_source_is_not():
    source = dance(body(), 60)
    trembling = 10.0 * (-1.0) ** np.arange(60)
    copied = transfer.carry(source, OTHER, "hip_height")
    inner = slice(15, 45)  # the ends are kept where they are
    assert far(answered(Lossy(trembling), source, OTHER), copied, inner) < 1e-3
    assert far(answered(Lossy(trembling), source, OTHER, ["residual[sigma=0]"]), copied) > 0.02


# ------------------------------------------------------------------------------------------ what it takes
def test_a_joint_that_the_source_lacks_moves_with_the_one_that_it_hangs_from():
    source = dance(without(body(), "LeftToeBase"))
    answer = answered(Lossy(flat=True), source, SMALL)
    foot, toe = SMALL.joints(["left_foot", "left_toe"])
    ratios = root_rules.ratios("hip_height", source.character, SMALL)
    own = Lossy(flat=True).retarget(source, source.character, context=Context())
    alone = Lossy(flat=True).retarget(source, SMALL, context=Context())
    lost = ratios * (source.positions - own.positions)[:, source.character.joint_of["left_foot"]]
    assert answer.positions[:, foot] - alone.positions[:, foot] == pytest.approx(lost, abs=1e-3)
    moved = answer.positions - alone.positions
    assert moved[:, toe] == pytest.approx(moved[:, foot], abs=1e-12)


def test_an_answer_with_rotations_needs_a_source_with_rotations():
    source = dance(body())
    flat = source.character.positions(source.positions, source.fps)

    class Fixed(Lossy):
        def retarget(self, asked, target, *, context):
            return super().retarget(source, target, context=context)

    with pytest.raises(NotSupported, match="a source with rotations"):
        answered(Fixed(), flat, OTHER)
    assert answered(Lossy(flat=True), source, OTHER).kind == "positions"


@pytest.mark.parametrize("sigma", [-0.1, 1.5])
def test_sigma_is_in_seconds(sigma):
    with pytest.raises(BenchError, match=r"from 0 to 1;"):
        registry.create("posts", f"residual[sigma={sigma}]")


def test_a_reconstruction_without_rotations_is_said_to_be_that():
    class Half(Lossy):
        def retarget(self, source, target, *, context):
            answer = super().retarget(source, target, context=context)
            return answer if target is OTHER else target.positions(answer.positions, answer.fps)

    with pytest.raises(NotSupported, match="on the source's own body, too"):
        answered(Half(), dance(body()), OTHER)


def test_what_a_method_sees_of_the_target_says_nothing_of_the_source():
    method = registry.create("methods", "copy_rotations[root_rule=reference]+residual")
    assert "sees reference of the target" in method.supports(body(), OTHER)
    assert registry.create("methods", "copy_rotations+residual").supports(body(), OTHER) is None


def test_a_bad_reconstruction_is_told_as_one():
    class Bad(Lossy):
        def retarget(self, source, target, *, context):
            return super().retarget(source, OTHER, context=context)

    with pytest.raises(Invalid, match="asked for the source's own body, it returned a motion of 'other'"):
        answered(Bad(), dance(body()), OTHER)


def test_a_pair_of_which_the_method_does_not_know_the_source_as_a_target_is_unsupported():
    class Picky(Lossy):
        def supports(self, source, target):
            return None if target.name == "other" else f"{target.name} is no target of this"

    method = Composed(Picky(), [registry.create("posts", "residual")])
    assert method.supports(body(), OTHER) == "puppet is no target of this"
    assert Composed(Picky(), []).supports(body(), OTHER) is None


def test_what_a_post_processor_does_to_its_reconstruction_is_its_own_affair():
    class Spoils(Post):
        card = replace(registry.create("posts", "residual").card, name="spoils", needs="reconstruction")

        def supports(self, source, target):
            return None

        def process(self, prediction, source, *, context):
            context.reconstruction.rotations[:] = 7.0
            return prediction

    source = dance(body())
    answer = Composed(Lossy(), [Spoils(), registry.create("posts", "residual")]).retarget(
        source, SMALL, context=Context()
    )
    assert far(answer, transfer.carry(source, SMALL, "hip_height")) < 1e-6


# ------------------------------------------------------------------------------------- by whose networks
def test_pan_reconstructs_a_source_by_the_networks_that_answer_for_the_target():
    """Between two structures these are others than its own; what they lose is then the same, so that
    little but the bones differs."""
    one, other = pan_material.BODIES["one"], pan_material.BODIES["legs"]
    method = pan_material.trained()
    assert method.assigned(one)[0] != method.assigned(other)[0]
    source = dance(pan_material.BODIES["one"], 24)
    (own,) = method.reconstruct_batch([source], [one], contexts=[Context()])
    (others,) = method.reconstruct_batch([source], [other], contexts=[Context()])
    assert far(own, method.retarget(source, one, context=Context())) == 0.0
    answer = method.retarget(source, other, context=Context())
    shared = [role for role in other.roles if role and role in one.joint_of]
    apart = [
        rotation.multiply(
            rotation.conjugate(transfer.relative(each)[:, one.joints(shared)]),
            transfer.relative(answer)[:, other.joints(shared)],
        )
        for each in (own, others)
    ]
    sizes = [np.arccos(np.abs(each[..., 0]).clip(max=1.0)).mean() for each in apart]
    assert sizes[1] < 0.2 * sizes[0]


def test_batches_are_what_single_answers_are():
    method = pan_material.trained()
    composed = Composed(method, [registry.create("posts", "residual")])
    cases = [
        (dance(pan_material.BODIES[name], frames), pan_material.BODIES[target])
        for name, target, frames in (("one", "legs", 24), ("legs", "one", 20), ("one", "one", 24))
    ]
    sources, targets = zip(*cases, strict=True)
    together = composed.retarget_batch(sources, targets, contexts=[Context()] * 3)
    for answer, source, target in zip(together, sources, targets, strict=True):
        alone = composed.retarget(source, target, context=Context())
        assert far(answer, alone) < 1e-5 * target.height


# --------------------------------------------------------------------------------- what goes before it
def test_a_reconstruction_goes_through_what_stands_before():
    """``a+fit+residual``: both answers are fitted."""
    calls = []

    class Recorder(Post):
        card = replace(registry.create("posts", "residual").card, name="look", accepts=("motion",))

        def supports(self, source, target):
            return None

        def process(self, prediction, source, *, context):
            calls.append((prediction, context.reconstruction))
            return prediction

    class After(Recorder):
        card = replace(Recorder.card, name="after", needs=())

    source = dance(body())
    posts = [registry.create("posts", "fit"), Recorder(), After()]
    Composed(Lossy(flat=True), posts).retarget(source, OTHER, context=Context())
    (answer, own), (_, nothing) = calls
    assert isinstance(answer, Motion)
    assert isinstance(own, Motion)
    assert (answer.character, own.character) == (OTHER, source.character)
    assert nothing is None
