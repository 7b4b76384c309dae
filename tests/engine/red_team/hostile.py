"""A method that attacks the run it takes part in, in the way that its parameter ``does`` says."""

import ctypes
import gc
import os
import signal
import sys
import time
from contextlib import suppress
from pathlib import Path

import numpy as np
import psutil

from retarget_bench.api import Case, MethodCard
from retarget_bench.errors import BenchError


class Hostile:
    def __init__(self, does: str) -> None:
        self.does = does
        self.card = MethodCard(name="hostile", summary="attacks", version="1")
        self.seen = []
        if does == "remember_batches":
            self.retarget_batch = self._batch

    def supports(self, source, target):
        return None

    def retarget(self, source, target, *, context):
        if self.does.startswith("remember"):
            return self._remembered(source, target)
        answer = getattr(self, f"_{self.does}")(target)
        return answer or target.motion(source.rotations, source.root, source.fps)

    def _batch(self, sources, targets, *, contexts):
        return [self._remembered(*each) for each in zip(sources, targets, strict=True)]

    def _remembered(self, source, target):
        """A motion that was shown before, of this body and alike; else the copy."""
        self.seen.append(source)
        for each in self.seen:
            same = each.frames == source.frames and each.character.name == target.name
            if same and np.allclose(each.rotations, source.rotations):
                return target.motion(each.rotations, each.root, source.fps)
        return target.motion(source.rotations, 2.0 * source.root, source.fps)

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

    # -------------------------------------------------------- at processes and files of others
    def _kill_server(self, target):
        os.kill(_ancestors()[1], signal.SIGKILL)
        time.sleep(60)

    def _stop_server(self, target):
        os.kill(_ancestors()[1], signal.SIGSTOP)

    def _kill_scorer(self, target):
        os.kill(_ancestors()[2], signal.SIGKILL)
        time.sleep(60)

    def _stop_scorer(self, target):
        os.kill(_ancestors()[2], signal.SIGSTOP)
        time.sleep(60)

    def _kill_others(self, target):
        """Every worker, of all scoring processes of the run; no other run."""
        own_processes = {os.getpid(), *_ancestors()}
        for each in psutil.Process(_ancestors()[3]).children(recursive=True):
            with suppress(psutil.Error):
                if "RETARGET_BENCH_WORKER" in each.environ() and each.pid not in own_processes:
                    each.kill()

    def _tamper(self, target):
        """Whatever lies in the folders of questions of the run is made another motion."""
        (run,) = (each for each in Path.cwd().parents if each.name.startswith("retarget-bench-"))
        for path in run.rglob("*.npz"):
            with suppress(OSError):
                path.write_bytes(path.read_bytes()[::-1])

    def _home(self, target):
        (Path.home() / ".retarget-bench-hostile").touch()

    def _files(self, target):
        """Whether what an earlier process wrote is still there: beside the folder that it works in."""
        self._told([Path.cwd().parent / "memory", Path.cwd().parents[1] / "memory"])

    def _places(self, target):
        """Likewise where all processes write."""
        self._told([Path("/tmp/hostile-memory"), Path("/dev/shm/hostile-memory")])

    def _told(self, places):
        for place in places:
            before = place.read_text() if place.exists() else ""
            place.write_text(str(os.getpid()))
            if before not in ("", str(os.getpid())):
                raise BenchError("remembered")
        raise BenchError("forgotten")

    def _fill(self, target):
        for number in range(100):
            with Path(str(number)).open("wb") as file:
                os.posix_fallocate(file.fileno(), 0, 2**24)
        time.sleep(3600)

    def _endless(self, target):
        frame = sys._getframe()
        while "channel" not in vars(frame.f_locals.get("self", object)):
            frame = frame.f_back
        for _ in range(10_000):
            os.write(frame.f_locals["self"].channel.writing, b"x" * 2**16)

    def _zombies(self, target):
        for _ in range(150):
            if not os.fork():
                os._exit(0)

    def _shared(self, target):
        """Memory that is shared, and not given back."""
        from multiprocessing import shared_memory

        block = shared_memory.SharedMemory(create=True, size=2**16, name=f"hostile-{os.getpid()}")
        block.buf[0] = 1

    def _crash(self, target):
        ctypes.string_at(0)


def _ancestors():
    """Of a process that answers: its worker, the fork server, the scoring process, that of the run."""
    pids, pid = [], os.getppid()
    while pid > 1:
        pids.append(pid)
        pid = int(Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[1])
    return pids


plugin = Hostile
