"""The gate has been seen red: metrics broken on purpose, against our golden rows."""

import numpy as np
import pytest
from gates import FOLDER, measured, metrics

from retarget_bench.api import CaseFeatures, MetricCard, Value
from retarget_bench.api.comparison import Comparison
from retarget_bench.errors import NotSupported
from retarget_bench.plugins import registry
from retarget_bench.verification.gate import compare, frozen, golden, method_rows
from retarget_bench.verification.gate.compare import Status


@pytest.fixture(scope="module")
def golden_facts():
    return golden.read(FOLDER)


def of_cases():
    """The metrics that score single cases: those of sets take most of the time."""
    return [each for each in metrics() if hasattr(each, "compute")]


def under(measurements, start):
    return [name for name in measurements.facts if name.startswith(f"{start}/")]


def row(measurements, name):
    """The facts of one row, as numbers."""
    return {
        key.removeprefix(f"{name}/"): float(measurements.facts[key]) for key in under(measurements, name)
    }


# ------------------------------------------------------------------------------------ what golden rows are
def test_the_gate_is_green(golden_facts):
    comparison = compare.compare(golden_facts, measured(golden_facts))
    assert (comparison.verdict, comparison.changes) == (0, ())
    assert comparison.compared > 5000


def test_every_value_of_every_built_in_metric_is_guarded(golden_facts):
    guarded = {
        golden.parsed(name)[2] for part in ("motion", "clouds") for name in under(golden_facts, part)
    }
    declared = {value.id for metric in metrics() for value in metric.card.computed}
    assert {name for name in guarded if not name.endswith(".features")} == declared
    assert set(golden_facts.under("value")) == declared


def test_frozen_numbers_are_what_their_faults_say(golden_facts):
    off = np.array([0.03, 0.02, -0.05])
    shifted = row(golden_facts, "motion/intra_walk/shifted")
    case = frozen.read(FOLDER / "frozen" / "intra_walk.npz").case
    assert shifted["mpjpe_h.world"] == pytest.approx(
        100 * np.linalg.norm(off) / case.target.height, rel=1e-6
    )
    assert shifted["root_path.vertical"] == pytest.approx(100 * 0.02 / case.target.height, rel=1e-5)
    assert shifted["mpjpe_h.root"] == pytest.approx(0, abs=1e-5)
    exact = row(golden_facts, "motion/intra_walk/exact")
    assert max(exact[name] for name in ("mpjpe_h.world", "san_code", "rotation.world", "acc")) < 1e-12
    turned = row(golden_facts, "motion/intra_walk/turned")
    assert turned["rotation.local"] == pytest.approx(7.0, rel=1e-5)
    sliding = row(golden_facts, "motion/intra_walk/sliding")
    assert sliding["foot_slide"] - exact["foot_slide"] == pytest.approx(0.4, abs=0.05)
    longer = row(golden_facts, "motion/intra_walk/longer")
    assert longer["acceleration_ratio"] == pytest.approx(1.03, rel=1e-6)
    assert "rotation.local" not in longer
    assert "mpjpe_h.world" not in row(golden_facts, "motion/intra_walk/shifted, no answer")


def test_the_smoke_split_shows_every_structure_on_both_sides(golden_facts):
    data = registry.create("datasets", golden_facts.facts["dataset/spec"])
    by_split = method_rows.golden_cases(golden_facts)
    bodies = data.characters()
    cases = [case for split in by_split.values() for case in split]
    assert 12 <= len(cases) <= 20
    pairs = [case.split("/")[1].split(">") for case in cases]
    for side in (0, 1):
        assert {bodies[pair[side]].structure for pair in pairs} == {b.structure for b in bodies.values()}
    assert len({case.split("/")[2].rsplit("-", 1)[0] for case in cases}) >= 8
    for split, chosen in by_split.items():
        assert [info.id for info in method_rows.choose(data, data.cases("retarget", split))] == chosen


def test_the_origin_of_every_frozen_motion_stands_beside_it():
    text = (FOLDER / "frozen" / "README.md").read_text(encoding="utf-8")
    for path in sorted((FOLDER / "frozen").glob("*.npz")):
        held = frozen.read(path)
        assert f"`{path.name}`" in text
        assert held.origin in text
        assert all(f"`{name}`: " in text for name in held.predictions)


def test_the_origin_of_every_frozen_input_stands_beside_it():
    text = (FOLDER / "inputs" / "README.md").read_text(encoding="utf-8")
    files = [path for path in (FOLDER / "inputs").iterdir() if path.name != "README.md"]
    assert len(files) == 5
    assert all(f"- `{path.name}`: " in text for path in files)


# -------------------------------------------------------------------------------------- broken metrics
def of(cls, name, change):
    """Replaces a property of Comparison (or of anything else) by something made from what it gives."""
    before = vars(cls)[name]
    get = before.func if hasattr(before, "func") else before.fget
    return cls, name, property(lambda self: change(self, get(self)))


def computed(metric, change):
    """Replaces what a metric gives."""
    cls = type(next(each for each in metrics() if each.card.name == metric))
    before = cls.compute
    return cls, "compute", lambda self, comparison: change(dict(before(self, comparison)), comparison)


def scaled(value, by):
    return lambda values, comparison: values | ({value: values[value] * by} if value in values else {})


def nan(values, comparison):
    return values | {"mpjpe_h.world": float("nan")}


def forgotten(values, comparison):
    values.pop("contact_precision.speed", None)
    return values


def raises(values, comparison):
    raise ZeroDivisionError("nothing to divide by")


METRICS = {
    "axis mirrored": lambda: of(Comparison, "predicted", lambda c, p: p * [-1.0, 1.0, 1.0]),
    "one frame off": lambda: of(Comparison, "predicted", lambda c, p: np.roll(p, 1, axis=0)),
    "NaN": lambda: computed("position", nan),
    "root joint left out": lambda: of(Comparison, "joints", lambda c, j: j[1:]),
    "a value forgotten": lambda: computed("contact_speed", forgotten),
    "an error raised": lambda: computed("slide", raises),
    "a millionth more": lambda: computed("smoothness", scaled("jerk", 1 + 1e-6)),
}
"""Faults of all kinds that the gate tells apart; faults of single metrics: ``test_check_mutations.py``."""


@pytest.mark.parametrize("name", METRICS)
def test_a_broken_metric_is_seen(golden_facts, monkeypatch, name):
    cls, attribute, broken = METRICS[name]()
    built = [each for each in metrics() if isinstance(each, cls)] or of_cases()
    monkeypatch.setattr(cls, attribute, broken)
    comparison = compare.compare(golden_facts, measured(golden_facts, built))
    assert comparison.verdict == 1
    marks = {each.status for each in comparison.changes}
    fails = name in ("NaN", "a value forgotten", "an error raised")
    lost = {Status.FAILING} if name == "root joint left out" else set()  # its own number is gone
    assert marks == ({Status.FAILING} if fails else {Status.MOVED} | lost)
    if name == "an error raised":
        assert any("ZeroDivisionError: nothing to divide by" in each.why for each in comparison.changes)


class Width:
    """A metric of sets: windows of ten frames, whose features are how wide and high hands are."""

    card = MetricCard("width", "toy", "1", (Value("width", "w", "m", "m", "lower", "f", "s"),))
    hash = "network 1"
    bias = 0.0

    def network(self, target):
        if target.structure == "dog21":
            raise NotSupported("no network for dogs")
        return self.hash

    def features(self, comparison):
        self.network(comparison.target)
        sides = [
            (p[: len(p) // 10 * 10].reshape(-1, 10, *p.shape[1:]).mean(axis=1)).std(axis=1) + self.bias
            for p in (comparison.predicted, comparison.expected)
        ]
        return CaseFeatures(*sides, speed=np.ones(len(sides[0])))

    def value(self, value_id, real, generated):
        return float(np.abs(real.features).mean() - np.abs(generated.features).mean())


def test_metrics_of_sets_are_guarded_by_clouds_and_by_features_of_frozen_motions(golden_facts):
    metric = Width()
    before = measured(golden_facts, [metric])
    clouds = [float(before.facts[f"clouds/{way}/width"]) for way in ("one way", "the other")]
    assert clouds[0] == -clouds[1] != 0
    assert {"width.features@generated", "width.features@real"} <= row(before, "motion/stairs/sunk").keys()
    assert "width.features@generated" not in row(before, "motion/self_dog/late")

    def moved():
        return {
            (x.status, x.value or x.subject)
            for x in compare.compare(before, measured(golden_facts, [metric])).changes
        }

    assert moved() == set()
    metric.bias = 1e-5
    assert moved() == set()
    metric.bias = 1e-2
    assert moved() == {(Status.MOVED, "width.features")}
    metric.hash = "network 2"
    structures = {name.rpartition("/")[2] for name in under(before, "network/width")}
    assert moved() == {(Status.INCOMPARABLE, f"network width/{each}") for each in structures}


def test_clouds_are_the_same_for_ever():
    """Drawn from raw bits by plain arithmetic; so are the numbers here."""
    first, second = frozen.clouds()
    assert first.features[0, 0] == pytest.approx(-0.02456136716623014, abs=1e-15)
    assert second.features[-1, -1] == pytest.approx(0.1336124997505529, abs=1e-15)
    assert abs(first.features.mean()) < 0.05
    assert first.features.std() == pytest.approx(np.sqrt(4 / 12), rel=0.02)


def test_rounding_of_another_processor_is_not_seen(golden_facts, monkeypatch):
    """Every place is moved by some units in the last digit."""
    random = np.random.default_rng(5)
    cls, attribute, shaken = of(
        Comparison, "predicted", lambda c, p: p * (1 + 4e-16 * random.integers(-1, 2, size=p.shape))
    )
    monkeypatch.setattr(cls, attribute, shaken)
    assert compare.compare(golden_facts, measured(golden_facts, of_cases())).verdict == 0
