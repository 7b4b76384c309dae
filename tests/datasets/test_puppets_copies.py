"""No two clips of the puppets' test are near copies of each other or of a training clip."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from functools import cache
from itertools import combinations, product

import numpy as np
import pytest

from retarget_bench.datasets.puppets.generator.corpus.clips import Clip, clips, training_clips
from retarget_bench.datasets.puppets.generator.corpus.families import bodies_of, families
from retarget_bench.datasets.puppets.generator.solver.solve import solve

pytestmark = pytest.mark.slow

EVERY = 3
"""Of the frames that are compared: ten a second."""

LEAST = 0.01
"""Of body height, 1.7 cm for a person: clips nearer than this would be near copies."""


@cache
def trajectory(clip: Clip) -> np.ndarray:
    """``(samples, 3 * joints)``: the clip by the first body of its family, from the root, turned to face
    one way, in shares of the body's height; so that neither place, heading nor build tells clips apart."""
    body = next(iter(clip.family.bodies.values()))
    solution = solve(clip.score(), body)
    places = body.positions(solution.orientations, solution.root)[::EVERY]
    from_root = places - places[:, :1]
    ahead = solution.orientations[::EVERY, 0, :, 2]
    yaw = np.arctan2(ahead[:, 0], ahead[:, 2])
    c, s = np.cos(yaw)[:, None], np.sin(yaw)[:, None]
    x, y, z = np.moveaxis(from_root, -1, 0)
    height = np.ptp(
        body.positions(np.tile(np.eye(3), (1, len(body.offsets), 1, 1)), np.zeros((1, 3)))[..., 1]
    )
    return np.stack([c * x - s * z, y, s * x + c * z], axis=-1).reshape(len(places), -1) / height


def distance(a: np.ndarray, b: np.ndarray) -> float:
    """Root mean square distance of joints, shares of height, at the shift in time at which it is least,
    among shifts that leave two thirds of the shorter clip beside the longer one."""
    squares = (a * a).sum(-1)[:, None] + (b * b).sum(-1) - 2.0 * a @ b.T
    rows, columns = squares.shape
    # sums along diagonals: read in rows that are one longer than written, what lies on one is one column
    width = columns + rows
    wide = np.zeros((rows, width))
    wide[:, :columns] = squares
    sums = np.concatenate([wide.ravel(), np.zeros(rows)]).reshape(rows, width + 1).sum(0)
    shift = np.arange(width + 1)
    shift = np.where(shift < columns, shift, shift - width - 1)
    beside = np.minimum(rows, columns - shift) - np.maximum(0, -shift)
    enough = beside >= 2 * min(rows, columns) // 3
    joints = a.shape[1] // 3
    return float(np.sqrt(np.maximum(sums[enough] / beside[enough] / joints, 0.0).min()))


def nearest(pairs: Iterable[tuple[Clip, Clip]]) -> tuple[float, str, str]:
    """The smallest distance and whose it is."""
    return min((distance(trajectory(a), trajectory(b)), a.name, b.name) for a, b in pairs)


def trained(size: str) -> Iterator[Clip]:
    for family in families():
        for body in bodies_of(family, "train"):
            yield from training_clips(size, body, 0)


def of_one_family(pairs: Iterable[tuple[Clip, Clip]]) -> Iterator[tuple[Clip, Clip]]:
    return ((a, b) for a, b in pairs if a.family is b.family)


def alike(pairs: Iterable[tuple[Clip, Clip]]) -> Iterator[tuple[Clip, Clip]]:
    """Pairs that might be copies: of one kind."""
    return ((a, b) for a, b in pairs if a.kind == b.kind)


def test_no_two_test_clips_are_near_copies() -> None:
    for size in ("tiny", "default"):
        least, first, second = nearest(of_one_family(combinations(clips(size, 0), 2)))
        assert least > LEAST, (first, second)


def test_no_test_clip_is_nearly_a_training_clip() -> None:
    """Every fifth training clip."""
    shown = list(trained("default"))[::5]
    least, first, second = nearest(alike(product(clips("default", 0), shown)))
    assert least > LEAST, (first, second)
