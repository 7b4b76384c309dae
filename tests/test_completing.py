"""Plug-ins that derive from no contract have its defaults, whatever kind of object they are."""

from __future__ import annotations

import pickle
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import pytest

from retarget_bench.api import (
    Case,
    CaseInfo,
    Dataset,
    DatasetCard,
    Method,
    MethodCard,
    Metric,
    MetricCard,
    PairMetric,
    SetMetric,
)
from retarget_bench.api.completing import complete, original
from retarget_bench.api.metrics import contract_of
from retarget_bench.errors import BenchError
from retarget_bench.plugins import registry
from retarget_bench.plugins.bound import stages_fault

INFO = CaseInfo("toy/a>b/walk", "retarget", "cross", "a", "b", "walk")
CARD = DatasetCard("toy", "two clips", "1", "CC0", "here")
NOTE = "half of it is left out"


class Plain:
    card, content, label, notes = CARD, "1", "toy", ()
    training_notes = (NOTE,)

    def cases(self, task: str, split: str) -> list[CaseInfo]:
        return [INFO]


class Slots:
    __slots__ = ("card", "training_notes")

    def __init__(self) -> None:
        self.card, self.training_notes = CARD, (NOTE,)

    def cases(self, task: str, split: str) -> list[CaseInfo]:
        return [INFO]


@dataclass(frozen=True)
class Frozen:
    card: DatasetCard = CARD
    training_notes: tuple[str, ...] = (NOTE,)

    def cases(self, task: str, split: str) -> list[CaseInfo]:
        return [INFO]


class Delegating:
    """Has what another has, by ``__getattr__``: that comes before any default."""

    def __init__(self) -> None:
        self.inner = Plain()

    def __getattr__(self, name: str) -> Any:
        return getattr(self.__dict__["inner"], name)


class Deriving(Dataset):
    card = CARD

    def __init__(self) -> None:
        self.content, self.training_notes = "1", (NOTE,)

    def characters(self) -> dict[str, Any]:
        return {}

    def cases(self, task: str, split: str) -> list[CaseInfo]:
        return [INFO]

    def load(self, info: CaseInfo) -> Case:
        raise BenchError("there is no file")


KINDS = {
    "plain": Plain,
    "slots": Slots,
    "frozen": Frozen,
    "delegating": Delegating,
    "namespace": lambda: SimpleNamespace(card=CARD, training_notes=(NOTE,), cases=lambda *_: [INFO]),
    "deriving": Deriving,
}


@pytest.mark.parametrize("kind", KINDS)
def test_any_object_has_its_own_and_the_defaults(kind: str) -> None:
    plugin = KINDS[kind]()
    data: Dataset = complete(plugin, Dataset)
    assert isinstance(data, Dataset)
    assert complete(data, Dataset) is data
    assert original(data) is plugin
    assert (data is plugin) == (kind == "deriving")
    assert data.cases("retarget", "cross") == [INFO]
    assert data.training_notes == (NOTE,)
    assert data.parts() == {"": data}
    assert (data.training(), data.validation(), data.unseen(INFO), data.real) == ({}, None, None, None)
    assert data.unreadable is None


def test_what_is_needed_and_lacking_is_an_error_of_the_plug_in() -> None:
    with pytest.raises(AttributeError, match="'Plain' object has no attribute 'load'"):
        complete(Plain(), Dataset).load(INFO)


def test_what_a_plug_in_has_later_counts() -> None:
    class Learns:
        card = MethodCard("learns", "later", "1")

    plugin = Learns()
    method = complete(plugin, Method)
    assert method.weights_hash == ""
    plugin.weights_hash = "abc"
    assert method.weights_hash == "abc"
    method.weights_hash = "def"
    assert plugin.weights_hash == "def"
    del method.weights_hash
    assert method.weights_hash == ""


def test_a_pickle_is_completed_too() -> None:
    again = pickle.loads(pickle.dumps(complete(Plain(), Dataset)))
    assert isinstance(again, Dataset)
    assert (again.training_notes, again.training()) == ((NOTE,), {})


def test_cards_of_a_plug_in_are_made_whole() -> None:
    card = SimpleNamespace(name="own", summary="s", accepts="points", needs=(), tasks=None)
    method = complete(SimpleNamespace(card=card), Method)
    assert method.card == MethodCard("own", "s", "", accepts=("points",))
    assert method.training_manifest is None
    card.trained_on = {"characters": ["a"]}
    assert method.training_manifest == {"characters": ["a"]}


@pytest.mark.parametrize(
    ("members", "kind", "contract"),
    [
        ("compute", "", Metric),
        ("extract", "", PairMetric),
        ("extract compute", "", Metric),
        ("features", "", SetMetric),
        ("features extract", "", PairMetric),
        ("features extract", "set", SetMetric),
        ("features", "case", Metric),
    ],
)
def test_a_metric_is_of_the_kind_that_its_card_or_its_methods_say(
    members: str, kind: str, contract: type
) -> None:
    card = MetricCard("m", "s", "1", (), kind=kind)  # type: ignore[arg-type]
    metric = SimpleNamespace(card=card, **dict.fromkeys(members.split(), len))
    assert contract_of(metric) is contract


def test_answers_on_own_bodies_are_asked_in_a_batch_where_there_is_one() -> None:
    one, other = (SimpleNamespace(character=name) for name in ("a", "b"))

    class Single:
        card = MethodCard("single", "s", "1")

        def retarget(self, source: Any, target: Any, *, context: Any) -> Any:
            return ("alone", target, context)

    class Batched(Single):
        def retarget_batch(self, sources: Any, targets: Any, *, contexts: Any) -> Any:
            return [("batch", *each) for each in zip(targets, contexts, strict=True)]

    for plugin, how in ((Single(), "alone"), (Batched(), "batch")):
        answers = complete(plugin, Method).reconstruct_batch([one, other], ["x", "x"], contexts=[1, 2])
        assert answers == [(how, "a", 1), (how, "b", 2)]


def test_a_class_that_leaves_out_what_it_must_have_is_told_what(tmp_path, monkeypatch) -> None:
    monkeypatch.setattr(registry, "_FILES", {})
    (tmp_path / "half.py").write_text(
        '"""Half a method."""\nfrom retarget_bench.api import Method, MethodCard\n\n\n'
        'class Half(Method):\n    card = MethodCard("half", "s", "1")\n\n'
        "    def retarget(self, source, target, *, context):\n        return source\n\n\nplugin = Half\n"
    )
    registry.add_file(tmp_path / "half.py")
    with pytest.raises(BenchError, match=r"method half .* could not be built .* abstract method.*supports"):
        registry.create("methods", "half")


def test_what_is_offered_but_not_there_is_the_default() -> None:
    class Nothing:
        card = SimpleNamespace(name="nothing", summary=None, version=1)

        def __getattr__(self, name: str) -> Any:
            if name.startswith("__"):
                raise AttributeError(name)
            return None

    method: Method = complete(Nothing(), Method)
    assert (method.stages, method.weights_hash) == ({}, "")
    assert (method.card.summary, method.card.version) == ("", "1")


def test_values_of_a_card_are_completed_as_it_is() -> None:
    value = SimpleNamespace(id="far.mean", unit="m", better="lower", meaning="how far")
    card = SimpleNamespace(name="far", summary="how far", version="1", values=(value,))
    plugin = SimpleNamespace(card=card, compute=lambda comparison: {})
    metric: Metric = complete(plugin, Metric)
    (declared,) = metric.card.values
    assert (declared.id, declared.better, declared.from_source) == ("far.mean", "lower", None)


def test_stages_that_cannot_be_read_are_told() -> None:
    class Raises:
        card = SimpleNamespace(name="raises", summary="it", version="1")

        @property
        def stages(self) -> Any:
            raise RuntimeError("not yet")

    assert "its stages cannot be read" in stages_fault(complete(Raises(), Method))
