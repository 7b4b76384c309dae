"""A process that carries out shards for a ``Local`` engine, as lines on its standard input ask it to.

{"folder": "runs/.shards/0f3a...", "kind": "shard", "number": 7, "again": false, "without": []}
{"at": [[2], ["puppets/ada>boulder/sit-001"], ""]}  what it is at, for whoever finds it dead
{"alive": true}                                     every other second
{"done": "", "stop": false}                         or why it was not completed; stop: the run must end
"""

import os
import signal
import threading
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

from retarget_bench.errors import BenchError, one_line
from retarget_bench.evaluation.attempt import overdue
from retarget_bench.evaluation.prediction.channel import Channel, Closed
from retarget_bench.evaluation.prediction.launch import adopt_orphans
from retarget_bench.evaluation.shard_work import CannotStore, ShardWork

BEAT = 2.0
"""Seconds between two signs of life."""


def main(scratch: str, check: bool) -> None:
    """Carry out shards until the standard input ends. check: whether this may be another machine than
    the one that planned the run."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # who asks decides
    adopt_orphans()
    channel = Channel(os.dup(0), os.dup(1))
    os.dup2(2, 1)  # what plug-ins print is no answer
    speaking = threading.Lock()

    def say(message: dict[str, object]) -> None:
        with speaking:
            try:
                channel.send(message)
            except Closed:
                os._exit(1)

    def beat() -> None:
        while not ended.wait(BEAT):
            if not overdue():
                say({"alive": True})

    def at(units: Sequence[int], cases: Sequence[str], call: str) -> None:
        say({"at": [list(units), list(cases), call]})

    ended = threading.Event()
    threading.Thread(target=beat, daemon=True).start()
    work: ShardWork | None = None
    with suppress(Closed):
        while True:
            request = channel.receive()
            assert request is not None
            problem, stop = "", False
            try:
                if work is None or work.folder != Path(request["folder"]):
                    work = ShardWork(Path(request["folder"]), Path(scratch), at, work, check)
                work.do(request)
            except BenchError as error:
                problem, stop = str(error), isinstance(error, CannotStore)
            except Exception as error:  # of a plug-in, where nothing else told of it
                problem = one_line(error)
            say({"done": problem, "stop": stop})
    ended.set()
    if work is not None:
        work.close()
