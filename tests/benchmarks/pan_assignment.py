"""Error of PAN on ``h36m17``, which is in no training, through each structure that weights know.

    python tests/benchmarks/pan_assignment.py [DATASET] [EVERY]

EVERY: only each so-manieth case. Of cross cases, in % of the target's height: pose error and error in
the world, means over cases, and in how many cases a structure's pose error is the least.
"""

from __future__ import annotations

import sys
from collections import defaultdict

import numpy as np

from retarget_bench.evaluation import predict
from retarget_bench.evaluation.score import score
from retarget_bench.methods.pan.assignment import Assignment, in_layout
from retarget_bench.plugins import bound, registry
from retarget_bench.plugins.spec import Spec
from retarget_bench.training.layers.skeletal.body import FOUR

ODD, VALUES = "h36m17", ("mpjpe_h.root", "mpjpe_h.world")


def through(name: str, bodies: object):
    """The method with every body of the odd structure in the one called so."""
    method = registry.create("methods", "pan")
    for each in bodies:
        if each.structure == ODD:
            body = in_layout(each, method.structures[name].layout)
            method._assignments[each] = Assignment(name, body)
    return method


def main(data: str = "puppets[size=tiny]", every: str = "1") -> None:
    found = bound.dataset(Spec.parse(data)).built
    bodies = found.characters()
    names = [n for n in registry.create("methods", "pan").structures if not n.endswith(FOUR)]
    methods = [through(name, bodies.values()) for name in names]
    metrics, rows = bound.metrics(("position",)).of_cases, defaultdict(list)
    for info in found.cases("retarget", "cross")[:: int(every)]:
        pair = tuple(bodies[name].structure for name in (info.source, info.target))
        if ODD not in pair or any(bodies[name].four_legged for name in (info.source, info.target)):
            continue
        case = found.load(info)
        outcomes = [predict.predict(m, case, predict.context_for(m, found, case, 0)) for m in methods]
        scores = [score(metrics, case, each.prediction) for each in outcomes]
        rows[" > ".join(pair)].append([[each[value] for value in VALUES] for each in scores])
    print(f"{'pair':20}{'n':>4}  " + "  ".join(f"{name:>12}" for name in names) + "  least pose error")
    for pair, values in sorted(rows.items()):
        means, best = np.mean(values, axis=0), np.argmin(np.array(values)[:, :, 0], axis=1)
        cells = "  ".join(f"{pose:5.2f} /{world:5.2f}" for pose, world in means)
        print(f"{pair:20}{len(values):4}  {cells}  {np.bincount(best, minlength=len(names))}")


if __name__ == "__main__":
    main(*sys.argv[1:])
