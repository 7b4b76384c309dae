"""A method whose behaviour is chosen by its parameter ``does``."""

import os
import signal
from dataclasses import replace

import numpy as np

from retarget_bench.api import MethodCard


class ToyMethod:
    def __init__(self, does: str = "copy", on: str = "") -> None:
        self.does, self.on = does, on
        self.card = MethodCard(
            name="toy_method",
            summary="toy",
            version="1",
            needs={"peek": ("reference",), "other": ("other_clips",)}.get(does, ()),
            stochastic=does == "noise",
        )

    def supports(self, source, target):
        return "I only know tall targets" if self.does == "picky" and target.name != "tall" else None

    def retarget(self, source, target, *, context):
        if self.on and round(float(source.rotations[3, 0, 1]), 3) != float(self.on):
            return target.motion(source.rotations, source.root, source.fps)
        return getattr(self, f"_{self.does}")(source, target, context)

    def _copy(self, source, target, context):
        return target.motion(source.rotations, source.root, source.fps)

    _picky = _copy

    def _positions(self, source, target, context):
        return target.positions(target.motion(source.rotations, source.root, 30.0).positions, source.fps)

    def _noise(self, source, target, context):
        shift = np.random.default_rng(context.seed).normal(size=3)
        return target.motion(source.rotations, source.root + shift, source.fps)

    def _peek(self, source, target, context):
        return context.reference

    def _other(self, source, target, context):
        assert context.reference is None
        return replace(context.other_clips[0], fps=source.fps)

    def _overwrite(self, source, target, context):
        source.rotations[...] = [1.0, 0.0, 0.0, 0.0]
        source.root[...] = 0.0
        return target.motion(source.rotations, source.root, source.fps)

    def _shaken(self, source, target, context):
        noise = np.random.default_rng(context.seed).normal(size=source.rotations.shape)
        turned = source.rotations + 0.3 * noise
        turned /= np.linalg.norm(turned, axis=-1, keepdims=True)
        return target.motion(turned, source.root + 1e-4 * noise[:, 0, :3], source.fps)

    def _far(self, source, target, context):
        return target.motion(source.rotations, 1e30 * source.root, source.fps)

    def _interrupt(self, source, target, context):
        raise KeyboardInterrupt

    def _leak(self, source, target, context):
        return target.motion(source.rotations, context.reference.root, source.fps)

    def _nan(self, source, target, context):
        return target.motion(source.rotations, np.where(source.root > 0.3, np.nan, source.root), 30.0)

    def _short(self, source, target, context):
        return target.motion(source.rotations[1:], source.root[1:], source.fps)

    def _double(self, source, target, context):
        return target.motion(2 * source.rotations, source.root, source.fps)

    def _wrong_body(self, source, target, context):
        return source

    def _nothing(self, source, target, context):
        return None

    def _raise(self, source, target, context):
        raise RuntimeError("out of\nideas")

    def _die(self, source, target, context):
        os.kill(os.getpid(), signal.SIGKILL)


plugin = ToyMethod
