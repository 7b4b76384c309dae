"""The gate sees faults of the code: metrics, statistics, tables, reader, answers, seeds and ground."""

import inspect
import textwrap
from dataclasses import replace
from importlib import import_module

import pytest
from gates import FOLDER, measured, metrics, only

from retarget_bench.verification.gate import compare, core, golden
from retarget_bench.verification.gate.compare import Status


@pytest.fixture(scope="module")
def ours():
    return golden.read(FOLDER)


def lines_of(ours, part, monkeypatch):
    """What the gate says of one metric, or of one part of the frozen inputs."""
    if part in core.PARTS:
        monkeypatch.setattr(core, "PARTS", {part: core.PARTS[part]})
        now = replace(ours, frozen={}, failures={}, methods={})
        core.measure(now, FOLDER)
    else:
        now = measured(ours, built=[each for each in metrics() if each.card.name == part])
    return compare.compare(only(ours, {part}), now)


SMOOTHNESS, SPEED = "retarget_bench.metrics.smoothness", "retarget_bench.metrics.joint_speed"
SLIDE, PLANT = "retarget_bench.api.comparison", "retarget_bench.metrics.plant"
FID, CONTACT = "retarget_bench.metrics.fid.frechet", "retarget_bench.motion.contact"
GROUND, RECORDING = "retarget_bench.motion.ground", "retarget_bench.motion.bvh.recording"
DOCUMENT, CHECK = "retarget_bench.motion.bvh.document", "retarget_bench.plugins.prediction_check"
STORE, SUMMARY = "retarget_bench.results.store", "retarget_bench.analysis.summary"
STATISTICS = "retarget_bench.analysis.statistics"

MUTATIONS = {
    "accelerations without their rate": ("smoothness", SMOOTHNESS, "_sizes", "fps**order", "30.0**order"),
    "covariance of a part over n": (
        "fid", FID, "without",
        "triangle / np.sqrt(len(rows) - 1)", "triangle / np.sqrt(len(rows))",
    ),
    "clips count as still up to 0.11": ("smoothness", SMOOTHNESS, "STILL", 0.1, 0.11),
    "nearest sample of the ground": ("floor", GROUND, "_cell", "place - sample", "np.rint(place - sample)"),
    "intervals of 90 %": ("table", STATISTICS, "LEVEL", 0.95, 0.9),
    "differences at 10 %": ("table", STATISTICS, "ALPHA", 0.05, 0.1),
    "Euler angles in reverse": (
        "reader", RECORDING, "local_rotations", "(angles, order)", "(angles[..., ::-1], order[::-1])",
    ),
    "seeds without the case": ("seeds", STORE, "case_seed", r"\n{case_id}", ""),
    "answers of any rate": (
        "refusals", CHECK, "verified", "abs(answer.fps - case.source.fps) >", "0.0 >",
    ),
    "answers that are not finite": ("refusals", CHECK, "verified", "bad.any()", "False"),
    "contacts without their rate": ("contact", CONTACT, "planted", "30.0 / fps * ", ""),
    "no contact in the first frame": ("slide", CONTACT, "planted", "[slow[:1],", "[slow[:1] & False,"),
    "skating without its rate": ("slide", SLIDE, "steps", "(fps / RATE)", "1.0"),
    "stays of four frames at any rate": ("plant", PLANT, "_stays", "STAY * fps", "STAY * 30.0"),
    "joint accelerations without their rate": (
        "joint_speed", SPEED, "JointSpeed.compute", "* comparison.fps", "* 30.0",
    ),
    "p-values not adjusted": ("table", STATISTICS, "holm", "factors * np.asarray", "np.asarray"),
    "intervals not corrected for skew": (
        "table", STATISTICS, "mean_intervals", "np.nan_to_num(skewness)", "0 * np.nan_to_num(skewness)",
    ),
    "cases for clips": (
        "table", STATISTICS, "per_clip", "np.flatnonzero(np.diff(clips, prepend=-1))",
        "np.arange(len(clips))",
    ),
    "ratios ranked by plain differences": (
        "table", STATISTICS, "losses", "np.abs(np.log(numbers / goal))", "np.abs(numbers - goal)",
    ),
    "controls ranked": ("table", SUMMARY, "never_ranked", "if method.control", "if False"),
    "rates as printed": ("reader", DOCUMENT, "frame_rate", "10.0 ** int(exponent)", "0.0"),
    "places in the order of the channels": (
        "reader", RECORDING, "_stated_places",
        "channels.index(name) for name in POSITIONS if name in channels",
        "place for place, name in enumerate(channels) if name in POSITIONS",
    ),
}  # fmt: skip
"""Fault -> metric or part that shows it; module and name of a constant or a function; before and after: the
constant itself, or a piece of the function's source."""


def mutate(monkeypatch, module, name, before, after):
    *owner, attribute = name.split(".")
    holder = import_module(module)
    for each in owner:
        holder = getattr(holder, each)
    found = getattr(holder, attribute)
    if not callable(found):
        assert found == before
        monkeypatch.setattr(holder, attribute, after)
        return
    source = textwrap.dedent(inspect.getsource(found))
    assert source.count(before) == 1
    made: dict = {}
    exec(source.replace(before, after), dict(found.__globals__), made)
    # its code and not its name, which others have imported
    monkeypatch.setattr(found, "__code__", made[attribute].__code__)


@pytest.mark.parametrize("fault", MUTATIONS)
def test_a_mutation_is_seen(ours, monkeypatch, fault):
    part, *where = MUTATIONS[fault]
    mutate(monkeypatch, *where)
    lines = lines_of(ours, part, monkeypatch)
    assert compare.verdict(lines) == 1
    moved = {line.status for line in lines} - {Status.SAME}
    assert moved <= {Status.MOVED, Status.FAILING}
    assert not any("Error" in line.why for line in lines), "a number is another or gone; nothing broke"


@pytest.mark.parametrize("part", sorted({part for part, *_ in MUTATIONS.values()}))
def test_without_mutation_all_is_the_same(ours, monkeypatch, part):
    lines = lines_of(ours, part, monkeypatch)
    assert {line.status for line in lines} == {Status.SAME}
