"""Cards that each object of a plug-in has of its own, so that ``needs`` depend on a parameter."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import torch

from retarget_bench import cli
from retarget_bench.evaluation.predict import Inputs
from retarget_bench.plugins import registry
from retarget_bench.plugins.spec import Spec
from retarget_bench.training.validate import Validator

SAYS = 'MethodCard("own_card", "asks", "1", needs=needs, parameters={"statistics": "of whom"})'
CARDS = {
    "property": f"""
    @property
    def card(self):
        needs = ("target_motions",) if self.statistics == "target" else ()
        return {SAYS}
""",
    "attribute": f"""
    needs = ()
    card = {SAYS}

    @property
    def statistics(self):
        return self._statistics

    @statistics.setter
    def statistics(self, value):
        self._statistics = value
        needs = ("target_motions",) if value == "target" else ()
        self.card = {SAYS}
""",
}
PLUGIN = '''"""Statistics of the target's motion, if they are asked for."""

from retarget_bench.api import MethodCard


class OwnCard:
    """Asks for statistics of the target, or does not."""
{card}
    def __init__(self, statistics: str = "source"):
        self.statistics = statistics
        self.given = []

    def supports(self, source, target):
        return None

    def retarget(self, source, target, *, context):
        self.given.append(None if context.target_motions is None else len(context.target_motions))
        return target.motion(source.rotations, source.root, source.fps)


plugin = OwnCard
'''
TOYS = Path(__file__).parents[1] / "training" / "toys"


@pytest.fixture(params=CARDS)
def own_card(request, tmp_path, monkeypatch) -> None:
    monkeypatch.setattr(registry, "_FILES", {})
    (tmp_path / "own_card.py").write_text(PLUGIN.format(card=CARDS[request.param]))
    registry.add_file(tmp_path / "own_card.py")


def info(capsys: pytest.CaptureFixture[str], spec: str) -> str:
    with pytest.raises(SystemExit) as ended:
        cli.main(["info", spec])
    assert not ended.value.code
    return " ".join(capsys.readouterr().out.split())


def test_needs_are_those_of_the_parameters(own_card, capsys):
    method = registry.create("methods", Spec.parse("own_card[statistics=target]"))
    assert Inputs.of(method).needs == ("target_motions",)
    assert Inputs.of(registry.create("methods", "own_card")).needs == ()
    assert "needs (privileged): target_motions" in info(capsys, "own_card[statistics=target]")
    plain = info(capsys, "own_card")
    assert "privileged" not in plain
    assert "statistics=str (default source): of whom" in plain


def test_validation_gives_what_the_card_needs_and_nothing_else(own_card):
    registry.add_file(TOYS / "toy_walks.py")
    data = registry.create("datasets", "toy_walks")
    for statistics, expected in (("target", {4}), ("source", {None})):
        method = registry.create("methods", Spec.parse(f"own_card[statistics={statistics}]"))
        judge = Validator(data, method, 2, torch.device("cpu"), lambda done, total: None)
        scores = judge(torch.nn.ModuleDict(), method)
        assert set(method.given) == expected
        assert np.isfinite(judge.decisive(scores))
