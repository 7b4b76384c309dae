"""``bench doctor`` without a file: the installation, as bug reports need it, and what is wrong with it."""

from __future__ import annotations

import importlib
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
MODULES = {"pillow": "PIL"}
"""Package -> its module, where that has another name."""
UNKNOWN = "not known: retarget-bench is not installed, but lies on the path"
PLUG_INS = 4
"""Most of those that do not work that are named: one package may break all."""
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
    """Extra ("": of none) -> its requirements; {} where this package is not installed but lies on the
    path."""
    packages: dict[str, list[str]] = {}
    with suppress(metadata.PackageNotFoundError):
        for text in metadata.requires("retarget-bench") or ():
            extra = re.search(r"extra == ['\"](\w+)", text)
            packages.setdefault(extra[1] if extra else "", []).append(text.partition(";")[0].strip())
    return packages


def _name(requirement: str) -> str:
    return re.split(r"[^\w.-]", requirement)[0]


def _packages() -> Look:
    needed = _requirements().get("", ())
    text = ", ".join(f"{_name(each)} {_version(_name(each)) or 'missing'}" for each in needed)
    return text or UNKNOWN, [problem for each in needed if (problem := _lacking(each))]


def _lacking(requirement: str) -> str:
    """What is wrong with a package that is needed, and its cure; "" if nothing is."""
    name, version = _name(requirement), _version(_name(requirement))
    if not version:
        return f"{name} is not installed: pip install {name}"
    from packaging.requirements import Requirement

    if not Requirement(requirement).specifier.contains(version, prereleases=True):
        return f"{name} {version} is not {requirement}: pip install '{requirement}'"
    try:
        importlib.import_module(MODULES.get(name, name))
    except Exception as error:
        return f"{name} cannot be imported ({one_line(error)}): pip install --force-reinstall {name}"
    return ""


def _extras() -> Look:
    if not (packages := _requirements()):
        return UNKNOWN, ()
    there = [
        extra for extra in EXTRAS if extra in packages and all(map(_version, map(_name, packages[extra])))
    ]
    absent = [f"{extra} ({use})" for extra, use in EXTRAS.items() if extra not in there]
    cure = f"; absent: {', '.join(absent)}; pip install 'retarget-bench[NAME]'" if absent else ""
    return f"{', '.join(there) or 'none'}{cure}", ()


def _plug_ins() -> Look:
    from retarget_bench.plugins import registry

    broken = {kind: registry.working(kind)[1] for kind in registry.KINDS}
    text = ", ".join(f"{len(registry.names(kind)) - len(broken[kind])} {kind}" for kind in broken)
    problems = [each for kind in broken for each in broken[kind]]
    cures = [f"{each}; mend or uninstall it, or what it needs" for each in problems[:PLUG_INS]]
    return text, [*cures, *([f"and {len(problems) - PLUG_INS} more"] if problems[PLUG_INS:] else [])]


def _weights() -> Look:
    """Shipped weights that are here, read whole and compared with the hashes of their cards."""
    from retarget_bench.plugins import registry
    from retarget_bench.training import released, weights
    from retarget_bench.training.tensor_files import arrays_of

    methods = [type(each) for each in registry.working("methods")[0].values()]
    cards = [card for each in methods if hasattr(each, "shipped") for card in each.shipped().values()]
    problems, here, later = [], 0, 0
    for card in cards:
        file = arrays_of(card)
        fetched = None if file.exists() else released.released(file)
        if fetched is not None and not fetched.copy.exists():
            later += 1
            continue
        here += 1
        if fetched is not None and not fetched.intact():
            problems.append(f"{fetched.copy} is damaged: remove it, and its next use fetches it again")
            continue
        try:
            weights.read(card)
        except BenchError as error:
            problems.append(f"{error}; they are shipped: install the package again")
    text = f"{here - len(problems)} of {here} shipped ones are as their cards say"
    return text + (f"; {later} more are fetched at their first use" if later else ""), problems


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
