"""Carrying out a plan: which cases are missing, the shards, the journal, and the finished files."""

import shutil
import time
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from contextlib import closing, nullcontext
from dataclasses import replace
from pathlib import Path
from typing import Literal

from retarget_bench.errors import BenchError, FileError, some
from retarget_bench.evaluation import clips, executors, pairs, set_metrics, timing, waiting
from retarget_bench.evaluation.executors import Engine
from retarget_bench.evaluation.executors.local import Local
from retarget_bench.evaluation.header_builder import header_of
from retarget_bench.evaluation.plan import EvaluationUnit, Plan, evaluation_units
from retarget_bench.evaluation.shards import Answer, StoredPlan, Unit, cut, left_over
from retarget_bench.files import LOCK, locked
from retarget_bench.plugins import bound
from retarget_bench.results import case_metadata, journal, store
from retarget_bench.results.store import CaseResult, ResultPaths

PATIENCE = 60.0
"""Seconds in which the answers of a shard that has ended must appear: shared file systems are slow."""
POLL = 0.5

Progress = Callable[[int, int], None]
"""Called with the number of answers done and of all that are to be asked."""
Entries = dict[str, CaseResult]


def run(plan: Plan, progress: Progress, *, timed: bool = False) -> list[ResultPaths]:
    """Compute what a plan lacks and return the paths of its results. timed: measure speeds, too.

    Interrupted at any moment, it keeps what was finished; the next run goes on from there. A plan of
    some clips leaves results that are not complete. Raises BenchError where another run is writing to
    the same folder.
    """
    busy = f"another run is writing to {plan.out}; wait until it has ended, or give another folder"
    with (
        nullcontext() if plan.overwrite == "never" else locked(plan.out / LOCK, busy),
        Local(plan.jobs) as local,
    ):
        engine = executors.engine(plan.executor, local)
        units = _with_cases(plan, evaluation_units(plan))
        todo = [unit for unit in units if _lacks(unit)]
        for unit in units if plan.overwrite != "never" else ():
            if case_metadata.damaged(unit.paths):
                case_metadata.write(unit.paths, unit.data, unit.infos)
            if unit not in todo:
                store.settle(unit.paths)
        done = _begun(plan, todo)
        _answer(plan, engine, done, progress)
        if plan.stage != "predict":
            complete = {unit: entries for unit, entries in done.items() if len(entries) == len(unit.infos)}
            _finish(plan, local, complete)
            if timed and plan.overwrite != "never" and len(complete) == len(done):
                _time(plan, local)
    return [unit.paths for unit in units]


# --------------------------------------------------------------------------------------------- answers
def _begun(plan: Plan, units: Iterable[EvaluationUnit]) -> dict[EvaluationUnit, Entries]:
    """The entries that interrupted runs left of each unit, whose results can be read from now on."""
    if plan.stage == "predict":
        return {unit: {} for unit in units}
    by_paths = {unit.paths: unit for unit in units}
    if plan.overwrite != "never":
        _take_over(plan.out, by_paths)
    entries = {unit: _journalled(unit) for unit in by_paths.values()}
    for unit in entries:
        if not store.lists(unit.paths, unit.infos):
            case_metadata.write(unit.paths, unit.data, unit.infos)
        store.begin(unit.paths, header_of(unit, ()), unit.infos)
    return entries


def _answer(plan: Plan, engine: Engine, done: Mapping[EvaluationUnit, Entries], progress: Progress) -> None:
    """Have the missing cases that are requested computed, and journal them. Raises BenchError."""
    left = {unit: _skipped_cases(unit, entries) for unit, entries in done.items()}
    if not any(len(unit.infos) > len(skipped) for unit, skipped in left.items()):
        progress(0, 0)
        return
    stored = StoredPlan.write(plan, [Unit.of(unit) for unit in left], cut(left))
    units = list(done)
    count, total = 0, sum(stored.content.sizes)
    progress(0, total)
    lost: dict[int, str] = {}
    with closing(engine.run(stored.folder, stored.shards)) as ended:
        for number, problem in ended:
            answers = _complete(stored, number, wait=not problem)
            if len(answers) < stored.content.sizes[number]:
                lost[number] = problem or "it ended, but not all of its answers are to be seen here"
            for unit, entry in answers:
                if plan.stage != "predict":
                    journal.append_journal(units[unit].paths, entry)
                done[units[unit]][entry.case] = entry
            count += len(answers)
            progress(count, total)
    if lost:
        number, problem = min(lost.items())
        raise BenchError(
            f"{len(lost)} of {len(stored.shards)} shards were lost; shard {number}: {problem}. What was "
            "finished is kept; run again to continue"
        )
    stored.remove()


def _complete(stored: StoredPlan, number: int, wait: bool) -> list[Answer]:
    """The answers of a shard that has ended. wait: until all of them are to be seen."""
    until = time.monotonic() + PATIENCE * wait
    while True:
        answers = list(stored.answers(number))
        if len(answers) >= stored.content.sizes[number] or time.monotonic() >= until:
            return answers
        time.sleep(POLL)


def _skipped_cases(unit: EvaluationUnit, done: Entries) -> Collection[str]:
    """The cases of a unit that are done, or not of the clips that are asked for."""
    if unit.requested is unit.infos:
        return done
    requested = {info.id for info in unit.requested}
    return {info.id for info in unit.infos if info.id in done or info.id not in requested}


def _lacks(unit: EvaluationUnit) -> bool:
    """Whether anything of a unit is to be computed: it is not complete, or not up to date."""
    overwrite = unit.plan.overwrite
    if overwrite == "never":
        return False
    if overwrite == "always" or unit.plan.stage == "predict":
        return True
    try:
        header = store.read_header(unit.paths.header)
        store.verify(unit.paths, header)
    except FileError:
        return True
    counts = header.counts
    complete = header.keys == unit.keys and counts.asked == len(unit.infos) and not counts.missing
    again = overwrite == "failed" and (counts.failed + counts.invalid or header.faults)
    return not complete or bool(again)


def _take_over(root: Path, units: Mapping[ResultPaths, EvaluationUnit]) -> None:
    """Journal what shards of a run that has ended went on to finish, and remove them."""
    plans = left_over(root, units)
    done = {paths: journal.open_journal(paths, unit.keys) for paths, unit in units.items()} if plans else {}
    for stored in plans:
        for number, entry in stored.answers() if stored.plan.stage != "predict" else ():
            paths = replace(stored.units[number].paths, root=root)
            same = paths in units and units[paths].keys == stored.units[number].keys
            if same and entry.case not in done[paths]:
                journal.append_journal(paths, entry)
                done[paths][entry.case] = entry
        stored.remove()


def _journalled(unit: EvaluationUnit) -> Entries:
    """The entries that an interrupted run left, unless they are to be made anew."""
    entries = journal.open_journal(unit.paths, unit.keys, anew=unit.plan.overwrite != "missing")
    return {
        case: entry
        for case, entry in entries.items()
        if entry.status != "missing"
        and (entry.status != "ok" or not unit.metrics.wait or waiting.file(unit.paths, case).exists())
    }


def _with_cases(plan: Plan, units: list[EvaluationUnit]) -> list[EvaluationUnit]:
    """The units that have cases; raises BenchError with the data set's own notes where none has."""
    filled = [unit for unit in units if unit.infos]
    if not filled:
        data = {id(unit.data): unit.data for unit in units}.values()
        notes = " ".join(f"{each.label}: {'; '.join(each.notes) or 'no notes'}." for each in data)
        splits = ", ".join(dict.fromkeys(unit.split for unit in units))
        raise BenchError(f"there is no case in {splits}. {notes}")
    there = dict.fromkeys(info.clip for unit in filled for info in unit.infos) if plan.clips else {}
    for pattern in clips.patterns(plan.clips, there):
        if not any(clips.fits(clip, pattern) for clip in there):
            raise BenchError(f"no clip fits {pattern!r}; there are {some(list(there), 5)}")
    return [unit for unit in filled if unit.requested]


# --------------------------------------------------------------------------------------------- finishing
def _finish(plan: Plan, local: Local, done: Mapping[EvaluationUnit, Entries]) -> None:
    """Values of pairs and sets, then rows, then the header, which says that all is there."""
    metrics = bound.metrics(plan.metrics)
    if metrics.wait:
        answered = [
            [each.case for each in entries.values() if each.status == "ok"] for entries in done.values()
        ]
        _units_by(plan, local, "sets", list(done), answered)
    else:
        for unit in done:
            set_metrics.write(unit.paths, [])  # earlier results of other metrics may have left some
    written = set[Path]()
    for unit, entries in done.items():
        listed = [entries[info.id] for info in unit.infos]
        if metrics.of_pairs:
            listed = pairs.completed(unit.paths, listed)
        if unit.paths.folder not in written:  # all methods share them
            case_metadata.write(unit.paths, unit.data, unit.infos)
            written.add(unit.paths.folder)
        store.write_results(unit.paths, header_of(unit, listed), listed, unit.infos)
        shutil.rmtree(waiting.folder(unit.paths), ignore_errors=True)


def _time(plan: Plan, local: Local) -> None:
    """Measure the speed of every method that has results but no times newer than them, one after the
    other."""
    units: dict[object, list[EvaluationUnit]] = {}
    for unit in evaluation_units(plan) if plan.external is None else ():
        if not unit.seed_number and unit.paths.header.exists():
            units.setdefault((unit.dataset, unit.method), []).append(unit)
    stale = timing.stale({each[-1]: [unit.paths for unit in each] for each in units.values()})
    _units_by(plan, local, "time", stale)


def _units_by(
    plan: Plan,
    local: Local,
    kind: Literal["sets", "time"],
    units: list[EvaluationUnit],
    answered: Sequence[Sequence[str]] = (),
) -> None:
    """Have something done for every unit by processes of this machine, times one after the other. Raises
    BenchError where sets fail."""
    if not units:
        return
    stored = StoredPlan.write(plan, [Unit.of(unit) for unit in units], answered=answered)
    try:
        for number, problem in local.run(stored.folder, range(len(units)), kind):
            if problem and kind == "sets":
                raise BenchError(f"the sets of {units[number].paths.rows} could not be compared: {problem}")
    finally:
        stored.remove()
