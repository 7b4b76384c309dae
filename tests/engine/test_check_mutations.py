"""The gate sees faults of the code: metrics, statistics, tables, reader, answers, seeds and ground."""

import inspect
import textwrap
from importlib import import_module

import pytest
from gates import FOLDER, measured, metrics, part_measured

from retarget_bench.motion.bvh import recording
from retarget_bench.tables.builder import DEFAULT_COLUMNS as COLUMNS
from retarget_bench.verification.gate import compare, core, golden
from retarget_bench.verification.gate.compare import Status


@pytest.fixture(scope="module")
def golden_facts():
    return golden.read(FOLDER)


def compared(golden_facts, part):
    """What the gate says of one metric, or of one part of the core."""
    if part in core.PARTS:
        return compare.compare(golden_facts, part_measured(golden_facts, part))
    return compare.compare(
        golden_facts, measured(golden_facts, [each for each in metrics() if each.card.name == part])
    )


SMOOTHNESS, SPEED = "retarget_bench.metrics.smoothness", "retarget_bench.metrics.joint_speed"
SLIDE, CONTACT_METRIC = "retarget_bench.api.comparison", "retarget_bench.metrics.contact"
FID, CONTACT = "retarget_bench.metrics.fid.frechet", "retarget_bench.motion.contact"
GROUND, RECORDING = "retarget_bench.motion.ground", "retarget_bench.motion.bvh.recording"
DOCUMENT, CHECK = "retarget_bench.motion.bvh.document", "retarget_bench.plugins.prediction_check"
STORE, RANKING = "retarget_bench.results.store", "retarget_bench.analysis.ranking"
STATISTICS = "retarget_bench.analysis.statistics"
COMPARISON, TRANSFER = "retarget_bench.api.comparison", "retarget_bench.motion.transfer"
MEASURES, POSE = "retarget_bench.motion.measures", "retarget_bench.motion.reference_pose"
CHARACTER, WRITING = "retarget_bench.motion.character", "retarget_bench.motion.bvh.writing"
BUILDER, MODEL = "retarget_bench.tables.builder", "retarget_bench.tables.model"
CELLS, METHODS = "retarget_bench.tables.cells", "retarget_bench.tables.method_groups"
PAIRWISE, MATRIX = "retarget_bench.analysis.pairwise", "retarget_bench.results.result_matrix"
RENDERED = "retarget_bench.tables.rendering.as_text"

MUTATIONS = {
    "accelerations without their rate": ("smoothness", SMOOTHNESS, "_sizes", "fps**order", "30.0**order"),
    "covariance of a part over n": (
        "fid_structure", FID, "without",
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
    "contacts without their rate": ("contact_speed", CONTACT, "planted", "30.0 / fps * ", ""),
    "no contact in the first frame": ("slide", CONTACT, "planted", "[slow[:1],", "[slow[:1] & False,"),
    "skating without its rate": ("slide", SLIDE, "steps", "(fps / RATE)", "1.0"),
    "stays of four frames at any rate": ("contact", CONTACT_METRIC, "_stays", "STAY * fps", "STAY * 30.0"),
    "joint accelerations without their rate": (
        "joint_speed", SPEED, "JointSpeed.compute", "* comparison.fps for", "* 30.0 for",
    ),
    "p-values not adjusted": (
        "table", STATISTICS, "against_best", "draws, np.minimum(stages[first], stages[second]))", "draws)",
    ),
    "p-values of values not adjusted": (
        "table", STATISTICS, "step_down", "(differences, draws, stages)", "(differences, draws)",
    ),
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
    "controls ranked": ("table", RANKING, "never_ranked", "if method.control", "if False"),
    "rates as printed": ("reader", DOCUMENT, "frame_rate", "10.0 ** int(exponent)", "0.0"),
    "places in the order of the channels": (
        "reader", RECORDING, "_stated_places",
        "channels.index(name) for name in POSITIONS if name in channels",
        "place for place, name in enumerate(channels) if name in POSITIONS",
    ),
    "root-aligned error by joint 0": (
        "position", COMPARISON, "Comparison.hips", 'get("hips", 0)', 'get("", 0)',
    ),
    "the root for the hips": ("body", TRANSFER, "hips", "if joint == 0", "if True"),
    "heights up to the root": (
        "body", MEASURES, "measure", "bones(skeleton, foot, hips) + bones(skeleton, head, hips)",
        "bones(skeleton, foot, 0) + bones(skeleton, head, 0)",
    ),
    "heights by the reference pose": (
        "body", CHARACTER, "Character.height", "measures.height", "measures.h4",
    ),
    "the second bone of an A-pose as it rests": (
        "body", POSE, "_straighten", "body.swing(pose, joints[1], joints[2], direction)", "",
    ),
    "tips left out of what is written": (
        "writer", WRITING, "hierarchy_text", "tips[site.parent].append(site.offset)", "pass",
    ),
    "tips in the file's unit": (
        "body", RECORDING, "_skeleton", "(x * scale, y * scale, z * scale)", "(x, y, z)",
    ),
    "cells cut": (
        "table", CELLS, "CellBuilder.shown", 'f"{number:.{self.decimals(key)}f}"',
        'f"{int(number * 10 ** self.decimals(key)) / 10 ** self.decimals(key):.{self.decimals(key)}f}"',
    ),
    "default columns in another order": ("table", BUILDER, "DEFAULT_COLUMNS", COLUMNS, COLUMNS[::-1]),
    "arrows exchanged": (
        "table", MODEL, "ARROWS", None, {"lower": "↑", "higher": "↓", "target": "→", "none": ""},
    ),
    "marks exchanged": ("table", MODEL, "MARKS", None, {"": "", "best": "=", "tied": "*"}),
    "the wrong winner": (
        "table", PAIRWISE, "Difference.verdict", 'facts.better == "higher"', 'facts.better == "lower"',
    ),
    "paired intervals the other way round": (
        "table", PAIRWISE, "Difference.interval", "self.there[None]", "-self.there[None]",
    ),
    "adjusted p-values in their own order": (
        "table", STATISTICS, "step_down", "stages[order] =", "stages[np.arange(len(order))] =",
    ),
    "the largest distance of sets is best": (
        "table", RANKING, "set_ranking", "statistics.losses(", "-statistics.losses(",
    ),
    "the floor is what answers score": (
        "table", METHODS, "floors", ").floor", ").value",
    ),
    "self pairs left out of pooled means": (
        "table", MATRIX, "_aligned", "if own_self is not None and", "if False and",
    ),
    "seeds of one digit less": ("seeds", STORE, "case_seed", "15)", "14)"),
    "seeds without the base": ("seeds", STORE, "case_seed", "{base}", ""),
    "seeds without the method": ("seeds", STORE, "case_seed", "{method}", ""),
}  # fmt: skip
"""Fault -> metric or part that shows it; module and name of a constant or a function; before and after: the
constant itself, or a piece of the function's source."""


def mutate(monkeypatch, module, name, before, after):
    *owner, attribute = name.split(".")
    holder = import_module(module)
    for each in owner:
        holder = getattr(holder, each)
    target = getattr(holder, attribute)
    if isinstance(target, dict):  # itself and not its name, which others have imported
        for key, each in after.items():
            monkeypatch.setitem(target, key, each)
        return
    target = target.fget if isinstance(target, property) else getattr(target, "func", target)
    function = inspect.unwrap(target)
    if not callable(function):
        assert target == before
        monkeypatch.setattr(holder, attribute, after)
        return
    source = textwrap.dedent(inspect.getsource(function))
    source = source[source.index("def ") :]
    assert source.count(before) == 1
    namespace: dict = {}
    exec(source.replace(before, after), dict(function.__globals__), namespace)
    # its code and not its name, which others have imported
    monkeypatch.setattr(function, "__code__", namespace[attribute].__code__)


@pytest.fixture(autouse=True)
def _skeletons():
    """Skeletons that a mutated reader made are forgotten."""
    recording._skeleton.cache_clear()
    yield
    recording._skeleton.cache_clear()


@pytest.mark.parametrize("fault", MUTATIONS)
def test_a_mutation_is_seen(golden_facts, monkeypatch, fault):
    part, *where = MUTATIONS[fault]
    mutate(monkeypatch, *where)
    comparison = compared(golden_facts, part)
    assert comparison.verdict == 1
    assert {each.status for each in comparison.changes} <= {Status.MOVED, Status.FAILING}
    assert not any("Error" in each.why for each in comparison.changes), "a number is another; nothing broke"


@pytest.mark.parametrize("part", sorted({part for part, *_ in MUTATIONS.values()}))
def test_without_mutation_all_is_the_same(golden_facts, part):
    assert compared(golden_facts, part).changes == ()
