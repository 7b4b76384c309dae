"""Trials of plug-ins, and the outcomes, sample cases and snapshots that all of them use."""

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, fields, is_dataclass, replace
from typing import Any, ClassVar, Generic, TypeVar

import numpy as np

from retarget_bench.api import TASKS, Case, Dataset, Prediction
from retarget_bench.errors import BenchError, one_line
from retarget_bench.plugins import parameters, registry
from retarget_bench.plugins.spec import Spec
from retarget_bench.verification.rewriting import resized

P = TypeVar("P")
"""The contract that a plug-in is to fulfil."""


@dataclass(frozen=True)
class Check:
    """The outcome of one check: the demand, and the problem ("" where there is none)."""

    demand: str
    problem: str = ""

    @property
    def passed(self) -> bool:
        return not self.problem

    def __str__(self) -> str:
        return f"ok      {self.demand}" if self.passed else f"FAILED  {self.demand}: {self.problem}"


Problems = Iterator[str]
"""Sentences on what is wrong, of which the first is reported; none where nothing is."""
CheckMethod = Callable[[Any], Problems | None]
"""A method of a ``Trial``: a check. None: it is passed where nothing is raised."""


def demand(text: str) -> Callable[[CheckMethod], CheckMethod]:
    """Mark a method of a ``Trial`` as the check of a demand."""

    def marked(method: CheckMethod) -> CheckMethod:
        method.demand = text  # type: ignore[attr-defined]
        return method

    return marked


class Trial(Generic[P]):
    """A plug-in under test. Iterating makes its checks in the order in which the class lists them; each is
    made whatever came of the others, unless one is ``over``.

    Raises BenchError if the plug-in cannot be built.
    """

    kind: ClassVar[registry.Kind]

    def __init__(self, spec: Spec) -> None:
        self.spec, self.over = spec, False
        self.plugin: P = registry.create(self.kind, spec)

    def __iter__(self) -> Iterator[Check]:
        for method in [method for each in reversed(type(self).__mro__) for method in vars(each).values()]:
            if text := getattr(method, "demand", ""):
                try:
                    problem = next(method(self) or iter(()), "")
                except BenchError as error:
                    problem = str(error)
                except Exception as error:  # the plug-in's own fault: it costs this check only
                    problem = one_line(error)
                yield Check(text, problem)
            if self.over:
                return

    def card_fault(self, card: Any, **allowed: Iterable[str]) -> Problems:
        """The faults of a card: unknown words, another name, or a parameter without a line."""
        for name, words in allowed.items():
            if strange := set(getattr(card, name)) - set(words):
                yield f"{name} {sorted(strange)}; known are {', '.join(words)}"
        if card.name != (expected := self.spec.names):
            yield f"card.name is {card.name!r}, but the plug-in is called {expected!r}"
        declared, _ = parameters.known(registry.load(self.kind, self.spec.name))
        described = getattr(card, "parameters", None)
        if described is not None and (missing := [p.name for p in declared if p.name not in described]):
            yield f"card.parameters has no line for {', '.join(missing)}"


def sample(data: Dataset, frames: int = 40, task: str = TASKS[0]) -> list[Case]:
    """The first case of every split of a data set, brought to a length by ``resized``."""
    cases = []
    for split in data.card.splits:
        cases += [resized(data.load(info), frames) for info in data.cases(task, split)[:1]]
    if not cases:
        raise BenchError(f"data set {data.card.name!r} has no case to try a plug-in on")
    return cases


def arrays(thing: Any, name: str = "") -> Iterator[tuple[str, np.ndarray]]:
    """Every array in a tree of dataclasses and tuples, with its path."""
    if isinstance(thing, np.ndarray):
        yield name, thing
    elif isinstance(thing, tuple):
        for number, each in enumerate(thing):
            yield from arrays(each, f"{name}.{number}")
    elif is_dataclass(thing):
        for each in fields(thing):
            yield from arrays(getattr(thing, each.name), f"{name}.{each.name}")


def snapshot(**things: Any) -> dict[str, np.ndarray]:
    """Copies of all arrays in some objects."""
    return {path: a.copy() for name, thing in things.items() for path, a in arrays(thing, name)}


def changed(before: Mapping[str, np.ndarray], **things: Any) -> Problems:
    """The arrays that are no longer what the snapshot holds."""
    after = snapshot(**things)
    yield from (f"{path} was modified" for path in before if not np.array_equal(before[path], after[path]))


def difference(a: Prediction, b: Prediction) -> float:
    """The largest difference of any number in two predictions; infinite where their shapes differ."""
    one, two = dict(arrays(replace(a, character=b.character))), dict(arrays(b))
    if one.keys() != two.keys() or any(one[path].shape != two[path].shape for path in one):
        return float("inf")
    return max(float(np.abs(one[path] - two[path]).max(initial=0.0)) for path in one)
