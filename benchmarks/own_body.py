"""What a learned method lacks: motions given back on their own bodies, bodies known or not, motions or not.

    python benchmarks/own_body.py pan humot+residual --root PATH/TO/mixamo

Root-aligned MPJPE in % of height of people, with 95 % intervals over motions: motions of the puppets' test
and of Mixamo (none of fold 0, by which choices are made), each on bodies of both; on another's body with
copied rotations. The right answer is the question, so that copying is exact. What is left is what a method
loses of any motion (all four cells), of motion unlike its training's (the first two beside the last two),
and of bodies unlike them.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence

import numpy as np
from tqdm import tqdm

from retarget_bench.analysis import statistics
from retarget_bench.api import Case, CaseInfo, Context, Method
from retarget_bench.datasets.mixamo.protocols import fold_of
from retarget_bench.errors import BenchError, NotSupported
from retarget_bench.evaluation.score import score
from retarget_bench.files import digest
from retarget_bench.motion.character import Character
from retarget_bench.motion.motion import Motion
from retarget_bench.plugins import bound, registry
from retarget_bench.plugins.spec import Spec

VALUE = "mpjpe_h.root"
MOTIONS = 24
"""Of each data set, at most."""


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("methods", nargs="+", metavar="METHOD")
    parser.add_argument("--root", required=True, metavar="DIR", help="folder of the Mixamo clips")
    options = parser.parse_args()
    try:
        found = measured(options.methods, options.root)
    except BenchError as error:
        parser.error(str(error))
    print("\n".join(table(found)))


Found = Mapping[str, Mapping[tuple[str, str], np.ndarray]]
"""Method -> (whose motion, whose body) -> the error of each motion."""


def measured(names: Sequence[str], root: str) -> Found:
    """root: folder of the Mixamo clips. Raises BenchError."""
    methods = {name: bound.method(name).built for name in names}
    moved = {
        "Mixamo": motions(f"mixamo[root={root}]", is_unseen),
        "puppet": motions("puppets[size=tiny]"),
    }
    cells = [(motion, body) for motion in moved for body in moved]
    return {
        name: {cell: losses(method, on(*(moved[each] for each in cell))) for cell in cells}
        for name, method in tqdm(methods.items(), leave=False, disable=None)
    }


def table(found: Found) -> Iterator[str]:
    """Lines of Markdown."""
    cells = next(iter(found.values()))
    yield f"| method | {' | '.join(f'{motion} motion, {body} body' for motion, body in cells)} |"
    yield "|---|" + "---:|" * len(cells)
    for name, row in found.items():
        yield f"| {name.replace('_', chr(92) + '_')} | {' | '.join(map(shown, row.values()))} |"


def is_unseen(clip: str) -> bool:
    """True of a Mixamo clip by which nothing was chosen: not of fold 0."""
    return fold_of(clip) > 0


def motions(spec: str, taken: Callable[[str], bool] = lambda _: True) -> list[Motion]:
    """Motions of a data set on the bodies of people that do them, of clips drawn by their names' hash.

    taken: of a clip's name, whether it may be drawn.
    """
    data = registry.create("datasets", Spec.parse(spec))
    cast = data.characters()
    infos = {
        info.clip: info
        for info in data.cases("retarget", "cross")
        if taken(info.clip) and not cast[info.source].four_legged
    }
    chosen = sorted(infos, key=lambda clip: digest(clip, 16))[:MOTIONS]
    return [data.load(infos[clip]).source for clip in sorted(chosen)]


def on(moving: Sequence[Motion], standing: Sequence[Motion]) -> Iterator[Motion]:
    """The motions on the bodies of others, by turns; on their own where both are of one data set."""
    for number, motion in enumerate(moving):
        body = standing[number % len(standing)].character
        yield motion if moving is standing else carried(motion, body)


def carried(motion: Motion, body: Character) -> Motion:
    """A motion by copied rotations, the path scaled by the height of the hips."""
    return registry.create("methods", "copy_rotations").retarget(motion, body, context=Context(seed=0))


def losses(method: Method, questions: Iterable[Motion]) -> np.ndarray:
    """The error of every motion that the method answers for."""
    found = []
    metric = registry.create("metrics", "position")
    for number, motion in enumerate(questions):
        info = CaseInfo(f"own/{number}", "retarget", "self", "a", "a", str(number))
        case = Case(info, motion, motion.character, reference=motion)
        try:
            answer = method.retarget(motion, motion.character, context=Context(seed=0))
        except NotSupported:
            continue
        found.append(score([metric], case, answer).sound()[VALUE])
    return np.array(found)


def shown(numbers: np.ndarray) -> str:
    """The mean, with its interval where there are motions enough."""
    (interval,) = statistics.mean_intervals(numbers[None])
    ends = f" [{interval.low:.2f}, {interval.high:.2f}]" if interval else ""
    return f"{numbers.mean():.2f}{ends}" if len(numbers) else "refused"


if __name__ == "__main__":
    main()
