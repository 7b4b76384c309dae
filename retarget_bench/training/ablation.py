"""Ablations: the tables of a paper in which a method is trained again with one thing changed.

A method offers ``ablations``, a mapping from a short name to an ``Ablation``; ``bench ablate METHOD NAME``
trains every row and prints ours below the published numbers.
"""

from collections.abc import Mapping
from dataclasses import dataclass

from retarget_bench.plugins.spec import Scalar


@dataclass(frozen=True)
class Ablation:
    """The rows of an ablation, and where it is published.

    tables: names of the published tables that print its rows (``bench table --paper NAME``).
    rows: label, as printed where the paper has the row -> parameters of the method that it trains.
    notes: sentences on the printed numbers, and on how ours differ.
    """

    title: str
    tables: tuple[str, ...]
    rows: Mapping[str, Mapping[str, Scalar]]
    notes: tuple[str, ...] = ()
