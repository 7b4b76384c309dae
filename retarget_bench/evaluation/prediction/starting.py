"""The first steps of a prediction worker: on its own, with what it prints in a log, and with its method."""

import faulthandler
import gc
import os
import signal
import sys
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

from retarget_bench.api import optional
from retarget_bench.errors import BenchError, one_line
from retarget_bench.evaluation.prediction import apart
from retarget_bench.evaluation.prediction.answering import AnsweringLoop
from retarget_bench.evaluation.prediction.channel import Channel, Closed
from retarget_bench.evaluation.prediction.launch import adopt_orphans
from retarget_bench.evaluation.prediction.numpy_worker import end_with
from retarget_bench.plugins import registry
from retarget_bench.plugins.spec import Spec


def begin(start: Mapping[str, Any], reading: int, writing: int) -> None:
    """Build the method and answer until the channel closes; never returns.

    start: ``method`` (its spec), ``plugins`` (files and kinds of plug-ins), ``folder`` (an empty one to
    work in) and ``log`` (the file that takes what is printed).
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    adopt_orphans()
    with suppress(AttributeError, PermissionError):  # where there is none, or it leads a group already
        os.setsid()  # whoever ends this process ends what it started
    _print_into(start["log"])
    channel = Channel(reading, writing)
    with suppress(Closed):
        channel.send(_ready(start, channel))
    os._exit(0)


def _ready(start: Mapping[str, Any], channel: Channel) -> dict[str, Any]:
    """Load the method and serve; what keeps it from that, as a line."""
    try:
        registry.know_files(start["plugins"])
        method = registry.create("methods", Spec.parse(start["method"]))
        os.chdir(start["folder"])  # what a method writes or deletes by relative paths is its own
        optional.warm_up(method)
        gc.freeze()  # memory that nobody writes to stays shared with the processes that answer
        # fitting to training motion takes long, and is to be done once
        forks = apart.possible() and "training" not in optional.method_card(method).uses
        if not forks:
            end_with(channel.reading)
        channel.send({"ready": True, "forks": forks})
        AnsweringLoop(method, channel, Path(start["folder"])).serve(forks)
    except Closed:
        return {}
    except BenchError as error:
        return {"broken": str(error)}
    except (Exception, KeyboardInterrupt, SystemExit) as error:
        return {"broken": one_line(error)}
    return {}


def _print_into(log: str) -> None:
    """Standard output and errors of this process, and of what it starts, go to a file; input is empty."""
    nothing = os.open(os.devnull, os.O_RDONLY)
    printed = os.open(log, os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o600)
    for target, source in ((0, nothing), (1, printed), (2, printed)):
        os.dup2(source, target)
    sys.stdout = open(1, "w", encoding="utf-8", errors="replace", closefd=False, buffering=1)  # noqa: SIM115
    sys.stderr = open(2, "w", encoding="utf-8", errors="replace", closefd=False, buffering=1)  # noqa: SIM115
    faulthandler.enable(file=2)
