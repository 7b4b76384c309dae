"""What shards on Ray cost beside the local pool: the same run in both, one after the other.

    python tests/benchmarks/executors.py mixamo --root PATH/TO/mixamo

Both have two processes, an empty folder of results, and parsed motions cached; the time of Ray includes its
start, the sample and the shards. Rows have to be the same bytes. Ray gives its workers a low priority by
default; here they have the usual one.
"""

import argparse
import os
import platform
import tempfile
import time
from dataclasses import replace
from pathlib import Path

from retarget_bench.evaluation import runner
from retarget_bench.evaluation.plan import Plan
from retarget_bench.plugins.spec import Spec
from retarget_bench.python.plans import default_metrics
from retarget_bench.results import store

METHODS = ("copy_rotations", "bone_directions", "ik", "rest_pose", "humot", "pmnet", "r2et", "smrm")


def seconds(plan: Plan) -> float:
    start = time.perf_counter()
    runner.run(plan, lambda done, total: None)
    return time.perf_counter() - start


def rows(root: Path) -> dict[str, bytes]:
    found = store.find_results(root)
    return {f"{paths.split} {paths.method}": paths.rows.read_bytes() for paths in found}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("dataset")
    parser.add_argument("--root", help="folder of the data set")
    parser.add_argument("--rounds", type=int, default=1)
    asked = parser.parse_args()
    os.environ["RAY_worker_niceness"] = "0"  # noqa: SIM112 (so Ray spells it)
    data = Spec.parse(asked.dataset)
    data = data.with_parameters(root=str(Path(asked.root).resolve())) if asked.root else data
    metrics = default_metrics("retarget", print)
    plan = Plan(tuple(map(Spec, METHODS)), (data,), (), metrics, jobs=2)
    print(f"{os.cpu_count()} cores, load {os.getloadavg()[0]:.1f}, Python {platform.python_version()}")
    with tempfile.TemporaryDirectory() as folder:
        runner.run(
            replace(plan, root=Path(folder, "warm"), methods=(Spec("copy_rotations"),)),
            lambda done, total: None,
        )
        for number in range(asked.rounds):
            spent = {}
            for executor in ("local", "ray"):
                root = Path(folder, f"{executor}-{number}")
                spent[executor] = seconds(replace(plan, root=root, executor=executor))
            assert rows(Path(folder, f"local-{number}")) == rows(Path(folder, f"ray-{number}"))
            counts = [store.read_header(paths.header).counts for paths in store.find_results(root)]
            print(
                f"{sum(each.asked for each in counts)} answers: local pool {spent['local']:.1f} s, "
                f"Ray {spent['ray']:.1f} s, ratio {spent['ray'] / spent['local']:.3f}",
                flush=True,
            )


if __name__ == "__main__":
    main()
