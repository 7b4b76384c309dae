"""Source-instance fidelity: the arithmetic of its authors' toolkit, and what its ends mean."""

from __future__ import annotations

from dataclasses import replace
from itertools import permutations

import numpy as np
import pytest
from metric_cases import Sides, character, motion

from retarget_bench.api.comparison import Comparison
from retarget_bench.metrics.sif import (
    LENGTH,
    Sif,
    correlation,
    distances,
    exchanged,
    group,
    summary,
    to_length,
)


@pytest.fixture(scope="module")
def oracle(real_data):
    with np.load(real_data / "oracles/sif.npz") as arrays:
        return {name: arrays[name] for name in arrays.files}


def clips_of(oracle, part: str, number: int) -> list[np.ndarray]:
    names = [f"{part}_{number}_{clip}" for clip in range(6)]
    return [oracle[name] for name in names if name in oracle]


@pytest.mark.parametrize("mode", ["raw", "fixed"])
def test_mean_interval_and_p_are_the_toolkits(oracle, mode):
    groups = []
    for number in range(8):
        both = (oracle[f"{mode}_{part}_distances_{number}"] for part in ("source", "output"))
        groups.append(tuple(each[np.triu_indices(len(each), 1)] for each in both))
    found = summary(groups, [str(oracle[f"block_{number}"]) for number in range(8)])
    np.testing.assert_allclose(
        (found.mean, found.low, found.high, found.p), oracle[f"{mode}_summary"][:4], atol=1e-6
    )


@pytest.mark.parametrize("mode", ["raw", "fixed"])
def test_distances_and_correlations_are_the_toolkits(oracle, mode):
    for number in range(8):
        found = {}
        for part in ("source", "output"):
            clips = clips_of(oracle, part, number)
            clips = [to_length(clip, LENGTH) for clip in clips] if mode == "fixed" else clips
            found[part] = distances(clips)
            expected = oracle[f"{mode}_{part}_distances_{number}"]
            np.testing.assert_allclose(found[part], expected[np.triu_indices(len(clips), 1)], rtol=1e-6)
        assert correlation(*found.values()) == pytest.approx(oracle[f"{mode}_sif"][number], abs=1e-6)
        ratio = found["output"].mean() / found["source"].mean()
        assert ratio == pytest.approx(oracle[f"{mode}_variation"][number], rel=1e-6)


# ------------------------------------------------------------------------------------- what its ends mean
def some(number: int, seed: int = 0) -> list[np.ndarray]:
    """Clips of unequal lengths."""
    random = np.random.default_rng(seed)
    return [random.normal(size=(20 + 3 * clip, 7, 3)) * (1.0 + clip) for clip in range(number)]


def test_answers_that_are_their_sources_have_one() -> None:
    clips = some(4)
    assert group(list(zip(clips, clips, strict=True))) == pytest.approx(
        {"sif": 1.0, "sif.fixed": 1.0, "sif.variation": 1.0}
    )


def test_one_answer_for_all_sources_has_nought() -> None:
    clips, still = some(4), np.random.default_rng(1).normal(size=(20, 5, 3))
    found = group([(clip, still) for clip in clips])
    assert (found["sif"], found["sif.fixed"]) == (0.0, 0.0)
    assert found["sif.variation"] == pytest.approx(0.0, abs=1e-12)


def test_answers_exchanged_within_a_group_have_less() -> None:
    clips = some(4)
    for order in permutations(range(4)):
        if order != (0, 1, 2, 3):
            assert group([(clips[k], clips[place]) for k, place in enumerate(order)])["sif"] < 1.0 - 1e-6


def test_answers_may_be_turned_moved_and_scaled() -> None:
    """Each clip otherwise, by any place and turn of each frame; by one scale in all."""
    random, clips, answers = np.random.default_rng(2), some(4), some(4, seed=3)
    turned = []
    for clip in answers:
        turn = np.linalg.qr(random.normal(size=(len(clip), 3, 3)))[0]
        turn *= np.sign(np.linalg.det(turn))[:, None, None]
        turned.append(1.7 * clip @ turn + random.normal(size=(len(clip), 1, 3)))
    raw = group(list(zip(clips, answers, strict=True)))
    assert group(list(zip(clips, turned, strict=True)))["sif"] == pytest.approx(raw["sif"], abs=1e-9)


def test_exchanging_goes_through_all_orders_as_words_are_sorted() -> None:
    sources, answers = distances(some(4)), some(4, seed=5)
    expected = [
        float(correlation(sources, symmetric(answers)[np.ix_(order, order)][np.triu_indices(4, 1)]))
        for order in permutations(range(4))
    ]
    shares = (np.arange(24) + 0.5) / 24
    np.testing.assert_allclose(exchanged(sources, distances(answers), shares), expected, atol=1e-12)
    assert np.mean(expected) == pytest.approx(0.0, abs=1e-12)


def symmetric(clips: list[np.ndarray]) -> np.ndarray:
    between = np.zeros((len(clips), len(clips)))
    between[np.triu_indices(len(clips), 1)] = distances(clips)
    return between + between.T


def test_a_summary_of_no_group_is_an_error() -> None:
    with pytest.raises(ValueError, match="no group"):
        summary([], [])


# ------------------------------------------------------------------------------------------- in a run
def extract(kind: str, seed: int) -> np.ndarray:
    source, target = character("A", seed=1), character("B", seed=2)
    answer = motion(target, 12 + seed, seed)
    comparison = Sides(motion(source, 12 + seed, seed), answer, answer).comparison()
    case = replace(comparison.case, info=replace(comparison.case.info, kind=kind))
    return np.asarray(Sif().extract(Comparison(case, answer)), np.float32)


def test_clips_of_a_pair_are_grouped_by_kind() -> None:
    """Kinds of two clips have no value, nor have unknown ones; a group has one value, at its
    shortest clip, in whatever order clips come."""
    kinds = ("run", "walk", "walk", "", "sit", "walk", "run", "", "", "walk")
    extracts = [extract(kind, seed) for seed, kind in enumerate(kinds)]
    values = Sif().values(extracts)
    assert [number for number, each in enumerate(values) if each] == [1]
    (alone, *others) = Sif().values(
        [each for each, kind in zip(extracts, kinds, strict=True) if kind == "walk"]
    )
    assert (values[1], others) == (alone, [{}, {}, {}])
    assert Sif().values(extracts[::-1])[::-1] == values
    assert 0.5 < alone["sif"] <= 1.0  # the same rotations by a body of other lengths
