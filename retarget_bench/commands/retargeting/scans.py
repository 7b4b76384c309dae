"""Retargeting of scans: a folder of meshes or points moves a mesh, into a folder of PLY files."""

from __future__ import annotations

from retarget_bench import defaults
from retarget_bench.commands.editing_options import asked_edits
from retarget_bench.commands.retargeting.job import Job
from retarget_bench.commands.terminal import echo
from retarget_bench.errors import BenchError
from retarget_bench.motion.editing.edits import USUAL
from retarget_bench.motion.findings import counted_frames
from retarget_bench.motion.scans.importing import load_body, load_scan
from retarget_bench.python import scans
from retarget_bench.python.progress import progress_bar


def retarget(job: Job, quiet: bool) -> None:
    """Carry out a job of scans, and print the summary. Raises BenchError."""
    source, target, out, asked = job.source, job.target, job.out, job.options
    method, fps = job.method or defaults.SCAN_METHOD, job.fps or scans.FPS
    scans.check_folder(out)
    scans.ready(method)
    for side in ("", "target_"):
        unset = {"roles": None, "root_place": "auto", "inner_positions": "auto", "skeleton": None}
        unset["body_model"] = None
        if any(asked[side + name] != value for name, value in unset.items()):
            raise BenchError("roles and root places are of files with a skeleton; scans have no joints")
        if asked[f"{side}rate"] is not None:
            raise BenchError("--rate is of files that state one; the frames of scans are --fps per second")
    if asked_edits(asked) != USUAL:
        raise BenchError("start, path and hands are of files with a skeleton; scans have no joints")
    body = load_body(target, unit=asked["target_unit"], up=asked["target_up"])
    with progress_bar("reading", "files", not quiet) as progress:
        scan = load_scan(source, unit=asked["unit"], up=asked["up"], fps=fps, progress=progress)
    for findings, option in ((scan.findings, "--"), (body.findings, "--target-")):
        for warning in () if quiet else findings.warnings:
            echo(f"{findings.path}: {warning.replace('--', option)}", err=True)
    moved = scans.answer(scan.motion, body.character, method, job.seed, scan.findings.frames)
    moved.save(out)
    if not quiet:
        echo(
            f"{out}: {counted_frames(moved.frames)} of {source.name} at {fps:g} per second on the mesh of "
            f"{target.name}, by {method}; {source.name}: {scans.facts(scan.findings)}; "
            f"{target.name}: {scans.facts(body.findings)}"
        )
