"""Options of ``bench retarget``, in groups; those that say how files are read are in ``motion_files``."""

from __future__ import annotations

import click

from retarget_bench import defaults
from retarget_bench.commands import options

target_option = click.option(
    "--target",
    required=True,
    metavar="FILE",
    type=options.PATH,
    help="File of the target character; for scans its mesh in T-pose.",
)
out_option = click.option(
    "-o",
    "--out",
    required=True,
    metavar="FILE",
    type=options.PATH,
    help="Output file: .bvh or .glb; for scans a new folder, of PLY files.",
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
