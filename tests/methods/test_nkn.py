"""nkn as a method: what it learns from, what it answers, and that chunks and company change nothing."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import torch
from method_bodies import body, dance, without
from nkn_toys import CAST, apart, batch, structured, train, training_data, training_module

from retarget_bench.api import Context
from retarget_bench.errors import BenchError, NotSupported
from retarget_bench.methods.nkn import plugin
from retarget_bench.methods.nkn.network.bodies import Bodies
from retarget_bench.motion.character import Character
from retarget_bench.motion.motion import Motion
from retarget_bench.training.config import TrainingConfig
from retarget_bench.training.layers.kinematic.features import answer
from retarget_bench.training.layers.kinematic.retargeter import Cases

SMALL = {"hidden": 16, "facing": 3.0, "drift": 0.0, "lengths": "world"}


@pytest.fixture(scope="module")
def method():
    """One with weights that make it move."""
    made = training_module(plugin(**SMALL))
    for each in made.modules["generator"].parameters():
        each.data += 0.1 * torch.randn_like(each)
    return made.method()


def run(method, source: Motion, target: Character, **context) -> Motion:
    return method.retarget(source, target, context=Context(**context))


# ------------------------------------------------------------------------------------------- learning
def test_gradients_reach_every_parameter_of_both_networks():
    made, given = training_module(plugin(**SMALL)), {}
    # the very first answers are next to constant, so that the discriminator's slopes underflow
    for each in made.modules["generator"].parameters():
        each.data += 0.1 * torch.randn_like(each)
    now = batch(made)
    for phase in made.phases:
        torch.stack(list(made.losses(phase.name, now, given).values())).sum().backward()
        for name, each in made.modules[phase.name].named_parameters():
            assert each.grad is not None, name
            assert float(each.grad.abs().max()) > 0.0, name
        made.modules.zero_grad(set_to_none=True)


def test_terms_of_the_ablations():
    every = {"same_places", "same_moves", "twist", "smooth"}
    cycle = every | {"cycle_places", "cycle_moves"}
    for losses, expected, phases in (
        ("autoencoder", every, 1),
        ("cycle", cycle, 1),
        ("adversarial", cycle | {"adversarial"}, 2),
    ):
        made = training_module(plugin(losses=losses, **SMALL))
        now = batch(made)
        assert set(made.losses("generator", now, {})) == expected
        assert len(made.phases) == phases
        assert ("real" in now["groups"][0]) == (phases == 2)
        assert bool(now["groups"][0]["same"].all()) == (losses == "autoencoder")
    assert "drift" in training_module(plugin(**{**SMALL, "drift": 0.1})).losses("generator", now, {})


def test_only_rows_of_the_same_body_are_compared_with_their_source():
    made = training_module(plugin(same=0.0, **SMALL))
    terms = made.losses("generator", batch(made), {})
    assert terms["same_places"].item() == terms["same_moves"].item() == 0.0
    whole = training_module(plugin(same=1.0, **SMALL))
    given: dict = {}
    assert whole.losses("generator", batch(whole), given)["same_places"].item() > 0.0
    assert not given["fakes"]
    assert whole.losses("discriminator", batch(whole), given) == {}


def test_losses_are_sums_over_numbers_and_means_over_real_frames():
    made = training_module(plugin(same=1.0, losses="autoencoder", **SMALL), window=30)
    (group,) = (now := batch(made))["groups"]
    assert len(set(group["lengths"].tolist())) > 1
    generator = made.modules["generator"]["body22"].eval()
    poses = generator.scale.poses(group["poses"].transpose(0, 1))
    bodies = method_bodies_of(made, group)
    answers = generator.decoder(generator.encoder(poses)[1], bodies)[0]
    total = 0.0
    for row, length in enumerate(group["lengths"].tolist()):
        total += (answers - poses)[:length, row, :66].square().sum().item()
    terms = made.losses("generator", now, {})
    assert terms["same_places"].item() == pytest.approx(total / int(group["lengths"].sum()), rel=1e-5)


def method_bodies_of(made, group):
    scale = made.modules["generator"]["body22"].scale
    return Bodies(made._tree("body22", group["bones"]), group["target_bones"], scale)


def test_the_same_seed_gives_the_same_weights_and_another_gives_others():
    runs = []
    for seed in (0, 0, 1):
        made = training_module(plugin(**SMALL), seed=seed)
        train(made, 3)
        runs.append(made.export())
    assert all(torch.equal(runs[0][name], runs[1][name]) for name in runs[0])
    assert any(not torch.equal(runs[0][name], runs[2][name]) for name in runs[0])


def test_the_running_score_decides_whether_the_discriminator_learns():
    made, given = training_module(plugin(**SMALL)), {}
    now = batch(made)
    made.losses("generator", now, given)
    (fake,) = given["fakes"]
    scores = made.modules["scores"]
    assert set(made.losses("discriminator", now, given)) == {"cross_entropy"}
    expected = 0.99 * 0.5 + 0.01 * float(fake.logits.detach().sigmoid().mean())
    assert float(scores.running[0]) == pytest.approx(expected)
    scores.running.fill_(0.29)
    fake.logits = torch.full_like(fake.logits, -100.0)
    assert made.losses("discriminator", now, given) == {}
    assert float(scores.running[0]) == pytest.approx(0.99 * 0.29)


def test_padding_and_the_order_of_rows_change_nothing():
    """A row alone, cut to its length, against the same row among longer ones, with rubbish behind it."""
    made = training_module(plugin(losses="cycle", **SMALL), window=30)
    made.modules.eval()
    (group,) = (now := batch(made))["groups"]
    whole = {name: each.item() for name, each in made.losses("generator", now, {}).items()}
    frames, summed = int(group["lengths"].sum()), dict.fromkeys(whole, 0.0)
    for row, length in enumerate(group["lengths"].tolist()):
        alone = {name: each[row : row + 1] for name, each in group.items() if name != "structures"}
        alone |= {"structures": group["structures"], "poses": alone["poses"][:, :length]}
        alone["other"] = torch.nonzero(~alone["same"])[:, 0]
        for name, each in made.losses("generator", {"groups": [alone]}, {}).items():
            summed[name] += each.item() * length / frames
    assert summed == pytest.approx(whole, rel=1e-4)
    order = torch.tensor([2, 0, 3, 1])
    mixed = {name: each[order] for name, each in group.items() if name not in ("structures", "other")}
    mixed |= {"structures": group["structures"], "other": torch.nonzero(~mixed["same"])[:, 0]}
    behind = torch.arange(30) >= mixed["lengths"][:, None]
    mixed["poses"] = torch.where(behind[..., None], torch.tensor(1e3), mixed["poses"])
    again = {name: each.item() for name, each in made.losses("generator", {"groups": [mixed]}, {}).items()}
    assert again == pytest.approx(whole, rel=1e-4)


def overfit(hidden: int, steps: int, rate: float) -> float:
    """The mean error of joints relative to the hips after training on one batch, in heights."""
    made = training_module(plugin(hidden=hidden, losses="cycle", facing=3.0), window=6)
    made.modules.eval()  # no dropout: can it be learned at all?
    now = batch(made, rows=2)
    optimiser = torch.optim.Adam(made.modules["generator"].parameters(), lr=rate)
    schedule = torch.optim.lr_scheduler.CosineAnnealingLR(optimiser, steps)
    for _ in range(steps):
        optimiser.zero_grad()
        torch.stack(list(made.losses("generator", now, {}).values())).sum().backward()
        torch.nn.utils.clip_grad_norm_(made.modules["generator"].parameters(), 25.0)
        optimiser.step()
        schedule.step()
    (group,) = now["groups"]
    generator = made.modules["generator"]["body22"]
    poses = generator.scale.poses(group["poses"].transpose(0, 1))
    there = generator.decoder(generator.encoder(poses)[1], method_bodies_of(made, group))[0]
    group = {**group, "target_bones": group["bones"]}
    again = generator.decoder(generator.encoder(there)[1], method_bodies_of(made, group))[0]
    error = (generator.scale.plain(again) - group["poses"].transpose(0, 1))[..., 3:66].detach()
    return float(error.unflatten(-1, (21, 3)).norm(dim=-1).mean()) / 100.0 / body().height


def test_one_batch_is_learned_by_heart():
    assert overfit(64, 60, 1e-2) < 0.01


@pytest.mark.slow
def test_one_batch_is_learned_by_heart_at_full_size():
    assert overfit(512, 150, 2e-3) < 0.01


def test_exported_weights_make_the_same_method_again():
    made, other = training_module(plugin(**SMALL)), training_module(plugin(**SMALL), seed=1)
    source, target = dance(CAST["one"]), CAST["small"]
    before = run(made.method(), source, target)
    assert apart(run(other.method(), source, target), before) > 0.0
    other.load(made.export())
    np.testing.assert_array_equal(run(other.method(), source, target).rotations, before.rotations)


def test_weights_of_another_size_are_refused():
    with pytest.raises(BenchError, match="of another structure"):
        training_module(plugin(**SMALL)).load(training_module(plugin(hidden=8)).export())


def test_one_character_is_not_enough():
    alone = {"one": CAST["one"]}
    with pytest.raises(NotSupported, match="two characters"):
        plugin(**SMALL).training_module(
            training_data(plugin(**SMALL), alone), TrainingConfig(1, 4, 16, 1e-3)
        )


def test_presets_are_the_papers_and_smaller_ones():
    paper = plugin.presets["paper"]
    assert (paper.steps, paper.batch, paper.window, paper.rate) == (50_000, 16, 60, 1e-4)
    assert set(plugin.presets) == {"paper", "default", "quick", "gpu"}


# ---------------------------------------------------------------------------------------- retargeting
@pytest.mark.parametrize("path", ["integrated", "relative"])
def test_chunks_of_any_length_are_the_whole(method, path):
    source, target = dance(CAST["one"], 60), CAST["long"]
    method = plugin(**SMALL, path=path).using(method.tensors)
    sight, whole = method.see(source), run(method, source, target)
    lead = sight.hips * target.measures.hip_height / source.character.measures.hip_height
    for sizes in ([1] * 60, [7, 1, 52], [59, 1]):
        stream = method.stream(Cases([source.character], [target]))
        parts, at = [], 0
        for size in sizes:
            part = slice(at, at + size)
            parts.append(stream.advance(*(each[part, None] for each in (sight.poses, sight.turn, lead))))
            at += size
        turns, turn, hips = (np.concatenate(each)[:, 0] for each in zip(*parts, strict=True))
        again = answer(method.body(target), turns, turn, hips, 60, 30.0)
        assert apart(again, whole) < 1e-6


def test_a_stream_keeps_no_more_of_a_long_clip_than_of_a_frame(method):
    sight, kept = method.see(dance(CAST["one"], 60)), []
    for frames in (1, 60):
        stream = method.stream(Cases([CAST["one"]], [CAST["long"]]))
        stream.advance(*(each[:frames, None] for each in (sight.poses, sight.turn, sight.hips)))
        kept.append(sum(each.untyped_storage().nbytes() for each in stream.held()))
    assert kept[0] == kept[1] == 4 * (4 * SMALL["hidden"] + 70 + 1)


def test_long_clips_go_through_in_chunks(method, monkeypatch):
    source = dance(CAST["one"], 100)
    whole = run(method, source, CAST["long"])
    monkeypatch.setattr("retarget_bench.methods.nkn.inference.CHUNK", 13)
    assert apart(run(method, source, CAST["long"]), whole) < 1e-6


def test_company_changes_nothing(method):
    sources = [
        dance(CAST[name], frames, seed=frames) for name, frames in (("one", 40), ("long", 7), ("small", 90))
    ]
    sources[1] = replace(sources[1], fps=60.0)
    targets = [CAST["small"], CAST["one"], CAST["one"]]
    together = method.retarget_batch(sources, targets, contexts=[Context()] * 3)
    for source, target, found in zip(sources, targets, together, strict=True):
        assert (found.frames, found.fps) == (source.frames, source.fps)
        assert apart(found, run(method, source, target)) < 1e-5


def test_threads_change_nothing(method):
    source = dance(CAST["one"], 50)
    before = torch.get_num_threads()
    try:
        torch.set_num_threads(1)
        one = run(method, source, CAST["long"])
        torch.set_num_threads(2)
        assert apart(run(method, source, CAST["long"]), one) < 1e-5
    finally:
        torch.set_num_threads(before)


def test_the_answer_begins_at_the_scaled_place_and_depends_on_the_source(method):
    target = CAST["small"]
    answers = [run(method, dance(CAST["one"], seed=seed), target) for seed in (0, 1)]
    np.testing.assert_allclose(answers[0].root[0], 0.6 * dance(CAST["one"]).root[0], atol=1e-6)
    assert apart(*answers) > 1e-3


def test_yaw_of_the_source_is_kept_if_asked(method):
    source = dance(CAST["one"])
    tensors = method.tensors
    own = plugin(**SMALL, yaw="source").using(tensors)
    sight = own.see(source)
    stream = own.stream(Cases([source.character], [CAST["long"]]))
    _, turn, _ = stream.advance(*(each[:, None] for each in (sight.poses, sight.turn, sight.hips)))
    np.testing.assert_array_equal(turn[:, 0], sight.turn)
    assert apart(run(own, source, CAST["long"]), run(method, source, CAST["long"])) > 1e-3


def test_clean_up_takes_signs_from_the_source(method):
    source = dance(CAST["one"])
    cleaned = plugin(**SMALL, clean=True, yaw="source", path="integrated")
    clean = run(cleaned.using(method.tensors), source, CAST["long"])
    sight = method.see(source)
    rises = np.diff(clean.root[:, 1])
    wanted = sight.poses[1:, 67]
    assert (np.sign(rises[np.abs(rises) > 1e-9]) == np.sign(wanted[np.abs(rises) > 1e-9])).all()
    assert not rises[np.abs(wanted) <= 0.01].any()


def test_positions_are_enough(method):
    source = dance(CAST["one"])
    known = source.character.positions(source.positions, source.fps)
    assert apart(run(method, known, CAST["long"]), run(method, source, CAST["long"])) < 1e-9


def test_bones_of_the_target_are_kept(method):
    target = CAST["long"]
    answer = run(method, dance(CAST["one"]), target)
    parents = target.skeleton.parents[1:]
    lengths = np.linalg.norm(answer.positions[:, 1:] - answer.positions[:, parents], axis=-1)
    np.testing.assert_allclose(lengths, np.broadcast_to(target.skeleton.bone_lengths[1:], lengths.shape))


# -------------------------------------------------------------------------------------------- refusals
def test_bodies_that_are_not_like_the_22_joints_are_refused_with_a_reason(method):
    armless = without(CAST["one"], "LeftHand")
    assert "left_hand" in method.supports(armless, CAST["one"])
    with pytest.raises(NotSupported, match="left_hand"):
        run(method, dance(armless), CAST["one"])
    assert method.supports(CAST["one"], CAST["small"]) is None
    assert not method.unfit(body("bendy", spines=4))


def test_without_weights_it_says_what_to_do(monkeypatch):
    monkeypatch.setattr(plugin, "shipped", classmethod(lambda cls: {}))
    assert "bench train nkn" in plugin(hidden=3).supports(CAST["one"], CAST["one"])


def test_shipped_weights_of_other_parameters_are_refused():
    with pytest.raises(BenchError, match=r"trained as nkn.*hidden=512"):
        plugin(hidden=3).supports(CAST["one"], CAST["one"])


@pytest.mark.parametrize("wrong", [{"hidden": 0}, {"same": 1.5}, {"facing": -1.0}, {"drift": -0.1}])
def test_values_out_of_range_are_refused(wrong):
    with pytest.raises(BenchError):
        plugin(**wrong)


def test_a_learned_method_of_bodies_of_any_structure():
    """Structures do not matter to nkn, the 22 joints do."""
    mixed = {"one": CAST["one"], "other": structured(body(spines=4), "other", "more spine")}
    made = training_module(plugin(**SMALL), cast=mixed)
    assert list(made.modules["generator"]) == ["body22"]
