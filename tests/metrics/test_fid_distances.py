"""Distances of sets of vectors, against closed forms, other libraries and slow ways of the same."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.linalg
from hypothesis import given
from hypothesis import strategies as st

from retarget_bench.api import Sample
from retarget_bench.metrics.fid.frechet import Frechet, frechet
from retarget_bench.metrics.fid_structure import FidStructure
from retarget_bench.metrics.fid_structure.pairs import Fits, Kid
from tests.examples import examples


def kid(a, b, groups_a, groups_b) -> float:
    return Kid()(Sample(a, groups_a), Sample(b, groups_b))


def fit(real, generated, groups_real, groups_generated, k=5):
    return Fits(k)(Sample(real, groups_real), Sample(generated, groups_generated))


def trace(sample: np.ndarray) -> float:
    """Of the covariance: the scale on which a distance is large or small."""
    return float(sample.var(axis=0, ddof=1).sum())


def sets(seed: int, n: int, d: int, m: int | None = None) -> tuple[np.ndarray, np.ndarray]:
    """Two sets with different means and full, different covariances."""
    random = np.random.default_rng(seed)
    a = random.normal(size=(n, d)) @ random.normal(size=(d, d)) + random.normal(size=d)
    b = random.normal(size=(m or n, d)) @ random.normal(size=(d, d)) + random.normal(size=d)
    return a, b


def by_square_root(a: np.ndarray, b: np.ndarray) -> float:
    """As the formula is written, with the root of the product of the covariances."""
    root = scipy.linalg.sqrtm(np.cov(a.T) @ np.cov(b.T))
    apart = a.mean(axis=0) - b.mean(axis=0)
    return float(apart @ apart + np.trace(np.cov(a.T) + np.cov(b.T) - 2 * root.real))


@pytest.mark.parametrize(("n", "m", "d"), [(400, 400, 8), (900, 500, 32), (1200, 1200, 64)])
@pytest.mark.parametrize("seed", [0, 1])
def test_frechet_agrees_with_the_matrix_square_root(seed, n, m, d):
    """PAN's eq. 21."""
    a, b = sets(seed, n, d, m)
    assert frechet(a, b) == pytest.approx(by_square_root(a, b), rel=1e-6)


@pytest.mark.parametrize(("n", "d"), [(50, 256), (256, 256), (1200, 256), (2, 3)])
def test_frechet_of_a_set_with_itself_is_nothing_beside_its_trace(n, d):
    a, _ = sets(3, n, d)
    assert frechet(a, a) < 1e-9 * trace(a)
    assert frechet(a, a[::-1]) < 1e-9 * trace(a)


@pytest.mark.parametrize("shift", [0.0, 2.0])
def test_frechet_of_fewer_windows_than_dimensions_is_that_in_their_common_space(shift):
    """20 points in 100 dimensions span 19; two such sets, brought into their joint span by a rotation."""
    random = np.random.default_rng(5)
    a, b = random.normal(size=(20, 100)), random.normal(size=(20, 100)) + shift
    basis = np.linalg.qr(np.concatenate([a, b]).T)[0]
    # in the joint span the covariances are singular still: a ridge that goes to 0 gives the root
    ridge = 1e-10 * np.eye(basis.shape[1])
    ca, cb = (np.cov((each @ basis).T) + ridge for each in (a, b))
    half = scipy.linalg.sqrtm(ca).real
    root = np.sqrt(np.clip(np.linalg.eigvalsh(half @ cb @ half), 0, None)).sum()
    apart = a.mean(axis=0) - b.mean(axis=0)
    expected = apart @ apart + np.trace(ca) + np.trace(cb) - 2 * root
    assert frechet(a, b) == pytest.approx(expected, rel=1e-4)


def test_frechet_of_known_gaussians_is_the_closed_form():
    """PAN's eq. 21 of N(0, diag(s)) and N(mu, diag(t)): |mu|^2 + sum (sqrt s - sqrt t)^2.

    Of samples with exact moments.
    """
    random = np.random.default_rng(1)
    n, d = 300, 10
    white = random.normal(size=(n, d))
    white -= white.mean(axis=0)
    exact = white @ np.linalg.inv(np.linalg.cholesky(np.cov(white.T))).T
    s, t, mu = random.uniform(0.2, 3, d), random.uniform(0.2, 3, d), random.normal(size=d)
    sides = (exact * np.sqrt(s), exact[::-1] * np.sqrt(t) + mu)
    value = FidStructure().value("fid.structure", *(Sample(each, np.arange(n)) for each in sides))
    assert value == pytest.approx(mu @ mu + ((np.sqrt(s) - np.sqrt(t)) ** 2).sum(), rel=1e-9)


@examples(25)
@given(st.integers(0, 10**6), st.integers(2, 40), st.integers(1, 20))
def test_frechet_does_not_care_for_order_sides_places_or_turns(seed, n, d):
    a, b = sets(seed, n, d)
    random = np.random.default_rng(seed)
    value, scale = frechet(a, b), trace(a) + trace(b) + float(((a.mean(0) - b.mean(0)) ** 2).sum())
    turn = np.linalg.qr(random.normal(size=(d, d)))[0]
    shift = random.normal(size=d)
    for other in (
        frechet(b, a),
        frechet(a[random.permutation(n)], b[random.permutation(n)]),
        frechet(a @ turn + shift, b @ turn + shift),
    ):
        assert other == pytest.approx(value, abs=1e-9 * scale)


def parts_of(features: np.ndarray, clips: np.ndarray) -> list[tuple[Sample, Sample]]:
    """Every set without a tenth of its clips: as a part, and as a set of its own."""
    sample = Sample(features, clips)
    kept = [np.flatnonzero(clips % 10 != group) for group in range(10)]
    return [(sample.part(rows), Sample(features[rows], clips[rows])) for rows in kept]


def test_below_four_windows_per_dimension_only_kid_is_given():
    metric = FidStructure()
    assert {value.id: metric.least(value.id) for value in metric.card.values} == {
        "fid.structure": 4 * 43,
        "kid": 32,
        "coverage": 4 * 43,
        "density": 4 * 43,
    }


@pytest.mark.parametrize("odd", ["", "constant", "one clip", "few"])
@pytest.mark.parametrize("value", ["fid.structure", "kid", "coverage", "density"])
def test_a_part_of_a_set_is_worth_what_it_is_worth_alone(value, odd):
    """Also where a feature never varies, varies in one clip only, or windows are fewer than features."""
    n, d = (60, 100) if odd == "few" else (400, 24)
    a, b = sets(11, n, d)
    clips = np.arange(n) // 8
    if odd == "constant":
        a[:, 3] = 2.0
    if odd == "one clip":
        a[:, 3] = np.where(clips == 4, np.arange(n) % 8, 0.0)
    metric = FidStructure()
    for (real, alone), (generated, generated_alone) in zip(
        parts_of(a, clips), parts_of(b, clips + 1000 * (odd != "few")), strict=True
    ):
        part = metric.value(value, real, generated)
        assert part == pytest.approx(FidStructure().value(value, alone, generated_alone), rel=1e-8)


def slow_kid(a, b, groups_a, groups_b) -> float:
    def mean(x, y, p, q):
        pairs = [(i, j) for i in range(len(x)) for j in range(len(y)) if p[i] != q[j]]
        return np.mean([(x[i] @ y[j] / len(x[i]) + 1) ** 3 for i, j in pairs])

    return (
        mean(a, a, groups_a, groups_a) + mean(b, b, groups_b, groups_b) - 2 * mean(a, b, groups_a, groups_b)
    )


def test_kid_is_what_its_formula_says():
    a, b = sets(2, 14, 5, 11)
    groups_a, groups_b = np.arange(14) // 3, np.arange(11) // 2 + 3
    assert kid(a, b, groups_a, groups_b) == pytest.approx(slow_kid(a, b, groups_a, groups_b), rel=1e-10)


def draws(
    random: np.random.Generator, clips: int, windows: int, first: int
) -> tuple[np.ndarray, np.ndarray]:
    """Windows of clips: those of one clip lie near each other."""
    centres = random.normal(size=(clips, 4))
    vectors = np.repeat(centres, windows, axis=0) + 0.3 * random.normal(size=(clips * windows, 4))
    return vectors, first + np.repeat(np.arange(clips), windows)


def test_kid_of_the_same_distribution_is_0_on_average_though_windows_of_a_clip_are_alike():
    random = np.random.default_rng(0)
    grouped, plain = [], []
    for _ in range(400):
        (a, p), (b, q) = draws(random, 8, 6, 0), draws(random, 8, 6, 100)
        grouped.append(kid(a, b, p, q))
        plain.append(kid(a, b, np.arange(48), np.arange(100, 148)))
    error = np.std(grouped) / np.sqrt(len(grouped))
    assert abs(np.mean(grouped)) < 3 * error
    assert np.mean(plain) > 20 * error  # what leaving the pairs of one clip in would do


def test_kid_of_apart_distributions_is_the_squared_distance_of_their_kernel_means():
    """Points +-1 against +-2 in one dimension: E k(x, y) = 1 + 3 E[x^2] E[y^2] for symmetric x, y."""
    random = np.random.default_rng(4)
    values = []
    for _ in range(300):
        a, b = random.choice([-1.0, 1.0], (30, 1)), random.choice([-2.0, 2.0], (30, 1))
        values.append(kid(a, b, np.arange(30), np.arange(30, 60)))
    expected = (1 + 3 * 1 * 1) + (1 + 3 * 4 * 4) - 2 * (1 + 3 * 1 * 4)
    assert np.mean(values) == pytest.approx(expected, abs=4 * np.std(values) / np.sqrt(len(values)))


def test_kid_of_one_clip_is_undefined():
    a, b = sets(0, 5, 3)
    assert np.isnan(kid(a, b, np.zeros(5), np.ones(5)))


def slow_fit(real, generated, groups_real, groups_generated, k):
    covered, balls = 0, 0
    for i in range(len(real)):
        others = sorted(
            np.linalg.norm(real[i] - real[j]) for j in range(len(real)) if groups_real[i] != groups_real[j]
        )
        inside = [
            j
            for j in range(len(generated))
            if groups_generated[j] != groups_real[i]
            and np.linalg.norm(real[i] - generated[j]) < others[k - 1]
        ]
        covered += bool(inside)
        balls += len(inside)
    return covered / len(real), balls / (k * len(generated))


@pytest.mark.parametrize("size", [1, 3])
def test_coverage_and_density_agree_with_the_naive_way(size):
    """size 1: every window is a group of its own, which is the published definition."""
    random = np.random.default_rng(8)
    real, generated = random.normal(size=(30, 4)), 1.3 * random.normal(size=(24, 4)) + 0.4
    p, q = np.arange(30) // size, np.arange(24) // size + (100 if size == 1 else 5)
    assert fit(real, generated, p, q, 3) == pytest.approx(slow_fit(real, generated, p, q, 3))


def test_coverage_of_real_motion_is_one_minus_a_power_of_two():
    """Naeem et al.: for the same distribution and large n, 1 - 2^-k; density 1."""
    random = np.random.default_rng(9)
    fits = [
        fit(
            random.normal(size=(500, 6)), random.normal(size=(500, 6)), np.arange(500), np.arange(500, 1000)
        )
        for _ in range(10)
    ]
    assert np.mean([each.coverage for each in fits]) == pytest.approx(1 - 2**-5, abs=0.01)
    assert np.mean([each.density for each in fits]) == pytest.approx(1.0, abs=0.05)


def test_too_few_real_windows_have_no_balls():
    random = np.random.default_rng(0)
    few = fit(random.normal(size=(5, 2)), random.normal(size=(5, 2)), np.arange(5), np.arange(5, 10))
    assert np.isnan(few).all()


def test_a_part_of_a_set_that_never_varies_has_a_distance():
    """As of a body that stands still throughout: the covariance of the whole is 0."""
    still = Sample(np.full((60, 5), 2.0), np.repeat(np.arange(6), 10).astype(str))
    moving = Sample(np.random.default_rng(4).normal(size=(60, 5)), still.clips)
    distance = Frechet()
    distance(moving, still)
    part = still.part(np.arange(50))
    assert distance(moving, part) == pytest.approx(frechet(moving.features, part.features))
