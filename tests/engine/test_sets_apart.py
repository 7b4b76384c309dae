"""Sets of answers to cases without references, against other real motion of the target's structure."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from small_plans import asked, know_toys

from retarget_bench.api import CaseFeatures, CaseInfo
from retarget_bench.api.comparison import Comparison
from retarget_bench.evaluation import runner, set_metrics
from retarget_bench.evaluation.predict import context_for
from retarget_bench.evaluation.set_metrics import draw
from retarget_bench.evaluation.set_metrics.files import NO_REFERENCE, collect
from retarget_bench.plugins import bound, registry
from retarget_bench.plugins.spec import Spec
from retarget_bench.results import store
from retarget_bench.results.predictions import read_prediction

pytestmark = pytest.mark.usefixtures("toys")


# -------------------------------------------------------------------------------------------------- draws
def case(name: str, clip: str, generated: np.ndarray | None, real: np.ndarray | None, speed: np.ndarray):
    info = CaseInfo(name, "retarget", "cross", name.split(">")[0], name.split(">")[1], clip, "", 100)
    width = (generated if generated is not None else real).shape[1]
    none = np.zeros((0, width), np.float32)
    return info, CaseFeatures(
        none if generated is None else generated, none if real is None else real, speed.astype(np.float32)
    )


def corpus(seed: int = 0, clips: int = 20, windows: int = 9, wide: int = 3):
    """Answers named by their clip and window, and real motion likewise, of other clips."""
    random = np.random.default_rng(seed)
    answers, real = {}, {}
    infos, real_infos = {}, {}
    for number in range(clips):
        numbered = np.stack([np.full(windows, number), np.arange(windows), np.zeros(windows)], axis=1)
        info, case_features = case(
            f"a>b/{number}", f"s{number}", numbered[:, :wide], None, random.gamma(1, 0.4, windows)
        )
        answers[info.id], infos[info.id] = case_features, info
        info, case_features = case(
            f"b>b/{number}", f"r{number}", None, numbered[:, :wide] + 100, random.gamma(1, 1, windows)
        )
        real[info.id], real_infos[info.id] = replace(case_features, generated=case_features.real), info
    return answers, infos, real, real_infos


def test_both_halves_of_the_real_motion_stand_against_one_set_of_all_answers():
    answers, infos, real, real_infos = corpus()
    drawn = draw.draw_apart(answers, infos, real, real_infos)
    first, second = (set(half.clips.tolist()) for half in drawn.real)
    assert not first & second
    assert first | second == {info.clip for info in real_infos.values()}
    assert drawn.generated[0] is drawn.generated[1]
    assert drawn.apart
    sizes = {len(sample.clips) for sample in (*drawn.real, *drawn.generated)}
    assert sizes == {drawn.n} == {90}
    assert set(drawn.generated[0].clips.tolist()) <= {info.clip for info in infos.values()}
    rows = {tuple(row) for row in drawn.generated[0].features.tolist()}
    assert len(rows) == drawn.n


def test_answers_decide_nothing_about_the_draw():
    answers, infos, real, real_infos = corpus()
    drawn = draw.draw_apart(answers, infos, real, real_infos)
    other = {key: replace(each, generated=each.generated * 3 + 1) for key, each in answers.items()}
    assert draw.draw_apart(other, infos, real, real_infos).hash == drawn.hash
    fewer = dict(list(answers.items())[:-1])
    assert draw.draw_apart(fewer, infos, real, real_infos).hash != drawn.hash
    moved = {key: replace(each, real=each.real + 1) for key, each in real.items()}
    assert draw.draw_apart(answers, infos, moved, real_infos).hash != drawn.hash


# --------------------------------------------------------------------------------------------- whole runs
def carry_out(root: Path, *methods: str, data: str = "toy_apart", **changes) -> list[store.ResultPaths]:
    changes = {"splits": ("cross",), "metrics": ("position", "toy_sets"), **changes}
    return runner.run(asked(root, *methods, data=data, **changes), lambda done, total: None)


@pytest.fixture(scope="module")
def finished(tmp_path_factory) -> list[store.ResultPaths]:
    know_toys()
    return carry_out(tmp_path_factory.mktemp("apart"), "toy_method", "other_clip")


def test_values_are_of_the_stored_answers_and_the_real_motion(finished):
    """Worked out here from the data set's motion, half by half, as the definition has it."""
    by_value = {(each.value_id, each.structure, each.kind): each for each in set_metrics.read(finished[0])}
    gap = by_value["toy_gap", "tall", ""]
    data = bound.dataset(Spec.parse("toy_apart")).built
    metric = registry.create("metrics", Spec.parse("toy_sets"))
    assert gap.n == 18
    halves = draw.halves(
        [(info.id, at) for info in data.real("retarget", "tall") for at in range(3)],
        {info.id: info for info in data.real("retarget", "tall")},
    )

    def pieces(case, motion):
        return metric.features(Comparison(case, motion)).generated

    real: dict[int, list[np.ndarray]] = {0: [], 1: []}
    for info in data.real("retarget", "tall"):
        shown = data.load(info)
        real[halves[info.clip]].append(pieces(shown, shown.reference))
    means = [np.concatenate(each).mean(axis=0) for each in real.values()]
    assert gap.floor == pytest.approx(np.linalg.norm(means[0] - means[1]), rel=1e-5)
    # half of the answers are drawn: by the same draw, from what the run stored
    infos = {info.id: info for info in data.cases("retarget", "cross") if info.target == "tall"}
    none = np.zeros((0, 27), np.float32)
    cases = {key: data.load(info) for key, info in infos.items()}
    answers = {
        key: metric.features(
            Comparison(each, read_prediction(finished[0].prediction(key), each.target, each.source.fps))
        )
        for key, each in cases.items()
    }
    shown = {info.id: info for info in data.real("retarget", "tall")}
    moving = {
        key: CaseFeatures(none, pieces(data.load(info), data.load(info).reference), np.linspace(0, 1, 3))
        for key, info in shown.items()
    }
    drawn = draw.draw_apart(answers, infos, moving, shown).generated[0]
    assert gap.clips == len(set(drawn.clips.tolist())) >= 10
    away = [np.linalg.norm(each - drawn.features.mean(axis=0)) for each in means]
    assert gap.value == pytest.approx(np.mean(away), rel=1e-5)
    assert gap.low <= gap.value <= gap.high


def test_kinds_stand_apart_and_structures_without_real_motion_say_so(finished):
    by_value = {(each.value_id, each.structure, each.kind): each for each in set_metrics.read(finished[0])}
    assert {key[2] for key in by_value if key[1] == "tall"} == {"", "hop", "rest"}
    for kind in ("hop", "rest"):
        part = by_value["toy_gap", "tall", kind]
        assert part.n == 9  # six clips of three windows, half of the real ones
        assert part.value is not None
        assert (part.low, part.high) == (None, None)  # too few clips of one kind
    assert by_value["toy_gap", "small", ""].value is None
    assert by_value["toy_gap", "small", ""].reason == (
        "the data set has no real motion of bodies of structure small in this part"
    )


def test_other_clip_takes_real_motion_of_the_target(finished):
    """The small body has none and is not answered; the tall one's answers are its own real motion."""
    by_value = {
        (each.value_id, each.structure): each for each in set_metrics.read(finished[1]) if not each.kind
    }
    assert ("toy_gap", "small") not in by_value
    assert by_value["toy_gap", "tall"].value is not None
    data = bound.dataset(Spec.parse("toy_apart")).built
    info = data.cases("retarget", "cross")[0]
    method = registry.create("methods", Spec.parse("other_clip"))
    context = context_for(method, data, data.load(info), seed=0)
    assert context.reference is None
    assert len(context.other_clips) == 12
    shown = data.load(data.real("retarget", "tall")[0]).reference
    assert any((clip.positions == shown.positions).all() for clip in context.other_clips)


def test_data_without_real_motion_say_why_there_is_no_value():
    data = bound.dataset(Spec.parse("toy_apart")).built
    loaded = data.load(data.cases("retarget", "cross")[0])
    metric = registry.create("metrics", Spec.parse("toy_sets"))
    answer = loaded.target.motion(loaded.source.rotations, loaded.source.root, loaded.source.fps)
    members, faults = collect([metric], loaded, answer)
    assert members["toy_sets"].reason == NO_REFERENCE
    assert not faults
    assert collect([metric], loaded, answer, elsewhere=True)[0]["toy_sets"].features is not None


def test_answers_are_drawn_evenly_over_the_sources_speed(monkeypatch):
    """Fast windows are rare among the sources; of those drawn, they are not."""
    monkeypatch.setattr(draw, "MOST", 60)
    answers, infos, real, real_infos = corpus(clips=40, windows=20)
    fast = {}
    for key, each in answers.items():
        speed = np.where(np.arange(20) % 10 == 0, 0.9, 0.1).astype(np.float32)
        fast[key] = replace(each, generated=speed[:, None].repeat(3, 1), speed=speed)
    drawn = draw.draw_apart(fast, infos, real, real_infos)
    assert drawn.n == 60
    assert (drawn.generated[0].features[:, 0] > 0.5).mean() == pytest.approx(0.5)
