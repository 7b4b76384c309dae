"""Speed of methods: measured while no other is asked, one case at a time, after a warm-up.

Times stand in files of their own, never in rows or keys: they differ from run to run and machine to
machine, and rows must not. Speeds are read from there alone. Beside every time stands that of
a fixed piece of work at the same moment, the yardstick, so that times of a busy moment, or of a slower
machine, are not shown as if they were of a quiet one.
"""

from __future__ import annotations

import json
import math
import statistics
import time
from collections.abc import Callable, Container, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, TypeVar

from retarget_bench.api import Case, CaseInfo, Dataset
from retarget_bench.errors import BenchError, FileError
from retarget_bench.files import digest, write_csv
from retarget_bench.results.store import ResultPaths, read_cases, read_csv

if TYPE_CHECKING:
    from retarget_bench.evaluation.prediction.questions import Question
    from retarget_bench.evaluation.prediction.workers import PredictionWorker

U = TypeVar("U")

CASES = 5
REPEATS = 3
ENOUGH_SECONDS = 0.5
SLOWER = 1.5
"""Ratio of yardsticks from which times are not compared."""
WORK = 60_000
FIELDS = ("case", "frames", "seconds", "yardstick", "sum")
"""The last is a checksum of the others of all rows, in each of them."""


@dataclass(frozen=True)
class Time:
    """The seconds that a method takes for a case, and those of the yardstick meanwhile; nan: not known."""

    case: str
    frames: int
    seconds: float
    yardstick: float = math.nan


def stale(units: Mapping[U, Sequence[ResultPaths]]) -> list[U]:
    """Those without times newer than their results, or with times taken while the machine was busier
    than now.

    units: a method on the split that it is timed on -> its results on all splits.
    """
    now = yardstick()
    return [unit for unit, places in units.items() if _stale(places, now)]


def write(paths: ResultPaths, times: Sequence[Time]) -> None:
    """Write the times of a method, which are those on all splits."""
    rows = [[t.case, str(t.frames), f"{t.seconds:.6g}", f"{t.yardstick:.6g}"] for t in times]
    write_csv(paths.timing, FIELDS, [[*row, _sum(rows)] for row in rows])
    for other in _times(paths):
        if other != paths:
            other.timing.unlink()


def spread(infos: Sequence[CaseInfo]) -> tuple[CaseInfo, ...]:
    """A few cases, evenly spread over the list."""
    step = max(1, len(infos) // CASES)
    return tuple(infos[::step][:CASES])


def yardstick() -> float:
    """Seconds of a fixed piece of work in one thread: the middle one of three."""
    seconds = []
    for _ in range(3):
        start = time.perf_counter()
        sum(number * number for number in range(WORK))
        seconds.append(time.perf_counter() - start)
    return sorted(seconds)[1]


def measured(
    worker: PredictionWorker,
    questions: Callable[[Sequence[Case]], list[Question]],
    data: Dataset,
    infos: Sequence[CaseInfo],
) -> list[Time]:
    """Seconds for a few cases, by the clock of the asking process, after the method has answered one.

    Every question is another one, so that nothing is gained by remembering: each is a case without its
    first few frames. Handing over counts, as it does for all methods alike.
    """
    times: list[Time] = []
    spent, mark = 0.0, yardstick()
    for info in infos:
        if spent > ENOUGH_SECONDS:
            break
        try:
            case = data.load(info)
        except BenchError:
            continue
        if not times and worker.ask_alone(questions([case]))[0][0].prediction is None:
            continue
        tries: list[Time] = []
        for number in range(1, REPEATS + 1):
            view = _view(case, number)
            (outcome,), seconds = worker.ask_alone(questions([view]))
            spent, before, mark = spent + seconds, mark, yardstick()
            if outcome.prediction is not None:
                tries.append(Time(info.id, view.source.frames, seconds, max(before, mark)))
        if tries:
            times.append(min(tries, key=lambda each: (each.yardstick, each.seconds / each.frames)))
    return times


def _view(case: Case, number: int) -> Case:
    """A case without so many of its first frames, as far as there are others."""
    frames = slice(min(number, case.source.frames - 1), None)
    names = ("source", "reference", "alternative", "source_motion")
    return replace(case, **{name: (each := getattr(case, name)) and each.at(frames) for name in names})


def read(paths: ResultPaths, clips: Container[str] | None = None) -> list[Time]:
    """The times of the cases that a method was timed on; empty where there are none.

    They may be of another split than these results. Results that are not complete have none. clips: only
    of these clips.
    """
    for place in _times(paths)[: paths.complete]:
        times = _read(place)
        if clips is None:
            return times
        clip = {info.id: info.clip for info in read_cases(place.cases, place.task, place.split)}
        return [each for each in times if clip.get(each.case) in clips]
    return []


def _read(place: ResultPaths) -> list[Time]:
    """The times in a file. Raises FileError."""
    try:
        lines = read_csv(place.timing, FIELDS)
        rows = [row[:-1] for row in lines]
        if any(row[-1] != _sum(rows) for row in lines):
            raise ValueError("it is not as it was written")
        return [Time(case, int(frames), *map(float, seconds)) for case, frames, *seconds in rows]
    except (FileError, OSError, ValueError) as error:
        problem = error.problem if isinstance(error, FileError) else error
        raise FileError(place.timing, f"cannot be read as times ({problem}); delete it") from error


def _sum(rows: Sequence[Sequence[str]]) -> str:
    return digest(json.dumps(rows), 12)


def rate(times: Sequence[Time]) -> float | None:
    """Frames per second; None where there are no times."""
    seconds = sum(each.seconds for each in times)
    return sum(each.frames for each in times) / seconds if seconds > 0 else None


def pace(times: Sequence[Time]) -> float:
    """The middle one of the yardsticks of times, in seconds; nan where there are none."""
    return statistics.median(each.yardstick for each in times) if times else math.nan


def _times(paths: ResultPaths) -> list[ResultPaths]:
    """The splits of the same method that have times, its own first."""
    folders = sorted(each.parents[0].name for each in paths.folder.parent.glob(f"*/{paths.timing.name}"))
    return [replace(paths, split=split) for split in sorted(folders, key=paths.split.__ne__)]


def _stale(places: Sequence[ResultPaths], now: float) -> bool:
    """now: the yardstick."""
    if not (timed := _times(places[-1])):
        return True
    newest = max(place.timing.stat().st_mtime for place in timed)
    older = newest < max(place.header.stat().st_mtime for place in places)
    return older or pace(_read(timed[0])) > SLOWER * now
