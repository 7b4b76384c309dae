"""The gate has been seen red: metrics, methods and data broken on purpose, against our golden rows."""

from dataclasses import replace

import numpy as np
import pytest
from gates import FOLDER, measured, metrics, quiet

from retarget_bench.api import CaseFeatures, MetricCard, SetMetric, Value
from retarget_bench.api.comparison import Comparison
from retarget_bench.api.completing import complete
from retarget_bench.errors import NotSupported
from retarget_bench.plugins import registry
from retarget_bench.verification.gate import compare, frozen, golden, method_rows, report, run
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
    bias = 0.0

    def features(self, comparison):
        if comparison.target.structure == "dog21":
            raise NotSupported("no features of dogs")
        sides = [
            (p[: len(p) // 10 * 10].reshape(-1, 10, *p.shape[1:]).mean(axis=1)).std(axis=1) + self.bias
            for p in (comparison.predicted, comparison.expected)
        ]
        return CaseFeatures(*sides, speed=np.ones(len(sides[0])))

    def value(self, value_id, real, generated):
        return float(np.abs(real.features).mean() - np.abs(generated.features).mean())


def test_metrics_of_sets_are_guarded_by_clouds_and_by_features_of_frozen_motions(golden_facts):
    metric = Width()
    completed = [complete(metric, SetMetric)]
    before = measured(golden_facts, completed)
    clouds = [float(before.facts[f"clouds/{way}/width"]) for way in ("one way", "the other")]
    assert clouds[0] == -clouds[1] != 0
    assert {"width.features@generated", "width.features@real"} <= row(before, "motion/stairs/sunk").keys()
    assert "width.features@generated" not in row(before, "motion/self_dog/late")

    def moved():
        return {
            (x.status, x.value or x.subject)
            for x in compare.compare(before, measured(golden_facts, completed)).changes
        }

    assert moved() == set()
    metric.bias = 1e-5
    assert moved() == set()
    metric.bias = 1e-2
    assert moved() == {(Status.MOVED, "width.features")}


def test_rounding_of_another_processor_is_not_seen(golden_facts, monkeypatch):
    """Every place is moved by some units in the last digit."""
    random = np.random.default_rng(5)
    cls, attribute, shaken = of(
        Comparison, "predicted", lambda c, p: p * (1 + 4e-16 * random.integers(-1, 2, size=p.shape))
    )
    monkeypatch.setattr(cls, attribute, shaken)
    assert compare.compare(golden_facts, measured(golden_facts, of_cases())).verdict == 0


# ---------------------------------------------------------------------------------- broken methods and data
@pytest.fixture
def checked(tmp_path):
    def check(*methods):
        return run.check(FOLDER, tmp_path, methods, None, quiet)[0]

    return check


def test_the_methods_are_green(checked):
    comparison = checked("copy_rotations", "reference")
    assert comparison.verdict == 0
    assert comparison.compared > 300


def test_every_method_of_a_plain_run_has_golden_rows():
    assert set(golden.read(FOLDER).under("weights")) == set(method_rows.default_methods())


def answer(change):
    """Replaces what copy_rotations answers."""
    from retarget_bench.methods.copy_rotations import CopyRotations

    before = CopyRotations.retarget

    def broken(self, source, target, *, context):
        return change(before(self, source, target, context=context), source, target)

    return CopyRotations, "retarget", broken


def exchanged(motion, source, target):
    """What the left side should do the right side does, and the other way round."""
    twin = list(range(len(target.skeleton)))
    for role, joint in target.joint_of.items():
        other = {"left": "right", "right": "left"}.get(role.split("_")[0])
        twin[joint] = target.joint_of.get(f"{other}_{role.split('_', 1)[-1]}", joint)
    return replace(motion, rotations=motion.rotations[:, twin])


BROKEN = {
    "frozen": lambda m, s, t: m.at(np.zeros(m.frames, dtype=int)),
    "left and right exchanged": exchanged,
    "a tenth of a millimetre up": lambda m, s, t: replace(m, root=m.root + np.array([0.0, 1e-4, 0.0])),
}


@pytest.mark.parametrize("name", BROKEN)
def test_a_broken_method_is_seen(checked, monkeypatch, name):
    monkeypatch.setattr(*answer(BROKEN[name]))
    comparison = checked("copy_rotations")
    assert comparison.verdict == 1
    assert {each.status for each in comparison.changes} & {Status.WORSE, Status.BETTER}


def test_a_root_one_percent_longer_is_told_by_a_handful_of_values(checked, monkeypatch):
    monkeypatch.setattr(*answer(lambda m, s, t: replace(m, root=1.01 * m.root)))
    comparison = checked("copy_rotations")
    assert len(comparison.changes) > 100
    lines = [line.split() for line in report.text(comparison).splitlines() if " copy_rotations " in line]
    assert len(lines) <= 14
    (line,) = (each for each in lines if each[0] == "worse" and each[2] == "mpjpe_h.world")
    # of a body copied onto itself, 1 % of the height of its hips, which is about half of its own
    assert line[3] == "self"
    assert line[5].startswith("0.5")
    assert len(report.text(comparison, everything=True).splitlines()) > len(comparison.changes)


def test_self_pairs_that_slip_into_intra_are_seen(checked, monkeypatch):
    Puppets = type(registry.create("datasets", "puppets"))
    cases = Puppets.cases

    def slipped(self, task, split):
        more = cases(self, task, "self") if split == "intra" else []
        return [*cases(self, task, split), *(replace(info, split="intra") for info in more)]

    monkeypatch.setattr(Puppets, "cases", slipped)
    comparison = checked("copy_rotations")
    assert comparison.verdict == 1
    (change,) = comparison.changes
    assert (change.status, change.where) == (Status.INCOMPARABLE, "intra")
