"""The jobs of a run: what of every case is lacking, put together when a process is free to take it."""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import overload

from retarget_bench.evaluation.plan import EvaluationUnit, located
from retarget_bench.evaluation.predict import Inputs
from retarget_bench.evaluation.worker import CaseJob, JobPart

Asked = tuple[tuple[str, ...], tuple[int, ...]]
"""A batch of cases, and the numbers of the units that it is a batch of."""


class Jobs(Sequence[CaseJob]):
    """One job per case with all methods that lack it, so that a case is loaded once; and one per batch with
    all methods that take several at once and lack any of it.

    Batches come last and the longest of them first, so that all workers end at about the same time. A
    million cases of ten methods have ten million keys, so a job is made anew whenever it is asked for.

    done: unit -> cases that are not to be answered, mostly what earlier runs left; what is added later
    changes no job.
    answers: the number of answers, each of one method to one case, that are lacking.
    """

    def __init__(
        self,
        done: Mapping[EvaluationUnit, Collection[str]],
        scratch: Path = Path(),
        preload: tuple[str, ...] = (),
    ) -> None:
        self._scratch, self._preload = scratch, preload
        self._units, self._done = list(done), [frozenset(entries) for entries in done.values()]
        self._parts = [_part(unit) for unit in done]
        pairs = list(zip(self._units, self._done, strict=True))
        self.answers = sum(sum(info.id not in left for info in unit.infos) for unit, left in pairs)
        shared: dict[tuple[object, ...], list[int]] = {}
        for number, unit in enumerate(self._units):
            shared.setdefault((unit.dataset, unit.split, unit.plan.seed), []).append(number)
        alone: list[Asked] = []
        together: list[tuple[int, Asked]] = []
        for units in shared.values():
            frames = {info.id: info.frames for info in self._units[units[0]].infos}
            for batch, asked in self._lacking(units):
                if len(batch) == 1:
                    alone.append((batch, asked))
                else:
                    together.append((sum(frames[case] for case in batch), (batch, asked)))
        together.sort(key=lambda each: each[0], reverse=True)
        self._jobs = [*alone, *(each for _, each in together)]

    def _lacking(self, units: Sequence[int]) -> Iterator[Asked]:
        """Batches of one split, and the units that have them, where any of these lacks a case."""
        lists = {id(self._units[u].batches): self._units[u].batches for u in units}  # methods share them
        owners: dict[tuple[str, ...], tuple[int, ...]] = {}
        for number, batches in lists.items():
            having = tuple(u for u in units if id(self._units[u].batches) == number)
            for batch in batches:
                owners[batch] = owners[batch] + having if batch in owners else having
        for batch, asked in owners.items():
            if any(case not in self._done[unit] for unit in asked for case in batch):
                yield batch, asked

    def __len__(self) -> int:
        return len(self._jobs)

    @overload
    def __getitem__(self, number: int) -> CaseJob: ...
    @overload
    def __getitem__(self, number: slice) -> Sequence[CaseJob]: ...
    def __getitem__(self, number: int | slice) -> CaseJob | Sequence[CaseJob]:
        if isinstance(number, slice):
            return [self[each] for each in range(*number.indices(len(self)))]
        batch, asked = self._jobs[number]
        keys = {unit: self._keys(unit, batch) for unit in asked}
        parts = tuple(replace(self._parts[unit], keys=mine) for unit, mine in keys.items() if mine)
        first = self._units[next(unit for unit, mine in keys.items() if mine)]
        job = CaseJob(first.plan, first.dataset, first.split, batch, parts)
        return replace(job, scratch=self._scratch, preload=self._preload)

    def _keys(self, unit: int, batch: Sequence[str]) -> dict[str, str]:
        key = self._units[unit].case_key
        return {case: key(case) for case in batch if case not in self._done[unit]}


def _part(unit: EvaluationUnit) -> JobPart:
    """What a scoring process needs to know of a method, which it never imports; no keys yet."""
    if unit.plan.external:
        return JobPart(unit.method, unit.paths, {}, "", Inputs())
    seeded_as = str(unit.known_as.alone)  # post-processors follow the very answers of the method alone
    return JobPart(located(unit.method), unit.paths, {}, seeded_as, Inputs.of(unit.built), unit.lock)
