"""Carrying out a plan: which cases are missing, the jobs, the journal, and the finished files."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

from retarget_bench.errors import BenchError, FileError
from retarget_bench.evaluation.header import header_of
from retarget_bench.evaluation.plan import EvaluationUnit, Plan, dataset, evaluation_units, set_metrics
from retarget_bench.evaluation.process_pool import Executor, LocalPool
from retarget_bench.evaluation.set_metrics import files as set_files
from retarget_bench.evaluation.set_metrics.evaluate import evaluate
from retarget_bench.evaluation.worker import Stop, work
from retarget_bench.results import case_metadata, store
from retarget_bench.results.store import CaseResult, ResultPaths

Progress = Callable[[int, int], None]
"""Called with the number of cases done and of all that are to be asked."""


def run(plan: Plan, progress: Progress, executor: Executor | None = None) -> list[ResultPaths]:
    """Compute what a plan lacks and return the places of its results.

    Interrupted at any moment, it keeps what was finished; the next run goes on from there.
    """
    wanted = _with_cases(plan, evaluation_units(plan))
    todo = {cell: cases for cell in wanted if (cases := _wanted_cases(cell))}
    keep = plan.stage != "predict"
    done = {cell: _begun(cell) if keep else {} for cell in todo}
    jobs = _jobs(todo, done)
    by_place = {cell.place: cell for cell in todo}
    pool = executor or LocalPool(plan.jobs)
    for place, entry in _answers(pool, jobs, progress):
        if keep:
            store.append_journal(place, entry)
        done[by_place[place]][entry.case] = entry
    if keep:
        _finish(pool, done)
    return [cell.place for cell in wanted]


def _finish(pool: Executor, done: Mapping[EvaluationUnit, Mapping[str, CaseResult]]) -> None:
    """Values of sets, then rows, then the header, which says that all is there."""
    for cell in _with_sets(pool, done):
        listed = [done[cell][info.id] for info in cell.infos]
        case_metadata.write(cell.place, cell.data, cell.infos)
        store.write_results(cell.place, header_of(cell, listed), listed, cell.infos)
        set_files.clear(cell.place)


def _with_sets(
    pool: Executor, done: Mapping[EvaluationUnit, Mapping[str, CaseResult]]
) -> Iterator[EvaluationUnit]:
    """The cells as the values of their sets are written; those without any first."""
    waiting = [cell for cell in done if set_metrics(cell.plan.metrics)]
    yield from (cell for cell in done if cell not in waiting)
    jobs = [
        {
            "plan": cell.plan,
            "place": cell.place,
            "dataset": cell.dataset,
            "infos": [info for info in cell.infos if done[cell][info.id].status == "ok"],
        }
        for cell in waiting
    ]
    for answer in pool.run(evaluate, jobs):
        if answer.error:
            raise BenchError(
                f"the sets of {waiting[answer.job].place.rows} could not be compared: {answer.error}"
            )
        set_files.write(waiting[answer.job].place, answer.result)
        yield waiting[answer.job]


def _wanted_cases(cell: EvaluationUnit) -> list[str]:
    """All cases of a cell, or none where its results are complete and up to date."""
    wanted = [info.id for info in cell.infos]
    redo = cell.plan.redo
    if redo == "never":
        return []
    if redo == "always" or cell.plan.stage == "predict":
        return wanted
    try:
        header = store.read_header(cell.place.header)
    except FileError:
        return wanted
    counts = header.counts
    if header.keys != cell.keys or counts.asked != len(wanted):
        return wanted
    if counts.missing:
        return wanted
    return wanted if redo == "failed" and counts.failed + counts.invalid else []


def _begun(cell: EvaluationUnit) -> dict[str, CaseResult]:
    """The entries that an interrupted run left, unless they are to be made anew."""
    found = store.open_journal(cell.place, cell.keys, anew=cell.plan.redo != "missing")
    kept = {case: entry for case, entry in found.items() if entry.status != "missing"}
    if not set_metrics(cell.plan.metrics):
        return kept
    return {
        case: entry
        for case, entry in kept.items()
        if entry.status != "ok" or set_files.waits(cell.place, case)
    }


def _jobs(
    todo: Mapping[EvaluationUnit, Sequence[str]], done: Mapping[EvaluationUnit, Mapping[str, CaseResult]]
) -> list[dict[str, Any]]:
    """One job per case with all methods that lack it, so that a case is loaded once; and one per batch of
    a method that takes several at once, whole if it lacks any of it."""
    jobs: dict[tuple[Any, ...], dict[str, Any]] = {}
    for cell, cases in todo.items():
        lacking = set(cases) - done[cell].keys()
        for batch in cell.batches:
            wanted = {case: cell.case_key(case) for case in batch if case in lacking}
            if not wanted:
                continue
            alone = cell.method if cell.in_batches else None
            job = jobs.setdefault(
                (cell.dataset, cell.split, batch, cell.plan.seed, alone),
                {
                    "plan": cell.plan,
                    "dataset": cell.dataset,
                    "split": cell.split,
                    "cases": batch,
                    "cells": [],
                },
            )
            job["cells"].append((cell.method, cell.place, wanted))
    return list(jobs.values())


def _answers(
    pool: Executor, jobs: Sequence[dict[str, Any]], progress: Progress
) -> Iterator[tuple[ResultPaths, CaseResult]]:
    """Entries as they come. A job that killed its worker is tried again, one method and one case at a
    time, so that it costs the method and the case that did it and no other."""
    again: list[dict[str, Any]] = []
    count, total = 0, sum(map(_size, jobs))
    progress(0, total)
    for answer in pool.run(work, jobs):
        job = jobs[answer.job]
        if answer.error:
            again += _apart(job)
        else:
            yield from _entries(answer.result)
        count += _size(job)
        progress(count, total + len(again))
    for number, answer in enumerate(pool.run(work, again), count + 1):
        ((_, place, wanted),) = again[answer.job]["cells"]
        lost = [(place, CaseResult(case, "failed", answer.error)) for case in wanted]
        yield from lost if answer.error else _entries(answer.result)
        progress(number, total + len(again))


def _size(job: Mapping[str, Any]) -> int:
    """How many cases a job is to answer."""
    return len({case for _, _, wanted in job["cells"] for case in wanted})


def _apart(job: Mapping[str, Any]) -> list[dict[str, Any]]:
    """A job as jobs of one method and one case."""
    return [
        {**job, "cases": (case,), "cells": [(spec, place, {case: key})]}
        for spec, place, wanted in job["cells"]
        for case, key in wanted.items()
    ]


def _entries(result: list[tuple[ResultPaths, CaseResult]] | Stop) -> list[tuple[ResultPaths, CaseResult]]:
    if isinstance(result, Stop):
        raise BenchError(f"stopped: {result.reason}. What was finished is kept; run again to continue")
    return result


def _with_cases(plan: Plan, found: list[EvaluationUnit]) -> list[EvaluationUnit]:
    """The cells that have cases; raises BenchError with the data set's own notes where none has, and with
    its splits where it has none of those asked for."""
    filled = [cell for cell in found if cell.infos]
    if not found:
        cards = {spec: dataset(spec, plan.task).card for spec in plan.datasets}
        offered = "; ".join(f"{spec} has {' and '.join(card.splits)}" for spec, card in cards.items())
        raise BenchError(f"there is no case in {' or '.join(plan.splits)}: {offered}")
    if not filled:
        data = {id(cell.data): cell.data for cell in found}.values()
        notes = " ".join(f"{each.label}: {'; '.join(each.notes) or 'no notes'}." for each in data)
        splits = ", ".join(dict.fromkeys(cell.split for cell in found))
        raise BenchError(f"there is no case in {splits}. {notes}")
    return filled
