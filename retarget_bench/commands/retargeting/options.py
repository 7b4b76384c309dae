"""Options of ``bench retarget`` beside its files."""

from __future__ import annotations

from pathlib import Path

from retarget_bench.options import Parallel, option
from retarget_bench.python.motions import RetargetOptions


class Options(RetargetOptions, Parallel):
    """``bench retarget``."""

    out: str = option(
        "Output file, whose ending is its format; the folder of several results, or FOLDER/ of one; for "
        "scans a new folder of PLY files.",
        letter="o",
        metavar="FILE|FOLDER",
    )
    fps: float | None = option(
        "Frames per second.", default=None, shown="the source's; of scans 30", at_least=1, below=1001
    )
    format: str | None = option(
        "Of results in a folder: bvh, glb, ...",
        default=None,
        shown="the target's own, where it can be written",
        metavar="FORMAT",
    )
    overwrite: bool = option(
        "Redo results that are up to date, too, and replace the file of --report.", default=False
    )
    preview: Path | None = option(
        "Also draw source and result side by side: a clip (.mp4, .gif, .webp) or a sheet (.png). An ending "
        "alone, such as mp4, is for a file beside each result.",
        default=None,
        metavar="FILE",
    )
    report: Path | None = option("Also write the verdict as JSON.", default=None, metavar="FILE")
    quiet: bool = option("Print errors only.", default=False)
