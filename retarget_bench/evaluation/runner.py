"""Carrying out a plan: which cases are missing, the jobs, the journal, and the finished files."""

import shutil
from collections.abc import Collection, Iterable, Iterator, Mapping
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path

from retarget_bench.errors import BenchError, FileError
from retarget_bench.evaluation import executors, quick_looks, timing
from retarget_bench.evaluation.answers import Progress, answers
from retarget_bench.evaluation.executors import following
from retarget_bench.evaluation.header_builder import header_of
from retarget_bench.evaluation.jobs import Jobs
from retarget_bench.evaluation.plan import EvaluationUnit, Plan, dataset, evaluation_units, set_metrics
from retarget_bench.evaluation.prediction.workers import LEARNED
from retarget_bench.evaluation.process_pool import LocalPool
from retarget_bench.evaluation.set_metrics import files as set_files
from retarget_bench.evaluation.set_metrics.evaluate import SetJob, evaluate
from retarget_bench.evaluation.stored_plan import left_over, taken_over
from retarget_bench.files import LOCK, locked, scratch_folder
from retarget_bench.motion.bvh.catalogue import some
from retarget_bench.results import case_metadata, store
from retarget_bench.results.store import CaseResult, ResultPaths


def run(plan: Plan, progress: Progress, *, timed: bool = False) -> list[ResultPaths]:
    """Compute what a plan lacks and return the paths of its results. timed: measure speeds, too.

    Interrupted at any moment, it keeps what was finished; the next run goes on from there. Raises
    BenchError where another run is writing to the same folder. A plan of some clips leaves results
    unfinished, and their paths say so (``look``).
    """
    busy = f"another run is writing to {plan.root}; wait until it has ended, or give another folder"
    with nullcontext() if plan.redo == "never" else locked(plan.root / LOCK, busy):
        return _run(plan, progress, timed)


def _run(plan: Plan, progress: Progress, timed: bool) -> list[ResultPaths]:
    engine = executors.engine(plan.executor)
    wanted = _with_cases(plan, evaluation_units(plan))
    todo = {unit: cases for unit in wanted if (cases := _wanted_cases(unit))}
    keep = plan.stage != "predict"
    by_paths = {unit.paths: unit for unit in todo}
    if keep and plan.redo == "missing":
        _take_over(plan.root, by_paths)
    for unit in wanted if plan.redo != "never" else ():
        if case_metadata.damaged(unit.paths):
            case_metadata.write(unit.paths, unit.data, unit.infos)
    done = {unit: _begun(unit) if keep else {} for unit in todo}
    for unit in todo if keep else ():
        if not unit.paths.cases.exists():
            case_metadata.write(unit.paths, unit.data, unit.infos)
        store.begin(unit.paths, replace(header_of(unit, ()), only=plan.only), unit.infos)
    with scratch_folder() as scratch, LocalPool(plan.jobs) as pool:
        preload = _preload(todo)
        jobs = Jobs({unit: _not_asked(unit, entries) for unit, entries in done.items()}, scratch, preload)
        if engine is None:
            found = answers(pool, jobs, jobs.answers, progress)
        else:
            found = following.answers(engine, by_paths, pool, jobs, progress)
        for paths, entry in found:
            if keep:
                store.append_journal(paths, entry)
            done[by_paths[paths]][entry.case] = entry
        partial = {unit for unit in done if keep and plan.only and len(done[unit]) < len(unit.infos)}
        if keep:
            _finish(pool, {unit: entries for unit, entries in done.items() if unit not in partial})
        if timed and plan.redo != "never" and not plan.only:
            timing.measure(plan, pool, scratch, preload)
    return [replace(unit.paths, look=unit in partial) for unit in wanted]


def _not_asked(unit: EvaluationUnit, done: Mapping[str, CaseResult]) -> Collection[str]:
    """The cases of a unit that are done, or not of the clips that are asked for."""
    if not unit.plan.only:
        return done
    asked = {info.id for info in unit.asked}
    return {info.id for info in unit.infos if info.id in done or info.id not in asked}


def _finish(pool: LocalPool, done: Mapping[EvaluationUnit, Mapping[str, CaseResult]]) -> None:
    """Values of sets, then rows, then the header, which says that all is there."""
    splits = set[Path]()
    for unit in _with_sets(pool, done):
        listed = [done[unit][info.id] for info in unit.infos]
        if unit.paths.folder not in splits:  # all methods share them
            case_metadata.write(unit.paths, unit.data, unit.infos)
            splits.add(unit.paths.folder)
        store.write_results(unit.paths, header_of(unit, listed), listed, unit.infos)
        shutil.rmtree(set_files.waiting_folder(unit.paths), ignore_errors=True)


def _with_sets(
    pool: LocalPool, done: Mapping[EvaluationUnit, Mapping[str, CaseResult]]
) -> Iterator[EvaluationUnit]:
    """The units as the values of their sets are written; those of no metric of sets first."""
    waiting = [unit for unit in done if set_metrics(unit.plan.metrics)]
    for unit in done:
        if unit not in waiting:
            set_files.write(unit.paths, [])  # earlier results of other metrics may have left some
            yield unit
    jobs = []
    for unit in waiting:
        answered = tuple(info for info in unit.infos if done[unit][info.id].status == "ok")
        jobs.append(SetJob(unit.plan, unit.dataset, unit.paths, answered))
    for answer in pool.run(evaluate, jobs):
        if answer.error:
            raise BenchError(
                f"the sets of {waiting[answer.job].paths.rows} could not be compared: {answer.error}"
            )
        set_files.write(waiting[answer.job].paths, answer.result)
        yield waiting[answer.job]


def _wanted_cases(unit: EvaluationUnit) -> list[str]:
    """All cases of a unit, or none where its results are complete and up to date."""
    wanted = [info.id for info in unit.infos]
    redo = unit.plan.redo
    if redo == "never":
        return []
    if redo == "always" or unit.plan.stage == "predict":
        return wanted
    try:
        header = store.read_header(unit.paths.header)
        store.verify(unit.paths, header)
    except FileError:
        return wanted
    counts = header.counts
    complete = header.keys == unit.keys and counts.asked == len(wanted) and not counts.missing
    again = redo == "failed" and counts.failed + counts.invalid
    return [] if complete and not again else wanted


def _take_over(root: Path, units: Mapping[ResultPaths, EvaluationUnit]) -> None:
    """Journal what shards of a run that has ended went on to finish, and remove them."""
    keys = {paths: unit.keys for paths, unit in units.items()}
    plans = left_over(root, keys)
    begun = {paths: store.open_journal(paths, keys[paths]) for paths in keys} if plans else {}
    for paths, entry in taken_over(plans, keys, root):
        if entry.case not in begun[paths]:
            store.append_journal(paths, entry)
            begun[paths][entry.case] = entry
    for stored in plans:
        stored.remove()


def _begun(unit: EvaluationUnit) -> dict[str, CaseResult]:
    """The entries that an interrupted run left, unless they are to be made anew."""
    found = store.open_journal(unit.paths, unit.keys, anew=unit.plan.redo != "missing")
    sets = bool(set_metrics(unit.plan.metrics))
    return {
        case: entry
        for case, entry in found.items()
        if entry.status != "missing"
        and (entry.status != "ok" or not sets or set_files.case_features(unit.paths, case).exists())
    }


def _preload(units: Iterable[EvaluationUnit]) -> tuple[str, ...]:
    """What prediction workers import once for all of them."""
    return LEARNED if any(unit.prediction_facts["weights"] for unit in units) else ()


def _with_cases(plan: Plan, found: list[EvaluationUnit]) -> list[EvaluationUnit]:
    """The units that have cases; raises BenchError with the data set's own notes where none has, and with
    its splits where it has none of those asked for."""
    filled = [unit for unit in found if unit.infos]
    if not found:
        cards = {spec: dataset(spec, plan.task).card for spec in plan.datasets}
        offered = "; ".join(f"{spec} has {' and '.join(card.splits)}" for spec, card in cards.items())
        raise BenchError(f"there is no case in {' or '.join(plan.splits)}: {offered}")
    if not filled:
        data = {id(unit.data): unit.data for unit in found}.values()
        notes = " ".join(f"{each.label}: {'; '.join(each.notes) or 'no notes'}." for each in data)
        splits = ", ".join(dict.fromkeys(unit.split for unit in found))
        raise BenchError(f"there is no case in {splits}. {notes}")
    clips = dict.fromkeys(info.clip for unit in filled for info in unit.infos) if plan.clips else {}
    for pattern in plan.clips:
        if not any(quick_looks.fits(clip, pattern) for clip in clips):
            raise BenchError(f"no clip fits {pattern!r}; there are {some(list(clips), 5)}")
    return [unit for unit in filled if unit.asked]
