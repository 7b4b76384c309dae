"""Intervals, sign flips and corrections against brute force, scipy, numbers by hand, and known truth."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from clip_simulation import OWN, RECKLESS, STEADY, errors, failures
from hypothesis import example, given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy import optimize, stats

from retarget_bench.analysis import statistics
from tests.examples import examples

SIZES = st.integers(1, 8).flatmap(
    lambda n: arrays(float, (1, n), elements=st.floats(-10, 10).map(lambda x: round(x, 3)))
)


def plain(differences: list[float]) -> float:
    """The statistic of the paired test in plain words: Hall's transformed, studentised mean."""
    n = len(differences)
    mean = sum(differences) / n
    square = sum(d * d for d in differences) / n
    variance = max(sum((d - mean) ** 2 for d in differences) / n, 1e-9 * square)
    if not square:
        return 0.0
    skewness = sum((d - mean) ** 3 for d in differences) / n / variance**1.5
    t = mean / math.sqrt(variance)
    return abs(t + skewness * t**2 / 3 + skewness**2 * t**3 / 27 + skewness / (6 * n))


def by_brute_force(differences: np.ndarray) -> float:
    """The share of all 2^n sign flips that are as far from 0 as what was observed."""
    observed = plain(differences.tolist())
    flips = itertools.product((1.0, -1.0), repeat=len(differences))
    sizes = [plain([s * d for s, d in zip(signs, differences.tolist(), strict=True)]) for signs in flips]
    return sum(size >= observed * (1 - 1e-8) for size in sizes) / len(sizes)


@examples(60)
@given(SIZES)
@example(np.array([[3.75, 3.625, 3.695, 3.688]]))  # agree so well that their spread is lost in rounding
def test_few_clips_give_exactly_the_share_of_all_flips(differences):
    assert statistics.sign_flip(differences)[0] == by_brute_force(differences[0])


@pytest.mark.parametrize("clips", [10, 13])
def test_all_flips_are_tried_up_to_13_clips(clips):
    differences = np.random.default_rng(clips).gamma(1.0, 1.0, (2, clips)) - 0.5
    expected = [by_brute_force(row) for row in differences]
    assert statistics.sign_flip(differences).tolist() == expected


@pytest.mark.parametrize("clips", [7, 10])
def test_all_flips_agree_with_scipys_permutation_test(clips):
    differences = np.random.default_rng(clips).normal(0.4, 1.0, clips)

    def statistic(values: np.ndarray, axis: int) -> np.ndarray:
        return np.apply_along_axis(lambda row: plain(row.tolist()), axis, values)

    result = stats.permutation_test(
        (differences,), statistic, permutation_type="samples", n_resamples=np.inf, alternative="greater"
    )
    assert statistics.sign_flip(differences[None])[0] == result.pvalue


def test_drawn_flips_come_close_to_all_flips():
    differences = np.random.default_rng(3).normal([[0.3], [0.2]], 1.0, (2, 14))
    expected = np.array([by_brute_force(row) for row in differences])
    close = (expected > 0.025) & (expected < 0.1)
    assert sorted(close) == [False, True]
    draws = np.where(close, statistics.SAMPLED_FLIPS, statistics.FIRST_FLIPS)
    noise = np.sqrt(expected * (1 - expected) / draws)
    assert np.all(np.abs(statistics.sign_flip(differences) - expected) < 4 * noise + 1e-4)


def test_drawn_flips_count_the_observed_one_and_are_always_the_same():
    certain = np.linspace(1.0, 1.1, 40)[None]
    assert statistics.sign_flip(certain)[0] == 1 / (statistics.FIRST_FLIPS + 1)
    # frozen: the raw bits of Philox are the same in every version of numpy, on every machine
    assert statistics._signs(20, statistics.SAMPLED_FLIPS)[1, :10].tolist() == FIRST_SIGNS


FIRST_SIGNS = [-1.0, 1.0, 1.0, -1.0, -1.0, 1.0, -1.0, -1.0, -1.0, -1.0]


@given(SIZES, st.floats(0.001, 1000))
@examples(50)
def test_unit_order_and_direction_do_not_matter(differences, unit):
    p = statistics.sign_flip(differences)[0]
    assert statistics.sign_flip(-differences)[0] == p
    assert statistics.sign_flip(differences[:, ::-1])[0] == p
    assert statistics.sign_flip(unit * differences)[0] == pytest.approx(p)
    assert 0 < p <= 1


def test_no_difference_is_no_alarm():
    assert statistics.sign_flip(np.zeros((2, 40))).tolist() == [1.0, 1.0]
    assert statistics.sign_flip(np.empty((3, 0))).tolist() == [1.0, 1.0, 1.0]


# ------------------------------------------------------------------------------------------- intervals
def test_without_skew_the_interval_is_that_of_student():
    half = np.random.default_rng(0).normal(size=12)
    mirrored = np.concatenate([5 + half, 5 - half])
    (interval,) = statistics.mean_intervals(mirrored[None])
    expected = stats.t.interval(0.95, 23, mirrored.mean(), stats.sem(mirrored))
    assert (interval.low, interval.high) == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("clips", [10, 37, 200])
def test_with_skew_the_ends_solve_halls_equation(clips):
    sample = np.random.default_rng(clips).gamma(0.7, 2.0, clips)
    (interval,) = statistics.mean_intervals(sample[None])
    g, root = stats.skew(sample), math.sqrt(clips)

    def transformed(mean: float) -> float:
        w = (sample.mean() - mean) / stats.tstd(sample)
        return root * (w + g * w**2 / 3 + g**2 * w**3 / 27 + g / (6 * clips))

    q = stats.t.ppf(0.975, clips - 1)
    far = 50 * sample.std()
    low = optimize.brentq(lambda m: transformed(m) - q, sample.mean() - far, sample.mean() + far)
    high = optimize.brentq(lambda m: transformed(m) + q, sample.mean() - far, sample.mean() + far)
    assert (interval.low, interval.high) == pytest.approx((low, high), rel=1e-9)


def test_intervals_are_withheld_below_ten_clips():
    means = np.random.default_rng(0).normal(size=(2, 12))
    means[1, 9:] = np.nan
    first, second = statistics.mean_intervals(means)
    assert first is not None
    assert second is None
    assert statistics.paired_intervals(means[:, :9]) == [None, None]


def test_missing_clips_are_as_if_they_were_not_there():
    means = np.random.default_rng(1).gamma(1.0, 1.0, (1, 30))
    means[0, ::4] = np.nan
    (interval,) = statistics.mean_intervals(means)
    (expected,) = statistics.mean_intervals(means[:, ~np.isnan(means[0])])
    assert (interval.low, interval.high) == pytest.approx((expected.low, expected.high), rel=1e-12)


def test_equal_means_have_an_interval_of_no_width():
    assert statistics.mean_intervals(np.full((1, 20), 3.0)) == [statistics.Interval(3.0, 3.0)]
    assert statistics.paired_intervals(np.full((1, 20), 3.0)) == [statistics.Interval(3.0, 3.0)]


@pytest.mark.parametrize("clips", [10, 13, pytest.param(30, marks=pytest.mark.slow)])
def test_paired_intervals_hold_what_the_test_does_not_reject(clips):
    differences = np.random.default_rng(clips).gamma(1.0, 1.0, (6, clips)) - 0.8
    for row, interval in zip(differences, statistics.paired_intervals(differences), strict=True):
        error = row.std(ddof=1) / math.sqrt(clips)
        for end, inwards in ((interval.low, 1), (interval.high, -1)):
            inside, outside = (row - end - step * inwards * error for step in (0.01, -0.01))
            assert statistics.sign_flip(inside[None])[0] >= statistics.ALPHA
            assert statistics.sign_flip(outside[None])[0] < statistics.ALPHA


def test_means_per_clip_weigh_cases_within_clips_only():
    numbers = np.array([[1.0, 3.0, 10.0, np.nan, np.nan], [1.0, np.nan, 2.0, 4.0, 6.0]])
    clip_means = statistics.per_clip(numbers, np.array([0, 0, 1, 1, 2]))
    np.testing.assert_array_equal(clip_means, [[2.0, 10.0, np.nan], [1.0, 3.0, 6.0]])


# ------------------------------------------------------------------------------------------ many tests
def flips(clips: int) -> list[tuple[float, ...]]:
    return list(itertools.product((1.0, -1.0), repeat=clips))


def far(row: np.ndarray, signs: tuple[float, ...]) -> float:
    return plain((row * np.array(signs)).tolist())


def greatest(rows: np.ndarray, least: float) -> float:
    """The share of all flips in which any of the rows is as far from 0 as this."""
    hits = [max(far(row, signs) for row in rows) >= least * (1 - 1e-8) for signs in flips(rows.shape[1])]
    return sum(hits) / len(hits)


@pytest.mark.parametrize("clips", [5, 8])
def test_step_down_is_the_share_of_flips_whose_greatest_statistic_is_as_great(clips):
    rows = np.random.default_rng(clips).normal([[0.1], [0.5], [1.2]], 1.0, (3, clips))
    sizes = [far(row, (1.0,) * clips) for row in rows]
    order = np.argsort(sizes)[::-1]
    expected, above = {}, 0.0
    for place, row in enumerate(order):
        above = max(above, greatest(rows[order[place:]], sizes[row]))
        expected[row] = above
    assert statistics.step_down(rows).tolist() == [expected[row] for row in range(3)]


@pytest.mark.parametrize("seed", range(3))
def test_methods_are_compared_with_the_best_in_the_family_of_all_that_are_left(seed):
    means = np.random.default_rng(seed).normal([[0.0], [0.2], [0.8], [3.0]], 1.0, (4, 7))
    best = int(means.mean(axis=1).argmin())
    sizes = {row: far(means[row] - means[best], (1.0,) * 7) for row in range(4) if row != best}
    left, above, expected = set(range(4)), 0.0, np.ones(4)
    for row in sorted(sizes, key=lambda row: -sizes[row]):
        pairs = np.array([means[one] - means[two] for one, two in itertools.combinations(sorted(left), 2)])
        above = expected[row] = max(above, greatest(pairs, sizes[row]))
        left -= {row}
    ranked = statistics.against_best(means)
    assert ranked[0] == best
    np.testing.assert_allclose(ranked[1], expected, rtol=1e-12)


def test_a_value_that_says_the_same_again_costs_nothing_and_one_of_its_own_does():
    rows = np.random.default_rng(1).normal(0.5, 1.0, (2, 20))
    alone = statistics.sign_flip(rows[:1])[0]
    assert statistics.step_down(np.array([rows[0], 3 * rows[0]])).tolist() == [alone, alone]
    both = statistics.step_down(rows)
    assert (both >= statistics.sign_flip(rows)).all()
    assert both.min() > statistics.sign_flip(rows).min()


def test_a_row_without_some_clips_is_flipped_on_those_that_it_has():
    rows = np.random.default_rng(2).normal(0.6, 1.0, (1, 12))
    gaps = np.insert(rows, [3, 9], np.nan, axis=1)
    assert statistics.sign_flip(gaps)[0] == pytest.approx(statistics.sign_flip(rows)[0], abs=0.02)
    assert statistics.step_down(gaps)[0] == pytest.approx(statistics.step_down(rows)[0], abs=0.02)


def test_nobody_is_compared_with_nobody():
    assert statistics.step_down(np.empty((0, 20))).tolist() == []
    assert statistics.against_best(np.ones((1, 20)))[1].tolist() == [1.0]


def test_values_best_at_a_goal_count_by_their_factor_from_it():
    losses = statistics.losses(np.array([4.0, 1.0, 2.0, 0.0, -1.0, 1e9, np.nan]), "target", 2.0)
    far = math.log(statistics.FARTHEST_RATIO)
    assert losses.tolist() == pytest.approx(
        [math.log(2), math.log(2), 0, far, far, far, math.nan], nan_ok=True
    )
    assert statistics.losses(np.array([1.0]), "higher").tolist() == [-1.0]


# ------------------------------------------------------------------------------- what clips can show
def test_ten_methods_that_differ_everywhere_are_told_apart_with_ten_clips():
    means = np.arange(10)[:, None] + np.random.default_rng(0).normal(0, 0.01, (10, statistics.ENOUGH_CLIPS))
    assert (statistics.against_best(means)[1][1:] < statistics.ALPHA).all()


@pytest.mark.parametrize("clips", [10, 43, 94])
def test_failures_as_rare_as_unseen_are_missed_in_one_sample_of_twenty(clips):
    assert (1 - statistics.unseen(clips)) ** clips == pytest.approx(0.05)
    assert statistics.unseen(clips) == pytest.approx(3 / clips, rel=0.15)  # the rule of three


def test_rare_failures_are_seen_from_74_clips_on():
    assert statistics.unseen(74) <= statistics.RARE < statistics.unseen(73)
    assert statistics.CLIPS_FOR_RARE == 74


@pytest.mark.parametrize(("clips", "times", "p"), [(20, 1, 0.2), (43, 1, 0.06), (43, 45, 0.01)])
def test_clips_for_power_give_the_power_of_students_test(clips, times, p):
    """The size of the effect that gives this p to Student's paired test; its power by noncentral t."""
    effect = stats.t.isf(p / 2, clips - 1) / math.sqrt(clips)
    needed = statistics.clips_for_power(p, times * p, clips)
    critical = stats.t.isf(statistics.ALPHA / times / 2, needed - 1)
    power = stats.nct.sf(critical, needed - 1, effect * math.sqrt(needed))
    assert power == pytest.approx(statistics.POWER, abs=0.05)


def test_no_number_of_clips_shows_no_difference_and_clearer_ones_need_fewer():
    assert statistics.clips_for_power(1.0, 1.0, 20) is None
    needed = [statistics.clips_for_power(p, min(1.0, 10 * p), 20) for p in (0.9, 0.5, 0.2, 0.01)]
    assert needed == sorted(needed, reverse=True)
    assert needed[-1] > 20


# --------------------------------------------------------------------------------------- known truth
REPEATS = 4000
FEWER_REPEATS = 1000


def false_alarms(
    clips: int, methods: tuple[tuple[float, float], ...], seed: int, repeats: int = REPEATS
) -> float:
    first, second = errors(np.random.default_rng(seed), repeats, clips, methods)
    return float((statistics.sign_flip(first - second) < 0.05).mean())


EQUALS = {"alike": (OWN, OWN), "unlike": (OWN, STEADY), "one reckless": (RECKLESS, STEADY)}


def test_equal_methods_are_told_apart_one_time_in_twenty():
    """Fifty clips, the pairs per clip and the skew of real results; the pair that errs most often."""
    assert 0.04 <= false_alarms(50, EQUALS["one reckless"], 1, FEWER_REPEATS) <= 0.065


def failing(clips: int, repeats: int) -> tuple[np.ndarray, np.ndarray]:
    """p-values of two methods of one mean, one of which fails on 4 % of all clips; whether that shows."""
    random = np.random.default_rng(7)
    first, second = errors(random, repeats, clips, (OWN, OWN))
    factors = failures(random, first.shape, statistics.RARE, 10)
    return statistics.sign_flip(factors * first - second), (factors > 1).any(axis=1)


@pytest.mark.parametrize("clips", [13, pytest.param(43, marks=pytest.mark.slow)])
def test_false_alarms_by_rare_failures_are_samples_without_any(clips):
    p, without_failures = failing(clips, 800)
    assert (p[without_failures] < 0.05).mean() <= 0.05
    assert (p[~without_failures] < 0.05).mean() >= 0.7
    assert (~without_failures).mean() == pytest.approx((1 - statistics.RARE) ** clips, abs=0.06)


@pytest.mark.slow
@pytest.mark.parametrize("clips", [statistics.CLIPS_FOR_RARE, 94])
def test_verdicts_without_reserve_hold_with_rare_failures(clips):
    assert (failing(clips, REPEATS)[0] < 0.05).mean() <= 0.06


@pytest.mark.parametrize(
    ("share", "documented"), [pytest.param(0.1, 0.309, marks=pytest.mark.slow), (0.2, 0.827)]
)
def test_methods_that_differ_are_told_apart_as_often_as_the_docs_say(share, documented):
    """Errors smaller by this share, 43 clips: docs/tables.md, with other random numbers."""
    repeats = 1000
    first, second = errors(np.random.default_rng(6), repeats, 43, (OWN, OWN))
    power = (statistics.sign_flip(first - (1 - share) * second) < 0.05).mean()
    assert power == pytest.approx(documented, abs=4 * math.sqrt(documented * (1 - documented) / repeats))


def test_intervals_cover_the_truth_nineteen_times_in_twenty():
    (means,) = errors(np.random.default_rng(2), REPEATS, 50, (OWN,))
    covered = [interval.low <= 1 <= interval.high for interval in statistics.mean_intervals(means)]
    assert 0.94 <= np.mean(covered) <= 0.96


@pytest.mark.slow
def test_equal_methods_share_the_first_place_in_nineteen_tables_of_twenty():
    """Of eight equal methods somebody is told from the best."""
    samples = errors(np.random.default_rng(4), 400, 50, (OWN,) * 8)
    separated = [
        statistics.against_best(samples[:, table])[1].min() < statistics.ALPHA for table in range(400)
    ]
    assert 0.03 <= np.mean(separated) <= 0.07
