"""Shared by the checks of every kind of plug-in: trials, outcomes, sample cases, snapshots."""

import traceback
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, fields, is_dataclass, replace
from pathlib import Path
from typing import Any, ClassVar, Generic, TypeVar

import numpy as np

from retarget_bench.api import Case, Contacts, Dataset, Prediction
from retarget_bench.errors import BenchError
from retarget_bench.plugins import parameters, registry
from retarget_bench.plugins.spec import Spec

P = TypeVar("P")
"""The contract that a plug-in is to fulfil."""
KINDS_OF_SOURCE = ("motion", "positions")


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


Look = Callable[[Any], str | None]
"""A method of a ``Trial`` that says what is wrong; None where nothing is."""


def demand(text: str) -> Callable[[Look], Look]:
    """Mark a method of a ``Trial`` as the check of a demand."""

    def marked(look: Look) -> Look:
        look.demand = text  # type: ignore[attr-defined]
        return look

    return marked


class Trial(Generic[P]):
    """A plug-in under test. Iterating makes its checks in the order in which the class lists them; each is
    made whatever came of the others.

    Raises BenchError if the plug-in cannot be built.
    """

    kind: ClassVar[registry.Kind]

    def __init__(self, spec: Spec) -> None:
        self.spec = spec
        self.plugin: P = registry.create(self.kind, spec)

    def __iter__(self) -> Iterator[Check]:
        looks = [look for each in reversed(type(self).__mro__) for look in vars(each).values()]
        for look in looks:
            if text := getattr(look, "demand", ""):
                yield Check(text, self._problem(look))

    def _problem(self, look: Look) -> str:
        try:
            return look(self) or ""
        except BenchError as error:
            return str(error)
        except Exception as error:  # the plug-in's own fault: it costs this check only
            return _where(error)

    def misnamed(self, name: str) -> str | None:
        """The difference between the name on the card and the name of the plug-in."""
        wanted = self.spec.names
        return None if name == wanted else f"card.name is {name!r}, but the plug-in is called {wanted!r}"

    def undescribed(self, described: Iterable[str]) -> str | None:
        """The parameters of the plug-in that its card has no line for."""
        taken, _ = parameters.known(registry.load(self.kind, self.spec.name))
        missing = [each.name for each in taken if each.name not in described]
        return f"card.parameters has no line for {', '.join(missing)}" if missing else None


def _where(error: Exception) -> str:
    last = traceback.extract_tb(error.__traceback__)[-1]
    return f"{type(error).__name__}: {error} ({Path(last.filename).name}:{last.lineno})"


def sample(data: Dataset, frames: int = 40) -> list[Case]:
    """The first case of every split of a data set, brought to a length by ``resized``."""
    found = []
    for split in data.card.splits:
        found += [resized(data.load(info), frames) for info in data.cases("retarget", split)[:1]]
    if not found:
        raise BenchError(f"data set {data.card.name!r} has no case to try a plug-in on")
    return found


def resized(case: Case, frames: int) -> Case:
    """The first frames of a case; where it is shorter, it goes back and forth."""
    there_and_back = np.arange(max(2 * case.source.frames - 2, 1))
    turning = np.minimum(there_and_back, len(there_and_back) - there_and_back)
    part = np.resize(turning, frames)
    contacts = case.contacts and Contacts(
        case.contacts.roles,
        case.contacts.planted[part],
        None if case.contacts.pivoting is None else case.contacts.pivoting[part],
    )
    touches = case.touches and tuple(replace(touch, rests=touch.rests[part]) for touch in case.touches)
    answers = (None if each is None else each.at(part) for each in (case.reference, case.alternative))
    reference, other = answers
    return replace(
        case,
        source=case.source.at(part),
        reference=reference,
        alternative=other,
        contacts=contacts,
        touches=touches,
    )


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


def changed(before: Mapping[str, np.ndarray], **things: Any) -> str | None:
    """The first array that is no longer what the snapshot holds."""
    after = snapshot(**things)
    moved = (path for path in before if not np.array_equal(before[path], after[path]))
    return next((f"{path} was modified" for path in moved), None)


def difference(a: Prediction, b: Prediction) -> float:
    """The largest difference of any number in two predictions; infinite where their shapes differ."""
    one, two = dict(arrays(replace(a, character=b.character))), dict(arrays(b))
    if one.keys() != two.keys() or any(one[path].shape != two[path].shape for path in one):
        return float("inf")
    return max(float(np.abs(one[path] - two[path]).max(initial=0.0)) for path in one)
