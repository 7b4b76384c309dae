"""Default tables of reconstruction, denoising and joint completion."""

from collections.abc import Sequence

from retarget_bench.analysis import summary
from retarget_bench.analysis.breakdown import By
from retarget_bench.results.store import ResultPaths
from retarget_bench.tables import builder
from retarget_bench.tables.model import Table

COLUMNS = {
    "reconstruct": ("restored_cm", "jerk_ratio"),
    "denoise": ("restored_cm", "jerk_ratio"),
    "upsample": ("restored_cm", "restored_cm.missing"),
}
"""Task -> its default columns."""
BY: dict[str, By] = {"reconstruct": "structure", "denoise": "level", "upsample": "level"}
"""Task -> its default breakdown, since a mean over levels says little."""


def task_tables(places: Sequence[ResultPaths], task: str, by: By | None = None) -> list[Table]:
    """The tables of a task: by level or structure, or whatever else is asked for; of ``reconstruct`` also
    one over all structures."""
    whole = summary.split_summaries(places) if by is None and BY[task] == "structure" else []
    parts = summary.split_summaries(places, by or BY[task])
    return [
        *builder.tables(whole, _columns(whole, COLUMNS[task])),
        *builder.tables(parts, _columns(parts, COLUMNS[task][: 1 if whole else None]), by or BY[task]),
    ]


def _columns(found: Sequence[summary.SplitSummary], wanted: Sequence[str]) -> Sequence[str]:
    """Those that any result has; the default columns of all tables where none has."""
    there = {key for section in found for key in section.values}
    return tuple(key for key in wanted if key in there) or builder.DEFAULT_COLUMNS
