"""Options of ``bench retarget``, in groups; those that say how files are read are in ``motion_files``."""

from __future__ import annotations

import click

from retarget_bench import defaults
from retarget_bench.commands import options

target_option = click.option(
    "--target",
    "targets",
    required=True,
    multiple=True,
    metavar="FILE|FOLDER",
    type=options.PATH,
    help="File of the target character, or a folder of such files; may be repeated. For scans its mesh in "
    "T-pose.",
)
out_option = click.option(
    "-o",
    "--out",
    required=True,
    metavar="FILE|FOLDER",
    type=click.Path(),
    help="Output file, whose ending is its format; the folder of several results, or FOLDER/ of one; for "
    "scans a new folder of PLY files.",
)
method_option = click.option(
    "-m",
    "--method",
    default=None,
    show_default=f"{defaults.METHOD}; for scans {defaults.SCAN_METHOD}",
    metavar="METHOD",
    shell_complete=options.plugin_names("methods"),
    help="The method, with parameters in brackets.",
)
fps_option = click.option(
    "--fps",
    type=click.FloatRange(1, 1000),
    help="Frames per second. [default: the source's; of scans 30]",
)
quiet_option = click.option("--quiet", is_flag=True, help="Print errors only.")
folder_options = options.together(
    click.option(
        "--format",
        "ending",
        metavar="FORMAT",
        help="Of results in a folder: bvh, glb, ... [default: the target's own, where it can be written]",
    ),
    options.jobs_option,
    click.option(
        "--overwrite",
        is_flag=True,
        help="Redo results that are up to date, too, and replace role maps and the file of --report.",
    ),
)
"""Options of several results."""
look_options = options.together(
    click.option(
        "--preview",
        metavar="FILE",
        type=options.PATH,
        help="Also draw source and result side by side: a clip (.mp4, .gif, .webp) or a sheet (.png). An "
        "ending alone, such as mp4, is for a file beside each result.",
    ),
    click.option(
        "--report",
        metavar="FILE",
        type=options.FILE,
        help="Also write the verdict as JSON.",
    ),
    click.option(
        "--save-map",
        metavar="FILE",
        type=options.FILE,
        help="Also save what joints were taken for: FILE.toml for --roles, FILE.target.toml for "
        "--target-roles.",
    ),
)
"""Options of what is written beside results."""
