"""``bench train`` by two processes together, once for each argument, which is ``launch``'s as JSON.

torch's elastic agent watches them, as under ``torchrun``, and starts both anew where one dies. They are
forked where that can be, so that torch is imported once. They start no processes of their own and draw
nothing.
"""

from __future__ import annotations

import json
import os
import sys

from torch.distributed.launcher.api import LaunchConfig, elastic_launch

from retarget_bench.cli import main
from retarget_bench.training import clips, log
from tests.in_process import carried_out_here


def train(words: list[str], environment: dict[str, str]) -> None:
    """One of the processes."""
    os.environ.update(environment)
    clips.carried_out = carried_out_here  # type: ignore[misc]
    log.draw = lambda *_: None  # type: ignore[assignment]
    try:
        main(words)
    except SystemExit as ended:
        if ended.code:
            raise RuntimeError(f"bench train ended with {ended.code}") from ended


def launch(words: list[str], environment: dict[str, str]) -> None:
    config = LaunchConfig(
        min_nodes=1,
        max_nodes=1,
        nproc_per_node=2,
        run_id=str(os.getpid()),
        rdzv_backend="c10d",
        rdzv_endpoint="localhost:0",
        max_restarts=1,
        monitor_interval=0.1,
        start_method="fork" if sys.platform == "linux" else "spawn",
    )
    elastic_launch(config, train)(words, environment)


if __name__ == "__main__":
    import torch._dynamo  # noqa: F401  (an optimiser's first step would, in each process)

    for run in sys.argv[1:]:
        launch(**json.loads(run))
