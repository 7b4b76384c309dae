"""Who takes part in which plain run, and who is handed training motion."""

from __future__ import annotations

from pathlib import Path

import pytest

from retarget_bench.evaluation import plan
from retarget_bench.evaluation.predict import context_for
from retarget_bench.plugins import bound, registry
from retarget_bench.plugins.spec import Spec
from retarget_bench.python import plans
from retarget_bench.python.run_options import RunOptions

OWN = {"identity", "gaussian_filter", "savitzky_golay", "linear_joints", "nearest_pose"}

SKIN = {"mesh_contact", "self_penetration", "vertex_error"}
"""Metrics of meshes, which cost more than all of joints."""


def asked(task: str) -> tuple[set[str], set[str]]:
    """The methods and metrics of a plain run."""
    default_plan = plans.plan_of(RunOptions(dataset="puppets", splits="self", task=task), print)
    return {str(spec) for spec in default_plan.methods}, set(default_plan.metrics)


def test_every_task_asks_those_whom_it_means():
    methods, metrics = asked("retarget")
    assert not methods & OWN
    assert {"copy_rotations", "reference", "ik"} <= methods
    assert not {"restoration", *SKIN} & metrics
    assert asked("points")[1] >= SKIN
    methods, metrics = asked("reconstruct")
    assert methods & OWN == {"identity"}
    assert "copy_rotations" in methods
    assert metrics == {"restoration", "position", "smoothness"}
    for task, own in (
        ("denoise[levels=5]", {"identity", "gaussian_filter", "savitzky_golay"}),
        ("joint-completion", {"linear_joints", "nearest_pose"}),
    ):
        methods, _ = asked(task)
        assert methods & OWN == own
        assert "bone_directions" in methods
        # rotations alone, or sight of the right answer
        assert not methods & {"copy_rotations", "ik", "reference", "other_clip", "ambiguity_floor"}


def test_metrics_of_a_plain_run_can_be_named_beside_others():
    def metrics(*names):
        return plans.plan_of(RunOptions("ik", metrics=names), print).metrics

    assert metrics("default") == metrics()
    assert metrics("vertex_error", "default", "position") == (*metrics(), "vertex_error")
    assert metrics("vertex_error") == ("vertex_error",)


@pytest.mark.parametrize(("name", "handed"), [("linear_joints", True), ("bone_directions", False)])
def test_training_motion_goes_to_those_who_use_it_and_is_not_privileged(name, handed):
    registry.add_file(Path(__file__).parent / "toys" / "toy_people.py")
    data, method = (
        plan.data_of(bound.dataset(Spec.parse("toy_people")), "joint-completion"),
        bound.method(Spec(name)).built,
    )
    contexts = [
        context_for(method, data, data.load(info), 0) for info in data.cases("joint-completion", "self")[:2]
    ]
    assert [context.training is not None for context in contexts] == [handed, handed]
    assert contexts[0].training is contexts[1].training
    assert not method.card.needs


def test_a_data_set_without_training_motion_hands_out_none():
    registry.add_file(Path(__file__).parent / "toys" / "toy_people.py")
    data = plan.data_of(bound.dataset(Spec.parse("toy_people[train=false]")), "joint-completion")
    case = data.load(data.cases("joint-completion", "self")[0])
    assert context_for(bound.method(Spec("linear_joints")).built, data, case, 0).training is None


def test_a_post_process_keeps_what_its_method_uses():
    card = bound.method(Spec.parse("linear_joints+fit")).built.card
    assert (card.uses, card.tasks) == (("training",), ("joint-completion",))


# ------------------------------------------------------------------------------------- variants and clashes
CLASHING = '''"""A metric that uses a built-in's value id."""

from retarget_bench.api import MetricCard, Value


class Clash:
    card = MetricCard("clash", "clash", "1", (Value("mpjpe_h.world", "", "", "1", "lower", "", ""),))

    def compute(self, comparison):
        return {"mpjpe_h.world": 1.0}


plugin = Clash
'''


def test_a_plain_run_has_the_variants_that_a_card_names() -> None:
    specs = [str(spec) for spec in plans.default_methods("retarget", pytest.fail)]
    assert len(specs) == len(set(specs))
    for suffix in ("", "[root_rule=none]", "[root_rule=reference]"):
        assert f"copy_rotations{suffix}" in specs


def test_a_metric_that_takes_anothers_value_id_is_left_out(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(registry, "_FILES", dict(registry._FILES))
    (tmp_path / "clash.py").write_text(CLASHING)
    registry.add_file(tmp_path / "clash.py")
    messages: list[str] = []
    metrics = plans.default_metrics("retarget", messages.append)
    assert "clash" not in metrics
    assert "position" in metrics
    assert "both declare 'mpjpe_h.world'" in "".join(messages)
