"""A method that attacks the run it takes part in, in the way that its parameter ``does`` says."""

import ctypes
import gc
import os
import signal
import sys
import time
from pathlib import Path

from retarget_bench.api import Case, MethodCard
from retarget_bench.errors import BenchError


class Hostile:
    def __init__(self, does: str) -> None:
        self.does = does
        self.card = MethodCard(name="hostile", summary="attacks", version="1")

    def supports(self, source, target):
        return None

    def retarget(self, source, target, *, context):
        found = getattr(self, f"_{self.does}")(target)
        return found or target.motion(source.rotations, source.root, source.fps)

    def _frame(self, target):
        """The answer from a local variable of whoever calls."""
        frame = sys._getframe()
        while frame := frame.f_back:
            for each in frame.f_locals.values():
                if isinstance(each, Case) and each.reference is not None:
                    return each.reference
        raise BenchError("no answer in any frame")

    def _gc(self, target):
        """The answer from the memory of the process."""
        for each in gc.get_objects():
            if isinstance(each, Case) and each.reference is not None:
                return each.reference
        raise BenchError("no answer in memory")

    def _setflags(self, target):
        """All later methods are to be asked about a larger body."""
        target.skeleton.offsets.setflags(write=True)
        target.skeleton.offsets[...] *= 2.0

    def _patch(self, target):
        """All errors are to be nothing."""
        from retarget_bench.api import comparison
        from retarget_bench.evaluation import score, shard_work

        for module in (score, shard_work):
            module.score = lambda *_: {"mpjpe_h.world": 0.0}
        comparison.Comparison.__getattr__ = lambda *_: 0.0

    def _hang(self, target):
        while True:
            pass

    def _sleep(self, target):
        note = Path(os.environ["RETARGET_BENCH_NAP"])
        note.with_suffix(".new").write_text(str(os.getpid()))
        note.with_suffix(".new").rename(note)
        time.sleep(3600)

    def _fork(self, target):
        """Two processes come back where one was asked."""
        os.fork()

    def _hold(self, target):
        """A child that outlives its parent, in a session of its own, with all that is open."""
        if not os.fork():
            os.setsid()
            signal.signal(signal.SIGTERM, signal.SIG_IGN)
            time.sleep(3600)
        os._exit(0)

    def _leak(self, target):
        held = []
        while True:
            held.append(b"x" * 2**26)

    def _print(self, target):
        for _ in range(100):
            print("x" * 2**20)

    def _folders(self, target):
        """Delete what is at hand."""
        for each in Path().iterdir():
            each.unlink()
        os.chdir("/")

    def _leave(self, target):
        os._exit(7)

    def _crash(self, target):
        ctypes.string_at(0)


plugin = Hostile
