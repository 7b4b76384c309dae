"""FID of people: one small network for all bodies on two legs, and halves made of stretches of every clip.

Numbers of more motion: ``benchmarks/fid_sensitivity.py --people``.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from corruptions import HARMS, MORE_HARMS, Crowd, people_in, seen

from retarget_bench.api import TWO_LEGS, Case, CaseFeatures, CaseInfo, Stretches
from retarget_bench.api.comparison import Comparison, structure_joints
from retarget_bench.datasets.puppets import plugin as Puppets
from retarget_bench.errors import NotSupported
from retarget_bench.evaluation.set_metrics import draw, evaluate
from retarget_bench.metrics.fid import SHIPPED, Fid
from retarget_bench.motion.structures import reduce
from retarget_bench.training.features import data, network

ALL = {**HARMS, **MORE_HARMS}


@pytest.fixture(scope="module")
def puppets():
    return Puppets()


@pytest.fixture(scope="module")
def cases(puppets) -> dict[str, Case]:
    """A case per clip of the main job's cross split."""
    infos = {info.clip: info for info in reversed(puppets.cases("retarget", "cross"))}
    return {clip: puppets.load(info) for clip, info in infos.items()}


@pytest.fixture(scope="module")
def crowd(cases) -> Crowd:
    return Crowd({clip: seen(case.reference) for clip, case in cases.items()})


@pytest.mark.parametrize("name", ALL)
def test_every_harm_raises_it_the_more_the_worse_it_is(crowd, name):
    harm, amounts = ALL[name]
    if name == "warp":  # a quarter of the speed is lost in the noise of forty clips
        amounts = amounts[1:]
    values = [crowd.notice(), *(crowd.notice(harm, amount) for amount in amounts)]
    assert all(less < more for less, more in pairwise(values)), values
    assert values[-1] > 2 * values[0]


def test_the_main_job_has_windows_enough_in_each_half(crowd):
    drawn = crowd.sets()
    assert drawn.n >= 4 * network.OF_TWO_LEGS.features
    assert 32 <= network.OF_TWO_LEGS.features <= 64


@pytest.mark.parametrize("folder", ["lafan1", "cmu_bvh", "bandai_namco"])
def test_real_motion_of_other_families_has_a_floor_and_keeps_the_order_of_harms(real_data, folder):
    if not (real_data / folder).is_dir():
        pytest.skip(f"no {folder}")
    crowd = people_in(real_data / folder)
    floor = crowd.notice()
    assert crowd.sets().n >= 4 * network.OF_TWO_LEGS.features
    assert 0 < floor < 10  # of 32, the variance of the training motion
    for harm, amounts in HARMS.values():
        values = [floor, crowd.notice(harm, amounts[1]), crowd.notice(harm, amounts[-1])]
        assert all(less < more for less, more in pairwise(values)), (harm, values)


def test_it_is_of_cases_from_two_legs_to_two_legs(cases, puppets):
    person = next(iter(cases.values()))
    dog = next(each for each in puppets.characters().values() if each.four_legged)
    metric = Fid()
    assert {metric.set_of(each) for each in cases.values()} == {TWO_LEGS}
    assert metric.set_of(replace(person, target=dog)) == ""
    barking = dog.positions(np.zeros((70, len(dog.skeleton), 3)), 30.0)
    assert metric.set_of(replace(person, source=barking)) == ""
    with pytest.raises(NotSupported, match=f"{dog.name} stands on four legs"):
        metric.network(dog)


def test_bodies_without_toes_or_spine_joints_are_seen_alike(cases):
    """The features are of shared joints, so leaving out the others changes none; positions are enough."""
    shown = next(
        case for case in cases.values() if len(structure_joints(case.target)) > 22 and case.info.frames > 64
    )
    smaller = reduce(shown.target, "body22")
    assert len(smaller.character.skeleton) < len(shown.target.skeleton)
    shipped = network.find(SHIPPED, TWO_LEGS)
    complete, speed = shipped.features(shown.reference)
    reduced, same_speed = shipped.features(seen(smaller.apply(shown.reference)))
    np.testing.assert_allclose(reduced, complete, atol=1e-4)
    np.testing.assert_allclose(same_speed, speed, atol=1e-6)
    assert complete.shape == ((shown.info.frames - 16) // 4 + 1, 32)


def test_a_body_without_a_hand_is_in_no_set(cases):
    case = next(iter(cases.values()))
    roles = tuple(None if role == "left_hand" else role for role in case.target.roles)
    maimed = replace(case.target, roles=roles)
    assert Fid().set_of(replace(case, target=maimed)) == ""
    with pytest.raises(NotSupported, match="is known as left_hand"):
        Fid().network(maimed)


def test_without_a_reference_windows_have_the_speed_of_their_source(cases):
    """A reference in the place of the source says the same of how fast its windows move."""
    case = next(iter(cases.values()))
    alone = replace(case, source=case.reference, reference=None)
    features = Fid().features(Comparison(alone, case.reference))
    expected = Fid().features(Comparison(case, case.reference))
    assert len(features.real) == 0
    np.testing.assert_allclose(features.generated, expected.generated)
    np.testing.assert_allclose(features.speed, expected.speed, atol=1e-6)


def stretches_of(lengths: dict[str, int], rule: Stretches):
    features, infos = {}, {}
    for clip, count in lengths.items():
        for target in ("b", "c"):
            case = f"toy/a>{target}/{clip}"
            infos[case] = CaseInfo(case, "retarget", "intra", "a", target, clip)
            numbers = np.arange(count, dtype=np.float32)[:, None]
            features[case] = CaseFeatures(numbers, numbers, np.zeros(count, np.float32))
    rows = draw._rows(features, infos)
    return features, infos, draw.by_turns(rows, infos, rule)


def test_no_two_windows_of_the_two_halves_share_a_frame():
    rule = Stretches(overlap=4, length=15)
    lengths = {f"c{number}": 5 + 7 * number for number in range(20)}
    _, _, half_at = stretches_of(lengths, rule)
    for clip, count in lengths.items():
        at = {half: [w for w in range(count) if half_at.get((clip, w)) == half] for half in (0, 1)}
        assert at[0]
        assert at[1]
        assert min(abs(a - b) for a in at[0] for b in at[1]) >= rule.overlap
    longest = max(lengths, key=lambda clip: lengths[clip])
    sides = [half_at[longest, w] for w in range(lengths[longest]) if (longest, w) in half_at]
    assert sum(a != b for a, b in pairwise(sides)) >= 7  # stretches by turns, not halves


def test_clips_begin_with_either_half_about_equally_often():
    _, _, half_at = stretches_of({f"c{number}": 20 for number in range(20)}, Stretches(4, 15))
    assert sum(half_at[f"c{number}", 0] for number in range(20)) == 10


def test_the_same_stretch_of_two_bodies_is_on_one_side():
    features, infos, half_at = stretches_of({f"c{number}": 20 for number in range(12)}, Stretches(4, 15))
    drawn = draw.draw(features, infos, Stretches(4, 15))
    for half, sample in enumerate(drawn.real):
        for clip, (window,) in zip(sample.clips.tolist(), sample.features.tolist(), strict=True):
            assert half_at[clip, int(window)] == half
    assert drawn.n > 12


def test_a_tenth_of_the_clips_is_left_out_of_both_halves_at_once():
    features, infos, _ = stretches_of({f"c{number}": 20 for number in range(30)}, Stretches(4, 15))
    groups = evaluate._groups(draw.draw(features, infos, Stretches(4, 15)))
    assert sorted(groups) == sorted({info.clip for info in infos.values()})
    assert sorted(list(groups.values()).count(group) for group in range(10)) == [3] * 10


def test_the_network_is_trained_on_all_bodies_on_two_legs_of_the_training(puppets):
    (source,) = data.sources(puppets, [TWO_LEGS])
    names = set(data.performers(puppets, source))
    cast = puppets.characters()
    trained = {name for clips in puppets.training().values() for name in clips}
    assert names == {name for name in trained if not cast[name].four_legged}
    assert len({cast[name].structure for name in names}) > 1


def test_the_shipped_network_is_small_and_saw_no_test_motion(puppets):
    shipped = network.find(SHIPPED, TWO_LEGS)
    assert network.place(SHIPPED, TWO_LEGS).with_suffix(".safetensors").stat().st_size < 500_000
    assert shipped.card.features == 32
    assert shipped.card.dataset == "puppets[size=default]"
    assert set(shipped.card.characters) <= set(puppets.training_manifest()["characters"])
    bodies = [each for each in puppets.characters().values() if not each.four_legged]
    assert [shipped.unfit(body) for body in bodies] == [""] * len(bodies)
