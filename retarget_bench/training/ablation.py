"""Ablations: the tables of a paper in which a method is trained again with one thing changed.

A method offers ``ablations``, a mapping from a short name to an ``Ablation``; ``bench ablate METHOD NAME``
trains every row and prints the table as it was published, the published numbers beside ours.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field

from retarget_bench.api import CROSS, INTRA
from retarget_bench.plugins.spec import Scalar


@dataclass(frozen=True)
class AblationColumn:
    """One column as printed.

    label, unit: its heading. value: the id of our value of the same meaning; "": there is none, and
    ``missing`` says why, as a sentence. Where the unit is ``m`` and the value's is per cent of the height,
    it is shown in metres.
    splits: of the cases that ours is a mean over.
    """

    label: str
    unit: str
    value: str = ""
    missing: str = ""
    splits: tuple[str, ...] = (INTRA, CROSS)


@dataclass(frozen=True)
class AblationRow:
    """One row as printed, or one that the paper does not have.

    parameters: of the method that the row trains. printed: label of a column -> the number as printed.
    """

    label: str
    parameters: Mapping[str, Scalar]
    printed: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Ablation:
    """A published table. paper: which. notes: sentences on the printed numbers, and on how ours differ."""

    title: str
    paper: str
    columns: tuple[AblationColumn, ...]
    rows: tuple[AblationRow, ...]
    notes: tuple[str, ...] = ()
