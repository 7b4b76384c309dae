"""Shards carried out by processes of this machine."""

import os
import select
import socket
import subprocess
import sys
import time
from collections import Counter, deque
from collections.abc import Generator, Iterator, Sequence
from contextlib import ExitStack, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Self

from retarget_bench.errors import BenchError
from retarget_bench.evaluation.prediction.channel import Channel, Closed
from retarget_bench.evaluation.prediction.launch import ending
from retarget_bench.evaluation.shard_work import LOADING, SCORING
from retarget_bench.evaluation.shards import StoredPlan
from retarget_bench.files import scratch_folder
from retarget_bench.parallel import THREAD_VARIABLES
from retarget_bench.results.store import CaseResult

LARGE_PAGES = {"GLIBC_TUNABLES": "glibc.malloc.hugetlb=1"}
"""Environment in which memory comes in large pages where a system has them: what lives for one answer takes
all that it needs anew, and small pages cost it a tenth of its time."""
SILENCE = 30.0
"""Seconds without a sign of life after which a process is taken for dead."""
POLL = 1.0
ENDED = "the process that scores ended twice at this ({})"
LOADED = "the data set ended the process that loads this case, twice ({})"
SCORED = "ended the process that scores, twice ({})"
PATIENCE = 3
"""A metric that ended processes at so many answers is asked no more."""
OFTEN = f"ended the process that scores, twice at each of {PATIENCE} answers; it was asked no more"


class Local:
    """``jobs`` processes, one thread each; they serve all shards until the ``with`` block ends.

    A shard whose process ended is carried out again at the end, while no other is, since what ended it
    may have been another method. What a process ends at twice costs that one answer, or that one value.

    check: whether plans may have been made by another machine.
    """

    def __init__(self, jobs: int, check: bool = False) -> None:
        self.jobs, self._check = max(1, jobs), check
        self._open = ExitStack()
        self._processes: list[_Process] = []
        self._ended: list[_Work] = []
        self._scratch: Path | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        for each in self._processes:
            each.end()
        self._processes.clear()
        self._open.close()

    def run(
        self, folder: Path, numbers: Sequence[int], kind: str = "shard"
    ) -> Generator[tuple[int, str], None, None]:
        """Carry out shards of a stored plan; each as it ends, with "" or why it was not completed.

        kind: ``shard``, or ``sets`` or ``time`` with numbers of units; times are taken one after the other.
        Raises BenchError where the run must end.
        """
        waiting, lost = deque(_Work(kind, number) for number in numbers), deque[_Work]()
        jobs = 1 if kind == "time" else self.jobs
        self._ready(min(jobs, len(waiting)))
        processes = self._processes[:jobs]
        try:
            while waiting or lost or any(each.work for each in processes):
                for each in processes:
                    if each.work is None and waiting:
                        each.give(folder, waiting.popleft(), self._given_up)
                if lost and not waiting and not any(each.work for each in processes):
                    processes[0].give(folder, lost.popleft(), self._given_up)
                for each in _with_messages([each for each in processes if each.work]):
                    for message in each.messages():
                        if "done" in message:
                            yield each.finished().number, _problem(message)
                    if each.how:
                        work = each.finished()
                        self._ended += [work] * (not work.again)
                        if problem := work.ended(folder, each.how):
                            yield work.number, problem
                        else:
                            lost.append(work)
        finally:
            for each in [each for each in processes if each.work]:
                each.end()
                self._processes.remove(each)

    def problems(self, folder: Path, numbers: Sequence[int]) -> dict[int, str]:
        """Carry out shards; of each why it was not completed, with the name of this machine, or ""."""
        problems: dict[int, str] = {}
        try:
            problems.update(self.run(folder, numbers))
        except BenchError as error:
            problems = {number: problems.get(number, str(error)) for number in numbers}
        return {number: why and f"{why} ({socket.gethostname()})" for number, why in problems.items()}

    @property
    def _given_up(self) -> list[list[Any]]:
        """Metrics that are asked no more, as ``_Work.without``."""
        blamed = Counter(metric for work in self._ended for _, _, metric, _ in work.without)
        return [[None, None, metric, OFTEN] for metric, times in blamed.items() if times >= PATIENCE]

    def _ready(self, count: int) -> None:
        """Start processes until there are so many."""
        if self._scratch is None:
            self._scratch = self._open.enter_context(scratch_folder())
        while len(self._processes) < count:
            self._processes.append(_Process(self._scratch, self._check))


@dataclass
class _Work:
    """A piece of work of a process, and how it went so far.

    without: unit, case and metric of what is to be left out, and why. at: what the process is at; before:
    what earlier ones were at when they ended.
    """

    kind: str
    number: int
    without: list[list[Any]] = field(default_factory=list)
    at: list[Any] | None = None
    before: list[list[Any]] = field(default_factory=list)
    again: bool = False

    def ended(self, folder: Path, how: str) -> str:
        """Record that a process ended at this; why it cannot be completed, or ""."""
        first, self.again = not self.again, True
        units, cases, call = self.at or ([], [], "")
        metric = call not in ("", LOADING, SCORING)
        if not (metric or (cases and self.kind == "shard")):
            return "" if first else f"its process ended twice ({how})"
        twice = self.at in self.before or (metric and [units, cases, SCORING] in self.before)
        self.before.append([units, cases, call])
        if twice and metric:
            left_out = [[unit, case, call] for unit in units for case in cases or [""]]
            self.without += [[*each, SCORED.format(how)] for each in left_out]
        elif twice:
            write, why = StoredPlan(folder).writer(self.number), LOADED if call == LOADING else ENDED
            for unit in units:
                for case in cases:
                    write(unit, CaseResult(case, "failed", why.format(how)))
        return ""


class _Process:
    """A process and what it is doing; where it ended, the next work gets a new one.

    how: it ended, in words; "" while it lives.
    """

    def __init__(self, scratch: Path, check: bool) -> None:
        self._scratch, self._check = scratch, check
        self.work: _Work | None = None
        self._start()

    def _start(self) -> None:
        code = (
            f"import sys; sys.path[:] = {sys.path!r}\n"
            "from retarget_bench.evaluation.shard_process import main\n"
            f"main({str(self._scratch)!r}, {self._check})"
        )
        self._process = subprocess.Popen(
            [sys.executable, "-c", code],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            env=LARGE_PAGES | os.environ | dict.fromkeys(THREAD_VARIABLES, "1"),
            start_new_session=True,  # Ctrl-C is for who asks
        )
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self.channel = Channel(self._process.stdout.fileno(), self._process.stdin.fileno())
        self._heard, self.how = time.monotonic(), ""

    def give(self, folder: Path, work: _Work, given_up: Sequence[list[Any]]) -> None:
        """Start work of a stored plan. given_up: the metrics that are asked no more."""
        if self.how or self._process.poll() is not None:
            self._close()
            self._start()
        self.work, work.at = work, None
        self._heard = time.monotonic()
        request = {"folder": str(folder), "kind": work.kind, "number": work.number, "again": work.again}
        request["without"] = [*work.without, *given_up]
        with suppress(Closed):  # messages() will see that it ended
            self.channel.send(request)

    @property
    def silent(self) -> bool:
        return time.monotonic() - self._heard > SILENCE

    def messages(self) -> Iterator[dict[str, Any]]:
        """The lines that it wrote; ``how`` is set where it has ended."""
        try:
            while self.work is not None and (message := self.channel.receive(0.0)) is not None:
                self._heard = time.monotonic()
                if "at" in message:
                    self.work.at = message["at"]
                yield message
            if not self.silent:
                return
            self._process.kill()
            self._process.wait()
            self.how = f"no sign of life for {SILENCE:g} s"
        except Closed:
            self._process.kill()
            self.how = ending(self._process.wait())

    def finished(self) -> _Work:
        """Take its work from it, and return it."""
        assert self.work is not None
        work, self.work = self.work, None
        return work

    def end(self) -> None:
        if self.work is not None:
            self._process.kill()
        self._close()
        self._process.wait()

    def _close(self) -> None:
        """At the end of its input it ends, with its workers."""
        for pipe in (self._process.stdin, self._process.stdout):
            assert pipe is not None
            with suppress(OSError):
                pipe.close()


def _with_messages(processes: Sequence[_Process]) -> list[_Process]:
    """Those that have written something, or nothing for too long."""
    readable = select.select([each.channel.reading for each in processes], [], [], POLL)[0]
    return [each for each in processes if each.channel.reading in readable or each.silent]


def _problem(message: dict[str, Any]) -> str:
    """Why work was not completed, or "". Raises BenchError where the run must end."""
    if message["stop"]:
        raise BenchError(f"stopped: {message['done']}. What was finished is kept; run again to continue")
    return str(message["done"])
