"""Options of ``bench retarget`` beside its files."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from retarget_bench import defaults
from retarget_bench.options import option
from retarget_bench.python.motions import RetargetOptions


@dataclass(frozen=True)
class Options(RetargetOptions):
    """``bench retarget``."""

    fps: float | None = option(
        None, "Frames per second.", shown="the source's; of scans 30", at_least=1, below=1001
    )
    format: str | None = option(
        None,
        "Of results in a folder: bvh, glb, ...",
        shown="the target's own, where it can be written",
        metavar="FORMAT",
    )
    jobs: int = option(
        defaults.jobs,
        "Number of processes.",
        shown=f"one per core, at most {defaults.MOST_JOBS}",
        letter="j",
        at_least=1,
        metavar="N",
    )
    overwrite: bool = option(
        False, "Redo results that are up to date, too, and replace the file of --report."
    )
    preview: Path | None = option(
        None,
        "Also draw source and result side by side: a clip (.mp4, .gif, .webp) or a sheet (.png). An ending "
        "alone, such as mp4, is for a file beside each result.",
        metavar="FILE",
    )
    report: Path | None = option(None, "Also write the verdict as JSON.", metavar="FILE")
    quiet: bool = option(False, "Print errors only.")
