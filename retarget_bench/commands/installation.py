"""``bench doctor`` without a file: the installation, as bug reports need it, and what is wrong with it."""

from __future__ import annotations

import os
import platform
import re
import shutil
import subprocess
import sys
import warnings
from collections.abc import Callable, Collection, Iterable
from contextlib import suppress
from importlib import metadata
from pathlib import Path
from tempfile import gettempdir
from typing import Any

import retarget_bench
from retarget_bench import defaults, files
from retarget_bench.errors import BenchError, one_line

EXTRAS = {
    "fbx": "FBX files",
    "mesh": "scans and penetration",
    "video": ".mp4 where there is no ffmpeg",
    "store": "Parquet, above 20,000 cases",
    "ray": "--executor ray",
    "slurm": "--executor slurm",
}
"""Extra -> its use."""
UNKNOWN = "not known: retarget-bench is not installed, but lies on the path"
ROOM = 2**30
"""Bytes that are free at least where files are written."""
Look = tuple[str, Collection[str]]
"""A fact, and sentences on what is wrong, each with its cure."""


def findings(over: Callable[[Collection[Any]], Iterable[Any]] = iter) -> dict[str, Look]:
    """What is looked at -> what is found; a look that breaks is a problem. over: shows how far it is."""
    found: dict[str, Look] = {}
    for name in over(LOOKS):
        try:
            found[name] = LOOKS[name]()
        except Exception as error:  # of an import, mostly
            found[name] = "cannot be looked at", [f"{name}: {one_line(error)}"]
    return found


# ---------------------------------------------------------------------------------------- what is installed
def _package() -> Look:
    from retarget_bench.evaluation import header_builder

    revision = header_builder.revision()
    kind = f"checkout at {revision}" if revision else "no git checkout"
    return f"{retarget_bench.__version__}, {Path(retarget_bench.__file__).parent} ({kind})", ()


def _version(package: str) -> str:
    with suppress(metadata.PackageNotFoundError):
        return metadata.version(package)
    return ""


def _requirements() -> dict[str, list[str]]:
    """Extra ("": of none) -> its packages; {} where this package is not installed but lies on the path."""
    packages: dict[str, list[str]] = {}
    with suppress(metadata.PackageNotFoundError):
        for text in metadata.requires("retarget-bench") or ():
            extra = re.search(r"extra == ['\"](\w+)", text)
            packages.setdefault(extra[1] if extra else "", []).append(re.split(r"[^\w.-]", text)[0])
    return packages


def _packages() -> Look:
    versions = {name: _version(name) for name in _requirements().get("", ())}
    text = ", ".join(f"{name} {version or 'missing'}" for name, version in versions.items())
    missing = [f"{name} is not installed: pip install {name}" for name in versions if not versions[name]]
    return text or UNKNOWN, missing


def _extras() -> Look:
    if not (packages := _requirements()):
        return UNKNOWN, ()
    there = [extra for extra in EXTRAS if extra in packages and all(map(_version, packages[extra]))]
    absent = [f"{extra} ({use})" for extra, use in EXTRAS.items() if extra not in there]
    cure = f"; absent: {', '.join(absent)}; pip install 'retarget-bench[NAME]'" if absent else ""
    return f"{', '.join(there) or 'none'}{cure}", ()


def _plug_ins() -> Look:
    from retarget_bench.plugins import registry

    broken = {kind: registry.working(kind)[1] for kind in registry.KINDS}
    text = ", ".join(f"{len(registry.names(kind)) - len(broken[kind])} {kind}" for kind in broken)
    return text, [f"{each}; mend or uninstall it" for kind in broken for each in broken[kind]]


def _weights() -> Look:
    """Shipped weights that are here, read whole and compared with the hashes of their cards."""
    from retarget_bench.plugins import registry
    from retarget_bench.training import released, weights
    from retarget_bench.training.tensor_files import arrays_of

    methods = [type(each) for each in registry.working("methods")[0].values()]
    cards = [card for each in methods if hasattr(each, "shipped") for card in each.shipped().values()]
    here = [card for card in cards if not released.to_fetch(arrays_of(card))]
    problems = []
    for card in here:
        try:
            weights.read(card)
        except BenchError as error:
            problems.append(f"{error}; they are shipped: install the package again")
    later = (
        f"; {len(cards) - len(here)} more are fetched at their first use" if len(here) < len(cards) else ""
    )
    return (
        f"{len(here) - len(problems)} of {len(here)} shipped ones are as their cards say{later}",
        problems,
    )


# ---------------------------------------------------------------------------------------------- the machine
def _threads() -> Look:
    import psutil
    import torch

    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    threads, jobs, memory = torch.get_num_threads(), defaults.jobs(), psutil.virtual_memory()
    text = (
        f"{cores} cores, {memory.total / 1e9:.0f} GB memory ({memory.available / 1e9:.0f} free); torch has "
        f"{threads} threads (OMP_NUM_THREADS {os.environ.get('OMP_NUM_THREADS', 'not set')}), runs take "
        f"{jobs} processes of one thread"
    )
    if threads > cores:
        text += "; threads beyond the cores wait for each other: lower OMP_NUM_THREADS"
    if (share := _quota()) < jobs:
        text += f"; this container may use {share:g} cores: give --jobs {max(1, int(share))}"
    return text, ()


def _quota() -> float:
    """Cores that the control group of this process may use at a time; infinity where nothing limits it."""
    with suppress(OSError, ValueError):
        most, period = Path("/sys/fs/cgroup/cpu.max").read_text(encoding="ascii").split()
        return int(most) / int(period)  # "max" is no number
    return float("inf")


def _gpu() -> Look:
    import torch

    build = f"built for {f'CUDA {torch.version.cuda}' if torch.version.cuda else 'CPUs alone'}"
    with warnings.catch_warnings(record=True) as warned:
        warnings.simplefilter("always")
        available = torch.cuda.is_available()
    if not available:
        unseen = "a GPU is there; torch, {}, does not see it (driver, CUDA_VISIBLE_DEVICES, pytorch.org)"
        there = any(Path("/dev").glob("nvidia[0-9]*"))
        problems = [str(each.message) for each in warned] or [unseen.format(build)] * there
        return f"none that torch sees, which is {build}", problems
    cards = [torch.cuda.get_device_properties(each) for each in range(torch.cuda.device_count())]
    text = ", ".join(f"{each.name} ({each.total_memory / 1e9:.0f} GB)" for each in cards)
    problems = []
    try:
        torch.ones(8, device="cuda").sum().item()
    except RuntimeError as error:
        problems = [f"the GPU does not compute: {one_line(error)}; train with --device cpu"]
    return f"{text}; torch is {build}", problems


def _processes() -> Look:
    """Starts the process that workers of methods are forked from, and bubblewrap where it is installed."""
    from retarget_bench.evaluation.prediction import launch
    from retarget_bench.evaluation.prediction.limits import Limits

    problems, bwrap = [], "not installed"
    try:
        server = launch.ForkServer((), launch.new_mark())
        try:
            server.ask({"state": 0})
        finally:
            server.close()
    except (OSError, AttributeError) as error:
        problems = [f"processes of methods cannot be started: {one_line(error)}; does a sandbox forbid it?"]
    if shutil.which("bwrap"):
        with files.scratch_folder() as folder:
            command = [*Limits(isolate="bwrap").prefix(folder), "true"]
            done = subprocess.run(command, capture_output=True, text=True, timeout=20, check=False)
        bwrap = f"does not start ({done.stderr.strip()[:80]})" if done.returncode else "works"
    forks = f"{'a' if hasattr(os, 'pidfd_open') else 'on this system no'} fork for every batch"
    return f"{'do not start' if problems else 'start'}, {forks}; bwrap (--isolate): {bwrap}", problems


def _place(folder: Path, cure: str) -> Look:
    """A folder that is written to, or will be made. cure: names another one."""
    from retarget_bench.evaluation.prediction.limits import size_of

    folder = folder.absolute()
    try:
        files.check_writable(folder / "file")
    except BenchError as error:
        return f"{folder}, not writable", [f"{error}; {cure}"]
    free = shutil.disk_usage(next(each for each in (folder, *folder.parents) if each.exists())).free
    used = "" if folder == Path(gettempdir()) else f"{size_of(folder) / 1e6:.0f} MB used, "
    there = f"writable, {used}" if folder.exists() else "to be made, "
    problem = f"{folder} has {free / 1e6:.0f} MB of room left; make room, or {cure}"
    return f"{folder}, {there}{free / 1e9:.0f} GB free", [problem] * (free < ROOM)


LOOKS: dict[str, Callable[[], Look]] = {
    "retarget-bench": _package,
    "Python": lambda: (f"{platform.python_version()}, {sys.executable}; {platform.platform()}", ()),
    "packages": _packages,
    "extras": _extras,
    "plug-ins": _plug_ins,
    "weights": _weights,
    "threads": _threads,
    "GPU": _gpu,
    "processes": _processes,
    "cache": lambda: _place(files.cache_folder(), "set RETARGET_BENCH_CACHE to another folder"),
    "results": lambda: _place(Path(defaults.OUT), "name another folder by --out, or start elsewhere"),
    "temporary": lambda: _place(Path(gettempdir()), "set TMPDIR to another folder"),
}
