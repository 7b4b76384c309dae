"""How the defaults of the tasks' baselines were chosen: error on validation data over their parameters.

    python tests/benchmarks/task_baselines.py denoise
    python tests/benchmarks/task_baselines.py joint-completion

Validation data share no clip with the test. Each number is the mean over cases of the error in cm at a
level; the last column, the mean over levels, chooses.
"""

from __future__ import annotations

import argparse
from collections import defaultdict

import numpy as np

from retarget_bench.evaluation.plan import (
    data_of,
)
from retarget_bench.evaluation.predict import context_for, predict
from retarget_bench.evaluation.tasks import canonical
from retarget_bench.plugins import bound
from retarget_bench.plugins.spec import Spec

CANDIDATES = {
    "denoise": [
        "identity",
        "gaussian_filter",
        *(f"gaussian_filter[sigma={sigma}]" for sigma in (0.04, 0.06, 0.08, 0.1, 0.12)),
        *(f"savitzky_golay[window={window},order=1]" for window in (5, 7, 9, 11)),
        *(f"savitzky_golay[window={window},order=2]" for window in (13, 15, 17, 19, 21, 23)),
    ],
    "joint-completion": [
        *(f"linear_joints[ridge={ridge}]" for ridge in (1e-5, 1e-3, 1e-2, 1e-1)),
        *(f"nearest_pose[neighbours={count}]" for count in (1, 4, 8, 16, 32)),
    ],
}
LEVELS = {"denoise": "0,1,2,3,4,5,6,8,10", "joint-completion": "0.1,0.3,0.5,0.7,0.9,major"}


def errors(name: str, task: str, data: Spec) -> dict[str, float]:
    """Level -> mean error in cm."""
    asked, cases = bound.method(name).built, data_of(bound.dataset(data), task)
    found = defaultdict(list)
    for info in cases.cases(Spec.parse(task).name, "self"):
        case = cases.load(info)
        answer = predict(asked, case, context_for(asked, cases, case, 0)).prediction
        if answer is not None and case.reference is not None:
            off = np.linalg.norm(answer.positions - case.reference.positions, axis=-1)
            found[info.id.rsplit("/", 1)[1]].append(100 * float(off.mean()))
    return {level: float(np.mean(each)) for level, each in found.items()}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("task", choices=CANDIDATES)
    parser.add_argument("-d", "--dataset", default="puppets[size=default,part=validation]")
    parser.add_argument("--motions", type=int, default=12)
    given = parser.parse_args()
    task = str(canonical(given.task, LEVELS[given.task], given.motions))
    for name in CANDIDATES[given.task]:
        found = errors(name, task, Spec.parse(given.dataset))
        cells = "  ".join(f"{level} {number:.3f}" for level, number in found.items())
        print(f"{name:40} {cells}  mean {np.mean(list(found.values())):.3f}", flush=True)


if __name__ == "__main__":
    main()
