"""Copy-rotations on Mixamo under the published protocol, and what the default changes.

    python tests/benchmarks/mixamo_figures.py PATH/TO/mixamo

in an environment in which retarget-bench is installed. Errors are divided by H1 and averaged over frames
and joints, then over clips, then over ordered pairs: world, root-relative, and squared times 1000 by the
SAN code's rule. The root path is scaled by the ratio of root offsets.

The rate hardly matters: every second frame of the same motion. The joint set does. S23 adds ``Pelvis``,
which lies on the hips and thins the root-relative error out by 1 in 23. S28 adds three split joints, which
agree, and the ends of toes and head, which do not: toe ends lie as far off as the feet (3 % of height), and
the top of the head 7 % where the source is BigVegas, whose neck and head Mixamo turned in another way.
"""

import sys
from collections import defaultdict

import numpy as np

from retarget_bench.api import Case, Context, Prediction
from retarget_bench.datasets.mixamo import Mixamo
from retarget_bench.methods.copy_rotations import CopyRotations

SETTINGS = {
    "published: 60 fps, body22": {"fps": 60.0, "structure": "body22"},
    "30 fps, body22": {"fps": 30.0, "structure": "body22"},
    "default: 30 fps, native": {},
}


def errors(case: Case, prediction: Prediction) -> tuple[float, float, float]:
    """World, root-relative and squared error of one case."""
    assert case.reference is not None
    off = (prediction.positions - case.reference.positions) / case.target.measures.h1
    centred = off - off[:, :1]
    lengths = [float(np.linalg.norm(each, axis=-1).mean()) for each in (off, centred)]
    return lengths[0], lengths[1], float(1000.0 * (off**2).mean())


def groups(dataset: Mixamo) -> dict[str, list[tuple[float, float, float]]]:
    """Source structure > target structure -> one row per ordered pair."""
    method = CopyRotations(root_rule="root_offset")
    by_pair = defaultdict(list)
    for split in ("intra", "cross"):
        for info in dataset.cases("retarget", split):
            case = dataset.load(info)
            answer = method.retarget(case.source, case.target, context=Context())
            sides = case.source.character.structure, case.target.structure
            by_pair[(*sides, info.pair)].append(errors(case, answer))
    found = defaultdict(list)
    for (source, target, pair), rows in sorted(by_pair.items()):
        mean = tuple(np.mean(rows, axis=0))
        found[f"{source} to {target}"].append(mean)
        if pair.startswith("BigVegas>") and source != target:
            found[f"BigVegas to {target}"].append(mean)
    return found


def main() -> None:
    for name, parameters in SETTINGS.items():
        print(name)
        for group, rows in groups(Mixamo(sys.argv[1], **parameters)).items():
            world, centred, squared = np.mean(rows, axis=0)
            print(f"  {group:24} {len(rows):2} pairs  {world:.4f} / {centred:.4f}   {squared:.3f}")


if __name__ == "__main__":
    main()
