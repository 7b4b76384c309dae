"""Summaries by pair, clip, kind, joint, body part and what training had, against numbers done by hand."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest
from small_plans import asked, know_toys
from stored import metadata

from retarget_bench.analysis import summary
from retarget_bench.api import CaseInfo
from retarget_bench.errors import BenchError
from retarget_bench.evaluation import runner
from retarget_bench.results import case_metadata, store

VALUE = "mpjpe_h.world"
JOINT = "mpjpe_h.joint"


@pytest.fixture(scope="module")
def results(tmp_path_factory) -> Path:
    """Results of two toy methods, one of which answers half of the cases."""
    know_toys()
    root = tmp_path_factory.mktemp("results")
    plan = asked(root, "toy_method[does=shaken]", "toy_method[does=picky]")
    runner.run(plan, lambda done, total: None)
    return root


@pytest.fixture
def own(results, tmp_path) -> Path:
    """A copy that a test may change."""
    return Path(shutil.copytree(results, tmp_path / "own"))


def sections(root: Path, by: summary.By) -> dict[str, summary.SplitSummary]:
    return {section.part: section for section in summary.split_summaries(store.find_results(root), by)}


def shaken(section: summary.SplitSummary) -> summary.MethodSummary:
    return next(score for score in section.scores if "shaken" in score.label)


@pytest.mark.parametrize(("by", "size"), [("pair", 3), ("clip", 2), ("kind", 6)])
def test_groups_of_cases_hold_their_own_cases(results, by, size):
    groups = sections(results, by)
    place = next(p for p in store.find_results(results) if "shaken" in str(store.read_header(p.header)))
    read = store.read_results(place)
    for name, section in groups.items():
        inside = [e.values[VALUE] for e in read.entries if getattr(read.cases[e.case], by) == name]
        assert len(inside) == size
        score = shaken(section)
        assert (score.asked, score.ok, score.means[VALUE].n) == (size, size, size)
        assert score.means[VALUE].value == pytest.approx(np.mean(inside), rel=1e-8)
        assert section.values.keys() >= {VALUE}
    assert sum(shaken(section).asked for section in groups.values()) == 6


def test_a_method_that_does_not_answer_a_pair_is_counted_so(results):
    groups = sections(results, "pair")
    picky = {
        name: next(score for score in section.scores if "picky" in score.label)
        for name, section in groups.items()
    }
    assert (picky["small>tall"].asked, picky["small>tall"].ok) == (3, 3)
    assert (picky["tall>small"].asked, picky["tall>small"].ok) == (3, 0)
    assert picky["tall>small"].unranked == "answered 0 of 3"
    assert picky["small>tall"].unranked == ""


def arrays(root: Path) -> tuple[np.ndarray, np.ndarray]:
    place = next(p for p in store.find_results(root) if "shaken" in str(store.read_header(p.header)))
    numbers = store.read_results(place, arrays=True).numbers
    columns = {joint: column for (_, joint), column in numbers.items()}
    pairs = [(joint, number) for joint, column in columns.items() for number in column[~np.isnan(column)]]
    joints, numbers = zip(*pairs, strict=True)
    return np.array(joints), np.array(numbers)


def test_joints_stand_alone_and_in_body_parts(results):
    joints, numbers = arrays(results)
    by_joint = sections(results, "joint")
    assert set(by_joint) == set(joints.tolist())
    for name, section in by_joint.items():
        mean = shaken(section).means[JOINT]
        assert mean.value == pytest.approx(numbers[joints == name].mean(), rel=1e-8)
        assert (mean.n, section.values[JOINT].index) == (6, "")
    by_part = sections(results, "part")
    assert list(by_part) == ["trunk", "head", "left_leg", "right_leg"]
    leg = np.isin(joints, ["LeftUpLeg", "LeftLeg", "LeftFoot"])
    assert shaken(by_part["left_leg"]).means[JOINT].value == pytest.approx(numbers[leg].mean(), rel=1e-8)
    assert by_part["head"].rankings[JOINT].cases == 6


def test_results_without_body_parts_say_what_to_do(own):
    for path in own.rglob("cases.metadata.csv"):
        path.unlink()
    assert sections(own, "joint")
    with pytest.raises(BenchError, match="lacks the body parts of the joints"):
        sections(own, "part")


def test_what_the_data_set_calls_unseen_makes_four_groups(own):
    place, *_ = store.find_results(own)
    cases = store.read_cases(place.cases, "retarget", "intra")
    marked = {"clip 0": "", "clip 1": "kind", "clip 2": "kind+target"}
    metadata(place, unseen={info.id: marked[info.clip] for info in cases})
    groups = sections(own, "seen")
    assert {name: shaken(section).asked for name, section in groups.items()} == {
        "known characters, known motion": 2,
        "known characters, new motion": 2,
        "new characters, new motion": 2,
    }


def test_trained_methods_are_judged_by_their_own_training(own):
    place, *_ = store.find_results(own)
    path = next(p.header for p in store.find_results(own) if "shaken" in p.header.read_text())
    header = json.loads(path.read_text())
    header["method"]["trained_on"] = {"characters": ["tall", "small"], "clips": ["clip 0"]}
    path.write_text(json.dumps(header))
    cases = store.read_cases(place.cases, "retarget", "intra")
    metadata(place, unseen=dict.fromkeys((info.id for info in cases), "target"))
    groups = sections(own, "seen")
    answered = {
        name: {score.label: score.ok for score in section.scores} for name, section in groups.items()
    }
    shaken_, picky = "toy_method[does=shaken]", "toy_method[does=picky]"
    assert answered["known characters, known motion"] == {shaken_: 2, picky: 0}
    assert answered["known characters, new motion"] == {shaken_: 4, picky: 0}
    assert answered["new characters, known motion"] == {shaken_: 0, picky: 3}


@pytest.mark.parametrize(
    ("manifest", "new"),
    [
        ({"characters": ["a", "b"], "kinds": ["walk"]}, set()),
        ({"characters": ["a"], "kinds": ["walk"]}, {"target"}),
        ({"characters": ["a", "b"], "kinds": ["run"], "clips": ["c"]}, {"kind"}),
        ({"characters": ["b"], "clips": ["c"]}, {"source"}),
        ({}, {"source", "target", "kind"}),
    ],
)
def test_a_manifest_says_what_is_new(manifest, new):
    info = CaseInfo("d/a>b/c", "retarget", "intra", "a", "b", "c", "walk", 10)
    assert case_metadata.not_in(manifest, info) == new
