"""A method that takes several cases at once, and whose answers show what it was asked together with.

does: ``mix``: answers in a batch are off by a micrometre per frame of the whole batch; ``picky``: likewise,
and takes tall targets only; ``raise``, ``nan``, ``few``, ``die``: goes wrong in a batch, and also alone
where the source begins as clip 1 of ``toy_cases`` does.
"""

import os
import signal

import numpy as np

from retarget_bench.api import MethodCard
from retarget_bench.errors import NotSupported

MICROMETRE = 1e-6


class ToyBatches:
    card = MethodCard(name="toy_batches", summary="toy", version="1", default=False)

    def __init__(self, does: str = "mix") -> None:
        self.does = does

    def supports(self, source, target):
        return "tall targets only" if self.does == "picky" and target.name != "tall" else None

    def retarget(self, source, target, *, context):
        if self.does in ("raise", "nan", "few", "die") and is_clip_1(source):
            return getattr(self, f"_{self.does}")([target.motion(source.rotations, source.root, 30.0)])[0]
        return target.motion(source.rotations, source.root, source.fps)

    def retarget_batch(self, sources, targets, *, contexts):
        assert len(sources) == len(targets) == len(contexts) == len({each.seed for each in contexts})
        off = np.array([MICROMETRE * sum(each.frames for each in sources), 0, 0])
        pairs = zip(sources, targets, strict=True)
        answers = [body.motion(one.rotations, one.root + off, one.fps) for one, body in pairs]
        return getattr(self, f"_{self.does}")(answers)

    def _mix(self, answers):
        return answers

    _picky = _mix

    def _raise(self, answers):
        raise NotSupported("no batch today") if len(answers) > 1 else RuntimeError("no idea")

    def _nan(self, answers):
        answers[-1].root[0] = np.nan
        return answers

    def _few(self, answers):
        return answers[:-1]

    def _die(self, answers):
        os.kill(os.getpid(), signal.SIGKILL)


def is_clip_1(source):
    """Whether a source is ``clip 1`` of ``toy_cases``, whose third frame tells."""
    angle = 0.3 * np.sin(2 * np.pi * (3 / 30))
    return abs(source.rotations[3, 0, 1] - np.sin(angle / 2)) < 1e-6


plugin = ToyBatches
