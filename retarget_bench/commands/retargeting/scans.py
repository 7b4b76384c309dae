"""Retargeting of scans: a folder of meshes or points moves a mesh, into a folder of PLY files."""

from __future__ import annotations

from dataclasses import fields

from retarget_bench import defaults
from retarget_bench.commands import echo
from retarget_bench.commands.retargeting.job import Job
from retarget_bench.errors import BenchError
from retarget_bench.motion.editing.edits import Edits
from retarget_bench.motion.findings import counted_frames
from retarget_bench.motion.scans.importing import load_body, load_scan
from retarget_bench.python import scans
from retarget_bench.python.motions import ready
from retarget_bench.python.progress import progress_bar

_OF_MOTIONS = (*(each.name for each in fields(Edits)), "format", "preview", "report")
"""Options that scans cannot have."""


def retarget(job: Job) -> int:
    """One scan onto one mesh, into a new folder, with a summary. Raises BenchError."""
    options, source, target = job.options, job.source, job.target
    method, fps = options.method or defaults.SCAN_METHOD, options.fps or scans.FPS
    for each in fields(options):
        if each.name in _OF_MOTIONS and getattr(options, each.name) != each.default:
            flag = each.name.replace("_", "-")
            raise BenchError(f"--{flag} is for files with a skeleton; scans have no joints")
    for file in (source, target):
        if others := file.reading.stated.keys() - {"unit", "up"}:
            raise BenchError(
                f"{file.path}: a scan is read by its unit and up axis alone; it has no joints, and no "
                f"{min(others)}"
            )
    scans.check_folder(job.out)
    ready(method)
    body = load_body(target.path, target.reading)
    with progress_bar("reading", "files", not options.quiet) as progress:
        scan = load_scan(source.path, source.reading, fps=fps, progress=progress)
    for findings in (scan.findings, body.findings):
        for warning in () if options.quiet else findings.warnings:
            echo(f"{findings.path}: {warning}", err=True)
    moved = scans.answer(scan.motion, body.character, method, options.seed, scan.findings.frames)
    moved.save(job.out)
    if not options.quiet:
        for note in moved.notes:
            echo(f"{target.path}: {note}", err=True)
        echo(
            f"{job.out}: {counted_frames(moved.frames)} of {source.path.name} at {fps:g} per second on the "
            f"mesh of {target.path.name}, by {method}; {source.path.name}: {scans.facts(scan.findings)}; "
            f"{target.path.name}: {scans.facts(body.findings)}"
        )
    return 0
