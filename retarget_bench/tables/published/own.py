"""Our rows of a published table: numbers by column, what they are means over, and of which variant."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from retarget_bench.api import optional
from retarget_bench.errors import BenchError
from retarget_bench.plugins import registry
from retarget_bench.plugins.spec import Spec
from retarget_bench.results.header import MethodInfo


@dataclass(frozen=True)
class Counts:
    """What a number is a mean over. Of sets: windows in each, clips, and structures of targets."""

    cases: int
    clips: int
    pairs: int


@dataclass(frozen=True)
class OwnCell:
    """Our number for a column: mean over clips of the mean per clip, and spread over cases.

    common: False where it is over other cases than the column's common ones, since the method answered
            fewer. note: what else is to be known of the number, or "".
    """

    value: float
    spread: float
    over: Counts
    common: bool = True
    note: str = ""


@dataclass(frozen=True)
class OwnRow:
    """One method: column -> cell, where it has any; reasons: why it has none.

    mark:    why a method is never compared, or "".
    variant: which variant of a published method it is, or "".
    beside:  the method whose cases it is on, where that is the row above; or "".
    """

    label: str
    mark: str
    cells: Mapping[str, OwnCell]
    reasons: Mapping[str, str] = field(default_factory=dict)
    variant: str = ""
    beside: str = ""


@dataclass(frozen=True)
class OwnRows:
    """Our rows on one data set and one group of bodies ("": not told apart), by name.

    common: column -> the cases that all compared rows are means over, where there are any.
    """

    dataset: str
    bodies: str
    rows: tuple[OwnRow, ...]
    common: Mapping[str, Counts]

    @property
    def where(self) -> str:
        """Data set and bodies, for a title."""
        return f"{self.dataset}: {self.bodies}" if self.bodies else self.dataset


def variant(method: MethodInfo) -> str:
    """Variant of a published method, by its card: ``as published``, ``ours: ...``, or of a method without a
    paper, what distinguishes it. "" where the label says it, or it is not installed.

    What parameters in the label set is not said again.
    """
    given = {name: value for name, value in method.parameters.items() if name != "weights"}
    try:
        card = optional.method_card(registry.create("methods", Spec(method.name, given)))
    except BenchError:
        return ""
    words = ", ".join(said for name, said in card.differs.items() if name not in given)
    if not card.paper:
        return words
    if any(given == each for each in card.published):
        return "as published"
    return f"ours: {words}" if words else "ours, with these settings" if given else "ours"
