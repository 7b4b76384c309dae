"""``rb.run``: methods on a data set, scored; what is computed stays in a folder of results."""

from __future__ import annotations

from retarget_bench.evaluation import plan as planning
from retarget_bench.evaluation import runner
from retarget_bench.plugins import registry
from retarget_bench.python import plans
from retarget_bench.python.arguments import takes
from retarget_bench.python.progress import progress_bar
from retarget_bench.python.results import Results
from retarget_bench.python.run_options import RunOptions


@takes(RunOptions)
def run(options: RunOptions) -> Results:
    """Run methods on a data set and score them: ``bench run`` from Python.

    Results are kept in the folder ``out``, where the commands find them, too. Only what is missing there,
    or was made by other code, data or parameters, is computed; what an interrupted run finished is kept.

    Methods are specs (``"copy_rotations[root_rule=height]"``), files of methods of your own
    (``"my_method.py"``), or their modules. Returns the results of these methods on these splits, and of
    nothing else in the folder. Raises BenchError for whatever is unknown or broken. A method that fails on
    a case costs that case alone: see ``Results.problems``.
    """
    planning.forget()
    registry.refresh_files()
    plan = plans.plan_of(options, plans.warn)
    with progress_bar("run", "answers", options.progress) as progress:
        places = runner.run(plan, progress, timed=options.timed)
    return Results(plans.existing(places, plan.out), variants=options.methods != ())
