"""The post-processor fit: methods that give positions get rotations, rows of them and say so."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from retarget_bench.api import Context
from retarget_bench.evaluation import runner
from retarget_bench.evaluation.plan import Plan
from retarget_bench.motion import rotation
from retarget_bench.motion.motion import Motion
from retarget_bench.plugins import registry
from retarget_bench.plugins.spec import Spec
from retarget_bench.results import store
from tests.methods.method_bodies import body, dance

TOYS = Path(__file__).parents[1] / "engine" / "toys"


def fitted(prediction):
    return registry.create("posts", "fit").process(prediction, prediction, context=Context())


def test_positions_become_a_motion_with_the_body_s_bones():
    motion = dance(body())
    answer = fitted(motion.character.positions(motion.positions, motion.fps))
    assert isinstance(answer, Motion)
    assert np.abs(answer.positions - motion.positions).max() < 1e-4


def test_an_answer_with_rotations_is_left_as_it_is():
    motion = dance(body())
    answer = fitted(motion)
    assert (answer.rotations == motion.rotations).all()
    assert (answer.root == motion.root).all()


def test_twists_that_positions_leave_open_are_those_of_the_source():
    motion = dance(body())
    answer, head = motion.character.positions(motion.positions, motion.fps), motion.skeleton.index("Head")
    post = registry.create("posts", "fit")
    for source, near in ((motion, True), (answer, False)):
        processed = post.process(answer, source, context=Context())
        apart = rotation.angle(processed.global_rotations[:, head], motion.global_rotations[:, head])
        assert (np.degrees(apart).max() < 0.1) == near


def test_rows_hold_values_that_need_rotations_and_say_what_was_done(tmp_path, monkeypatch):
    monkeypatch.setattr(registry, "_FILES", {})
    for name in ("toy_cases.py", "toy_method.py"):
        registry.add_file(TOYS / name)
    plan = Plan(
        methods=tuple(Spec.parse(f"toy_method[does=positions]{post}") for post in ("", "+fit")),
        datasets=(Spec.parse("toy_cases"),),
        splits=("intra",),
        metrics=("position", "rotation"),
        out=tmp_path,
    )
    plain, rotated = (store.read_results(place) for place in runner.run(plan, lambda done, total: None))
    assert rotated.header.method.label == "toy_method[does=positions]+fit"
    assert [post["name"] for post in rotated.header.method.posts] == ["fit"]
    values = [values_of(results) for results in (plain, rotated)]
    turned = [{id_ for id_ in ids if id_.startswith("rotation.")} for ids in values]
    assert not turned[0]
    assert turned[1]
    assert values[1]["mpjpe_h.world"] == pytest.approx(values[0]["mpjpe_h.world"], abs=1e-3)


def values_of(results: store.Results) -> dict[str, float]:
    """Value id -> its mean over the cases."""
    by_value: dict[str, list[float]] = {}
    for entry in results.entries:
        assert entry.status == "ok", entry.message
        for id_, value in entry.values.items():
            if isinstance(value, float):
                by_value.setdefault(id_, []).append(value)
    return {id_: float(np.mean(each)) for id_, each in by_value.items()}
