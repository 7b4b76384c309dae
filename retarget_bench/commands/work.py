"""``bench work``: shards of a stored plan, carried out by hand or by any scheduler."""

from pathlib import Path

import click

from retarget_bench.commands.options import takes
from retarget_bench.errors import BenchError
from retarget_bench.evaluation.settings import Settings
from retarget_bench.python.progress import progress_bar


@click.command("work")
@click.argument("plan", metavar="PLAN", type=click.Path(exists=True, file_okay=False, path_type=Path))
@click.argument("shards", metavar="SHARD...", nargs=-1, required=True, type=click.IntRange(0))
@takes(Settings, only=("jobs",))
def command(plan: Path, shards: tuple[int, ...], options: Settings) -> None:
    """Carry out shards of a stored plan: what they lack is computed and written beside the plan.

    PLAN is a folder RESULTS/.shards/ID of a run with --executor; its shards are numbered from 0. That run
    takes up what comes; where it has ended, its repetition does.
    """
    from retarget_bench.evaluation.executors.local import Local

    with Local(options.jobs, check=True) as local, progress_bar("bench work", "shards") as progress:
        for count, (shard, problem) in enumerate(local.run(plan, shards), 1):
            if problem:
                raise BenchError(f"shard {shard} is not complete: {problem}")
            progress(count, len(shards))
