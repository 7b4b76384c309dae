"""Values of sets of results: draws, intervals, files, and their way through a run."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from small_plans import asked, know_toys

from retarget_bench.api import CaseFeatures, CaseInfo
from retarget_bench.api.comparison import Comparison
from retarget_bench.errors import FileError
from retarget_bench.evaluation import runner, set_metrics, waiting
from retarget_bench.evaluation.plan import Plan
from retarget_bench.evaluation.set_metrics import draw, evaluate
from retarget_bench.plugins import bound
from retarget_bench.results import store
from retarget_bench.results.predictions import read_prediction

pytestmark = pytest.mark.usefixtures("in_process", "toys")


# -------------------------------------------------------------------------------------------------- draws
def cell(clips: int = 30, targets: int = 2, seed: int = 0) -> tuple[dict, dict]:
    """Features whose first number names the clip and whose second one the window."""
    random = np.random.default_rng(seed)
    features, infos = {}, {}
    for clip in range(clips):
        windows = int(random.integers(3, 12))
        speed = np.sort(random.gamma(1.0, 0.4, windows)).astype(np.float32)
        for target in range(targets):
            for source in range(2):
                case = f"toy/s{source}>t{target}/c{clip}"
                infos[case] = CaseInfo(
                    case, "retarget", "intra", f"s{source}", f"t{target}", f"c{clip}", "kind", 100
                )
                real = np.stack([np.full(windows, clip), np.arange(windows)], axis=1).astype(np.float32)
                features[case] = CaseFeatures(real + 0.25 * (source + 1), real, speed)
    return features, infos


def test_no_clip_is_in_both_halves_and_both_are_equally_large():
    features, infos = cell()
    drawn = draw.draw(features, infos)
    first, second = (set(half.clips.tolist()) for half in drawn.real)
    assert not first & second
    assert len(drawn.real[0].clips) == len(drawn.real[1].clips) == drawn.n > 0
    total = sum(len(features[f"toy/s0>t{target}/c{clip}"].speed) for target in (0, 1) for clip in range(30))
    assert drawn.n > 0.4 * total
    for real, generated in zip(drawn.real, drawn.generated, strict=True):
        assert (real.clips == generated.clips).all()
        # the same windows of the same clips, from either source
        shift = generated.features - real.features
        assert set(np.unique(shift)) == {0.25, 0.5}
        assert len({(*row,) for row in real.features.tolist()}) * 2 >= drawn.n


def test_a_window_of_a_target_is_drawn_once_whatever_its_sources():
    features, infos = cell(targets=1)
    drawn = draw.draw(features, infos)
    rows = [tuple(row) for half in drawn.real for row in half.features.tolist()]
    assert len(rows) == len(set(rows))


def test_draws_depend_on_names_and_real_motion_alone():
    features, infos = cell()
    drawn = draw.draw(features, infos)
    turned = {case: features[case] for case in reversed(features)}
    assert draw.draw(turned, infos).hash == drawn.hash
    other = {case: replace(each, generated=each.generated * 7) for case, each in features.items()}
    assert draw.draw(other, infos).hash == drawn.hash
    slower = {case: replace(each, real=each.real + 1) for case, each in features.items()}
    assert draw.draw(slower, infos).hash != drawn.hash


def test_windows_are_drawn_evenly_over_root_speed(monkeypatch):
    """Slow windows are ten times as frequent; of those drawn, they are not."""
    monkeypatch.setattr(draw, "MOST", 100)
    random = np.random.default_rng(1)
    features, infos = {}, {}
    for clip in range(40):
        case = f"toy/a>b/c{clip}"
        infos[case] = CaseInfo(case, "retarget", "intra", "a", "b", f"c{clip}")
        fast = random.random(50) < 1 / 11
        speed = np.where(fast, random.uniform(0.5, 1.0, 50), random.uniform(0, 0.5, 50)).astype(np.float32)
        features[case] = CaseFeatures(speed[:, None], speed[:, None], speed)
    drawn = draw.draw(features, infos)
    assert drawn.n == 100
    share = np.mean([(half.features[:, 0] > 0.5).mean() for half in drawn.real])
    # a window in eleven is fast, but three or four of the ten stretches of speed lie above 0.5
    assert 0.25 < share < 0.45


@pytest.mark.parametrize(("counts", "n"), [((5, 5, 5), 9), ((1, 8, 3), 7), ((0, 4, 9), 13), ((2, 2), 3)])
def test_flat_takes_as_evenly_as_the_bins_allow(counts, n):
    bins = np.repeat(np.arange(len(counts)), counts)
    drawn = np.bincount(bins[draw.flat(bins, n)], minlength=len(counts))
    assert drawn.sum() == n
    for one, number in enumerate(drawn):
        assert number == counts[one] or number >= drawn.max() - 1


def test_a_cell_without_windows_draws_nothing():
    empty = CaseFeatures(np.zeros((0, 3)), np.zeros((0, 3)), np.zeros(0))
    info = CaseInfo("toy/a>b/c", "retarget", "intra", "a", "b", "c")
    assert draw.draw({info.id: empty}, {info.id: info}).n == 0


# ---------------------------------------------------------------------------------------------- jackknife
def test_the_jackknife_of_a_mean_is_its_textbook_error():
    """Equal groups: the variance of the mean of the group means, exactly."""
    random = np.random.default_rng(2)
    values = random.normal(size=(10, 7))
    without = [np.delete(values, group, axis=0).mean() for group in range(10)]
    assert evaluate.deviation(without) == pytest.approx(values.mean(axis=1).std(ddof=1) / np.sqrt(10))
    low, high = evaluate.interval(values.mean(), without)
    assert (high - low) / 2 == pytest.approx(2.262157 * evaluate.deviation(without), rel=1e-6)
    assert (high + low) / 2 == pytest.approx(values.mean())
    # of a mean they are the means of the groups
    tenths = set_metrics.SetValue("v", "s", 70, 10, values.mean(), without=tuple(without)).tenths
    assert tenths.tolist() == pytest.approx(values.mean(axis=1).tolist())


def test_the_interval_holds_the_truth_as_often_as_it_says():
    random = np.random.default_rng(3)
    hits = 0
    for _ in range(1000):
        values = random.exponential(size=(10, 30)) - 1.0
        without = [np.delete(values, group, axis=0).mean() for group in range(10)]
        low, high = evaluate.interval(values.mean(), without)
        hits += low <= 0 <= high
    assert 930 <= hits <= 970


def test_groups_are_about_equally_large_and_hold_whole_clips():
    random = np.random.default_rng(4)
    clips = {f"c{number}": int(random.integers(1, 40)) for number in range(83)}
    groups = evaluate.groups_of(clips)
    sizes = Counter(dict.fromkeys(range(10), 0))
    for clip, group in groups.items():
        sizes[group] += clips[clip]
    assert set(groups) == set(clips)
    assert max(sizes.values()) < 1.35 * min(sizes.values())


# --------------------------------------------------------------------------------------------- whole runs
def plan(root: Path, *methods: str, metric: str = "toy_sets", clips: int = 24, **changes) -> Plan:
    return asked(root, *methods, clips=clips, metrics=("position", metric), **changes)


def carry_out(*args, **changes) -> list[store.ResultPaths]:
    return runner.run(plan(*args, **changes), lambda done, total: None)


@pytest.fixture(scope="module")
def finished(tmp_path_factory) -> list[store.ResultPaths]:
    """The places of a wrong method and of the references."""
    know_toys()
    return carry_out(tmp_path_factory.mktemp("runs"), "toy_method", "reference")


def test_a_run_stores_features_and_values_and_the_references_score_the_floor(finished):
    toy, right = finished
    gap, many = set_metrics.read(toy)
    assert (gap.value_id, gap.structure) == ("toy_gap", "toy")
    assert gap.n == 3 * 24
    assert gap.clips == 24
    assert gap.low <= gap.value <= gap.high
    assert gap.tenths.mean() == pytest.approx(gap.value)
    half = 2.262157 * gap.tenths.std(ddof=1) / np.sqrt(10)
    assert (gap.high - gap.low) / 2 < 0.5 * half  # of what lies beyond the floor of the same clips
    assert (many.value, many.reason) == (None, f"toy_many needs 1000000 windows in each set, here {gap.n}")
    floor, _ = set_metrics.read(right)
    assert floor.value == pytest.approx(floor.floor, rel=1e-5)
    assert floor.low == pytest.approx(floor.high, rel=1e-5)  # whichever clips there are
    assert (floor.floor, floor.real) == (gap.floor, gap.real)
    header = store.read_header(toy.header)
    assert header.set_values["toy_gap"].better == "lower"
    assert "toy_gap" not in header.values
    assert not waiting.folder(toy).exists()
    assert len(store.find_results(toy.root)) == 2


def test_the_value_is_that_of_the_stored_predictions(finished):
    place, _ = finished
    gap, _ = set_metrics.read(place)
    infos = {info.id: info for info in store.read_cases(place.cases, "retarget", "intra")}
    data = bound.dataset("toy_cases[clips=24]").built
    metric = bound.metrics(("toy_sets",)).of_sets[0]
    cases = {case: data.load(info) for case, info in infos.items()}
    features = {
        case: metric.features(
            Comparison(each, read_prediction(place.prediction(case), each.target, each.source.fps))
        )
        for case, each in cases.items()
    }
    drawn = draw.draw(features, infos)
    (a, b), (p, q) = drawn.real, drawn.generated

    def apart(x, y):
        return np.linalg.norm(x.features.mean(axis=0) - y.features.mean(axis=0))

    assert gap.value == pytest.approx((apart(a, q) + apart(b, p)) / 2, rel=1e-6)  # features are single
    assert gap.floor == pytest.approx(apart(a, b), rel=1e-8)
    assert gap.real == drawn.hash


def test_an_interrupted_run_gives_the_same_bytes(finished, tmp_path):
    complete, _ = finished
    stopped = plan(tmp_path, "toy_method")

    class EnoughError(Exception):
        pass

    def progress(done: int, total: int) -> None:
        if done >= 20:
            raise EnoughError

    with pytest.raises(EnoughError):
        runner.run(stopped, progress)
    (cut,) = runner.run(stopped, lambda done, total: None)
    assert cut.sets.read_bytes() == complete.sets.read_bytes()
    assert cut.rows.read_bytes() == complete.rows.read_bytes()


def test_lost_features_of_a_begun_run_are_made_again(tmp_path):
    stopped = plan(tmp_path, "toy_method", clips=4)

    class EnoughError(Exception):
        pass

    def progress(done: int, total: int) -> None:
        if done >= 5:
            raise EnoughError

    with pytest.raises(EnoughError):
        runner.run(stopped, progress)
    (folder,) = tmp_path.rglob("toy_method.waiting")
    next(folder.iterdir()).unlink()
    (place,) = runner.run(stopped, lambda done, total: None)
    assert set_metrics.read(place)[0].n == 12


def test_a_value_that_real_motion_does_not_score_0_in_is_withheld():
    """By the interval of the floor: of ten parts about 0.1, or about 0."""
    parts = [(5.0, 0.14 + 0.001 * number) for number in range(10)]
    known = evaluate.SetValue("kid", "toy", 40, 12, value=5.0, floor=0.1445, low=4.0, high=6.0)
    withheld = evaluate._withheld(known, parts)
    assert (withheld.value, withheld.low, withheld.floor) == (None, None, None)
    assert withheld.reason == "kid of real motion is 0.14 here, where it should be about 0"
    near = evaluate.replace(known, floor=0.0)
    assert evaluate._withheld(near, [(value, floor - 0.1445) for value, floor in parts]) == near
    few = evaluate._withheld(evaluate.replace(known, clips=9), [])
    assert few.reason == "kid needs 10 clips to tell whether real motion scores 0, here 9"


def test_a_structure_without_features_is_not_applicable_and_says_why(tmp_path):
    (place,) = carry_out(tmp_path, "toy_method", metric="toy_sets[structures=other]")
    for value in set_metrics.read(place):
        assert value.value is None
        assert value.reason == "no toy features of structure toy"


def test_cases_that_failed_are_in_no_set(tmp_path):
    (place,) = carry_out(tmp_path, "toy_method[does=picky]", clips=8)
    assert set_metrics.read(place)[0].n == 12  # of 16 cases, half were answered


def test_a_metrics_parameters_are_part_of_the_key(tmp_path):
    one = carry_out(tmp_path, "toy_method", clips=2)[0]
    before = store.read_header(one.header).keys
    other = carry_out(tmp_path, "toy_method", clips=2, metric="toy_sets[structures=other]")[0]
    after = store.read_header(other.header).keys
    assert before["prediction_key"] == after["prediction_key"]
    assert before["score_key"] != after["score_key"]


def test_results_of_other_metrics_keep_no_sets_of_earlier_ones(tmp_path):
    (place,) = carry_out(tmp_path, "toy_method", clips=2)
    assert set_metrics.read(place)
    again = replace(plan(tmp_path, "toy_method", clips=2), metrics=("position",))
    runner.run(again, lambda done, total: None)
    assert set_metrics.read(place) == []


@pytest.mark.parametrize("damage", ["value_id\n", "", "nonsense", None])
def test_a_damaged_file_is_named(tmp_path, damage):
    (place,) = carry_out(tmp_path, "toy_method", clips=2)
    path = place.sets
    text = path.read_text()
    path.write_text(text.replace(",12,", ",many,") if damage is None else damage)
    if damage is None and text == path.read_text():
        path.write_text(text.replace("toy,", "toy,x"))
    with pytest.raises(FileError, match="cannot be read as values of sets"):
        set_metrics.read(place)
