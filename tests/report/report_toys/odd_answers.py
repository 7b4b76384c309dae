"""A method that gives positions only, or fails."""

from __future__ import annotations

from retarget_bench.api import MethodCard
from retarget_bench.plugins import registry
from retarget_bench.plugins.spec import Spec


class OddAnswers:
    card = MethodCard(name="odd_answers", summary="toy", version="1")

    def __init__(self, does: str = "positions") -> None:
        self.does = does
        self._copy = registry.create("methods", Spec("copy_rotations"))

    def supports(self, source, target):
        return None

    def retarget(self, source, target, *, context):
        if self.does == "raise":
            raise RuntimeError("out of <b>ideas</b> & 'words'")
        moved = self._copy.retarget(source, target, context=context)
        return target.positions(moved.positions, moved.fps)


plugin = OddAnswers
