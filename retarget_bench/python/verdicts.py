"""What to look at in a retargeted motion."""

from __future__ import annotations

from os import PathLike

from retarget_bench.motion.character import Prediction
from retarget_bench.python.arguments import checked
from retarget_bench.python.motions import load_motion
from retarget_bench.verification import verdict as judging
from retarget_bench.verification.verdict import Verdict


@checked
def verdict(source: Prediction | str | PathLike[str], result: Prediction | str | PathLike[str]) -> Verdict:
    """Frames of a retargeted motion to look at and why, told from its source; ``print`` shows them.

    source, result: motions, or files, with as many frames at one rate. The Verdict has ``defects``, worst
    first, each with ``first``, ``last`` and ``worst`` frame, counted from 0, and a ``reason``;
    ``as_dict()`` is what ``bench retarget --report`` writes. Hands in the body are looked for where the
    result's character has a mesh. Raises BenchError where frames or rates differ.
    """
    told, found = (
        load_motion(each) if isinstance(each, str | PathLike) else each for each in (source, result)
    )
    return judging.verdict(told, found)
