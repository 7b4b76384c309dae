"""Methods that are composed of others: the others' code and weights belong to what a result is known by."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from retarget_bench.evaluation import plan
from retarget_bench.plugins import bound, registry
from retarget_bench.plugins.spec import Spec

STAGE = '''"""Turns nothing."""

from pathlib import Path

from retarget_bench.api import MethodCard


class Stage:
    card = MethodCard(name="stage", summary="Turns nothing", version="1")

    def __init__(self, weights: str = "own") -> None:
        self.weights = weights

    @property
    def weights_hash(self):
        return "0" if self.weights == "own" else Path(self.weights).read_text()

    @property
    def weights_label(self):
        return self.weights if self.weights == "own" else "local-" + self.weights_hash

    def supports(self, source, target):
        return None

    def retarget(self, source, target, *, context):
        return target.motion(NUMBER * source.rotations, source.root, source.fps)


plugin = Stage
'''
SOURCE = '''"""Does what its stage does."""

from retarget_bench.api import MethodCard
from retarget_bench.plugins import registry
from retarget_bench.plugins.spec import Spec


class Whole:
    card = MethodCard(name="whole", summary="Does what its stage does", version="1")

    def __init__(self, stage: str = "own") -> None:
        self.stages = {"stage": registry.create("methods", Spec("stage", {"weights": stage}))}
        self.weights_hash = self.stages["stage"].weights_hash

    def supports(self, source, target):
        return None

    def retarget(self, source, target, *, context):
        return self.stages["stage"].retarget(source, target, context=context)


plugin = Whole
'''


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Any:
    monkeypatch.setattr(registry, "_FILES", dict(registry._FILES))
    monkeypatch.chdir(tmp_path)
    for name, text in (("stage", STAGE), ("whole", SOURCE)):
        (tmp_path / f"{name}.py").write_text(text.replace("NUMBER", "1"))
        registry.add_file(tmp_path / f"{name}.py")
    plan.forget()
    yield tmp_path
    plan.forget()


def test_the_code_of_a_stage_counts(folder: Path) -> None:
    specs = [Spec.parse(each) for each in ("whole", "copy_rotations", "whole+footlock")]
    before = [bound.method(each).code for each in specs]
    (folder / "stage.py").write_text(STAGE.replace("NUMBER", "-1"))
    registry.refresh_files()
    plan.forget()
    after = [bound.method(each).code for each in specs]
    assert [one == other for one, other in zip(before, after, strict=True)] == [False, True, False]


def test_weights_of_a_stage_go_by_what_they_hold(folder: Path) -> None:
    """Results have their label; processes that work elsewhere have their path in full."""
    for name in ("here", "there"):
        (folder / name).write_text("abc")
    shipped = Spec("whole")
    specs = [Spec("whole", {"stage": name}) for name in ("here", "there")]
    assert [str(bound.method(each).known_as) for each in specs] == ["whole[stage=local-abc]"] * 2
    assert bound.method(shipped).known_as == bound.method(shipped).located == shipped
    assert bound.method(specs[0]).located.parameters == {"stage": str(folder / "here")}
    assert bound.method(bound.method(specs[0]).located).located == bound.method(specs[0]).located


@pytest.mark.parametrize(
    ("method", "stages"), [("correspondence_free", {"skr", "smrm", "skin"}), ("skin", {"skr"})]
)
def test_shipped_methods_have_the_stages_that_they_ask(method: str, stages: set[str]) -> None:
    built = registry.create("methods", method)
    assert set(built.stages) == stages
    assert set(built.stages) <= set(built.card.parameters)
