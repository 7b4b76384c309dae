"""FID of people: halves made of stretches of every clip, and what harm raises it by.

Numbers of more motion: ``benchmarks/fid_sensitivity.py``.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from corruptions import HARMS, Crowd, people_in, seen, structure_in

from retarget_bench.api import TWO_LEGS, Case, CaseFeatures, CaseInfo, Stretches
from retarget_bench.api.comparison import Comparison, structure_joints
from retarget_bench.datasets.puppets import plugin as Puppets
from retarget_bench.errors import NotSupported
from retarget_bench.evaluation.set_metrics import draw, evaluate
from retarget_bench.metrics.fid import FEATURES, Fid, features
from retarget_bench.motion.structures import reduce
from retarget_bench.plugins import registry


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
    return Crowd({(clip, ""): seen(case.reference) for clip, case in cases.items()})


LEAST = {"mirrored": 1.0, "a foot leaps, heights": 1.0}
"""What the worst of a harm comes to, in floors, where that is less than half as much again: mirrored motion
is natural, and a single frame is for other columns to see."""


def check_harms(crowd: Crowd) -> None:
    """No harm brings real motion nearer, more harm takes it farther, and what people see, far."""
    for name, (harm, amounts) in HARMS.items():
        pairs = [crowd.times(harm, amount) for amount in amounts]
        ratios = [1.0, *(harmed / floor for harmed, floor in pairs)]
        assert all(less < more for less, more in pairwise(ratios)), (name, ratios)
        assert ratios[-1] >= LEAST.get(name, 1.5), (name, ratios)
    share = {
        (name, amount): float(np.divide(*crowd.times(HARMS[name][0], amount)))
        for name, amount in (
            ("jitter, heights", 0.0005),
            ("jitter, heights", 0.001),
            ("gliding, heights a second", 0.05),
            ("lifted, heights", 0.05),
            ("faster, times", 1.25),
        )
    }
    assert np.divide(*crowd.times(crowd.other_clip, 1.0)) >= 1.0
    assert share["jitter, heights", 0.0005] <= 1.3
    assert share["gliding, heights a second", 0.05] > share["jitter, heights", 0.001]
    assert min(share["lifted, heights", 0.05], share["faster, times", 1.25]) >= 1.5


def test_the_truth_scores_exactly_the_floor(crowd):
    value, floor = crowd.times(None, 0.0)
    assert value == pytest.approx(floor, abs=1e-9)


def test_no_harm_scores_below_the_floor_and_more_is_worse(crowd):
    check_harms(crowd)


@pytest.mark.parametrize("folder", ["lafan1", "bandai_namco"])
def test_on_rigs_and_motion_that_nothing_was_made_for(real_data, folder):
    if not (real_data / folder).is_dir():
        pytest.skip(f"no {folder}")
    check_harms(people_in(real_data / folder))


def test_on_the_mixamo_clips(real_data):
    if not (real_data / "mixamo_san").is_dir():
        pytest.skip("no mixamo_san")
    data = registry.create("datasets", f"mixamo[root={real_data / 'mixamo_san'}]")
    infos = {info.clip: info for info in data.cases("retarget", "cross")}
    check_harms(Crowd({(clip, ""): seen(data.load(info).reference) for clip, info in infos.items()}))


@pytest.mark.slow
@pytest.mark.parametrize("structure", ["body22", "dog21"])
def test_values_by_structure_notice_harm_too(structure):
    """Distances rise; real motion is covered less."""
    crowd = structure_in(Puppets(size="default"), structure, 60)
    for name in ("jitter, heights", "gliding, heights a second", "lifted, heights", "slower, times"):
        harm, amounts = HARMS[name]
        for value in ("fid.structure", "kid"):
            numbers = [crowd.notice(value=value), *(crowd.notice(harm, a, value) for a in amounts[-2:])]
            assert all(less < more for less, more in pairwise(numbers)), (name, value, numbers)
        assert crowd.notice(harm, amounts[-1], "coverage") < crowd.notice(value="coverage")


def test_the_main_job_has_windows_enough_in_each_half(crowd):
    assert crowd.sets().n >= 4 * FEATURES


def test_it_is_of_cases_from_two_legs_to_two_legs(cases, puppets):
    person = next(iter(cases.values()))
    dog = next(each for each in puppets.characters().values() if each.four_legged)
    metric = Fid()
    assert {metric.set_of(each) for each in cases.values()} == {TWO_LEGS}
    assert metric.set_of(replace(person, target=dog)) == ""
    barking = dog.positions(np.zeros((70, len(dog.skeleton), 3)), 30.0)
    assert metric.set_of(replace(person, source=barking)) == ""


def test_bodies_without_toes_or_spine_joints_are_seen_alike(cases):
    """The features are of shared joints, so leaving out the others changes none; positions are enough."""
    shown = next(case for case in cases.values() if len(structure_joints(case.target)) > 22)
    smaller = reduce(shown.target, "body22")
    assert len(smaller.character.skeleton) < len(shown.target.skeleton)
    complete, speed = features.features(shown.reference)
    reduced, same_speed = features.features(seen(smaller.apply(shown.reference)))
    np.testing.assert_allclose(reduced, complete, atol=1e-4)
    np.testing.assert_allclose(same_speed, speed, atol=1e-6)


def test_a_body_without_a_hand_is_in_no_set(cases):
    case = next(iter(cases.values()))
    roles = tuple(None if role == "left_hand" else role for role in case.target.roles)
    maimed = replace(case, target=replace(case.target, roles=roles))
    assert Fid().set_of(maimed) == ""
    with pytest.raises(NotSupported, match="is known as left_hand"):
        Fid().features(Comparison(maimed, case.reference))


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
