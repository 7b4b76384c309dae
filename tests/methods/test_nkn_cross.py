"""nkn_cross: structures with networks of their own, and what its weights know."""

from __future__ import annotations

import numpy as np
import pytest
import torch
from method_bodies import body, dance
from nkn_toys import STRUCTURES as CAST
from nkn_toys import structured, training_data, training_module
from training_material import batch

from retarget_bench.api import Context
from retarget_bench.errors import BenchError, NotSupported
from retarget_bench.methods.nkn_cross import plugin
from retarget_bench.motion.character import Character
from retarget_bench.motion.skeleton import Skeleton
from retarget_bench.training.config import TrainingConfig
from retarget_bench.training.phases import to_device

SMALL = {"hidden": 12, "facing": 3.0}


@pytest.fixture(scope="module")
def module():
    return training_module(plugin(**SMALL), cast=CAST)


def test_every_structure_has_networks_of_its_own_size(module):
    generators = module.modules["generator"]
    assert list(generators) == ["five_spine", "three"]
    for name, joints in (("five_spine", 24), ("three", 22)):
        assert len(generators[name].encoder.lower.kernel) == 3 * joints + 4
        assert generators[name].decoder.out.shape == (12, 4 * joints + 4)
        assert module.modules["discriminator"][name].layers[0].in_channels == 3 * joints + 4


def test_groups_mix_all_pairs_of_structures_and_keep_the_share_of_own_bodies(module):
    pairs, own, rows = set(), 0, 0
    for step in range(60):
        groups = batch(module, rows=5, seed=step)["groups"]
        assert [len(group["same"]) for group in groups] == [3, 2]
        for group in groups:
            pairs.add(tuple(group["structures"]))
            assert group["poses"].shape[-1] == (76, 70)[group["structures"][0]]
            assert group["target_bones"].shape[1] == (24, 22)[group["structures"][1]]
            own, rows = own + int(group["same"].sum()), rows + len(group["same"])
    assert pairs == {(0, 0), (0, 1), (1, 0), (1, 1)}
    assert own / rows == pytest.approx(0.2, abs=0.09)  # 2.2 standard errors and more: the seeds are fixed


def test_rows_of_two_structures_are_not_compared(module):
    crossing = next(
        group
        for step in range(20)
        for group in batch(module, seed=step)["groups"]
        if group["structures"][0] != group["structures"][1]
    )
    terms = module.losses("generator", {"groups": [crossing]}, {})
    assert terms["same_places"].item() == terms["same_moves"].item() == 0.0
    assert terms["cycle_places"].item() > 0.0
    assert terms["adversarial"].item() > 0.0


def test_terms_have_the_same_names_whatever_was_drawn(module):
    """Several processes put them together."""
    names = {tuple(sorted(module.losses("generator", batch(module, seed=step), {}))) for step in range(8)}
    assert len(names) == 1


def test_other_structures_and_other_joints_are_refused_with_a_reason(module):
    method = module.method()
    four = structured(body(spines=4), "four", "four")
    assert "these weights know five_spine, three" in method.supports(CAST["one"], four)
    fake = structured(body(spines=4), "fake", "three")
    assert "other joints" in method.supports(fake, CAST["one"])
    with pytest.raises(NotSupported, match="know five_spine"):
        method.retarget(dance(four), CAST["one"], context=Context())


def test_one_structure_with_two_sets_of_joints_cannot_be_trained():
    cast = {"one": CAST["one"], "odd": structured(body(spines=4), "odd", "three")}
    with pytest.raises(NotSupported, match="one of them another structure"):
        plugin(**SMALL).training_module(
            training_data(plugin(**SMALL), cast), TrainingConfig(1, 4, 16, 1e-3)
        )


def test_weights_of_other_structures_are_not_taken_over(module):
    with pytest.raises(BenchError, match="other structures"):
        module.load(training_module(plugin(**SMALL), cast={k: CAST[k] for k in ("one", "long")}).export())


def test_structures_say_who_is_trained_on():
    method = plugin(structures="three+four")
    assert not method.unfit(CAST["one"])
    assert "five.spine" in method.unfit(CAST["bendy"])
    assert not plugin(structures="all").unfit(CAST["bendy"])


def test_the_hips_come_first_and_joints_above_them_are_left_out():
    full = body().skeleton
    above = Skeleton(
        ("World", *full.names),
        np.array([-1, 0, *(full.parents[1:] + 1)]),
        np.concatenate([np.zeros((1, 3)), full.offsets]),
    )
    nkn_body = plugin().body(Character.of("above", above))
    assert nkn_body.joints == tuple(range(1, len(full) + 1))


@pytest.mark.parametrize("name", ["one", "bendy"])
def test_ends_are_seen_in_lengths_of_their_chains(module, name):
    """As far from the hips as in the motion, over the bones in between at rest."""
    character, other = CAST[name], CAST["bendy" if name == "one" else "one"]
    motion = dance(character)
    poses = torch.from_numpy(plugin(**SMALL).see(motion).poses)[:, None]
    joints, lengths = module.ends.shares([name], [other.name])[0]
    scaled = module.ends.scaled(poses, [(torch.from_numpy(joints), torch.from_numpy(lengths))], 0)
    body = plugin(**SMALL).body(character)
    for number, joint in enumerate(body.joints[index] for index in joints):
        chain, at = 0.0, joint
        while at != body.joints[0]:
            chain, at = (
                chain + np.linalg.norm(character.skeleton.offsets[at]),
                character.skeleton.parents[at],
            )
        away = np.linalg.norm(motion.positions[:, joint] - motion.positions[:, body.joints[0]], axis=-1)
        assert torch.linalg.norm(scaled[:, 0, number], dim=-1).numpy() == pytest.approx(
            away / chain, rel=1e-4
        )
    assert len(joints) == 9


def test_ends_count_between_structures_alone(module):
    terms = {own: _ends_term(module, own) for own in (True, False)}
    assert terms[True] == (0.0, 0.0)
    assert min(terms[False]) > 0.0
    assert training_module(plugin(**SMALL, ends=0.0), cast=CAST).ends is None


def _ends_term(module, own: bool) -> tuple[float, float]:
    for seed in range(50):
        drawn = module.draw(np.random.default_rng(seed), 2)
        if all((group["structures"][0] == group["structures"][1]) == own for group in drawn["groups"]):
            losses = module.losses("generator", to_device(drawn, torch.device("cpu")), {})
            return float(losses["ends"]), float(losses["ends_moves"])
    raise LookupError("no such batch was drawn")
