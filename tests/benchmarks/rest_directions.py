"""Where bones point in templates of real rigs, beside generated bodies: why HuMoT has ``slanted=true``.

    python tests/benchmarks/rest_directions.py --root PATH/TO/mixamo

For every role of ``body22``, in degrees: the largest angle of a bone of the puppets' test bodies from their
mean, and the mean and the largest angle of Mixamo's bodies from the same mean. Arms hang straight down in
every template.
"""

from __future__ import annotations

import argparse
from collections import defaultdict

import numpy as np

from retarget_bench.errors import BenchError
from retarget_bench.methods.humot.features import body
from retarget_bench.motion.body22 import PARENTS
from retarget_bench.motion.character import Character
from retarget_bench.motion.structures import BODY22
from retarget_bench.plugins import bound
from retarget_bench.plugins.spec import Spec


def people(dataset: str) -> list[Character]:
    """The characters of a data set's test cases that stand on two legs."""
    data, found = bound.dataset(Spec.parse(dataset)).built, {}
    for info in data.cases("retarget", "cross"):
        if {info.source, info.target} <= set(found):
            continue
        case = data.load(info)
        found |= {each.name: each for each in (case.source.character, case.target)}
    return [each for each in found.values() if not each.four_legged]


def directions(bodies: list[Character]) -> dict[str, np.ndarray]:
    """Role -> ``(bodies that have its bone, 3)`` unit vectors from the role above, in the template."""
    found = defaultdict(list)
    for mine in map(body, bodies):
        known = {mine.character.roles[joint]: place for place, joint in enumerate(mine.joints)}
        for role, parent in zip(BODY22[1:], PARENTS[1:], strict=True):
            if role in known and BODY22[parent] in known:
                bone = mine.template[known[role]] - mine.template[known[BODY22[parent]]]
                if (length := np.linalg.norm(bone)) > 0.0:
                    found[role].append(bone / length)
    return {role: np.array(each) for role, each in found.items()}


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n", 1)[0])
    parser.add_argument("--root", required=True, metavar="DIR", help="folder of the Mixamo clips")
    asked = parser.parse_args()
    try:
        generated, real = (
            directions(people(name)) for name in ("puppets[size=tiny]", f'mixamo[root="{asked.root}"]')
        )
    except BenchError as error:
        raise SystemExit(str(error)) from None
    print("role             generated, largest   real, mean and largest")
    for role in (each for each in BODY22 if each in generated and each in real):
        mean = generated[role].mean(0) / np.linalg.norm(generated[role].mean(0))
        here, there = (
            np.degrees(np.arccos((each @ mean).clip(-1, 1))) for each in (generated[role], real[role])
        )
        print(f"{role:16s} {here.max():10.1f} {there.mean():18.1f} {there.max():8.1f}")


if __name__ == "__main__":
    main()
