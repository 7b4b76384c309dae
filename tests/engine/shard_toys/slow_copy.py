"""A method that takes its time, so that what asks it can be killed meanwhile."""

import time

from retarget_bench.api import MethodCard


class SlowCopy:
    card = MethodCard(name="slow_copy", summary="toy", version="1")

    def __init__(self, seconds: float = 0.1) -> None:
        self.seconds = seconds

    def supports(self, source, target):
        return None

    def retarget(self, source, target, *, context):
        time.sleep(self.seconds)
        return target.motion(source.rotations, source.root, source.fps)


plugin = SlowCopy
