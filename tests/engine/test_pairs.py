"""Values of cases that all clips of a pair decide together: MPJPE after the path of the pair is fitted."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import lsq_linear
from small_plans import asked, carry_out
from toys.toy_cases import OFFSETS, PARENTS

from retarget_bench import defaults
from retarget_bench.analysis.summary import OnDemand, split_summaries
from retarget_bench.errors import BenchError
from retarget_bench.evaluation import runner, waiting
from retarget_bench.evaluation.pairs import of_case
from retarget_bench.evaluation.score import score
from retarget_bench.exchange.checking import _pair_scored_again
from retarget_bench.metrics import path_fitted
from retarget_bench.plugins import bound, registry
from retarget_bench.results import store
from retarget_bench.tables.builder import tables
from retarget_bench.tables.model import Table

pytestmark = pytest.mark.usefixtures("in_process", "toys")

VALUE, FIT = "mpjpe_h.path_fitted", ("path_fit.level", "path_fit.lift", "path_fit.clips")
METRICS = ("path_fitted", "position")


def numbers(results: store.Results) -> dict[str, dict[str, float]]:
    return {entry.case: entry.values for entry in results.entries}


def positions(rotations: np.ndarray, root: np.ndarray, size: float) -> np.ndarray:
    """Forward kinematics by 3 x 3 matrices."""
    w, x, y, z = np.moveaxis(rotations, -1, 0)
    matrices = np.stack(
        [
            *(1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
            *(2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
            *(2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
        ],
        axis=-1,
    ).reshape(*w.shape, 3, 3)
    turned, placed = [matrices[:, 0]], [root]
    for joint, parent in list(enumerate(PARENTS))[1:]:
        placed.append(placed[parent] + turned[parent] @ (size * OFFSETS[joint]))
        turned.append(turned[parent] @ matrices[:, joint])
    return np.stack(placed, axis=1)


def test_values_are_those_of_plain_numpy_on_the_stored_predictions(tmp_path: Path) -> None:
    (results,) = carry_out(tmp_path, "toy_method[does=noise]", clips=5, metrics=METRICS)
    stored, data = numbers(results), bound.dataset("toy_cases[clips=5]").built
    for pair, size in (("small>tall", 1.5), ("tall>small", 1.0)):
        answers, rights, roots = {}, {}, {}
        for info in (each for each in results.infos if each.pair == pair):
            case, file = data.load(info), np.load(results.paths.prediction(info.id))
            answers[info.id] = positions(file["rotations"].astype(float), file["root"].astype(float), size)
            rights[info.id] = positions(case.reference.rotations, case.reference.root, size)
            roots[info.id] = case.source.root[0]
        level = [0, 2]
        moved = np.concatenate([(answers[case][:, 0] - roots[case])[:, level] for case in answers]).ravel()
        should = np.concatenate([(rights[case][:, 0] - roots[case])[:, level] for case in answers]).ravel()
        factor = lsq_linear(moved[:, None], should, bounds=(0, np.inf), tol=1e-15).x[0]
        lift = np.mean([(rights[case][:, 0, 1] - answers[case][:, 0, 1]) for case in answers])
        height = size * (np.hypot(0.1, 0.05) + 0.4 + 0.4 + 0.3 + 0.4)
        for case, answer in answers.items():
            fitted = answer.copy()
            shift = (factor - 1) * (answer[:, :1] - roots[case])[..., level]
            fitted[..., level] += shift
            fitted[..., 1] += lift
            error = np.linalg.norm(fitted - rights[case], axis=-1).mean() / height * 100
            assert stored[case][VALUE] == pytest.approx(error, rel=1e-6)
            assert stored[case]["path_fit.level"] == pytest.approx(factor, abs=1e-6)
            assert stored[case]["path_fit.lift"] == pytest.approx(100 * lift / height, abs=1e-6)
            assert stored[case]["path_fit.clips"] == 5


def test_pairs_of_two_clips_have_no_fit(tmp_path: Path) -> None:
    (results,) = carry_out(tmp_path, "toy_method[does=noise]", clips=2, metrics=METRICS)
    assert VALUE in results.header.values
    for values in numbers(results).values():
        assert "mpjpe_h.world" in values
        assert not values.keys() & {VALUE, *FIT}


def test_a_pair_is_fitted_to_its_answered_clips(tmp_path: Path) -> None:
    (results,) = carry_out(tmp_path, "toy_method[does=picky]", clips=3, metrics=METRICS)
    assert results.header.counts.unsupported == 3
    assert {case: values["path_fit.clips"] for case, values in numbers(results).items() if values} == {
        f"toy/small>tall/clip {n}": 3 for n in range(3)
    }


def test_order_and_interruption_change_nothing(tmp_path: Path) -> None:
    def rows(folder: str, *stages: dict[str, object]) -> bytes:
        for changes in stages:
            plan = asked(tmp_path / folder, "toy_method[does=noise]", clips=5, metrics=METRICS)
            (place,) = runner.run(replace(plan, **changes), lambda done, total: None)
        assert not waiting.folder(place).exists()
        return place.rows.read_bytes()

    once = rows("once", {})
    assert rows("in parts", {"clips": ("clip 3", "clip 0")}, {"clips": ("clip 4",)}, {}) == once
    assert rows("scored later", {"stage": "predict"}, {"stage": "score"}) == once


def _raises(self, clips):
    yield {VALUE: 1.0}
    raise ValueError("of its own")


def _endless(self, clips):
    while True:
        yield {VALUE: 1.0}


@pytest.mark.parametrize(
    ("extract", "values", "message"),
    [
        (None, lambda self, clips: None, "not iterable"),
        (None, _raises, "of its own"),
        (None, _endless, "gave values of 4 or more clips for 3"),
        (None, lambda self, clips: [{VALUE: "1"}] * 3, "instead of a number"),
        (None, lambda self, clips: [{VALUE: float("nan")}] * 3, f"gave nan for {VALUE}"),
        (lambda self, comparison: np.float64(1.0), lambda self, clips: [{}] * 2, "gave values of 2"),
        (lambda self, comparison: np.array(np.nan), lambda self, clips: [{}] * 3, "not finite"),
    ],
)
def test_a_metric_that_breaks_its_contract_costs_its_own_values(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, extract, values, message: str
) -> None:
    (metric,) = bound.metrics(("path_fitted",)).of_pairs
    monkeypatch.setattr(type(metric), "values", values)
    if extract is not None:
        monkeypatch.setattr(type(metric), "extract", extract)
    (results,) = carry_out(tmp_path, "toy_method", metrics=METRICS)
    (fault,) = results.header.faults
    assert (fault.metric, len(fault.cases)) == ("path_fitted", 6)
    assert message in fault.message
    assert all("mpjpe_h.world" in each for each in numbers(results).values())


def test_a_metric_of_pairs_in_a_file_is_known_and_one_without_a_least_number_is_refused(
    tmp_path: Path,
) -> None:
    source = Path(path_fitted.__file__).read_text(encoding="utf-8")
    own = source.replace('"mpjpe_h.', '"my_h.').replace('"path_fit.', '"my_fit.')
    (tmp_path / "my_fit.py").write_text(own.replace('"path_fitted"', '"my_fit"'))
    assert registry.add_file(tmp_path / "my_fit.py").kind == "metrics"
    (results,) = carry_out(tmp_path / "runs", "toy_method", metrics=("my_fit",))
    assert all("my_h.path_fitted" in values for values in numbers(results).values())
    without = own.replace("    least = 3\n", "").replace('"path_fitted"', '"no_least"')
    (tmp_path / "no_least.py").write_text(without)
    registry.add_file(tmp_path / "no_least.py")
    with pytest.raises(BenchError, match="metric no_least: least, the fewest clips"):
        carry_out(tmp_path / "runs", "toy_method", metrics=("no_least",))


def test_forged_values_of_a_pair_are_found_beside_the_predictions(tmp_path: Path) -> None:
    (results,) = carry_out(tmp_path, "toy_method[does=noise]", clips=4, metrics=METRICS)
    data, answers = bound.dataset("toy_cases[clips=4]").built, results.paths.folder / results.paths.method
    assert list(_pair_scored_again(results, data, answers)) == []
    smaller = {key: each * (0.99 if key[0] == VALUE else 1.0) for key, each in results.numbers.items()}
    (found,) = _pair_scored_again(replace(results, numbers=smaller), data, answers)
    assert f"other numbers than the rows as {VALUE}" in found


@pytest.mark.parametrize(("scale", "lift"), [(1.25, 0.0), (0.8, -0.04), (1.0, 0.1)])
def test_a_path_of_another_scale_and_height_is_no_error(scale: float, lift: float) -> None:
    case = _case()
    root = case.source.root[0] + (case.reference.root - case.source.root[0]) * scale
    root[:, 1] = case.reference.root[:, 1] + lift
    values = _scored(case, replace(case.reference, root=root))
    assert values[VALUE] == pytest.approx(0.0, abs=1e-5)
    assert values["path_fit.level"] == pytest.approx(1 / scale, rel=1e-6)
    assert values["path_fit.lift"] == pytest.approx(-100 * lift / case.target.height, abs=1e-5)


def test_a_path_the_other_way_is_taken_away_and_none_stays() -> None:
    case = _case()
    start, root = case.source.root[0], case.reference.root
    back = np.where([True, False, True], start - (root - start), root)
    assert _scored(case, replace(case.reference, root=back))["path_fit.level"] == 0
    still = np.where([True, False, True], start, root)
    values = _scored(case, replace(case.reference, root=still))
    assert values["path_fit.level"] == 1
    distance = np.linalg.norm((root - start)[:, [0, 2]], axis=1).mean()
    assert values[VALUE] == pytest.approx(100 * distance / case.target.height, rel=1e-6)


def _case():
    data = bound.dataset("toy_cases").built
    return data.load(data.cases("retarget", "intra")[0])


def _scored(case, prediction) -> dict[str, float]:
    (metric,) = bound.metrics(("path_fitted",)).of_pairs
    return score([of_case(metric)], case, prediction).sound()


def test_tables_say_what_scales_root_paths_and_how_many_clips_fits_are_of(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """And compute no value for it that they do not show: to count those of a method takes all."""
    monkeypatch.delattr(OnDemand, "__len__")
    methods = (
        *("copy_rotations", "copy_rotations[root_rule=none]", "bone_directions", "toy_method"),
        "ik+footlock[root_rule=height]",
    )
    carry_out(tmp_path, *methods, clips=4, metrics=METRICS)
    below = table_of(tmp_path).groups[0].below
    assert (
        "Rule that scales root paths: none for copy_rotations[root_rule=none]; unknown for toy_method; "
        "hip_height for all others."
    ) in below
    assert "Paths are fitted over all clips of a pair of bodies (clips, about: intra 4)." in below


def table_of(root: Path) -> Table:
    (table,) = tables(split_summaries(store.find_results(root)))
    return table


def test_tables_without_fits_name_rules_on_the_clips_of_papers_alone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    carry_out(tmp_path, "copy_rotations", clips=2, metrics=METRICS)
    assert not any("root paths" in line for line in table_of(tmp_path).groups[0].below)
    monkeypatch.setattr(defaults, "PAPERS_DATASET", "toy_cases")
    (first, *_) = table_of(tmp_path).groups[0].below
    assert first == "Rule that scales root paths: hip_height for all."
