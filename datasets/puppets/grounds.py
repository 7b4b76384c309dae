"""The floor of a case: flat, or with the performance's steps in the performer's own measure."""

from __future__ import annotations

from retarget_bench.api import Ground

from .bodies import Body
from .score import Score


def ground(score: Score, body: Body) -> Ground:
    """The floor under a body that performs the score."""
    del body
    del score
    return Ground(0.0)
