"""One line that says what the method does; bench list shows it."""

import shlex
import sys
from pathlib import Path

from retarget_bench.api import Context, MethodCard, Prediction
from retarget_bench.errors import NotSupported
from retarget_bench.motion.character import Character

HERE = Path(__file__).parent
PYTHON = sys.executable  # put the path of the other Python here


class MyWorker:
    """What results and tables know of the method; my_worker_code.py answers, in the other Python."""

    card = MethodCard(
        name="my_worker",
        summary="Local rotations copied by another Python",
        version="1",
        environment=shlex.join(
            [PYTHON, *(str(HERE / f"my_worker_{file}.py") for file in ("worker", "code"))]
        ),
    )

    def supports(self, source: Character, target: Character) -> str | None:
        """The code in the other Python decides."""
        del source, target
        return None

    def retarget(self, source: Prediction, target: Character, *, context: Context) -> Prediction:
        del source, target, context
        raise NotSupported("my_worker answers in another Python, in bench run alone")


plugin = MyWorker
